//! A deformation as numbers that can be animated, sent and drawn.

use glam::{DQuat, DVec2, DVec3};
use pita_sim::{RestShape, SimError};

use super::{Axis, FreeForm, deform};

/// A deformation about a vertical axis: its own degrees of freedom. It is nowhere singular, so that numbers between two
/// warps are a warp between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warp {
    /// Stretch along x, y and z.
    pub scale: DVec3,
    /// Turn about the axis with each metre along it, rad/m.
    pub twist: f64,
    /// Curvature of the axis towards x and z, rad/m.
    pub bend: DVec2,
}

impl Warp {
    /// How many numbers it is.
    pub const NUMBERS: usize = 6;

    /// Nothing is deformed.
    pub const NONE: Self = Self { scale: DVec3::ONE, twist: 0.0, bend: DVec2::ZERO };

    /// Scale x, y, z; twist; bend towards x, z.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let Self { scale, twist, bend } = *self;
        [scale.x, scale.y, scale.z, twist, bend.x, bend.y]
    }

    /// As [`Warp::numbers`] has them.
    pub fn of_numbers([x, y, z, twist, bend_x, bend_z]: [f64; Self::NUMBERS]) -> Self {
        Self { scale: DVec3::new(x, y, z), twist, bend: DVec2::new(bend_x, bend_z) }
    }

    /// Both at once: stretches multiply, twists and curvatures add.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        Self { scale: self.scale * other.scale, twist: self.twist + other.twist, bend: self.bend + other.bend }
    }

    /// The deformations, one after the other, of what stands on `base`, m.
    pub fn free_form(&self, base: DVec3) -> [FreeForm; 2] {
        let straight = RestShape { scale: self.scale, twist: self.twist, bend: 0.0 };
        let towards = DQuat::from_rotation_y(f64::atan2(-self.bend.y, self.bend.x));
        let bent = FreeForm::bend(Axis { base, rotation: towards }, self.bend.length());
        [FreeForm { axis: Axis::up_from(base), shape: straight }, bent]
    }

    /// What a lattice, whose nodes are DOF, is to be told so that it follows.
    ///
    /// # Errors
    /// [`SimError::Unusable`] where it bends towards z: a lattice's own axis bends towards x.
    pub fn rest_shape(&self) -> Result<RestShape, SimError> {
        if self.bend.y != 0.0 {
            return Err(SimError::Unusable { what: "a lattice bends towards its x alone" });
        }
        Ok(RestShape { scale: self.scale, twist: self.twist, bend: self.bend.x })
    }
}

impl Default for Warp {
    fn default() -> Self {
        Self::NONE
    }
}

/// How what is drawn of an actor is turned and deformed: with the place of its first part, all that is needed to draw it
/// from its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    /// Turn of the whole about its vertical axis, 0 to 2π.
    pub spin: f64,
    /// Its free-form deformation.
    pub warp: Warp,
    /// 0 where it is not there, 1 in full strength.
    pub strength: f64,
}

impl Appearance {
    /// As its mesh is.
    pub const PLAIN: Self = Self { spin: 0.0, warp: Warp::NONE, strength: 1.0 };

    /// How many numbers it is.
    pub const NUMBERS: usize = 9;

    /// Cosine and sine of the spin, strength; scale x, y, z; twist; bend towards x, z. Numbers between two of such lists
    /// are between them too, all the way round.
    pub fn numbers(&self) -> [f64; Self::NUMBERS] {
        let (sin, cos) = self.spin.sin_cos();
        let [x, y, z, twist, bend_x, bend_z] = self.warp.numbers();
        [cos, sin, self.strength, x, y, z, twist, bend_x, bend_z]
    }

    /// As [`Appearance::numbers`] has them.
    pub fn of_numbers([cos, sin, strength, warp @ ..]: [f64; Self::NUMBERS]) -> Self {
        let spin = f64::atan2(sin, cos).rem_euclid(std::f64::consts::TAU);
        Self { spin, warp: Warp::of_numbers(warp), strength }
    }

    /// Turns and deforms points of the mesh in place, and puts its origin to `base`, m.
    pub fn deform(&self, base: DVec3, points: &mut [DVec3]) {
        let spin = DQuat::from_rotation_y(self.spin);
        points.iter_mut().for_each(|point| *point = spin * *point);
        deform(&self.warp.free_form(DVec3::ZERO), points);
        points.iter_mut().for_each(|point| *point += base);
    }
}
