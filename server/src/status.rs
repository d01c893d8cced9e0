//! `pita-server status`: asks a running server how it does. Owns how the command line asks a server anything.

use std::process::ExitCode;
use std::time::Duration;

use comfy_table::{Cell, CellAlignment, Table, presets};
use pita_protocol::message::Status;
use pita_protocol::{Message, decode, keys};
use serde_json::json;

use crate::cli::StatusArgs;
use crate::report;

/// Longest wait for the answer of a server that accepted the connection.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest wait for the connection itself.
const OPEN_TIMEOUT: Duration = Duration::from_secs(3);

/// Why there is no status.
#[derive(Debug, thiserror::Error)]
pub enum StatusError {
    /// Nobody listens there.
    #[error(
        "no server at {endpoint}: {reason}\nStart one with `cargo run --release`, or say where it is: --connect tcp/ADDRESS:PORT"
    )]
    NoServer {
        /// Where.
        endpoint: String,
        /// What Zenoh says.
        reason: String,
    },
    /// Connected, but nothing that speaks our protocol answered.
    #[error("{endpoint} accepts connections, but no PITA server answered within {} s", ANSWER_TIMEOUT.as_secs())]
    NoAnswer {
        /// Where.
        endpoint: String,
    },
    /// It answered something else.
    #[error("the server at {endpoint} answers what cannot be read: {reason}")]
    Unreadable {
        /// Where.
        endpoint: String,
        /// Why.
        reason: String,
    },
}

/// Prints the status of the server at `args.connect`.
pub fn run(args: &StatusArgs) -> ExitCode {
    let runtime = match tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return report::failure(&format!("cannot start threads: {error}")),
    };
    match runtime.block_on(ask(&args.connect)) {
        Ok(status) if args.json => report::print(&json_of(&status)),
        Ok(status) => report::print(&table_of(&status)),
        Err(error) => return report::failure(&error.to_string()),
    }
    ExitCode::SUCCESS
}

/// Asks the server at `endpoint`.
///
/// # Errors
/// [`StatusError`], within eight seconds.
pub async fn ask(endpoint: &str) -> Result<Status, StatusError> {
    let session = connect(endpoint).await?;
    question(&session, endpoint, keys::ANY_STATUS, Vec::new()).await
}

/// Connects to the server at `endpoint`.
///
/// # Errors
/// [`StatusError::NoServer`].
pub(crate) async fn connect(endpoint: &str) -> Result<zenoh::Session, StatusError> {
    let no_server = |reason: String| StatusError::NoServer { endpoint: endpoint.to_owned(), reason };
    let config = client_configuration(endpoint).map_err(|error| no_server(error.to_string()))?;
    tokio::time::timeout(OPEN_TIMEOUT, zenoh::open(config))
        .await
        .map_err(|_| no_server(format!("no connection within {} s", OPEN_TIMEOUT.as_secs())))?
        .map_err(|_| no_server("no connection".to_owned()))
}

/// Asks the server at `endpoint` on `key`, with `payload`.
///
/// # Errors
/// [`StatusError::NoAnswer`] and [`StatusError::Unreadable`].
pub(crate) async fn question<M: Message>(
    session: &zenoh::Session,
    endpoint: &str,
    key: &str,
    payload: Vec<u8>,
) -> Result<M, StatusError> {
    let unreadable = |reason: String| StatusError::Unreadable { endpoint: endpoint.to_owned(), reason };
    let asked = session.get(key).payload(payload).timeout(ANSWER_TIMEOUT);
    let replies = asked.await.map_err(|error| unreadable(error.to_string()))?;
    while let Ok(reply) = replies.recv_async().await {
        if let Ok(sample) = reply.result() {
            return decode(&sample.payload().to_bytes()).map_err(|error| unreadable(error.to_string()));
        }
    }
    Err(StatusError::NoAnswer { endpoint: endpoint.to_owned() })
}

/// A client that knows one server and looks for no other.
pub(crate) fn client_configuration(endpoint: &str) -> zenoh::Result<zenoh::Config> {
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"client\"")?;
    config.insert_json5("connect/endpoints", &json!([endpoint]).to_string())?;
    config.insert_json5("scouting/multicast/enabled", "false")?;
    config.insert_json5("scouting/gossip/enabled", "false")?;
    Ok(config)
}

fn json_of(status: &Status) -> String {
    let mut value = json!(status);
    // A 64-bit hash does not survive readers that know numbers only as f64.
    value["state_hash"] = json!(format!("{:016x}", status.state_hash));
    format!("{value:#}")
}

fn table_of(status: &Status) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY);
    let mut row = |name: &str, value: String| {
        table.add_row([Cell::new(name), Cell::new(value).set_alignment(CellAlignment::Right)]);
    };
    row("version", status.version.clone());
    row("arena", status.arena.clone());
    row("up", format!("{:.0} s", status.uptime_s));
    row("tick", format!("{} at {} Hz", status.tick, status.tick_hz));
    row("tick time p50 / p99", format!("{:.2} / {:.2} ms", status.tick_p50_ms, status.tick_p99_ms));
    row("overruns / skipped ticks", format!("{} / {}", status.overruns, status.skipped_ticks));
    row("clients", status.clients.to_string());
    row("bodies", status.bodies.to_string());
    row("awake DOF", status.dof_awake.to_string());
    row("contacts", status.contacts.to_string());
    row("quarantined", status.quarantined.to_string());
    for kind in status.kinds.iter().filter(|kind| kind.actors > 0) {
        let a_tick = kind.sporadic as f64 / status.tick.max(1) as f64;
        row(&format!("{}: actors, sporadic jobs a tick", kind.kind), format!("{}, {a_tick:.2}", kind.actors));
    }
    row("sent", report::rate(status.sent_bytes_per_s));
    row("received", report::rate(status.received_bytes_per_s));
    let inputs = &status.inputs;
    row("inputs in time / late", format!("{} / {}", inputs.in_time, inputs.late));
    row("superseded / early / missing", format!("{} / {} / {}", inputs.superseded, inputs.early, inputs.missing));
    row("input wait p50 / p99", format!("{:.1} / {:.1} ms", status.input_wait_p50_ms, status.input_wait_p99_ms));
    row("memory", format!("{:.1} MB", status.memory_bytes as f64 / 1e6));
    row("CPU since start", format!("{:.1} s", status.cpu_s));
    row("state hash", format!("{:016x}", status.state_hash));
    if let serde_json::Value::Object(refused) = json!(status.refused) {
        for (name, count) in refused.iter().filter(|(_, count)| count.as_u64() != Some(0)) {
            row(&format!("refused: {}", name.replace('_', " ")), count.to_string());
        }
    }
    table.to_string()
}
