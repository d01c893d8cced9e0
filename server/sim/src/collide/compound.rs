//! Compounds: several shapes on one rigid body, with the mass properties of all.
//!
//! Owns what a compound is made of and where its principal axes lie. The world makes bodies of compounds; detection sees
//! each piece as a collider of its own.

use glam::{DQuat, DVec3};

use super::shape::Collider;
use crate::dof::{Pose, RigidBodyDesc};
use crate::error::{LARGEST, SimError, require, require_rotation, require_vector};
use crate::mass::{Density, MassProperties};

/// Most pieces of a compound.
pub const PIECES_MAX: usize = 256;

/// A shape of a compound.
#[derive(Clone, Debug)]
pub struct Piece {
    /// What it collides with.
    pub collider: Collider,
    /// Where the shape's origin is in the compound's frame, m.
    pub position: DVec3,
    /// Shape to compound.
    pub rotation: DQuat,
    /// kg/m³, 0 or above: a piece of density 0 collides and weighs nothing.
    pub density: f64,
}

impl Piece {
    /// A piece that is not turned.
    pub fn new(collider: Collider, position: DVec3, density: f64) -> Self {
        Self { collider, position, rotation: DQuat::IDENTITY, density }
    }
}

/// Several shapes on one rigid body. Pieces do not collide with each other; where they overlap, both weigh.
#[derive(Clone, Debug)]
pub struct Compound {
    /// In the body's axes: from the centre of mass, along principal axes.
    pieces: Vec<Piece>,
    mass: MassProperties,
    inertia: DVec3,
    /// Principal axes to the compound's.
    axes: DQuat,
}

impl Compound {
    /// A compound of 1 to 256 pieces, given in a frame of the author's.
    ///
    /// # Errors
    /// [`SimError`] naming the piece and what of it is out of range; where no piece weighs anything, or their mass lies on
    /// a line.
    pub fn new(pieces: Vec<Piece>) -> Result<Self, SimError> {
        let count = pieces.len();
        require((1..=PIECES_MAX).contains(&count), "pieces", count as f64, "1 to 256")?;
        let mut solids = Vec::new();
        for (index, piece) in pieces.iter().enumerate() {
            solids.extend(piece.solid().map_err(|reason| reason.of(format!("piece {index}")))?);
        }
        if solids.is_empty() {
            return Err(SimError::Unusable { what: "a compound of pieces of density 0 has no mass" });
        }
        let mass = MassProperties::combined(solids)?;
        let (inertia, axes) = mass.principal();
        let to_body = axes.inverse();
        let seen_from_body = |piece: Piece| Piece {
            position: to_body * (piece.position - mass.centre),
            rotation: (to_body * piece.rotation).normalize(),
            ..piece
        };
        Ok(Self { pieces: pieces.into_iter().map(seen_from_body).collect(), mass, inertia, axes })
    }

    /// The same, every density multiplied such that the whole weighs `mass` kg.
    ///
    /// # Errors
    /// [`SimError`] where `mass` is out of range.
    pub fn weighing(self, mass: f64) -> Result<Self, SimError> {
        let scaled = self.mass.scaled_to(mass)?;
        Ok(Self { inertia: self.inertia * (mass / self.mass.mass), mass: scaled, ..self })
    }

    /// Of the whole, in the compound's frame.
    pub fn mass_properties(&self) -> MassProperties {
        self.mass
    }

    /// A point of the compound's frame in the body's, whose origin is the centre of mass and whose axes are principal:
    /// where to put an anchor, m.
    pub fn to_body(&self, point: DVec3) -> DVec3 {
        self.axes.inverse() * (point - self.mass.centre)
    }

    /// A body at rest whose compound's frame stands at `position`, turned by `rotation`; it has no collider yet:
    /// [`World::add_compound`](crate::World::add_compound) adds the pieces.
    pub fn desc(&self, position: DVec3, rotation: DQuat) -> RigidBodyDesc {
        let desc = RigidBodyDesc::new(position + rotation * self.mass.centre, self.mass.mass, self.inertia);
        RigidBodyDesc { rotation: (rotation * self.axes).normalize(), ..desc }
    }

    /// The pieces with their places on the body.
    pub(crate) fn placed(&self) -> impl Iterator<Item = (Collider, Pose)> + '_ {
        let place = |piece: &Piece| Pose { position: piece.position, rotation: piece.rotation };
        self.pieces.iter().map(move |piece| (piece.collider.clone(), place(piece)))
    }
}

impl Piece {
    /// Its mass in the compound's frame, where it has any.
    fn solid(&self) -> Result<Option<MassProperties>, SimError> {
        self.collider.validate_moving()?;
        require_vector(self.position, "position")?;
        require_rotation(self.rotation, "rotation")?;
        require((0.0..LARGEST).contains(&self.density), "density", self.density, "0 to below 1e9 kg/m³")?;
        if self.density == 0.0 {
            return Ok(None);
        }
        let solid = self.collider.shape().mass_properties(Density::constant(self.density))?;
        Ok(Some(solid.moved(self.position, self.rotation.normalize())))
    }
}
