//! What a term adds to the blocks of the Newton matrix.

use glam::{DMat3, DVec3};

use crate::integrate::block::Block;

/// A Hessian with respect to the displacements of two frames, translation first, rotation second.
pub(crate) trait BetweenFrames {
    /// Second derivative by the displacement of one frame, 0 is a, 1 is b: all of it with R = 6, that of places with 3.
    fn own<const R: usize>(&self, end: usize) -> Block<R>;

    /// Second derivative by the displacements of a, rows, and b, columns; R as in [`BetweenFrames::own`].
    fn between<const R: usize>(&self) -> Block<R>;
}

/// Hessian of a term with respect to the displacements of its two frames, as what its blocks are made of: a stiffness
/// between two points, and stiffnesses against turns. The blocks, translation first, rotation second, are made where they
/// are added: against the world only one of the three is wanted.
#[derive(Clone, Debug)]
pub(crate) struct PairBlocks {
    /// N/m.
    points: DMat3,
    /// From the frames' origins to the points, m.
    arms: [DVec3; 2],
    /// Against turns of either by itself, N m.
    turns: [DMat3; 2],
    /// Between the turns of both, N m.
    turns_between: DMat3,
}

impl PairBlocks {
    /// Hessian of ½ dᵀ K d, K symmetric, d the displacement of the point at `arm_b` of b against the one at `arm_a` of a.
    pub fn of_points(k: DMat3, arm_a: DVec3, arm_b: DVec3) -> Self {
        Self { points: k, arms: [arm_a, arm_b], turns: [DMat3::ZERO; 2], turns_between: DMat3::ZERO }
    }

    /// Adds the Hessian of ½ tᵀ K t, t the turn of b against a.
    pub fn add_rotation(&mut self, k: DMat3) {
        self.add_rotation_a(k);
        self.add_rotation_b(k);
        self.turns_between -= k;
    }

    /// Adds to the rotation block of a alone.
    pub fn add_rotation_a(&mut self, k: DMat3) {
        self.turns[0] += k;
    }

    /// Adds to the rotation block of b alone.
    pub fn add_rotation_b(&mut self, k: DMat3) {
        self.turns[1] += k;
    }
}

impl BetweenFrames for PairBlocks {
    #[inline(always)]
    fn own<const R: usize>(&self, end: usize) -> Block<R> {
        if R <= 3 {
            return quarter(&self.points, 1.0);
        }
        // J = [I, −[r]×]: Jᵀ K J = [K, −K [r]×; [r]× K, −[r]× K [r]×].
        let k = turned(&self.points, self.arms[end]);
        block(self.points, -k, -k.transpose(), self.turns[end] - crossed(self.arms[end], &k))
    }

    #[inline(always)]
    fn between<const R: usize>(&self) -> Block<R> {
        if R <= 3 {
            return quarter(&self.points, -1.0);
        }
        let (ka, kb) = (turned(&self.points, self.arms[0]), turned(&self.points, self.arms[1]));
        block(-self.points, kb, ka.transpose(), self.turns_between + crossed(self.arms[0], &kb))
    }
}

/// K [r]×, whose columns are the images of r × the axes, negated.
#[inline]
fn turned(k: &DMat3, r: DVec3) -> DMat3 {
    let [x, y, z] = [k.x_axis, k.y_axis, k.z_axis];
    DMat3::from_cols(y * r.z - z * r.y, z * r.x - x * r.z, x * r.y - y * r.x)
}

/// [r]× M.
#[inline]
fn crossed(r: DVec3, m: &DMat3) -> DMat3 {
    DMat3::from_cols(r.cross(m.x_axis), r.cross(m.y_axis), r.cross(m.z_axis))
}

/// `factor` × the symmetric `k` as the leading part of a block.
#[inline]
fn quarter<const R: usize>(k: &DMat3, factor: f64) -> Block<R> {
    let columns = k.to_cols_array_2d();
    std::array::from_fn(|i| std::array::from_fn(|j| if i < 3 && j < 3 { factor * columns[i][j] } else { 0.0 }))
}

/// A block out of its quarters: translation by translation, translation by rotation, and so on.
// Number by number: a matrix that is copied as a whole right after it was made waits for its numbers to arrive in memory.
#[inline(always)]
fn block<const R: usize>(ll: DMat3, la: DMat3, al: DMat3, aa: DMat3) -> Block<R> {
    let mut block = [[0.0; R]; R];
    for (quarter, row, column) in [(ll, 0, 0), (la, 0, 3), (al, 3, 0), (aa, 3, 3)] {
        for (j, axis) in [quarter.x_axis, quarter.y_axis, quarter.z_axis].into_iter().enumerate() {
            for (i, number) in [axis.x, axis.y, axis.z].into_iter().enumerate() {
                block[row + i][column + j] = number;
            }
        }
    }
    block
}

/// Sum of [`PairBlocks::of_points`] of several points between the same two frames, as the points of a manifold are:
/// summed up on the first frame, and only then taken to the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointSum {
    /// From the first frame's origin to the second's, negated, m: the same for all points, unless one of the frames is
    /// no body that turns.
    offset: DVec3,
    /// Second derivatives by the displacement of the first frame: translations, ...
    ll: DMat3,
    /// ... translations by turns, ...
    la: DMat3,
    /// ... and turns.
    aa: DMat3,
}

/// Offsets that differ by less than this are the same, m.
const SAME: f64 = 1e-9;

impl PointSum {
    /// Of no point, for frames of one origin.
    pub const ZERO: Self = Self { offset: DVec3::ZERO, ll: DMat3::ZERO, la: DMat3::ZERO, aa: DMat3::ZERO };

    /// Of one point: as [`PairBlocks::of_points`].
    #[inline(always)]
    pub fn at(stiffness: DMat3, arms: [DVec3; 2]) -> Self {
        let k = turned(&stiffness, arms[0]);
        Self { offset: arms[1] - arms[0], ll: stiffness, la: -k, aa: -crossed(arms[0], &k) }
    }

    /// Of what is [`PairBlocks::of_points`] alone.
    #[inline(always)]
    pub fn of(PairBlocks { points, arms, .. }: &PairBlocks) -> Self {
        Self::at(*points, *arms)
    }

    /// Adds another, if it is between the same origins. Answers whether it was.
    #[inline(always)]
    pub fn join(&mut self, other: &Self) -> bool {
        let joins = (self.offset - other.offset).length_squared() < SAME * SAME;
        if joins {
            self.ll += other.ll;
            self.la += other.la;
            self.aa += other.aa;
        }
        joins
    }
}

impl BetweenFrames for PointSum {
    fn own<const R: usize>(&self, end: usize) -> Block<R> {
        let Self { offset, ll, la, aa } = self;
        if R <= 3 {
            return quarter(ll, 1.0);
        }
        if end == 0 {
            return block(*ll, *la, la.transpose(), *aa);
        }
        let (shift, moved) = (turned(ll, *offset), crossed(*offset, la));
        let la = *la - shift;
        block(*ll, la, la.transpose(), *aa + moved + moved.transpose() - crossed(*offset, &shift))
    }

    fn between<const R: usize>(&self) -> Block<R> {
        let Self { offset, ll, la, aa } = self;
        if R <= 3 {
            return quarter(ll, -1.0);
        }
        let al = la.transpose();
        block(-*ll, turned(ll, *offset) - *la, -al, turned(&al, *offset) - *aa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points that are summed up on one frame do to both what they do one by one.
    #[test]
    fn a_sum_of_points_is_the_sum_of_their_blocks() {
        let offset = DVec3::new(0.3, -1.2, 0.7);
        let point = |i: i32| {
            let x = f64::from(i);
            let n = DVec3::new(x.sin(), x.cos(), 0.3 * x).normalize();
            let arm = DVec3::new(0.5 - x, 0.2 * x, (2.0 * x).cos());
            let k = super::super::outer(n, n) * (5.0 + x) + DMat3::from_diagonal(DVec3::new(1.0, 2.0 + x, 3.0));
            PairBlocks::of_points(k, arm, arm + offset)
        };
        let mut sum = PointSum::of(&point(0));
        assert!((1..4).all(|i| sum.join(&PointSum::of(&point(i)))));
        let one_by_one = |blocks: fn(&PairBlocks) -> Block<6>| {
            let each = (0..4).map(|i| blocks(&point(i)));
            each.fold([[0.0; 6]; 6], |sum, block| {
                std::array::from_fn(|i| std::array::from_fn(|j| sum[i][j] + block[i][j]))
            })
        };
        let pairs = [
            (sum.own::<6>(0), one_by_one(|blocks| blocks.own::<6>(0))),
            (sum.own::<6>(1), one_by_one(|blocks| blocks.own::<6>(1))),
            (sum.between::<6>(), one_by_one(PairBlocks::between::<6>)),
        ];
        for (of_sum, wanted) in pairs {
            for (a, b) in of_sum.as_flattened().iter().zip(wanted.as_flattened()) {
                assert!((a - b).abs() < 1e-12, "{of_sum:?} {wanted:?}");
            }
        }
        let elsewhere = PairBlocks::of_points(DMat3::IDENTITY, DVec3::ZERO, offset + DVec3::X * 1e-6);
        assert!(!sum.join(&PointSum::of(&elsewhere)));
    }
}
