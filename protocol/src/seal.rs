//! Authentication of what clients send: a blake3 keyed hash over key expression and body.
//!
//! ```text
//! ┌───────────────────────────┬──────────────┐
//! │ encoded packet            │ tag          │
//! │ n bytes                   │ 16 bytes     │
//! └───────────────────────────┴──────────────┘
//! tag = blake3_keyed(session key, u32 LE length of key expression ‖ key expression ‖ encoded packet)[..16]
//! ```
//!
//! The key expression is covered so that a packet of one slot cannot be replayed on another's. Replays on the same
//! slot are dropped by the sequence number inside.

use crate::{Message, WireError, decode, encode};

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
pub fn seal<M: Message>(packet: &M, key: &SessionKey, key_expr: &str) -> Vec<u8> {
    let mut bytes = encode(packet);
    let tag = tag(&bytes, key, key_expr);
    bytes.extend_from_slice(&tag);
    bytes
}

/// Checks the tag, then decodes.
///
/// # Errors
/// [`WireError::TooLong`] and [`WireError::Malformed`] by length, [`WireError::Forged`] where the tag does not match,
/// else what [`decode`] says.
pub fn open<M: Message>(sealed: &[u8], key: &SessionKey, key_expr: &str) -> Result<M, WireError> {
    let max = M::MAX_BYTES + TAG_BYTES;
    if sealed.len() > max {
        return Err(WireError::TooLong { bytes: sealed.len(), max });
    }
    let (body, theirs) = sealed.split_last_chunk::<TAG_BYTES>().ok_or(WireError::Malformed)?;
    if !same(&tag(body, key, key_expr), theirs) {
        return Err(WireError::Forged);
    }
    decode(body)
}

fn tag(body: &[u8], key: &SessionKey, key_expr: &str) -> [u8; TAG_BYTES] {
    let mut hasher = blake3::Hasher::new_keyed(&key.0);
    // Keys of this protocol are shorter than 100 bytes.
    hasher.update(&u32::try_from(key_expr.len()).unwrap_or(u32::MAX).to_le_bytes());
    hasher.update(key_expr.as_bytes());
    hasher.update(body);
    truncated(&hasher)
}

/// Shows whoever knows `key` that the caller does, for the session of `slot` and `epoch`.
pub fn prove(slot: u16, epoch: u32, key: &SessionKey) -> [u8; TAG_BYTES] {
    let mut hasher = blake3::Hasher::new_keyed(&key.0);
    // No key expression has this length: a proof is the tag of no packet.
    hasher.update(&u32::MAX.to_le_bytes());
    hasher.update(&slot.to_le_bytes());
    hasher.update(&epoch.to_le_bytes());
    truncated(&hasher)
}

fn truncated(hasher: &blake3::Hasher) -> [u8; TAG_BYTES] {
    let mut tag = [0; TAG_BYTES];
    tag.copy_from_slice(&hasher.finalize().as_bytes()[..TAG_BYTES]);
    tag
}

/// Whether `claimed` is what [`prove`] answers.
pub fn proves(claimed: &[u8; TAG_BYTES], slot: u16, epoch: u32, key: &SessionKey) -> bool {
    same(&prove(slot, epoch, key), claimed)
}

/// Compares in constant time.
fn same(ours: &[u8; TAG_BYTES], theirs: &[u8; TAG_BYTES]) -> bool {
    // Both are padded to whole hashes because their comparison is constant in time.
    let padded = |tag: &[u8; TAG_BYTES]| {
        let mut hash = [0; 32];
        hash[..TAG_BYTES].copy_from_slice(tag);
        blake3::Hash::from_bytes(hash)
    };
    padded(ours) == padded(theirs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::InputPacket;
    use crate::message::{Controls, InputFrame};

    fn packet() -> InputPacket {
        let frame = InputFrame { sequence: 9, tick: 100, controls: Controls { throttle: 1.0, ..Controls::default() } };
        InputPacket { epoch: 4, snapshot_tick: 98, snapshots_before: 1, leave: false, frames: vec![frame] }
    }

    #[test]
    fn opens_only_with_the_same_key_body_and_key_expression() {
        let key = SessionKey([7; 32]);
        let sealed = seal(&packet(), &key, "pita/a/input/1");
        assert_eq!(open(&sealed, &key, "pita/a/input/1"), Ok(packet()));
        assert_eq!(open::<InputPacket>(&sealed, &key, "pita/a/input/2"), Err(WireError::Forged));
        assert_eq!(open::<InputPacket>(&sealed, &SessionKey([8; 32]), "pita/a/input/1"), Err(WireError::Forged));
        for bit in 0..sealed.len() * 8 {
            let mut flipped = sealed.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(open::<InputPacket>(&flipped, &key, "pita/a/input/1"), Err(WireError::Forged), "bit {bit}");
        }
        for length in 0..sealed.len() {
            assert!(open::<InputPacket>(&sealed[..length], &key, "pita/a/input/1").is_err(), "length {length}");
        }
    }

    #[test]
    fn a_proof_is_for_one_session_and_key() {
        let key = SessionKey([7; 32]);
        let proof = prove(3, 9, &key);
        assert!(proves(&proof, 3, 9, &key));
        assert!(
            !proves(&proof, 4, 9, &key) && !proves(&proof, 3, 8, &key) && !proves(&proof, 3, 9, &SessionKey([8; 32]))
        );
    }
}
