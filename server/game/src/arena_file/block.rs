//! Blocks of equal things, along the axes of the world.

use glam::DVec3;

use super::{ArenaError, Key};

/// Most copies along an axis.
const COPIES_MAX: usize = 4_096;

/// Where equal things are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Place of the first, m.
    pub first: [f64; 3],
    /// How many along x, y and z; 0 along any is none at all.
    pub copies: [usize; 3],
    /// Distance of neighbours along x, y and z, m.
    pub spacing: [f64; 3],
}

impl Block {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for a number out of range, below `key`.
    pub fn check(&self, key: &Key) -> Result<(), ArenaError> {
        (0..3).try_for_each(|axis| {
            key.at("copies").index(axis).count(self.copies[axis], 0, COPIES_MAX, "copies")?;
            key.at("spacing").index(axis).number(self.spacing[axis], -1_000.0, 1_000.0, "m")
        })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.copies.iter().product()
    }

    /// Place of the last, m.
    pub fn last(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.first[axis] + self.copies[axis].saturating_sub(1) as f64 * self.spacing[axis])
    }

    /// Place of each, m, lowest layer first.
    pub fn places(self) -> impl Iterator<Item = DVec3> {
        let [nx, ny, nz] = self.copies;
        let cells = (0..ny).flat_map(move |iy| (0..nx).flat_map(move |ix| (0..nz).map(move |iz| [ix, iy, iz])));
        cells.map(move |cell| DVec3::from(self.first) + DVec3::from(cell.map(|i| i as f64)) * DVec3::from(self.spacing))
    }
}
