//! Shapes: convex cores, spherically extruded (the talk's "points become spheres, edges become cylinders").

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use parry3d_f64::math::Pose as ParryPose;
use parry3d_f64::shape::{Cuboid, Cylinder, Segment};

use super::cloud::Cloud;
use super::convex::Convex;
use super::core::{Core, Point, Polytope};
use super::groups::Groups;
use super::material::Material;
use super::triangle_mesh::TriangleMesh;
use crate::error::{SimError, require, require_vector};

/// A collision shape in its body's frame, metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Everything below the plane through the origin; static only.
    HalfSpace {
        /// Unit normal, points out of the ground.
        normal: DVec3,
    },
    /// Ball around the origin: an extruded point.
    Ball {
        /// Radius.
        radius: f64,
    },
    /// Box around the origin.
    Box {
        /// Half extents.
        half: DVec3,
    },
    /// Segment along x, extruded.
    Capsule {
        /// Half length of the segment.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Cylinder along z with rounded edges: a wheel.
    Cylinder {
        /// Half length along z, the rounding included.
        half_length: f64,
        /// Radius, the rounding included.
        radius: f64,
        /// Extrusion radius of the edges; less than the other two.
        rounding: f64,
    },
    /// Convex hull of points, extruded: a point becomes a ball, an edge a cylinder with round ends, a polygon a plate.
    Hull {
        /// 1 to 256 points.
        points: Vec<DVec3>,
        /// Extrusion radius; above 0 where the points lie in a plane.
        radius: f64,
    },
    /// Surface of triangles; static only.
    Mesh(Arc<TriangleMesh>),
}

/// Most vertices of a hull.
pub const HULL_POINTS_MAX: usize = 256;

impl Shape {
    /// # Errors
    /// [`SimError`] naming the first size that is out of range.
    pub fn validate(&self) -> Result<(), SimError> {
        let size = |value: f64, what| require(value > 0.0 && value < 1e6, what, value, "above 0, below 1e6 m");
        match self {
            Self::HalfSpace { normal } => {
                let length = normal.length();
                require((length - 1.0).abs() < 1e-6, "normal", length, "a vector of length 1")
            }
            Self::Ball { radius } => size(*radius, "radius"),
            Self::Box { half } => half.to_array().into_iter().try_for_each(|h| size(h, "half")),
            Self::Capsule { half_length, radius } => {
                size(*half_length, "half_length")?;
                size(*radius, "radius")
            }
            Self::Cylinder { half_length, radius, rounding } => {
                size(*half_length, "half_length")?;
                size(*radius, "radius")?;
                let fits = *rounding >= 0.0 && *rounding < half_length.min(*radius);
                require(fits, "rounding", *rounding, "0 to below half_length and radius")
            }
            Self::Hull { points, radius } => {
                let count = points.len();
                require((1..=HULL_POINTS_MAX).contains(&count), "points", count as f64, "1 to 256")?;
                points.iter().try_for_each(|&p| require_vector(p, "points"))?;
                require((0.0..1e6).contains(radius), "radius", *radius, "0 to below 1e6 m")?;
                if *radius > 0.0 { Ok(()) } else { spans_a_volume(points) }
            }
            // It was checked when it was made.
            Self::Mesh(_) => Ok(()),
        }
    }

    /// Axis in the body's frame about which the shape may spin without moving its surface. A ball has every axis, and its
    /// contacts' arms lie along their normals anyway.
    pub(crate) fn revolution_axis(&self) -> Option<DVec3> {
        match self {
            Self::Capsule { .. } => Some(DVec3::X),
            Self::Cylinder { .. } => Some(DVec3::Z),
            _ => None,
        }
    }

    /// Radius of the ball around the body's origin that contains the shape; infinite for a half-space.
    pub(crate) fn bounding_radius(&self) -> f64 {
        match self {
            Self::HalfSpace { .. } => f64::INFINITY,
            Self::Ball { radius } => *radius,
            Self::Box { half } => half.length(),
            Self::Capsule { half_length, radius } => half_length + radius,
            Self::Cylinder { half_length, radius, .. } => half_length.hypot(*radius),
            Self::Hull { points, radius } => farthest(points) + radius,
            Self::Mesh(mesh) => farthest(mesh.vertices()),
        }
    }

    /// Least and greatest coordinate along a unit vector in the body's frame: the support map both ways, m.
    pub(crate) fn interval(&self, direction: DVec3) -> (f64, f64) {
        let ([low], [high]) = self.intervals(|v| [v.dot(direction)]);
        (low, high)
    }

    /// As [`Shape::interval`], for several unit vectors at once: `along` answers the coordinates along them of a vector in
    /// the body's frame.
    #[inline]
    pub(crate) fn intervals<const H: usize>(&self, along: impl Fn(DVec3) -> [f64; H]) -> ([f64; H], [f64; H]) {
        let half = match self {
            Self::HalfSpace { .. } => [f64::INFINITY; H],
            Self::Ball { radius } => [*radius; H],
            Self::Box { half } => {
                let (mut x, y, z) = (along(DVec3::X), along(DVec3::Y), along(DVec3::Z));
                for i in 0..H {
                    x[i] = x[i].abs() * half.x + y[i].abs() * half.y + z[i].abs() * half.z;
                }
                x
            }
            Self::Capsule { half_length, radius } => along(DVec3::X).map(|x| x.abs() * half_length + radius),
            Self::Cylinder { half_length, radius, rounding } => along(DVec3::Z).map(|along| {
                let across = (1.0 - along * along).max(0.0).sqrt();
                along.abs() * (half_length - rounding) + across * (radius - rounding) + rounding
            }),
            Self::Hull { points, radius } => {
                let (low, high) = ends(points, along);
                return (low.map(|low| low - radius), high.map(|high| high + radius));
            }
            Self::Mesh(mesh) => return ends(mesh.vertices(), along),
        };
        (half.map(|half| -half), half)
    }

    /// What is extruded, and by how much; `None` for what is not convex, or has no bounds.
    fn core(&self) -> Option<(Core, f64)> {
        Some(match self {
            Self::HalfSpace { .. } | Self::Mesh(_) => return None,
            Self::Ball { radius } => (Core::Point(Point), *radius),
            Self::Box { half } => (Core::Box(Cuboid::new(*half)), 0.0),
            Self::Capsule { half_length, radius } => {
                (Core::Segment(Segment::new(DVec3::NEG_X * *half_length, DVec3::X * *half_length)), *radius)
            }
            Self::Cylinder { half_length, radius, rounding } => {
                (Core::Cylinder(Cylinder::new(half_length - rounding, radius - rounding)), *rounding)
            }
            Self::Hull { points, radius } => (Core::Polytope(Polytope::new(points.clone())), *radius),
        })
    }

    /// Turns the axes of the core into the body's: cylinders stand along y there.
    fn core_rotation(&self) -> DQuat {
        match self {
            Self::Cylinder { .. } => DQuat::from_rotation_x(FRAC_PI_2),
            _ => DQuat::IDENTITY,
        }
    }
}

/// Distance of the farthest of points from the origin, m.
fn farthest(points: &[DVec3]) -> f64 {
    points.iter().map(|p| p.length()).fold(0.0, f64::max)
}

/// Least and greatest coordinates of points, m.
fn ends<const H: usize>(points: &[DVec3], along: impl Fn(DVec3) -> [f64; H]) -> ([f64; H], [f64; H]) {
    let (mut low, mut high) = ([f64::INFINITY; H], [f64::NEG_INFINITY; H]);
    for at in points.iter().map(|&point| along(point)) {
        for i in 0..H {
            low[i] = if at[i] < low[i] { at[i] } else { low[i] };
            high[i] = if at[i] > high[i] { at[i] } else { high[i] };
        }
    }
    (low, high)
}

const FLAT_HULL: &str = "points of a hull lie in a plane: give it a radius, or a point beside the plane";

/// A hull is flat where its height is less than this fraction of its length.
const FLATTEST: f64 = 1e-6;

/// `Err` where all points lie in a plane, within [`FLATTEST`].
fn spans_a_volume(points: &[DVec3]) -> Result<(), SimError> {
    let origin = points[0];
    let farthest = |height: &dyn Fn(DVec3) -> DVec3| {
        let heights = points.iter().map(|&p| height(p - origin));
        heights.fold(DVec3::ZERO, |best, h| if h.length_squared() > best.length_squared() { h } else { best })
    };
    let line = farthest(&|p| p);
    let along = line.normalize_or_zero();
    let across = farthest(&|p| p.reject_from_normalized(along));
    let normal = along.cross(across.normalize_or_zero());
    let height = farthest(&|p| normal * normal.dot(p));
    let flat = height.length() <= FLATTEST * line.length() || along == DVec3::ZERO;
    if flat { Err(SimError::Unusable { what: FLAT_HULL }) } else { Ok(()) }
}

/// What a body or a static piece collides with.
#[derive(Clone, Debug)]
pub struct Collider {
    shape: Shape,
    material: Material,
    groups: Groups,
    is_sensor: bool,
    /// The shape for the fine phase: its core, the extrusion radius and the core's rotation into the body's frame. Built
    /// once: hulls are costly.
    core: Option<(Core, f64, DQuat)>,
    bounding_radius: f64,
}

impl Collider {
    /// A collider of a material, or with a Coulomb coefficient of friction and nothing else.
    pub fn new(shape: Shape, material: impl Into<Material>) -> Self {
        // What does not validate has no core.
        let core = shape.validate().ok().and_then(|()| shape.core());
        let core = core.map(|(core, radius)| (core, radius, shape.core_rotation()));
        let bounding_radius = shape.bounding_radius();
        let (material, groups, is_sensor) = (material.into(), Groups::ALL, false);
        Self { shape, material, groups, is_sensor, core, bounding_radius }
    }

    /// A collider of what deforms: a hull of so many points, which are in one place until [`Collider::deform`] moves them.
    pub(super) fn deforming(points: usize, radius: f64, material: impl Into<Material>) -> Self {
        let points = vec![DVec3::ZERO; points];
        let core = Some((Core::Cloud(Cloud::new(points.clone())), radius, DQuat::IDENTITY));
        let (material, groups, is_sensor) = (material.into(), Groups::ALL, false);
        Self { shape: Shape::Hull { points, radius }, material, groups, is_sensor, core, bounding_radius: radius }
    }

    /// Moves the points of what deforms.
    pub(super) fn deform(&mut self, places: impl Iterator<Item = DVec3> + Clone) {
        if let (Shape::Hull { points, .. }, Some((Core::Cloud(cloud), ..))) = (&mut self.shape, &mut self.core) {
            cloud.deform(places.clone());
            points.clear();
            points.extend(places);
        }
        self.bounding_radius = self.shape.bounding_radius();
    }

    /// The same in other groups.
    pub fn with_groups(self, groups: Groups) -> Self {
        Self { groups, ..self }
    }

    /// The same as a sensor: it sees what overlaps it, and neither pushes nor is pushed. Sensors do not see each other.
    pub fn into_sensor(self) -> Self {
        Self { is_sensor: true, ..self }
    }

    /// Its shape.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// What it is made of.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Its groups.
    pub fn groups(&self) -> Groups {
        self.groups
    }

    /// Whether it sees and does not push.
    pub fn is_sensor(&self) -> bool {
        self.is_sensor
    }

    /// Whether the two look at each other at all.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.groups.meet(other.groups) && !(self.is_sensor && other.is_sensor)
    }

    pub(crate) fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }

    /// # Errors
    /// [`SimError`] naming the first value that is out of range.
    pub fn validate(&self) -> Result<(), SimError> {
        self.material.surface.validate()?;
        self.shape.validate()
    }

    /// [`Collider::validate`] for what moves.
    ///
    /// # Errors
    /// As there, and for a half-space, which has no bounds, or a mesh, which has no inside.
    pub(crate) fn validate_moving(&self) -> Result<(), SimError> {
        match self.shape {
            Shape::HalfSpace { .. } => Err(SimError::Unusable { what: "a half-space cannot move: use a box" }),
            Shape::Mesh(_) => {
                Err(SimError::Unusable { what: "a surface of triangles cannot move: use its convex parts" })
            }
            _ => self.validate(),
        }
    }

    /// The shape for the fine phase, given the body's pose; `None` for what is not convex.
    pub(super) fn convex(&self, pose: crate::dof::Pose) -> Option<Convex<'_>> {
        let (core, radius, rotation) = self.core.as_ref()?;
        let pose = ParryPose::from_parts(pose.position, pose.rotation * *rotation);
        Some(Convex { core: core.map(), half: core.half(), radius: *radius, pose, constraints: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inertia_of_a_hull_agrees_with_the_box_it_is() {
        let half = DVec3::new(0.2, 0.5, 1.1);
        let corner = |i: usize| {
            let sign = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
            half * DVec3::new(sign(1), sign(2), sign(4))
        };
        let hull = Shape::Hull { points: (0..8).map(corner).collect(), radius: 0.0 };
        let (a, b) = (hull.inertia(3.0), Shape::Box { half }.inertia(3.0));
        assert!((a - b).length() < 1e-9, "{a} {b}");
    }

    #[test]
    fn sizes_out_of_range_are_named() {
        let bad = Shape::Cylinder { half_length: 0.1, radius: 0.3, rounding: 0.1 };
        assert!(bad.validate().unwrap_err().to_string().contains("rounding is 0.1"));
        let flat = Shape::Hull { points: vec![DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::X + DVec3::Z], radius: 0.0 };
        assert!(flat.validate().is_err());
        assert!(Shape::Ball { radius: f64::NAN }.validate().is_err());
    }
}
