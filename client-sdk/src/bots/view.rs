//! What a script sees: its own car and the others, at one tick.

use glam::{Quat, Vec3};
use pita_protocol::dof::{Slice, kind};

use crate::{ReceivedSnapshot, Roster};

/// Kind of the actors that scripts take for cars.
pub(super) const VEHICLE: &str = "vehicle";

/// Root body of a car: x points forwards, y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Centre of mass, m.
    pub position: Vec3,
    /// Body to world.
    pub rotation: Quat,
    /// m/s.
    pub velocity: Vec3,
}

impl Body {
    fn of(slice: &Slice) -> Option<Self> {
        if slice.kind != kind::RIGID_BODY {
            return None;
        }
        let mut numbers = slice.q.iter().chain(&slice.v).copied();
        let mut next = || numbers.next();
        let position = Vec3::new(next()?, next()?, next()?);
        let rotation = Quat::from_xyzw(next()?, next()?, next()?, next()?).normalize();
        let velocity = Vec3::new(next()?, next()?, next()?);
        let rotation = if rotation.is_finite() { rotation } else { Quat::IDENTITY };
        Some(Self { position, rotation, velocity })
    }

    /// Where the car looks, unit vector.
    pub fn forward(&self) -> Vec3 {
        self.rotation * Vec3::X
    }

    /// Where its roof points, unit vector.
    pub fn up(&self) -> Vec3 {
        self.rotation * Vec3::Y
    }

    /// Speed forwards, m/s; negative backwards.
    pub fn speed(&self) -> f32 {
        self.velocity.dot(self.forward())
    }

    /// Horizontal direction in which it looks, rad from +x, positive towards −z: counter-clockwise seen from above.
    pub fn heading(&self) -> f32 {
        heading_of(self.forward())
    }

    /// Angle by which it has to turn to look along `heading`, −π to π rad, positive to the left.
    pub fn turn_to(&self, heading: f32) -> f32 {
        let turn = (heading - self.heading()).rem_euclid(std::f32::consts::TAU);
        if turn > std::f32::consts::PI { turn - std::f32::consts::TAU } else { turn }
    }

    /// Direction to `point`, as [`Self::heading`] counts it.
    pub fn heading_to(&self, point: Vec3) -> f32 {
        heading_of(point - self.position)
    }
}

fn heading_of(direction: Vec3) -> f32 {
    (-direction.z).atan2(direction.x)
}

/// One tick as one bot sees it.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The bot's own car.
    pub own: Body,
    actor: u32,
    snapshot: &'a ReceivedSnapshot,
    roster: &'a Roster,
}

impl<'a> View<'a> {
    /// What `snapshot` shows to the driver of `actor`; `None` where the actor is not in it.
    pub fn of(snapshot: &'a ReceivedSnapshot, roster: &'a Roster, actor: u32) -> Option<Self> {
        let root = roster.root_slice(actor)?;
        let own = snapshot.select(&[root]).first().and_then(Body::of)?;
        Some(Self { own, actor, snapshot, roster })
    }

    /// The other cars. Read from the snapshot when asked for.
    pub fn others(&self) -> Vec<Body> {
        let cars = self.roster.actors().filter(|actor| actor.kind == VEHICLE && actor.id != self.actor);
        let mut roots: Vec<u32> = cars.filter_map(|actor| Some(actor.parts.first()?.slice)).collect();
        roots.sort_unstable();
        let slices = self.snapshot.select(&roots);
        slices.iter().filter_map(Body::of).collect()
    }
}
