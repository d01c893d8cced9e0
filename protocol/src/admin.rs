//! What those who run a server ask of it: requests that only they can seal.
//!
//! A request carries a challenge that the server gave out before and takes once, so that none can be sent again by who
//! heard it.

use serde::{Deserialize, Serialize};

use crate::codec::{Message, WireError, require};
use crate::seal::SessionKey;

/// Length of a challenge, bytes.
pub const CHALLENGE_BYTES: usize = 16;

/// Shortest and longest secret, bytes.
pub const SECRET_BYTES: std::ops::RangeInclusive<usize> = 16..=4096;

/// Most lines of an answer, and most bytes of each.
const LINES_MAX: usize = 16;
const LINE_MAX: usize = 1000;

/// The key under which requests are sealed by who knows `secret`.
pub fn admin_key(secret: &[u8]) -> SessionKey {
    SessionKey(blake3::derive_key("PITA 2026-11 admin requests", secret))
}

/// Query payload on [`admin`](crate::Keys::admin), [sealed](crate::seal::seal) under the [`admin_key`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AdminRequest {
    /// Asks for a challenge.
    Challenge,
    /// Asks for something to be done.
    Do {
        /// The one that the server answered last.
        challenge: [u8; CHALLENGE_BYTES],
        /// What.
        action: AdminAction,
    },
}

/// What a server can be asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AdminAction {
    /// Read the arena's file again, as on SIGHUP.
    Reload,
}

/// Answer to an [`AdminRequest`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AdminReply {
    /// For the next request.
    Challenge([u8; CHALLENGE_BYTES]),
    /// It was done, or not for a reason that is said: at most 16 lines of 1000 bytes, for people.
    Answered {
        /// Whether it was done.
        done: bool,
        /// What there is to say.
        lines: Vec<String>,
    },
    /// It is not sealed by who knows the secret, or not with the challenge.
    Refused,
}

impl AdminReply {
    /// An answer of as much of `lines` as there is room for.
    pub fn answered(done: bool, lines: impl IntoIterator<Item = String>) -> Self {
        let cut = |line: String| line.chars().take(LINE_MAX / 4).collect();
        Self::Answered { done, lines: lines.into_iter().take(LINES_MAX).map(cut).collect() }
    }
}

impl Message for AdminRequest {
    const KIND: u8 = 20;
    const MAX_BYTES: usize = 64;
    fn validate(&self) -> Result<(), WireError> {
        Ok(())
    }
}

impl Message for AdminReply {
    const KIND: u8 = 21;
    const MAX_BYTES: usize = LINES_MAX * (LINE_MAX + 4) + 32;
    fn validate(&self) -> Result<(), WireError> {
        let Self::Answered { lines, .. } = self else { return Ok(()) };
        require(lines.len() <= LINES_MAX, "lines", "at most 16")?;
        require(lines.iter().all(|line| line.len() <= LINE_MAX), "line", "at most 1000 bytes")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{decode, encode, seal};

    #[test]
    fn requests_open_under_the_same_secret_alone() {
        let request = AdminRequest::Do { challenge: [3; CHALLENGE_BYTES], action: AdminAction::Reload };
        let sealed = seal::seal(&request, &admin_key(b"sixteen letters!"), "pita/a/admin");
        assert_eq!(seal::open(&sealed, &admin_key(b"sixteen letters!"), "pita/a/admin"), Ok(request));
        let other = seal::open::<AdminRequest>(&sealed, &admin_key(b"sixteen letters?"), "pita/a/admin");
        assert_eq!(other, Err(WireError::Forged));
    }

    #[test]
    fn answers_are_cut_to_what_may_travel() {
        let long = AdminReply::answered(true, (0..100).map(|_| "ü".repeat(5000)));
        assert_eq!(decode(&encode(&long)), Ok(long.clone()));
        let AdminReply::Answered { lines, .. } = long else { panic!("an answer") };
        assert_eq!(lines.len(), LINES_MAX);
    }
}
