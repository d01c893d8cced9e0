//! What touches in the world: points with their forces, collisions of pairs with their phases, and the materials that
//! they are made of.

use super::World;
use crate::collide::{Bodies, Collision, CollisionId, ContactView, MaterialId, Partner, Surface};
use crate::dof::{BodyId, Placed};
use crate::error::SimError;

impl World {
    /// From the next detection on contacts of materials `a` and `b` are like `surface`, instead of what
    /// [`Surface::combined`] makes of both.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] for a coefficient that is.
    pub fn set_material_pair(&mut self, a: MaterialId, b: MaterialId, surface: Surface) -> Result<(), SimError> {
        surface.validate()?;
        self.detector.set_material_pair(a, b, surface);
        Ok(())
    }

    /// What collides in this tick, sensors and what has just parted included, in a stable order: as stage 2 found it, for
    /// stage 3 to judge.
    pub fn collisions(&self) -> impl Iterator<Item = Collision> + '_ {
        self.detector.collisions(|serial| {
            let placed = self.placed(serial)?;
            let bodies = Bodies { bodies: &self.bodies, state: &self.state };
            Some((placed.body, bodies.collider(placed)?))
        })
    }

    /// Lets the pair of a collision pass in this tick: it is not pushed apart. Answers whether the collision is of this
    /// tick.
    pub fn cancel_collision(&mut self, id: CollisionId) -> bool {
        self.detector.cancel(id)
    }

    /// Contact points of the last tick, in a stable order; none of sensors.
    pub fn contacts(&self) -> impl Iterator<Item = ContactView> + '_ {
        self.detector.contacts.iter().filter_map(|c| {
            let b = match c.b {
                Partner::Body(serial) => Some(self.body_of(serial)?),
                Partner::Static(_) => None,
            };
            let (point, normal, gap, normal_force) = (c.position, c.normal, c.gap, c.normal_force);
            Some(ContactView { a: self.body_of(c.a)?, b, point, normal, gap, normal_force })
        })
    }

    /// The body that a collider belongs to.
    fn body_of(&self, serial: u32) -> Option<BodyId> {
        Some(self.placed(serial)?.body)
    }

    /// A collider by its serial.
    fn placed(&self, serial: u32) -> Option<&Placed> {
        let place = self.placed.binary_search_by_key(&serial, |placed| placed.serial).ok()?;
        Some(&self.placed[place])
    }
}
