//! Coarse pruning: which pairs may touch during the tick.
//!
//! Sweep and prune along x over boxes that contain each body's motion. A later change puts the talk's k-DOP trees behind
//! the same interface: bounds in, pairs out, in a stable order.

use glam::DVec3;

/// World-axis box around a body and its motion during the tick, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub min: DVec3,
    pub max: DVec3,
}

impl Bounds {
    /// Overlaps nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    fn overlaps_across_x(&self, other: &Self) -> bool {
        self.min.y <= other.max.y && other.min.y <= self.max.y && self.min.z <= other.max.z && other.min.z <= self.max.z
    }

    /// Whether the two share a point.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.x <= other.max.x && other.min.x <= self.max.x && self.overlaps_across_x(other)
    }
}

/// Finds overlapping bounds.
#[derive(Clone, Debug, Default)]
pub(crate) struct BroadPhase {
    /// Indices in order of `min.x`; nearly right from tick to tick.
    order: Vec<u32>,
}

impl BroadPhase {
    /// Writes all pairs of overlapping bounds into `pairs`, the smaller index first, sorted. Empty bounds (min above max)
    /// overlap nothing.
    pub fn pairs(&mut self, bounds: &[Bounds], pairs: &mut Vec<(u32, u32)>) {
        pairs.clear();
        if self.order.len() != bounds.len() {
            self.order.clear();
            self.order.extend(0..bounds.len() as u32);
            self.order.sort_by(|&a, &b| bounds[a as usize].min.x.total_cmp(&bounds[b as usize].min.x));
        }
        let start = |i: u32| bounds[i as usize].min.x;
        insertion_sort(&mut self.order, |&a, &b| start(a) > start(b));
        for (place, &i) in self.order.iter().enumerate() {
            let this = &bounds[i as usize];
            for &j in &self.order[place + 1..] {
                if start(j) > this.max.x {
                    break;
                }
                if this.overlaps_across_x(&bounds[j as usize]) {
                    pairs.push((i.min(j), i.max(j)));
                }
            }
        }
        pairs.sort_unstable();
    }
}

/// Linear on what is nearly sorted already, and stable.
fn insertion_sort<T: Copy>(items: &mut [T], after: impl Fn(&T, &T) -> bool) {
    for i in 1..items.len() {
        let item = items[i];
        let mut j = i;
        while j > 0 && after(&items[j - 1], &item) {
            items[j] = items[j - 1];
            j -= 1;
        }
        items[j] = item;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bounds() -> impl Strategy<Value = Bounds> {
        let vector = |range: std::ops::Range<f64>| prop::array::uniform3(range).prop_map(DVec3::from_array);
        (vector(-10.0..10.0), vector(0.0..4.0)).prop_map(|(min, size)| Bounds { min, max: min + size })
    }

    proptest! {
        #[test]
        fn finds_what_the_quadratic_loop_finds(ticks in prop::collection::vec(prop::collection::vec(bounds(), 0..40), 1..4)) {
            let mut broad_phase = BroadPhase::default();
            let mut pairs = Vec::new();
            for bounds in ticks {
                broad_phase.pairs(&bounds, &mut pairs);
                let all = (0..bounds.len()).flat_map(|i| (i + 1..bounds.len()).map(move |j| (i, j)));
                let expected: Vec<_> = all
                    .filter(|&(i, j)| bounds[i].overlaps(&bounds[j]))
                    .map(|(i, j)| (i as u32, j as u32))
                    .collect();
                prop_assert_eq!(&pairs, &expected);
            }
        }
    }
}
