//! The one place that knows bincode.
//!
//! A message on the wire is
//!
//! ```text
//! ┌───────────────┬────────────┬──────────────────────────────┐
//! │ version       │ kind       │ body                         │
//! │ varint u16    │ u8         │ bincode 2 `standard()`       │
//! └───────────────┴────────────┴──────────────────────────────┘
//! ```
//!
//! Decoding checks, in this order: the length against [`Message::MAX_BYTES`], the version, the kind, the body under a
//! memory limit, that every byte was consumed, and [`Message::validate`].

use bincode::config;
use serde::{Serialize, de::DeserializeOwned};

use crate::PROTOCOL_VERSION;

/// Most memory that decoding one message may claim, bytes. Without a limit nine bytes can claim all memory.
const DECODE_MEMORY_MAX: usize = 4 << 20;

/// A type that travels on its own.
pub trait Message: Serialize + DeserializeOwned {
    /// Tells one message type from another on the wire.
    const KIND: u8;

    /// Longest encoding that is looked at, bytes.
    const MAX_BYTES: usize;

    /// What types cannot say: ranges, finite numbers.
    ///
    /// # Errors
    /// [`WireError::Content`] naming the field and its allowed range.
    fn validate(&self) -> Result<(), WireError>;
}

/// Why bytes were refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// Longer than the message type may be.
    #[error("message of {bytes} bytes, allowed are {max}")]
    TooLong {
        /// Received length.
        bytes: usize,
        /// Allowed length.
        max: usize,
    },
    /// Sender speaks another version.
    #[error("protocol version {theirs}, this side speaks {PROTOCOL_VERSION}")]
    Version {
        /// Version in the message.
        theirs: u16,
    },
    /// Another message type than the key expression carries.
    #[error("message kind {got}, expected {expected}")]
    Kind {
        /// Kind in the message.
        got: u8,
        /// Kind that was expected.
        expected: u8,
    },
    /// Not an encoding of the type.
    #[error("malformed message")]
    Malformed,
    /// A field out of its range.
    #[error("{field} out of range, allowed is {allowed}")]
    Content {
        /// Name of the field.
        field: &'static str,
        /// Allowed range.
        allowed: &'static str,
    },
    /// The seal does not match body, key expression and session key.
    #[error("message authentication failed")]
    Forged,
    /// A snapshot is coded against one that this side does not have.
    #[error("the snapshot's baseline is not there")]
    NoBaseline,
    /// A snapshot decoded to another state than the sender has.
    #[error("the decoded state differs from the sender's")]
    Desync,
    /// Arena names are part of key expressions.
    #[error("arena name must be 1 to 32 of a-z 0-9 - _")]
    ArenaName,
}

/// Encodes `message` behind version and kind.
pub fn encode<M: Message>(message: &M) -> Vec<u8> {
    // Encoding into a Vec of types without custom serializers has no error path.
    bincode::serde::encode_to_vec((PROTOCOL_VERSION, M::KIND, message), config::standard())
        .expect("in-memory encoding of plain data")
}

/// Kind of the message in `bytes`, on keys that carry several; `None` where it is none of this version.
pub fn kind_of(bytes: &[u8]) -> Option<u8> {
    let limited = config::standard().with_limit::<DECODE_MEMORY_MAX>();
    let ((version, kind), _): ((u16, u8), usize) = bincode::serde::decode_from_slice(bytes, limited).ok()?;
    (version == PROTOCOL_VERSION).then_some(kind)
}

/// Decodes and validates a message of type `M`.
///
/// # Errors
/// Any [`WireError`]; see the module's order of checks.
pub fn decode<M: Message>(bytes: &[u8]) -> Result<M, WireError> {
    let limited = config::standard().with_limit::<DECODE_MEMORY_MAX>();
    if bytes.len() > M::MAX_BYTES {
        return Err(WireError::TooLong { bytes: bytes.len(), max: M::MAX_BYTES });
    }
    let ((theirs, got), head): ((u16, u8), usize) =
        bincode::serde::decode_from_slice(bytes, limited).map_err(|_| WireError::Malformed)?;
    if theirs != PROTOCOL_VERSION {
        return Err(WireError::Version { theirs });
    }
    if got != M::KIND {
        return Err(WireError::Kind { got, expected: M::KIND });
    }
    let (message, body): (M, usize) =
        bincode::serde::decode_from_slice(&bytes[head..], limited).map_err(|_| WireError::Malformed)?;
    if head + body != bytes.len() {
        return Err(WireError::Malformed);
    }
    message.validate()?;
    Ok(message)
}

/// `Err` naming `field` unless `ok`.
pub(crate) fn require(ok: bool, field: &'static str, allowed: &'static str) -> Result<(), WireError> {
    if ok { Ok(()) } else { Err(WireError::Content { field, allowed }) }
}
