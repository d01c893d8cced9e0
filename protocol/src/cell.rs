//! Messages of interest cells: what is said once to everybody who looks at a part of the arena.
//!
//! The ground is divided into squares. Each has a stream of its own ([`CellEncoder`](crate::dof::CellEncoder)), which is
//! coded once a tick and spread over layers: the first carries keyframes alone, each further one doubles the rate. Who
//! takes layers 0 to n of a cell subscribes to n + 1 key expressions.

use serde::{Deserialize, Serialize};

use crate::codec::{Message, WireError, require};
use crate::message::bytes;

/// Most cells that a session may take.
pub const GRANTS_MAX: usize = 128;
/// Most layers of a cell: keyframes at least every 32 ticks.
pub const LAYERS_MAX: u8 = 6;
/// Most bodies that a cell says to have left it.
const DEPARTED_MAX: usize = 16_384;

/// A square of the ground: where x, and z, divided by the side, rounded down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default, Hash, Serialize, Deserialize)]
pub struct CellId {
    /// Along x.
    pub x: i16,
    /// Along z.
    pub z: i16,
}

impl CellId {
    /// The cell of what has no place: kinds of a game's own, whose numbers may mean anything.
    pub const EVERYWHERE: Self = Self { x: i16::MIN, z: i16::MIN };
    /// Not a cell but everything there is, in one stream: for whom all cells would fit into its budget.
    pub const WHOLE: Self = Self { x: i16::MIN, z: i16::MAX };
}

/// A cell that a session may take within its byte budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellGrant {
    /// The cell.
    pub cell: CellId,
    /// How many of its layers, from the first on.
    pub layers: u8,
}

/// Checks the cells that a session may take.
pub(crate) fn check_grants(grants: &[CellGrant]) -> Result<(), WireError> {
    require(grants.len() <= GRANTS_MAX, "cells", "at most 128")?;
    require(grants.iter().all(|grant| (1..=LAYERS_MAX).contains(&grant.layers)), "layers", "1 to 6")?;
    require(grants.is_sorted_by(|a, b| a.cell < b.cell), "cells", "ascending")
}

/// Put on [`cell`](crate::Keys::cell) after each tick at which the cell has something to tell.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellSnapshot {
    /// The cell.
    pub cell: CellId,
    /// Tick whose end this is.
    pub tick: u64,
    /// Ticks since the cell's newest keyframe; 0 where it is one. Who lacks that asks for it.
    pub keyframe_age: u8,
    /// Bodies that went over to another cell within the last ticks.
    pub departures: Vec<Departure>,
    /// All bodies of the cell; see [`dof`](crate::dof).
    #[serde(with = "bytes")]
    pub dof: Vec<u8>,
}

/// Bodies that went from one cell to another. A body that a cell lacks and that is in none of these is no more.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Departure {
    /// The cell that they belong to from then on.
    pub to: CellId,
    /// Their ids.
    pub bodies: Vec<u32>,
}

impl Message for CellSnapshot {
    const KIND: u8 = 13;
    const MAX_BYTES: usize = (1 << 20) + (64 << 10);
    fn validate(&self) -> Result<(), WireError> {
        let bodies: usize = self.departures.iter().map(|departure| departure.bodies.len()).sum();
        require(bodies <= DEPARTED_MAX, "departures", "at most 16384 bodies")
    }
}

/// Query payload on [`keyframes`](crate::Keys::keyframes), answered by [`Keyframes`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyframesRequest {
    /// What is wanted, at most [`GRANTS_MAX`], in order of cell.
    pub cells: Vec<KeyframesWanted>,
}

/// A cell of which keyframes are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyframesWanted {
    /// The cell.
    pub cell: CellId,
    /// Tick of the newest keyframe of it that the client has; 0 for none.
    pub have: u64,
}

impl Message for KeyframesRequest {
    const KIND: u8 = 14;
    const MAX_BYTES: usize = 2048;
    fn validate(&self) -> Result<(), WireError> {
        require(self.cells.len() <= GRANTS_MAX, "cells", "at most 128")?;
        // Who asks for one cell many times would be answered as many times.
        require(self.cells.is_sorted_by(|a, b| a.cell < b.cell), "cells", "ascending")
    }
}

/// What leads to the present keyframes of cells.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Keyframes {
    /// As asked for; those at the end are missing where they would not fit.
    pub cells: Vec<CellKeyframes>,
}

/// What leads to a cell's present keyframe: to be decoded in order, after the keyframe that the client has where that
/// belongs to the present epoch, and from nothing otherwise.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CellKeyframes {
    /// The cell.
    pub cell: CellId,
    /// Oldest first; empty where there is nothing newer, or nothing in the cell.
    pub keyframes: Vec<Keyframe>,
}

/// A keyframe of a cell.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Its tick.
    pub tick: u64,
    /// As in [`CellSnapshot::dof`].
    #[serde(with = "bytes")]
    pub dof: Vec<u8>,
}

impl Keyframes {
    /// Appends what `epoch`, the keyframes of the present epoch of `wanted`, has that the client has not, unless the message
    /// would become too long.
    pub fn push(&mut self, wanted: KeyframesWanted, epoch: &[Keyframe]) {
        let had = epoch.iter().position(|keyframe| keyframe.tick == wanted.have).map_or(0, |had| had + 1);
        let bytes = |keyframes: &[Keyframe]| keyframes.iter().map(|keyframe| keyframe.dof.len() + 16).sum::<usize>();
        let so_far: usize = self.cells.iter().map(|cell| bytes(&cell.keyframes) + 16).sum();
        if so_far + bytes(&epoch[had..]) < Self::MAX_BYTES / 2 || self.cells.is_empty() {
            self.cells.push(CellKeyframes { cell: wanted.cell, keyframes: epoch[had..].to_vec() });
        }
    }
}

impl Message for Keyframes {
    const KIND: u8 = 15;
    const MAX_BYTES: usize = 4 << 20;
    fn validate(&self) -> Result<(), WireError> {
        require(self.cells.len() <= GRANTS_MAX, "cells", "at most 128")?;
        let ascend = |cell: &CellKeyframes| cell.keyframes.is_sorted_by(|a, b| a.tick < b.tick);
        require(self.cells.iter().all(ascend), "keyframes", "ascending")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{decode, encode};

    #[test]
    fn messages_round_trip() {
        let cell = CellId { x: -3, z: 7 };
        let departures = vec![Departure { to: CellId::EVERYWHERE, bodies: vec![1, 5] }];
        let snapshot = CellSnapshot { cell, tick: 9, keyframe_age: 3, departures, dof: vec![1, 2] };
        assert_eq!(decode(&encode(&snapshot)), Ok(snapshot));
        let wanted = |x| KeyframesWanted { cell: CellId { x, z: i16::MIN }, have: u64::MAX };
        let request = KeyframesRequest { cells: (i16::MIN..).map(wanted).take(GRANTS_MAX).collect() };
        assert_eq!(decode(&encode(&request)), Ok(request));
    }

    #[test]
    fn who_has_a_keyframe_gets_those_behind_it_and_an_answer_is_no_longer_than_a_message() {
        let keyframe = |tick| Keyframe { tick, dof: vec![9; 300] };
        let epoch: Vec<_> = (1..=5).map(keyframe).collect();
        let mut answer = Keyframes::default();
        for have in [0, 3, 5, 77] {
            answer.push(KeyframesWanted { cell: CellId::default(), have }, &epoch);
        }
        let ticks: Vec<usize> = answer.cells.iter().map(|cell| cell.keyframes.len()).collect();
        assert_eq!(ticks, [5, 2, 0, 5]);
        let large = [Keyframe { tick: 1, dof: vec![1; 900_000] }];
        for _ in 0..10 {
            answer.push(KeyframesWanted::default(), &large);
        }
        assert_eq!(answer.cells.len(), 6);
        assert_eq!(decode(&encode(&answer)), Ok(answer));
    }

    #[test]
    fn content_is_checked() {
        let grant = |x, layers| CellGrant { cell: CellId { x, z: 0 }, layers };
        assert_eq!(check_grants(&[grant(-1, 1), grant(0, 6)]), Ok(()));
        for bad in [vec![grant(0, 0)], vec![grant(0, 7)], vec![grant(1, 1), grant(0, 1)], vec![grant(0, 1); 2]] {
            assert!(check_grants(&bad).is_err(), "{bad:?}");
        }
        let keyframe = |tick| Keyframe { tick, dof: Vec::new() };
        let of_cell = CellKeyframes { cell: CellId::default(), keyframes: vec![keyframe(2), keyframe(2)] };
        let unordered = Keyframes { cells: vec![of_cell] };
        assert!(decode::<Keyframes>(&encode(&unordered)).is_err());
        let twice = KeyframesRequest { cells: vec![KeyframesWanted::default(); 2] };
        assert!(decode::<KeyframesRequest>(&encode(&twice)).is_err());
    }
}
