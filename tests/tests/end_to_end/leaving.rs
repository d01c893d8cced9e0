//! Clients that go without a word: their cars go too.

use pita_client::{Session, SessionEvent};
use pita_protocol::message::Event;
use pita_tests::process::Signal;

use crate::clients::{bots_process, connect, next_snapshot};
use crate::{SOON, await_clients, eventually, start_patient_server};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_car_of_a_killed_client_is_taken_out() {
    let (server, observer) = start_patient_server().await;
    let witness = connect(&server.endpoint, "witness").await;
    let bots = bots_process(&server.endpoint, 1);
    await_clients(&observer, 2).await;
    let victim = other_vehicle(&witness).await;

    bots.process.signal(Signal::KILL).unwrap();
    await_removal(&witness, victim).await;
    await_clients(&observer, 1).await;
    let session_stands = next_snapshot(&witness).await;
    assert!(session_stands.tick() > 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_car_of_a_dropped_session_is_taken_out() {
    let (server, observer) = start_patient_server().await;
    let witness = connect(&server.endpoint, "witness").await;
    let dropped = connect(&server.endpoint, "dropped").await;
    let victim = other_vehicle(&witness).await;
    assert_eq!(Some(victim), dropped.actor());

    drop(dropped);
    await_removal(&witness, victim).await;
    await_clients(&observer, 1).await;
}

/// The vehicle of whoever else plays, once the witness knows of it.
async fn other_vehicle(witness: &Session) -> u32 {
    eventually("the other's car", async || {
        let roster = witness.roster();
        roster.actors().find(|actor| actor.slot.is_some_and(|slot| slot != witness.slot())).map(|actor| actor.id)
    })
    .await
}

/// Waits until the witness is told that `victim` is gone, finds it neither in the roster nor in the snapshots, and has
/// been told why.
async fn await_removal(witness: &Session, victim: u32) {
    let root = witness.roster().root_slice(victim);
    let mut left = None;
    let mut removed = false;
    let told = tokio::time::timeout(SOON, async {
        while left.is_none() || !removed {
            match witness.next_event().await.expect("the witness stays") {
                SessionEvent::Happened(Event::ActorRemoved { id }) => removed |= id == victim,
                SessionEvent::Happened(Event::Left { slot, reason }) if slot != witness.slot() => left = Some(reason),
                _ => {}
            }
        }
    });
    told.await.unwrap_or_else(|_| panic!("removed: {removed}, left: {left:?}"));
    assert!(!left.unwrap_or_default().is_empty(), "no reason");
    assert!(witness.roster().actor(victim).is_none());
    eventually("a snapshot without the car", async || {
        let slices = next_snapshot(witness).await.slices();
        slices.iter().all(|slice| Some(slice.id) != root).then_some(())
    })
    .await;
}
