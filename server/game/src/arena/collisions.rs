//! Collisions come before the actors that have them, in the order in which the engine tells of them.

use pita_sim::{Collision, CollisionObject, CollisionSide, DVec3};

use super::Arena;
use crate::actor::{Contact, ContactSide, Partner, Response};

/// What counts as a kerb, m: no higher than this above what a body rolls on.
const KERB: f64 = 0.15;

/// So often it is asked whether there is room, m: no farther apart than a wheel is long.
const SAMPLE: f64 = 0.3;

/// Most times that it is asked: what is faster, 270 m/s at 30 Hz, rolls over nothing.
const SAMPLES_MAX: f64 = 30.0;

impl Arena {
    /// Stage 3: both actors of every collision judge it; where one of them lets it pass, it passes.
    pub(super) fn judge_collisions(&mut self) {
        let mut collisions = std::mem::take(&mut self.collisions);
        collisions.clear();
        collisions.extend(self.world.collisions());
        for collision in &collisions {
            // Both are asked: hearing of a collision is the actor's only way to know of it.
            let answers = [self.ask(collision, 0), self.ask(collision, 1)];
            let mut rolls_over = |side: usize| answers[side] == Response::RollOver && self.rolls_over(collision, side);
            if answers.contains(&Response::Pass) || rolls_over(0) || rolls_over(1) {
                self.world.cancel_collision(collision.id);
            }
        }
        self.collisions = collisions;
    }

    /// Asks the actor of one side.
    fn ask(&mut self, collision: &Collision, own: usize) -> Response {
        let [own_side, other_side] = [collision.sides[own], collision.sides[1 - own]];
        let CollisionObject::Body(body) = own_side.object else { return Response::Collide };
        let partner = self.partner(&other_side);
        let owner = self.owners.get(&body);
        let (Some(partner), Some(owner)) = (partner, owner) else { return Response::Collide };
        let side = |side: CollisionSide| ContactSide {
            body: match side.object {
                CollisionObject::Body(body) => Some(body),
                CollisionObject::Static(_) => None,
            },
            material: self.materials.name(side.material),
            is_sensor: side.is_sensor,
        };
        let Collision { phase, point, normal, gap, approach_speed, impulse, .. } = *collision;
        let normal = if own == 0 { normal } else { -normal };
        let (own, other) = (side(own_side), side(other_side));
        let contact = Contact { phase, own, other, partner, point, normal, gap, approach_speed, impulse };
        self.actors.get_mut(owner).map_or(Response::Collide, |actor| actor.collide(&contact))
    }

    /// Whether a body rolls over what it is about to hit: it has room all along its way, as far above it as a kerb is high.
    /// The plane of the contact, which is that of the start of the tick, would be a ramp that lifts a fast wheel higher than
    /// that, and a wall to a faster one. What the wheel is in when the tick is over lifts it out.
    fn rolls_over(&mut self, collision: &Collision, own: usize) -> bool {
        let sides = [collision.sides[own], collision.sides[1 - own]].map(|side| side.object);
        let [CollisionObject::Body(body), CollisionObject::Static(_)] = sides else { return false };
        let towards = if own == 0 { collision.normal } else { -collision.normal };
        let (Some(position), Some(velocity)) = (self.world.position(body), self.world.velocity(body)) else {
            return false;
        };
        let way = velocity.with_y(0.0) * self.dt;
        let forward = way.dot(towards.with_y(0.0));
        let samples = (way.length() / SAMPLE).ceil().max(1.0);
        if towards.y > 0.0 || forward < KERB * (-towards.y).max(0.5) || samples > SAMPLES_MAX {
            return false;
        }
        (1..=samples as usize).all(|i| {
            let there = position + way * (i as f64 / samples) + DVec3::Y * KERB;
            self.world.meets_static(body, there) == Ok(false)
        })
    }

    /// Whom a side belongs to. Every body has an actor.
    fn partner(&self, side: &CollisionSide) -> Option<Partner> {
        match side.object {
            CollisionObject::Static(id) => Some(Partner::Ground(id)),
            CollisionObject::Body(body) => {
                let id = *self.owners.get(&body)?;
                let kind = self.actors.get(&id)?.describe().kind;
                Some(Partner::Actor { id, kind })
            }
        }
    }
}
