//! Shapes as an arena file writes them.

use glam::{DQuat, DVec3, EulerRot};
use pita_sim::Shape;
use serde::Deserialize;

use super::{ArenaError, Key};

/// Largest extent of a shape, m.
const SIZE_MAX: f64 = 5_000.0;
/// Smallest extent of a shape, m.
const SIZE_MIN: f64 = 0.02;

/// A shape, in the frame of what has it: `shape.box.half = [1, 2, 3]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeFile {
    /// Everything below the plane through the origin with the normal +y.
    HalfSpace {},
    /// Box.
    Box {
        /// Half extents, m.
        half: [f64; 3],
    },
    /// Ball.
    Ball {
        /// Radius, m.
        radius: f64,
    },
    /// Segment along x, spherically extruded.
    Capsule {
        /// Half length of the segment, m.
        half_length: f64,
        /// Radius, m.
        radius: f64,
    },
    /// Cylinder along z with rounded edges.
    Cylinder {
        /// Half length, m.
        half_length: f64,
        /// Radius, m.
        radius: f64,
        /// Radius of the edges, contained in the other two, at most 0.9 of each, m.
        #[serde(default)]
        rounding: f64,
    },
}

impl ShapeFile {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first size out of range, below `key`.
    pub fn check(&self, key: &Key) -> Result<(), ArenaError> {
        let size = |name: &str, value: f64| key.at(name).number(value, SIZE_MIN, SIZE_MAX, "m");
        match *self {
            Self::HalfSpace {} => Ok(()),
            Self::Box { half } => half
                .iter()
                .enumerate()
                .try_for_each(|(i, &h)| key.at("box.half").index(i).number(h, SIZE_MIN, SIZE_MAX, "m")),
            Self::Ball { radius } => size("ball.radius", radius),
            Self::Capsule { half_length, radius } => {
                size("capsule.half_length", half_length)?;
                size("capsule.radius", radius)
            }
            Self::Cylinder { half_length, radius, rounding } => {
                size("cylinder.half_length", half_length)?;
                size("cylinder.radius", radius)?;
                key.at("cylinder.rounding").number(rounding, 0.0, 0.9 * half_length.min(radius), "m")
            }
        }
    }

    /// Whether something movable can have this shape.
    pub fn is_bounded(&self) -> bool {
        !matches!(self, Self::HalfSpace {})
    }
}

impl From<&ShapeFile> for Shape {
    fn from(file: &ShapeFile) -> Self {
        match *file {
            ShapeFile::HalfSpace {} => Self::HalfSpace { normal: DVec3::Y },
            ShapeFile::Box { half } => Self::Box { half: DVec3::from_array(half) },
            ShapeFile::Ball { radius } => Self::Ball { radius },
            ShapeFile::Capsule { half_length, radius } => Self::Capsule { half_length, radius },
            ShapeFile::Cylinder { half_length, radius, rounding } => Self::Cylinder { half_length, radius, rounding },
        }
    }
}

/// Heading, slope and bank in degrees: `yaw` to the left about y, then `pitch` with +x up, then `roll` with +z down.
#[derive(Clone, Copy, Debug)]
pub struct Angles {
    /// About y, deg.
    pub yaw: f64,
    /// About the z that yaw leaves, deg.
    pub pitch: f64,
    /// About the x that pitch leaves, deg.
    pub roll: f64,
}

impl Angles {
    /// # Errors
    /// [`ArenaError::OutOfRange`] for an angle beyond a full turn, below `key`.
    pub fn check(&self, key: &Key) -> Result<(), ArenaError> {
        let angles = [("yaw", self.yaw), ("pitch", self.pitch), ("roll", self.roll)];
        angles.iter().try_for_each(|(name, angle)| key.at(name).number(*angle, -360.0, 360.0, "deg"))
    }

    /// As a rotation from the shape's frame to the world's.
    pub fn rotation(&self) -> DQuat {
        let [yaw, pitch, roll] = [self.yaw, self.pitch, self.roll].map(f64::to_radians);
        DQuat::from_euler(EulerRot::YZX, yaw, pitch, roll)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_turn_as_documented() {
        let turn = |yaw, pitch, roll, v: DVec3| Angles { yaw, pitch, roll }.rotation() * v;
        assert!(turn(90.0, 0.0, 0.0, DVec3::X).distance(DVec3::NEG_Z) < 1e-12, "yaw turns left");
        assert!(turn(0.0, 10.0, 0.0, DVec3::X).y > 0.17, "pitch lifts +x");
        assert!(turn(0.0, 0.0, 10.0, DVec3::Z).y < -0.17, "roll lowers +z");
        assert!(turn(90.0, 10.0, 0.0, DVec3::X).y > 0.17, "pitch comes after yaw");
    }
}
