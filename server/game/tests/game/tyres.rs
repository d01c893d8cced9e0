//! What a tyre gives, along its heading and across it, as `docs/VEHICLE.md` has it: the contact model measured on a wheel
//! of the default car.

use pita_game::vehicle::VehicleParameters;
use pita_sim::{BodyId, Collider, DQuat, DVec3, RigidBodyDesc, Settings, Shape, StaticDesc, World};

/// Share of the car that presses the wheel down, N.
const LOAD: f64 = 3_000.0;

/// Speed of the hub, m/s.
const SPEED: f64 = 20.0;

/// Of the wheel and what drives it, kg and kg m²: so much that a tick's force changes its slip by 0.05 % at most.
const MASS: f64 = 1e4;
const INERTIA: f64 = 1e6;

/// A wheel under load on the ground, which is held at its slip.
struct Rig {
    world: World,
    wheel: BodyId,
    p: VehicleParameters,
    dt: f64,
}

impl Rig {
    fn new(tick_hz: f64) -> Self {
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
    fn force(&mut self, velocity: DVec3, rim: f64) -> [f64; 2] {
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
}

#[test]
fn a_tyre_gives_coulombs_force_at_any_slip() {
    for tick_hz in [30.0, 480.0] {
        eprintln!("{tick_hz} Hz");
        for slip in [0.0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3, 1.0] {
            let along = Rig::new(tick_hz).force(DVec3::X * SPEED, SPEED * (1.0 - slip));
            let angle = f64::atan(slip);
            let across =
                Rig::new(tick_hz).force(DVec3::new(angle.cos(), 0.0, angle.sin()) * SPEED, SPEED * angle.cos());
            eprintln!(
                "slip {slip}: along {:.3} {:.3}, across at {:.2} deg {:.3} {:.3}",
                along[0],
                along[1],
                angle.to_degrees(),
                across[0],
                across[1]
            );
            if slip >= 0.01 {
                assert!((along[0] + 1.0).abs() < 0.03 && along[1].abs() < 0.01, "slip {slip}: {along:?}");
                assert!((across[1] + 1.0).abs() < 0.03 && across[0].abs() < 0.1, "slip {slip}: {across:?}");
            }
        }
    }
}

/// Sliding both ways the force points against the slip and stays within the circle.
#[test]
fn slip_along_and_across_share_one_circle() {
    let [along, across] = Rig::new(30.0).force(DVec3::new(SPEED, 0.0, 1.0), SPEED - 1.0);
    assert!((along.hypot(across) - 1.0).abs() < 0.03, "{along} {across}");
    assert!((along / across - 1.0).abs() < 0.05, "{along} {across}");
}
