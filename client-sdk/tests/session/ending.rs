//! How sessions end: the server closes, takes one out, or falls silent; the client leaves or vanishes.

use std::time::{Duration, Instant};

use pita_client::{ClientError, Controls, Event, Session, SessionEnd, SessionEvent};
use pita_protocol::message::Snapshot;

use crate::{
    builder,
    fake_server::{EVENTS_BEFORE, FakeServer, SLOT, description, snapshot},
    player, soon,
};

/// How long a session that leaves waits for the server's word, at the least.
const LEAVE_TIMEOUT: Duration = Duration::from_millis(900);

/// Every way of asking tells of the same end.
async fn assert_ends(session: Session, expected: impl Fn(&SessionEnd) -> bool) {
    let end = loop {
        match soon("the end", session.next_snapshot()).await {
            Ok(_) => continue,
            Err(end) => break end,
        }
    };
    assert!(expected(&end), "{end:?}");
    assert_eq!(session.end(), Some(end.clone()));
    assert_eq!(session.send(Controls::default()).await, Err(ClientError::Ended(end)));
    soon("the last event", async { while session.next_event().await.is_some() {} }).await;
    soon("leaving", session.leave()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_closes_says_so() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    let closing = Event::Closing { reason: "maintenance".into() };
    server.put_event(EVENTS_BEFORE + 1, closing.clone()).await;
    assert_eq!(soon("the event", session.next_event()).await, Some(SessionEvent::Happened(closing)));
    assert_ends(session, |end| *end == SessionEnd::Closed { reason: "maintenance".into() }).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_was_taken_out_learns_why() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    // Not the own slot, and the own slot's earlier session: neither is meant.
    server.put_event(EVENTS_BEFORE, Event::Left { slot: SLOT, reason: "earlier".into() }).await;
    server.put_event(EVENTS_BEFORE + 1, Event::Left { slot: SLOT + 1, reason: "other".into() }).await;
    server.put_event(EVENTS_BEFORE + 2, Event::Left { slot: SLOT, reason: "no input for 5 s".into() }).await;
    assert_ends(session, |end| *end == SessionEnd::Removed { reason: "no input for 5 s".into() }).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_whose_actor_is_gone_ends_though_nobody_says_so() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    *server.description.lock().unwrap() = description(EVENTS_BEFORE + 2, &[]);
    server.put_snapshot(Snapshot { event_sequence: EVENTS_BEFORE + 2, ..snapshot(102) }).await;
    assert_ends(session, |end| matches!(end, SessionEnd::Removed { .. })).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn silence_ends_a_session() {
    let server = FakeServer::start().await;
    let patience = Duration::from_millis(500);
    let session = builder(&server).loss_timeout(patience).connect().await.unwrap();
    assert_ends(session, |end| matches!(end, SessionEnd::Lost { silent_for } if *silent_for >= patience)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_vanishes_ends_a_session() {
    let server = FakeServer::start().await;
    let session = builder(&server).loss_timeout(Duration::from_millis(500)).connect().await.unwrap();
    server.zenoh.close().await.unwrap();
    assert_ends(session, |end| matches!(end, SessionEnd::Lost { .. })).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn leaving_says_good_bye_and_waits_for_the_word() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    assert!(server.liveliness().await.1);
    let began = Instant::now();
    let leaving = tokio::spawn(session.leave());
    let packet = server.input().await;
    assert!(packet.leave);
    let waits = !leaving.is_finished() || began.elapsed() >= LEAVE_TIMEOUT;
    assert!(waits, "it waits until the server has heard it");
    server.put_event(EVENTS_BEFORE + 1, Event::Left { slot: SLOT, reason: "left".into() }).await;
    let counts = soon("leaving", leaving).await.unwrap();
    assert_eq!(counts.snapshots_received, 1);
    assert!(!server.liveliness().await.1);
}

#[tokio::test(flavor = "multi_thread")]
async fn leaving_a_deaf_server_takes_a_bounded_time() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    let began = Instant::now();
    soon("leaving", session.leave()).await;
    assert!(began.elapsed() >= LEAVE_TIMEOUT, "it gave the server a chance");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_session_takes_its_token_along() {
    let server = FakeServer::start().await;
    let session = player(&server).await;
    assert!(server.liveliness().await.1);
    drop(session);
    assert!(!server.liveliness().await.1);
}
