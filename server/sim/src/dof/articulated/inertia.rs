//! The mass matrix over a figure's rates, for what has to know how heavy a joint feels.

use arrayvec::ArrayVec;
use glam::{DMat3, DVec3};

use super::{Articulated, PARTS_MAX};
use crate::dof::{Columns, Dof, PartPoint};

/// A dense symmetric matrix over `n` rates.
pub(super) struct MassMatrix<'a> {
    pub n: usize,
    /// Row by row.
    pub entries: &'a mut [f64],
}

impl MassMatrix<'_> {
    /// Adds Jᵀ M J of every part of a figure at `q`.
    pub fn add(&mut self, figure: &Articulated, q: &[f64]) {
        for (part, inertia) in (0..).zip(&figure.inertias) {
            let place = figure.place(part, q);
            let tensor = place.rotation * inertia.inertia * place.rotation.transpose();
            let mut movers = ArrayVec::<(usize, Columns), PARTS_MAX>::new();
            figure.jacobian(PartPoint { part, point: inertia.centre }, q, &mut |block, columns| {
                movers.push((block, *columns));
            });
            for (a, left) in &movers {
                for (b, right) in &movers {
                    self.add_pair(figure, (*a, left), (*b, right), inertia.mass, tensor);
                }
            }
        }
    }

    fn add_pair(
        &mut self,
        figure: &Articulated,
        (a, left): (usize, &Columns),
        (b, right): (usize, &Columns),
        mass: f64,
        tensor: DMat3,
    ) {
        let [rows, columns] = [a, b].map(|block| figure.rates_of(block));
        for (right, j) in right.iter().zip(columns) {
            let (linear, angular) = (mass * DVec3::from_slice(right), tensor * DVec3::from_slice(&right[3..]));
            for (left, i) in left.iter().zip(rows.clone()) {
                let (moved, turned) = (DVec3::from_slice(left), DVec3::from_slice(&left[3..]));
                self.entries[i * self.n + j] += moved.dot(linear) + turned.dot(angular);
            }
        }
    }

    /// What rate i resists with where all others are held.
    pub fn held(&self, i: usize) -> f64 {
        self.entries[i * self.n + i]
    }

    /// Lets a rate go where its potentials take it, none: the others then feel what is left (Schur complement).
    pub fn release(&mut self, i: usize) {
        let n = self.n;
        let pivot = self.held(i);
        for row in (0..n).filter(|&row| row != i) {
            let factor = self.entries[row * n + i] / pivot;
            for column in 0..n {
                self.entries[row * n + column] -= factor * self.entries[i * n + column];
            }
        }
    }

    /// Up to three rates from `start`, with unit inertia where there are fewer.
    pub fn block(entries: &[f64], n: usize, start: usize, size: usize) -> DMat3 {
        let entry = |i: usize, j: usize| match i < size && j < size {
            true => entries[(start + i) * n + start + j],
            false => f64::from(u8::from(i == j)),
        };
        let column = |j: usize| DVec3::new(entry(0, j), entry(1, j), entry(2, j));
        DMat3::from_cols(column(0), column(1), column(2))
    }
}
