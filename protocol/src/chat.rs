//! What players say to each other: length bounded, and free of what would fool a reader.

use serde::{Deserialize, Serialize};

use crate::codec::{Message, WireError, require};

/// Longest text, bytes.
pub const CHAT_MAX: usize = 200;

/// Query payload on [`say`](crate::Keys::say), [sealed](crate::seal::seal).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SayRequest {
    /// [`JoinAccepted::epoch`](crate::message::JoinAccepted::epoch).
    pub epoch: u32,
    /// Ascends with each of a session's requests: none is taken twice.
    pub sequence: u32,
    /// 1 to 200 bytes.
    pub text: String,
}

impl Message for SayRequest {
    const KIND: u8 = 11;
    const MAX_BYTES: usize = CHAT_MAX + 32;
    fn validate(&self) -> Result<(), WireError> {
        require((1..=CHAT_MAX).contains(&self.text.len()), "text", "1 to 200 bytes")
    }
}

/// Answer to a [`SayRequest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SayReply {
    /// Everybody is told, by [`Event::Said`](crate::message::Event::Said).
    Said,
    /// Nobody is.
    Refused(SayRefusal),
}

/// Why something was not said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum SayRefusal {
    /// Too much of late.
    #[error("too many messages: wait {wait_ms} ms")]
    TooOften {
        /// Time after which there is room for one, ms.
        wait_ms: u32,
    },
    /// Nothing is left of the text without what is not for reading.
    #[error("there is nothing to read in it")]
    Empty,
    /// It could not be read, is sealed wrongly, came before, or is of no session.
    #[error("it is not a message of this session")]
    NotYours,
}

impl Message for SayReply {
    const KIND: u8 = 12;
    const MAX_BYTES: usize = 64;
    fn validate(&self) -> Result<(), WireError> {
        Ok(())
    }
}

/// `text` as it is shown: one line, single spaces, without control characters and without those that are not seen or turn
/// the direction of reading.
pub fn readable(text: &str) -> String {
    let is_unseen = |c: char| {
        c.is_control()
            || matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
    };
    let seen: String = text.chars().map(|c| if is_unseen(c) { ' ' } else { c }).collect();
    seen.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_for_reading_goes() {
        for (said, shown) in [
            ("  hello \n world ", "hello world"),
            ("\u{1b}[31mred", "[31mred"),
            ("abc\u{202e}txt.exe", "abc txt.exe"),
            ("\u{200b}\u{feff}", ""),
            ("Grüße, 羊!", "Grüße, 羊!"),
        ] {
            assert_eq!(readable(said), shown);
        }
    }

    #[test]
    fn texts_have_a_length() {
        let say = |length| SayRequest { epoch: 1, sequence: u32::MAX, text: "x".repeat(length) };
        assert!(say(0).validate().is_err() && say(201).validate().is_err());
        assert!(crate::encode(&say(200)).len() <= SayRequest::MAX_BYTES);
        assert_eq!(crate::decode(&crate::encode(&say(200))), Ok(say(200)));
    }
}
