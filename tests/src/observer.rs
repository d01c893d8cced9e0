//! Asks a running server how it does, over the wire like anybody may. Joins nothing.

use std::time::Duration;

use pita_protocol::keys::{self, Keys};
use pita_protocol::message::{Description, Status, TickRecords, TicksRequest};
use pita_protocol::{Message, WireError, decode, encode};

/// How long an answer may take.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);

/// A connection to one server.
pub struct Observer {
    session: zenoh::Session,
    keys: Keys,
}

/// Why a server could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum ObserverError {
    /// No connection.
    #[error("no server at {endpoint} ({reason}): start one with `cargo run --release`, or check the endpoint")]
    Connect {
        /// Where it was looked for.
        endpoint: String,
        /// What Zenoh says.
        reason: String,
    },
    /// Zenoh refused to ask.
    #[error("cannot ask for {key}: {reason}")]
    Ask {
        /// Key expression.
        key: String,
        /// What Zenoh says.
        reason: String,
    },
    /// Nobody answered.
    #[error("no answer to {key} within {ANSWER_WITHIN:?}: is it a server of this protocol version?")]
    Silent {
        /// Key expression.
        key: String,
    },
    /// The answer could not be read.
    #[error("answer to {key}: {reason}")]
    Answer {
        /// Key expression.
        key: String,
        /// Why not.
        reason: WireError,
    },
}

impl Observer {
    /// Connects to the server at `endpoint`, such as `tcp/127.0.0.1:7447`.
    ///
    /// # Errors
    /// [`ObserverError`]: no server there, or one that does not answer.
    pub async fn connect(endpoint: &str) -> Result<Self, ObserverError> {
        let session = open(endpoint).await?;
        let (key, _): (_, Status) = ask(&session, keys::ANY_STATUS, Vec::new()).await?;
        let arena = keys::arena_of(&key).unwrap_or_default();
        let keys = Keys::new(arena).map_err(|reason| ObserverError::Answer { key: key.clone(), reason })?;
        Ok(Self { session, keys })
    }

    /// Key expressions of the server's arena.
    pub fn keys(&self) -> &Keys {
        &self.keys
    }

    /// The Zenoh session, to say what no client would.
    pub fn session(&self) -> &zenoh::Session {
        &self.session
    }

    /// How the server does.
    ///
    /// # Errors
    /// [`ObserverError`]: no answer, or not one that can be read.
    pub async fn status(&self) -> Result<Status, ObserverError> {
        Ok(ask(&self.session, &self.keys.status(), Vec::new()).await?.1)
    }

    /// What there is in the arena.
    ///
    /// # Errors
    /// [`ObserverError`]: no answer, or not one that can be read.
    pub async fn description(&self) -> Result<Description, ObserverError> {
        Ok(ask(&self.session, &self.keys.describe(), Vec::new()).await?.1)
    }

    /// Records of all ticks from `since` on that the server still has.
    ///
    /// # Errors
    /// [`ObserverError`]: no answer, or not one that can be read.
    pub async fn ticks(&self, since: u64) -> Result<TickRecords, ObserverError> {
        Ok(ask(&self.session, &self.keys.ticks(), encode(&TicksRequest { since })).await?.1)
    }
}

/// A Zenoh session in client mode to `endpoint`, nothing else scouted.
///
/// # Errors
/// [`ObserverError::Connect`] where nobody listens.
pub async fn open(endpoint: &str) -> Result<zenoh::Session, ObserverError> {
    let failed =
        |error: zenoh::Error| ObserverError::Connect { endpoint: endpoint.to_owned(), reason: error.to_string() };
    let mut config = zenoh::Config::default();
    let endpoints = serde_json::json!([endpoint]).to_string();
    let settings = [("mode", "\"client\""), ("connect/endpoints", &endpoints), ("scouting/multicast/enabled", "false")];
    for (key, value) in settings {
        config.insert_json5(key, value).map_err(failed)?;
    }
    zenoh::open(config).await.map_err(failed)
}

/// First answer of message type `M` to a query on `key`, and the key expression that it came on.
async fn ask<M: Message>(session: &zenoh::Session, key: &str, payload: Vec<u8>) -> Result<(String, M), ObserverError> {
    let refused = |error: zenoh::Error| ObserverError::Ask { key: key.to_owned(), reason: error.to_string() };
    let replies = session.get(key).payload(payload).timeout(ANSWER_WITHIN).await.map_err(refused)?;
    while let Ok(reply) = replies.recv_async().await {
        // An error reply is Zenoh's own word for a timeout.
        let Ok(sample) = reply.result() else { continue };
        let answered = sample.key_expr().to_string();
        let message = decode(&sample.payload().to_bytes());
        let message = message.map_err(|reason| ObserverError::Answer { key: answered.clone(), reason })?;
        return Ok((answered, message));
    }
    Err(ObserverError::Silent { key: key.to_owned() })
}
