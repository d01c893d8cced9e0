//! The bodies of a car and how they hang together.

use glam::{DQuat, DVec3};
use pita_sim::{
    AntiRollBarDesc, AxleControl, AxleDesc, AxleId, BodyId, Collider, Driven, Material, Motor, MotorDesc, MotorId,
    RigidBodyDesc, Shape, SimError, World,
};

use super::VehicleParameters;
use crate::Pose;
use crate::arena_file::material;
use crate::part::PartInfo;

/// Place of a wheel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wheel {
    /// At +x, −z.
    FrontLeft,
    /// At +x, +z.
    FrontRight,
    /// At −x, −z.
    RearLeft,
    /// At −x, +z.
    RearRight,
}

/// All wheels, in the order of a car's parts.
pub const WHEELS: [Wheel; 4] = [Wheel::FrontLeft, Wheel::FrontRight, Wheel::RearLeft, Wheel::RearRight];

impl Wheel {
    /// Whether it steers.
    pub fn is_front(self) -> bool {
        matches!(self, Self::FrontLeft | Self::FrontRight)
    }

    /// Its distance from the car's middle plane, to the right, m.
    pub fn z(self, p: &VehicleParameters) -> f64 {
        let right = matches!(self, Self::FrontRight | Self::RearRight);
        if right { 0.5 * p.track } else { -0.5 * p.track }
    }

    /// Where its centre is in the chassis frame while the suspension bears nothing, m.
    pub fn hub(self, p: &VehicleParameters) -> DVec3 {
        let x = if self.is_front() { 0.5 * p.wheelbase } else { -0.5 * p.wheelbase };
        DVec3::new(x, p.hub_height, self.z(p))
    }
}

/// How a wheel rolls.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rolling {
    /// Speed of its hub along its heading, m/s.
    pub speed: f64,
    /// Its turning against the chassis, rad/s; positive where it rolls forwards.
    pub spin: f64,
}

/// Chassis, wheels and axles.
pub struct Rig {
    /// Chassis, then [`WHEELS`].
    bodies: [BodyId; 5],
    axles: [AxleId; 4],
    /// Between the wheels of the front, and the rear, axle.
    clutches: [MotorId; 2],
    shapes: [Shape; 5],
    /// Centre of each body above the ground point of a pose, in the car's axes, m.
    rest: [DVec3; 5],
}

impl Rig {
    /// Adds a car that rests on the ground at `pose`.
    ///
    /// # Errors
    /// What the engine says; what was added before is taken out again.
    pub fn add(world: &mut World, p: &VehicleParameters, pose: Pose) -> Result<Self, SimError> {
        let mut bodies = Vec::with_capacity(5);
        Self::build(world, p, pose, &mut bodies).inspect_err(|_| remove_all(world, &bodies))
    }

    /// Takes it out of the world.
    pub fn remove(&self, world: &mut World) {
        remove_all(world, &self.bodies);
    }

    fn build(world: &mut World, p: &VehicleParameters, pose: Pose, added: &mut Vec<BodyId>) -> Result<Self, SimError> {
        let rest = resting_places(p);
        let chassis_shape = Shape::Box { half: DVec3::from_array(p.chassis_half) };
        let wheel_shape =
            Shape::Cylinder { half_length: p.wheel_half_width, radius: p.wheel_radius, rounding: p.wheel_rounding };
        let mut add_body = |shape: &Shape, mass, material: Material, at: DVec3| {
            let desc = RigidBodyDesc {
                rotation: pose.rotation(),
                collider: Some(Collider::new(shape.clone(), material)),
                ..RigidBodyDesc::new(pose.position + pose.rotation() * at, mass, shape.inertia(mass))
            };
            world.add_rigid_body(desc).inspect(|&body| added.push(body))
        };
        let chassis = add_body(&chassis_shape, p.chassis_mass, material::chassis(p.chassis_friction), rest[0])?;
        let mut add_wheel = |at: DVec3| add_body(&wheel_shape, p.wheel_mass, material::tyre(p.tyre_friction), at);
        let wheels = [add_wheel(rest[1])?, add_wheel(rest[2])?, add_wheel(rest[3])?, add_wheel(rest[4])?];

        let mut add_axle = |wheel: Wheel| {
            world.add_axle(AxleDesc {
                chassis,
                wheel: wheels[wheel as usize],
                hub: wheel.hub(p),
                stiffness: p.suspension.stiffness,
                damping: p.suspension.damping,
                control: AxleControl::default(),
            })
        };
        let [fl, fr, rl, rr] = WHEELS;
        let axles = [add_axle(fl)?, add_axle(fr)?, add_axle(rl)?, add_axle(rr)?];
        let mut couple = |pair: [usize; 2], stiffness: f64| {
            let pair = pair.map(|i| axles[i]);
            if stiffness > 0.0 {
                world.add_anti_roll_bar(AntiRollBarDesc { axles: pair, stiffness })?;
            }
            world.add_motor(MotorDesc { joint: Driven::Wheels(pair), motor: Motor::default() })
        };
        let clutches = [couple([0, 1], p.suspension.anti_roll_front)?, couple([2, 3], p.suspension.anti_roll_rear)?];
        let shapes = [chassis_shape, wheel_shape.clone(), wheel_shape.clone(), wheel_shape.clone(), wheel_shape];
        let [w1, w2, w3, w4] = wheels;
        Ok(Self { bodies: [chassis, w1, w2, w3, w4], axles, clutches, shapes, rest })
    }

    /// Chassis, then [`WHEELS`].
    pub fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// The chassis.
    pub fn chassis(&self) -> BodyId {
        self.bodies[0]
    }

    /// Steers, drives and brakes a wheel.
    ///
    /// # Errors
    /// What the engine says.
    pub fn set_axle(&self, world: &mut World, wheel: Wheel, control: AxleControl) -> Result<(), SimError> {
        world.set_axle(self.axles[wheel as usize], control)
    }

    /// Sets the clutches between the wheels of the front, and the rear, axle.
    ///
    /// # Errors
    /// What the engine says.
    pub fn set_clutches(&self, world: &mut World, clutches: [Motor; 2]) -> Result<(), SimError> {
        self.clutches.iter().zip(clutches).try_for_each(|(&id, motor)| world.set_motor(id, motor))
    }

    /// How a wheel rolls that is steered by `steer` rad; at rest where it is gone.
    pub fn rolling(&self, world: &World, wheel: Wheel, steer: f64) -> Rolling {
        let (chassis, wheel) = (self.chassis(), self.bodies[1 + wheel as usize]);
        let turn = world.rotation(chassis).unwrap_or_default() * DQuat::from_rotation_y(steer);
        let spins = |body| world.angular_velocity(body).unwrap_or_default();
        Rolling {
            speed: world.velocity(wheel).unwrap_or_default().dot(turn * DVec3::X),
            spin: (spins(chassis) - spins(wheel)).dot(turn * DVec3::Z),
        }
    }

    /// Gives the whole car the velocity `change`, m/s, within the coming tick.
    ///
    /// # Errors
    /// What the engine says.
    pub fn kick(&self, world: &mut World, change: DVec3, dt: f64) -> Result<(), SimError> {
        self.bodies.iter().try_for_each(|&body| {
            let (mass, at) = (world.mass(body).unwrap_or_default(), world.position(body).unwrap_or_default());
            world.apply_force(body, change * (mass / dt), at)
        })
    }

    /// Slices and shapes of the bodies.
    pub fn parts(&self, world: &World) -> Vec<PartInfo> {
        let part = |(&body, shape): (&BodyId, &Shape)| PartInfo::new(world, body, shape.clone());
        let mut parts = self.bodies.iter().zip(&self.shapes).map(part);
        let chassis = parts.next();
        chassis.into_iter().chain(parts.map(PartInfo::hinged)).collect()
    }

    /// Puts the whole car at `pose`, upright and at rest.
    ///
    /// # Errors
    /// What the engine says where it refuses a pose.
    pub fn place(&self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        for (&body, &at) in self.bodies.iter().zip(&self.rest) {
            world.set_pose(body, pose.position + pose.rotation() * at, pose.rotation())?;
            world.set_velocity(body, DVec3::ZERO, DVec3::ZERO)?;
        }
        Ok(())
    }
}

fn remove_all(world: &mut World, bodies: &[BodyId]) {
    bodies.iter().for_each(|&body| {
        world.remove_body(body);
    });
}

/// Chassis and wheels with the wheels on the ground and the suspension at its static sag.
fn resting_places(p: &VehicleParameters) -> [DVec3; 5] {
    let chassis = DVec3::Y * p.ride_height();
    let wheel = |wheel: Wheel| wheel.hub(p).with_y(p.wheel_radius);
    [chassis, wheel(WHEELS[0]), wheel(WHEELS[1]), wheel(WHEELS[2]), wheel(WHEELS[3])]
}
