//! Brakes: pedal with bias and anti-lock, and the hand brake.

use pita_sim::Motor;

use super::VehicleParameters;
use super::parameters::STANDARD_GRAVITY;
use super::rig::{Rolling, Wheel};

/// Below this speed of the ground a wheel is braked to rest, m/s: what is left of it is less than a step.
const ANTI_LOCK_SPEED: f64 = 2.0;

/// How firmly anti-lock holds a wheel at its speed: it leaves of a difference at most 1 over this in a tick. With a band as
/// broad as the engine's a car brakes at a fifth of its torque at 5 m/s.
const ANTI_LOCK_GAIN: f64 = 100.0;

/// Pedal below which it is released.
const RELEASED: f64 = 0.02;

/// What a wheel's brake does in a tick.
#[derive(Clone, Copy, Debug)]
pub enum Braking {
    /// Nothing.
    Released,
    /// So much torque against any spin, N m; it blocks a wheel that the ground does not turn.
    Blocking(f64),
    /// Towards a spin a little below that of the ground.
    AntiLock(Motor),
}

impl Braking {
    /// Of `wheel`, at `pedal`, 0 to 1.
    pub fn of(p: &VehicleParameters, wheel: Wheel, pedal: f64, handbrake: bool, rolling: &Rolling, dt: f64) -> Self {
        if handbrake && !wheel.is_front() {
            return Self::Blocking(p.brakes.handbrake);
        }
        if pedal < RELEASED {
            return Self::Released;
        }
        let front = p.brakes.front_share;
        let torque = 0.5 * pedal * p.brakes.torque * if wheel.is_front() { front } else { 1.0 - front };
        if rolling.speed.abs() < ANTI_LOCK_SPEED || p.brakes.anti_lock_slip >= 1.0 {
            return Self::Blocking(torque);
        }
        // Below the speed that the ground has when the tick ends: a wheel that is held at its start's rolls along.
        let ground = (rolling.speed.abs() - p.tyre_friction * STANDARD_GRAVITY * dt).max(0.0);
        let wanted = ground.copysign(rolling.speed) * (1.0 - p.brakes.anti_lock_slip) / p.wheel_radius;
        // A brake turns no wheel: one that is slower than that already is left to the ground.
        let is_slower = rolling.spin * wanted.signum() < wanted.abs();
        let (gain, max_torque) = (ANTI_LOCK_GAIN * p.wheel_inertia() / dt, if is_slower { 0.0 } else { torque });
        // A wheel that rolls towards +x turns about −z.
        Self::AntiLock(Motor { target_speed: -wanted, gain, max_torque })
    }
}
