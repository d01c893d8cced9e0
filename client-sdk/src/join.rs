//! How a session comes about on an open connection: find the arena, listen for events, join, declare the rest.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use pita_protocol::{
    Keys, keys,
    message::{JoinAccepted, JoinReply, JoinRequest, Role, Status},
};
use tokio::sync::mpsc;
use zenoh::{liveliness::LivelinessToken, pubsub::Subscriber};

use crate::{
    builder::SessionBuilder,
    conditioner::{ConditionerSettings, Delivery, Link},
    datagrams::Following,
    error::ClientError,
    interpolation::{InterpolationBuffer, Playback},
    keeper::{self, EVENTS_MAX, Incoming, Keeper},
    looking::Looking,
    session::Session,
    shared::{Interpolation, Shared},
    transport,
    wire::Wire,
};
#[cfg(feature = "prediction")]
use {
    crate::prediction::Predictor,
    pita_protocol::message::{ArenaSource, Mount, PartDescription},
    std::sync::Mutex,
};

/// How often a spectator, who drives nothing, says which snapshots it has: what they are coded against must not get old.
const ACKNOWLEDGED: Duration = Duration::from_millis(66);

/// What is declared for as long as a session lives.
#[derive(Debug)]
pub struct Declared {
    _events: Subscriber<()>,
    _snapshots: Snapshots,
    _token: LivelinessToken,
}

/// What brings snapshots.
#[derive(Debug)]
enum Snapshots {
    Control { _subscriber: Subscriber<()> },
    Datagrams { _following: Following },
}

/// Joins as `wanted` says; snapshots are to come over `datagrams` where there are any.
pub async fn join(
    wanted: &SessionBuilder,
    zenoh: &zenoh::Session,
    datagrams: Option<zenoh::Session>,
    request: JoinRequest,
) -> Result<Session, ClientError> {
    let arena = match &wanted.arena {
        Some(name) => name.clone(),
        None => find_arena(wanted, zenoh).await?,
    };
    let keys = Keys::new(&arena).map_err(ClientError::BadArgument)?;

    // Before the join: no event falls between the description in its answer and the subscription.
    let (events, incoming) = subscribe_to_events(zenoh, &keys, wanted.conditioner).await?;
    let accepted = ask_to_join(wanted, zenoh, &keys, request).await?;
    #[cfg_attr(not(feature = "prediction"), expect(unused_mut, reason = "there is nothing to add"))]
    let mut shared = share(wanted, &accepted);
    #[cfg(feature = "prediction")]
    if wanted.prediction && accepted.actor.is_some() {
        shared.prediction = Some(Mutex::new(predictor(wanted, zenoh, &keys, &accepted).await?));
    }
    let shared = Arc::new(shared);
    let snapshots =
        SnapshotKey { key: keys.snapshot(accepted.slot), shared: Arc::clone(&shared), conditioner: wanted.conditioner };
    // Over datagrams cells come along with the snapshots.
    let subscribes_to_cells = datagrams.is_none();
    let declared = Declared {
        _events: events,
        _snapshots: match datagrams {
            Some(datagrams) => Snapshots::Datagrams { _following: Following::new(zenoh.clone(), datagrams, snapshots) },
            None => Snapshots::Control { _subscriber: snapshots.subscribe(zenoh, None).await? },
        },
        _token: declare_alive(zenoh, &keys, &accepted).await?,
    };
    let wire = Arc::new(Wire::open(zenoh, &keys, &accepted, Arc::clone(&shared), wanted.conditioner).await?);
    let looking =
        Looking::new(zenoh.clone(), keys.clone(), Arc::clone(&shared), wanted.conditioner, subscribes_to_cells);
    let silent_otherwise = wanted.role == Role::Spectator;
    let keeper = Keeper {
        zenoh: zenoh.clone(),
        keys,
        slot: accepted.slot,
        actor: accepted.actor,
        joined_at: accepted.description.event_sequence,
        loss_timeout: wanted.loss_timeout,
        keep_alive: silent_otherwise
            .then(|| ACKNOWLEDGED.min(Duration::from_millis(accepted.input_timeout_ms.into()) / 3)),
        shared: Arc::clone(&shared),
        wire: Arc::clone(&wire),
    };
    let tasks = [tokio::spawn(keeper.run(incoming)), tokio::spawn(looking.run())];
    Ok(Session::new(zenoh.clone(), accepted, shared, wire, tasks, declared))
}

/// The one arena that answers.
async fn find_arena(wanted: &SessionBuilder, zenoh: &zenoh::Session) -> Result<String, ClientError> {
    let running: Vec<Status> = transport::ask_all(zenoh, keys::ANY_STATUS, "status", wanted.connect_timeout).await?;
    let mut names: Vec<String> = running.into_iter().map(|status| status.arena).collect();
    names.sort_unstable();
    names.dedup();
    match names.len() {
        0 => Err(no_arena(wanted)),
        1 => Ok(names.remove(0)),
        _ => Err(ClientError::SeveralArenas(names)),
    }
}

async fn ask_to_join(
    wanted: &SessionBuilder,
    zenoh: &zenoh::Session,
    keys: &Keys,
    request: JoinRequest,
) -> Result<JoinAccepted, ClientError> {
    let payload = pita_protocol::encode(&request);
    match transport::ask(zenoh, &keys.join(), "join", payload, wanted.connect_timeout).await? {
        Some(JoinReply::Accepted(accepted)) => Ok(*accepted),
        Some(JoinReply::Refused(refusal)) => Err(refusal.into()),
        None => Err(no_arena(wanted)),
    }
}

fn no_arena(wanted: &SessionBuilder) -> ClientError {
    let (endpoint, arena) = (wanted.endpoint.clone(), wanted.arena.clone());
    ClientError::NoArena { endpoint, arena, waited: wanted.connect_timeout }
}

/// Asks for the arena's file and builds what predicts the session's own car.
#[cfg(feature = "prediction")]
async fn predictor(
    wanted: &SessionBuilder,
    zenoh: &zenoh::Session,
    keys: &Keys,
    accepted: &JoinAccepted,
) -> Result<Predictor, ClientError> {
    let asked = transport::ask(zenoh, &keys.source(), "source", Vec::new(), wanted.connect_timeout).await?;
    let source: ArenaSource = asked.ok_or_else(|| no_arena(wanted))?;
    let own = accepted.description.actors.iter().find(|actor| Some(actor.id) == accepted.actor);
    // What is of a game's own kind is what the car looks like, no part of its motion.
    let moves = |part: &&PartDescription| part.mount != Mount::Own;
    let slices = own.ok_or(ClientError::NoActor)?.parts.iter().filter(moves).map(|part| part.slice).collect();
    Predictor::new(&source, accepted.tick_hz, slices).map_err(ClientError::Arena)
}

fn share(wanted: &SessionBuilder, accepted: &JoinAccepted) -> Shared {
    let period_s = 1.0 / f64::from(accepted.tick_hz);
    let interpolation = wanted.interpolation.map(|settings| Interpolation {
        buffer: InterpolationBuffer::new(settings, period_s),
        playback: Playback::new(period_s, settings.delay.as_secs_f64(), settings.delay_max.as_secs_f64()),
    });
    let recent_max = wanted.interpolation.map_or(0, |settings| settings.frames_max());
    Shared::new(accepted, recent_max, interpolation)
}

async fn subscribe_to_events(
    zenoh: &zenoh::Session,
    keys: &Keys,
    conditioner: Option<ConditionerSettings>,
) -> Result<(Subscriber<()>, Incoming), ClientError> {
    let (sender, incoming) = mpsc::channel(EVENTS_MAX);
    let take = move |bytes: &[u8]| keeper::forward(bytes, &sender);
    let subscriber = subscribe(zenoh, keys.event(), "subscribe to events", conditioner, Delivery::Stream, take).await?;
    Ok((subscriber, Incoming(incoming)))
}

/// Gives what arrives on `key` to `take`, through the conditioner where there is one.
async fn subscribe(
    zenoh: &zenoh::Session,
    key: String,
    action: &'static str,
    conditioner: Option<ConditionerSettings>,
    delivery: Delivery,
    take: impl Fn(&[u8]) + Send + Sync + 'static,
) -> Result<Subscriber<()>, ClientError> {
    let link = conditioner.map(|settings| (settings.down, settings.seed ^ u64::from(delivery == Delivery::Stream)));
    let subscriber = zenoh.declare_subscriber(key);
    let subscribed = match link {
        None => subscriber.callback(move |sample| take(&sample.payload().to_bytes())).await,
        Some((conditions, seed)) => {
            let link = Link::new(conditions, delivery, seed, move |bytes| take(&bytes));
            subscriber.callback(move |sample| link.carry(sample.payload().to_bytes().into_owned())).await
        }
    };
    subscribed.map_err(ClientError::transport(action))
}

/// What a session's snapshots are asked for by, over whichever connection.
#[derive(Debug)]
pub struct SnapshotKey {
    key: String,
    shared: Arc<Shared>,
    conditioner: Option<ConditionerSettings>,
}

impl SnapshotKey {
    /// Asks for them over `zenoh`; each that comes is counted.
    pub async fn subscribe(
        &self,
        zenoh: &zenoh::Session,
        counted: Option<Arc<AtomicU64>>,
    ) -> Result<Subscriber<()>, ClientError> {
        let shared = Arc::clone(&self.shared);
        let take = move |bytes: &[u8]| {
            if let Some(counted) = &counted {
                counted.fetch_add(1, Ordering::Relaxed);
            }
            shared.take_own(bytes, Instant::now());
        };
        let (action, delivery) = ("subscribe to snapshots", Delivery::Datagrams);
        subscribe(zenoh, self.key.clone(), action, self.conditioner, delivery, take).await
    }
}

async fn declare_alive(
    zenoh: &zenoh::Session,
    keys: &Keys,
    accepted: &JoinAccepted,
) -> Result<LivelinessToken, ClientError> {
    zenoh
        .liveliness()
        .declare_token(keys.live(accepted.slot, accepted.epoch))
        .await
        .map_err(ClientError::transport("declare the session alive"))
}
