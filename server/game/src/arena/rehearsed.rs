//! What a [rehearsal](crate::rehearsal) needs of an arena: one without actors, and a player's car to be read and set.

use super::{Arena, ArenaSettings};
use crate::arena_file::{ArenaError, ArenaFile};
use crate::kinds::ActorKinds;
use crate::rehearsal::{BodyState, Memory};

impl Arena {
    /// The arena that `text` describes, without actors, drivers and combat, its meshes read by `read`.
    pub(crate) fn without_actors(
        text: &str,
        settings: &ArenaSettings,
        read: impl Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Self, ArenaError> {
        let mut file = ArenaFile::parse(text)?;
        file.read_meshes(read)?;
        file.actors.clear();
        file.drivers.clear();
        (file.ai, file.combat) = (None, None);
        // It is no part of the motion.
        file.vehicle.squash.strength = 0.0;
        Self::from_file(&file, settings, &ActorKinds::none())
    }

    /// Bodies and memory of the actor of `slot`; nothing where there is none.
    pub(crate) fn rehearsed(&self, slot: u16) -> (Vec<BodyState>, Memory) {
        let Some(actor) = self.slots.get(&slot).and_then(|id| self.actors.get(id)) else { return Default::default() };
        let state = |&body| {
            Some(BodyState {
                position: self.world.position(body)?,
                rotation: self.world.rotation(body)?,
                velocity: self.world.velocity(body)?,
                angular_velocity: self.world.angular_velocity(body)?,
            })
        };
        (actor.bodies().iter().filter_map(state).collect(), actor.memory())
    }

    /// Sets them; answers whether the engine took all.
    pub(crate) fn set_rehearsed(&mut self, slot: u16, bodies: &[BodyState], memory: &Memory) -> bool {
        let Self { world, actors, slots, .. } = self;
        let Some(actor) = slots.get(&slot).and_then(|id| actors.get_mut(id)) else { return false };
        actor.recall(memory);
        let ids = actor.bodies();
        ids.len() == bodies.len()
            && ids.iter().zip(bodies).all(|(&id, state)| {
                world.set_pose(id, state.position, state.rotation).is_ok()
                    && world.set_velocity(id, state.velocity, state.angular_velocity).is_ok()
            })
    }
}
