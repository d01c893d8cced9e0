//! Drive train: from the throttle to a torque on every driven wheel.
//!
//! The engine has no inertia of its own: it turns as the driven wheels do on average, through the gear that is in, or as
//! fast as the clutch lets it slip. Shifting is automatic.

use pita_sim::Motor;

use super::VehicleParameters;
use super::parameters::drive_train::RPM;
use super::rig::{Rolling, Wheel};

/// Slip at which a driven wheel's torque passes from none to full, rad/s. A motor that switches within a smaller band is
/// stiff against the wheel's inertia and costs Newton iterations; a wider one leaves top speed short.
const MOTOR_BAND: f64 = 4.0;

/// How much of a difference of two wheels a differential's clutch leaves within a tick, at most, as 1 over this.
const CLUTCH_GAIN: f64 = 30.0;

/// The gear that is in, and what is left of a shift.
#[derive(Clone, Copy, Debug)]
pub struct DriveTrain {
    /// 1 to the last; 0 is the reverse gear.
    gear: usize,
    /// Time until it drives again, s.
    shift_rest: f64,
}

/// What the engine gives in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// Over all driven wheels, N m; at least 0.
    torque: f64,
    /// Fastest that it turns a wheel, rad/s; 0 where it brakes.
    limit: f64,
    /// 1 forwards, −1 backwards.
    direction: f64,
}

impl Default for DriveTrain {
    fn default() -> Self {
        Self { gear: 1, shift_rest: 0.0 }
    }
}

impl DriveTrain {
    /// Shifts as the speed asks for, m/s, and answers what the engine gives while the driven wheels turn by `spin` rad/s on
    /// average.
    pub fn drive(
        &mut self,
        p: &VehicleParameters,
        throttle: f64,
        reverse: bool,
        [speed, spin]: [f64; 2],
        dt: f64,
    ) -> Output {
        // The tick in which a shift ends drives for what is left of it.
        let part = 1.0 - (self.shift_rest / dt).min(1.0);
        self.shift_rest = (self.shift_rest - dt).max(0.0);
        self.shift(p, reverse, speed);
        let ratio = p.gearbox.ratio(self.gear);
        let direction = if reverse { -1.0 } else { 1.0 };
        if throttle <= 0.0 {
            // The engine turns with the wheels and brakes them.
            return Output { torque: p.engine.brake_torque * ratio * part, limit: 0.0, direction };
        }
        let rpm = (spin.abs() * ratio / RPM).max(p.engine.clutch_rpm);
        let top = if reverse { p.reverse_speed } else { p.top_speed };
        let limit = (p.engine.limit_rpm * RPM / ratio).min(top / p.wheel_radius);
        Output { torque: throttle * p.engine.torque_at(rpm) * ratio * part, limit, direction }
    }

    fn shift(&mut self, p: &VehicleParameters, reverse: bool, speed: f64) {
        if reverse || self.gear == 0 {
            self.gear = usize::from(!reverse);
            return;
        }
        if self.shift_rest > 0.0 {
            return;
        }
        // By the speed of the car: wheels that spin ask for no gear.
        let rpm = speed.max(0.0) / p.wheel_radius * p.gearbox.ratio(self.gear) / RPM;
        if rpm > p.gearbox.up_rpm && self.gear < p.gearbox.ratios.len() {
            (self.gear, self.shift_rest) = (self.gear + 1, p.gearbox.shift_time);
        } else if rpm < p.gearbox.down_rpm && self.gear > 1 {
            (self.gear, self.shift_rest) = (self.gear - 1, p.gearbox.shift_time);
        }
    }

    /// The gear, 0 is reverse.
    pub fn gear(&self) -> usize {
        self.gear
    }

    /// Gear, and what is left of a shift.
    pub fn to_array(self) -> [f64; 2] {
        [self.gear as f64, self.shift_rest]
    }

    /// What [`Self::to_array`] answered; what is no gear is the first.
    pub fn from_array([gear, shift_rest]: [f64; 2]) -> Self {
        let gear = if (0.0..=64.0).contains(&gear) { gear as usize } else { 1 };
        Self { gear, shift_rest }
    }
}

impl Output {
    /// The engine's share of one wheel, which rolls as `rolling` says.
    ///
    /// It gives all its torque up to a speed near that of the ground, so that wheels do not spin away and lose their side
    /// force.
    pub fn motor(&self, p: &VehicleParameters, wheel: Wheel, rolling: &Rolling) -> Motor {
        let max_torque = self.torque * p.drive.wheel_share(wheel.is_front(), p.differential.front_share);
        let ground = (rolling.speed * self.direction).max(0.0) + p.engine.traction_slip;
        let target = (ground / p.wheel_radius).min(self.limit);
        // A wheel that rolls towards +x turns about −z.
        motor(-self.direction * target, max_torque)
    }

    /// The clutch between the wheels of an axle.
    pub fn clutch(&self, p: &VehicleParameters, front: bool, dt: f64) -> Motor {
        let share = 2.0 * p.drive.wheel_share(front, p.differential.front_share);
        let max_torque = if share > 0.0 { p.differential.clutch(front, self.torque * share) } else { 0.0 };
        Motor { target_speed: 0.0, gain: CLUTCH_GAIN * p.wheel_inertia() / dt, max_torque }
    }
}

/// Full torque at a slip of [`MOTOR_BAND`], nothing at the target.
fn motor(target_speed: f64, max_torque: f64) -> Motor {
    Motor { target_speed, gain: max_torque / MOTOR_BAND, max_torque }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 30.0;

    #[test]
    fn it_shifts_up_and_down_and_drives_not_meanwhile() {
        let (p, mut train) = (VehicleParameters::default(), DriveTrain::default());
        let mut at = |speed: f64, seconds: f64| {
            let mut torques = Vec::new();
            for _ in 0..(seconds / DT).round() as usize {
                torques.push(train.drive(&p, 1.0, false, [speed, speed / p.wheel_radius], DT).torque);
            }
            (train.gear(), torques)
        };
        assert_eq!(at(5.0, 1.0).0, 1);
        let (gear, torques) = at(22.0, 1.0);
        assert_eq!(gear, 2);
        let lost: f64 = torques.iter().map(|t| 1.0 - t / torques[torques.len() - 1]).filter(|x| *x > 0.0).sum();
        assert!((lost * DT - p.gearbox.shift_time).abs() < 1e-9, "{lost} ticks without torque");
        assert_eq!(at(60.0, 3.0).0, 5);
        assert_eq!(at(0.0, 3.0).0, 1);
    }

    #[test]
    fn no_speed_makes_it_shift_to_and_fro() {
        let p = VehicleParameters::default();
        for speed in (0..600).map(|i| f64::from(i) * 0.1) {
            let mut train = DriveTrain::default();
            let mut gears = |ticks: usize| {
                (0..ticks)
                    .map(|_| {
                        train.drive(&p, 1.0, false, [speed, 0.0], DT);
                        train.gear()
                    })
                    .collect::<Vec<_>>()
            };
            gears(60);
            let last = gears(60);
            assert!(last.iter().all(|gear| *gear == last[0]), "{speed} m/s: {last:?}");
        }
    }

    #[test]
    fn what_is_no_memory_is_survived() {
        for wild in [f64::NAN, -3.0, 1e300] {
            let mut train = DriveTrain::from_array([wild, 0.0]);
            train.drive(&VehicleParameters::default(), 1.0, false, [0.0; 2], DT);
            assert_eq!(train.gear(), 1);
        }
    }
}
