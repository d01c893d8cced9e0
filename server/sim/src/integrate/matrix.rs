//! The matrix of a Newton iteration: symmetric, sparse, of D×D blocks.
//!
//! Owns pattern, storage, assembly from an island's problem and the product with a vector; it knows nothing of
//! factorisations. Stored are the diagonal and the lower triangle, row by row, columns ascending.

use super::block::{Block, Entry, multiply_add, transpose, transposed_multiply_add, zero};
use super::figures::{Blocks, Figures};
use super::problem::{Problem, Unknown, Visitor, pair};
use super::pull_back::{multiplied, projected};
use super::solver::work::block;
use glam::DMat3;

use crate::dof::{Columns, Frame};
use crate::potential::{BetweenFrames, FIXED, FrameIndex, PointSum, Term};

/// Marks a term without an off-diagonal block.
const NONE: u32 = u32::MAX;

/// A symmetric block-sparse matrix.
#[derive(Default)]
pub(super) struct Matrix<const D: usize> {
    /// `columns[rows[i]..rows[i + 1]]` are the columns of row i, all below i.
    pub rows: Vec<u32>,
    pub columns: Vec<u32>,
    pub diagonal: Vec<Block<D>>,
    /// Blocks below the diagonal, as `columns` has them.
    pub lower: Vec<Block<D>>,
    /// Off-diagonal block of each term, in the order of visits.
    slots: Vec<u32>,
    /// Off-diagonal block of each pair of points, in the order of [`Figures::point_pairs`].
    point_slots: Vec<u32>,
    pairs: Vec<(u32, u32)>,
}

impl<const D: usize> Matrix<D> {
    /// Finds the sparsity pattern of `problem`.
    pub fn analyse(&mut self, problem: &mut Problem) {
        let n = problem.len();
        self.pairs.clear();
        let Problem { terms, figures, .. } = problem;
        terms.visit(&mut Pairs { blocks: n, figures, pairs: &mut self.pairs });
        figures.couplings(&mut |a, b| self.pairs.push((a.max(b), a.min(b))));
        self.pairs.sort_unstable();
        self.pairs.dedup();
        self.rows.clear();
        self.rows.resize(n + 1, 0);
        self.columns.clear();
        for &(row, column) in &self.pairs {
            self.rows[row as usize + 1] += 1;
            self.columns.push(column);
        }
        for i in 0..n {
            self.rows[i + 1] += self.rows[i];
        }
        self.slots.clear();
        terms.visit(&mut Slots { blocks: n, rows: &self.rows, columns: &self.columns, slots: &mut self.slots });
        self.point_slots.clear();
        let Self { rows, columns, point_slots, .. } = self;
        figures.point_pairs(&mut |a, b| {
            point_slots.push(slot(rows, columns, (a.max(b), a.min(b))).unwrap_or(NONE));
        });
        self.diagonal.resize(n, zero());
        self.lower.resize(self.columns.len(), zero());
    }

    /// Sums up M + dt² ∂²Φ at the problem's candidate.
    pub fn assemble(&mut self, problem: &mut Problem) {
        for (block, unknown) in self.diagonal.iter_mut().zip(&problem.unknowns) {
            *block = inertia_block(unknown);
        }
        self.lower.fill(zero());
        let Problem { dt, terms, figures, frames, .. } = problem;
        figures.begin_hessian();
        let mut slots = std::mem::take(&mut self.slots);
        terms.visit(&mut Assemble { dt: *dt, frames, figures, matrix: self, slots: slots.iter() });
        std::mem::swap(&mut self.slots, &mut slots);
        let point_slots = std::mem::take(&mut self.point_slots);
        figures.assemble(*dt, frames, &mut OfFigures { matrix: self, point_slots: point_slots.iter() });
        self.point_slots = point_slots;
    }

    /// Adds the leading part of `factor` × `block` at (row, column), or its transpose where that is the stored half.
    fn add<const R: usize>(&mut self, row: u32, column: u32, block: &Block<R>, factor: f64) {
        if row == column {
            return add_scaled(&mut self.diagonal[row as usize], block, factor);
        }
        let (i, j) = (row.max(column), row.min(column));
        if let Some(slot) = slot(&self.rows, &self.columns, (i, j)) {
            let below = if row < column { &transpose(block) } else { block };
            add_scaled(&mut self.lower[slot as usize], below, factor);
        }
    }

    /// y = A x.
    pub fn multiply(&self, x: &[Entry<D>], y: &mut [Entry<D>]) {
        for i in 0..y.len() {
            y[i] = [0.0; D];
            multiply_add(&self.diagonal[i], &x[i], &mut y[i]);
            for k in self.row(i) {
                let j = self.columns[k] as usize;
                multiply_add(&self.lower[k], &x[j], &mut y[i]);
                transposed_multiply_add(&self.lower[k], &x[i], &mut y[j]);
            }
        }
    }

    /// Multiply-adds of a product with a vector.
    pub fn multiply_work(&self) -> u64 {
        (self.diagonal.len() + 2 * self.lower.len()) as u64 * block(D)
    }

    /// Places of row i in `columns` and `lower`.
    pub fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.rows[i] as usize..self.rows[i + 1] as usize
    }
}

/// What a block of unknowns weighs by itself. A figure adds its inertia later; rates that a block does not have are held
/// at zero by a unit mass.
pub(super) fn inertia_block<const D: usize>(unknown: &Unknown) -> Block<D> {
    let mut block = zero();
    for (i, row) in block.iter_mut().enumerate() {
        match unknown {
            Unknown::Body(node) if i < 3 => row[i] = node.mass,
            // The inertia is symmetric: its columns are its rows.
            Unknown::Body(node) => row[3..].copy_from_slice(&node.inertia.col(i - 3).to_array()),
            Unknown::Rates(rates) => row[i] = if i < usize::from(rates.size) { 0.0 } else { 1.0 },
        }
    }
    block
}

/// Place in `columns` of the block at (row, column), row > column.
fn slot(rows: &[u32], columns: &[u32], (row, column): (u32, u32)) -> Option<u32> {
    let (start, end) = (rows[row as usize], rows[row as usize + 1]);
    let found = columns[start as usize..end as usize].binary_search(&column);
    found.ok().map(|k| start + k as u32)
}

/// Row and column of the lower-triangle block between two frames that are blocks of unknowns themselves.
fn place([a, b]: [FrameIndex; 2], blocks: usize) -> Option<(u32, u32)> {
    let direct = (a as usize) < blocks && (b as usize) < blocks;
    direct.then(|| (a.max(b), a.min(b)))
}

/// A frame that is a block of unknowns moves with it.
const IDENTITY: Columns = {
    let mut columns = [[0.0; 6]; 6];
    let mut i = 0;
    while i < 6 {
        columns[i][i] = 1.0;
        i += 1;
    }
    columns
};

/// Hands `each` every block that moves a frame, with the number of its rates and the frame's derivatives.
fn movers(figures: &Figures, blocks: usize, frame: FrameIndex, mut each: impl FnMut(u32, u8, &Columns)) {
    if (frame as usize) < blocks {
        each(frame, 6, &IDENTITY);
    } else if frame != FIXED {
        figures.influences(frame as usize - blocks).iter().for_each(|i| each(i.block, i.size, &i.columns));
    }
}

struct Pairs<'a> {
    blocks: usize,
    figures: &'a Figures,
    pairs: &'a mut Vec<(u32, u32)>,
}

impl Visitor for Pairs<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let frames = term.frames();
            if let Some(pair) = place(frames, self.blocks) {
                self.pairs.push(pair);
                continue;
            }
            movers(self.figures, self.blocks, frames[0], |i, _, _| {
                movers(self.figures, self.blocks, frames[1], |j, _, _| {
                    if i != j {
                        self.pairs.push((i.max(j), i.min(j)));
                    }
                });
            });
        }
    }
}

struct Slots<'a> {
    blocks: usize,
    rows: &'a [u32],
    columns: &'a [u32],
    slots: &'a mut Vec<u32>,
}

impl Visitor for Slots<'_> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        for term in terms {
            let slot = place(term.frames(), self.blocks).and_then(|place| slot(self.rows, self.columns, place));
            self.slots.push(slot.unwrap_or(NONE));
        }
    }
}

/// Takes what figures add.
struct OfFigures<'a, const D: usize> {
    matrix: &'a mut Matrix<D>,
    point_slots: std::slice::Iter<'a, u32>,
}

impl<const D: usize> Blocks for OfFigures<'_, D> {
    fn add<const R: usize>(&mut self, row: u32, column: u32, block: &Block<R>) {
        self.matrix.add(row, column, block, 1.0);
    }

    fn add_point(&mut self, row: u32, column: u32, block: &DMat3, mass: f64) {
        let block = block.to_cols_array_2d();
        if row == column {
            return add_block_of_points(&mut self.matrix.diagonal[row as usize], &block, mass, true);
        }
        if let Some(target) = self.point_slots.next().and_then(|&slot| self.matrix.lower.get_mut(slot as usize)) {
            // Columns are the rows of the transpose.
            add_block_of_points(target, &block, mass, row > column);
        }
    }
}

/// target += source + mass, or of the transpose of source.
fn add_block_of_points<const D: usize>(target: &mut Block<D>, source: &Block<3>, mass: f64, transposed: bool) {
    for i in 0..3 {
        for j in 0..3 {
            target[i][j] += if transposed { source[j][i] } else { source[i][j] };
        }
        target[i][i] += mass;
    }
}

struct Assemble<'a, const D: usize> {
    dt: f64,
    frames: &'a [Frame<f64>],
    figures: &'a mut Figures,
    matrix: &'a mut Matrix<D>,
    slots: std::slice::Iter<'a, u32>,
}

impl<const D: usize> Visitor for Assemble<'_, D> {
    fn visit<T: Term>(&mut self, terms: &mut [T]) {
        if T::IS_OF_POINTS {
            return self.add_points(terms);
        }
        for term in terms {
            let slot = self.slots.next().copied().unwrap_or(NONE);
            let at = pair(self.frames, term);
            if !term.is_idle(self.dt, at) {
                let hessian = term.hessian(self.dt, at);
                self.add(term.frames(), slot, &hessian);
            }
        }
    }
}

impl<const D: usize> Assemble<'_, D> {
    /// Points between the same two frames one after the other are added at once.
    fn add_points<T: Term>(&mut self, terms: &[T]) {
        let mut pending: Option<([FrameIndex; 2], u32, PointSum)> = None;
        for term in terms {
            let slot = self.slots.next().copied().unwrap_or(NONE);
            let at = pair(self.frames, term);
            if term.is_idle(self.dt, at) {
                continue;
            }
            let point = PointSum::of(&term.hessian(self.dt, at));
            if let Some((frames, slot, sum)) = &mut pending {
                if *frames == term.frames() && sum.join(&point) {
                    continue;
                }
                self.add(*frames, *slot, sum);
            }
            pending = Some((term.frames(), slot, point));
        }
        if let Some((frames, slot, sum)) = &pending {
            self.add(*frames, *slot, sum);
        }
    }

    /// Adds what acts between two frames.
    fn add(&mut self, [a, b]: [FrameIndex; 2], slot: u32, hessian: &impl BetweenFrames) {
        let factor = self.dt * self.dt;
        let blocks = self.matrix.diagonal.len();
        for (end, frame) in [a, b].into_iter().enumerate().filter(|&(_, frame)| frame != FIXED) {
            match self.matrix.diagonal.get_mut(frame as usize) {
                Some(diagonal) => add_scaled(diagonal, &hessian.own::<D>(end), factor),
                // Summed up at the point and pulled back once for all terms.
                None => self.figures.stiffen(frame as usize - blocks, hessian, end, factor),
            }
        }
        if slot != NONE {
            let ab = hessian.between::<D>();
            let below = if a < b { transpose(&ab) } else { ab };
            add_scaled(&mut self.matrix.lower[slot as usize], &below, factor);
        } else if a != FIXED && b != FIXED {
            self.pull_back([a, b], &hessian.between::<6>(), factor);
        }
    }

    /// Adds what a term does between two ends of which one is a material point of a figure: Jᵀ H J over all blocks that
    /// move them.
    fn pull_back(&mut self, [a, b]: [FrameIndex; 2], ab: &Block<6>, factor: f64) {
        let Self { figures, matrix, .. } = self;
        let blocks = matrix.diagonal.len();
        for (row, column, block) in [(a, b, ab), (b, a, &transpose(ab))] {
            movers(figures, blocks, column, |j, _, right| {
                let half = multiplied(block, right);
                movers(figures, blocks, row, |i, size, left| {
                    if i >= j {
                        matrix.add(i, j, &projected(left, size, &half), factor);
                    }
                });
            });
        }
    }
}

/// target += factor source, the part that both have.
// What a block is made of is then added as it comes, and the block never written to memory.
#[inline(always)]
fn add_scaled<const D: usize, const R: usize>(target: &mut Block<D>, source: &Block<R>, factor: f64) {
    for (target, source) in target.iter_mut().zip(source) {
        for (target, source) in target.iter_mut().zip(source) {
            *target += factor * source;
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;

    pub const D: usize = 3;

    /// A positive definite matrix with blocks below the diagonal at `pairs`, sorted by row, and the same one dense.
    pub fn matrix(n: usize, pairs: &[(u32, u32)], numbers: &[f64]) -> (Matrix<D>, Vec<Vec<f64>>) {
        let mut numbers = numbers.iter().copied().cycle();
        let mut matrix = Matrix::<D> { pairs: pairs.to_vec(), ..Matrix::default() };
        matrix.rows = vec![0; n + 1];
        for &(row, column) in pairs {
            matrix.columns.push(column);
            (row as usize + 1..=n).for_each(|i| matrix.rows[i] += 1);
        }
        let mut dense = vec![vec![0.0; D * n]; D * n];
        for &(row, column) in pairs {
            let block: Block<D> = std::array::from_fn(|_| std::array::from_fn(|_| numbers.next().unwrap()));
            for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                let (p, q) = (D * row as usize + i, D * column as usize + j);
                (dense[p][q], dense[q][p]) = (block[i][j], block[i][j]);
            }
            matrix.lower.push(block);
        }
        for (i, row) in dense.iter_mut().enumerate() {
            // Diagonally dominant, so positive definite.
            row[i] = 0.1 + row.iter().map(|x| x.abs()).sum::<f64>();
        }
        let diagonal = |i: usize| std::array::from_fn(|p| std::array::from_fn(|q| dense[D * i + p][D * i + q]));
        matrix.diagonal = (0..n).map(diagonal).collect();
        (matrix, dense)
    }

    /// A tree whose children come before their parents: the blocks below the diagonal, sorted by row.
    pub fn tree(parents: &[prop::sample::Index]) -> Vec<(u32, u32)> {
        let n = parents.len() + 1;
        let parent = |(child, index): (usize, &prop::sample::Index)| {
            ((child + 1 + index.index(n - child - 1)) as u32, child as u32)
        };
        let mut pairs: Vec<_> = parents.iter().enumerate().map(parent).collect();
        pairs.sort_unstable();
        pairs
    }

    /// Any blocks below the diagonal of `n` rows, sorted by row.
    pub fn pattern(n: u32) -> impl Strategy<Value = Vec<(u32, u32)>> {
        prop::collection::btree_set((1..n, 0..n - 1), 0..20)
            .prop_map(|pairs| pairs.into_iter().filter(|(row, column)| column < row).collect())
    }

    pub fn entries(n: usize) -> Vec<Entry<D>> {
        (0..n).map(|i| std::array::from_fn(|j| 1.0 + (i * D + j) as f64 * 0.37)).collect()
    }

    pub fn dense_product(dense: &[Vec<f64>], x: &[Entry<D>]) -> Vec<f64> {
        dense.iter().map(|row| row.iter().zip(x.as_flattened()).map(|(a, x)| a * x).sum()).collect()
    }

    pub fn largest_difference(a: &[Entry<D>], b: &[f64]) -> f64 {
        a.as_flattened().iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn the_sparse_product_is_the_dense_one(
            pairs in pattern(8),
            numbers in prop::collection::vec(-1.0..1.0f64, 40),
        ) {
            let n = 8;
            let (matrix, dense) = matrix(n, &pairs, &numbers);
            let x = entries(n);
            let mut product = vec![[0.0; D]; n];
            matrix.multiply(&x, &mut product);
            prop_assert!(largest_difference(&product, &dense_product(&dense, &x)) < 1e-12);
        }
    }
}
