//! The judge: figures of a trace, and whether it is accepted. The same for every engine.
//!
//! Owns the acceptance tests, which are the kit's. Times are not its business.

mod beam;
mod boxes;
mod figure;
mod linkages;
mod penetration;
mod single;
#[cfg(test)]
mod tests;

pub use figure::{Figure, Unit, three_digits};

use super::scene::{Content, Family};
use super::trace::{BodyState, Trace};

/// What is so far from the ground has blown up, m.
const FAR: f64 = 100.0;

/// Records of a second.
const SECOND: usize = 30;

/// What a trace is worth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Whether the scene's test is passed.
    pub accepted: bool,
    /// What went wrong altogether, where figures would not say it.
    pub failure: Option<&'static str>,
    /// What the test looked at, and what it reports besides.
    pub figures: Vec<Figure>,
}

impl Verdict {
    fn new(accepted: bool, figures: impl Into<Vec<Figure>>) -> Self {
        Self { accepted, failure: None, figures: figures.into() }
    }

    fn failed(failure: &'static str) -> Self {
        Self { failure: Some(failure), ..Self::default() }
    }

    /// The value of the figure with that key, SI.
    pub fn value(&self, key: &str) -> Option<f64> {
        Some(self.figures.iter().find(|figure| figure.key == key)?.value)
    }

    /// Figures on one line.
    pub fn text(&self) -> String {
        let figures = self.figures.iter().map(Figure::to_string);
        self.failure.map(str::to_owned).into_iter().chain(figures).collect::<Vec<_>>().join(", ")
    }
}

/// Judges the trace of a scene.
pub fn judge(content: &Content, trace: &Trace) -> Verdict {
    let (family, scene) = match content {
        Content::Beam(beam) => return beam::judge(beam, trace),
        Content::Rigid(family, scene) => (family, scene),
    };
    if !trace.iter().flatten().all(is_sane) {
        return Verdict::failed("blows up");
    }
    match family {
        Family::Pile => boxes::pile(scene, trace),
        Family::Stack => boxes::stack(scene, trace),
        Family::Sheep => linkages::sheep(scene, trace),
        Family::Chain => linkages::chain(scene, trace),
        Family::Cars => linkages::cars(scene, trace),
        Family::Spin => single::spin(scene, trace),
        Family::Stick => single::stick(scene, trace),
        Family::Slide => single::slide(scene, trace),
    }
}

fn is_sane(body: &BodyState) -> bool {
    let BodyState { position, rotation, velocity, angular_velocity } = body;
    rotation.is_finite()
        && [position, velocity, angular_velocity].iter().all(|v| v.is_finite())
        && position.y.abs() < FAR
}

/// Mean of `values`; NaN for none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / count
}

/// Largest of `values`; negative infinity for none.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

/// Mean speed of all bodies over the last second, m/s.
fn speed_at_the_end(trace: &Trace) -> f64 {
    mean(trace.last(SECOND).flatten().map(|body| body.velocity.length()))
}
