//! The one place for key expressions.
//!
//! ```text
//! pita/<arena>/join               query: JoinRequest -> JoinReply
//! pita/<arena>/describe           query: - -> Description
//! pita/<arena>/source             query: - -> ArenaSource
//! pita/<arena>/status             query: - -> Status
//! pita/<arena>/ticks              query: TicksRequest -> TickRecords
//! pita/<arena>/admin              query: sealed AdminRequest -> AdminReply
//! pita/<arena>/input/<slot>       put by the client: sealed InputPacket
//! pita/<arena>/say/<slot>         query: sealed SayRequest -> SayReply
//! pita/<arena>/snapshot/<slot>    put by the server: Snapshot
//! pita/<arena>/cell/<x>/<z>/<layer>  put by the server: CellSnapshot
//! pita/<arena>/keyframes          query: KeyframesRequest -> Keyframes
//! pita/<arena>/event              put by the server: EventMessage
//! pita/<arena>/live/<slot>/<epoch>  liveliness token of a session
//! ```

use crate::WireError;
use crate::cell::CellId;

/// Longest arena name, bytes.
pub const ARENA_NAME_MAX: usize = 32;

/// Key expressions of one arena.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keys {
    arena: String,
}

impl Keys {
    /// Keys of `arena`.
    ///
    /// # Errors
    /// [`WireError::ArenaName`] unless the name is 1 to 32 of `a-z 0-9 - _`.
    pub fn new(arena: &str) -> Result<Self, WireError> {
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
        if arena.is_empty() || arena.len() > ARENA_NAME_MAX || !arena.chars().all(allowed) {
            return Err(WireError::ArenaName);
        }
        Ok(Self { arena: arena.to_owned() })
    }

    /// The arena's name.
    pub fn arena(&self) -> &str {
        &self.arena
    }

    /// Query: a [`JoinRequest`](crate::message::JoinRequest) is answered by a [`JoinReply`](crate::message::JoinReply).
    pub fn join(&self) -> String {
        self.of("join")
    }

    /// Query: answered by the present [`Description`](crate::message::Description).
    pub fn describe(&self) -> String {
        self.of("describe")
    }

    /// Query: answered by [`ArenaSource`](crate::message::ArenaSource).
    pub fn source(&self) -> String {
        self.of("source")
    }

    /// Query: answered by [`Status`](crate::message::Status).
    pub fn status(&self) -> String {
        self.of("status")
    }

    /// Query: a [`TicksRequest`](crate::message::TicksRequest) is answered by
    /// [`TickRecords`](crate::message::TickRecords).
    pub fn ticks(&self) -> String {
        self.of("ticks")
    }

    /// Query of who runs the server: a sealed [`AdminRequest`](crate::admin::AdminRequest) is answered by an
    /// [`AdminReply`](crate::admin::AdminReply).
    pub fn admin(&self) -> String {
        self.of("admin")
    }

    /// Put by the client of `slot`: a sealed [`InputPacket`](crate::message::InputPacket).
    pub fn input(&self, slot: u16) -> String {
        self.of(&format!("input/{slot}"))
    }

    /// All inputs, for the server's subscriber.
    pub fn all_inputs(&self) -> String {
        self.of("input/*")
    }

    /// Query of the client of `slot`: a sealed [`SayRequest`](crate::message::SayRequest) is answered by
    /// [`SayReply`](crate::message::SayReply).
    pub fn say(&self, slot: u16) -> String {
        self.of(&format!("say/{slot}"))
    }

    /// All chat, for the server's queryable.
    pub fn all_says(&self) -> String {
        self.of("say/*")
    }

    /// Put by the server for the client of `slot`: [`Snapshot`](crate::message::Snapshot).
    pub fn snapshot(&self, slot: u16) -> String {
        self.of(&format!("snapshot/{slot}"))
    }

    /// All snapshots, for the server's access rules.
    pub fn all_snapshots(&self) -> String {
        self.of("snapshot/*")
    }

    /// Put by the server: [`CellSnapshot`](crate::message::CellSnapshot)s of one layer of a cell.
    pub fn cell(&self, cell: CellId, layer: u8) -> String {
        self.of(&format!("cell/{}/{}/{layer}", cell.x, cell.z))
    }

    /// All cells, for the server's access rules.
    pub fn all_cells(&self) -> String {
        self.of("cell/*/*/*")
    }

    /// Query: a [`KeyframesRequest`](crate::message::KeyframesRequest) is answered by
    /// [`Keyframes`](crate::message::Keyframes).
    pub fn keyframes(&self) -> String {
        self.of("keyframes")
    }

    /// Put by the server: [`EventMessage`](crate::message::EventMessage).
    pub fn event(&self) -> String {
        self.of("event")
    }

    /// Liveliness token of one session.
    pub fn live(&self, slot: u16, epoch: u32) -> String {
        self.of(&format!("live/{slot}/{epoch}"))
    }

    /// All liveliness tokens, for the server's subscriber.
    pub fn all_live(&self) -> String {
        self.of("live/**")
    }

    /// Slot of an input key of this arena.
    pub fn slot_of_input(&self, key: &str) -> Option<u16> {
        self.rest(key)?.strip_prefix("input/")?.parse().ok()
    }

    /// Slot of a chat key of this arena.
    pub fn slot_of_say(&self, key: &str) -> Option<u16> {
        self.rest(key)?.strip_prefix("say/")?.parse().ok()
    }

    /// Slot and epoch of a liveliness key of this arena.
    pub fn session_of_live(&self, key: &str) -> Option<(u16, u32)> {
        let (slot, epoch) = self.rest(key)?.strip_prefix("live/")?.split_once('/')?;
        Some((slot.parse().ok()?, epoch.parse().ok()?))
    }

    fn of(&self, tail: &str) -> String {
        format!("pita/{}/{tail}", self.arena)
    }

    fn rest<'a>(&self, key: &'a str) -> Option<&'a str> {
        key.strip_prefix("pita/")?.strip_prefix(self.arena.as_str())?.strip_prefix('/')
    }
}

/// Status of whatever arena a server runs, for tools that know only the endpoint.
pub const ANY_STATUS: &str = "pita/*/status";

/// Join key of whatever arena a server runs, for clients that know only the endpoint.
pub const ANY_JOIN: &str = "pita/*/join";

/// Arena named by a key expression of this protocol.
pub fn arena_of(key: &str) -> Option<&str> {
    key.strip_prefix("pita/")?.split('/').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_round_trip() {
        let keys = Keys::new("proving-ground").unwrap();
        assert_eq!(keys.slot_of_input(&keys.input(65535)), Some(65535));
        assert_eq!(keys.session_of_live(&keys.live(3, 77)), Some((3, 77)));
        let cell = CellId { x: -7, z: 12 };
        assert_eq!(keys.cell(cell, 2), "pita/proving-ground/cell/-7/12/2");
        assert_eq!(arena_of(&keys.join()), Some("proving-ground"));
    }

    #[test]
    fn foreign_and_malformed_keys_are_refused() {
        let keys = Keys::new("a").unwrap();
        for key in ["pita/b/input/1", "pita/a/input/65536", "pita/a/input/-1", "pita/a/input/", "pita/ainput/1", ""] {
            assert_eq!(keys.slot_of_input(key), None, "{key}");
        }
        for name in ["", "A", "a/b", "a*", "ä", &"a".repeat(33)] {
            assert_eq!(Keys::new(name), Err(WireError::ArenaName), "{name}");
        }
    }
}
