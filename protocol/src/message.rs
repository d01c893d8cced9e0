//! Every message of the protocol, with its limits and its checks.
//!
//! Joining: a client queries [`JoinRequest`], gets [`JoinReply`]; from then on it puts sealed [`InputPacket`]s and
//! receives [`Snapshot`]s and [`EventMessage`]s. Anybody may query [`Description`], [`Status`] and [`TickRecords`].

use serde::{Deserialize, Serialize};

use crate::cell::check_grants;
pub use crate::cell::{
    CellGrant, CellId, CellKeyframes, CellSnapshot, Departure, GRANTS_MAX, Keyframe, Keyframes, KeyframesRequest,
    KeyframesWanted, LAYERS_MAX,
};
pub use crate::chat::{CHAT_MAX, SayRefusal, SayReply, SayRequest};
use crate::codec::{Message, WireError, require};
pub use crate::description::{
    ActorDescription, ChainJoint, Description, JointMotion, Mount, MountNode, PartDescription, Shape,
    StaticDescription, Vertex,
};
pub use crate::input::{
    Controls, FATES_MAX, INPUT_FRAMES_MAX, InputAck, InputCounts, InputFate, InputFates, InputFrame, InputPacket,
    buttons,
};
use crate::seal::{SessionKey, TAG_BYTES};

/// Longest player name, bytes.
pub const NAME_MAX: usize = 32;
/// Longest free text in a message, bytes.
pub const TEXT_MAX: usize = 256;

// --- joining -------------------------------------------------------------------------------------------------------

/// What a client wants to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Gets a slot and a vehicle.
    Player,
    /// Gets a slot and snapshots, and drives nothing.
    Spectator,
}

/// Query payload on [`join`](crate::Keys::join).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinRequest {
    /// Name to show, 1 to 32 bytes without control characters.
    pub name: String,
    /// Player or spectator.
    pub role: Role,
    /// How much of the state it wants to be sent, bytes/s; the server gives no more than its configuration allows, and not
    /// less than 8000. `None` for what the server gives.
    pub bytes_per_s: Option<u32>,
    /// Whether what it may take of cells is put on the key of its own snapshots, where it need not subscribe to any: over
    /// datagrams subscriptions get lost, and so does what takes them back.
    pub cells_along: bool,
    /// The earlier session that is to go on, where it is not over yet; name and role stay what they were, what it is sent is
    /// as this request says.
    pub resume: Option<ResumeProof>,
}

/// Shows that whoever asks had a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResumeProof {
    /// Its slot.
    pub slot: u16,
    /// Its epoch. The session gets a new one, and a new key: a proof is good for once.
    pub epoch: u32,
    /// What [`prove`](crate::seal::prove) makes of them and the session's key.
    pub proof: [u8; TAG_BYTES],
}

impl Message for JoinRequest {
    const KIND: u8 = 1;
    const MAX_BYTES: usize = 128;
    fn validate(&self) -> Result<(), WireError> {
        let printable = !self.name.trim().is_empty() && !self.name.chars().any(char::is_control);
        require(printable && self.name.len() <= NAME_MAX, "name", "1 to 32 bytes without control characters")
    }
}

/// Answer to a [`JoinRequest`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JoinReply {
    /// The session exists now.
    Accepted(Box<JoinAccepted>),
    /// No session; the text is for a person.
    Refused(Refusal),
}

/// Why a join was refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The client speaks another protocol version.
    #[error("the server speaks protocol version {server}, this client {client}: use a client of the server's version")]
    Version {
        /// Version of the server.
        server: u16,
        /// Version that the client sent.
        client: u16,
    },
    /// The request could not be read.
    #[error("malformed join request: {0}")]
    Malformed(String),
    /// Every slot is taken.
    #[error("the server is full ({slots} slots): try again later, or start it with more")]
    Full {
        /// Number of slots of the server.
        slots: u16,
    },
    /// Somebody with that name is there.
    #[error("the name {name:?} is taken: choose another")]
    NameTaken {
        /// The name.
        name: String,
    },
    /// The name is banned by whoever runs the server.
    #[error("the name {name:?} is banned on this server")]
    Banned {
        /// The name.
        name: String,
    },
    /// The session that was to go on is over, or another one than the proof is for.
    #[error("the earlier session is over: join anew")]
    Over,
    /// The server is about to end.
    #[error("the server is closing")]
    Closing,
    /// The session ended before it was let in.
    #[error("the session ended before it began ({reason}): try again")]
    Ended {
        /// For a person, as in [`Event::Left`].
        reason: String,
    },
}

/// A session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JoinAccepted {
    /// Number of the place; part of the session's key expressions.
    pub slot: u16,
    /// Tells this session from earlier ones on the same slot.
    pub epoch: u32,
    /// Secret that seals this session's inputs.
    pub session_key: SessionKey,
    /// Length of a tick is 1 s / this, Hz.
    pub tick_hz: u16,
    /// A session that sends no input for so long is ended, ms.
    pub input_timeout_ms: u32,
    /// The session's own actor; `None` for a spectator.
    pub actor: Option<u32>,
    /// The world at [`Description::tick`].
    pub description: Description,
}

impl Message for JoinReply {
    const KIND: u8 = 2;
    const MAX_BYTES: usize = Description::MAX_BYTES + 1024;
    fn validate(&self) -> Result<(), WireError> {
        match self {
            Self::Refused(_) => Ok(()),
            Self::Accepted(accepted) => {
                require((1..=1000).contains(&accepted.tick_hz), "tick_hz", "1 to 1000")?;
                accepted.description.validate()
            }
        }
    }
}

// --- what happens --------------------------------------------------------------------------------------------------

/// Put on [`snapshot`](crate::Keys::snapshot) after each tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// [`JoinAccepted::epoch`] of the session that it is for: the slot's last or next session is none of its business.
    pub epoch: u32,
    /// Tick whose end this is; gaps in it are lost snapshots.
    pub tick: u64,
    /// Inputs of the session that this snapshot is for.
    pub ack: InputAck,
    /// Number of the last event before this snapshot.
    pub event_sequence: u32,
    /// The cells that the session may take from now on, in order; `None` where that is known to have arrived.
    pub cells: Option<Vec<CellGrant>>,
    /// The session's own actor, a snapshot of the session's stream; see [`dof`](crate::dof).
    #[serde(with = "bytes")]
    pub dof: Vec<u8>,
}

impl Message for Snapshot {
    const KIND: u8 = 5;
    const MAX_BYTES: usize = 1 << 20;
    fn validate(&self) -> Result<(), WireError> {
        self.cells.as_deref().map_or(Ok(()), check_grants)
    }
}

/// Put on [`event`](crate::Keys::event).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventMessage {
    /// Counts up by one; a gap means that [`Description`] has to be asked for again.
    pub sequence: u32,
    /// Tick at which it happened.
    pub tick: u64,
    /// What happened.
    pub event: Event,
}

/// Something that happens once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// An actor came into the arena.
    ActorAdded(ActorDescription),
    /// An actor and all of its slices are gone.
    ActorRemoved {
        /// [`ActorDescription::id`].
        id: u32,
    },
    /// A session began.
    Joined {
        /// Its slot.
        slot: u16,
        /// Its name.
        name: String,
    },
    /// A session ended.
    Left {
        /// Its slot.
        slot: u16,
        /// For a person: `left`, `connection lost`, `no input for 5 s`.
        reason: String,
    },
    /// A player or spectator says something.
    Said {
        /// Slot of the session.
        slot: u16,
        /// One line, [readable](crate::chat::readable).
        text: String,
    },
    /// Something to see or hear.
    Effect(Effect),
    /// An actor is knocked out.
    KnockedOut {
        /// Who.
        actor: u32,
        /// Whose merit it is.
        by: Option<u32>,
    },
    /// An actor has more points than before.
    Scored {
        /// Who.
        actor: u32,
        /// In this round.
        points: u32,
    },
    /// A round is over.
    RoundEnded {
        /// Counts rounds, from 1.
        number: u32,
        /// Who has most points; nobody where nobody has any.
        winner: Option<u32>,
    },
    /// A round begins, nobody having any points.
    RoundBegan {
        /// Counts rounds, from 1.
        number: u32,
    },
    /// The server ends.
    Closing {
        /// For a person.
        reason: String,
    },
}

/// Something to see or hear, once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// `dust`, `splinters`, `blast`.
    pub kind: String,
    /// The actor that made it.
    pub actor: u32,
    /// Where, m.
    pub position: [f32; 3],
    /// Which way and how far, m.
    pub direction: [f32; 3],
    /// 0 to 1.
    pub strength: f32,
}

impl Message for EventMessage {
    const KIND: u8 = 6;
    const MAX_BYTES: usize = 64 << 10;
    fn validate(&self) -> Result<(), WireError> {
        match &self.event {
            Event::ActorAdded(actor) => actor.validate(),
            Event::Joined { name: text, .. } | Event::Left { reason: text, .. } | Event::Closing { reason: text } => {
                require(text.len() <= TEXT_MAX, "text", "at most 256 bytes")
            }
            Event::Said { text, .. } => require(text.len() <= TEXT_MAX, "text", "at most 256 bytes"),
            Event::Effect(effect) => {
                require(effect.kind.len() <= TEXT_MAX, "text", "at most 256 bytes")?;
                let numbers = effect.position.iter().chain(&effect.direction).chain([&effect.strength]);
                require(numbers.into_iter().all(|x| x.is_finite()), "effect", "finite")
            }
            Event::ActorRemoved { .. }
            | Event::KnockedOut { .. }
            | Event::Scored { .. }
            | Event::RoundEnded { .. }
            | Event::RoundBegan { .. } => Ok(()),
        }
    }
}

/// Answer on [`source`](crate::Keys::source): the arena's file, for those who predict their own vehicle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArenaSource {
    /// TOML, as the server read it.
    pub toml: String,
    /// The meshes that it names, at most [`SOURCE_FILES_MAX`]; none of them where they are more than 1.5 MiB.
    pub files: Vec<SourceFile>,
}

/// Most files of an [`ArenaSource`].
pub const SOURCE_FILES_MAX: usize = 256;

/// Most bytes of all of them.
pub const SOURCE_FILES_BYTES_MAX: usize = 3 << 19;

/// A file beside an arena's.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceFile {
    /// As the arena's file names it, at most 128 bytes.
    pub name: String,
    /// What is in it.
    #[serde(with = "bytes")]
    pub content: Vec<u8>,
}

impl Message for ArenaSource {
    const KIND: u8 = 10;
    const MAX_BYTES: usize = 3 << 20;
    fn validate(&self) -> Result<(), WireError> {
        require(self.files.len() <= SOURCE_FILES_MAX, "files", "at most 256")?;
        require(self.files.iter().all(|file| file.name.len() <= 128), "name of a file", "at most 128 bytes")
    }
}

// --- how the server does -------------------------------------------------------------------------------------------

/// Answer on [`status`](crate::Keys::status).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Version and commit of the server.
    pub version: String,
    /// Name of the arena.
    pub arena: String,
    /// Last finished tick.
    pub tick: u64,
    /// Ticks a second.
    pub tick_hz: u16,
    /// Since the start, s.
    pub uptime_s: f64,
    /// Over the last ten seconds, ms.
    pub tick_p50_ms: f64,
    /// Over the last ten seconds, ms.
    pub tick_p99_ms: f64,
    /// Ticks that took longer than the tick period, since the start.
    pub overruns: u64,
    /// Ticks that were left out to catch up, since the start.
    pub skipped_ticks: u64,
    /// Sessions now.
    pub clients: u32,
    /// Bodies now.
    pub bodies: u32,
    /// Unknowns of the last tick.
    pub dof_awake: u32,
    /// Contact points of the last tick.
    pub contacts: u32,
    /// Bodies whose state became non-finite and were taken out, since the start.
    pub quarantined: u64,
    /// Payload sent to clients, over the last ten seconds, bytes/s.
    pub sent_bytes_per_s: f64,
    /// Payload received from clients, over the last ten seconds, bytes/s.
    pub received_bytes_per_s: f64,
    /// Resident memory, bytes.
    pub memory_bytes: u64,
    /// CPU time of the whole process since its start, s.
    pub cpu_s: f64,
    /// What became of the players' inputs, since the start.
    pub inputs: InputCounts,
    /// From the arrival of an input to the start of the tick that applied it, over the last inputs, ms.
    pub input_wait_p50_ms: f64,
    /// The same, ms.
    pub input_wait_p99_ms: f64,
    /// What was refused, since the start.
    pub refused: RefusedCounts,
    /// What actors do, by kind, in order of their names; at most [`KINDS_MAX`].
    pub kinds: Vec<KindStatus>,
    /// Hash of the state after [`Status::tick`].
    pub state_hash: u64,
}

/// Most kinds of actors that a [`Status`] tells of.
pub const KINDS_MAX: usize = 40;

/// Longest name of a kind of actors there, bytes.
const KIND_NAME_MAX: usize = 48;

/// What the actors of one kind do.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KindStatus {
    /// `vehicle`, `crate`; at most 48 bytes.
    pub kind: String,
    /// How many acted in the last tick.
    pub actors: u32,
    /// Sporadic jobs of theirs since the start: work that is spread over ticks.
    pub sporadic: u64,
}

/// Messages that were dropped or refused, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusedCounts {
    /// Joins of another protocol version.
    pub join_version: u64,
    /// Joins that could not be read.
    pub join_malformed: u64,
    /// Joins for which there was no slot.
    pub join_full: u64,
    /// Joins of which the session ended before it was let in.
    pub join_ended: u64,
    /// Joins under a name that is taken or banned.
    pub join_name: u64,
    /// Joins that were to go on with a session that is over.
    pub join_over: u64,
    /// Inputs longer than allowed.
    pub input_too_long: u64,
    /// Inputs of another protocol version.
    pub input_version: u64,
    /// Inputs that could not be read.
    pub input_malformed: u64,
    /// Inputs with a value that is out of range or not finite.
    pub input_content: u64,
    /// Inputs with a wrong seal.
    pub input_forged: u64,
    /// Inputs of no session, or of one that is over: the last words of one that leaves are repeated.
    pub input_no_session: u64,
    /// Inputs with nothing new in them.
    pub input_stale: u64,
    /// Inputs dropped because too many came between two ticks.
    pub input_flood: u64,
    /// Queries (`status`, `ticks`, `describe`) that could not be read.
    pub query_malformed: u64,
    /// Chat that was refused: too much of it, not for reading, not authentic.
    pub say_refused: u64,
}

impl Message for Status {
    const KIND: u8 = 7;
    const MAX_BYTES: usize = 4096;
    fn validate(&self) -> Result<(), WireError> {
        require(self.kinds.len() <= KINDS_MAX, "kinds", "at most 40")?;
        require(self.kinds.iter().all(|kind| kind.kind.len() <= KIND_NAME_MAX), "kind", "at most 48 bytes")
    }
}

/// Query payload on [`ticks`](crate::Keys::ticks).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TicksRequest {
    /// First tick wanted; the server keeps the last [`TICK_RECORDS_MAX`].
    pub since: u64,
}

impl Message for TicksRequest {
    const KIND: u8 = 8;
    const MAX_BYTES: usize = 32;
    fn validate(&self) -> Result<(), WireError> {
        Ok(())
    }
}

/// Most ticks that a server keeps records of.
pub const TICK_RECORDS_MAX: usize = 4096;

/// Names of the pipeline's five stages, in order: the same in the code, the docs and the metrics.
pub const STAGE_NAMES: [&str; 5] = ["input", "collision", "logic", "integration", "output"];

/// What one tick cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TickRecord {
    /// Number of the tick.
    pub tick: u64,
    /// From the tick's start to its end, µs.
    pub wall_us: u32,
    /// Of [`TickRecord::wall_us`], each stage of [`STAGE_NAMES`], µs.
    pub stage_us: [u32; 5],
    /// CPU time of the tick's thread, µs.
    pub cpu_us: u32,
    /// Time that the tick's thread was ready and waited for a core, µs.
    pub wait_us: u32,
    /// How late the tick began, µs.
    pub late_us: u32,
    /// Sessions.
    pub clients: u16,
    /// Bodies.
    pub bodies: u32,
    /// Unknowns.
    pub dof_awake: u32,
    /// Contact points.
    pub contacts: u32,
    /// Newton iterations, summed over islands.
    pub newton_iterations: u32,
    /// Iterations of the linear solver, summed over islands.
    pub linear_iterations: u32,
    /// Actors that acted.
    pub actors: u32,
    /// Sporadic jobs that were due: work that is spread over ticks.
    pub sporadic: u32,
}

/// Answer to a [`TicksRequest`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickRecords {
    /// In order of tick, without gaps unless ticks were skipped.
    pub records: Vec<TickRecord>,
}

impl Message for TickRecords {
    const KIND: u8 = 9;
    const MAX_BYTES: usize = 128 * TICK_RECORDS_MAX;
    fn validate(&self) -> Result<(), WireError> {
        require(self.records.len() <= TICK_RECORDS_MAX, "records", "at most 4096")
    }
}

/// `Vec<u8>` as one run of bytes instead of a sequence of numbers.
pub(crate) mod bytes {
    use serde::{Deserializer, Serializer, de::Visitor};

    pub fn serialize<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(bytes)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
        struct Bytes;
        impl Visitor<'_> for Bytes {
            type Value = Vec<u8>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("bytes")
            }
            fn visit_bytes<E>(self, bytes: &[u8]) -> Result<Vec<u8>, E> {
                Ok(bytes.to_vec())
            }
            fn visit_byte_buf<E>(self, bytes: Vec<u8>) -> Result<Vec<u8>, E> {
                Ok(bytes)
            }
        }
        deserializer.deserialize_byte_buf(Bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PROTOCOL_VERSION, decode, encode};

    fn join(name: &str) -> JoinRequest {
        JoinRequest { name: name.to_owned(), role: Role::Player, bytes_per_s: None, cells_along: false, resume: None }
    }

    fn packet(throttle: f32) -> InputPacket {
        let controls = Controls { throttle, ..Controls::default() };
        let frames = (1..=3).map(|sequence| InputFrame { sequence, tick: 7, controls }).collect();
        InputPacket { epoch: 1, snapshot_tick: 6, snapshots_before: 5, leave: false, frames }
    }

    #[test]
    fn messages_round_trip() {
        assert_eq!(decode(&encode(&join("Wu"))), Ok(join("Wu")));
        assert_eq!(decode(&encode(&packet(0.5))), Ok(packet(0.5)));
        let snapshot = Snapshot {
            epoch: 9,
            tick: 1,
            ack: InputAck::default(),
            event_sequence: 2,
            cells: Some(vec![CellGrant { cell: CellId { x: -1, z: 2 }, layers: 3 }]),
            dof: vec![1, 2, 3],
        };
        assert_eq!(decode(&encode(&snapshot)), Ok(snapshot));
    }

    #[test]
    fn version_and_kind_come_before_the_body() {
        let mut other_version = encode(&join("Wu"));
        other_version[0] = 99;
        assert_eq!(decode::<JoinRequest>(&other_version), Err(WireError::Version { theirs: 99 }));
        let other_kind = encode(&TicksRequest { since: 1 });
        assert_eq!(decode::<JoinRequest>(&other_kind), Err(WireError::Kind { got: 8, expected: 1 }));
        const { assert!(PROTOCOL_VERSION < 99) };
    }

    #[test]
    fn content_is_checked() {
        for name in ["", "  ", "a\nb", &"x".repeat(33)] {
            assert!(matches!(decode::<JoinRequest>(&encode(&join(name))), Err(WireError::Content { .. })), "{name:?}");
        }
        for throttle in [f32::NAN, f32::INFINITY, -0.1, 1.1] {
            let refused = decode::<InputPacket>(&encode(&packet(throttle)));
            assert_eq!(refused, Err(WireError::Content { field: "throttle", allowed: "0 to 1" }));
        }
        let mut trailing = encode(&join("Wu"));
        trailing.push(0);
        assert_eq!(decode::<JoinRequest>(&trailing), Err(WireError::Malformed));
        assert!(matches!(decode::<JoinRequest>(&[1; 129]), Err(WireError::TooLong { bytes: 129, max: 128 })));
    }

    #[test]
    fn the_largest_input_packet_fits_its_limit() {
        let frame = InputFrame {
            sequence: u32::MAX,
            tick: u64::MAX,
            controls: Controls { throttle: 1.0, brake: 1.0, steer: 1.0, buttons: u16::MAX },
        };
        let frames = (0..8).map(|i| InputFrame { sequence: u32::MAX - 8 + i, ..frame }).collect();
        let packet = InputPacket { epoch: u32::MAX, snapshot_tick: u64::MAX, snapshots_before: 5, leave: true, frames };
        assert!(encode(&packet).len() <= InputPacket::MAX_BYTES);
    }

    #[test]
    fn nine_bytes_cannot_claim_all_memory() {
        // Version, kind, then the marker and value of a length of 2^63.
        let mut bomb = vec![PROTOCOL_VERSION as u8, Snapshot::KIND, 0, 0, 0, 0, 0, 253];
        bomb.extend_from_slice(&(1u64 << 63).to_le_bytes());
        assert_eq!(decode::<Snapshot>(&bomb), Err(WireError::Malformed));
    }
}
