//! The tick thread's side of inputs: what each player's controls are at this tick.
//!
//! Pure, and free of allocation: time is the number of the tick, seats are as many as slots.

use pita_game::{Command, Controls as GameControls};
use pita_protocol::message::{Controls, InputAck, buttons};

use crate::inputs::Arrival;
use crate::sessions::SessionId;

/// Seats of all slots.
pub struct Drivers {
    seats: Vec<Option<Seat>>,
    coast_after_ticks: u64,
}

struct Seat {
    epoch: u32,
    ack: InputAck,
    controls: Controls,
    /// Tick of the last arrival, or of taking the seat.
    heard_tick: u64,
}

impl Drivers {
    /// Empty seats for `slots`; who is silent for `coast_after_ticks` coasts.
    pub fn new(slots: u16, coast_after_ticks: u64) -> Self {
        Self { seats: (0..slots).map(|_| None).collect(), coast_after_ticks }
    }

    /// A player takes the seat of its slot at `tick`.
    pub fn enter(&mut self, id: SessionId, tick: u64) {
        if let Some(seat) = self.seats.get_mut(usize::from(id.slot)) {
            let (ack, controls) = (InputAck::default(), Controls::default());
            *seat = Some(Seat { epoch: id.epoch, ack, controls, heard_tick: tick });
        }
    }

    /// The seat is free again.
    pub fn leave(&mut self, slot: u16) {
        if let Some(seat) = self.seats.get_mut(usize::from(slot)) {
            *seat = None;
        }
    }

    /// An input collected at `tick`. The newest sequence wins; what belongs to another session is ignored. A press of
    /// reset holds until it is driven, also where a newer input of the same tick does not have it.
    pub fn hear(&mut self, arrival: &Arrival, tick: u64) {
        let Some(Some(seat)) = self.seats.get_mut(usize::from(arrival.id.slot)) else { return };
        if seat.epoch != arrival.id.epoch || arrival.sequence <= seat.ack.sequence {
            return;
        }
        let pressed = seat.controls.buttons & buttons::RESET;
        seat.controls = arrival.controls;
        seat.controls.buttons |= pressed;
        seat.ack = InputAck { sequence: arrival.sequence, tick };
        seat.heard_tick = tick;
    }

    /// Appends what every player drives at `tick`. Controls hold until the next input, but reset is pressed for one
    /// tick only, and whoever is silent for too long coasts.
    pub fn drive(&mut self, tick: u64, into: &mut Vec<Command>) {
        for (slot, seat) in (0u16..).zip(&mut self.seats) {
            let Some(seat) = seat else { continue };
            if tick.saturating_sub(seat.heard_tick) >= self.coast_after_ticks {
                seat.controls = Controls::default();
            }
            into.push(Command::Drive { slot, controls: to_game(&seat.controls) });
            seat.controls.buttons &= !buttons::RESET;
        }
    }

    /// Appends the acknowledgement of every player.
    pub fn acks(&self, into: &mut Vec<(SessionId, InputAck)>) {
        let seats = (0u16..).zip(&self.seats).filter_map(|(slot, seat)| Some((slot, seat.as_ref()?)));
        into.extend(seats.map(|(slot, seat)| (SessionId { slot, epoch: seat.epoch }, seat.ack)));
    }
}

fn to_game(controls: &Controls) -> GameControls {
    let pressed = |button| controls.buttons & button != 0;
    GameControls {
        throttle: controls.throttle.into(),
        brake: controls.brake.into(),
        steer: controls.steer.into(),
        reverse: pressed(buttons::REVERSE),
        handbrake: pressed(buttons::HANDBRAKE),
        reset: pressed(buttons::RESET),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: SessionId = SessionId { slot: 1, epoch: 7 };

    fn arrival(sequence: u32, throttle: f32, buttons: u16) -> Arrival {
        Arrival { id: ID, sequence, controls: Controls { throttle, buttons, ..Controls::default() } }
    }

    fn driven(drivers: &mut Drivers, tick: u64) -> (f64, bool) {
        let mut commands = Vec::new();
        drivers.drive(tick, &mut commands);
        match &commands[..] {
            [Command::Drive { slot: 1, controls }] => (controls.throttle, controls.reset),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_newest_input_holds_until_its_driver_has_been_silent_for_too_long() {
        let mut drivers = Drivers::new(2, 15);
        drivers.enter(ID, 100);
        assert_eq!(driven(&mut drivers, 100), (0.0, false));
        for arrival in [arrival(2, 0.5, 0), arrival(3, 1.0, 0), arrival(1, 0.25, 0)] {
            drivers.hear(&arrival, 101);
        }
        assert_eq!(driven(&mut drivers, 101), (1.0, false));
        assert_eq!(driven(&mut drivers, 115), (1.0, false));
        assert_eq!(driven(&mut drivers, 116), (0.0, false));
        let mut acks = Vec::new();
        drivers.acks(&mut acks);
        assert_eq!(acks, [(ID, InputAck { sequence: 3, tick: 101 })]);
    }

    #[test]
    fn reset_is_pressed_for_one_tick() {
        let mut drivers = Drivers::new(2, 15);
        drivers.enter(ID, 1);
        drivers.hear(&arrival(1, 0.0, buttons::RESET), 1);
        drivers.hear(&arrival(2, 0.5, 0), 1);
        assert_eq!(driven(&mut drivers, 1), (0.5, true));
        assert_eq!(driven(&mut drivers, 2), (0.5, false));
    }

    #[test]
    fn strangers_do_not_drive() {
        let mut drivers = Drivers::new(2, 15);
        drivers.hear(&arrival(1, 1.0, 0), 1);
        drivers.enter(ID, 1);
        for id in [SessionId { epoch: 6, ..ID }, SessionId { slot: 0, ..ID }, SessionId { slot: 9, ..ID }] {
            drivers.hear(&Arrival { id, ..arrival(5, 1.0, 0) }, 1);
        }
        assert_eq!(driven(&mut drivers, 1), (0.0, false));
        drivers.leave(ID.slot);
        let mut commands = Vec::new();
        drivers.drive(2, &mut commands);
        assert!(commands.is_empty());
    }
}
