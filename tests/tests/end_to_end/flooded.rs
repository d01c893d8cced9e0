//! Rubbish by the ten thousand: the server throws it away, and its ticks do not notice.

use std::time::{Duration, Instant};

use pita_protocol::{
    Message, encode,
    message::{CellId, GRANTS_MAX, InputPacket, KeyframesRequest, KeyframesWanted},
};
use rand::{RngExt, SeedableRng, rngs::StdRng};

use crate::clients::{ahead, connect, next_snapshot};
use crate::{eventually, start_patient_server};

/// Messages, and how many are sent at once.
const MESSAGES: usize = 30_000;
const AT_ONCE: usize = 500;
/// Between two such heaps.
const PAUSE: Duration = Duration::from_millis(20);
/// Questions for the keyframes of all cells, which take as long to answer as any.
const QUESTIONS: usize = 6_000;
/// Share of a tick's period that its 99th percentile may take.
const TICK_P99_MAX: f64 = 0.5;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_rubbish_is_thrown_away_and_delays_no_tick() {
    let (server, observer) = start_patient_server().await;
    let honest = connect(&server.endpoint, "honest").await;
    let since = observer.status().await.unwrap().tick;
    let mut random = StdRng::seed_from_u64(2002);
    let keys = observer.keys();
    let began = Instant::now();
    for sent in 0..MESSAGES {
        let length = random.random_range(0..2 * InputPacket::MAX_BYTES);
        let mut bytes: Vec<u8> = (0..length).map(|_| random.random()).collect();
        // Some begin as they should.
        if sent % 3 == 0 {
            let head = encode(&pita_protocol::message::TicksRequest { since: 1 });
            bytes.splice(0..head.len().min(bytes.len()), head);
        }
        let slot = random.random_range(0..300);
        observer.session().put(keys.input(slot), bytes).await.unwrap();
        if sent % AT_ONCE == 0 {
            honest.send(ahead()).await.unwrap();
            tokio::time::sleep(PAUSE).await;
        }
    }
    let sequence = honest.send(ahead()).await.unwrap();
    eventually("the honest client's input", async || {
        (next_snapshot(&honest).await.ack().sequence >= sequence).then_some(())
    })
    .await;

    let status = observer.status().await.unwrap();
    let mut walls: Vec<u32> = observer.ticks(since).await.unwrap().records.iter().map(|tick| tick.wall_us).collect();
    walls.sort_unstable();
    let p99_ms = f64::from(walls[walls.len() * 99 / 100]) * 1e-3;
    let refused = status.refused;
    let thrown = refused.input_forged + refused.input_no_session + refused.input_too_long + refused.input_malformed;
    let found = format!(
        "{MESSAGES} messages in {:?}, {thrown} refused, the rest dropped before; tick p99 {p99_ms:.2} ms over {} ticks; {:.1} MB",
        began.elapsed(),
        walls.len(),
        status.memory_bytes as f64 * 1e-6
    );
    eprintln!("{found}");
    assert!(thrown > 100, "{found}");
    assert!(p99_ms < TICK_P99_MAX * 1e3 / f64::from(status.tick_hz), "{found}");
    assert_eq!(status.clients, 1, "{found}");
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_questions_for_keyframes_delays_neither_ticks_nor_players() {
    let (server, observer) = start_patient_server().await;
    let honest = connect(&server.endpoint, "honest").await;
    next_snapshot(&honest).await;
    let since = observer.status().await.unwrap().tick;
    let before = honest.statistics();
    let wanted = |x| KeyframesWanted { cell: CellId { x, z: 0 }, have: 0 };
    let cells: Vec<_> = (-(GRANTS_MAX as i16) / 2..).map(wanted).take(GRANTS_MAX).collect();
    let question = encode(&KeyframesRequest { cells });
    for sent in 0..QUESTIONS {
        let asked = observer.session().get(observer.keys().keyframes()).payload(question.clone());
        asked.timeout(Duration::from_secs(1)).callback(drop).await.unwrap();
        if sent % (AT_ONCE / 5) == 0 {
            honest.send(ahead()).await.unwrap();
            tokio::time::sleep(PAUSE).await;
        }
    }
    let sequence = honest.send(ahead()).await.unwrap();
    eventually("the honest client's input", async || {
        (next_snapshot(&honest).await.ack().sequence >= sequence).then_some(())
    })
    .await;
    let counts = honest.statistics().since(&before);
    let mut walls: Vec<u32> = observer.ticks(since).await.unwrap().records.iter().map(|tick| tick.wall_us).collect();
    walls.sort_unstable();
    let p99_ms = f64::from(walls[walls.len() * 99 / 100]) * 1e-3;
    let status = observer.status().await.unwrap();
    let found = format!(
        "{QUESTIONS} questions; tick p99 {p99_ms:.2} ms over {} ticks; {} snapshots, {} missed; {:.1} MB",
        walls.len(),
        counts.snapshots_received,
        counts.snapshots_missed,
        status.memory_bytes as f64 * 1e-6
    );
    eprintln!("{found}");
    assert!(p99_ms < TICK_P99_MAX * 1e3 / f64::from(status.tick_hz), "{found}");
    assert!(counts.snapshots_received > 20 && counts.snapshots_missed == 0, "{found}");
    // Whoever comes then is answered.
    let newcomer = connect(&server.endpoint, "newcomer").await;
    next_snapshot(&newcomer).await;
    server.stop().unwrap_or_else(|error| panic!("{error}"));
}
