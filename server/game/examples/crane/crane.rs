//! A wrecking-ball crane: a jib that swings to and fro, and a heavy ball on a rope at its end.

use pita_game::arena_file::{ArenaError, ArenaFile, Key};
use pita_game::assembly::{Assembly, Piece};
use pita_game::{Actor, ActorInfo, ActorKind, Contact, Partner, Pose, Response, Site, Step, WhenLost};
use pita_sim::{
    Anchor, BodyId, DVec3, DistanceLimitDesc, Driven, HingeDesc, Motor, MotorDesc, MotorId, Phase, Shape, SimError,
    World,
};
use serde::Deserialize;

/// Kg/m³ of iron.
const IRON: f64 = 7_900.0;
/// Kg of the jib with each metre.
const JIB: f64 = 150.0;

/// The crane's own keys in an arena file. Its foot is at its `position`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CraneParameters {
    /// Name of the ball's material.
    material: String,
    /// Of the jib above the ground, m.
    height: f64,
    /// Length of the jib, m.
    reach: f64,
    /// Length of the rope, m.
    rope: f64,
    /// Of the ball, kg.
    mass: f64,
    /// Of the jib, deg/s.
    speed_deg: f64,
    /// Ticks between two turns of its motion.
    period: u32,
}

/// The crane.
pub struct Crane {
    info: ActorInfo,
    parts: Assembly,
    motor: MotorId,
    home: Pose,
    period: u32,
    /// Where the ball hit something in this tick, m.
    hit: Option<DVec3>,
}

impl ActorKind for Crane {
    const KIND: &'static str = "crane";
    type Parameters = CraneParameters;

    fn check(p: &CraneParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        file.check_material(&key.at("material"), &p.material)?;
        key.at("height").number(p.height, 2.0, 50.0, "m")?;
        key.at("reach").number(p.reach, 1.0, 50.0, "m")?;
        key.at("rope").number(p.rope, 0.5, p.height, "m, no longer than the crane is high")?;
        key.at("mass").number(p.mass, 10.0, 1e5, "kg")?;
        key.at("speed_deg").number(p.speed_deg, 1.0, 180.0, "deg/s")?;
        key.at("period").count(p.period as usize, 1, 3_000, "ticks")
    }

    fn add(site: &mut Site, p: &CraneParameters) -> Result<Self, SimError> {
        let (top, end) = (DVec3::Y * p.height, DVec3::new(p.reach, p.height, 0.0));
        let mut parts = Assembly::at(site.pose);
        let jib = Shape::Box { half: DVec3::new(0.5 * p.reach, 0.2, 0.2) };
        let jib = parts.add(site.world, Piece::new(jib, JIB * p.reach, 0.3, 0.5 * (top + end)))?;
        let radius = (3.0 * p.mass / (4.0 * std::f64::consts::PI * IRON)).cbrt();
        let ball = Piece::new(Shape::Ball { radius }, p.mass, site.material(&p.material), end - DVec3::Y * p.rope);
        let ball = parts.add(site.world, ball)?;

        let mast = Anchor::world(parts.point(top));
        let foot = Anchor::body(jib, DVec3::NEG_X * 0.5 * p.reach);
        let hinge = site.world.add_hinge(HingeDesc::new(mast, foot, DVec3::Y, DVec3::Y))?;
        let tip = Anchor::body(jib, DVec3::X * 0.5 * p.reach);
        site.world.add_distance_limit(DistanceLimitDesc::rope(tip, Anchor::body(ball, DVec3::ZERO), p.rope))?;
        let target_speed = p.speed_deg.to_radians();
        // Strong enough to swing ball and jib up to speed within a second.
        let max_torque = (p.mass + JIB * p.reach) * p.reach * p.reach * target_speed;
        let motor = Motor { target_speed, gain: max_torque / (0.1 * target_speed), max_torque };
        let motor = site.world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor })?;
        let info = site.info(Self::KIND, parts.parts());
        Ok(Self { info, parts, motor, home: site.pose, period: p.period, hit: None })
    }
}

impl Actor for Crane {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.parts.bodies()
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        let is_blow = contact.phase == Phase::Begin && matches!(contact.partner, Partner::Actor { .. });
        if is_blow && contact.own.body == Some(self.bodies()[1]) {
            self.hit = Some(contact.point);
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        if let Some(at) = self.hit.take() {
            step.effect("clang", at, DVec3::ZERO, 1.0);
        }
        if step.is_due(self.period) {
            let motor = *step.world.motor(self.motor).ok_or(SimError::Gone { what: "the motor" })?;
            step.world.set_motor(self.motor, Motor { target_speed: -motor.target_speed, ..motor })?;
        }
        Ok(())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    fn place(&mut self, world: &mut World, _pose: Pose) -> Result<(), SimError> {
        self.parts.place(world, self.home)
    }
}
