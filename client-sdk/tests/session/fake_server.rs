//! A server that does what a test tells it, good or bad.

use std::{
    collections::HashSet,
    net::{SocketAddr, TcpListener},
    sync::{
        Arc, Mutex,
        atomic::{AtomicU16, AtomicUsize, Ordering},
    },
};

use pita_client::{ActorDescription, Description, Event};
use pita_protocol::{
    Keys,
    dof::{Encoder, Group, Precision, State, kind},
    encode,
    message::{
        EventMessage, FATES_MAX, InputAck, InputFate, InputPacket, JoinAccepted, JoinReply, JoinRequest,
        PartDescription, Role, Shape, Snapshot, Status,
    },
    seal::{SessionKey, open},
};
use tokio::sync::{Mutex as AsyncMutex, mpsc};
use zenoh::{
    Wait,
    qos::CongestionControl,
    query::{Query, Queryable},
    sample::SampleKind,
};

use crate::soon;

pub const ARENA: &str = "fake";
/// Slot and epoch of the first session; later ones count up the slot.
pub const SLOT: u16 = 3;
pub const EPOCH: u32 = 41;
/// The own actor of slot `s` is `s`, its root slice `10 s`.
pub const ROOT: u32 = 30;
/// Number of the last event in the description that a session starts from.
pub const EVENTS_BEFORE: u32 = 7;

pub type Answer = Box<dyn Fn(&[u8]) -> Option<Vec<u8>> + Send + Sync>;

/// The fake. Everything that it declares goes with it.
pub struct FakeServer {
    pub endpoint: String,
    /// Where it gives datagrams.
    pub datagrams: SocketAddr,
    pub zenoh: zenoh::Session,
    pub description: Arc<Mutex<Description>>,
    /// How often the description was asked for.
    pub described: Arc<AtomicUsize>,
    keys: Keys,
    inputs: AsyncMutex<mpsc::UnboundedReceiver<(u16, Vec<u8>)>>,
    live: AsyncMutex<mpsc::UnboundedReceiver<(String, bool)>>,
    queryables: Vec<Queryable<()>>,
}

impl FakeServer {
    /// Accepts everybody.
    pub async fn start() -> Self {
        let slots = AtomicU16::new(SLOT);
        Self::answering(Box::new(move |request| {
            let request: JoinRequest = pita_protocol::decode(request).expect("the client's request");
            Some(accept(slots.fetch_add(1, Ordering::Relaxed), request.role))
        }))
        .await
    }

    /// Answers joins by `join`.
    pub async fn answering(join: Answer) -> Self {
        let (zenoh, endpoint, datagrams) = listen().await;
        let keys = Keys::new(ARENA).unwrap();
        let description = Arc::new(Mutex::new(description(EVENTS_BEFORE, &[u32::from(SLOT)])));
        let (input_sender, inputs) = mpsc::unbounded_channel();
        let of_inputs = keys.clone();
        let inputs_at = zenoh.declare_subscriber(keys.all_inputs()).callback(move |sample| {
            let slot = of_inputs.slot_of_input(sample.key_expr()).expect("an input key");
            let _ = input_sender.send((slot, sample.payload().to_bytes().into_owned()));
        });
        inputs_at.background().await.unwrap();
        let (live_sender, live) = mpsc::unbounded_channel();
        let live_at = zenoh.liveliness().declare_subscriber(keys.all_live()).callback(move |sample| {
            let _ = live_sender.send((sample.key_expr().to_string(), sample.kind() == SampleKind::Put));
        });
        live_at.background().await.unwrap();
        let (of_description, described) = (Arc::clone(&description), Arc::new(AtomicUsize::new(0)));
        let counter = Arc::clone(&described);
        let describe = move |_: &[u8]| {
            counter.fetch_add(1, Ordering::Relaxed);
            Some(encode(&*of_description.lock().unwrap()))
        };
        let status = encode(&Status { arena: ARENA.into(), ..Status::default() });
        let queryables = vec![
            answer(&zenoh, keys.join(), join).await,
            answer(&zenoh, keys.describe(), Box::new(describe)).await,
            answer(&zenoh, keys.status(), Box::new(move |_| Some(status.clone()))).await,
        ];
        let (inputs, live) = (AsyncMutex::new(inputs), AsyncMutex::new(live));
        Self { endpoint, datagrams, zenoh, description, described, keys, inputs, live, queryables }
    }

    /// Lets another arena answer status queries.
    pub async fn also_run(&mut self, arena: &str) {
        let status = encode(&Status { arena: arena.into(), ..Status::default() });
        let key = Keys::new(arena).unwrap().status();
        self.queryables.push(answer(&self.zenoh, key, Box::new(move |_| Some(status.clone()))).await);
    }

    pub async fn put_snapshot(&self, snapshot: Snapshot) {
        self.put_on_snapshot(encode(&snapshot)).await;
    }

    pub async fn put_on_snapshot(&self, bytes: Vec<u8>) {
        put(&self.zenoh, self.keys.snapshot(SLOT), bytes).await;
    }

    pub async fn put_event(&self, sequence: u32, event: Event) {
        self.put_on_event(encode(&EventMessage { sequence, tick: 100, event })).await;
    }

    pub async fn put_on_event(&self, bytes: Vec<u8>) {
        put(&self.zenoh, self.keys.event(), bytes).await;
    }

    /// The next input, opened as the server would.
    pub async fn input(&self) -> InputPacket {
        self.input_and_slot().await.1
    }

    /// Waits until so many sessions have said good-bye.
    pub async fn all_leave(&self, count: usize) {
        let mut left = HashSet::new();
        while left.len() < count {
            let (slot, packet) = self.input_and_slot().await;
            if packet.leave {
                left.insert(slot);
            }
        }
    }

    async fn input_and_slot(&self) -> (u16, InputPacket) {
        let (slot, bytes) = soon("an input", async { self.inputs.lock().await.recv().await }).await.unwrap();
        (slot, open(&bytes, &session_key(), &self.keys.input(slot)).unwrap())
    }

    /// The next change of a liveliness token: its key, and whether it came.
    pub async fn liveliness(&self) -> (String, bool) {
        soon("a liveliness token", async { self.live.lock().await.recv().await }).await.unwrap()
    }
}

/// Puts `bytes`, and waits where the client's connection takes no more: what a test sends arrives.
pub async fn put(zenoh: &zenoh::Session, key: String, bytes: Vec<u8>) {
    zenoh.put(key, bytes).congestion_control(CongestionControl::Block).await.unwrap();
}

async fn listen() -> (zenoh::Session, String, SocketAddr) {
    // Another process may take the port between the two steps; then the next one is tried.
    for _ in 0..20 {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let (endpoint, datagrams) = (format!("tcp/127.0.0.1:{port}"), format!("udp/127.0.0.1:{port}"));
        let mut config = zenoh::Config::default();
        for (key, value) in [
            ("mode", "\"peer\"".to_owned()),
            ("listen/endpoints", format!("[\"{endpoint}\", \"{datagrams}\"]")),
            ("scouting/multicast/enabled", "false".to_owned()),
            ("scouting/gossip/enabled", "false".to_owned()),
        ] {
            config.insert_json5(key, &value).unwrap();
        }
        if let Ok(zenoh) = zenoh::open(config).await {
            return (zenoh, endpoint, SocketAddr::from(([127, 0, 0, 1], port)));
        }
    }
    panic!("no free port on loopback");
}

async fn answer(zenoh: &zenoh::Session, key: String, answer: Answer) -> Queryable<()> {
    let reply_key = key.clone();
    let reply = move |query: Query| {
        let request = query.payload().map(|payload| payload.to_bytes().into_owned()).unwrap_or_default();
        if let Some(bytes) = answer(&request) {
            query.reply(reply_key.clone(), bytes).wait().unwrap();
        }
    };
    zenoh.declare_queryable(key).callback(reply).await.unwrap()
}

/// The key that every session of the fake gets.
pub fn session_key() -> SessionKey {
    SessionKey([9; 32])
}

/// The reply that lets a client in.
pub fn accept(slot: u16, role: Role) -> Vec<u8> {
    let actor = (role == Role::Player).then_some(u32::from(slot));
    encode(&JoinReply::Accepted(Box::new(JoinAccepted {
        slot,
        epoch: EPOCH,
        session_key: session_key(),
        tick_hz: 30,
        input_timeout_ms: 900,
        actor,
        description: description(EVENTS_BEFORE, &[u32::from(slot)]),
    })))
}

/// All inputs up to `sequence` were applied in time, the last at `tick`.
pub fn ack(sequence: u32, tick: u64) -> InputAck {
    let mut ack = InputAck { sequence, tick, ..InputAck::default() };
    (0..FATES_MAX).for_each(|behind| ack.fates.set(behind, InputFate::Applied { late_ticks: 0 }));
    ack
}

pub fn description(event_sequence: u32, actors: &[u32]) -> Description {
    Description {
        arena: ARENA.into(),
        title: "A fake".into(),
        tick: 100,
        event_sequence,
        gravity: [0.0, -9.81, 0.0],
        precision: Precision::default(),
        scores: Vec::new(),
        statics: Vec::new(),
        actors: actors.iter().map(|&id| actor(id)).collect(),
    }
}

pub fn actor(id: u32) -> ActorDescription {
    let part = PartDescription::of_body(10 * id, Shape::Ball { radius: 0.5 });
    ActorDescription { id, kind: "vehicle".into(), name: format!("car {id}"), slot: None, parts: vec![part] }
}

/// The own car of the first session at `x = tick − 100` m.
pub fn snapshot(tick: u64) -> Snapshot {
    let x = tick as f64 - 100.0;
    Snapshot {
        epoch: EPOCH,
        tick,
        ack: InputAck::default(),
        event_sequence: EVENTS_BEFORE,
        cells: None,
        dof: car(ROOT, tick, x),
    }
}

/// One rigid body at `x`, 30 m/s fast along it, in a snapshot that needs nothing before it.
pub fn car(slice: u32, tick: u64, x: f64) -> Vec<u8> {
    let mut state = State::new(Precision::default()).unwrap();
    let layout = [Group::Point, Group::Rotation, Group::Rate, Group::Rate];
    let numbers = [x, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 30.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    state.push(slice, kind::RIGID_BODY, None, &layout, &numbers).unwrap();
    Encoder::default().encode(tick, &state, &[])
}
