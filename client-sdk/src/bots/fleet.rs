//! Any number of bots in one process.

use std::{
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use tokio::{
    sync::watch,
    task::{JoinHandle, JoinSet},
};

use super::{
    BotTally, FleetTally, ScriptKind,
    driver::{Driver, Meter},
};
use crate::{ClientError, ConditionerSettings, InterpolationSettings, Session, lock::lock, shared::StatisticsReader};

/// Connections that are opened at the same time. More would not be faster: opening is work for both sides.
const OPENING_MAX: usize = 8;

/// What the bots of a fleet have in common.
#[derive(Clone, Debug)]
pub struct FleetSettings {
    /// Zenoh endpoint of the server.
    pub endpoint: String,
    /// As [`SessionBuilder::datagrams`](crate::SessionBuilder::datagrams).
    pub datagrams: Option<String>,
    /// Arena to join; otherwise the server is asked.
    pub arena: Option<String>,
    /// Dealt out in turn; all wander where it is empty.
    pub scripts: Vec<ScriptKind>,
    /// Part of all names: those of another fleet are others, whatever its seed.
    pub tag: u16,
    /// Bot `n` draws from a seed that follows from this and `n`.
    pub seed: u64,
    /// As [`SessionBuilder::connect_timeout`](crate::SessionBuilder::connect_timeout).
    pub connect_timeout: Duration,
    /// As [`SessionBuilder::loss_timeout`](crate::SessionBuilder::loss_timeout).
    pub loss_timeout: Duration,
    /// As [`SessionBuilder::conditioner`](crate::SessionBuilder::conditioner), each bot with a seed of its own.
    pub conditioner: Option<ConditionerSettings>,
    /// Whether bots look at the world as a player's screen would show it, which costs time: others interpolated, the own
    /// car predicted. It is counted how smoothly both move.
    pub watch: bool,
}

impl FleetSettings {
    /// Wandering bots for whatever arena runs at `endpoint`.
    pub fn new(endpoint: &str) -> Self {
        Self {
            endpoint: endpoint.to_owned(),
            datagrams: None,
            arena: None,
            scripts: vec![ScriptKind::Wander],
            tag: rand::random(),
            seed: 1,
            connect_timeout: Duration::from_secs(5),
            loss_timeout: Duration::from_secs(3),
            conditioner: None,
            watch: false,
        }
    }

    fn script_of(&self, number: usize) -> ScriptKind {
        self.scripts.get(number % self.scripts.len().max(1)).copied().unwrap_or(ScriptKind::Wander)
    }
}

/// Bots that drive, each over a session of its own, from when they are [added](Self::add) until they are
/// [stopped](Self::stop). Runs on the tokio runtime that it is used from, which must be a multi-threaded one.
#[derive(Debug)]
pub struct BotFleet {
    settings: FleetSettings,
    bots: Vec<Bot>,
    /// Number of the next bot; numbers of bots that failed to join are not given again.
    next: usize,
    began: Instant,
    stop: watch::Sender<bool>,
}

#[derive(Debug)]
struct Bot {
    script: ScriptKind,
    statistics: StatisticsReader,
    meter: Arc<Mutex<Meter>>,
    task: JoinHandle<()>,
}

impl BotFleet {
    /// A fleet without bots.
    pub fn new(settings: FleetSettings) -> Self {
        Self { settings, bots: Vec::new(), next: 0, began: Instant::now(), stop: watch::Sender::new(false) }
    }

    /// Bots that have joined.
    pub fn len(&self) -> usize {
        self.bots.len()
    }

    /// Whether no bot has joined.
    pub fn is_empty(&self) -> bool {
        self.bots.is_empty()
    }

    /// Bots that drive: those that joined without those that were lost.
    pub fn running(&self) -> usize {
        self.bots.iter().filter(|bot| !bot.task.is_finished()).count()
    }

    /// Connects `count` more bots, which drive at once.
    ///
    /// # Errors
    /// Why the first one that failed did; those that joined stay and drive.
    pub async fn add(&mut self, count: usize) -> Result<(), ClientError> {
        let mut waiting = self.next..self.next + count;
        self.next = waiting.end;
        let mut opening = JoinSet::new();
        let mut failed = Ok(());
        loop {
            while opening.len() < OPENING_MAX
                && failed.is_ok()
                && let Some(number) = waiting.next()
            {
                opening.spawn(connect(self.settings.clone(), number));
            }
            match opening.join_next().await {
                None => return failed,
                Some(Ok(Ok((number, session)))) => failed = failed.and(self.start(number, session)),
                Some(Ok(Err(error))) => failed = failed.and(Err(error)),
                // A task of ours that panicked or was cancelled with the runtime: no bot came of it.
                Some(Err(error)) => {
                    failed = Err(ClientError::Transport { action: "start a bot", reason: error.to_string() });
                }
            }
        }
    }

    fn start(&mut self, number: usize, session: Session) -> Result<(), ClientError> {
        let actor = session.actor().ok_or(ClientError::NoActor)?;
        let script = self.settings.script_of(number);
        let (statistics, meter) = (session.statistics_reader(), Arc::new(Mutex::new(Meter::new())));
        let seed = self.settings.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(number as u64);
        let driver = Driver::new(session, actor, script.script(seed), Arc::clone(&meter));
        let task = tokio::spawn(driver.run(self.stop.subscribe()));
        self.bots.push(Bot { script, statistics, meter, task });
        Ok(())
    }

    /// All counts since the fleet began.
    pub fn tally(&self) -> FleetTally {
        let mut tally = FleetTally::new(self.began);
        for bot in &self.bots {
            let meter = lock(&bot.meter);
            let counted = BotTally {
                connected: 1,
                lost: meter.lost.iter().cloned().collect(),
                distances_m: vec![meter.distance_m],
                lateness_us: meter.lateness_us.clone(),
                inputs_skipped: meter.inputs_skipped,
                jumps_um: meter.jumps_um.clone(),
                session: bot.statistics.read(),
            };
            tally.add(bot.script, &counted);
        }
        tally
    }

    /// Lets all bots leave, and answers the last counts.
    pub async fn stop(mut self) -> FleetTally {
        self.stop.send_replace(true);
        for bot in &mut self.bots {
            if let Err(error) = (&mut bot.task).await {
                tracing::error!("a bot did not end as it should: {error}");
            }
        }
        self.tally()
    }
}

async fn connect(settings: FleetSettings, number: usize) -> Result<(usize, Session), ClientError> {
    let name = format!("{}-{number}-{:04x}", settings.script_of(number).name(), settings.tag);
    let builder = Session::builder(&settings.endpoint, &name);
    let builder = match &settings.arena {
        Some(arena) => builder.arena(arena),
        None => builder,
    };
    let builder = match &settings.datagrams {
        Some(endpoint) => builder.datagrams(endpoint),
        None => builder,
    };
    let seeded = |conditions: ConditionerSettings| ConditionerSettings {
        seed: conditions.seed.wrapping_add(number as u64),
        ..conditions
    };
    let builder = builder
        .connect_timeout(settings.connect_timeout)
        .loss_timeout(settings.loss_timeout)
        .conditioner(settings.conditioner.map(seeded))
        .interpolation(settings.watch.then(InterpolationSettings::default));
    #[cfg(feature = "prediction")]
    let builder = builder.prediction(settings.watch);
    Ok((number, builder.connect().await?))
}
