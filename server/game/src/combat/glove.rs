//! The boxing glove: a ball on a slider at the front of a vehicle, driven by a compressed spring. The spring pushes the
//! vehicle back as hard as the victim.

use pita_sim::{
    Anchor, BodyId, Collider, DVec3, Material, RigidBodyDesc, Shape, SimError, SliderDesc, SpringDesc, World,
};

use super::Muzzle;
use super::parameters::GloveParameters;
use crate::actor::{Actor, ActorInfo, Contact, Partner, Response, WhenLost};
use crate::part::PartInfo;
use crate::step::{Message, Step};

/// [`ActorInfo::kind`].
pub const KIND: &str = "glove";

/// m.
const RADIUS: f64 = 0.3;

/// Length of the spring at the start, m.
const COMPRESSED: f64 = 0.7;

/// The least length of the spring, where something is right before the vehicle, m.
const SHORTEST: f64 = 0.1;

/// Damping ratio of the spring, as the glove alone would swing.
const DAMPING: f64 = 0.15;

/// It is drawn in after, s.
const LIFE: f64 = 0.6;

/// A glove that is out.
pub struct Glove {
    info: ActorInfo,
    body: [BodyId; 1],
    owner: u32,
    chassis: BodyId,
    damage: f64,
    /// Where the spring is at rest, m before the chassis' origin.
    farthest: f64,
    /// Share of what is left to there that the spring would drive the glove in a tick if it did not slacken.
    push: f64,
    /// Farther from the vehicle it is left behind, m.
    leash: f64,
    age: f64,
    /// Whom it hit in this tick, and whom before.
    hit: Vec<u32>,
    told: usize,
}

impl Glove {
    /// Asks for one at the vehicle's front.
    pub fn fire(step: &mut Step, p: &GloveParameters, muzzle: Muzzle) {
        let p = p.clone();
        step.add(move |world, id| Ok(Box::new(Self::add(world, id, &p, &muzzle.now(world)?)?)));
    }

    fn add(world: &mut World, id: u32, p: &GloveParameters, muzzle: &Muzzle) -> Result<Self, SimError> {
        let shape = Shape::Ball { radius: RADIUS };
        let start = Self::start(world, muzzle, &shape)?;
        let body = world.add_rigid_body(RigidBodyDesc {
            rotation: muzzle.rotation,
            velocity: muzzle.velocity,
            collider: Some(Collider::new(shape.clone(), Material::from(0.5))),
            ..RigidBodyDesc::new(start, p.mass, shape.inertia(p.mass))
        })?;
        let hand = Anchor::body(body, DVec3::ZERO);
        world.add_slider(SliderDesc::new(Anchor::body(muzzle.chassis, muzzle.front), hand, DVec3::X))?;
        let root = muzzle.front - DVec3::X * (COMPRESSED - RADIUS);
        world.add_spring(SpringDesc {
            a: Anchor::body(muzzle.chassis, root),
            b: hand,
            rest_length: COMPRESSED + p.reach,
            stiffness: p.stiffness,
            damping: 2.0 * DAMPING * (p.stiffness * p.mass).sqrt(),
        })?;
        let parts = vec![PartInfo::new(world, body, shape)];
        let glove = Self {
            info: ActorInfo { id, kind: KIND, name: "glove".to_owned(), slot: None, parts },
            body: [body],
            owner: muzzle.owner,
            chassis: muzzle.chassis,
            damage: p.damage,
            farthest: muzzle.front.x + RADIUS + p.reach,
            push: p.stiffness / p.mass * world.settings().dt.powi(2),
            leash: muzzle.front.length() + 2.0 * (COMPRESSED + p.reach),
            age: 0.0,
            hit: Vec::new(),
            told: 0,
        };
        glove.foresee(world)?;
        Ok(glove)
    }

    /// Right before the front, or as near as what is there allows, not farther back than the spring's other end.
    fn start(world: &World, muzzle: &Muzzle, shape: &Shape) -> Result<DVec3, SimError> {
        muzzle.way_out(world, (shape, muzzle.rotation), [RADIUS - COMPRESSED + SHORTEST, RADIUS], RADIUS)
    }

    /// Lets detection know how the spring is about to drive the glove: at most as far as it does within a tick from here.
    fn foresee(&self, world: &mut World) -> Result<(), SimError> {
        let places = [self.body[0], self.chassis].map(|body| world.position(body));
        let ([Some(glove), Some(chassis)], Some(rotation)) = (places, world.rotation(self.chassis)) else {
            return Ok(());
        };
        let along = rotation * DVec3::X;
        let ahead = self.farthest - (glove - chassis).dot(along);
        let share = self.push / (1.0 + self.push);
        world.set_surge(self.body[0], along * (ahead.max(0.0) * share / world.settings().dt))
    }

    fn is_left_behind(&self, world: &World) -> bool {
        let [glove, chassis] = [self.body[0], self.chassis].map(|body| world.position(body));
        let (Some(glove), Some(chassis)) = (glove, chassis) else { return true };
        glove.distance(chassis) > self.leash
    }
}

impl Actor for Glove {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.body
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        match contact.partner {
            Partner::Actor { id, .. } if id == self.owner => return Response::Pass,
            // Who is only near may be behind a wall.
            Partner::Actor { id, .. } if contact.impulse > 0.0 && !self.hit.contains(&id) => self.hit.push(id),
            _ => {}
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        for &victim in &self.hit[self.told..] {
            step.tell(victim, Message::Damage { amount: self.damage, by: Some(self.owner) });
        }
        self.told = self.hit.len();
        if self.age > LIFE || self.is_left_behind(step.world) {
            return super::end(step);
        }
        self.age += step.dt;
        self.foresee(step.world)
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Expire
    }
}
