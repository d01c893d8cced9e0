//! Cartoon squash: the body of a car gives way to what it feels, and swings back.
//!
//! Owns the car's body as it is drawn, a free-form lattice whose few modes, stretch along three axes and bend towards two,
//! are DOF on damped springs. What the chassis is accelerated by, beside gravity, is where they swing to. It is a mark of
//! the motion and no part of it: the chassis pushes and collides as if its body were rigid, so that cars with and without
//! it drive the same.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use pita_sim::{BodyId, FigureDesc, JointDrive, Shape, SimError, World};

use super::VehicleParameters;
use super::parameters::stunts::SquashParameters;
use crate::driver::Motion;
use crate::free_form::{Appearance, AppearanceDof, Warp};
use crate::part::PartInfo;

/// What it gives way by less is none, as a share of its height: cars that stand on trembling wheels may sleep.
const LEAST: f64 = 5e-3;

/// Length, height and width of the cabin's roof, by the chassis's half extents.
const CABIN: DVec3 = DVec3::new(0.45, 2.0, 0.8);

/// The body of a car as it is drawn.
pub struct Squash {
    body: BodyId,
    parameters: SquashParameters,
    /// Of the car's body, m.
    height: f64,
    /// Of the chassis a tick ago, m/s; `None` where it was put somewhere since.
    velocity: Option<DVec3>,
}

impl Squash {
    /// Adds the DOF of a car's body at `place`, m; `None` where it is to keep its shape.
    ///
    /// # Errors
    /// What the engine says, of a frequency that its ticks cannot show for one.
    pub fn add(world: &mut World, p: &VehicleParameters, place: DVec3) -> Result<Option<Self>, SimError> {
        let parameters = p.squash.clone();
        if parameters.strength <= 0.0 {
            return Ok(None);
        }
        let SquashParameters { frequency, damping_ratio, .. } = parameters;
        let gains = JointDrive::Position { frequency, damping_ratio }.gains(world.settings().dt)?;
        let dof = AppearanceDof::new(place, world.settings().gravity, gains);
        let (q, v) = (Appearance::PLAIN.numbers().to_vec(), vec![0.0; Appearance::NUMBERS]);
        let body = world.add_figure(FigureDesc { dof: Arc::new(dof), q, v, colliders: Vec::new() })?;
        Ok(Some(Self { body, parameters, height: height(p), velocity: None }))
    }

    /// The body whose DOF they are.
    pub fn body(&self) -> BodyId {
        self.body
    }

    /// How it is drawn: a hull in the chassis frame, which the DOF's [`Appearance`] deforms about the chassis's centre.
    pub fn part(&self, world: &World, p: &VehicleParameters) -> PartInfo {
        let [x, y, z] = p.chassis_half;
        let ring = |y: f64, x: f64, z: f64| [(x, z), (x, -z), (-x, z), (-x, -z)].map(|(x, z)| DVec3::new(x, y, z));
        let points = [ring(-y, x, z), ring(y, x, z), ring(y + CABIN.y * y, CABIN.x * x, CABIN.z * z)].concat();
        PartInfo::new(world, self.body, Shape::Hull { points, radius: 0.0 })
    }

    /// Lets a tick pass in which the chassis moves by `motion`.
    ///
    /// # Errors
    /// What the engine says.
    pub fn follow(&mut self, world: &mut World, motion: &Motion) -> Result<(), SimError> {
        let before = self.velocity.replace(motion.velocity).unwrap_or(motion.velocity);
        let (dt, gravity) = (world.settings().dt, world.settings().gravity);
        let felt = motion.rotation.inverse() * ((motion.velocity - before) / dt - gravity);
        // A car that stands is as it was drawn.
        let warp = self.warp(felt - DVec3::Y * gravity.length());
        world.set_controls(self.body, &Appearance { warp, ..Appearance::PLAIN }.numbers())
    }

    /// Where the modes swing to under the acceleration `felt` beyond that of standing, in the car's axes, m/s².
    fn warp(&self, felt: DVec3) -> Warp {
        let SquashParameters { strength, frequency, limit, .. } = self.parameters;
        let omega = std::f64::consts::TAU * frequency;
        let share = felt * (strength / (omega * omega * self.height));
        let [x, y, z] = share.to_array().map(|share| if share.abs() < LEAST { 0.0 } else { share });
        let along = 1.0 - y.clamp(-limit, limit);
        let across = along.sqrt().recip();
        // The tip of an arc of length h and curvature c is c h² / 2 off its start. It stays behind.
        let bend = DVec2::new(-x, -z).clamp_length_max(limit) * (2.0 / self.height);
        Warp { scale: DVec3::new(across, along, across), twist: 0.0, bend }
    }

    /// The car was put somewhere: its body is as it was made.
    ///
    /// # Errors
    /// What the engine says.
    pub fn reset(&mut self, world: &mut World) -> Result<(), SimError> {
        self.velocity = None;
        world.set_controls(self.body, &Appearance::PLAIN.numbers())?;
        world.set_slice(self.body, &Appearance::PLAIN.numbers(), &[0.0; Appearance::NUMBERS])
    }
}

/// Of a car's body from below the chassis to the roof, m.
fn height(p: &VehicleParameters) -> f64 {
    (2.0 + CABIN.y) * p.chassis_half[1]
}
