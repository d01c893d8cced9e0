//! A byte budget a client: less of it means fewer bodies at a time, and nobody else notices.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use pita_client::Session;

use crate::clients::next_snapshot;
use crate::{SOON, await_clients, observed, pita_server};

/// A thousand crates on a field, and a car among them.
const FIELD: &str = r#"
name = "field"
title = "A thousand crates"
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
position = [10.0, 0.4, -60.0]
copies = [25, 1, 40]
spacing = [3.0, 0.0, 3.0]

[[spawn_grids]]
count = [4, 4]
spacing = [8.0, 6.0]
"#;
const CRATES: usize = 1000;

const POOR_BYTES_PER_S: u32 = 8_000;

/// How a session saw the crates come.
struct Arrival {
    session: Session,
    /// Until all of them were there.
    took: Duration,
    /// Bytes of snapshots and events in that time.
    bytes: u64,
    /// Crates that the first snapshot had.
    at_first: usize,
    /// Snapshots whose own car was an old one.
    without_own: usize,
}

async fn arrive(endpoint: &str, name: &str, bytes_per_s: Option<u32>) -> Arrival {
    let builder = Session::builder(endpoint, name);
    let builder = if let Some(budget) = bytes_per_s { builder.bytes_per_s(budget) } else { builder };
    let session = builder.connect().await.unwrap_or_else(|error| panic!("{name}: {error}"));
    let own = session.roster().root_slice(session.actor().unwrap()).unwrap();
    let roster = session.roster();
    let crates: BTreeSet<u32> =
        roster.actors().filter(|actor| actor.kind == "prop").map(|actor| actor.parts[0].slice).collect();
    assert_eq!(crates.len(), CRATES);
    let (began, mut at_first, mut without_own) = (Instant::now(), None, 0);
    loop {
        let snapshot = next_snapshot(&session).await;
        session.send(Default::default()).await.unwrap();
        let slices = snapshot.slices();
        let known = slices.iter().filter(|slice| crates.contains(&slice.id)).count();
        at_first.get_or_insert(known);
        without_own += usize::from(!slices.iter().any(|slice| slice.id == own && slice.tick == snapshot.tick()));
        if known == CRATES {
            break;
        }
        assert!(began.elapsed() < SOON, "{name}: {known} of {CRATES} crates");
    }
    let (took, bytes) = (began.elapsed(), session.statistics().received_bytes);
    Arrival { session, took, bytes, at_first: at_first.unwrap_or(0), without_own }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_large_world_arrives_within_the_budget_and_with_the_own_car_first() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("field.toml");
    std::fs::write(&file, FIELD).unwrap();
    let (server, observer) = observed(pita_server().arg("run").arg("--arena").arg(&file)).await;
    let rich = arrive(&server.endpoint, "rich", None).await;
    let poor = arrive(&server.endpoint, "poor", Some(POOR_BYTES_PER_S)).await;
    await_clients(&observer, 2).await;
    for (arrival, bytes_per_s) in [(&rich, 64_000), (&poor, POOR_BYTES_PER_S)] {
        let Arrival { took, bytes, at_first, without_own, .. } = arrival;
        // What was saved up before the first snapshot, events, and the last snapshots in flight come on top.
        let allowed = f64::from(bytes_per_s) * (took.as_secs_f64() + 0.5) * 1.15;
        assert!((*bytes as f64) < allowed, "{bytes} bytes in {took:?} of {bytes_per_s} bytes/s");
        assert!(*at_first < CRATES, "they come one after the other: {at_first}");
        assert_eq!(*without_own, 0, "the own car is in every snapshot");
    }
    assert!(poor.took > rich.took, "{:?} {:?}", poor.took, rich.took);
    for arrival in [rich, poor] {
        let counts = arrival.session.leave().await;
        assert_eq!(counts.malformed, 0);
    }
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
