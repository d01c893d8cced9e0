//! Sessions: who holds which slot, with which key, and when a session ends.
//!
//! A pure state machine. Times come in as milliseconds of a monotonic clock, secrets come in from outside; it knows no
//! network and no thread. What happens is queued as [`Change`]s, and a slot is given away again only after the
//! [`Change::Ended`] of its last session was taken: that bounds the queue and keeps the order of a slot's sessions.
//!
//! A player whose connection is lost keeps slot and car for a grace time. Within it the session goes on: the connection
//! comes back and shows its token or sends an input, or whoever proves to know the session's key resumes it over another
//! one, with a new epoch and key.

use pita_protocol::chat;
use pita_protocol::message::{InputFrame, InputPacket, ResumeProof, Role, SayRefusal, SayRequest};
use pita_protocol::seal::{self, SessionKey};

use crate::cells::LEAST_BYTES_PER_S;

/// Limits of the state machine. Both kinds of slots together are at most `u16::MAX`.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Slots of players: the lowest numbers, because the arena counts its players by slot.
    pub players: u16,
    /// Slots of spectators, above those of the players.
    pub spectators: u16,
    /// Silence after which a session ends, ms.
    pub input_timeout_ms: u64,
    /// For so long a player may be without a connection, ms.
    pub resume_grace_ms: u64,
    /// Inputs that are looked at between two ticks; a packet without a new one counts as one.
    pub inputs_per_tick: u32,
    /// Byte budget of a session that wishes for none, and the highest that one can wish for.
    pub bytes_per_s: u32,
}

/// What a client wants to be.
#[derive(Clone, Copy, Debug)]
pub struct Wish<'a> {
    /// To be shown.
    pub name: &'a str,
    /// Player or spectator.
    pub role: Role,
    /// Byte budget; `None` for what the server gives.
    pub bytes_per_s: Option<u32>,
    /// Whether cells come along with its own snapshots.
    pub cells_along: bool,
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
    /// It goes on over another connection.
    Resumed,
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
            Self::Resumed => f.write_str("resumed over another connection"),
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
        /// Its byte budget.
        bytes_per_s: u32,
        /// Whether cells come along with its own snapshots.
        cells_along: bool,
    },
    /// A player's session goes on under another id.
    Resumed {
        /// What it was until now.
        from: SessionId,
        /// What it is from now on; the slot is the same.
        to: SessionId,
        /// Its byte budget from now on.
        bytes_per_s: u32,
        /// Whether cells come along with its own snapshots now.
        cells_along: bool,
    },
    /// A session says something that everybody is to read.
    Said {
        /// Its slot.
        slot: u16,
        /// One line.
        text: String,
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
    /// As [`folded`].
    banned: Vec<String>,
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
    /// As [`folded`].
    name: String,
    heard_ms: u64,
    /// Since when it has no connection.
    away_since_ms: Option<u64>,
    last_sequence: u32,
    inputs_tick: u64,
    inputs: u32,
    acknowledged: (u64, u32),
    /// Of the newest thing that it said.
    said_sequence: u32,
    /// When it had said nothing for long enough to say [`SAID_AT_ONCE`] things, ms.
    quiet_ms: u64,
}

/// A session may say one thing in so long, ms,
const SAID_EVERY_MS: u64 = 1500;
/// and so many at once after a silence: it bounds what waits to be published, too.
const SAID_AT_ONCE: u64 = 4;

/// Why nobody can join.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JoinRefusal {
    /// Every slot of the role is taken.
    Full,
    /// Somebody has that name.
    NameTaken,
    /// The name is on the ban list.
    Banned,
    /// There is no such session any more, or the proof is none.
    Over,
    /// The server ends.
    Closing,
}

impl Sessions {
    /// Empty slots; nobody gets in under one of the `banned` names.
    pub fn new(limits: Limits, banned: &[String]) -> Self {
        let slots = (0..limits.players + limits.spectators).map(|_| Slot::Free).collect();
        let banned = banned.iter().map(|name| folded(name)).collect();
        Self { limits, banned, slots, closing: false, changes: Vec::new() }
    }

    /// Begins a session on the lowest free slot of its role.
    ///
    /// # Errors
    /// [`JoinRefusal`].
    pub fn join(&mut self, wish: Wish<'_>, secrets: Secrets, now_ms: u64) -> Result<SessionId, JoinRefusal> {
        let Wish { name, role, .. } = wish;
        if self.closing {
            return Err(JoinRefusal::Closing);
        }
        let shown = folded(name);
        if self.banned.contains(&shown) {
            return Err(JoinRefusal::Banned);
        }
        if self.slots.iter().any(|slot| matches!(slot, Slot::Taken(session) if session.name == shown)) {
            return Err(JoinRefusal::NameTaken);
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
            name: shown,
            heard_ms: now_ms,
            away_since_ms: None,
            last_sequence: 0,
            inputs_tick: 0,
            inputs: 0,
            acknowledged: (0, 0),
            said_sequence: 0,
            quiet_ms: 0,
        });
        let (bytes_per_s, cells_along) = (self.bytes_per_s(wish.bytes_per_s), wish.cells_along);
        self.changes.push(Change::Began { id, role, name: name.to_owned(), bytes_per_s, cells_along });
        Ok(id)
    }

    /// The byte budget of a session that wishes for `wish`.
    pub fn bytes_per_s(&self, wish: Option<u32>) -> u32 {
        let most = self.limits.bytes_per_s;
        wish.map_or(most, |wish| wish.clamp(LEAST_BYTES_PER_S.min(most), most))
    }

    /// Lets a player's session go on that `proof` is for, whether its connection is known to be lost or not. Name and role
    /// stay; what it is sent, and how, is as `wish` says from then on.
    ///
    /// # Errors
    /// [`JoinRefusal::Over`], [`JoinRefusal::Closing`].
    pub fn resume(
        &mut self,
        proof: &ResumeProof,
        wish: Wish<'_>,
        secrets: Secrets,
        now_ms: u64,
    ) -> Result<SessionId, JoinRefusal> {
        let (bytes_per_s, cells_along) = (self.bytes_per_s(wish.bytes_per_s), wish.cells_along);
        if self.closing {
            return Err(JoinRefusal::Closing);
        }
        let from = SessionId { slot: proof.slot, epoch: proof.epoch };
        let session = self.session_mut(from).ok_or(JoinRefusal::Over)?;
        let is_proven = seal::proves(&proof.proof, proof.slot, proof.epoch, &session.key);
        if !is_proven || session.role != Role::Player {
            return Err(JoinRefusal::Over);
        }
        let to = SessionId { slot: from.slot, epoch: secrets.epoch };
        (session.epoch, session.key, session.acknowledged) = (to.epoch, secrets.key, (0, 0));
        (session.heard_ms, session.away_since_ms, session.last_sequence) = (now_ms, None, 0);
        session.said_sequence = 0;
        self.changes.push(Change::Resumed { from, to, bytes_per_s, cells_along });
        Ok(to)
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
        session.acknowledged = (packet.snapshot_tick, packet.snapshots_before);
        (session.heard_ms, session.away_since_ms) = (now_ms, None);
        Ok(Received::Inputs(fresh))
    }

    /// Takes what the session on `slot` says; `request` is authentic.
    ///
    /// # Errors
    /// [`SayRefusal`].
    pub fn say(&mut self, slot: u16, request: &SayRequest, now_ms: u64) -> Result<(), SayRefusal> {
        let text = chat::readable(&request.text);
        let id = SessionId { slot, epoch: request.epoch };
        let session = self.session_mut(id).ok_or(SayRefusal::NotYours)?;
        if request.sequence <= session.said_sequence {
            return Err(SayRefusal::NotYours);
        }
        session.said_sequence = request.sequence;
        if text.is_empty() {
            return Err(SayRefusal::Empty);
        }
        let quiet_ms = session.quiet_ms.max(now_ms) + SAID_EVERY_MS;
        if let Some(wait_ms @ 1..) = quiet_ms.checked_sub(now_ms + SAID_AT_ONCE * SAID_EVERY_MS) {
            return Err(SayRefusal::TooOften { wait_ms: wait_ms as u32 });
        }
        session.quiet_ms = quiet_ms;
        self.changes.push(Change::Said { slot, text });
        Ok(())
    }

    /// What the newest packet of a session acknowledged: the tick of a snapshot, 0 for none, and a bit for each before.
    pub fn acknowledged(&self, id: SessionId) -> (u64, u32) {
        match self.slots.get(usize::from(id.slot)) {
            Some(Slot::Taken(session)) if session.epoch == id.epoch => session.acknowledged,
            _ => (0, 0),
        }
    }

    /// The session's liveliness token is there, perhaps again.
    pub fn token_appeared(&mut self, id: SessionId, now_ms: u64) {
        if let Some(session) = self.session_mut(id) {
            (session.heard_ms, session.away_since_ms) = (now_ms, None);
        }
    }

    /// The session's liveliness token is gone: the grace time of a player begins, a spectator's session ends.
    pub fn token_disappeared(&mut self, id: SessionId, now_ms: u64) {
        let has_grace = self.limits.resume_grace_ms > 0;
        match self.session_mut(id) {
            Some(session) if session.role == Role::Player && has_grace => session.away_since_ms = Some(now_ms),
            _ => self.end(id, EndReason::ConnectionLost),
        }
    }

    /// The arena refused the player: ends the session.
    pub fn refused_by_arena(&mut self, id: SessionId) {
        self.end(id, EndReason::NoPlace);
    }

    /// Ends sessions whose grace time is over or of which nothing was heard; spectators send inputs too, which drive nothing.
    pub fn expire(&mut self, now_ms: u64) {
        let Limits { input_timeout_ms: timeout_ms, resume_grace_ms: grace_ms, .. } = self.limits;
        for slot in 0..self.slots() {
            let Slot::Taken(session) = &self.slots[usize::from(slot)] else { continue };
            let id = SessionId { slot, epoch: session.epoch };
            match session.away_since_ms {
                Some(since_ms) if now_ms.saturating_sub(since_ms) > grace_ms => self.end(id, EndReason::ConnectionLost),
                None if now_ms.saturating_sub(session.heard_ms) > timeout_ms => {
                    self.end(id, EndReason::Silent { timeout_ms });
                }
                _ => {}
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

    /// Sessions that have a connection now.
    pub fn count(&self) -> usize {
        let is_here = |slot: &&Slot| matches!(slot, Slot::Taken(session) if session.away_since_ms.is_none());
        self.slots.iter().filter(is_here).count()
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

/// A name as it is compared: two that a person would take for one are one.
fn folded(name: &str) -> String {
    name.trim().to_lowercase()
}

#[cfg(test)]
mod tests;
