//! The tick thread's side of inputs: what each player's controls are at this tick, and what became of each input.
//!
//! An input waits here for the tick that it is meant for. One that is late is applied at the next tick, unless a newer
//! one is; one that is too early is refused. Pure, and free of allocation once warm: time comes in, seats are as many
//! as slots.

use pita_game::{Command, Controls as GameControls};
use pita_protocol::message::{Controls, FATES_MAX, InputAck, InputCounts, InputFate, InputFrame, buttons};

use crate::inputs::Arrival;
use crate::sessions::SessionId;

/// Inputs that wait for their tick, of one player; more than [`EARLY_MAX_TICKS`], for those who send several a tick.
const WAITING_MAX: usize = 32;
/// An input may be meant for so many ticks ahead of the coming one: a lead of half a second and more is no connection to
/// drive over.
const EARLY_MAX_TICKS: u64 = 24;

/// Seats of all slots.
pub struct Drivers {
    seats: Vec<Option<Seat>>,
    coast_after_ticks: u64,
    period_ns: u64,
    counts: InputCounts,
    /// How long each input applied at this tick had waited, µs.
    waits_us: Vec<u32>,
}

struct Seat {
    epoch: u32,
    ack: InputAck,
    controls: Controls,
    /// For ticks to come, in order of arrival.
    waiting: Vec<Arrival>,
    /// Newest sequence that was refused as early.
    early: u32,
    /// Reset was pressed in an input that was not driven; it holds until something is.
    reset_pressed: bool,
    /// Tick of the last arrival, or of taking the seat.
    heard_tick: u64,
}

/// The tick that collects inputs.
#[derive(Clone, Copy, Debug)]
pub struct Now {
    /// Its number.
    pub tick: u64,
    /// When it collects, ns of the daemon's clock.
    pub ns: u64,
}

impl Drivers {
    /// Empty seats for `slots`; who is silent for `coast_after_ticks` coasts. A tick is `period_ns` long.
    pub fn new(slots: u16, coast_after_ticks: u64, period_ns: u64) -> Self {
        let seats = (0..slots).map(|_| None).collect();
        Self { seats, coast_after_ticks, period_ns, counts: InputCounts::default(), waits_us: Vec::new() }
    }

    /// A player takes the seat of its slot at `tick`.
    pub fn enter(&mut self, id: SessionId, tick: u64) {
        if let Some(seat) = self.seats.get_mut(usize::from(id.slot)) {
            *seat = Some(Seat {
                epoch: id.epoch,
                ack: InputAck::default(),
                controls: Controls::default(),
                waiting: Vec::with_capacity(WAITING_MAX),
                early: 0,
                reset_pressed: false,
                heard_tick: tick,
            });
        }
    }

    /// The player of `from` drives on as `to`, whose inputs count from 1 again.
    pub fn resume(&mut self, from: SessionId, to: SessionId, tick: u64) {
        let is_seated = |seat: &&mut Seat| seat.epoch == from.epoch;
        if self.seats.get_mut(usize::from(from.slot)).and_then(Option::as_mut).as_ref().is_some_and(is_seated) {
            self.enter(to, tick);
        }
    }

    /// The seat is free again.
    pub fn leave(&mut self, slot: u16) {
        if let Some(seat) = self.seats.get_mut(usize::from(slot)) {
            *seat = None;
        }
    }

    /// An input collected at `now`; what belongs to another session is ignored.
    pub fn hear(&mut self, arrival: &Arrival, now: Now) {
        let Some(Some(seat)) = self.seats.get_mut(usize::from(arrival.id.slot)) else { return };
        if seat.epoch != arrival.id.epoch {
            return;
        }
        seat.heard_tick = now.tick;
        seat.note_slack(arrival, now, self.period_ns);
        let frame = &arrival.frame;
        if frame.tick > now.tick.saturating_add(EARLY_MAX_TICKS) || seat.waiting.len() == WAITING_MAX {
            seat.early = seat.early.max(frame.sequence);
            self.counts.early += 1;
        } else if frame.sequence <= seat.ack.sequence {
            seat.pass_over(frame, &mut self.counts);
        } else {
            seat.waiting.push(*arrival);
        }
    }

    /// Appends what every player drives at `now`. Controls hold until the next input, but reset is pressed for one
    /// tick only, and whoever is silent for too long coasts.
    pub fn drive(&mut self, now: Now, into: &mut Vec<Command>) {
        let Self { seats, counts, waits_us, .. } = self;
        waits_us.clear();
        for (slot, seat) in (0u16..).zip(seats) {
            let Some(seat) = seat else { continue };
            if let Some(applied) = seat.apply_due(now, counts) {
                let wait_us = now.ns.saturating_sub(applied.at_ns) / 1000;
                waits_us.push(u32::try_from(wait_us).unwrap_or(u32::MAX));
            }
            if now.tick.saturating_sub(seat.heard_tick) >= self.coast_after_ticks {
                seat.controls = Controls::default();
            }
            let Controls { throttle, brake, steer, buttons: held } = seat.controls;
            let mut controls = GameControls::of([throttle, brake, steer], held);
            controls.reset |= std::mem::take(&mut seat.reset_pressed);
            into.push(Command::Drive { slot, controls });
            seat.controls.buttons &= !buttons::RESET;
        }
    }

    /// Appends the acknowledgement of every player.
    pub fn acks(&self, into: &mut Vec<(SessionId, InputAck)>) {
        let seats = (0u16..).zip(&self.seats).filter_map(|(slot, seat)| Some((slot, seat.as_ref()?)));
        into.extend(seats.map(|(slot, seat)| (SessionId { slot, epoch: seat.epoch }, seat.ack)));
    }

    /// What became of all inputs so far.
    pub fn counts(&self) -> InputCounts {
        self.counts
    }

    /// From arrival to the tick, of each input that the last tick applied, µs.
    pub fn waits_us(&self) -> &[u32] {
        &self.waits_us
    }
}

impl Seat {
    /// Measures how early the newest input came.
    fn note_slack(&mut self, arrival: &Arrival, now: Now, period_ns: u64) {
        if arrival.frame.sequence <= self.ack.received {
            return;
        }
        // Ticks apart times period fits: what is further ahead or behind than a year is clamped.
        let ticks = i128::from(arrival.frame.tick) - i128::from(now.tick);
        let waited_ns = i128::from(now.ns.saturating_sub(arrival.at_ns));
        let slack_ms = (ticks * i128::from(period_ns) + waited_ns) / 1_000_000;
        self.ack.received = arrival.frame.sequence;
        self.ack.slack_ms = slack_ms.clamp(i16::MIN.into(), i16::MAX.into()) as i16;
    }

    /// Applies the newest of the inputs whose tick has come; the others are passed over.
    fn apply_due(&mut self, now: Now, counts: &mut InputCounts) -> Option<Arrival> {
        let is_due = |arrival: &&Arrival| arrival.frame.tick <= now.tick;
        let newest = *self.waiting.iter().filter(is_due).max_by_key(|arrival| arrival.frame.sequence)?;
        self.acknowledge(&newest, now.tick, counts);
        for at in (0..self.waiting.len()).rev() {
            // Those that are due, and those meant for later although they were sent before.
            if self.waiting[at].frame.sequence <= newest.frame.sequence {
                let passed = self.waiting.swap_remove(at).frame;
                if passed.sequence != newest.frame.sequence {
                    self.pass_over(&passed, counts);
                }
            }
        }
        self.controls = newest.frame.controls;
        Some(newest)
    }

    fn acknowledge(&mut self, applied: &Arrival, tick: u64, counts: &mut InputCounts) {
        let (before, sequence) = (self.ack.sequence, applied.frame.sequence);
        let late_ticks = tick - applied.frame.tick;
        self.ack.fates.advance((sequence - before) as usize);
        self.ack.fates.set(0, InputFate::Applied { late_ticks: u8::try_from(late_ticks).unwrap_or(u8::MAX) });
        // Only as far as fates reach: the client chooses how far its sequence jumps.
        for behind in 1..(sequence - before).min(FATES_MAX as u32) {
            match sequence - behind <= self.early {
                true => self.ack.fates.set(behind as usize, InputFate::Early),
                false => counts.missing += 1,
            }
        }
        (self.ack.sequence, self.ack.tick) = (sequence, tick);
        match late_ticks {
            0 => counts.in_time += 1,
            _ => counts.late += 1,
        }
    }

    /// An input that is not newer than the one applied. It was thought missing; now it is known to have come.
    fn pass_over(&mut self, frame: &InputFrame, counts: &mut InputCounts) {
        let behind = (self.ack.sequence - frame.sequence) as usize;
        if self.ack.fates.get(behind) == Some(InputFate::Missing) {
            counts.missing = counts.missing.saturating_sub(1);
        }
        self.ack.fates.set(behind, InputFate::Superseded);
        self.reset_pressed |= frame.controls.holds(buttons::RESET);
        counts.superseded += 1;
    }
}

#[cfg(test)]
mod tests;
