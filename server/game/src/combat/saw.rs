//! The saw disc: a flat cylinder, thrown and spinning, that slides and bounces until it vanishes.

use std::f64::consts::FRAC_PI_2;

use pita_sim::{BodyId, Collider, DQuat, DVec3, Material, Phase, RigidBodyDesc, Shape, SimError, Surface, World};

use super::parameters::SawParameters;
use super::{Muzzle, Release};
use crate::actor::{Actor, ActorInfo, Contact, Partner, Response, WhenLost};
use crate::part::PartInfo;
use crate::step::{Message, Step};

/// [`ActorInfo::kind`].
pub const KIND: &str = "saw";

/// m.
const RADIUS: f64 = 0.35;

/// m.
const HALF_THICKNESS: f64 = 0.05;

/// What its rim is like: it slides, and it bounces.
const SURFACE: Surface =
    Surface { friction: 0.05, restitution: 0.6, rolling_resistance: 0.0, spinning_resistance: 0.0 };

/// A disc on its way.
pub struct Saw {
    info: ActorInfo,
    body: [BodyId; 1],
    owner: u32,
    damage: f64,
    release: Release,
    /// Time until it vanishes, s.
    life: f64,
    /// Who is near in this tick.
    near: Vec<u32>,
    /// Whom it cut and is still near; the first ones know of it.
    cut: Vec<u32>,
    told: usize,
}

impl Saw {
    /// Asks for one in front of the vehicle.
    pub fn fire(step: &mut Step, p: &SawParameters, muzzle: Muzzle) {
        let p = p.clone();
        step.add(move |world, id| Ok(Box::new(Self::add(world, id, &p, &muzzle.now(world)?)?)));
    }

    fn add(world: &mut World, id: u32, p: &SawParameters, muzzle: &Muzzle) -> Result<Self, SimError> {
        let shape = Shape::Cylinder { half_length: HALF_THICKNESS, radius: RADIUS, rounding: 0.02 };
        let forward = muzzle.rotation * DVec3::X;
        // Its own axis is z; it lies.
        let rotation = muzzle.rotation * DQuat::from_rotation_x(-FRAC_PI_2);
        let start = muzzle.throw(world, (&shape, rotation), RADIUS)?;
        let body = world.add_rigid_body(RigidBodyDesc {
            rotation,
            velocity: muzzle.velocity + forward * p.speed,
            angular_velocity: muzzle.rotation * DVec3::Y * p.spin,
            collider: Some(Collider::new(shape.clone(), Material { surface: SURFACE, ..Material::default() })),
            ..RigidBodyDesc::new(start, p.mass, shape.inertia(p.mass))
        })?;
        let parts = vec![PartInfo::new(world, body, shape)];
        let info = ActorInfo { id, kind: KIND, name: "saw".to_owned(), slot: None, parts };
        Ok(Self {
            info,
            body: [body],
            owner: muzzle.owner,
            damage: p.damage,
            release: Release::default(),
            life: p.life,
            near: Vec::new(),
            cut: Vec::new(),
            told: 0,
        })
    }
}

impl Actor for Saw {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.body
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        let Partner::Actor { id, .. } = contact.partner else { return Response::Collide };
        if id == self.owner && self.release.meet() == Response::Pass {
            return Response::Pass;
        }
        if contact.phase != Phase::End {
            self.near.push(id);
        }
        // Who is only near may be behind a wall.
        if contact.impulse > 0.0 && !self.cut.contains(&id) {
            self.cut.push(id);
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        self.release.step();
        for &victim in &self.cut[self.told..] {
            step.tell(victim, Message::Damage { amount: self.damage, by: Some(self.owner) });
        }
        self.cut.retain(|victim| self.near.contains(victim));
        self.told = self.cut.len();
        self.near.clear();
        if self.life <= 0.0 {
            return super::end(step);
        }
        self.life -= step.dt;
        Ok(())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Expire
    }
}
