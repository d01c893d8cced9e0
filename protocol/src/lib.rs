//! PITA's wire: what travels between the daemon and its clients.
//!
//! Owns: key expressions ([`keys`]), messages ([`message`], those of inputs in [`input`], the world in words in [`description`],
//! what players say in [`chat`], interest cells in [`cell`], what those who run a server ask of it in [`admin`]), their encoding and limits ([`codec`]), authentication of
//! inputs ([`seal`]), and the streams of DOF ([`dof`]). It does no I/O, reads no clock and knows no engine.
//!
//! Every byte that is decoded here is untrusted: decoding answers a [`WireError`], never panics, and allocates no more
//! than the message's own limit.

pub mod admin;
pub mod build_info;
pub mod cell;
pub mod chat;
pub mod codec;
pub mod description;
pub mod dof;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod hostile;
pub mod input;
pub mod keys;
pub mod message;
pub mod seal;

pub use codec::{Message, WireError, decode, encode, kind_of};
pub use keys::Keys;

/// Version of everything this crate encodes; the first field of every message.
///
/// A peer of another version is refused at join with both numbers in the text.
pub const PROTOCOL_VERSION: u16 = 7;

/// Where a daemon listens, and where clients look for it, unless told otherwise.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";
