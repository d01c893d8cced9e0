//! The saw disc: a flat cylinder, thrown and spinning, that slides and bounces until it vanishes.

use std::f64::consts::FRAC_PI_2;

use pita_sim::{BodyId, Collider, DQuat, DVec3, Material, Phase, RigidBodyDesc, Shape, SimError, Surface, World};

use super::Muzzle;
use super::parameters::SawParameters;
use crate::actor::{Actor, ActorInfo, Contact, Partner, Response};
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
    /// Time until it vanishes, s.
    life: f64,
    /// Whom it begins to touch in this tick.
    cuts: Vec<u32>,
}

impl Saw {
    /// Asks for one in front of the vehicle.
    pub fn fire(step: &mut Step, p: &SawParameters, muzzle: Muzzle) {
        let p = p.clone();
        step.add(move |world, id| Ok(Box::new(Self::add(world, id, &p, &muzzle)?)));
    }

    fn add(world: &mut World, id: u32, p: &SawParameters, muzzle: &Muzzle) -> Result<Self, SimError> {
        let shape = Shape::Cylinder { half_length: HALF_THICKNESS, radius: RADIUS, rounding: 0.02 };
        let forward = muzzle.rotation * DVec3::X;
        let body = world.add_rigid_body(RigidBodyDesc {
            // Its own axis is z; it lies.
            rotation: muzzle.rotation * DQuat::from_rotation_x(-FRAC_PI_2),
            velocity: muzzle.velocity + forward * p.speed,
            angular_velocity: muzzle.rotation * DVec3::Y * p.spin,
            collider: Some(Collider::new(shape.clone(), Material { surface: SURFACE, ..Material::default() })),
            ..RigidBodyDesc::new(muzzle.position + forward * (2.0 * RADIUS), p.mass, shape.inertia(p.mass))
        })?;
        let parts = vec![PartInfo::new(world, body, shape)];
        let info = ActorInfo { id, kind: KIND, name: "saw".to_owned(), slot: None, parts };
        Ok(Self { info, body: [body], owner: muzzle.owner, damage: p.damage, life: p.life, cuts: Vec::new() })
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
        if let Partner::Actor { id, .. } = contact.partner
            && contact.phase == Phase::Begin
            && !self.cuts.contains(&id)
        {
            self.cuts.push(id);
        }
        Response::Collide
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        for victim in self.cuts.drain(..) {
            step.tell(victim, Message::Damage { amount: self.damage, by: Some(self.owner) });
        }
        self.life -= step.dt;
        if self.life <= 0.0 { super::end(step) } else { Ok(()) }
    }
}
