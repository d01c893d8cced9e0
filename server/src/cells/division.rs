//! Which cell owns what: the ground in squares.
//!
//! Pure. A family belongs to the cell that its first body is in; it goes over to another one only when it is well inside,
//! so that who drives along an edge does not change sides all the time.

use pita_protocol::message::CellId;

use crate::crowd::Family;

/// How far out of its cell a family may be before it goes over, of the side.
const MARGIN: f32 = 0.125;

/// The cells of all families.
#[derive(Debug)]
pub struct Division {
    side_m: f32,
    /// In order of root.
    of: Vec<(u32, CellId)>,
    /// Kept for its memory.
    before: Vec<(u32, CellId)>,
}

impl Division {
    /// Squares with sides of `side_m`.
    pub fn new(side_m: f32) -> Self {
        Self { side_m, of: Vec::new(), before: Vec::new() }
    }

    /// Finds the cells of `families`, which are in order of root; `moved` is told which of them, by index, left which cell.
    pub fn follow(&mut self, families: &[Family], mut moved: impl FnMut(usize, CellId)) {
        std::mem::swap(&mut self.of, &mut self.before);
        self.of.clear();
        let mut before = self.before.iter().peekable();
        for (index, family) in families.iter().enumerate() {
            while before.next_if(|(root, _)| *root < family.root).is_some() {}
            let last = before.next_if(|(root, _)| *root == family.root).map(|(_, cell)| *cell);
            let cell = self.cell(family.position, last);
            self.of.push((family.root, cell));
            if let Some(last) = last.filter(|last| *last != cell) {
                moved(index, last);
            }
        }
    }

    /// The cell of the family with this index.
    pub fn cell_of(&self, family: usize) -> CellId {
        self.of[family].1
    }

    /// How far `position` is from a cell on the ground, m; 0 inside, and where there is no position.
    pub fn distance(&self, position: Option<[f32; 3]>, cell: CellId) -> f32 {
        match position {
            Some([x, _, z]) if cell != CellId::EVERYWHERE => self.outside(x, cell.x).hypot(self.outside(z, cell.z)),
            _ => 0.0,
        }
    }

    /// Length of a side, m.
    pub fn side_m(&self) -> f32 {
        self.side_m
    }

    fn cell(&self, position: Option<[f32; 3]>, last: Option<CellId>) -> CellId {
        let Some([x, _, z]) = position else { return CellId::EVERYWHERE };
        let is_near = |cell: &CellId| self.distance(position, *cell) <= MARGIN * self.side_m;
        // The lowest number is of those that have no place.
        let along = |x: f32| (x / self.side_m).floor().clamp(-32767.0, 32767.0) as i16;
        last.filter(|last| *last != CellId::EVERYWHERE && is_near(last)).unwrap_or(CellId { x: along(x), z: along(z) })
    }

    /// How far a coordinate is outside a cell.
    fn outside(&self, x: f32, cell: i16) -> f32 {
        let low = f32::from(cell) * self.side_m;
        (low - x).max(x - low - self.side_m).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(root: u32, position: Option<[f32; 3]>) -> Family {
        Family { root, position, speed: 0.0, importance: 1.0, slot: None }
    }

    #[test]
    fn who_crosses_goes_over_once_and_well_inside() {
        let mut division = Division::new(64.0);
        let mut crossings = Vec::new();
        // Along an edge in waves of 7 m, and then away.
        for step in 0..200 {
            let x = if step < 100 { 7.0 * (step as f32).sin() } else { (step - 100) as f32 };
            let families = [family(3, Some([x - 1.0, 9.0, -1.0])), family(7, None)];
            division.follow(&families, |index, from| crossings.push((step, index, from)));
        }
        let of: Vec<_> = crossings.iter().map(|(step, index, from)| (*step >= 100, *index, from.x)).collect();
        assert_eq!(of, [(true, 0, -1), (true, 0, 0)], "{crossings:?}");
        assert_eq!(division.cell_of(0), CellId { x: 1, z: -1 });
        assert_eq!(division.cell_of(1), CellId::EVERYWHERE);
    }

    #[test]
    fn distances_are_to_the_edge_and_far_off_is_in_the_last_cell() {
        let mut division = Division::new(10.0);
        assert_eq!(division.distance(Some([-3.0, 5.0, 14.0]), CellId { x: 0, z: 0 }), 5.0);
        assert_eq!(division.distance(Some([-3.0, 5.0, 14.0]), CellId::EVERYWHERE), 0.0);
        division.follow(&[family(1, Some([-1e9, 0.0, f32::INFINITY]))], |_, _| ());
        assert_eq!(division.cell_of(0), CellId { x: -32767, z: 32767 });
    }
}
