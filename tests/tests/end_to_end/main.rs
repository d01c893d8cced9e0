//! PITA from end to end: real server processes and real clients over loopback.
//!
//! Every test has a server of its own on a free port, so that tests and runs never meet. Every wait is for a condition
//! and bounded.

mod bad_network;
mod budget;
mod cells;
mod chat;
mod clients;
mod daemon;
mod driving;
mod flooded;
mod frozen;
mod kinds;
mod leaving;
mod programs;
mod refusals;
mod reloading;
mod resuming;
mod routers;
mod run;

use std::future::Future;
use std::process::Command;
use std::time::{Duration, Instant};

use pita_tests::observer::Observer;
use pita_tests::server_process::ServerProcess;

/// How long anything may take that should happen soon; generous, for machines with other things to do.
const SOON: Duration = Duration::from_secs(20);

/// How long a program may take that does something of its own.
const LONG: Duration = Duration::from_secs(60);

/// How often a condition is looked at that nothing announces.
const POLL: Duration = Duration::from_millis(20);

/// How often it is looked whether the machine stalled.
const METRONOME: Duration = Duration::from_millis(5);

/// `pita-server` of this build.
fn pita_server() -> Command {
    Command::new(env!("CARGO_BIN_EXE_pita-test-server"))
}

/// Starts `command`, a `pita-server run`, and a connection that asks the server questions.
async fn observed(command: &mut Command) -> (ServerProcess, Observer) {
    let server = ServerProcess::start(command).unwrap_or_else(|error| panic!("{error}"));
    let observer = Observer::connect(&server.endpoint).await.unwrap_or_else(|error| panic!("{error}"));
    (server, observer)
}

/// A running server and a connection that asks it questions.
async fn start_server() -> (ServerProcess, Observer) {
    observed(pita_server().arg("run")).await
}

/// The same, of a server that waits ten minutes for a silent player.
async fn start_patient_server() -> (ServerProcess, Observer) {
    start_configured("[sessions]\ninput_timeout_ms = 600000\n").await
}

/// The same, of a server with `configuration`.
async fn start_configured(configuration: &str) -> (ServerProcess, Observer) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("server.toml");
    std::fs::write(&file, configuration).unwrap();
    observed(pita_server().arg("run").arg("--config").arg(&file)).await
}

/// Waits until `check` answers something.
async fn eventually<T, F: Future<Output = Option<T>>>(what: &str, mut check: impl FnMut() -> F) -> T {
    let waited = tokio::time::timeout(SOON, async {
        loop {
            if let Some(found) = check().await {
                return found;
            }
            tokio::time::sleep(POLL).await;
        }
    });
    waited.await.unwrap_or_else(|_| panic!("waited {SOON:?} in vain: {what}"))
}

/// Plays `scene`; answers how late a timer of this process was meanwhile, at worst.
async fn stalls_while(scene: impl Future<Output = ()>) -> Duration {
    let mut longest = Duration::ZERO;
    let mut scene = std::pin::pin!(scene);
    loop {
        let due = Instant::now() + METRONOME;
        tokio::select! {
            () = &mut scene => return longest,
            () = tokio::time::sleep_until(due.into()) => longest = longest.max(due.elapsed()),
        }
    }
}

/// Waits until the server has so many sessions.
async fn await_clients(observer: &Observer, clients: u32) {
    let what = format!("{clients} clients");
    eventually(&what, async || {
        let status = observer.status().await.unwrap_or_else(|error| panic!("{error}"));
        (status.clients == clients).then_some(())
    })
    .await;
}
