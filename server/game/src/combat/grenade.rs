//! The grenade: a ball that bursts. The blast pushes everything around away from its middle for one tick, by an impulse that
//! falls off with the square of what is left to its rim.

use pita_sim::{
    BodyId, Collider, CollisionObject, DQuat, DVec3, Material, PartPoint, QueryFilter, RigidBodyDesc, Shape, SimError,
    World,
};

use super::parameters::GrenadeParameters;
use super::{Muzzle, Release};
use crate::actor::{Actor, ActorInfo, Contact, Partner, Response, WhenLost};
use crate::part::PartInfo;
use crate::step::{Message, Step};

/// [`ActorInfo::kind`].
pub const KIND: &str = "grenade";

/// m.
const RADIUS: f64 = 0.2;

/// How much of its direction the blast lifts, so that what stands on the ground flies.
const LIFT: f64 = 0.5;

/// A grenade on its way.
pub struct Grenade {
    info: ActorInfo,
    body: [BodyId; 1],
    owner: u32,
    parameters: GrenadeParameters,
    release: Release,
    age: f64,
    has_hit: bool,
}

impl Grenade {
    /// Asks for one in front of the vehicle.
    pub fn fire(step: &mut Step, p: &GrenadeParameters, muzzle: Muzzle) {
        let p = p.clone();
        step.add(move |world, id| Ok(Box::new(Self::add(world, id, p, &muzzle.now(world)?)?)));
    }

    fn add(world: &mut World, id: u32, p: GrenadeParameters, muzzle: &Muzzle) -> Result<Self, SimError> {
        let shape = Shape::Ball { radius: RADIUS };
        let forward = muzzle.rotation * DVec3::X;
        let start = muzzle.throw(world, (&shape, DQuat::IDENTITY), RADIUS)?;
        let body = world.add_rigid_body(RigidBodyDesc {
            velocity: muzzle.velocity + forward * p.speed[0] + DVec3::Y * p.speed[1],
            collider: Some(Collider::new(shape.clone(), Material::from(0.5))),
            ..RigidBodyDesc::new(start, p.mass, shape.inertia(p.mass))
        })?;
        let parts = vec![PartInfo::new(world, body, shape)];
        let info = ActorInfo { id, kind: KIND, name: "grenade".to_owned(), slot: None, parts };
        Ok(Self {
            info,
            body: [body],
            owner: muzzle.owner,
            parameters: p,
            release: Release::default(),
            age: 0.0,
            has_hit: false,
        })
    }

    fn burst(&self, step: &mut Step) -> Result<(), SimError> {
        let Some(middle) = step.world.position(self.body[0]) else { return Ok(()) };
        let filter = QueryFilter { except: Some(self.body[0]), ..QueryFilter::ALL };
        let reach = Shape::Ball { radius: self.parameters.radius };
        for object in step.world.overlap(&reach, middle, DQuat::IDENTITY, &filter)? {
            if let CollisionObject::Body(body) = object {
                self.push(step, body, middle)?;
            }
        }
        step.effect("blast", middle, DVec3::Y, 1.0);
        Ok(())
    }

    /// Pushes one body for this tick, and harms the actor whose first body it is.
    fn push(&self, step: &mut Step, body: BodyId, middle: DVec3) -> Result<(), SimError> {
        let p = &self.parameters;
        let at = PartPoint { part: 0, point: DVec3::ZERO };
        let (Some(frame), Some(mass)) = (step.world.frame(body, at), step.world.mass(body)) else { return Ok(()) };
        let away = DVec3::from(frame.position) - middle;
        let left = (1.0 - away.length() / p.radius).max(0.0);
        let impulse = (mass * p.blast_speed).min(p.blast_impulse) * left * left;
        let direction = (away.normalize_or(DVec3::Y) + DVec3::Y * LIFT).normalize_or(DVec3::Y);
        step.world.apply_force_at(body, at, direction * (impulse / step.dt))?;
        if let Some(victim) = step.owner(body).filter(|other| other.body == body) {
            let amount = p.damage * left * left;
            step.tell(victim.id, Message::Damage { amount, by: Some(self.owner) });
        }
        Ok(())
    }
}

impl Actor for Grenade {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.body
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        match contact.partner {
            Partner::Actor { id, .. } if id == self.owner => self.release.meet(),
            Partner::Actor { kind: "vehicle", .. } => {
                // Who is only near may be behind a wall.
                self.has_hit |= contact.impulse > 0.0;
                Response::Collide
            }
            _ => Response::Collide,
        }
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        self.release.step();
        if self.age < self.parameters.fuse && !self.has_hit {
            // In its first step it has not moved yet.
            self.age += step.dt;
            return Ok(());
        }
        self.burst(step)?;
        super::end(step)
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Expire
    }
}
