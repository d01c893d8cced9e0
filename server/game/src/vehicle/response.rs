//! From controls to pedals and wheel: people and scripts step, a car does not.

use super::VehicleParameters;
use crate::Controls;

/// A throttle that falls below this is released: the engine brakes from here on.
const RELEASED: f64 = 0.02;

/// Pedals and steering as they are now.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pedals {
    throttle: f64,
    brake: f64,
    steer: f64,
}

impl Pedals {
    /// Moves towards `controls` over `dt` s: pedals as a first-order low-pass, the steering at a limited rate and within
    /// the angle that the forward speed `speed`, m/s, allows.
    pub fn follow(&mut self, controls: &Controls, p: &VehicleParameters, speed: f64, dt: f64) {
        // Implicit Euler of x' = (target − x) / time: stable for any dt.
        let part = dt / (p.steering.pedal_time + dt);
        self.throttle += part * (controls.throttle - self.throttle);
        self.brake += part * (controls.brake - self.brake);
        // Right is positive for a player, left for an angle about y.
        let wanted = -controls.steer * p.steer_limit(speed);
        let change = p.steering.rate_deg.to_radians() * dt;
        self.steer += (wanted - self.steer).clamp(-change, change);
        if controls.throttle == 0.0 && self.throttle < RELEASED {
            self.throttle = 0.0;
        }
    }

    /// Throttle, brake and steering.
    pub fn to_array(self) -> [f64; 3] {
        [self.throttle, self.brake, self.steer]
    }

    /// What [`Self::to_array`] answered.
    pub fn from_array([throttle, brake, steer]: [f64; 3]) -> Self {
        Self { throttle, brake, steer }
    }

    /// 0 to 1.
    pub fn throttle(&self) -> f64 {
        self.throttle
    }

    /// 0 to 1.
    pub fn brake(&self) -> f64 {
        self.brake
    }

    /// Angle of an imagined wheel in the middle of the front axle, positive to the left, rad.
    pub fn steer(&self) -> f64 {
        self.steer
    }
}
