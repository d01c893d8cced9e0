//! From frames to the rates that move them: Jᵀ H J, block by block.

use glam::DMat3;

use super::block::{Block, zero};
use crate::dof::Columns;

/// H B, B the derivatives of a frame.
pub(super) fn multiplied(h: &Block<6>, columns: &Columns) -> Block<6> {
    let rows: Block<6> = std::array::from_fn(|l| std::array::from_fn(|j| columns[j][l]));
    let mut product = zero();
    for (product, h) in product.iter_mut().zip(h) {
        for (h, row) in h.iter().zip(&rows) {
            add_row(product, row, *h);
        }
    }
    product
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

/// target += factor source.
pub(super) fn add_block(target: &mut Block<6>, source: &Block<6>, factor: f64) {
    target.iter_mut().zip(source).for_each(|(target, source)| add_row(target, source, factor));
}

fn add_row(target: &mut [f64; 6], source: &[f64; 6], factor: f64) {
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
