//! A wheel of the default car on a test bench: the contact model, measured.

use pita_game::vehicle::VehicleParameters;
use pita_sim::{BodyId, Collider, DQuat, DVec3, RigidBodyDesc, Settings, Shape, StaticDesc, World};

/// Share of the car that presses the wheel down, N.
pub const LOAD: f64 = 3_000.0;

/// Speed of the hub, m/s.
pub const SPEED: f64 = 20.0;

/// Of the wheel and what drives it, kg and kg m²: so much that a tick's force changes its slip by 0.05 % at most.
const MASS: f64 = 1e4;
const INERTIA: f64 = 1e6;

/// A wheel under load on the ground, which is held at its slip.
pub struct Rig {
    world: World,
    wheel: BodyId,
    p: VehicleParameters,
    dt: f64,
}

impl Rig {
    /// At this tick rate.
    pub fn new(tick_hz: f64) -> Self {
        let (p, dt) = (VehicleParameters::default(), 1.0 / tick_hz);
        let mut world =
            World::new(Settings { gravity: DVec3::ZERO, sleep: None, ..Settings::at(dt) }).expect("good settings");
        let ground = Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 1.0);
        world.add_static(StaticDesc::new(ground)).expect("a plane");
        let shape =
            Shape::Cylinder { half_length: p.wheel_half_width, radius: p.wheel_radius, rounding: p.wheel_rounding };
        let wheel = RigidBodyDesc {
            rotation: DQuat::IDENTITY,
            collider: Some(Collider::new(shape, p.tyre_friction)),
            ..RigidBodyDesc::new(DVec3::Y * p.wheel_radius, MASS, DVec3::splat(INERTIA))
        };
        let wheel = world.add_rigid_body(wheel).expect("a wheel");
        Self { world, wheel, p, dt }
    }

    /// Force of the ground along and across the heading over the load, while the hub moves with `velocity` and the wheel
    /// rolls with `rim` m/s: held at that for half a second, and then the mean of another half.
    pub fn force(&mut self, velocity: DVec3, rim: f64) -> [f64; 2] {
        let spin = DVec3::NEG_Z * (rim / self.p.wheel_radius);
        let ticks = (0.5 / self.dt).round() as usize;
        let mut sum = DVec3::ZERO;
        for tick in 0..2 * ticks {
            // The ground may push it up and down.
            let rise = self.world.velocity(self.wheel).unwrap().y;
            self.world.set_velocity(self.wheel, velocity.with_y(rise), spin).unwrap();
            let at = self.world.position(self.wheel).unwrap();
            self.world.apply_force(self.wheel, DVec3::NEG_Y * LOAD, at).unwrap();
            self.world.step();
            let change = self.world.velocity(self.wheel).unwrap() - velocity;
            if tick >= ticks {
                sum += change * (MASS / self.dt / ticks as f64);
            }
        }
        [sum.x / LOAD, sum.z / LOAD]
    }

    /// Force along the heading over the load at a slip: the share of the hub's speed by which the rim is slower.
    pub fn along(&mut self, slip: f64) -> [f64; 2] {
        self.force(DVec3::X * SPEED, SPEED * (1.0 - slip))
    }

    /// The same of a rolling wheel at a slip angle, given by its tangent.
    pub fn across(&mut self, slip: f64) -> [f64; 2] {
        let angle = slip.atan();
        self.force(DVec3::new(angle.cos(), 0.0, angle.sin()) * SPEED, SPEED * angle.cos())
    }
}
