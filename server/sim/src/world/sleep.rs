//! Sleeping and waking: bodies, their colliders and their potentials leave the lists that a tick walks, and come back.

use std::ops::Range;

use super::World;
use crate::collide::Bodies;
use crate::dof::{ABSENT, BodyId, Placed};
use crate::error::SimError;
use crate::island::Islands;
use crate::potential::Anchor;

impl World {
    /// Whether a body sleeps: it stays where it is and costs nothing until something wakes it, with all that fell asleep
    /// with it: a touch, a force, a change of what holds or drives it, or [`World::wake`].
    pub fn is_asleep(&self, id: BodyId) -> bool {
        self.bodies.get(id).is_some_and(|body| body.asleep.is_some())
    }

    /// Wakes a body and all that fell asleep with it.
    ///
    /// # Errors
    /// [`SimError::Gone`] for a body that is.
    pub fn wake(&mut self, id: BodyId) -> Result<(), SimError> {
        self.bodies.get_mut(id).ok_or(SimError::Gone { what: "the body" })?.rest.reset();
        self.rouse(id);
        Ok(())
    }

    /// Puts a body to sleep with its island of the last tick, where they are and however they move.
    ///
    /// # Errors
    /// [`SimError::Gone`] for a body that is.
    pub fn sleep(&mut self, id: BodyId) -> Result<(), SimError> {
        let body = self.bodies.get(id).ok_or(SimError::Gone { what: "the body" })?;
        if body.asleep.is_some() {
            return Ok(());
        }
        let island = if body.index == ABSENT { Islands::FREE } else { self.integrator.island_of(body.index) };
        let mut group: Vec<_> = self.integrator.members(island).filter(|&id| self.bodies.contains_key(id)).collect();
        if island == Islands::FREE {
            group.push(id);
        }
        self.lay_down(group);
        Ok(())
    }

    /// Wakes a body where it sleeps, and all that fell asleep with it.
    pub(super) fn rouse(&mut self, id: BodyId) {
        let Some(group) = self.bodies.get(id).and_then(|body| body.asleep) else { return };
        let group = self.sleepers.remove(group);
        for &id in &group {
            let body = &mut self.bodies[id];
            body.asleep = None;
            body.rest.reset();
        }
        self.awake.extend(&group);
        let Self { awake, bodies, .. } = self;
        awake.sort_by_key(|&id| bodies[id].serial);
        let hulls = self.colliders_of_all(&group);
        self.detector.wake(&hulls);
        self.potentials_are_sorted = false;
    }

    /// Wakes the bodies of a potential.
    pub(super) fn rouse_ends(&mut self, a: Anchor, b: Anchor) {
        [a, b].into_iter().filter_map(|anchor| anchor.body).for_each(|id| self.rouse(id));
    }

    /// Puts bodies to sleep.
    fn lay_down(&mut self, group: Vec<BodyId>) {
        let hulls = self.colliders_of_all(&group);
        let key = self.sleepers.add(group.clone());
        for id in group {
            let body = &mut self.bodies[id];
            body.asleep = Some(key);
            body.index = ABSENT;
            self.state.v_mut(body.slice).fill(0.0);
        }
        let Self { awake, bodies, .. } = self;
        awake.retain(|&id| bodies[id].asleep.is_none());
        let bodies = Bodies { bodies: &self.bodies, state: &self.state };
        self.detector.sleep(&hulls, bodies, &self.settings);
        self.potentials_are_sorted = false;
    }

    /// Puts to sleep what has been still for long enough.
    pub(super) fn settle(&mut self) {
        let Some(settings) = &self.settings.sleep else { return };
        let Self { awake, bodies, state, integrator, stillness, .. } = self;
        stillness.clear();
        stillness.resize(integrator.islands(), f64::INFINITY);
        let mut lone = Vec::new();
        for &id in awake.iter() {
            let body = &mut bodies[id];
            let still = body.watch(state, settings, self.settings.dt);
            if body.index == ABSENT {
                continue;
            }
            match stillness.get_mut(integrator.island_of(body.index) as usize) {
                Some(least) => *least = least.min(still),
                None if still >= settings.time => lone.push(id),
                None => {}
            }
        }
        let time = settings.time;
        for island in 0..self.stillness.len() {
            if self.stillness[island] >= time {
                let group = self.integrator.members(island as u32).collect();
                self.lay_down(group);
            }
        }
        lone.into_iter().for_each(|id| self.lay_down(vec![id]));
    }

    /// Looks which potentials take part, where bodies fell asleep or woke since.
    pub(super) fn sort_potentials(&mut self) {
        let Self { potentials, bodies, potentials_are_sorted, .. } = self;
        if !std::mem::replace(potentials_are_sorted, true) {
            potentials.sort(|id| bodies.get(id).is_some_and(|body| body.asleep.is_none()));
        }
    }

    /// Colliders of a body, in order of serial.
    pub(super) fn colliders_of(&self, id: BodyId) -> &[Placed] {
        &self.placed[self.collider_range(id)]
    }

    /// Where they are among those of all bodies.
    pub(super) fn collider_range(&self, id: BodyId) -> Range<usize> {
        let Some(body) = self.bodies.get(id) else { return 0..0 };
        // A body's first collider has its serial, and the others follow.
        let from = self.placed.partition_point(|placed| placed.serial < body.serial);
        let count = self.placed[from..].iter().take_while(|placed| placed.body == id).count();
        from..from + count
    }

    fn colliders_of_all(&self, group: &[BodyId]) -> Vec<Placed> {
        let mut all: Vec<_> = group.iter().flat_map(|&id| self.colliders_of(id)).copied().collect();
        all.sort_unstable_by_key(|placed| placed.serial);
        all
    }
}
