//! How a session comes about, and how it is refused.

use std::time::Duration;

use pita_client::{ClientError, Controls, Event, Session, SessionEvent};
use pita_protocol::{
    PROTOCOL_VERSION, WireError, encode,
    message::{EventMessage, JoinReply, Refusal, Role},
};
use zenoh::{Wait, qos::CongestionControl};

use crate::{
    SOON, builder,
    fake_server::{self, EPOCH, EVENTS_BEFORE, FakeServer, SLOT, accept, actor},
    soon,
};

async fn refused(server: &FakeServer) -> ClientError {
    let connected = soon("an answer", builder(server).connect()).await;
    connected.expect_err("the server does not let it in")
}

#[tokio::test(flavor = "multi_thread")]
async fn joins_finds_the_arena_and_sends_sealed_inputs() {
    let server = FakeServer::start().await;
    let session = Session::connect(&server.endpoint, "Wu").await.unwrap();
    assert_eq!((session.slot(), session.actor(), session.tick_hz()), (SLOT, Some(u32::from(SLOT)), 30));
    assert_eq!(session.description().title, "A fake");
    assert_eq!(server.liveliness().await, (format!("pita/fake/live/{SLOT}/{EPOCH}"), true));

    let controls = Controls { throttle: 0.5, ..Controls::default() };
    for sequence in 1..=3 {
        assert_eq!(session.send(controls).await, Ok(sequence));
        let packet = server.input().await;
        assert_eq!((packet.epoch, packet.leave), (EPOCH, false));
        let sequences: Vec<u32> = packet.frames.iter().map(|frame| frame.sequence).collect();
        assert_eq!(sequences, (1..=sequence).collect::<Vec<_>>());
        assert!(packet.frames.iter().all(|frame| frame.controls == controls && frame.tick > 100));
    }
    let bad = Controls { steer: f32::NAN, ..Controls::default() };
    assert!(matches!(session.send(bad).await, Err(ClientError::BadArgument(WireError::Content { .. }))));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_spectator_drives_nothing_and_is_kept_alive() {
    let server = FakeServer::start().await;
    let session = builder(&server).spectator().connect().await.unwrap();
    assert_eq!(session.actor(), None);
    assert_eq!(session.send(Controls::default()).await, Err(ClientError::Spectator));
    let (first, second) = (server.input().await, server.input().await);
    assert!(second.frames.last().unwrap().sequence > first.frames.last().unwrap().sequence);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_event_between_description_and_answer_is_not_lost() {
    // The event goes out before the reply does, as when somebody else joins at the same tick.
    let publisher: std::sync::Arc<std::sync::OnceLock<zenoh::Session>> = Default::default();
    let events = std::sync::Arc::clone(&publisher);
    let server = FakeServer::answering(Box::new(move |_| {
        let event = EventMessage { sequence: EVENTS_BEFORE + 1, tick: 100, event: Event::ActorAdded(actor(99)) };
        let put = events.get().unwrap().put("pita/fake/event", encode(&event));
        put.congestion_control(CongestionControl::Block).wait().unwrap();
        Some(accept(SLOT, Role::Player))
    }))
    .await;
    publisher.set(server.zenoh.clone()).unwrap();
    let session = builder(&server).connect().await.unwrap();
    assert_eq!(
        soon("the event", session.next_event()).await,
        Some(SessionEvent::Happened(Event::ActorAdded(actor(99))))
    );
    assert!(session.roster().actor(99).is_some());
}

#[tokio::test(flavor = "multi_thread")]
async fn refusals_are_typed_and_say_what_to_do() {
    let full = Refusal::Full { slots: 64 };
    let version = Refusal::Version { server: 2, client: 1 };
    for (refusal, advice) in [(full, "try again later"), (version, "use a client of the server's version")] {
        let reply = encode(&JoinReply::Refused(refusal.clone()));
        let server = FakeServer::answering(Box::new(move |_| Some(reply.clone()))).await;
        let error = refused(&server).await;
        assert_eq!(error, ClientError::Refused(refusal));
        assert!(error.to_string().contains(advice), "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_answer_of_another_version_names_both() {
    let mut reply = accept(SLOT, Role::Player);
    reply[0] = 200;
    let server = FakeServer::answering(Box::new(move |_| Some(reply.clone()))).await;
    assert_eq!(refused(&server).await, ClientError::Version { server: 200, client: PROTOCOL_VERSION });
}

#[tokio::test(flavor = "multi_thread")]
async fn an_answer_that_cannot_be_read_is_an_error() {
    for reply in [Vec::new(), vec![1, 2, 3], vec![0xFF; 400], {
        let mut cut = accept(SLOT, Role::Player);
        cut.pop();
        cut
    }] {
        let server = FakeServer::answering(Box::new(move |_| Some(reply.clone()))).await;
        let error = refused(&server).await;
        let is_typed = matches!(error, ClientError::BadAnswer { question: "join", .. } | ClientError::Version { .. });
        assert!(is_typed, "{error:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn silence_and_absence_are_told_apart() {
    let server = FakeServer::answering(Box::new(|_| None)).await;
    let impatient = builder(&server).connect_timeout(Duration::from_millis(300));
    let error = soon("an error", impatient.clone().connect()).await.unwrap_err();
    assert!(matches!(&error, ClientError::NoArena { arena: Some(arena), .. } if arena == "fake"), "{error:?}");
    let elsewhere = soon("an error", impatient.arena("elsewhere").connect()).await.unwrap_err();
    assert!(matches!(&elsewhere, ClientError::NoArena { arena: Some(arena), .. } if arena == "elsewhere"));
    assert!(error.is_worth_retrying());

    let endpoint = server.endpoint.clone();
    server.zenoh.close().await.unwrap();
    drop(server);
    let nobody = soon("an error", Session::connect(&endpoint, "Wu")).await.unwrap_err();
    assert!(matches!(&nobody, ClientError::Unreachable { .. }) && nobody.is_worth_retrying(), "{nobody:?}");
    assert!(nobody.to_string().contains("cargo run --release"), "{nobody}");
}

/// Zenoh has a word of its own for that, which a client that is kept from a core meanwhile found before it saw that its
/// patience was over.
#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_does_not_answer_in_time_is_not_said_to_answer_nonsense() {
    let server = FakeServer::answering(Box::new(|_| {
        std::thread::sleep(Duration::from_secs(5));
        None
    }))
    .await;
    let connecting = builder(&server).connect_timeout(Duration::from_secs(2)).connect();
    let held_up = async {
        tokio::time::sleep(Duration::from_secs(1)).await;
        std::thread::sleep(Duration::from_secs(3));
    };
    let error = tokio::join!(connecting, held_up).0.unwrap_err();
    assert!(matches!(&error, ClientError::NoArena { .. }) && error.is_worth_retrying(), "{error:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn bad_arguments_are_refused_before_anything_is_sent() {
    for endpoint in ["", "nonsense", "tcp/", "carrier-pigeon/1.2.3.4:5", "tcp/127.0.0.1:99999\", \"x"] {
        let error = soon("an error", Session::connect(endpoint, "Wu")).await.unwrap_err();
        assert!(matches!(error, ClientError::Unreachable { .. }), "{endpoint}: {error:?}");
    }
    let server = FakeServer::start().await;
    for name in ["", "a\nb", &"x".repeat(33)] {
        let error = Session::connect(&server.endpoint, name).await.unwrap_err();
        assert!(matches!(error, ClientError::BadArgument(WireError::Content { field: "name", .. })), "{error:?}");
    }
    let error = builder(&server).arena("a/b").connect().await.unwrap_err();
    assert_eq!(error, ClientError::BadArgument(WireError::ArenaName));
}

#[tokio::test(flavor = "multi_thread")]
async fn several_arenas_have_to_be_chosen_from() {
    let mut server = FakeServer::start().await;
    server.also_run("other").await;
    let anywhere = Session::builder(&server.endpoint, "Wu").connect_timeout(SOON);
    let error = soon("an error", anywhere.connect()).await.unwrap_err();
    assert_eq!(error, ClientError::SeveralArenas(vec![fake_server::ARENA.into(), "other".into()]));
}
