//! Who may ask for what only those may ask who run the server.
//!
//! Owns the secret and the challenges that were given out; what is asked for is done by the daemon's own loop, which reads
//! the disk. Pure: randomness comes in.

use std::collections::VecDeque;
use std::io::Read;
use std::path::Path;

use pita_protocol::admin::{AdminAction, AdminReply, AdminRequest, CHALLENGE_BYTES, SECRET_BYTES, admin_key};
use pita_protocol::seal::{self, SessionKey};
use zenoh::query::Query;

/// Challenges that wait to be used; the oldest is forgotten for a new one.
const CHALLENGES_MAX: usize = 8;

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
    given: VecDeque<[u8; CHALLENGE_BYTES]>,
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
    /// Of those who know what `key` was made of.
    pub fn new(key: Option<SessionKey>) -> Self {
        Self { key, given: VecDeque::with_capacity(CHALLENGES_MAX) }
    }

    /// Judges a request that came on `key_expr`; `fresh` is the challenge that it gets if it asks for one.
    pub fn judge(&mut self, sealed: &[u8], key_expr: &str, fresh: [u8; CHALLENGE_BYTES]) -> Verdict {
        let Some(key) = &self.key else {
            let how = "this server takes no admin requests: set admin.secret_file in its configuration";
            return Verdict::Answer(AdminReply::answered(false, [how.to_owned()]));
        };
        match seal::open(sealed, key, key_expr) {
            Ok(AdminRequest::Challenge) => {
                if self.given.len() == CHALLENGES_MAX {
                    self.given.pop_front();
                }
                self.given.push_back(fresh);
                Verdict::Answer(AdminReply::Challenge(fresh))
            }
            Ok(AdminRequest::Do { challenge, action }) if self.take(&challenge) => Verdict::Do(action),
            _ => Verdict::Answer(AdminReply::Refused),
        }
    }

    /// Whether the challenge was given out and not used yet; it is used then.
    fn take(&mut self, challenge: &[u8; CHALLENGE_BYTES]) -> bool {
        let place = self.given.iter().position(|given| given == challenge);
        place.and_then(|place| self.given.remove(place)).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY_EXPR: &str = "pita/a/admin";

    #[test]
    fn a_challenge_opens_the_door_once() {
        let key = admin_key(b"a secret of some length");
        let mut door = Doorkeeper::new(Some(key.clone()));
        let sealed = |request: &AdminRequest| seal::seal(request, &key, KEY_EXPR);
        let reload = |challenge| sealed(&AdminRequest::Do { challenge, action: AdminAction::Reload });
        let refused = Verdict::Answer(AdminReply::Refused);
        assert_eq!(door.judge(&reload([7; 16]), KEY_EXPR, [0; 16]), refused, "it was never given out");
        let given = door.judge(&sealed(&AdminRequest::Challenge), KEY_EXPR, [7; 16]);
        assert_eq!(given, Verdict::Answer(AdminReply::Challenge([7; 16])));
        assert_eq!(door.judge(&reload([7; 16]), KEY_EXPR, [0; 16]), Verdict::Do(AdminAction::Reload));
        assert_eq!(door.judge(&reload([7; 16]), KEY_EXPR, [0; 16]), refused, "and is used");
    }

    #[test]
    fn who_does_not_know_the_secret_gets_no_challenge() {
        let mut door = Doorkeeper::new(Some(admin_key(b"a secret of some length")));
        let forged = seal::seal(&AdminRequest::Challenge, &admin_key(b"another secret, as long"), KEY_EXPR);
        for sealed in [&forged[..], b"", b"nonsense"] {
            assert_eq!(door.judge(sealed, KEY_EXPR, [1; 16]), Verdict::Answer(AdminReply::Refused));
        }
        assert!(door.given.is_empty());
        let said = Doorkeeper::new(None).judge(&forged, KEY_EXPR, [1; 16]);
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
