//! What arrives while all is well, and when the network loses some of it.

use std::time::{Duration, Instant};

use pita_client::{Controls, InterpolationSettings};
use pita_protocol::message::Snapshot;

use crate::{
    builder, eventually,
    fake_server::{EPOCH, FakeServer, ROOT, ack, snapshot},
    first_snapshot, player, soon,
};

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_wins_and_gaps_are_counted() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    assert_eq!(soon("a snapshot", session.next_snapshot()).await.unwrap().tick(), 101);
    for tick in [102, 103, 106, 105, 105, 107] {
        server.put_snapshot(snapshot(tick)).await;
    }
    // Repeats of the first one, sent while the subscription was under way, are stale too.
    let counts = eventually(&session, "six ticks", |s| s.snapshots_received == 6).await;
    assert_eq!(counts.snapshots_missed, 1);
    eventually(&session, "a repeat", |s| s.snapshots_stale >= 1).await;
    let newest = soon("a snapshot", session.next_snapshot()).await.unwrap();
    assert_eq!(newest.tick(), 107);
    assert_eq!(newest.select(&[ROOT])[0].q[0], 7.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_for_another_session_of_the_slot_is_not_taken() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    server.put_snapshot(Snapshot { epoch: EPOCH + 1, ..snapshot(102) }).await;
    server.put_snapshot(snapshot(103)).await;
    let counts = eventually(&session, "both", |s| s.snapshots_received == 2 && s.snapshots_foreign == 1).await;
    assert_eq!((counts.snapshots_missed, counts.malformed), (1, 0));
    assert_eq!(session.latest_snapshot().unwrap().tick(), 103);
}

#[tokio::test(flavor = "multi_thread")]
async fn acknowledgements_give_the_latency() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    for _ in 0..5 {
        session.send(Controls::default()).await.unwrap();
    }
    let packet = server.input().await;
    assert_eq!(packet.snapshot_tick, 101, "it acknowledges the newest snapshot");
    tokio::time::sleep(Duration::from_millis(50)).await;
    let ack = ack(3, 102);
    server.put_snapshot(Snapshot { ack, ..snapshot(102) }).await;
    let counts = eventually(&session, "three latencies", |s| s.latency_us.len() == 3).await;
    assert!(counts.latency_us.min() >= 49_000, "{} µs", counts.latency_us.min());
    assert_eq!(counts.inputs_sent, 5);
    assert!(counts.sent_bytes > 0 && counts.received_bytes > 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_world_is_shown_between_ticks() {
    let server = FakeServer::start().await;
    let settings = InterpolationSettings { delay: Duration::from_millis(100), ..Default::default() };
    let session = builder(&server).interpolation(Some(settings)).connect().await.unwrap();
    assert_eq!(session.world_at(Instant::now()), None);
    first_snapshot(&server, &session).await;
    for tick in 102..112 {
        server.put_snapshot(snapshot(tick)).await;
        tokio::time::sleep(Duration::from_millis(33)).await;
    }
    eventually(&session, "all snapshots", |s| s.snapshots_received == 11).await;
    let mut last = 0.0;
    for after_ms in [0, 7, 20, 41] {
        let world = session.world_at(Instant::now() + Duration::from_millis(after_ms)).unwrap();
        let x = f64::from(world.slices[0].q[0]);
        // The car is at x = tick − 100, between ticks as well as at them.
        assert!((x - (world.tick - 100.0)).abs() < 1e-3, "{x} m at tick {}", world.tick);
        assert!(world.tick > last);
        last = world.tick;
    }
    // What is further ahead than may be guessed stands still.
    let far = session.world_at(Instant::now() + Duration::from_secs(60)).unwrap();
    assert!((far.slices[0].q[0] - 11.0 - 7.5).abs() < 0.01, "{:?}", far.slices[0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_without_interpolation_keeps_nothing_for_it() {
    let server = FakeServer::start().await;
    let session = builder(&server).interpolation(None).connect().await.unwrap();
    first_snapshot(&server, &session).await;
    assert_eq!(session.world_at(Instant::now()), None);
}
