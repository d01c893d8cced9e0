//! Servers that send what they must not: it is counted, and the session goes on.

use std::time::{Duration, Instant};

use pita_client::Event;
use pita_protocol::{
    Message, encode,
    message::{EventMessage, Snapshot},
};
use proptest::{prelude::*, strategy::ValueTree, test_runner::TestRunner};

use crate::{
    eventually,
    fake_server::{EVENTS_BEFORE, FakeServer, SLOT, actor, snapshot},
    player, soon,
};

#[tokio::test(flavor = "multi_thread")]
async fn malformed_and_oversized_messages_are_counted() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    let mut cut = encode(&snapshot(102));
    cut.pop();
    let mut other_version = encode(&snapshot(102));
    other_version[0] = 77;
    let of_the_future = encode(&Snapshot { tick: u64::MAX, ..snapshot(0) });
    let too_long = vec![1; Snapshot::MAX_BYTES + 1];
    let bad = [Vec::new(), vec![1, 5], cut, other_version, of_the_future, too_long];
    let count = bad.len() as u64;
    for bytes in bad {
        server.put_on_snapshot(bytes).await;
    }
    server.put_on_event(vec![0xFF; 100]).await;
    server.put_on_event(vec![1; EventMessage::MAX_BYTES + 1]).await;
    let counts = eventually(&session, "all of them counted", |s| s.malformed == count + 2).await;
    assert_eq!(counts.snapshots_received, 1);

    server.put_snapshot(snapshot(102)).await;
    server.put_event(EVENTS_BEFORE + 1, Event::ActorAdded(actor(5))).await;
    eventually(&session, "good ones after bad ones", |s| s.snapshots_received == 2 && s.events_received == 1).await;
    assert_eq!(session.end(), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_snapshot_whose_slices_cannot_be_read_is_a_gap() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    server.put_snapshot(Snapshot { dof: vec![7; 33], ..snapshot(102) }).await;
    server.put_snapshot(snapshot(103)).await;
    let counts = eventually(&session, "the one after it", |s| s.snapshots_received == 2).await;
    assert_eq!((counts.snapshots_missed, counts.malformed), (1, 1));
    let world = session.world_at(Instant::now()).expect("the others are good");
    assert_eq!(world.slices.len(), 1);
    assert_eq!(session.latest_snapshot().unwrap().slices().len(), 1);
}

/// Whatever bytes come on both keys, the session neither ends nor panics, and hears what is good afterwards.
#[tokio::test(flavor = "multi_thread")]
async fn random_messages_are_survived() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    let mut runner = TestRunner::deterministic();
    let bytes = prop::collection::vec(any::<u8>(), 0..200);
    for i in 0..400u64 {
        let random = bytes.new_tree(&mut runner).unwrap().current();
        match i % 4 {
            0 => server.put_on_snapshot(random).await,
            1 => server.put_on_event(random).await,
            2 => {
                server
                    .put_on_snapshot([&[pita_protocol::PROTOCOL_VERSION as u8, Snapshot::KIND][..], &random].concat())
                    .await
            }
            _ => server.put_snapshot(Snapshot { dof: random, ..snapshot(101 + i / 4) }).await,
        }
        let _ = session.world_at(Instant::now());
    }
    server.put_snapshot(snapshot(300)).await;
    let heard = async {
        loop {
            let snapshot = session.next_snapshot().await.unwrap();
            if snapshot.tick() == 300 {
                return;
            }
        }
    };
    soon("the good one", heard).await;
    assert!(session.statistics().malformed > 100);
    assert_eq!(session.slot(), SLOT);
}

/// The queue of events is bounded and its overflow told; the roster does not depend on it.
#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_events_fills_nothing() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    let count = 3000;
    for i in 1..=count {
        server.put_event(EVENTS_BEFORE + i, Event::Joined { slot: 9, name: format!("n{i}") }).await;
        if i % 500 == 0 {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    server.description.lock().unwrap().event_sequence = EVENTS_BEFORE + count;
    let all = |s: &pita_client::Statistics| s.events_received + s.events_missed >= u64::from(count);
    eventually(&session, "every event seen or known as missed", all).await;
    let mut read = 0;
    while let Ok(Some(_)) = tokio::time::timeout(Duration::from_millis(100), session.next_event()).await {
        read += 1;
    }
    assert!(read <= 1100, "{read} events were kept");
}
