//! Sessions that go on after their connection was lost, and names that stay out.

use pita_client::{ClientError, Session, SessionEvent};
use pita_protocol::message::{Event, Refusal};

use crate::clients::{ahead, connect, ground_distance, next_snapshot, position};
use crate::{SOON, await_clients, eventually, start_configured, start_server};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cut_session_goes_on_in_the_same_car() {
    let (server, observer) = start_server().await;
    let witness = connect(&server.endpoint, "witness").await;
    let cut = connect(&server.endpoint, "cut").await;
    let (slot, actor, ticket) = (cut.slot(), cut.actor().unwrap(), cut.resume_ticket());
    let start = position(&cut, &*next_snapshot(&cut).await, actor).unwrap();
    let left_at = eventually("the car to drive off", async || {
        cut.send(ahead()).await.unwrap();
        position(&cut, &*next_snapshot(&cut).await, actor).filter(|&now| ground_distance(start, now) > 3.0)
    })
    .await;
    drop(cut);
    await_clients(&observer, 1).await;

    let taken = Session::connect(&server.endpoint, "cut").await.expect_err("its name is kept for it");
    assert!(matches!(taken, ClientError::Refused(Refusal::NameTaken { .. })), "{taken}");
    let builder = |ticket| Session::builder(&server.endpoint, "cut").resume(ticket);
    let resumed = builder(ticket.clone()).connect().await.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((resumed.slot(), resumed.actor()), (slot, Some(actor)));
    let found_at = position(&resumed, &*next_snapshot(&resumed).await, actor).unwrap();
    assert!(ground_distance(start, found_at) > 2.0, "{start:?}, left at {left_at:?}, found at {found_at:?}");
    let again = builder(ticket).connect().await.expect_err("a ticket is good for once");
    assert!(matches!(again, ClientError::Refused(Refusal::Over)), "{again}");

    let sequence = resumed.send(ahead()).await.unwrap();
    eventually("the effect of an input", async || {
        (next_snapshot(&resumed).await.ack().sequence >= sequence).then_some(())
    })
    .await;
    resumed.leave().await;
    let mut told = Vec::new();
    let is_removal = |told: &SessionEvent| *told == SessionEvent::Happened(Event::ActorRemoved { id: actor });
    while !told.last().is_some_and(is_removal) {
        let next = tokio::time::timeout(SOON, witness.next_event()).await;
        told.push(next.unwrap_or_else(|_| panic!("told no more than {told:?}")).expect("the witness stays"));
    }
    assert!(
        !told.iter().any(|event| matches!(event, SessionEvent::Happened(Event::Left { .. }))),
        "the cut was no one's business: {told:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_over_cannot_go_on_and_banned_names_stay_out() {
    let strict = "[sessions]\nresume_grace_ms = 0\n[bans]\nnames = [\"mallory\"]\n";
    let (server, observer) = start_configured(strict).await;
    let banned = Session::connect(&server.endpoint, "Mallory").await.expect_err("a banned name");
    assert!(matches!(banned, ClientError::Refused(Refusal::Banned { .. })), "{banned}");

    let session = connect(&server.endpoint, "ann").await;
    let ticket = session.resume_ticket();
    session.leave().await;
    await_clients(&observer, 0).await;
    let over = Session::builder(&server.endpoint, "ann").resume(ticket).connect().await.expect_err("it has left");
    assert!(matches!(over, ClientError::Refused(Refusal::Over)), "{over}");
    let refused = observer.status().await.unwrap().refused;
    assert_eq!((refused.join_name, refused.join_over), (1, 1));
}
