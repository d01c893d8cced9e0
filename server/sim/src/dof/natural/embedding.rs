//! How a part is embedded in points: kinematics and mass.

use glam::{DMat3, DQuat, DVec3};

use super::desc::EMBEDDED_IN;
use crate::dof::embedding::EmbeddedPoint;
use crate::dof::{Columns, Frame, Mount, MountNode};
use crate::error::SimError;
use crate::mass::{MassProperties, embedded_mass};

/// Volume of a tetrahedron in cubes of its longest edge below which it is flat; the regular one has 0.118.
const FLATTEST: f64 = 1e-3;

/// Farthest that the centre of mass of a part between two points may be off their line, in its length.
const OFF_LINE_MAX: f64 = 1e-6;

/// Least 1 + cos of the angle between a rod's direction and that at rest: the shortest turn between opposite
/// directions is not unique, and near them it changes fast.
const OPPOSITE: f64 = 1e-6;

/// A part embedded in points, which are given in the part's frame.
#[derive(Clone, Debug)]
pub(super) enum Embedding {
    /// In one point: the part moves with it and does not turn.
    Point { offset: DVec3 },
    /// In two points: the part turns with their line, and not about it.
    Line { start: DVec3, direction: DVec3, length: f64 },
    /// In four points: a place in the part is Σ λᵢ qᵢ.
    Tetrahedron {
        first: DVec3,
        /// λ₁, λ₂, λ₃ of a place are this times what leads there from the first point; λ₀ is what is missing to 1.
        weights: DMat3,
    },
}

impl Embedding {
    /// # Errors
    /// [`SimError`] for points in one place, four in a plane, or a number of points that is not 1, 2 or 4.
    pub fn new(points: &[DVec3]) -> Result<Self, SimError> {
        match *points {
            [point] => Ok(Self::Point { offset: point }),
            [start, end] => {
                let line = end - start;
                let direction = line.try_normalize().ok_or(SimError::Unusable { what: "its two points are one" })?;
                Ok(Self::Line { start, direction, length: line.length() })
            }
            [a, b, c, d] => {
                let edges = DMat3::from_cols(b - a, c - a, d - a);
                let longest =
                    points.iter().flat_map(|p| points.iter().map(move |q| p.distance(*q))).fold(0.0, f64::max);
                let spans = edges.determinant().abs() > 6.0 * FLATTEST * longest.powi(3);
                if !spans {
                    return Err(SimError::Unusable { what: "its four points lie (nearly) in a plane" });
                }
                Ok(Self::Tetrahedron { first: a, weights: edges.inverse() })
            }
            _ => Err(SimError::Unusable { what: EMBEDDED_IN }),
        }
    }

    /// Mass matrix over the points, row by row, kg.
    ///
    /// # Errors
    /// [`SimError`] where the mass of a part between two points is not on their line.
    pub fn masses(&self, points: &[DVec3], props: &MassProperties) -> Result<Vec<f64>, SimError> {
        match *self {
            Self::Point { .. } => Ok(vec![props.mass]),
            Self::Line { start, direction, length } => {
                let arm = props.centre - start;
                let off = (arm - direction * direction.dot(arm)).length();
                if off > OFF_LINE_MAX * length {
                    return Err(SimError::Unusable { what: "its centre of mass is not on the line of its two points" });
                }
                let near = direction.dot(arm) / length;
                let spread = direction.dot(props.moments * direction) / (length * length);
                let (far, mass) = (1.0 - near, props.mass);
                let between = mass * near * far - spread;
                Ok(vec![mass * far * far + spread, between, between, mass * near * near + spread])
            }
            Self::Tetrahedron { .. } => {
                let corners = [points[0], points[1], points[2], points[3]];
                Ok(embedded_mass(&corners, props)?.as_flattened().to_vec())
            }
        }
    }

    /// The frame at `local`; `q` and `v` answer place and velocity of each point.
    pub fn frame(&self, local: DVec3, q: impl Fn(usize) -> DVec3, v: impl Fn(usize) -> DVec3) -> Frame<f64> {
        match *self {
            Self::Point { offset } => Frame::point(q(0) + local - offset, v(0)),
            Self::Line { start, direction, length } => {
                let turn = LineTurn::new(direction, q(1) - q(0));
                let (share, off) = split(local - start, direction, length);
                let (arm, spin) = (turn.rotation * off, turn.spin(v(1) - v(0)));
                Frame::new(q(0).lerp(q(1), share) + arm, turn.rotation, v(0).lerp(v(1), share) + spin.cross(arm), spin)
            }
            Self::Tetrahedron { first, weights } => {
                between_four(first, weights, local).frame(&[0, 1, 2, 3].map(q), &[0, 1, 2, 3].map(v))
            }
        }
    }

    /// How the frame at `local` follows from `points`, given by their numbers.
    pub fn mount(&self, local: DVec3, points: &[u32]) -> Mount {
        match *self {
            Self::Point { offset } => {
                let nodes = vec![MountNode { point: points[0], weight: 1.0, gradient: DVec3::ZERO }];
                Mount::Points { nodes, position: local - offset, deformation: DMat3::IDENTITY }
            }
            Self::Line { start, direction, length } => {
                let (share, offset) = split(local - start, direction, length);
                Mount::Line { points: [points[0], points[1]], share, direction, offset }
            }
            Self::Tetrahedron { first, weights } => {
                let nodes = between_four(first, weights, local).mount_nodes(points);
                Mount::Points { nodes, position: DVec3::ZERO, deformation: DMat3::ZERO }
            }
        }
    }

    /// Hands `visit` every point's index with the derivatives of the frame at `local`.
    pub fn jacobian(&self, local: DVec3, q: impl Fn(usize) -> DVec3, mut visit: impl FnMut(usize, &Columns)) {
        match *self {
            Self::Point { .. } => visit(0, &columns(|axis| (axis, DVec3::ZERO))),
            Self::Line { start, direction, length } => {
                let turn = LineTurn::new(direction, q(1) - q(0));
                let (share, off) = split(local - start, direction, length);
                let arm = turn.rotation * off;
                for (point, weight, sign) in [(0, 1.0 - share, -1.0), (1, share, 1.0)] {
                    let derivatives = |axis: DVec3| {
                        let spin = turn.spin(axis * sign);
                        (axis * weight + spin.cross(arm), spin)
                    };
                    visit(point, &columns(derivatives));
                }
            }
            Self::Tetrahedron { first, weights } => {
                between_four(first, weights, local).columns(&[0, 1, 2, 3].map(q), visit);
            }
        }
    }

    /// Both at once.
    pub fn frame_and_jacobian(
        &self,
        local: DVec3,
        q: impl Fn(usize) -> DVec3,
        v: impl Fn(usize) -> DVec3,
        visit: impl FnMut(usize, &Columns),
    ) -> Frame<f64> {
        if let Self::Tetrahedron { first, weights } = *self {
            let point = between_four(first, weights, local);
            return point.frame_and_columns(&[0, 1, 2, 3].map(q), &[0, 1, 2, 3].map(v), visit);
        }
        self.jacobian(local, &q, visit);
        self.frame(local, q, v)
    }

    /// Place and velocity at `local`.
    pub fn point(&self, local: DVec3, q: impl Fn(usize) -> DVec3, v: impl Fn(usize) -> DVec3) -> [DVec3; 2] {
        if let Self::Tetrahedron { first, weights } = *self {
            return between_four(first, weights, local).place(&[0, 1, 2, 3].map(q), &[0, 1, 2, 3].map(v));
        }
        let frame = self.frame(local, q, v);
        [frame.position.into(), frame.linear.into()]
    }

    /// Whether places are linear in those of the points: what is off a line swings about it.
    pub fn is_linear(&self) -> bool {
        !matches!(self, Self::Line { .. })
    }

    /// As [`Embedding::jacobian`], of the place alone, where that is linear.
    pub fn place_jacobian(&self, local: DVec3, q: impl Fn(usize) -> DVec3, visit: impl FnMut(usize, &Columns)) {
        match *self {
            Self::Tetrahedron { first, weights } => between_four(first, weights, local).place_columns(visit),
            _ => self.jacobian(local, q, visit),
        }
    }
}

/// Columns of the rates of a point: velocity and angular velocity that a velocity of 1 along each axis gives.
fn columns(derivatives: impl Fn(DVec3) -> (DVec3, DVec3)) -> Columns {
    let mut columns = [[0.0; 6]; 6];
    for (column, axis) in columns.iter_mut().zip(DVec3::AXES) {
        let (linear, angular) = derivatives(axis);
        column[..3].copy_from_slice(&linear.to_array());
        column[3..].copy_from_slice(&angular.to_array());
    }
    columns
}

/// A place in a part between four points.
fn between_four(first: DVec3, weights: DMat3, local: DVec3) -> EmbeddedPoint<4> {
    let shares = weights * (local - first);
    let [a, b, c] = [weights.row(0), weights.row(1), weights.row(2)];
    EmbeddedPoint {
        weights: [1.0 - shares.element_sum(), shares.x, shares.y, shares.z],
        gradients: [-(a + b + c), a, b, c],
    }
}

/// Share of the length along the line, and the rest.
fn split(local: DVec3, direction: DVec3, length: f64) -> (f64, DVec3) {
    let along = direction.dot(local);
    (along / length, local - direction * along)
}

/// The shortest turn from the direction of a line at rest to that of now.
struct LineTurn {
    rotation: DMat3,
    /// Now.
    direction: DVec3,
    length: f64,
    /// What a change of the direction, at right angles to it, spins the part about its own line.
    about: DVec3,
}

impl LineTurn {
    fn new(rest: DVec3, line: DVec3) -> Self {
        let length = line.length();
        let direction = line.try_normalize().unwrap_or(rest);
        let rotation = DMat3::from_quat(DQuat::from_rotation_arc(rest, direction));
        let about = direction.cross(rest) / (1.0 + rest.dot(direction)).max(OPPOSITE);
        Self { rotation, direction, length, about }
    }

    /// Angular velocity where the line changes at a rate of `line`.
    fn spin(&self, line: DVec3) -> DVec3 {
        if self.length <= f64::MIN_POSITIVE {
            return DVec3::ZERO;
        }
        let rate = (line - self.direction * self.direction.dot(line)) / self.length;
        self.direction.cross(rate) + self.direction * self.about.dot(rate)
    }
}
