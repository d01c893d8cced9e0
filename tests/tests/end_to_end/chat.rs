//! What players say reaches everybody, once, in order, and not without end.

use pita_client::{ClientError, Event, Session, SessionEvent};
use pita_protocol::message::SayRefusal;

use crate::clients::connect_three;
use crate::{SOON, start_patient_server};

/// The next thing that somebody says.
async fn next_said(session: &Session) -> (u16, String) {
    let said = tokio::time::timeout(SOON, async {
        loop {
            match session.next_event().await {
                Some(SessionEvent::Happened(Event::Said { slot, text })) => return (slot, text),
                Some(_) => {}
                None => panic!("the session ended: {:?}", session.end()),
            }
        }
    });
    said.await.expect("nobody said anything in time")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn everybody_hears_what_is_said_and_nobody_is_flooded() {
    let (server, observer) = start_patient_server().await;
    let sessions = connect_three(&server.endpoint).await;
    let [ann, bob, _] = &sessions;
    ann.say("hello\n\u{202e}you").await.unwrap();
    bob.say("Grüße, 羊!").await.unwrap();
    for session in &sessions {
        assert_eq!(next_said(session).await, (ann.slot(), "hello you".to_owned()));
        assert_eq!(next_said(session).await, (bob.slot(), "Grüße, 羊!".to_owned()));
    }
    assert_eq!(ann.say("\u{200b}").await, Err(ClientError::NotSaid(SayRefusal::Empty)));
    assert!(matches!(ann.say("").await, Err(ClientError::BadArgument(_))));
    assert!(matches!(ann.say(&"x".repeat(201)).await, Err(ClientError::BadArgument(_))));
    let mut said = 0;
    let refused = loop {
        match ann.say("spam").await {
            Ok(()) => said += 1,
            Err(error) => break error,
        }
        assert!(said < 100, "there is an end to it");
    };
    assert!(matches!(refused, ClientError::NotSaid(SayRefusal::TooOften { wait_ms: 1..=1500 })), "{refused}");
    for _ in 0..said {
        assert_eq!(next_said(bob).await, (ann.slot(), "spam".to_owned()));
    }
    bob.say("still here").await.unwrap();
    assert_eq!(next_said(bob).await, (bob.slot(), "still here".to_owned()));
    assert_eq!(observer.status().await.unwrap().refused.say_refused, 2);
    for session in sessions {
        session.leave().await;
    }
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
