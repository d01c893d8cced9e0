//! What a tornado looks like: a funnel, and the numbers that warp it.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use pita_sim::collide::TriangleMesh;
use pita_sim::{BodyId, FigureDesc, JointDrive, SimError, World};

use super::TornadoParameters;
use super::column::Column;
use crate::arena_file::key_frames;
use crate::free_form::{Appearance, AppearanceDof, KeyFrames, Warp};

/// Rings of the funnel's mesh, from foot to top.
pub const RINGS: usize = 12;
/// Points of a ring.
pub const SECTORS: usize = 16;

/// Largest curvature of the axis times its length, rad: it bends over and does not curl up.
const BENT_MAX: f64 = 1.2;

/// Least share of its size that a tornado which is not there is drawn with.
const LEAST: f64 = 0.1;

/// The funnel before it is warped, open at both ends: points ring by ring from the foot, m.
///
/// # Errors
/// What the engine says of sizes that leave triangles without area.
pub fn mesh(p: &TornadoParameters) -> Result<TriangleMesh, SimError> {
    let point = |ring: usize, sector: usize| {
        let share = ring as f64 / (RINGS - 1) as f64;
        let radius = p.foot_radius + (p.top_radius - p.foot_radius) * share;
        let around = DQuat::from_rotation_y(TAU * sector as f64 / SECTORS as f64);
        around * DVec3::X * radius + DVec3::Y * p.height * share
    };
    let points: Vec<_> = (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| point(ring, sector))).collect();
    let corner = |ring: usize, sector: usize| (ring * SECTORS + sector % SECTORS) as u32;
    // Sectors go to the right, seen from outside.
    let quad = |ring: usize, sector: usize| {
        let [a, b] = [sector, sector + 1].map(|sector| corner(ring, sector));
        let [c, d] = [sector, sector + 1].map(|sector| corner(ring + 1, sector));
        [[a, b, d], [a, d, c]]
    };
    let quads = (0..RINGS - 1).flat_map(|ring| (0..SECTORS).map(move |sector| quad(ring, sector)));
    TriangleMesh::new(&points, &quads.flatten().collect::<Vec<_>>())
}

/// How the funnel follows what it is asked to be: a third of a second, without swinging.
const EASE: JointDrive = JointDrive::Position { frequency: 2.0, damping_ratio: 1.0 };

/// What spins and warps the funnel: it says what the funnel's DOF shall be, and the integrator moves them there.
pub struct Warping {
    keys: Option<KeyFrames<{ Warp::NUMBERS }>>,
    body: BodyId,
    /// Since it appeared first, s.
    time: f64,
}

impl Warping {
    /// Adds the DOF of a funnel that is not there yet; `place`, m, is where they are said to be.
    ///
    /// # Errors
    /// What the engine says.
    pub fn add(world: &mut World, p: &TornadoParameters, place: DVec3) -> Result<Self, SimError> {
        let keys = key_frames(&p.warp, p.warp_period);
        let q = Appearance { strength: 0.0, ..Appearance::PLAIN }.numbers().to_vec();
        let gains = EASE.gains(world.settings().dt)?;
        let (v, dof) = (vec![0.0; q.len()], AppearanceDof::new(place, world.settings().gravity, gains));
        let body = world.add_figure(FigureDesc { dof: Arc::new(dof), q, v, colliders: Vec::new() })?;
        Ok(Self { keys, body, time: 0.0 })
    }

    /// The body whose DOF they are.
    pub fn body(&self) -> BodyId {
        self.body
    }

    /// Lets a tick pass. What is key-framed comes on top of what the column's motion does by itself: its spacing stretches
    /// the funnel, its lean bends it, its strength scales it.
    ///
    /// # Errors
    /// What the engine says.
    pub fn step(
        &mut self,
        world: &mut World,
        p: &TornadoParameters,
        spheres: [(DVec3, DVec3); Column::SPHERES],
        strength: f64,
    ) -> Result<(), SimError> {
        self.time += world.settings().dt;
        let [(foot, _), .., (top, _)] = spheres;
        let height = (top.y - foot.y).max(LEAST * p.height);
        // The tip of an arc of length h and curvature c is c h² / 2 off its start.
        let lean = DVec2::new(top.x - foot.x, top.z - foot.z) * (2.0 / (height * height));
        let size = strength.max(LEAST);
        let moved = Warp {
            scale: DVec3::new(size, size * height / p.height, size),
            twist: p.twist,
            bend: lean.clamp_length_max(BENT_MAX / height),
        };
        let keyed = self.keys.as_ref().map_or(Warp::NONE, |keys| Warp::of_numbers(keys.at(self.time)));
        let wanted = Appearance { spin: p.spin_speed * self.time, warp: moved.with(&keyed), strength };
        world.set_controls(self.body, &wanted.numbers())
    }
}
