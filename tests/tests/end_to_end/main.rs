//! PITA from end to end: real server processes and real clients over loopback.
//!
//! Every test has a server of its own on a free port, so that tests and runs never meet. Every wait is for a condition
//! and bounded.

mod clients;
mod daemon;
mod driving;
mod frozen;
mod leaving;
mod programs;
mod refusals;
mod run;

use std::future::Future;
use std::ops::{Deref, DerefMut};
use std::process::Command;
use std::sync::{PoisonError, RwLock, RwLockReadGuard};
use std::time::Duration;

use pita_tests::observer::Observer;
use pita_tests::process::ProcessError;
use pita_tests::server_process::ServerProcess;

/// How long anything may take that should happen soon; generous, for machines with other things to do.
const SOON: Duration = Duration::from_secs(20);

/// How long a program may take that does something of its own.
const LONG: Duration = Duration::from_secs(60);

/// How often a condition is looked at that nothing announces.
const POLL: Duration = Duration::from_millis(20);

/// `pita-server` of this build.
fn pita_server() -> Command {
    Command::new(env!("CARGO_BIN_EXE_pita-test-server"))
}

/// Held for reading by tests beside which others may run, for writing by one that measures time and runs alone.
static COMPANY: RwLock<()> = RwLock::new(());

/// Lets no test run that wants to be alone, while this lives. At most one a test: a second one could wait for ever.
fn in_company() -> RwLockReadGuard<'static, ()> {
    COMPANY.read().unwrap_or_else(PoisonError::into_inner)
}

/// A server beside those of other tests.
struct Server {
    running: ServerProcess,
    _company: RwLockReadGuard<'static, ()>,
}

impl Server {
    /// Starts `command`, a `pita-server run`.
    fn start(command: &mut Command) -> Self {
        let company = in_company();
        let running = ServerProcess::start(command).unwrap_or_else(|error| panic!("{error}"));
        Self { running, _company: company }
    }

    /// Ends it in order.
    fn stop(self) -> Result<(), ProcessError> {
        self.running.stop()
    }
}

impl Deref for Server {
    type Target = ServerProcess;
    fn deref(&self) -> &ServerProcess {
        &self.running
    }
}

impl DerefMut for Server {
    fn deref_mut(&mut self) -> &mut ServerProcess {
        &mut self.running
    }
}

/// A running server and a connection that asks it questions.
async fn start_server() -> (Server, Observer) {
    let server = Server::start(pita_server().arg("run"));
    let observer = observe(&server).await;
    (server, observer)
}

/// The same, of a server that waits ten minutes for a silent player.
async fn start_patient_server() -> (Server, Observer) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("patient.toml");
    std::fs::write(&file, "[sessions]\ninput_timeout_ms = 600000\n").unwrap();
    let server = Server::start(pita_server().arg("run").arg("--config").arg(&file));
    let observer = observe(&server).await;
    (server, observer)
}

/// A connection that asks `server` questions.
async fn observe(server: &ServerProcess) -> Observer {
    Observer::connect(&server.endpoint).await.unwrap_or_else(|error| panic!("{error}"))
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

/// Waits until the server has so many sessions.
async fn await_clients(observer: &Observer, clients: u32) {
    let what = format!("{clients} clients");
    eventually(&what, async || {
        let status = observer.status().await.unwrap_or_else(|error| panic!("{error}"));
        (status.clients == clients).then_some(())
    })
    .await;
}
