//! The thread that ticks.
//!
//! Owns the arena and its pace. It waits for its next tick and for nothing else: no lock, no network, no disk, no
//! logging; what it needs and what it leaves goes through the lock-free queues of [`Shared`]. Once warm it allocates
//! only for events.

use std::sync::Arc;
use std::time::Duration;

use pita_game::pipeline::{self, Ports, Stage};
use pita_game::{Arena, Command};
use pita_protocol::message::{TICK_RECORDS_MAX, TickRecord};

use crate::boarding::Boarding;
use crate::drivers::{Drivers, Now};
use crate::event_backlog::EventBacklog;
use crate::frame::{Frame, KindFigures, Totals};
use crate::pacer::Pacer;
use crate::shared::{Phase, Shared};
use crate::stopwatch::ThreadUse;

/// Ticks until the daemon has [ended](Phase::Ended).
pub fn run(mut arena: Arena, drivers: Drivers, mut pacer: Pacer, shared: Arc<Shared>) {
    let mut outside = Outside::new(drivers, shared);
    while outside.shared.phase() != Phase::Ended {
        let now_ns = outside.wait_until(pacer.due_ns());
        let begin = pacer.begin(now_ns);
        outside.begin_tick(begin.skipped, begin.late_ns, now_ns);
        if let Some(reload) = outside.shared.reloads.pop() {
            arena.schedule(reload);
        }
        pipeline::tick(&mut arena, &mut outside);
        pacer.end(outside.shared.clock.ns());
        outside.hand_over(&pacer);
    }
}

/// What the pipeline sees of the world outside.
struct Outside {
    shared: Arc<Shared>,
    drivers: Drivers,
    thread_use: ThreadUse,
    /// Ticks left out so far: the arena's count plus this is the number of a tick.
    skipped: u64,
    quarantined: u64,
    /// Of every kind that ever acted, in order of their names.
    kinds: Vec<KindFigures>,
    frames_missed: u64,
    frame: Option<Box<Frame>>,
    record: TickRecord,
    begun_ns: u64,
    /// Stage that runs, and since when, ns.
    stage: Option<(Stage, u64)>,
    /// What found no frame yet.
    events: EventBacklog,
    records: Vec<TickRecord>,
}

impl Outside {
    fn new(drivers: Drivers, shared: Arc<Shared>) -> Self {
        Self {
            shared,
            drivers,
            thread_use: ThreadUse::of_this_thread(),
            skipped: 0,
            quarantined: 0,
            kinds: Vec::new(),
            frames_missed: 0,
            frame: None,
            record: TickRecord::default(),
            begun_ns: 0,
            stage: None,
            events: EventBacklog::default(),
            records: Vec::with_capacity(16),
        }
    }

    /// Sleeps until `due_ns`; answers the time then, ns.
    fn wait_until(&mut self, due_ns: u64) -> u64 {
        loop {
            let now_ns = self.shared.clock.ns();
            if now_ns >= due_ns {
                return now_ns;
            }
            std::thread::sleep(Duration::from_nanos(due_ns - now_ns));
        }
    }

    fn begin_tick(&mut self, skipped: u64, late_ns: u64, now_ns: u64) {
        self.skipped += skipped;
        self.begun_ns = now_ns;
        self.record = TickRecord { late_us: us(late_ns), ..TickRecord::default() };
        // Waking up is no part of the tick.
        self.thread_use.lap_ns();
    }

    /// After the tick: completes its record and hands the frame to the publishing thread.
    fn hand_over(&mut self, pacer: &Pacer) {
        let (cpu_ns, wait_ns) = self.thread_use.lap_ns();
        self.record.cpu_us = us(cpu_ns);
        self.record.wait_us = us(wait_ns);
        if self.records.len() < TICK_RECORDS_MAX {
            self.records.push(self.record);
        }
        let Some(mut frame) = self.frame.take() else { return };
        self.events.hand_over(&mut frame.events);
        frame.records.append(&mut self.records);
        frame.totals = Totals {
            overruns: pacer.overruns(),
            skipped_ticks: pacer.skipped(),
            given_up_ns: pacer.given_up_ns(),
            quarantined: self.quarantined,
            frames_missed: self.frames_missed,
            events_dropped: self.events.dropped(),
            inputs: self.drivers.counts(),
        };
        self.shared.frames.put_filled(frame);
        self.shared.wake_publisher();
    }

    /// Closes the stage that runs, at `now_ns`.
    fn close_stage(&mut self, now_ns: u64) {
        if let Some((stage, since_ns)) = self.stage.take() {
            self.record.stage_us[stage as usize] = us(now_ns.saturating_sub(since_ns));
        }
    }

    fn take_boarding(&mut self, tick: u64, into: &mut Vec<Command>) {
        for _ in 0..self.shared.boarding.capacity() {
            match self.shared.boarding.pop() {
                Some(Boarding::Enter { id, name }) => {
                    self.drivers.enter(id, tick);
                    into.push(Command::Enter { slot: id.slot, name });
                }
                Some(Boarding::Resume { from, to }) => self.drivers.resume(from, to, tick),
                Some(Boarding::Leave { slot, reason }) => {
                    self.drivers.leave(slot);
                    into.push(Command::Leave { slot, reason });
                }
                None => break,
            }
        }
    }

    fn measure(&mut self, arena: &Arena) {
        let report = arena.world().report();
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        self.quarantined += report.quarantined as u64;
        self.record.tick = arena.tick() + self.skipped;
        self.record.bodies = count(report.bodies);
        self.record.dof_awake = count(report.dof);
        self.record.contacts = count(report.contacts);
        self.record.newton_iterations = count(report.iterations);
        self.record.linear_iterations = count(report.linear_iterations);
        self.record.actors = count(arena.logic().actors);
        self.record.sporadic = count(arena.logic().sporadic);
        self.count_logic(arena);
    }

    fn count_logic(&mut self, arena: &Arena) {
        for (kind, logic) in arena.logic_by_kind() {
            let place = self.kinds.binary_search_by_key(&kind, |figures| figures.kind).unwrap_or_else(|place| {
                self.kinds.insert(place, KindFigures { kind, actors: 0, sporadic: 0 });
                place
            });
            let figures = &mut self.kinds[place];
            figures.actors = u32::try_from(logic.actors).unwrap_or(u32::MAX);
            figures.sporadic += logic.sporadic as u64;
        }
    }
}

impl Ports for Outside {
    fn begin(&mut self, stage: Stage) {
        let now_ns = self.shared.clock.ns();
        self.close_stage(now_ns);
        self.stage = Some((stage, now_ns));
    }

    fn collect(&mut self, tick: u64, into: &mut Vec<Command>) {
        let tick = tick + self.skipped;
        self.take_boarding(tick, into);
        let Self { shared, drivers, .. } = self;
        let now = Now { tick, ns: shared.clock.ns() };
        shared.inputs.collect(tick, |arrival| drivers.hear(&arrival, now));
        self.drivers.drive(now, into);
    }

    fn output(&mut self, arena: &Arena) {
        self.measure(arena);
        self.events.extend(arena.events());
        self.frame = self.shared.frames.take_free();
        match &mut self.frame {
            Some(frame) => {
                frame.tick = self.record.tick;
                frame.kinds.clone_from(&self.kinds);
                frame.copy_state(arena.world(), arena.relevant_actors());
                self.drivers.acks(&mut frame.acks);
                frame.input_waits_us.extend_from_slice(self.drivers.waits_us());
            }
            None => self.frames_missed += 1,
        }
    }

    fn end(&mut self) {
        let now_ns = self.shared.clock.ns();
        self.close_stage(now_ns);
        self.record.wall_us = us(now_ns.saturating_sub(self.begun_ns));
    }
}

/// Whole microseconds.
fn us(ns: u64) -> u32 {
    u32::try_from(ns / 1000).unwrap_or(u32::MAX)
}
