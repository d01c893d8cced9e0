//! From frames to the rates that move them: Jᵀ H J, block by block.

use glam::DMat3;

use super::attachment::Influence;
use super::block::{Block, zero};
use super::figures::Blocks;
use crate::dof::Columns;

/// H B, B the derivatives of a frame.
pub(super) fn multiplied(h: &Block<6>, columns: &Columns) -> Block<6> {
    product::<6, 6>(h, columns)
}

/// Aᵀ M, A the derivatives of a frame with respect to the first `size` rates of a block.
pub(super) fn projected(columns: &Columns, size: u8, m: &Block<6>) -> Block<6> {
    let mut product = zero();
    for (product, column) in product.iter_mut().zip(columns).take(usize::from(size)) {
        for (x, row) in column.iter().zip(m) {
            add_row(product, row, *x);
        }
    }
    product
}

/// Hands over Jᵀ H J of a frame that `movers` move; of a place only the upper left quarter of H counts.
pub(super) fn pull_back(h: &Block<6>, is_place: bool, movers: &[Influence], blocks: &mut impl Blocks) {
    let points = movers.iter().all(|mover| mover.size <= 3);
    match (is_place, points) {
        (true, true) => pull_back_part::<3, 3>(h, movers, blocks),
        (true, false) => pull_back_part::<3, 6>(h, movers, blocks),
        (false, true) => pull_back_part::<6, 3>(h, movers, blocks),
        (false, false) => pull_back_part::<6, 6>(h, movers, blocks),
    }
}

/// The same with the first L rows of frames, for blocks of R rates or fewer.
fn pull_back_part<const L: usize, const R: usize>(h: &Block<6>, movers: &[Influence], blocks: &mut impl Blocks) {
    for b in movers {
        let half = product::<L, R>(h, &b.columns);
        for a in movers.iter().filter(|a| a.block >= b.block) {
            let mut block: Block<R> = zero();
            for (row, column) in block.iter_mut().zip(&a.columns).take(usize::from(a.size)) {
                for (x, half) in column.iter().zip(&half) {
                    add_row(row, half, *x);
                }
            }
            blocks.add(a.block, b.block, &block);
        }
    }
}

/// H B, the first L rows of both and R columns.
fn product<const L: usize, const R: usize>(h: &Block<6>, columns: &Columns) -> [[f64; R]; L] {
    let rows: [[f64; R]; L] = std::array::from_fn(|l| std::array::from_fn(|j| columns[j][l]));
    let mut product = [[0.0; R]; L];
    for (product, h) in product.iter_mut().zip(h) {
        for (h, row) in h.iter().zip(&rows) {
            add_row(product, row, *h);
        }
    }
    product
}

/// target += factor source, the leading part that the source has.
pub(super) fn add_block<const R: usize>(target: &mut Block<6>, source: &Block<R>, factor: f64) {
    for (target, source) in target.iter_mut().zip(source) {
        target.iter_mut().zip(source).for_each(|(target, source)| *target += factor * source);
    }
}

fn add_row<const R: usize>(target: &mut [f64; R], source: &[f64; R], factor: f64) {
    for (target, source) in target.iter_mut().zip(source) {
        *target += factor * source;
    }
}

/// What a rigid part weighs at its centre of mass.
pub(super) fn inertia_block(mass: f64, inertia: DMat3) -> Block<6> {
    let mut block = zero();
    for i in 0..3 {
        block[i][i] = mass;
        // The inertia is symmetric: its columns are its rows.
        block[3 + i][3..].copy_from_slice(&inertia.col(i).to_array());
    }
    block
}
