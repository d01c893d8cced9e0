//! Rounds of combat: points for knock-outs, a winner, a pause, and everybody starts anew.
//!
//! Owns the score. Who is knocked out is the vehicles' to say, [`combat::fighter`](crate::combat::fighter).

use std::collections::BTreeMap;

use super::{Arena, ArenaEvent};
use crate::combat::parameters::RoundParameters;
use crate::step::Message;
use crate::vehicle::Vehicle;

/// The round that is on, and its score.
#[derive(Clone, Debug)]
pub struct Rounds {
    parameters: RoundParameters,
    number: u32,
    /// Between two rounds nobody scores.
    is_on: bool,
    /// Until it ends, or the next begins, s.
    left: f64,
    /// Points by actor.
    points: BTreeMap<u32, u32>,
}

impl Rounds {
    /// The first round begins.
    pub(super) fn new(parameters: RoundParameters) -> Self {
        let left = parameters.time;
        Self { parameters, number: 1, is_on: true, left, points: BTreeMap::new() }
    }

    /// Counts rounds, from 1.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Whether it is on, or over and the next one has not begun.
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Until it ends, or the next one begins, s.
    pub fn time_left(&self) -> f64 {
        self.left
    }

    /// Points of everybody who has some, by id of the actor.
    pub fn points(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.points.iter().map(|(&actor, &points)| (actor, points))
    }

    /// Who has most points, the first of equals; nobody without points.
    pub fn leader(&self) -> Option<u32> {
        let best = self.points.iter().rev().max_by_key(|(_, points)| **points);
        best.map(|(&actor, _)| actor)
    }

    /// A point for `by`; answers how many it has then. Nobody scores by himself or between rounds.
    fn score(&mut self, victim: u32, by: Option<u32>) -> Option<(u32, u32)> {
        let by = by.filter(|&by| by != victim && self.is_on)?;
        let points = self.points.entry(by).or_default();
        *points += 1;
        Some((by, *points))
    }

    /// Who is gone takes his points along.
    pub(super) fn forget(&mut self, actor: u32) {
        self.points.remove(&actor);
    }

    fn is_over(&self) -> bool {
        self.left <= 0.0 || self.points.values().any(|&points| points >= self.parameters.points)
    }
}

impl Arena {
    /// A vehicle as the arena's rules have it.
    pub(super) fn armed(&self, vehicle: Vehicle) -> Vehicle {
        vehicle.in_combat(self.combat.clone(), self.rounds.as_ref().is_some_and(Rounds::is_on))
    }

    /// Somebody is knocked out, by whom is the merit of nobody who is gone.
    pub(super) fn knock_out(&mut self, actor: u32, by: Option<u32>) {
        // A weapon may outlive who fired it.
        let by = by.filter(|by| self.actors.contains_key(by));
        self.events.push(ArenaEvent::KnockedOut { actor, by });
        if let Some((actor, points)) = self.rounds.as_mut().and_then(|rounds| rounds.score(actor, by)) {
            self.events.push(ArenaEvent::Scored { actor, points });
        }
    }

    /// Ends the round that is over, and begins the next after the pause.
    pub(super) fn keep_rounds(&mut self) {
        let Some(rounds) = &mut self.rounds else { return };
        rounds.left -= self.dt;
        if rounds.is_on && rounds.is_over() {
            (rounds.is_on, rounds.left) = (false, rounds.parameters.pause);
            let (number, winner) = (rounds.number, rounds.leader());
            self.events.push(ArenaEvent::RoundEnded { number, winner });
            self.tell_all(Message::RoundEnded);
        } else if !rounds.is_on && rounds.left <= 0.0 {
            (rounds.is_on, rounds.left) = (true, rounds.parameters.time);
            rounds.number += 1;
            rounds.points.clear();
            self.events.push(ArenaEvent::RoundBegan { number: rounds.number });
            self.tell_all(Message::RoundBegan);
        }
    }

    fn tell_all(&mut self, message: Message) {
        self.actors.iter_mut().for_each(|(&id, actor)| actor.hear(id, &message));
    }
}
