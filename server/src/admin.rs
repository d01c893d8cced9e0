//! Who may ask for what only those may ask who run the server.
//!
//! Owns the secret and which challenges were used; what is asked for is done by the daemon's own loop, which reads the
//! disk. Pure: randomness and time come in.
//!
//! A challenge proves by itself that this server gave it out, and when. So nothing is kept of those that are not used, and
//! who repeats what an operator once sent can neither push out the challenges of others nor have anything done.

use std::collections::VecDeque;
use std::io::Read;
use std::path::Path;
use std::time::Duration;

use pita_protocol::admin::{AdminAction, AdminReply, AdminRequest, CHALLENGE_BYTES, SECRET_BYTES, admin_key};
use pita_protocol::seal::{self, SessionKey};
use zenoh::query::Query;

/// A challenge is good for the period in which it was given out and for the next.
const PERIOD: Duration = Duration::from_secs(10);

/// Most requests of two periods; only who knows the secret can make more.
const USED_MAX: usize = 64;

/// First bytes of a challenge, at random; what follows is their tag.
pub const NONCE_BYTES: usize = CHALLENGE_BYTES / 2;

/// Why there is no secret.
#[derive(Debug, thiserror::Error)]
pub enum SecretError {
    /// The file cannot be read.
    #[error("secret file {file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        reason: std::io::Error,
    },
    /// It is too short or too long.
    #[error(
        "secret file {file} has {bytes} bytes, allowed are 16 to 4096: make one with `head -c 32 /dev/urandom | base64`"
    )]
    Length {
        /// The file.
        file: String,
        /// Its length, without white space around it; 4097 where it is longer.
        bytes: usize,
    },
}

/// Reads a secret; white space around it is no part of it.
///
/// # Errors
/// [`SecretError`] naming the file.
pub fn read_secret(file: &Path) -> Result<SessionKey, SecretError> {
    let name = || file.display().to_string();
    let mut secret = Vec::new();
    std::fs::File::open(file)
        .and_then(|opened| opened.take(*SECRET_BYTES.end() as u64 + 1).read_to_end(&mut secret))
        .map_err(|reason| SecretError::Unreadable { file: name(), reason })?;
    let secret = secret.trim_ascii();
    match SECRET_BYTES.contains(&secret.len()) {
        true => Ok(admin_key(secret)),
        false => Err(SecretError::Length { file: name(), bytes: secret.len() }),
    }
}

/// A key of challenges' tags from the operating system.
///
/// # Errors
/// Where the system gives no randomness.
pub fn new_tag_key() -> std::io::Result<[u8; 32]> {
    use rand::TryRng;
    let mut key = [0; 32];
    rand::rngs::SysRng.try_fill_bytes(&mut key).map_err(std::io::Error::other)?;
    Ok(key)
}

/// Something to be done, and whom to answer.
pub struct Order {
    /// What.
    pub action: AdminAction,
    /// Who asked.
    pub query: Query,
}

/// Lets those in who know the secret.
pub struct Doorkeeper {
    /// `None` where nobody may ask.
    key: Option<SessionKey>,
    /// Of the tags of challenges; another one each time that the server starts.
    tag_key: [u8; 32],
    /// Challenges that were used, with their periods: all that could still be good.
    used: VecDeque<(u64, [u8; CHALLENGE_BYTES])>,
}

/// What becomes of a request.
#[derive(Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is answered at once.
    Answer(AdminReply),
    /// It is to be done.
    Do(AdminAction),
}

impl Doorkeeper {
    /// Of those who know what `key` was made of; `tag_key` is random.
    pub fn new(key: Option<SessionKey>, tag_key: [u8; 32]) -> Self {
        Self { key, tag_key, used: VecDeque::new() }
    }

    /// Judges a request that came on `key_expr` at the time `now` since the server started; `nonce`, random, is for the
    /// challenge that it gets if it asks for one.
    pub fn judge(&mut self, sealed: &[u8], key_expr: &str, now: Duration, nonce: [u8; NONCE_BYTES]) -> Verdict {
        let Some(key) = &self.key else {
            let how = "this server takes no admin requests: set admin.secret_file in its configuration";
            return Verdict::Answer(AdminReply::answered(false, [how.to_owned()]));
        };
        let period = now.as_secs() / PERIOD.as_secs();
        match seal::open(sealed, key, key_expr) {
            Ok(AdminRequest::Challenge) => Verdict::Answer(AdminReply::Challenge(self.challenge(period, nonce))),
            Ok(AdminRequest::Do { challenge, action }) if self.take(challenge, period) => Verdict::Do(action),
            _ => Verdict::Answer(AdminReply::Refused),
        }
    }

    fn challenge(&self, period: u64, nonce: [u8; NONCE_BYTES]) -> [u8; CHALLENGE_BYTES] {
        let mut challenge = [0; CHALLENGE_BYTES];
        let (first, last) = challenge.split_at_mut(NONCE_BYTES);
        first.copy_from_slice(&nonce);
        let tag = blake3::Hasher::new_keyed(&self.tag_key).update(&nonce).update(&period.to_le_bytes()).finalize();
        last.copy_from_slice(&tag.as_bytes()[..CHALLENGE_BYTES - NONCE_BYTES]);
        challenge
    }

    /// Whether the challenge was given out in this period or the last one and is not used yet; it is used then.
    fn take(&mut self, challenge: [u8; CHALLENGE_BYTES], now: u64) -> bool {
        while self.used.front().is_some_and(|(period, _)| period + 1 < now) {
            self.used.pop_front();
        }
        let Some(nonce) = challenge.first_chunk() else { return false };
        let is_ours = (now.saturating_sub(1)..=now).any(|period| self.challenge(period, *nonce) == challenge);
        let is_new = self.used.len() < USED_MAX && self.used.iter().all(|(_, used)| *used != challenge);
        if is_ours && is_new {
            self.used.push_back((now, challenge));
        }
        is_ours && is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY_EXPR: &str = "pita/a/admin";
    const START: Duration = Duration::ZERO;

    /// Of a known secret, and what seals under it.
    fn door() -> (Doorkeeper, impl Fn(&AdminRequest) -> Vec<u8>) {
        let key = admin_key(b"a secret of some length");
        (Doorkeeper::new(Some(key.clone()), [1; 32]), move |request: &AdminRequest| seal::seal(request, &key, KEY_EXPR))
    }

    fn reload(challenge: [u8; CHALLENGE_BYTES]) -> AdminRequest {
        AdminRequest::Do { challenge, action: AdminAction::Reload }
    }

    fn given(verdict: Verdict) -> [u8; CHALLENGE_BYTES] {
        match verdict {
            Verdict::Answer(AdminReply::Challenge(challenge)) => challenge,
            other => panic!("no challenge: {other:?}"),
        }
    }

    const REFUSED: Verdict = Verdict::Answer(AdminReply::Refused);

    #[test]
    fn a_challenge_opens_the_door_once() {
        let (mut door, sealed) = door();
        assert_eq!(door.judge(&sealed(&reload([7; 16])), KEY_EXPR, START, [0; 8]), REFUSED, "it was never given out");
        let challenge = given(door.judge(&sealed(&AdminRequest::Challenge), KEY_EXPR, START, [7; 8]));
        let request = sealed(&reload(challenge));
        assert_eq!(door.judge(&request, KEY_EXPR, START, [0; 8]), Verdict::Do(AdminAction::Reload));
        for s in [0, 9, 10, 19, 20, 1_000_000] {
            assert_eq!(door.judge(&request, KEY_EXPR, Duration::from_secs(s), [0; 8]), REFUSED, "used, after {s} s");
        }
    }

    #[test]
    fn a_challenge_that_waits_too_long_is_good_for_nothing() {
        for (s, opens) in [(10, true), (19, true), (20, false), (40, false)] {
            let (mut door, sealed) = door();
            let challenge = given(door.judge(&sealed(&AdminRequest::Challenge), KEY_EXPR, START, [7; 8]));
            let verdict = door.judge(&sealed(&reload(challenge)), KEY_EXPR, Duration::from_secs(s), [0; 8]);
            assert_eq!(verdict == Verdict::Do(AdminAction::Reload), opens, "after {s} s");
        }
    }

    /// Who heard an operator ask can say it again, as often as he likes.
    #[test]
    fn requests_that_are_repeated_push_out_nobody() {
        let (mut door, sealed) = door();
        let asks = sealed(&AdminRequest::Challenge);
        let challenge = given(door.judge(&asks, KEY_EXPR, START, [7; 8]));
        for nonce in 0..100_000u64 {
            given(door.judge(&asks, KEY_EXPR, START, nonce.to_le_bytes()));
        }
        assert_eq!(door.judge(&sealed(&reload(challenge)), KEY_EXPR, START, [0; 8]), Verdict::Do(AdminAction::Reload));
        assert_eq!(door.used.len(), 1, "nothing is kept of what was not used");
    }

    #[test]
    fn what_is_kept_is_bounded_and_forgotten() {
        let (mut door, sealed) = door();
        let mut ask = |s: u64, nonce: u64| {
            let now = Duration::from_secs(s);
            let challenge = given(door.judge(&sealed(&AdminRequest::Challenge), KEY_EXPR, now, nonce.to_le_bytes()));
            (door.judge(&sealed(&reload(challenge)), KEY_EXPR, now, [0; 8]) != REFUSED, door.used.len())
        };
        let done = (0..100).filter(|&nonce| ask(0, nonce).0).count();
        assert_eq!(done, USED_MAX);
        assert_eq!(ask(20, 1_000), (true, 1));
    }

    #[test]
    fn who_does_not_know_the_secret_gets_no_challenge() {
        let (mut door, _) = door();
        let forged = seal::seal(&AdminRequest::Challenge, &admin_key(b"another secret, as long"), KEY_EXPR);
        for sealed in [&forged[..], b"", b"nonsense"] {
            assert_eq!(door.judge(sealed, KEY_EXPR, START, [1; 8]), REFUSED);
        }
        let said = Doorkeeper::new(None, [1; 32]).judge(&forged, KEY_EXPR, START, [1; 8]);
        assert!(format!("{said:?}").contains("admin.secret_file"), "{said:?}");
    }

    #[test]
    fn secrets_have_a_length_and_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("secret");
        assert!(read_secret(&file).unwrap_err().to_string().contains("secret"));
        std::fs::write(&file, "short").unwrap();
        let said = read_secret(&file).unwrap_err().to_string();
        assert!(said.contains("5 bytes") && said.contains("16 to 4096"), "{said}");
        std::fs::write(&file, "0123456789abcdef\n").unwrap();
        assert_eq!(read_secret(&file).unwrap(), admin_key(b"0123456789abcdef"));
    }
}
