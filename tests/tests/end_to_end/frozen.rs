//! A client that stops reading must not stop the others.
//!
//! Zenoh lingers up to 10 s over the close of a connection that does not drain, and the close blocks one of its two
//! receive workers: without `TCP_LINGER_TIMEOUT=0` in `.cargo/config.toml`, frozen clients stop everybody's input as
//! soon as their lease ends.

use std::sync::PoisonError;
use std::time::Duration;

use pita_client::Session;
use pita_tests::process::Signal;
use pita_tests::server_process::ServerProcess;
use tokio::sync::watch;

use crate::clients::{ahead, bots_process, connect_three, next_snapshot};
use crate::{COMPANY, await_clients, eventually, observe, pita_server};

/// Clients that freeze: more than Zenoh has receive workers.
const FROZEN: usize = 8;

/// Clients that go on.
const HEALTHY: usize = 3;

/// How long the healthy clients are watched before, for what is usual on this machine: as long as a lease, so that a
/// hiccup of the machine is as likely before as during.
const WATCHED_BEFORE: Duration = Duration::from_secs(5);

/// How long they are watched after the last frozen one was closed.
const WATCHED_AFTER: Duration = Duration::from_secs(2);

/// By how many ticks frozen clients may delay the others' inputs.
const DELAY_TICKS_MAX: u64 = 2;

/// How often the whole is tried: a hiccup of the machine spoils one round, frozen clients that delay others spoil all.
const ROUNDS: usize = 3;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[expect(
    clippy::await_holding_lock,
    reason = "who waits for the lock is another test, on a thread and a runtime of its own"
)]
async fn frozen_clients_do_not_delay_the_others() {
    let _alone = COMPANY.write().unwrap_or_else(PoisonError::into_inner);
    let mut rounds = Vec::new();
    while rounds.len() < ROUNDS {
        let (before, during) = freeze_some().await;
        if during <= before + DELAY_TICKS_MAX {
            return;
        }
        rounds.push((before, during));
    }
    panic!("most ticks between inputs, before and while {FROZEN} clients were frozen, round by round: {rounds:?}");
}

/// The most ticks from one input's effect to the next one's: before some clients freeze, and until all of them are
/// closed.
async fn freeze_some() -> (u64, u64) {
    let server = ServerProcess::start(pita_server().arg("run")).unwrap_or_else(|error| panic!("{error}"));
    let observer = observe(&server).await;
    let sessions: [Session; HEALTHY] = connect_three(&server.endpoint).await;
    let sockets = server.process.sockets();
    let bots = bots_process(&server.endpoint, FROZEN);
    await_clients(&observer, (HEALTHY + FROZEN) as u32).await;

    let before = longest_gaps(&sessions, tokio::time::sleep(WATCHED_BEFORE)).await;
    assert!(server.process.sockets() >= sockets + FROZEN);
    bots.process.signal(Signal::STOP).unwrap();
    let during = longest_gaps(&sessions, async {
        await_clients(&observer, HEALTHY as u32).await;
        eventually("the connections to be closed", async || (server.process.sockets() <= sockets).then_some(())).await;
        tokio::time::sleep(WATCHED_AFTER).await;
    })
    .await;
    eprintln!("ticks between inputs, before {before:?}, frozen and closed {during:?}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
    (before.into_iter().max().unwrap_or(1), during.into_iter().max().unwrap_or(u64::MAX))
}

/// For each session, the longest run of ticks from one input's effect to the next one's, while `scene` plays. Each sends
/// an input on each snapshot, so that a delay either way shows.
async fn longest_gaps(sessions: &[Session; HEALTHY], scene: impl Future<Output = ()>) -> [u64; HEALTHY] {
    let (over, playing) = watch::channel(false);
    let [ann, bob, cid] = sessions.each_ref().map(|session| longest_gap(session, playing.clone()));
    let play = async {
        scene.await;
        over.send_replace(true);
    };
    let (ann, bob, cid, ()) = tokio::join!(ann, bob, cid, play);
    [ann, bob, cid]
}

async fn longest_gap(session: &Session, over: watch::Receiver<bool>) -> u64 {
    let mut longest = 0;
    let mut effect = None;
    while !*over.borrow() {
        let snapshot = next_snapshot(session).await;
        session.send(ahead()).await.unwrap_or_else(|error| panic!("{error}"));
        let ack = snapshot.ack();
        let (sequence, since) = *effect.get_or_insert((ack.sequence, snapshot.tick()));
        longest = longest.max(snapshot.tick() - since);
        if ack.sequence > sequence {
            effect = Some((ack.sequence, snapshot.tick()));
        }
    }
    longest
}
