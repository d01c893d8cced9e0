//! Players come, drive and leave.

use super::{Arena, ArenaEvent, Command};
use crate::driver::Driver;
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
        let pose = self.free_spawn(id);
        let identity = Identity { id, name: name.clone(), slot: Some(slot) };
        match Vehicle::add(&mut self.world, identity, self.vehicle.clone(), Driver::Player, pose) {
            Ok(vehicle) => {
                let vehicle = self.armed(vehicle);
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
}
