//! What a driver, human or not, asks of a vehicle.

/// State of the controls; every number is a ratio.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Controls {
    /// 0 to 1.
    pub throttle: f64,
    /// 0 to 1.
    pub brake: f64,
    /// −1 (left) to 1 (right).
    pub steer: f64,
    /// The throttle drives backwards.
    pub reverse: bool,
    /// Blocks the rear wheels.
    pub handbrake: bool,
    /// Puts the vehicle back on its wheels where it is; acts when it becomes true.
    pub reset: bool,
    /// Pushes from behind as long as the tank lasts.
    pub boost: bool,
    /// Jumps; acts when it becomes true.
    pub jump: bool,
    /// Fires the weapon that is at hand.
    pub fire: bool,
    /// Takes the next weapon; acts when it becomes true.
    pub next_weapon: bool,
}

impl Controls {
    /// Throttle, brake and steering, and what is held besides as bits, the lowest first: reverse, handbrake, reset, boost,
    /// jump, fire, next weapon.
    pub fn of([throttle, brake, steer]: [f32; 3], buttons: u16) -> Self {
        let holds = |bit: u32| buttons >> bit & 1 == 1;
        Self {
            throttle: throttle.into(),
            brake: brake.into(),
            steer: steer.into(),
            reverse: holds(0),
            handbrake: holds(1),
            reset: holds(2),
            boost: holds(3),
            jump: holds(4),
            fire: holds(5),
            next_weapon: holds(6),
        }
    }

    /// The same controls with every number in its range; what is no number counts as released.
    pub fn in_range(self) -> Self {
        let ratio = |x: f64, least: f64| if x.is_nan() { 0.0 } else { x.clamp(least, 1.0) };
        Self {
            throttle: ratio(self.throttle, 0.0),
            brake: ratio(self.brake, 0.0),
            steer: ratio(self.steer, -1.0),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Controls;

    #[test]
    fn numbers_come_into_range() {
        let wild = Controls { throttle: f64::NAN, brake: f64::INFINITY, steer: -7.0, ..Controls::default() };
        let tame = Controls { throttle: 0.0, brake: 1.0, steer: -1.0, ..Controls::default() };
        assert_eq!(wild.in_range(), tame);
    }
}
