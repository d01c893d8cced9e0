//! The one error type of this crate, and the ways in which a session ends.

use std::time::Duration;

use pita_protocol::{
    WireError,
    message::{Refusal, SayRefusal},
};

/// Why something that was asked of this library did not happen; the text says what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClientError {
    /// No connection to the endpoint.
    #[error(
        "no server answers at {endpoint} ({reason}): start one with `cargo run --release`, or check the address \
         (form: tcp/HOST:PORT)"
    )]
    Unreachable {
        /// Zenoh endpoint that was tried.
        endpoint: String,
        /// What the transport said.
        reason: String,
    },
    /// Joins, inputs and events were to go over datagrams, which get lost.
    #[error("{0} would lose inputs and events: connect over tcp/HOST:PORT, and name this one as `datagrams` besides")]
    Control(String),
    /// Datagrams were to come over something else than UDP.
    #[error("{0} is nothing that datagrams come over: name the server's udp/HOST:PORT, or none")]
    Datagrams(String),
    /// Something speaks Zenoh at the endpoint, but no arena answered.
    #[error("{endpoint} was reached, but no arena{} answered within {waited:?}: check that a PITA server runs there{}",
        named(.arena), if .arena.is_some() { " and that it runs this arena" } else { "" })]
    NoArena {
        /// Zenoh endpoint that was reached.
        endpoint: String,
        /// Arena that was asked for.
        arena: Option<String>,
        /// How long an answer was waited for.
        waited: Duration,
    },
    /// More than one arena answered and none was chosen.
    #[error("several arenas run there ({}): choose one with `arena`", .0.join(", "))]
    SeveralArenas(Vec<String>),
    /// The server gave no session, and says why.
    #[error("the server refused: {0}")]
    Refused(#[from] Refusal),
    /// The server's answer is of another protocol version.
    #[error("the server speaks protocol version {server}, this client {client}: use a client of the server's version")]
    Version {
        /// Version of the server.
        server: u16,
        /// Version of this library.
        client: u16,
    },
    /// The server's answer cannot be used.
    #[error("the server's answer to `{question}` cannot be used ({error}): report it to whoever runs the server")]
    BadAnswer {
        /// Last part of the key that was asked.
        question: &'static str,
        /// What is wrong with it.
        error: WireError,
    },
    /// The server let a player in and gave it no vehicle.
    #[error("the server let a player in without a vehicle: report it to whoever runs the server")]
    NoActor,
    /// The server's arena cannot be stepped here.
    #[error(
        "the server's arena cannot be stepped here, so that nothing can be predicted ({0}): use a client of its version"
    )]
    Arena(String),
    /// The caller passed a value that the protocol does not allow.
    #[error("{0}")]
    BadArgument(WireError),
    /// The server did not pass a text on.
    #[error("nobody was told: {0}")]
    NotSaid(SayRefusal),
    /// A spectator drives nothing.
    #[error("a spectator drives nothing: connect as a player to send controls")]
    Spectator,
    /// The session is over.
    #[error("the session has ended: {0}")]
    Ended(#[from] SessionEnd),
    /// Zenoh refused an operation on an open connection.
    #[error("cannot {action}: {reason}")]
    Transport {
        /// What was being done.
        action: &'static str,
        /// What Zenoh said.
        reason: String,
    },
}

/// How a session ended.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SessionEnd {
    /// The server announced that it ends.
    #[error("the server closed ({reason}): connect again when it is back")]
    Closed {
        /// For a person.
        reason: String,
    },
    /// The server ended this session, and no other.
    #[error("the server ended this session ({reason}): connect again for a new one")]
    Removed {
        /// For a person.
        reason: String,
    },
    /// Nothing newer was received for too long.
    #[error("no snapshot for {:.1} s: the server or the connection is gone; connect again when it is back",
        .silent_for.as_secs_f64())]
    Lost {
        /// Length of the silence.
        silent_for: Duration,
    },
}

fn named(arena: &Option<String>) -> String {
    arena.as_ref().map(|name| format!(" `{name}`")).unwrap_or_default()
}

impl ClientError {
    pub(crate) fn transport(action: &'static str) -> impl FnOnce(zenoh::Error) -> Self {
        move |error| Self::Transport { action, reason: error.to_string() }
    }

    pub(crate) fn answer(question: &'static str, error: WireError) -> Self {
        match error {
            WireError::Version { theirs } => Self::Version { server: theirs, client: pita_protocol::PROTOCOL_VERSION },
            error => Self::BadAnswer { question, error },
        }
    }

    /// Whether the same call may succeed a little later, with nothing changed but the server's state.
    pub fn is_worth_retrying(&self) -> bool {
        match self {
            Self::Unreachable { .. } | Self::NoArena { .. } | Self::Transport { .. } => true,
            Self::Refused(refusal) => matches!(refusal, Refusal::Closing | Refusal::Ended { .. }),
            _ => false,
        }
    }
}
