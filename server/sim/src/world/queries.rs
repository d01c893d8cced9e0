//! Questions of logic and AI: rays, volumes, what is nearest. They see the world as the last stage 2 saw it.

use glam::{DQuat, DVec3};

use super::World;
use crate::collide::{Bodies, Collider, CollisionObject, Nearest, QueryFilter, RayHit, Shape};
use crate::dof::{BodyId, Pose, Twist};
use crate::error::{LARGEST, SimError, require, require_direction, require_rotation, require_vector};

impl World {
    /// The first thing that a ray from `origin` along `direction` hits within `length` metres. Of several at the same
    /// distance it is the one that was added first, bodies before static geometry.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range.
    pub fn ray_cast(
        &self,
        origin: DVec3,
        direction: DVec3,
        length: f64,
        filter: &QueryFilter,
    ) -> Result<Option<RayHit>, SimError> {
        require_vector(origin, "origin")?;
        require_direction(direction, "direction")?;
        require((0.0..LARGEST).contains(&length), "length", length, "0 to below 1e9 m")?;
        Ok(self.detector.ray_cast(self.looked_up(), [origin, direction.normalize()], length, filter))
    }

    /// Everything that overlaps a shape: bodies, each once, then static geometry, both in the order in which they were
    /// added.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, or a half-space.
    pub fn overlap(
        &self,
        shape: &Shape,
        position: DVec3,
        rotation: DQuat,
        filter: &QueryFilter,
    ) -> Result<Vec<CollisionObject>, SimError> {
        require_vector(position, "position")?;
        require_rotation(rotation, "rotation")?;
        let collider = Collider::new(shape.clone(), 0.0);
        collider.validate_moving()?;
        let pose = Pose { position, rotation: rotation.normalize() };
        Ok(self.detector.overlap(self.looked_up(), (&collider, pose), filter))
    }

    /// Whether a rigid body would overlap static geometry with its centre of mass at `position`, turned as it is. It is not
    /// about sensors, and allocates nothing once warm.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range, a body that is gone, or a figure.
    pub fn meets_static(&mut self, id: BodyId, position: DVec3) -> Result<bool, SimError> {
        require_vector(position, "position")?;
        let body = self.bodies.get(id).ok_or(SimError::Gone { what: "body" })?;
        if body.figure.is_some() {
            return Err(SimError::Unusable { what: "a figure has no pose to look from" });
        }
        let pose = Pose { position, ..body.pose(&self.state) };
        let colliders = self.collider_range(id);
        let (bodies, detector) = (Bodies { bodies: &self.bodies, state: &self.state }, &mut self.detector);
        Ok(self.placed[colliders].iter().any(|placed| {
            let (pose, _) = placed.carried(pose, Twist::REST);
            bodies.collider(placed).is_some_and(|collider| detector.meets_static(bodies, collider, pose))
        }))
    }

    /// What is nearest to a point and not farther than `within` metres; of several at the same distance, as with rays.
    ///
    /// # Errors
    /// [`SimError`] for a value out of range.
    pub fn nearest(&self, point: DVec3, within: f64, filter: &QueryFilter) -> Result<Option<Nearest>, SimError> {
        require_vector(point, "point")?;
        require((0.0..LARGEST).contains(&within), "within", within, "0 to below 1e9 m")?;
        Ok(self.detector.nearest(self.looked_up(), point, within, filter))
    }

    fn looked_up(&self) -> Bodies<'_> {
        Bodies { bodies: &self.bodies, state: &self.state }
    }
}
