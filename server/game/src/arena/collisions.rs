//! Collisions come before the actors that have them, in the order in which the engine tells of them.

use pita_sim::{Collision, CollisionObject, CollisionSide};

use super::Arena;
use crate::actor::{Contact, ContactSide, Partner, Response};

impl Arena {
    /// Stage 3: both actors of every collision judge it; where one of them lets it pass, it passes.
    pub(super) fn judge_collisions(&mut self) {
        let mut collisions = std::mem::take(&mut self.collisions);
        collisions.clear();
        collisions.extend(self.world.collisions());
        for collision in &collisions {
            // Both are asked: hearing of a collision is the actor's only way to know of it.
            let answers = [self.ask(collision, 0), self.ask(collision, 1)];
            if answers.contains(&Response::Pass) {
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
