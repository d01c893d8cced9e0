//! Clients as these tests need them.

use std::path::Path;
use std::sync::Arc;

use pita_client::bots::ScriptKind;
use pita_client::{ReceivedSnapshot, Session};
use pita_protocol::message::Controls;
use pita_tests::loadtest::bots::Bots;

use crate::SOON;

/// A session, or a failed test.
pub async fn connect(endpoint: &str, name: &str) -> Session {
    Session::connect(endpoint, name).await.unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Three sessions: ann, bob and cid.
pub async fn connect_three(endpoint: &str) -> [Session; 3] {
    let [ann, bob, cid] = ["ann", "bob", "cid"].map(|name| connect(endpoint, name));
    tokio::join!(ann, bob, cid).into()
}

/// The next snapshot, or a failed test.
pub async fn next_snapshot(session: &Session) -> Arc<ReceivedSnapshot> {
    let next = tokio::time::timeout(SOON, session.next_snapshot()).await;
    next.expect("no snapshot in time").unwrap_or_else(|end| panic!("{end}"))
}

/// Where an actor is in a snapshot, m.
pub fn position(session: &Session, snapshot: &ReceivedSnapshot, actor: u32) -> Option<[f32; 3]> {
    let root = session.roster().root_slice(actor)?;
    let slices = snapshot.select(&[root]);
    let slice = slices.first()?;
    Some([slice.q[0], slice.q[1], slice.q[2]])
}

/// Distance on the ground, m.
pub fn ground_distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).hypot(a[2] - b[2])
}

/// Half throttle, straight on.
pub fn ahead() -> Controls {
    Controls { throttle: 0.5, ..Controls::default() }
}

/// `count` driving bots in a process of their own, all of them joined.
pub fn bots_process(endpoint: &str, count: usize) -> Bots {
    let program = Path::new(env!("CARGO_BIN_EXE_pita-loadtest"));
    let bots = Bots::start(program, endpoint, count, ScriptKind::Circle, None);
    let mut bots = bots.unwrap_or_else(|error| panic!("{error}"));
    bots.wait_until_joined(SOON).unwrap_or_else(|error| panic!("{error}"));
    bots
}
