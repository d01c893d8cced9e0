//! Hulls whose vertices are embedded in DOF: they deform with the body, whatever its kind (talk, "Collision Detection").
//!
//! Owns what such a hull is, where it is in a tick, and of which vertices a point of its surface is made. Detection sees
//! the hull of where the vertices are; what pushes it pushes the vertices beneath, through the Jacobians of their
//! embedding, those of how the body turns there included: friction has the extrusion radius for a lever.

use arrayvec::ArrayVec;
use glam::{DMat3, DVec3};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::Triangle;

use super::groups::Groups;
use super::material::Material;
use super::shape::{Collider, HULL_POINTS_MAX};
use crate::dof::{FigureBody, PartPoint, Pose, Twist};
use crate::error::{SimError, require, require_vector};
use crate::potential::outer;

/// Most vertices among which those beneath a point are looked for.
const NEAREST_MAX: usize = 6;

/// What lies so much deeper than the surface counts as so many times farther off: vertices beneath a point are those of
/// the side that it is on.
const DEPTH_FACTOR: f64 = 10.0;

/// Vertices in one line have no rotation of their own about it: share of the sum of squared distances that is added to
/// their moments.
const ROUNDING: f64 = 1e-9;

/// A convex hull of material points of a figure, extruded: it deforms with the figure. Hulls and colliders of one body do
/// not collide with each other.
#[derive(Clone, Debug)]
pub struct EmbeddedHull {
    vertices: Vec<PartPoint>,
    radius: f64,
    /// What it is made of and meets; its shape is where the vertices are.
    collider: Collider,
}

/// Up to three vertices that a point of a hull lies between, with their weights, which sum up to 1; the weight of none is 0.
pub(crate) type Foot = [(PartPoint, f64); 3];

impl EmbeddedHull {
    /// The hull of 1 to 256 material points with an extrusion radius above 0, m: what deforms may get flat.
    pub fn new(vertices: Vec<PartPoint>, radius: f64, material: impl Into<Material>) -> Self {
        let collider = Collider::deforming(vertices.len(), radius, material);
        Self { vertices, radius, collider }
    }

    /// The same in other groups.
    pub fn with_groups(self, groups: Groups) -> Self {
        Self { collider: self.collider.with_groups(groups), ..self }
    }

    /// The same as a sensor.
    pub fn into_sensor(self) -> Self {
        Self { collider: self.collider.into_sensor(), ..self }
    }

    /// Where its vertices are embedded.
    pub fn vertices(&self) -> &[PartPoint] {
        &self.vertices
    }

    /// m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// A collider of its material and groups, of no size.
    pub(crate) fn collider(&self) -> &Collider {
        &self.collider
    }

    /// `Err` unless it fits a body of `parts` parts.
    pub(crate) fn validate(&self, parts: u32) -> Result<(), SimError> {
        let count = self.vertices.len();
        require((1..=HULL_POINTS_MAX).contains(&count), "vertices", count as f64, "1 to 256")?;
        require(self.radius > 0.0 && self.radius < 1e6, "radius", self.radius, "above 0, below 1e6 m")?;
        self.collider.material().surface.validate()?;
        for (index, vertex) in self.vertices.iter().enumerate() {
            let named = |reason: SimError| reason.of(format!("vertex {index}"));
            require_vector(vertex.point, "place").map_err(named)?;
            let exists = vertex.part < parts;
            require(exists, "part", f64::from(vertex.part), "the index of one of the body's parts").map_err(named)?;
        }
        Ok(())
    }

    /// The vertices beneath a point of the core on the side towards `outward`; `place` answers where material points are.
    pub(crate) fn foot(&self, point: DVec3, outward: DVec3, place: impl Fn(PartPoint) -> DVec3) -> Foot {
        let mut places = ArrayVec::<(PartPoint, DVec3), HULL_POINTS_MAX>::new();
        places.extend(self.vertices.iter().map(|&vertex| (vertex, place(vertex))));
        let distance =
            |&(_, at): &(PartPoint, DVec3)| (at - point).length() + DEPTH_FACTOR * (point - at).dot(outward).max(0.0);
        places.sort_unstable_by(|p, q| distance(p).total_cmp(&distance(q)));
        places.truncate(NEAREST_MAX);
        let mut best = (f64::INFINITY, [(places[0].0, 1.0), (places[0].0, 0.0), (places[0].0, 0.0)]);
        let mut offer = |corners: [usize; 3]| {
            let [a, b, c] = corners.map(|i| places[i].1);
            let (found, location) = Triangle::new(a, b, c).project_local_point_and_get_location(point, false);
            let apart = found.point.distance_squared(point);
            // A little nearer is rounding: the first will do.
            if let Some(weights) = location.barycentric_coordinates().filter(|_| apart + 1e-18 < best.0) {
                best = (apart, std::array::from_fn(|i| (places[corners[i]].0, weights[i])));
            }
        };
        let count = places.len();
        for k in 0..count {
            for j in 0..=k {
                (0..=j).for_each(|i| offer([i, j, k]));
            }
        }
        best.1
    }
}

/// A hull where its vertices are in this tick.
#[derive(Clone, Debug)]
pub(super) struct Deformed {
    /// Its shape is about the middle of the vertices, in world axes.
    pub collider: Collider,
    places: Vec<[DVec3; 2]>,
}

/// Where a deforming hull is and how it moves.
pub(super) struct Motion {
    pub pose: Pose,
    /// Of the rigid motion that is nearest to that of its vertices.
    pub twist: Twist,
    /// How much faster than that a vertex is at most, m/s.
    pub spread: f64,
}

impl Deformed {
    pub fn new(hull: &EmbeddedHull) -> Self {
        Self { collider: hull.collider.clone(), places: Vec::with_capacity(hull.vertices.len()) }
    }

    /// Takes over where the vertices are.
    pub fn follow(&mut self, hull: &EmbeddedHull, figure: &FigureBody, [q, v]: [&[f64]; 2]) -> Motion {
        let Self { collider, places } = self;
        places.clear();
        places.extend(hull.vertices.iter().map(|&at| figure.dof.point(at, q, v)));
        let count = places.len() as f64;
        let [middle, linear] = [0, 1].map(|i| places.iter().map(|place| place[i]).sum::<DVec3>() / count);
        let (mut moments, mut spin, mut squares) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for &[place, velocity] in places.iter() {
            let arm = place - middle;
            squares += arm.length_squared();
            moments -= outer(arm, arm);
            spin += arm.cross(velocity);
        }
        moments += DMat3::from_diagonal(DVec3::splat(squares * (1.0 + ROUNDING)));
        let angular = if squares > 0.0 { moments.inverse() * spin } else { DVec3::ZERO };
        let twist = Twist { linear, angular: if angular.is_finite() { angular } else { DVec3::ZERO } };
        let apart = places.iter().map(|&[place, velocity]| (velocity - twist.at(place - middle)).length());
        let spread = apart.fold(0.0, f64::max);
        collider.deform(places.iter().map(|&[place, _]| place - middle));
        Motion { pose: Pose { position: middle, ..Pose::IDENTITY }, twist, spread }
    }
}
