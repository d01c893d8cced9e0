//! One bot at work: sends each input when it is due until it is stopped or its session ends.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use glam::Vec3;
use pita_protocol::message::Controls;
use tokio::{
    sync::watch,
    time::{Instant, sleep_until},
};

use super::{Script, View, recovery::Recovery, watcher::Watcher};
use crate::{
    ClientError, Session, SessionEnd,
    lock::lock,
    statistics::{Durations, durations},
};

/// A car cannot drive so far between two snapshots that its bot sees, m: it was put somewhere else.
const DRIVEN_AT_ONCE_MAX: f32 = 10.0;

/// What a bot measures about itself.
#[derive(Debug)]
pub struct Meter {
    /// Path of the car's root body, m.
    pub distance_m: f64,
    /// From when an input was due to when it was sent, µs.
    pub lateness_us: Durations,
    /// Inputs that were left out because they were late by a whole tick or more.
    pub inputs_skipped: u64,
    /// As [`BotTally::jumps_um`](super::BotTally::jumps_um).
    pub jumps_um: Durations,
    /// Why the bot's session ended before it was stopped.
    pub lost: Option<SessionEnd>,
}

impl Meter {
    /// Of a bot that has not driven yet.
    pub fn new() -> Self {
        Self { distance_m: 0.0, lateness_us: durations(), inputs_skipped: 0, jumps_um: durations(), lost: None }
    }
}

/// A session, what drives it, and where it has got to.
pub struct Driver {
    session: Session,
    actor: u32,
    script: Box<dyn Script>,
    recovery: Recovery,
    meter: Arc<Mutex<Meter>>,
    last: Option<Vec3>,
    watcher: Watcher,
}

impl Driver {
    /// Drives `session`, whose own car is `actor`.
    pub fn new(session: Session, actor: u32, script: Box<dyn Script>, meter: Arc<Mutex<Meter>>) -> Self {
        Self { session, actor, script, recovery: Recovery::default(), meter, last: None, watcher: Watcher::default() }
    }

    /// Drives until `stop` turns true or the session ends; leaves in either case.
    pub async fn run(mut self, mut stop: watch::Receiver<bool>) {
        let period = Duration::from_secs_f64(1.0 / f64::from(self.session.tick_hz()));
        loop {
            let due = Instant::from_std(self.session.next_input_due());
            tokio::select! {
                biased;
                // An error means that the fleet is gone, which stops its bots too.
                _ = stop.wait_for(|&stop| stop) => break,
                () = sleep_until(due) => {}
            }
            self.note_lateness(due, period);
            let controls = self.controls();
            self.watch();
            match self.session.send(controls).await {
                Ok(_) => {}
                Err(ClientError::Ended(end)) => {
                    lock(&self.meter).lost = Some(end);
                    break;
                }
                Err(error) => tracing::warn!("bot in slot {}: {error}", self.session.slot()),
            }
        }
        self.session.leave().await;
    }

    /// Records how late an input is: those that are late by whole ticks are left out.
    fn note_lateness(&self, due: Instant, period: Duration) {
        let late = due.elapsed();
        let skipped = (late.as_nanos() / period.as_nanos().max(1)).min(u128::from(u32::MAX)) as u32;
        let mut meter = lock(&self.meter);
        meter.lateness_us.saturating_record(u64::try_from(late.as_micros()).unwrap_or(u64::MAX));
        meter.inputs_skipped += u64::from(skipped);
    }

    /// Neutral while there is nothing to see.
    fn controls(&mut self) -> Controls {
        let Some(snapshot) = self.session.latest_snapshot() else { return Controls::default() };
        let roster = self.session.roster();
        let Some(view) = View::of(&snapshot, &roster, self.actor) else { return Controls::default() };
        self.measure(view.own.position);
        let wanted = self.script.drive(&view, snapshot.tick());
        self.recovery.drive(&view.own, wanted)
    }

    /// Looks at the other cars, where the session shows them.
    fn watch(&mut self) {
        let now = std::time::Instant::now();
        let Some(world) = self.session.world_at(now) else { return };
        let jumps = self.watcher.look(&world, &self.session.roster(), self.actor, now);
        let mut meter = lock(&self.meter);
        jumps.into_iter().for_each(|jump_m| meter.jumps_um.saturating_record((f64::from(jump_m) * 1e6) as u64));
    }

    fn measure(&mut self, position: Vec3) {
        let driven = self.last.replace(position).map_or(0.0, |last| position.distance(last));
        if driven < DRIVEN_AT_ONCE_MAX {
            lock(&self.meter).distance_m += f64::from(driven);
        }
    }
}
