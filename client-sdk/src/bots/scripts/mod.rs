//! What bots do: one script a file.

mod chase;
mod circle;
mod wander;

use clap::ValueEnum;
use pita_protocol::message::Controls;

use super::{Body, View};

pub use chase::Chase;
pub use circle::Circle;
pub use wander::Wander;

/// Decides what one bot does.
pub trait Script: Send {
    /// Controls for the next tick, from what is known after `tick`. Called about once a tick; ticks may repeat or be
    /// left out as the network will have it.
    fn drive(&mut self, view: &View, tick: u64) -> Controls;
}

/// The scripts by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum ScriptKind {
    /// Drives in a circle.
    Circle,
    /// Drives to and fro around the place where it started, with random headings.
    Wander,
    /// Drives at the nearest other car, and away again once it has got there.
    Chase,
}

impl ScriptKind {
    /// A script of this kind. The same seed does the same in the same world.
    pub fn script(self, seed: u64) -> Box<dyn Script> {
        match self {
            Self::Circle => Box::new(Circle),
            Self::Wander => Box::new(Wander::new(seed)),
            Self::Chase => Box::new(Chase::new(seed)),
        }
    }

    /// Name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Wander => "wander",
            Self::Chase => "chase",
        }
    }
}

/// Full lock at this angle off the wanted heading, rad.
const FULL_LOCK_RAD: f32 = 0.7;

/// Controls that turn `own` to `heading` and hold `speed`, m/s.
fn towards(own: &Body, heading: f32, speed: f32) -> Controls {
    let turn = own.turn_to(heading);
    // A sharp turn at full speed ends on the roof.
    let allowed = if turn.abs() > FULL_LOCK_RAD { speed.min(5.0) } else { speed };
    Controls { steer: (-turn / FULL_LOCK_RAD).clamp(-1.0, 1.0), ..holding(own, allowed) }
}

/// Controls that hold `speed`, m/s, straight ahead.
fn holding(own: &Body, speed: f32) -> Controls {
    let missing = speed - own.speed();
    Controls {
        throttle: (0.15 + 0.3 * missing).clamp(0.0, 1.0),
        brake: (-0.2 * (missing + 2.0)).clamp(0.0, 1.0),
        ..Controls::default()
    }
}

#[cfg(test)]
mod tests;
