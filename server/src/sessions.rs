//! Sessions: who holds which slot, with which key, and when a session ends.
//!
//! A pure state machine. Times come in as milliseconds of a monotonic clock, secrets come in from outside; it knows no
//! network and no thread. What happens is queued as [`Change`]s, and a slot is given away again only after the
//! [`Change::Ended`] of its last session was taken: that bounds the queue and keeps the order of a slot's sessions.

use pita_protocol::message::{InputFrame, InputPacket, Role};
use pita_protocol::seal::SessionKey;

/// Limits of the state machine. Both kinds of slots together are at most `u16::MAX`.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Slots of players: the lowest numbers, because the arena counts its players by slot.
    pub players: u16,
    /// Slots of spectators, above those of the players.
    pub spectators: u16,
    /// Silence after which a session ends, ms.
    pub input_timeout_ms: u64,
    /// Inputs that are looked at between two ticks; a packet without a new one counts as one.
    pub inputs_per_tick: u32,
}

/// One session, named for good: a slot is used again, a pair of slot and epoch is not, as far as chance goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SessionId {
    /// Number of the place.
    pub slot: u16,
    /// Tells the sessions of one slot apart.
    pub epoch: u32,
}

/// What is random about a session, drawn by whoever begins it.
#[derive(Clone, Debug)]
pub struct Secrets {
    /// Becomes [`SessionId::epoch`]: nobody guesses it and takes the session's liveliness token for it.
    pub epoch: u32,
    /// Seals its inputs.
    pub key: SessionKey,
}

/// Why a session ended; its text is for a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndReason {
    /// The client said so.
    Left,
    /// Its liveliness token is gone.
    ConnectionLost,
    /// The arena had no place for it.
    NoPlace,
    /// Nothing was heard of it for the time given, ms.
    Silent {
        /// The timeout.
        timeout_ms: u64,
    },
}

impl std::fmt::Display for EndReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Left => f.write_str("left"),
            Self::ConnectionLost => f.write_str("connection lost"),
            Self::NoPlace => f.write_str("no place in the arena"),
            Self::Silent { timeout_ms } => write!(f, "no input for {} s", *timeout_ms as f64 / 1000.0),
        }
    }
}

/// What happened, for those who act on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A session began.
    Began {
        /// The session.
        id: SessionId,
        /// What it is.
        role: Role,
        /// Its name.
        name: String,
    },
    /// A session ended.
    Ended {
        /// The session.
        id: SessionId,
        /// What it was.
        role: Role,
        /// Why.
        reason: EndReason,
    },
}

/// What an input packet said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Received<'a> {
    /// Those of its frames that are new, oldest first; at least one.
    Inputs(&'a [InputFrame]),
    /// The session ended with this packet.
    Left,
}

/// Why an authentic input packet was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputRefusal {
    /// No such session, or another epoch of the slot.
    NoSession,
    /// Nothing new in it.
    Stale,
    /// Too many between two ticks.
    Flood,
}

/// All slots.
pub struct Sessions {
    limits: Limits,
    slots: Vec<Slot>,
    closing: bool,
    changes: Vec<Change>,
}

enum Slot {
    Free,
    Taken(Session),
    /// Its session's end has not been taken yet.
    Ended,
}

struct Session {
    epoch: u32,
    key: SessionKey,
    role: Role,
    heard_ms: u64,
    last_sequence: u32,
    inputs_tick: u64,
    inputs: u32,
}

/// Why nobody can join.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JoinRefusal {
    /// Every slot of the role is taken.
    Full,
    /// The server ends.
    Closing,
}

impl Sessions {
    /// Empty slots.
    pub fn new(limits: Limits) -> Self {
        let slots = (0..limits.players + limits.spectators).map(|_| Slot::Free).collect();
        Self { limits, slots, closing: false, changes: Vec::new() }
    }

    /// Begins a session on the lowest free slot of its role.
    ///
    /// # Errors
    /// [`JoinRefusal`].
    pub fn join(&mut self, name: &str, role: Role, secrets: Secrets, now_ms: u64) -> Result<SessionId, JoinRefusal> {
        if self.closing {
            return Err(JoinRefusal::Closing);
        }
        let slots = match role {
            Role::Player => 0..self.limits.players,
            Role::Spectator => self.limits.players..self.slots(),
        };
        let is_free = |slot: &u16| matches!(self.slots[usize::from(*slot)], Slot::Free);
        let slot = slots.into_iter().find(is_free).ok_or(JoinRefusal::Full)?;
        let id = SessionId { slot, epoch: secrets.epoch };
        self.slots[usize::from(slot)] = Slot::Taken(Session {
            epoch: id.epoch,
            key: secrets.key,
            role,
            heard_ms: now_ms,
            last_sequence: 0,
            inputs_tick: 0,
            inputs: 0,
        });
        self.changes.push(Change::Began { id, role, name: name.to_owned() });
        Ok(id)
    }

    /// Key of the session that holds `slot`.
    pub fn key(&self, slot: u16) -> Option<&SessionKey> {
        match self.slots.get(usize::from(slot))? {
            Slot::Taken(session) => Some(&session.key),
            Slot::Free | Slot::Ended => None,
        }
    }

    /// Takes an authentic packet for `slot`, received at `now_ms` while tick `tick` was the coming one.
    ///
    /// # Errors
    /// [`InputRefusal`].
    pub fn receive<'a>(
        &mut self,
        slot: u16,
        packet: &'a InputPacket,
        tick: u64,
        now_ms: u64,
    ) -> Result<Received<'a>, InputRefusal> {
        let id = SessionId { slot, epoch: packet.epoch };
        let inputs_max = self.limits.inputs_per_tick;
        let session = self.session_mut(id).ok_or(InputRefusal::NoSession)?;
        if session.inputs_tick != tick {
            (session.inputs_tick, session.inputs) = (tick, 0);
        }
        // Sequences of a valid packet ascend.
        let fresh = &packet.frames[packet.frames.partition_point(|frame| frame.sequence <= session.last_sequence)..];
        session.inputs = session.inputs.saturating_add(fresh.len().max(1) as u32);
        if session.inputs > inputs_max {
            return Err(InputRefusal::Flood);
        }
        if packet.leave {
            self.end(id, EndReason::Left);
            return Ok(Received::Left);
        }
        let newest = fresh.last().ok_or(InputRefusal::Stale)?;
        session.last_sequence = newest.sequence;
        session.heard_ms = now_ms;
        Ok(Received::Inputs(fresh))
    }

    /// The session's liveliness token is gone: ends it.
    pub fn token_disappeared(&mut self, id: SessionId) {
        self.end(id, EndReason::ConnectionLost);
    }

    /// The arena refused the player: ends the session.
    pub fn refused_by_arena(&mut self, id: SessionId) {
        self.end(id, EndReason::NoPlace);
    }

    /// Ends sessions of which nothing was heard; spectators send inputs too, which drive nothing.
    pub fn expire(&mut self, now_ms: u64) {
        let timeout_ms = self.limits.input_timeout_ms;
        for slot in 0..self.slots() {
            let Slot::Taken(session) = &self.slots[usize::from(slot)] else { continue };
            if now_ms.saturating_sub(session.heard_ms) > timeout_ms {
                self.end(SessionId { slot, epoch: session.epoch }, EndReason::Silent { timeout_ms });
            }
        }
    }

    /// From now on nobody joins.
    pub fn close(&mut self) {
        self.closing = true;
    }

    /// Moves what happened since the last call to the end of `into`, in order, and frees the slots of ended sessions.
    pub fn take_changes(&mut self, into: &mut Vec<Change>) {
        into.append(&mut self.changes);
        for slot in &mut self.slots {
            if matches!(slot, Slot::Ended) {
                *slot = Slot::Free;
            }
        }
    }

    /// Sessions now.
    pub fn count(&self) -> usize {
        self.slots.iter().filter(|slot| matches!(slot, Slot::Taken(_))).count()
    }

    /// Slots for `role`.
    pub fn slots_of(&self, role: Role) -> u16 {
        match role {
            Role::Player => self.limits.players,
            Role::Spectator => self.limits.spectators,
        }
    }

    /// Number of slots.
    pub fn slots(&self) -> u16 {
        self.limits.players + self.limits.spectators
    }

    fn session_mut(&mut self, id: SessionId) -> Option<&mut Session> {
        match self.slots.get_mut(usize::from(id.slot))? {
            Slot::Taken(session) if session.epoch == id.epoch => Some(session),
            _ => None,
        }
    }

    fn end(&mut self, id: SessionId, reason: EndReason) {
        let Some(session) = self.session_mut(id) else { return };
        let role = session.role;
        self.slots[usize::from(id.slot)] = Slot::Ended;
        self.changes.push(Change::Ended { id, role, reason });
    }
}

#[cfg(test)]
mod tests;
