//! What one session is sent that nobody else is: its own actor, what became of its inputs, which cells it may take.
//!
//! Pure. Its snapshots are coded against what the session acknowledged.

use pita_protocol::dof::{Body, Encoder, Precision, State};
use pita_protocol::message::{InputAck, Snapshot};

use super::{Cells, Grants, Published};
use crate::crowd::Family;

/// The stream of one session.
#[derive(Debug)]
pub struct OwnStream {
    state: State,
    position: Option<[f32; 3]>,
    encoder: Encoder,
    grants: Grants,
}

/// What a snapshot says beside the actor.
#[derive(Clone, Copy, Debug)]
pub struct Head {
    /// Epoch of the session.
    pub epoch: u32,
    /// Tick of the snapshot.
    pub tick: u64,
    /// What became of the session's inputs.
    pub ack: InputAck,
    /// Number of the last event.
    pub event_sequence: u32,
    /// Tick of the newest snapshot that the session acknowledged, 0 for none, and a bit for each before it.
    pub acknowledged: (u64, u32),
}

impl OwnStream {
    /// Of a session that is sent `bytes_per_s` at most.
    pub fn new(precision: Precision, bytes_per_s: u32, tick_hz: u16) -> Self {
        Self {
            // Of a description that has this precision already.
            state: State::new(precision).expect("a precision that was checked"),
            position: None,
            encoder: Encoder::default(),
            grants: Grants::new(bytes_per_s, tick_hz),
        }
    }

    /// Nothing of the coming tick is known yet.
    pub fn clear(&mut self) {
        self.state.clear();
        self.position = None;
    }

    /// The next body of `world` is one of the session's actor, which is `family`.
    pub fn add(&mut self, world: &State, body: &Body, family: &Family) {
        self.position = family.position;
        // A part of a world that fits does.
        drop(self.state.push_copy(world, body));
    }

    /// Those messages of the `cells` of this tick that the session may take; to be asked for before
    /// [`OwnStream::snapshot`], which chooses for the next.
    pub fn granted<'a>(&self, cells: &'a Cells) -> impl Iterator<Item = &'a Published> {
        self.grants.granted(cells.published())
    }

    /// The snapshot that follows the `cells` of its tick, encoded, and the bytes that the session is sent of those.
    pub fn snapshot(&mut self, head: &Head, cells: &Cells) -> (Vec<u8>, usize) {
        let &Head { epoch, tick, ack, event_sequence, .. } = head;
        let acknowledged = match head.acknowledged {
            (0, _) => {
                self.encoder.restart();
                None
            }
            (tick, before) => {
                self.encoder.acknowledge(tick, before);
                self.grants.acknowledge(tick);
                Some(tick)
            }
        };
        let of_cells = self.grants.fill(tick, cells.published());
        self.grants.choose(tick, cells.offers(), cells.layers(), self.position, cells.division());
        let dof = self.encoder.encode(tick, &self.state, &[]);
        let cells = self.grants.untold(acknowledged).map(<[_]>::to_vec);
        let bytes = pita_protocol::encode(&Snapshot { epoch, tick, ack, event_sequence, cells, dof });
        self.grants.spend(bytes.len());
        (bytes, of_cells)
    }
}
