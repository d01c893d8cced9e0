//! k-DOPs: bounds by slabs along k/2 fixed directions (talk, "k-DOPs": tighter than boxes, cheaper than oriented boxes,
//! and as good for what deforms).
//!
//! Owns the bound and its arithmetic; knows neither shapes nor trees.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;

/// Fixed directions of k-DOPs of `H` slabs, as unit vectors; the first three are x, y and z.
pub trait Directions<const H: usize> {
    /// The directions.
    const AXES: [DVec3; H];

    /// Their x, y and z, each by itself: so laid out, products with all of them vectorise.
    const COLUMNS: [[f64; H]; 3] = columns(&Self::AXES);
}

/// The sets of directions that there are: 3 slabs (a box), 7 (and the corners of a cube), 9 (and its edges), 13 (both).
pub struct Slabs;

/// 1/√3.
const CORNER: f64 = 0.577_350_269_189_625_8;
const EDGE: f64 = FRAC_1_SQRT_2;

const CORNERS: [DVec3; 4] = [
    DVec3::new(CORNER, CORNER, CORNER),
    DVec3::new(CORNER, CORNER, -CORNER),
    DVec3::new(CORNER, -CORNER, CORNER),
    DVec3::new(CORNER, -CORNER, -CORNER),
];

const EDGES: [DVec3; 6] = [
    DVec3::new(EDGE, EDGE, 0.0),
    DVec3::new(EDGE, -EDGE, 0.0),
    DVec3::new(EDGE, 0.0, EDGE),
    DVec3::new(EDGE, 0.0, -EDGE),
    DVec3::new(0.0, EDGE, EDGE),
    DVec3::new(0.0, EDGE, -EDGE),
];

impl Directions<3> for Slabs {
    const AXES: [DVec3; 3] = DVec3::AXES;
}

impl Directions<7> for Slabs {
    const AXES: [DVec3; 7] = joined(&[&DVec3::AXES, &CORNERS]);
}

impl Directions<9> for Slabs {
    const AXES: [DVec3; 9] = joined(&[&DVec3::AXES, &EDGES]);
}

impl Directions<13> for Slabs {
    const AXES: [DVec3; 13] = joined(&[&DVec3::AXES, &CORNERS, &EDGES]);
}

const fn columns<const H: usize>(axes: &[DVec3; H]) -> [[f64; H]; 3] {
    let mut columns = [[0.0; H]; 3];
    let mut i = 0;
    while i < H {
        (columns[0][i], columns[1][i], columns[2][i]) = (axes[i].x, axes[i].y, axes[i].z);
        i += 1;
    }
    columns
}

/// All of `sets`, one after the other.
const fn joined<const H: usize>(sets: &[&[DVec3]]) -> [DVec3; H] {
    let mut all = [DVec3::ZERO; H];
    let (mut n, mut set) = (0, 0);
    while set < sets.len() {
        let mut i = 0;
        while i < sets[set].len() {
            all[n] = sets[set][i];
            (n, i) = (n + 1, i + 1);
        }
        set += 1;
    }
    assert!(n == H);
    all
}

/// The lesser of two numbers, by a comparison: `f64::min` would have to look for NaN, and does not vectorise.
#[inline]
pub(super) fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers; see [`lesser`].
#[inline]
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A k-DOP of `H` = k/2 slabs: the points x with min\[i\] ≤ axis\[i\] · x ≤ max\[i\], m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kdop<const H: usize> {
    /// Lower ends of the slabs.
    pub min: [f64; H],
    /// Upper ends of the slabs.
    pub max: [f64; H],
}

impl<const H: usize> Kdop<H> {
    /// Contains and overlaps nothing.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; H], max: [f64::NEG_INFINITY; H] };

    /// What contains both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|i| lesser(self.min[i], other.min[i])),
            max: std::array::from_fn(|i| greater(self.max[i], other.max[i])),
        }
    }

    /// Whether no slab tells the two apart.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        let apart = |i: usize| (self.min[i] > other.max[i]) | (other.min[i] > self.max[i]);
        !(0..H).fold(false, |any, i| any | apart(i))
    }

    /// Whether every slab of `other` lies within this one's.
    #[inline]
    pub fn contains(&self, other: &Self) -> bool {
        (0..H).fold(true, |all, i| all & (self.min[i] <= other.min[i]) & (other.max[i] <= self.max[i]))
    }

    /// Every slab wider by `radius` on either side: contains what a ball of that radius sweeps over it.
    #[inline]
    pub fn grown(&self, radius: f64) -> Self {
        Self { min: self.min.map(|x| x - radius), max: self.max.map(|x| x + radius) }
    }

    /// What stands for its surface in the cost of a tree: the sum over pairs of widths, m². Of a box it is half the
    /// surface. Zero for an empty one.
    #[inline]
    pub fn cost(&self) -> f64 {
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..H {
            let width = self.max[i] - self.min[i];
            sum += width;
            squares += width * width;
        }
        if sum > 0.0 { 0.5 * (sum * sum - squares) } else { 0.0 }
    }

    /// Twice the middle of a slab.
    #[inline]
    pub fn doubled_centre(&self, slab: usize) -> f64 {
        self.min[slab] + self.max[slab]
    }
}

impl<const H: usize> Kdop<H>
where
    Slabs: Directions<H>,
{
    /// Where it is for all: a copy for every use costs more than what is done with it.
    const AXES: &'static [DVec3; H] = &Slabs::AXES;
    const COLUMNS: &'static [[f64; H]; 3] = &Slabs::COLUMNS;

    /// Coordinates of a vector along the axes.
    #[inline]
    pub fn along(v: DVec3) -> [f64; H] {
        let [x, y, z] = Self::COLUMNS;
        let mut along = [0.0; H];
        for i in 0..H {
            along[i] = x[i] * v.x + y[i] * v.y + z[i] * v.z;
        }
        along
    }

    /// The bound of points, deforming or not.
    pub fn of_points(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut bound = Self::EMPTY;
        for point in points {
            for (i, axis) in Self::AXES.iter().enumerate() {
                let x = axis.dot(point);
                bound.min[i] = lesser(x, bound.min[i]);
                bound.max[i] = greater(x, bound.max[i]);
            }
        }
        bound
    }

    /// What it sweeps over on a way of `displacement`, m.
    #[inline]
    pub fn swept(&self, displacement: DVec3) -> Self {
        let (mut swept, way) = (*self, Self::along(displacement));
        for (i, way) in way.into_iter().enumerate() {
            swept.min[i] += lesser(way, 0.0);
            swept.max[i] += greater(way, 0.0);
        }
        swept
    }

    /// A distance from `point` that nothing in it is nearer than, m.
    pub fn distance(&self, point: DVec3) -> f64 {
        let beyond = |i: usize| {
            let x = Self::AXES[i].dot(point);
            (self.min[i] - x).max(x - self.max[i]).max(0.0)
        };
        let of_box = DVec3::new(beyond(0), beyond(1), beyond(2)).length();
        (3..H).map(beyond).fold(of_box, f64::max)
    }

    /// Whether a ray comes into it, or as good as touches it, before it is `limit` long.
    #[inline]
    pub fn is_hit(&self, ray: &SlabRay<H>, limit: f64) -> bool {
        let (mut from, mut to) = (0.0, limit);
        for i in 0..H {
            let a = (self.min[i] - TOUCH - ray.origin[i]) * ray.inverse[i];
            let b = (self.max[i] + TOUCH - ray.origin[i]) * ray.inverse[i];
            from = a.min(b).max(from);
            to = a.max(b).min(to);
        }
        from <= to
    }
}

/// How near a ray passes what it touches, m: a slab without width is met at one place, which rounding makes two.
const TOUCH: f64 = 1e-9;

/// A ray, as the slabs see it.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay<const H: usize> {
    origin: [f64; H],
    /// One over the direction along each axis.
    inverse: [f64; H],
}

impl<const H: usize> SlabRay<H>
where
    Slabs: Directions<H>,
{
    /// A ray from `origin` along the unit vector `direction`.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        // A ray along a slab is in it or not, whatever its length; finite, so that it times zero is zero.
        let inverse = |axis: DVec3| {
            let along = axis.dot(direction);
            if along.abs() < 1e-300 { 1e300 } else { along.recip() }
        };
        Self { origin: Slabs::AXES.map(|axis| axis.dot(origin)), inverse: Slabs::AXES.map(inverse) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(range: f64) -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-range..range).prop_map(DVec3::from_array)
    }

    fn check<const H: usize>(points: &[DVec3], others: &[DVec3], way: DVec3)
    where
        Slabs: Directions<H>,
    {
        let (a, b) = (Kdop::<H>::of_points(points.iter().copied()), Kdop::<H>::of_points(others.iter().copied()));
        let union = a.union(&b);
        assert!(union.contains(&a) && union.contains(&b));
        assert!(a.overlaps(&union) && a.cost() <= union.cost());
        let swept = a.swept(way).grown(1e-9);
        assert!(points.iter().all(|&p| swept.contains(&Kdop::of_points([p + way * 0.7]))));
        for &point in others {
            let nearest = points.iter().map(|p| p.distance(point)).fold(f64::INFINITY, f64::min);
            assert!(a.distance(point) <= nearest + 1e-9);
            // A ray at one of its points hits it.
            let to = points[0] - point;
            let ray = SlabRay::new(point, to.normalize_or(DVec3::X));
            assert!(a.grown(1e-9).is_hit(&ray, to.length() + 1e-9), "{point} {to}");
        }
        assert!(!Kdop::<H>::EMPTY.overlaps(&a) && Kdop::<H>::EMPTY.cost() == 0.0);
    }

    proptest! {
        #[test]
        fn bounds_bound(
            points in prop::collection::vec(vector(3.0), 1..10),
            others in prop::collection::vec(vector(9.0), 1..10),
            way in vector(2.0),
        ) {
            check::<3>(&points, &others, way);
            check::<7>(&points, &others, way);
            check::<9>(&points, &others, way);
            check::<13>(&points, &others, way);
        }
    }

    #[test]
    fn rays_along_a_face_hit_and_beside_it_miss() {
        let cube = Kdop::<3>::of_points([DVec3::ZERO, DVec3::ONE]);
        let hits = |origin| cube.is_hit(&SlabRay::new(origin, DVec3::X), 10.0);
        assert!(hits(DVec3::new(-1.0, 0.0, 0.5)) && hits(DVec3::new(-1.0, 1.0, 1.0)));
        assert!(!hits(DVec3::new(-1.0, 1.0 + 1e-8, 0.5)) && !hits(DVec3::X * 2.0));
        assert!(!cube.is_hit(&SlabRay::new(DVec3::X * -1.0, DVec3::X), 0.9));
    }

    #[test]
    fn directions_are_unit_vectors_and_differ() {
        let axes = <Slabs as Directions<13>>::AXES;
        for (i, a) in axes.iter().enumerate() {
            assert!((a.length() - 1.0).abs() < 1e-12);
            assert!(axes[..i].iter().all(|b| a.dot(*b).abs() < 0.9));
        }
    }
}
