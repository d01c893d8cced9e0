//! How a session uses Zenoh: connections to one endpoint each, no scouting, bounded messages.

use std::time::Duration;

use pita_protocol::{Message, WireError, message::Keyframes};
use tokio::{
    sync::mpsc,
    time::{Instant, timeout, timeout_at},
};
use zenoh::{Config, query::Reply};

use crate::error::ClientError;

/// After so long without a word the server may end the connection, ms. The server uses the lease that its client
/// announces.
const LEASE_MS: u32 = 5_000;

/// Longest message that the transport collects before anybody looks at it, bytes: the longest of the protocol and room
/// for the transport's own. Zenoh's default is 1 GiB.
const MESSAGE_MAX: usize = Keyframes::MAX_BYTES + (64 << 10);

/// Longer than anybody here waits for an answer Zenoh does: when its time is over it says so by an answer that cannot be read.
const ZENOH_WAITS_LONGER: Duration = Duration::from_secs(10);

/// Most answers to one question that are looked at.
const ANSWERS_MAX: usize = 16;

/// How long a connection may take to close, before it is left to the operating system.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(2);

/// Longest datagram, bytes: what passes every network in one piece. The server keeps to the least of both sides.
const DATAGRAM_MAX: u16 = 1400;

/// Connects to `endpoint`, in one attempt.
pub async fn open(endpoint: &str, patience: Duration) -> Result<zenoh::Session, ClientError> {
    if endpoint.starts_with("udp/") {
        return Err(ClientError::Control(endpoint.to_owned()));
    }
    open_with(endpoint, patience, u16::MAX).await
}

/// Connects to `endpoint` for datagrams, in one attempt.
pub async fn open_datagrams(endpoint: &str, patience: Duration) -> Result<zenoh::Session, ClientError> {
    open_with(endpoint, patience, DATAGRAM_MAX).await
}

async fn open_with(endpoint: &str, patience: Duration, batch_max: u16) -> Result<zenoh::Session, ClientError> {
    let unreachable = |reason: String| ClientError::Unreachable { endpoint: endpoint.to_owned(), reason };
    let config = config(endpoint, batch_max).map_err(|error| unreachable(error.to_string()))?;
    match timeout(patience, zenoh::open(config)).await {
        Ok(opened) => opened.map_err(|_| unreachable("no connection".to_owned())),
        Err(_) => Err(unreachable(format!("no connection within {patience:?}"))),
    }
}

fn config(endpoint: &str, batch_max: u16) -> zenoh::Result<Config> {
    let mut config = Config::default();
    let endpoints = serde_json::json!([endpoint]).to_string();
    for (key, value) in [
        ("mode", "\"client\""),
        ("connect/endpoints", &endpoints),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        ("transport/link/tx/lease", &LEASE_MS.to_string()),
        ("transport/link/tx/batch_size", &batch_max.to_string()),
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "0"),
        ("transport/link/rx/max_message_size", &MESSAGE_MAX.to_string()),
    ] {
        config.insert_json5(key, value)?;
    }
    Ok(config)
}

/// Closes a connection. Failure to do so in time changes nothing for the caller.
///
/// In a task of its own: Zenoh blocks the thread meanwhile in an executor of its own, which on the thread of a `block_on`
/// (`#[tokio::main]`) takes the wake-ups of whatever else the caller waits for beside this, so that it waits for ever.
pub async fn close(zenoh: &zenoh::Session) {
    let zenoh = zenoh.clone();
    let closing = tokio::spawn(async move { zenoh.close().await });
    match timeout(CLOSE_TIMEOUT, closing).await {
        Ok(Ok(Ok(()))) => {}
        Ok(Ok(Err(error))) => tracing::debug!("closing the connection: {error}"),
        Ok(Err(error)) => tracing::debug!("closing the connection: {error}"),
        Err(_) => tracing::debug!("the connection did not close within {CLOSE_TIMEOUT:?}"),
    }
}

/// The first answer to a question. `Ok(None)` where nobody answers.
pub async fn ask<M: Message>(
    zenoh: &zenoh::Session,
    key: &str,
    question: &'static str,
    payload: Vec<u8>,
    patience: Duration,
) -> Result<Option<M>, ClientError> {
    let mut answers = pose(zenoh, key, payload, patience).await?;
    match timeout(patience, answers.recv()).await {
        Ok(Some(reply)) => read(question, &reply).map(Some),
        Ok(None) | Err(_) => Ok(None),
    }
}

/// All answers to a question that come in time.
pub async fn ask_all<M: Message>(
    zenoh: &zenoh::Session,
    key: &str,
    question: &'static str,
    patience: Duration,
) -> Result<Vec<M>, ClientError> {
    let mut answers = pose(zenoh, key, Vec::new(), patience).await?;
    let mut read_so_far = Vec::new();
    let until = Instant::now() + patience;
    while let Ok(Some(reply)) = timeout_at(until, answers.recv()).await {
        read_so_far.push(read(question, &reply)?);
    }
    Ok(read_so_far)
}

async fn pose(
    zenoh: &zenoh::Session,
    key: &str,
    payload: Vec<u8>,
    patience: Duration,
) -> Result<mpsc::Receiver<Reply>, ClientError> {
    let (sender, receiver) = mpsc::channel(ANSWERS_MAX);
    // Answers beyond the channel's room are dropped: waiting would hold up a thread that all sessions share.
    let keep = move |reply| drop(sender.try_send(reply));
    zenoh
        .get(key)
        .payload(payload)
        .timeout(patience + ZENOH_WAITS_LONGER)
        .callback(keep)
        .await
        .map_err(ClientError::transport("ask the server"))?;
    Ok(receiver)
}

fn read<M: Message>(question: &'static str, reply: &Reply) -> Result<M, ClientError> {
    match reply.result() {
        Ok(sample) => pita_protocol::decode(&sample.payload().to_bytes()).map_err(|e| ClientError::answer(question, e)),
        Err(_) => Err(ClientError::BadAnswer { question, error: WireError::Malformed }),
    }
}
