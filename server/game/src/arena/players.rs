//! Players come, drive and leave.

use pita_sim::{SimError, World};

use super::{Arena, ArenaEvent, Command};
use crate::Actor;
use crate::driver::Driver;
use crate::spawn;
use crate::vehicle::{Identity, Vehicle};

impl Arena {
    pub(crate) fn apply(&mut self, command: Command) {
        match command {
            Command::Enter { slot, name } => self.enter(slot, name),
            Command::Leave { slot, reason } => self.leave(slot, reason),
            Command::Drive { slot, controls } => {
                if let Some(actor) = self.slots.get(&slot).and_then(|id| self.actors.get_mut(id)) {
                    actor.control(controls);
                }
            }
        }
    }

    fn enter(&mut self, slot: u16, name: String) {
        if slot >= self.max_players {
            let reason = format!("slot {slot} does not exist, there are {}", self.max_players);
            return self.events.push(ArenaEvent::Left { slot, reason });
        }
        self.leave(slot, "replaced".to_owned());
        let id = self.new_id();
        let pose = spawn::choose(&self.spawns, &self.positions_but(id));
        let identity = Identity { id, name: name.clone(), slot: Some(slot) };
        match Vehicle::add(&mut self.world, identity, self.vehicle.clone(), Driver::Player, pose) {
            Ok(vehicle) => {
                self.add(Box::new(vehicle));
                self.slots.insert(slot, id);
                self.events.push(ArenaEvent::Entered { slot, name });
            }
            Err(error) => self.events.push(ArenaEvent::Left { slot, reason: format!("no vehicle: {error}") }),
        }
    }

    fn leave(&mut self, slot: u16, reason: String) {
        let Some(id) = self.slots.remove(&slot) else { return };
        self.remove(id);
        self.events.push(ArenaEvent::Left { slot, reason });
    }

    /// An id that no actor of this run ever had.
    pub(super) fn new_id(&mut self) -> u32 {
        let id = self.next_actor;
        self.next_actor += 1;
        id
    }

    /// Adds an actor of a game's own: `build` is given the world, to add its bodies, and the actor's id.
    ///
    /// # Errors
    /// What `build` says; nothing is added then.
    pub fn add_actor(
        &mut self,
        build: impl FnOnce(&mut World, u32) -> Result<Box<dyn Actor>, SimError>,
    ) -> Result<u32, SimError> {
        let id = self.new_id();
        let actor = build(&mut self.world, id)?;
        self.add(actor);
        Ok(id)
    }

    pub(super) fn add(&mut self, actor: Box<dyn Actor>) {
        let info = actor.describe().clone();
        self.owners.extend(actor.bodies().iter().map(|&body| (body, info.id)));
        self.actors.insert(info.id, actor);
        self.events.push(ArenaEvent::ActorAdded(info));
    }

    fn remove(&mut self, id: u32) {
        let Some(actor) = self.actors.remove(&id) else { return };
        for &body in actor.bodies() {
            self.owners.remove(&body);
            self.world.remove_body(body);
        }
        self.events.push(ArenaEvent::ActorRemoved(id));
    }
}
