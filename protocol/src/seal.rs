//! Authentication of inputs: a blake3 keyed hash over key expression and body.
//!
//! ```text
//! ┌───────────────────────────┬──────────────┐
//! │ encoded InputPacket       │ tag          │
//! │ n bytes                   │ 16 bytes     │
//! └───────────────────────────┴──────────────┘
//! tag = blake3_keyed(session key, u32 LE length of key expression ‖ key expression ‖ encoded packet)[..16]
//! ```
//!
//! The key expression is covered so that a packet of one slot cannot be replayed on another's. Replays on the same
//! slot are dropped by the sequence number inside.

use crate::{Message, WireError, decode, encode, message::InputPacket};

/// Secret shared by one session and the server, handed out at join.
#[derive(Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SessionKey(pub [u8; 32]);

impl std::fmt::Debug for SessionKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SessionKey(..)")
    }
}

/// Length of the tag behind a sealed packet, bytes.
pub const TAG_BYTES: usize = 16;

/// Encodes `packet` for `key_expr` and appends its tag.
pub fn seal(packet: &InputPacket, key: &SessionKey, key_expr: &str) -> Vec<u8> {
    let mut bytes = encode(packet);
    let tag = tag(&bytes, key, key_expr);
    bytes.extend_from_slice(&tag.as_bytes()[..TAG_BYTES]);
    bytes
}

/// Checks the tag, then decodes.
///
/// # Errors
/// [`WireError::TooLong`] and [`WireError::Malformed`] by length, [`WireError::Forged`] where the tag does not match,
/// else what [`decode`] says.
pub fn open(sealed: &[u8], key: &SessionKey, key_expr: &str) -> Result<InputPacket, WireError> {
    let max = InputPacket::MAX_BYTES + TAG_BYTES;
    if sealed.len() > max {
        return Err(WireError::TooLong { bytes: sealed.len(), max });
    }
    let (body, theirs) = sealed.split_last_chunk::<TAG_BYTES>().ok_or(WireError::Malformed)?;
    let mut padded = *tag(body, key, key_expr).as_bytes();
    padded[TAG_BYTES..].fill(0);
    let mut claimed = [0; 32];
    claimed[..TAG_BYTES].copy_from_slice(theirs);
    // Both are padded to whole hashes because their comparison is constant in time.
    if blake3::Hash::from_bytes(padded) != blake3::Hash::from_bytes(claimed) {
        return Err(WireError::Forged);
    }
    decode(body)
}

fn tag(body: &[u8], key: &SessionKey, key_expr: &str) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new_keyed(&key.0);
    // Keys of this protocol are shorter than 100 bytes.
    hasher.update(&u32::try_from(key_expr.len()).unwrap_or(u32::MAX).to_le_bytes());
    hasher.update(key_expr.as_bytes());
    hasher.update(body);
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Controls, InputFrame};

    fn packet() -> InputPacket {
        let frame = InputFrame { sequence: 9, tick: 100, controls: Controls { throttle: 1.0, ..Controls::default() } };
        InputPacket { epoch: 4, snapshot_tick: 98, leave: false, frames: vec![frame] }
    }

    #[test]
    fn opens_only_with_the_same_key_body_and_key_expression() {
        let key = SessionKey([7; 32]);
        let sealed = seal(&packet(), &key, "pita/a/input/1");
        assert_eq!(open(&sealed, &key, "pita/a/input/1"), Ok(packet()));
        assert_eq!(open(&sealed, &key, "pita/a/input/2"), Err(WireError::Forged));
        assert_eq!(open(&sealed, &SessionKey([8; 32]), "pita/a/input/1"), Err(WireError::Forged));
        for bit in 0..sealed.len() * 8 {
            let mut flipped = sealed.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(open(&flipped, &key, "pita/a/input/1"), Err(WireError::Forged), "bit {bit}");
        }
        for length in 0..sealed.len() {
            assert!(open(&sealed[..length], &key, "pita/a/input/1").is_err(), "length {length}");
        }
    }
}
