//! The roster follows the events, also when some of them are lost.

use std::{sync::atomic::Ordering, time::Duration};

use pita_client::{Event, Session, SessionEvent};
use pita_protocol::message::Snapshot;

use crate::{
    eventually,
    fake_server::{EVENTS_BEFORE, FakeServer, SLOT, actor, description, snapshot},
    player, soon,
};

const OWN: u32 = SLOT as u32;

async fn next(session: &Session) -> SessionEvent {
    soon("an event", session.next_event()).await.expect("the session goes on")
}

fn ids(session: &Session) -> Vec<u32> {
    session.roster().actors().map(|actor| actor.id).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn actors_come_and_go() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    assert_eq!(ids(&session), [OWN]);
    assert_eq!(session.roster().root_slice(OWN), Some(10 * OWN));
    let events = [
        Event::Joined { slot: 5, name: "Ada".into() },
        Event::ActorAdded(actor(50)),
        Event::ActorAdded(actor(51)),
        Event::ActorRemoved { id: 50 },
    ];
    for (event, sequence) in events.iter().zip(EVENTS_BEFORE + 1..) {
        server.put_event(sequence, event.clone()).await;
        server.put_event(sequence, event.clone()).await;
    }
    for event in events {
        assert_eq!(next(&session).await, SessionEvent::Happened(event));
    }
    assert_eq!(ids(&session), [OWN, 51]);
    assert_eq!(session.statistics().events_received, 4);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_gap_between_events_is_reconciled() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    // 8 and 9 are lost; the description that is asked for contains them.
    *server.description.lock().unwrap() = description(EVENTS_BEFORE + 3, &[OWN, 60, 61]);
    let third = Event::ActorAdded(actor(61));
    server.put_event(EVENTS_BEFORE + 3, third.clone()).await;
    assert_eq!(next(&session).await, SessionEvent::Happened(third));
    assert_eq!(next(&session).await, SessionEvent::Resynchronised { missed: 2 });
    assert_eq!(next(&session).await, SessionEvent::Happened(Event::ActorAdded(actor(60))));
    assert_eq!(ids(&session), [OWN, 60, 61]);
    assert_eq!(session.statistics().events_missed, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_event_that_only_snapshots_tell_of_is_reconciled() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    *server.description.lock().unwrap() = description(EVENTS_BEFORE + 1, &[OWN, 70]);
    server.put_snapshot(Snapshot { event_sequence: EVENTS_BEFORE + 1, ..snapshot(102) }).await;
    assert_eq!(next(&session).await, SessionEvent::Resynchronised { missed: 1 });
    assert_eq!(next(&session).await, SessionEvent::Happened(Event::ActorAdded(actor(70))));
    // What was contained in the description is not applied again when it arrives after all.
    server.put_event(EVENTS_BEFORE + 1, Event::ActorRemoved { id: OWN }).await;
    server.put_event(EVENTS_BEFORE + 2, Event::ActorRemoved { id: 70 }).await;
    assert_eq!(next(&session).await, SessionEvent::Happened(Event::ActorRemoved { id: 70 }));
    assert_eq!(ids(&session), [OWN]);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_old_description_is_not_believed() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    *server.description.lock().unwrap() = description(EVENTS_BEFORE, &[]);
    server.put_event(EVENTS_BEFORE + 2, Event::ActorAdded(actor(80))).await;
    assert!(matches!(next(&session).await, SessionEvent::Happened(_)));
    // The session asks one thing after the other: at the second question it has seen the answer to the first. The old
    // description must not take out what is there.
    let asked_twice = async {
        while server.described.load(Ordering::Relaxed) < 2 {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    soon("two questions", asked_twice).await;
    assert_eq!(ids(&session), [OWN, 80]);
    *server.description.lock().unwrap() = description(EVENTS_BEFORE + 2, &[OWN, 80, 81]);
    eventually(&session, "a new description", |s| s.events_missed == 1).await;
    assert_eq!(ids(&session), [OWN, 80, 81]);
}
