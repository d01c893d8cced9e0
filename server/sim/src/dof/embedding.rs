//! Points of a body that is embedded in nodes: a place is Σ Nᵢ xᵢ, its axes turn as the rotation of the deformation
//! gradient F = Σ xᵢ ⊗ ∇Nᵢ does.
//!
//! Shared by natural coordinates, finite elements and lattices; knows none of them.

use glam::{DMat3, DVec3};

use super::polar::Polar;
use super::{Columns, Frame, MountNode};
use crate::potential::cross_matrix;

/// A material point between N nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmbeddedPoint<const N: usize> {
    /// Nᵢ at the point; they sum up to 1.
    pub weights: [f64; N],
    /// ∇Nᵢ there in rest coordinates, 1/m; they sum up to 0.
    pub gradients: [DVec3; N],
}

impl<const N: usize> EmbeddedPoint<N> {
    /// The frame at the point, with nodes at `x` that move at `v`.
    pub fn frame(&self, x: &[DVec3; N], v: &[DVec3; N]) -> Frame<f64> {
        self.turned_frame(&self.polar(x), x, v)
    }

    /// Hands `visit` each node's number with the frame's derivatives with respect to its velocity.
    pub fn columns(&self, x: &[DVec3; N], visit: impl FnMut(usize, &Columns)) {
        self.turned_columns(&self.polar(x), visit);
    }

    /// Both at once.
    pub fn frame_and_columns(&self, x: &[DVec3; N], v: &[DVec3; N], visit: impl FnMut(usize, &Columns)) -> Frame<f64> {
        let polar = self.polar(x);
        self.turned_columns(&polar, visit);
        self.turned_frame(&polar, x, v)
    }

    /// Derivatives of the place alone: they never change.
    pub fn place_columns(&self, mut visit: impl FnMut(usize, &Columns)) {
        let mut columns = Columns::default();
        for (node, &weight) in self.weights.iter().enumerate() {
            (0..3).for_each(|k| columns[k][k] = weight);
            visit(node, &columns);
        }
    }

    /// For those who show the point: its nodes, given by their numbers.
    pub fn mount_nodes(&self, numbers: &[u32]) -> Vec<MountNode> {
        let shares = self.weights.into_iter().zip(self.gradients).zip(numbers);
        shares.map(|((weight, gradient), &point)| MountNode { point, weight, gradient }).collect()
    }

    /// Place and velocity of the point.
    pub fn place(&self, x: &[DVec3; N], v: &[DVec3; N]) -> [DVec3; 2] {
        [self.mean(x), self.mean(v)]
    }

    fn mean(&self, of: &[DVec3; N]) -> DVec3 {
        self.weights.iter().zip(of).map(|(&weight, &x)| weight * x).sum()
    }

    fn polar(&self, x: &[DVec3; N]) -> Polar {
        let column = |k: usize| self.gradients.iter().zip(x).map(|(g, &x)| g[k] * x).sum();
        Polar::of(DMat3::from_cols(column(0), column(1), column(2)))
    }

    fn turned_frame(&self, polar: &Polar, x: &[DVec3; N], v: &[DVec3; N]) -> Frame<f64> {
        let Polar { rotation, yielding } = *polar;
        let circulation: DVec3 = self.gradients.iter().zip(v).map(|(&g, &v)| (rotation * g).cross(v)).sum();
        Frame::new(self.mean(x), rotation, self.mean(v), yielding * circulation)
    }

    fn turned_columns(&self, polar: &Polar, mut visit: impl FnMut(usize, &Columns)) {
        let Polar { rotation, yielding } = *polar;
        let mut columns = Columns::default();
        for (node, (&weight, &gradient)) in self.weights.iter().zip(&self.gradients).enumerate() {
            let turn = yielding * cross_matrix(rotation * gradient);
            for (k, column) in columns.iter_mut().enumerate().take(3) {
                column[k] = weight;
                column[3..].copy_from_slice(&turn.col(k).to_array());
            }
            visit(node, &columns);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use proptest::array::{uniform3, uniform4};
    use proptest::prelude::*;

    use super::super::polar::LEAST_SUM;
    use super::*;
    use crate::dof::Twist;
    use crate::potential::elasticity::Principal;

    proptest! {
        /// Position and rotation move as velocity and angular velocity say, squeezed and inside out too; and the columns
        /// are the frame's derivatives.
        #[test]
        fn frames_move_as_they_say(
            x in uniform4(uniform3(-1.0..1.0f64)),
            v in uniform4(uniform3(-1.0..1.0f64)),
            weights in uniform3(-0.5..1.0f64),
        ) {
            let (x, v) = (x.map(DVec3::from_array), v.map(DVec3::from_array));
            let f = DMat3::from_cols(x[1] - x[0], x[2] - x[0], x[3] - x[0]);
            let s = Principal::of(f).stretches;
            prop_assume!(s.y + s.z > 1.5 * LEAST_SUM);
            let [a, b, c] = weights;
            let gradients = [-DVec3::ONE, DVec3::X, DVec3::Y, DVec3::Z];
            let point = EmbeddedPoint { weights: [1.0 - a - b - c, a, b, c], gradients };
            let Twist { linear, angular } = point.frame(&x, &v).twist();
            let step = 1e-6;
            let at = |h: f64| point.frame(&std::array::from_fn(|i| x[i] + h * v[i]), &v);
            let (before, after) = (at(-step), at(step));
            let moved = DVec3::from(after.position) - DVec3::from(before.position);
            prop_assert!((moved / (2.0 * step) - linear).length() < 1e-8);
            let turn = DQuat::from_mat3(&(after.rotation.value() * before.rotation.value().transpose()));
            let error = turn.to_scaled_axis() / (2.0 * step) - angular;
            prop_assert!(error.length() < 1e-6 * (1.0 + angular.length() / s.z.abs().max(1e-2)), "{error}");
            let mut sum = [0.0; 6];
            let frame = point.frame_and_columns(&x, &v, |node, columns| {
                for (column, v) in columns.iter().zip(v[node].to_array()) {
                    (0..6).for_each(|i| sum[i] += column[i] * v);
                }
            });
            prop_assert_eq!(frame, point.frame(&x, &v));
            let mut place = [0.0; 6];
            point.place_columns(|node, columns| {
                for (column, v) in columns.iter().zip(v[node].to_array()) {
                    (0..6).for_each(|i| place[i] += column[i] * v);
                }
            });
            prop_assert_eq!(place[..3].to_vec(), sum[..3].to_vec());
            let error = (DVec3::from_slice(&sum) - linear).length() + (DVec3::from_slice(&sum[3..]) - angular).length();
            prop_assert!(error < 1e-12 * (1.0 + angular.length()));
        }
    }
}
