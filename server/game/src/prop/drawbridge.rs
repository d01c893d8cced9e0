//! A drawbridge: a leaf on a hinge, which a motor lifts and lowers by the clock of the world.

use pita_sim::{
    Anchor, AngleLimitDesc, BodyId, DVec3, Driven, HingeDesc, Motor, MotorDesc, MotorId, Shape, SimError, World,
};
use serde::Deserialize;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key};
use crate::assembly::{Assembly, Piece};
use crate::kinds::{ActorKind, Site};
use crate::spawn::Pose;
use crate::step::Step;

/// The motor's torque, in torques that hold the leaf level.
const STRENGTH: f64 = 3.0;
/// Difference of speed at which the motor gives its full torque, in its speeds.
const SLIP: f64 = 0.2;

/// Keys of `kind = "drawbridge"`: a leaf that reaches from its place, where its hinge is, along its heading.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawbridgeParameters {
    /// Name of its material.
    pub material: String,
    /// Length, thickness and width of the leaf, m.
    pub size: [f64; 3],
    /// Of the leaf, kg.
    #[serde(default = "mass")]
    pub mass: f64,
    /// How far it opens, deg.
    #[serde(default = "opens_deg")]
    pub opens_deg: f64,
    /// How fast it moves, deg/s.
    #[serde(default = "speed_deg")]
    pub speed_deg: f64,
    /// For how long it is asked to be down, and then to be up, s.
    #[serde(default = "down_and_up")]
    pub down_and_up: [f64; 2],
}

fn mass() -> f64 {
    2_000.0
}

fn opens_deg() -> f64 {
    70.0
}

fn speed_deg() -> f64 {
    15.0
}

fn down_and_up() -> [f64; 2] {
    [20.0, 10.0]
}

/// A leaf, its hinge and its motor.
pub struct Drawbridge {
    info: ActorInfo,
    leaf: Assembly,
    motor: MotorId,
    home: Pose,
    parameters: DrawbridgeParameters,
}

impl ActorKind for Drawbridge {
    const KIND: &'static str = "drawbridge";
    type Parameters = DrawbridgeParameters;

    fn check(parameters: &DrawbridgeParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        let DrawbridgeParameters { material, size, mass, opens_deg, speed_deg, down_and_up } = parameters;
        file.check_material(&key.at("material"), material)?;
        size.iter().enumerate().try_for_each(|(i, &x)| key.at("size").index(i).number(x, 0.05, 100.0, "m"))?;
        key.at("mass").number(*mass, 1.0, 1e6, "kg")?;
        key.at("opens_deg").number(*opens_deg, 1.0, 120.0, "deg")?;
        key.at("speed_deg").number(*speed_deg, 1.0, 90.0, "deg/s")?;
        let key = key.at("down_and_up");
        down_and_up.iter().enumerate().try_for_each(|(i, &time)| key.index(i).number(time, 1.0, 3_600.0, "s"))
    }

    fn add(site: &mut Site, parameters: &DrawbridgeParameters) -> Result<Self, SimError> {
        let mut leaf = Assembly::at(site.pose);
        let size = DVec3::from(parameters.size);
        let middle = DVec3::new(0.5 * size.x, -0.5 * size.y, 0.0);
        let (shape, material) = (Shape::Box { half: 0.5 * size }, site.material(&parameters.material));
        let body = leaf.add(site.world, Piece::new(shape, parameters.mass, material, middle))?;
        let (a, b) = (Anchor::world(site.pose.position), Anchor::body(body, -middle));
        let hinge = site.world.add_hinge(HingeDesc::new(a, b, site.pose.rotation() * DVec3::Z, DVec3::Z))?;
        site.world.add_angle_limit(AngleLimitDesc::new(hinge, 0.0, parameters.opens_deg.to_radians()))?;
        let gravity = site.world.settings().gravity.length();
        let max_torque = STRENGTH * parameters.mass * gravity * middle.x;
        let target_speed = -parameters.speed_deg.to_radians();
        let motor = Motor { target_speed, gain: max_torque / (SLIP * target_speed.abs()), max_torque };
        let motor = site.world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor })?;
        let info = site.info(Self::KIND, leaf.parts());
        Ok(Self { info, leaf, motor, home: site.pose, parameters: parameters.clone() })
    }
}

impl Actor for Drawbridge {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.leaf.bodies()
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        let [down, up] = self.parameters.down_and_up;
        let is_up = (step.tick as f64 * step.dt) % (down + up) >= down;
        let speed = self.parameters.speed_deg.to_radians();
        let motor = *step.world.motor(self.motor).ok_or(SimError::Gone { what: "the motor" })?;
        step.world.set_motor(self.motor, Motor { target_speed: if is_up { speed } else { -speed }, ..motor })
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    /// Its hinge stays where it is: so does the leaf, whatever the pose.
    fn place(&mut self, world: &mut World, _pose: Pose) -> Result<(), SimError> {
        self.leaf.place(world, self.home)
    }
}
