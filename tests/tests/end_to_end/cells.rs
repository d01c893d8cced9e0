//! Interest cells over real connections: who looks where gets what is there, whatever is lost, and slow ones alone are slow.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::time::{Duration, Instant};

use pita_client::Session;
use pita_protocol::dof::CellDecoder;
use pita_protocol::message::{CellId, CellSnapshot, Keyframes, KeyframesRequest, KeyframesWanted};
use pita_protocol::{Keys, decode, encode};
use pita_tests::observer::{self, Observer};
use pita_tests::relay::Relay;
use pita_tests::server_process::ServerProcess;
use zenoh::handlers::RingChannel;

use crate::clients::{connect, next_snapshot};
use crate::{LONG, SOON, observed, pita_server};

/// Flat ground with spawn points far from each other, and crates in three places.
const FIELD: &str = r#"
name = "field"
title = "Two crates in the west, two in the east, cars on their way"
max_players = 16

[materials.grass]
friction = 0.9

[[statics]]
shape.half_space = {}
material = "grass"

[[actors]]
kind = "prop"
name = "crate"
shape.box.half = [0.4, 0.4, 0.4]
material = "grass"
mass = 40.0
position = [20.0, 0.4, 20.0]
copies = [2, 1, 2]
spacing = [640.0, 0.0, 3.0]

[[spawn_grids]]
count = [4, 4]
spacing = [8.0, 6.0]
"#;
const WEST: CellId = CellId { x: 0, z: 0 };
const EAST: CellId = CellId { x: 10, z: 0 };

/// What the server drives round and round: enough that all of it is more than a slow line takes.
const DRIVERS: usize = 60;

fn busy_field() -> String {
    let mut text = FIELD.to_owned();
    let corner = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / DRIVERS as f64;
        format!("[{:.1}, {:.1}]", 150.0 * angle.cos(), 150.0 * angle.sin())
    };
    let corners: Vec<_> = (0..DRIVERS).map(corner).collect();
    let _ = writeln!(text, "[routes.ring]\ncorners = [{}]", corners.join(", "));
    for i in 0..DRIVERS {
        let _ = writeln!(text, "[[drivers]]\nname = \"driver {i}\"\nroute = \"ring\"\nstart = {i}\nspeed = 12.0");
    }
    text
}

async fn start(arena: &str) -> (ServerProcess, Observer) {
    start_with(arena, &[]).await
}

async fn start_with(arena: &str, arguments: &[&str]) -> (ServerProcess, Observer) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("field.toml");
    std::fs::write(&file, arena).unwrap();
    observed(pita_server().arg("run").arg("--arena").arg(&file).args(arguments)).await
}

/// The crates of the field.
fn crates(player: &Session) -> BTreeSet<u32> {
    let roster = player.roster();
    roster.actors().filter(|actor| actor.kind == "prop").map(|actor| actor.parts[0].slice).collect()
}

/// Plays until one snapshot shows all of `wanted`.
async fn see_all(player: &Session, wanted: &BTreeSet<u32>) {
    let until = Instant::now() + SOON;
    loop {
        let snapshot = next_snapshot(player).await;
        let seen: BTreeSet<u32> = snapshot.slices().iter().map(|slice| slice.id).collect();
        if wanted.is_subset(&seen) {
            return;
        }
        player.send(Default::default()).await.unwrap();
        assert!(Instant::now() < until, "{seen:?} of {wanted:?}");
    }
}

/// One who speaks nothing but Zenoh and looks at one cell: what it has, read from the keyframes on.
struct Looker {
    decoder: CellDecoder,
    bodies: BTreeMap<u32, u64>,
}

impl Looker {
    /// Looks at `cell` until it has two of `crates`, and answers which.
    async fn look(endpoint: String, keys: Keys, cell: CellId, crates: BTreeSet<u32>) -> BTreeSet<u32> {
        let session = observer::open(&endpoint).await.unwrap();
        let key = format!("pita/{}/cell/{}/{}/*", keys.arena(), cell.x, cell.z);
        // A full channel of the other kind holds up the thread that answers come by.
        let messages = session.declare_subscriber(key).with(RingChannel::new(1024)).await.unwrap();
        let mut looker = Self { decoder: CellDecoder::default(), bodies: BTreeMap::new() };
        looker.fetch(&session, &keys, cell).await;
        let until = Instant::now() + SOON;
        while looker.seen(&crates).len() < 2 {
            assert!(Instant::now() < until, "{cell:?}: {:?}", looker.bodies);
            let message = tokio::time::timeout(SOON, messages.recv_async()).await.expect("a cell speaks").unwrap();
            let message: CellSnapshot = decode(&message.payload().to_bytes()).unwrap();
            assert_eq!(message.cell, cell);
            match looker.decoder.decode(message.tick, &message.dof, message.keyframe_age == 0) {
                Ok(frame) => looker.bodies = frame.bodies().map(|(body, at)| (body.id, at)).collect(),
                Err(_) => looker.fetch(&session, &keys, cell).await,
            }
        }
        drop(messages);
        session.close().await.unwrap();
        looker.seen(&crates)
    }

    /// Those of `crates` that it has.
    fn seen(&self, crates: &BTreeSet<u32>) -> BTreeSet<u32> {
        self.bodies.keys().copied().filter(|id| crates.contains(id)).collect()
    }

    async fn fetch(&mut self, session: &zenoh::Session, keys: &Keys, cell: CellId) {
        let wanted = KeyframesWanted { cell, have: self.decoder.keyframe().unwrap_or(0) };
        let request = encode(&KeyframesRequest { cells: vec![wanted] });
        let replies = session.get(keys.keyframes()).payload(request).timeout(SOON).await.unwrap();
        let reply = replies.recv_async().await.unwrap();
        let answer: Keyframes = decode(&reply.result().unwrap().payload().to_bytes()).unwrap();
        for keyframe in &answer.cells[0].keyframes {
            let frame = self.decoder.decode(keyframe.tick, &keyframe.dof, true).unwrap();
            self.bodies = frame.bodies().map(|(body, at)| (body.id, at)).collect();
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_looks_where_gets_what_is_there_and_newcomers_begin_at_the_keyframe() {
    let (server, observer) = start(FIELD).await;
    // Cells are published while somebody plays.
    let player = connect(&server.endpoint, "player").await;
    let crates = crates(&player);
    assert_eq!(crates.len(), 4);
    // In tasks of their own: to close a session Zenoh blocks the thread in an executor of its own, which takes the wake-ups
    // of whatever else a test's main future waits for.
    let look = |cell| Looker::look(server.endpoint.clone(), observer.keys().clone(), cell, crates.clone());
    let (west, east) = (tokio::spawn(look(WEST)), tokio::spawn(look(EAST)));
    let looking = async { (west.await.unwrap(), east.await.unwrap()) };
    let (west, east) = tokio::time::timeout(LONG, looking).await.expect("both see their crates");
    assert!(west.is_disjoint(&east), "{west:?} {east:?}");
    assert_eq!(&west | &east, crates);

    // A client takes both, and sees one world.
    see_all(&player, &crates).await;
    let counts = player.leave().await;
    assert!(counts.keyframes_fetched > 0 && counts.malformed == 0, "{counts:?}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// What the server says in front of the port of its datagrams.
const DATAGRAMS: &str = "udp/127.0.0.1:";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn over_datagrams_cells_come_along_with_the_own_snapshots() {
    let (mut server, observer) = start_with(FIELD, &["--datagrams", &format!("{DATAGRAMS}0")]).await;
    let said = server.process.line_with(DATAGRAMS, SOON).unwrap();
    let port: String = said.split(DATAGRAMS).nth(1).unwrap().chars().take_while(char::is_ascii_digit).collect();
    // What is put on the slot's key, seen from outside.
    let listener = observer::open(&server.endpoint).await.unwrap();
    let messages = listener.declare_subscriber(observer.keys().snapshot(0)).with(RingChannel::new(64)).await.unwrap();
    let player = Session::builder(&server.endpoint, "player").datagrams(&format!("{DATAGRAMS}{port}"));
    let player = player.connect().await.unwrap();
    see_all(&player, &crates(&player)).await;
    let until = Instant::now() + SOON;
    loop {
        let message = tokio::time::timeout(SOON, messages.recv_async()).await.expect("the slot's key speaks").unwrap();
        if decode::<CellSnapshot>(&message.payload().to_bytes()).is_ok() {
            break;
        }
        assert!(Instant::now() < until, "no cell came along");
    }
    let counts = player.leave().await;
    assert!(counts.cells_received > 0 && counts.malformed == 0, "{counts:?}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// How old, in ticks, what a snapshot says of the drivers' cars is; those that it lacks are as old as the world. A cell
/// may be ahead of a snapshot whose successor is lost.
fn ages(session: &Session, snapshot: &pita_client::ReceivedSnapshot) -> Vec<u64> {
    let roster = session.roster();
    let roots: Vec<u32> =
        roster.actors().filter(|actor| actor.kind == "vehicle").map(|actor| actor.parts[0].slice).collect();
    let slices = snapshot.select(&roots);
    let mut ages: Vec<u64> = slices.iter().map(|slice| snapshot.tick().saturating_sub(slice.tick)).collect();
    ages.resize(roots.len(), snapshot.tick());
    ages
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fifth_of_everything_lost_heals() {
    let (server, _observer) = start(&busy_field()).await;
    let lossy = Session::builder(&server.endpoint, "lossy").conditioner(Some("down.loss=20,seed=7".parse().unwrap()));
    let lossy = lossy.connect().await.unwrap();
    let (mut seen, until) = (Vec::new(), Instant::now() + Duration::from_secs(8));
    let settled = Instant::now() + Duration::from_secs(3);
    while Instant::now() < until {
        let snapshot = next_snapshot(&lossy).await;
        lossy.send(Default::default()).await.unwrap();
        if Instant::now() > settled {
            seen.extend(ages(&lossy, &snapshot));
        }
    }
    let counts = lossy.leave().await;
    seen.sort_unstable();
    let at = |share: f64| seen[(share * (seen.len() - 1) as f64) as usize];
    let found = format!(
        "ages of {} states: median {} ticks, 95 % {}, 99 % {}, worst {}; {} snapshots of cells, {} not to be read, {} keyframes \
         fetched, {} snapshots missed",
        seen.len(),
        at(0.5),
        at(0.95),
        at(0.99),
        at(1.0),
        counts.cells_received,
        counts.cells_unreadable,
        counts.keyframes_fetched,
        counts.snapshots_missed
    );
    eprintln!("{found}");
    assert!(counts.snapshots_missed > 10 && counts.keyframes_fetched > 0, "nothing is lost: {found}");
    assert_eq!(counts.malformed, 0, "{found}");
    assert!(at(0.95) <= 8 && at(1.0) <= 30, "{found}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// Over a connection that takes less a session goes on with what it asks for then.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_goes_on_with_less_is_sent_less() {
    const BYTES_PER_S: u32 = 8_000;
    const WATCHED: Duration = Duration::from_secs(3);
    let (server, _observer) = start(&busy_field()).await;
    let cut = connect(&server.endpoint, "cut").await;
    let until = Instant::now() + WATCHED;
    while Instant::now() < until {
        next_snapshot(&cut).await;
        cut.send(Default::default()).await.unwrap();
    }
    let full = cut.statistics().received_bytes;
    let ticket = cut.resume_ticket();
    drop(cut);
    let resumed = Session::builder(&server.endpoint, "cut").resume(ticket).bytes_per_s(BYTES_PER_S);
    let resumed = resumed.connect().await.unwrap();
    let until = Instant::now() + WATCHED;
    while Instant::now() < until {
        next_snapshot(&resumed).await;
        resumed.send(Default::default()).await.unwrap();
    }
    let least = resumed.leave().await.received_bytes;
    let allowed = f64::from(BYTES_PER_S) * WATCHED.as_secs_f64() * 1.3;
    assert!((least as f64) < allowed && full as f64 > allowed, "{full}, then {least} bytes of {allowed}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// What the slow line takes, bytes/s: more than a session is always given, less than everything.
const SLOW_BYTES_PER_S: u64 = 14_000;
/// And that of one who subscribes to everything.
const GREEDY_BYTES_PER_S: u64 = 2_000;
/// For so long the frozen one is frozen: shorter than a connection may be silent.
const FROZEN: Duration = Duration::from_millis(1500);
/// How old a slow client's newest state may be once it has settled, ticks.
const AGE_MAX: u64 = 90;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_client_gets_less_and_a_frozen_one_nothing_and_the_others_everything() {
    let (server, observer) = start(&busy_field()).await;
    let slow_line = Relay::start(&server.endpoint, 10_000_000).await.unwrap();
    let cold_line = Relay::start(&server.endpoint, 10_000_000).await.unwrap();
    let fast = connect(&server.endpoint, "fast").await;
    let slow = connect(&slow_line.endpoint, "slow").await;
    let cold = connect(&cold_line.endpoint, "cold").await;
    // One who takes all cells, whatever it is granted, and reads hardly any of them.
    let greedy_line = Relay::start(&server.endpoint, 10_000_000).await.unwrap();
    let greedy = observer::open(&greedy_line.endpoint).await.unwrap();
    let all_cells = format!("pita/{}/cell/**", observer.keys().arena());
    let _unread = greedy.declare_subscriber(all_cells).with(RingChannel::new(8)).await.unwrap();
    greedy_line.set_rate(GREEDY_BYTES_PER_S);
    slow_line.set_rate(SLOW_BYTES_PER_S);
    let began = Instant::now();
    let (mut newest, mut behind, mut cold_behind) = (0, Vec::new(), u64::MAX);
    let (freeze, thaw) = (Duration::from_secs(4), Duration::from_secs(4) + FROZEN);
    let (mut before, mut after) = (None, None);
    let mut steps = tokio::time::interval(Duration::from_millis(33));
    while began.elapsed() < Duration::from_secs(14) {
        steps.tick().await;
        for session in [&fast, &slow, &cold] {
            session.send(Default::default()).await.unwrap();
        }
        cold_line.set_rate(if (freeze..thaw).contains(&began.elapsed()) { 0 } else { 10_000_000 });
        let tick = |session: &Session| session.latest_snapshot().map_or(0, |snapshot| snapshot.tick());
        newest = tick(&fast).max(newest);
        if began.elapsed() > Duration::from_secs(6) {
            before.get_or_insert_with(|| [&fast, &slow].map(|session| session.statistics()));
            behind.push(newest.saturating_sub(tick(&slow)));
        }
        if began.elapsed() > thaw + Duration::from_secs(1) {
            cold_behind = cold_behind.min(newest.saturating_sub(tick(&cold)));
        }
        after = Some([&fast, &slow].map(|session| session.statistics()));
    }
    let ([fast_before, slow_before], [of_fast, of_slow]) = (before.unwrap(), after.unwrap());
    let [of_fast, of_slow] = [of_fast.since(&fast_before), of_slow.since(&slow_before)];
    behind.sort_unstable();
    let found = format!(
        "in 8 s the fast one received {} bytes, {} snapshots and missed {}; the slow one {} bytes, {} snapshots, {} ticks \
         behind in the median and {} at worst; the frozen one was {cold_behind} behind soon after",
        of_fast.received_bytes,
        of_fast.snapshots_received,
        of_fast.snapshots_missed,
        of_slow.received_bytes,
        of_slow.snapshots_received,
        behind[behind.len() / 2],
        behind.last().unwrap(),
    );
    eprintln!("{found}");
    assert_eq!(of_fast.snapshots_missed, 0, "{found}");
    assert!(of_slow.received_bytes * 10 < of_fast.received_bytes * 9, "the line is not slow: {found}");
    assert!(*behind.last().unwrap() <= AGE_MAX, "{found}");
    assert!(cold_behind <= 3, "{found}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
