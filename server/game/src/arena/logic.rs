//! Stage 3: actors act, are lost and go; and how actors come, in stage 1.

use pita_sim::{BodyId, DVec3, SimError, World};

use super::{Arena, ArenaEvent};
use crate::actor::{Actor, WhenLost};
use crate::arena_file::{ACTORS_MAX, BoundsFile};
use crate::spawn::{self, Pose};
use crate::step::{EFFECTS_MAX, KindLogic, Other, Request, Step, next_free};

impl Arena {
    /// Lets every actor judge its collisions, sees to those who are lost, lets every actor act, in order of id, and does
    /// what they asked for.
    pub(crate) fn run_logic(&mut self) {
        self.logic.actors = self.actors.len();
        self.judge_collisions();
        self.find_lost();
        self.see_to_lost();
        self.look_around();
        self.step_actors();
        self.see_to_lost();
        self.grant_requests();
        self.keep_rounds();
    }

    /// Whom the world lost: an actor that left the bounds, or of which the engine took a body out of the world.
    fn find_lost(&mut self) {
        let Self { actors, world, bounds, lost, logic, .. } = self;
        let is_broken = |&body: &BodyId| world.position(body).is_none() || world.is_quarantined(body);
        for (&id, actor) in actors {
            let is_broken = actor.bodies().iter().any(is_broken);
            if is_broken || !is_inside(world, bounds, &**actor) {
                let expires = !is_broken && actor.when_lost() == WhenLost::Expire;
                *if expires { &mut logic.expired } else { &mut logic.lost } += 1;
                lost.push(id);
            }
        }
    }

    fn see_to_lost(&mut self) {
        let mut lost = std::mem::take(&mut self.lost);
        for id in lost.drain(..) {
            self.put_back(id);
        }
        self.lost = lost;
    }

    /// Puts an actor back to where it wants to be when it is lost, or takes it away.
    fn put_back(&mut self, id: u32) {
        let pose = match self.actors.get(&id).map(|actor| actor.when_lost()) {
            None => return,
            Some(WhenLost::Remove | WhenLost::Expire) => return self.remove(id),
            Some(WhenLost::Home(pose)) => pose,
            Some(WhenLost::Spawn) => self.free_spawn(id),
        };
        if let Some(actor) = self.actors.get_mut(&id) {
            // Homes and spawn points are checked when the arena is built: the engine has no reason to refuse one.
            let _refused = actor.place(&mut self.world, pose);
        }
    }

    /// What actors are told of each other.
    fn look_around(&mut self) {
        let Self { actors, world, others, .. } = self;
        others.clear();
        others.extend(actors.values().filter_map(|actor| {
            let (info, &body) = (actor.describe(), actor.bodies().first()?);
            let (position, velocity) = (world.position(body)?, world.velocity(body)?);
            Some(Other { id: info.id, kind: info.kind, slot: info.slot, body, position, velocity })
        }));
    }

    fn step_actors(&mut self) {
        let mut step = Step {
            world: &mut self.world,
            dt: self.dt,
            tick: self.ticks + 1,
            id: 0,
            others: &self.others,
            owners: &self.owners,
            next_actor: &mut self.next_actor,
            requests: &mut self.requests,
            arrivals: &mut self.arrivals,
            report: &mut self.logic,
        };
        self.logic_by_kind.values_mut().for_each(|logic| *logic = KindLogic::default());
        for (&id, actor) in &mut self.actors {
            let before = step.report.sporadic;
            step.id = id;
            if actor.step(&mut step).is_err() {
                step.report.lost += 1;
                self.lost.push(id);
            }
            let of_kind = self.logic_by_kind.entry(actor.describe().kind).or_default();
            of_kind.actors += 1;
            of_kind.sporadic += step.report.sporadic - before;
        }
    }

    /// Stage 1, after commands: builds the actors that were asked for in the last tick. They come before contacts are found:
    /// what came in stage 3 would move in stage 4 through whatever is in its way.
    pub(super) fn let_in_arrivals(&mut self) {
        let mut arrivals = std::mem::take(&mut self.arrivals);
        for (id, build) in arrivals.drain(..) {
            let is_added = self.build_actor(id, build).is_ok();
            self.logic.added += usize::from(is_added);
            self.logic.refused += usize::from(!is_added);
        }
        self.arrivals = arrivals;
    }

    fn grant_requests(&mut self) {
        let mut requests = std::mem::take(&mut self.requests);
        for request in requests.drain(..) {
            self.grant(request);
        }
        self.requests = requests;
    }

    fn grant(&mut self, request: Request) {
        let is_granted = match request {
            Request::Remove(id) => {
                let may_go = self.actors.get(&id).is_some_and(|actor| actor.describe().slot.is_none());
                if may_go {
                    self.remove(id);
                    self.logic.removed += 1;
                }
                may_go
            }
            Request::Tell { from, to, message } => {
                let told = self.actors.get_mut(&to).map(|actor| actor.hear(from, &message)).is_some();
                self.logic.messages += usize::from(told);
                told
            }
            Request::Respawn(id) => {
                self.put_back(id);
                true
            }
            Request::KnockedOut { actor, by } => {
                self.knock_out(actor, by);
                true
            }
            Request::Effect(effect) => {
                let is_one_of_few = self.logic.effects < EFFECTS_MAX;
                if is_one_of_few {
                    self.events.push(ArenaEvent::Effect(effect));
                    self.logic.effects += 1;
                }
                is_one_of_few
            }
        };
        self.logic.refused += usize::from(!is_granted);
    }

    /// An id that no actor has; nobody had it before, unless this run gave out four thousand million.
    pub(super) fn new_id(&mut self) -> u32 {
        next_free(&mut self.next_actor, |id| self.actors.contains_key(&id))
    }

    /// Adds an actor of a game's own: `build` is given the world, to add its bodies, and the actor's id.
    ///
    /// # Errors
    /// What `build` says, or that there are too many actors; nothing is added then.
    pub fn add_actor(
        &mut self,
        build: impl FnOnce(&mut World, u32) -> Result<Box<dyn Actor>, SimError>,
    ) -> Result<u32, SimError> {
        let id = self.new_id();
        self.build_actor(id, build)?;
        Ok(id)
    }

    fn build_actor(
        &mut self,
        id: u32,
        build: impl FnOnce(&mut World, u32) -> Result<Box<dyn Actor>, SimError>,
    ) -> Result<(), SimError> {
        if self.actors.len() >= ACTORS_MAX {
            return Err(SimError::Unusable { what: "an arena has at most 16384 actors" });
        }
        if self.actors.contains_key(&id) {
            return Err(SimError::Unusable { what: "its id is that of another actor" });
        }
        let actor = whole_or_nothing(&mut self.world, |world| build(world, id))?;
        self.add(actor);
        Ok(())
    }

    pub(super) fn add(&mut self, actor: Box<dyn Actor>) {
        let info = actor.describe().clone();
        self.owners.extend(actor.bodies().iter().map(|&body| (body, info.id)));
        self.actors.insert(info.id, actor);
        self.events.push(ArenaEvent::ActorAdded(info));
    }

    pub(super) fn remove(&mut self, id: u32) {
        let Some(mut actor) = self.actors.remove(&id) else { return };
        actor.leave(&mut self.world);
        for body in actor.bodies() {
            self.owners.remove(body);
            self.world.remove_body(*body);
        }
        if let Some(rounds) = &mut self.rounds {
            rounds.forget(id);
        }
        self.events.push(ArenaEvent::ActorRemoved(id));
    }

    /// Where there is room for actor `id`.
    pub(super) fn free_spawn(&self, id: u32) -> Pose {
        let others = self.actors.iter().filter(|(other, _)| **other != id);
        let places: Vec<DVec3> =
            others.filter_map(|(_, actor)| self.world.position(*actor.bodies().first()?)).collect();
        spawn::choose(&self.spawns, &places, self.bounds.max[1])
    }
}

/// What `build` adds. Where it is refused, no body stays behind that it had added before.
pub(super) fn whole_or_nothing<T>(
    world: &mut World,
    build: impl FnOnce(&mut World) -> Result<T, SimError>,
) -> Result<T, SimError> {
    let before = world.body_count();
    build(world).inspect_err(|_| {
        // Bodies are in the order in which they came.
        while let Some(&body) = world.bodies().get(before) {
            world.remove_body(body);
        }
    })
}

/// Whether an actor is within the bounds.
pub(super) fn is_inside(world: &World, bounds: &BoundsFile, actor: &dyn Actor) -> bool {
    actor.whereabouts().iter().all(|&body| world.position(body).is_none_or(|at| bounds.contains(at)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arena::{ArenaSettings, Command};

    #[test]
    fn ids_start_anew_after_the_last_and_nobody_is_given_another_ones() {
        let text = include_str!("../../../../configs/arenas/flat.toml");
        let mut arena = Arena::from_toml(text, &ArenaSettings { tick_hz: 30, threads: 1 }).unwrap();
        let mut enter = |slot| {
            arena.apply(Command::Enter { slot, name: "driver".to_owned() });
            arena.slots.get(&slot).copied()
        };
        assert_eq!([enter(0), enter(1)], [Some(0), Some(1)]);
        arena.next_actor = u32::MAX;
        let mut enter = |slot| {
            arena.apply(Command::Enter { slot, name: "driver".to_owned() });
            arena.slots.get(&slot).copied()
        };
        assert_eq!([enter(2), enter(3)], [Some(u32::MAX), Some(2)]);
        arena.run_logic();
        assert_eq!(arena.actors.len(), 4);
        assert!(arena.build_actor(2, |_, _| Err(SimError::Unusable { what: "it is not even tried" })).is_err());
    }
}
