//! What a scene did, tick by tick: recorded once, then coded over as many links as one likes.

use std::ops::Range;

use pita_protocol::dof::{Group, Precision, State, kind, relative};
use pita_sim::SliceView;

/// A body at a tick.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Its id on the wire.
    pub id: u32,
    /// The body in whose frame it is coded, by its place in the tick.
    pub parent: Option<usize>,
    /// Whether it turns about its own z there.
    pub is_hinged: bool,
    /// Position, m, and quaternion x y z w.
    pub q: [f64; 7],
    /// m/s and rad/s.
    pub v: [f64; 6],
}

impl Placed {
    /// A particle or rigid body of the engine; nothing else is in these scenes.
    pub fn of(slice: &SliceView<'_>) -> Option<Self> {
        let (q, v) = (*slice.q.first_chunk::<7>()?, *slice.v.first_chunk::<6>()?);
        Some(Self { id: slice.serial, parent: None, is_hinged: false, q, v })
    }

    /// Whether it moves faster than 2 cm/s or turns faster than 0.05 rad/s.
    pub fn is_moving(&self) -> bool {
        let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        size(&self.v[..3]) > 0.02 || size(&self.v[3..]) > 0.05
    }
}

/// A scene's recording.
pub struct Trace {
    /// Ticks a second.
    pub tick_hz: u32,
    /// Steps of the stream.
    pub precision: Precision,
    /// All bodies of each tick, in order of id.
    pub ticks: Vec<Vec<Placed>>,
}

impl Trace {
    /// Mean number of bodies in motion, and the least.
    pub fn moving(&self) -> (f64, usize) {
        let counts = || self.ticks.iter().map(|bodies| bodies.iter().filter(|body| body.is_moving()).count());
        (counts().sum::<usize>() as f64 / self.ticks.len().max(1) as f64, counts().min().unwrap_or(0))
    }

    /// Those of the bodies of one tick in steps that are at the places `wanted`, which hold their parents too.
    pub fn quantise(&self, bodies: &[Placed], wanted: Range<usize>, into: &mut State) {
        into.clear();
        for body in &bodies[wanted] {
            let parent = body.parent.map(|parent| &bodies[parent]);
            let q = parent.map_or(body.q, |parent| relative(&parent.q, &body.q));
            let parent = parent.map(|parent| parent.id);
            let layout = [Group::Point, if body.is_hinged { Group::Hinge } else { Group::Rotation }];
            into.push(body.id, kind::RIGID_BODY, parent, &layout, &q).expect("bodies of an engine, in order of id");
        }
    }
}
