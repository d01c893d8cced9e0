//! A client that stops reading must not stop the others.
//!
//! Zenoh lingers up to 10 s over the close of a connection that does not drain, and the close blocks one of its two
//! receive workers: without `TCP_LINGER_TIMEOUT=0` in `.cargo/config.toml`, frozen clients stop everybody's input as
//! soon as their lease ends.

use std::time::{Duration, Instant};

use pita_client::Session;
use pita_tests::process::Signal;
use tokio::sync::watch;

use crate::clients::{ahead, bots_process, connect_three, next_snapshot};
use crate::{await_clients, eventually, stalls_while, start_server};

/// Clients that freeze: more than Zenoh has receive workers.
const FROZEN: usize = 8;

/// Clients that go on.
const HEALTHY: usize = 3;

/// How long the healthy clients are watched before, and after the last frozen one was closed.
const WATCHED: Duration = Duration::from_secs(2);

/// By how many ticks frozen clients may delay the others' inputs.
const DELAY_TICKS_MAX: u64 = 2;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frozen_clients_do_not_delay_the_others() {
    let (server, observer) = start_server().await;
    let sessions: [Session; HEALTHY] = connect_three(&server.endpoint).await;
    let sockets = server.process.sockets();
    let bots = bots_process(&server.endpoint, FROZEN);
    await_clients(&observer, (HEALTHY + FROZEN) as u32).await;

    let (usual, _) = longest_gap(&sessions, tokio::time::sleep(WATCHED)).await;
    assert!(server.process.sockets() >= sockets + FROZEN);
    let since = observer.status().await.unwrap().tick;
    bots.process.signal(Signal::STOP).unwrap();
    let frozen_at = Instant::now();
    let mut closed_after = Duration::ZERO;
    let (worst, own_stall) = longest_gap(&sessions, async {
        await_clients(&observer, HEALTHY as u32).await;
        eventually("the connections to be closed", async || (server.process.sockets() <= sockets).then_some(())).await;
        closed_after = frozen_at.elapsed();
        tokio::time::sleep(WATCHED).await;
    })
    .await;

    // What stops the whole machine stops these clients and the ticks too. Neither waits for the server's receivers.
    let ticks = observer.ticks(since).await.unwrap().records;
    let server_stall = Duration::from_micros(ticks.iter().map(|tick| u64::from(tick.late_us)).max().unwrap_or(0));
    let stalled = (own_stall.max(server_stall).as_secs_f64() * f64::from(sessions[0].tick_hz())).ceil() as u64;
    let found = format!(
        "an input took effect every {usual} ticks at worst before, every {worst} while {FROZEN} clients were frozen and \
         closed (after {closed_after:?}); the machine stalled these clients for {own_stall:?}, the ticks for {server_stall:?}"
    );
    assert!(worst <= usual + stalled + DELAY_TICKS_MAX, "{found}");
    eprintln!("{found}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

/// The longest run of ticks from one input's effect to the next one's in any of `sessions` while `scene` plays, and how
/// long the runtime itself kept a timer waiting. Each session sends an input on each snapshot, so that a delay either
/// way shows.
async fn longest_gap(sessions: &[Session; HEALTHY], scene: impl Future<Output = ()>) -> (u64, Duration) {
    let (over, playing) = watch::channel(false);
    let [ann, bob, cid] = sessions.each_ref().map(|session| longest_gap_of(session, playing.clone()));
    let play = async {
        scene.await;
        over.send_replace(true);
    };
    let (ann, bob, cid, stall) = tokio::join!(ann, bob, cid, stalls_while(play));
    (ann.max(bob).max(cid), stall)
}

async fn longest_gap_of(session: &Session, over: watch::Receiver<bool>) -> u64 {
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
