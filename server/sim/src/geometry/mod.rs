//! Geometry as modelling programs write it: bytes in, vertices and triangles out.
//!
//! No files, no network: what is not in the bytes is refused by name. Everything is untrusted: counts are bounded, indices
//! checked, and an error names the item. What comes out becomes a static surface
//! ([`TriangleMesh`]) or convex parts for what moves.

mod convex_parts;
mod gltf;
mod obj;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::collide::{TRIANGLES_MAX, TriangleMesh};
use crate::error::{SimError, require};

pub use convex_parts::ConvexPartsDesc;

/// Largest file, bytes.
pub const FILE_MAX: usize = 64 << 20;

/// Vertices and triangles between them, m. Nothing of it is checked yet but that there are not too many.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Places.
    pub vertices: Vec<DVec3>,
    /// Indices of vertices, counterclockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Geometry {
    /// Reads a file by what its name ends with: `.obj`, `.gltf` or `.glb`.
    ///
    /// # Errors
    /// [`SimError`] for another ending, and as the readers.
    pub fn from_file(name: &str, bytes: &[u8]) -> Result<Self, SimError> {
        let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            "obj" => Self::from_obj(bytes),
            "gltf" | "glb" => Self::from_gltf(bytes),
            _ => Err(SimError::UnknownName {
                what: "ending of a geometry file",
                name: ending.chars().take(64).collect(),
                known: "obj, gltf, glb".to_owned(),
            }),
        }
    }

    /// As a static surface, with what was repaired.
    ///
    /// # Errors
    /// As [`TriangleMesh::new`].
    pub fn surface(&self) -> Result<TriangleMesh, SimError> {
        TriangleMesh::new(&self.vertices, &self.triangles)
    }

    /// Adds vertices and the triangles between them.
    fn add(
        &mut self,
        vertices: impl ExactSizeIterator<Item = DVec3>,
        triangles: impl Iterator<Item = [u32; 3]>,
    ) -> Result<(), SimError> {
        let first = self.vertices.len();
        let count = first + vertices.len();
        require(count <= TRIANGLES_MAX, "vertices", count as f64, "at most 1000000")?;
        self.vertices.extend(vertices);
        // A corner that names no vertex must not come to name one of the next piece.
        let place = |corner: u32| if (corner as usize) < count - first { corner + first as u32 } else { u32::MAX };
        for triangle in triangles {
            let count = self.triangles.len() + 1;
            require(count <= TRIANGLES_MAX, "triangles", count as f64, "at most 1000000")?;
            self.triangles.push(triangle.map(place));
        }
        Ok(())
    }
}

/// `Err` where a file is too large.
fn check_size(bytes: &[u8]) -> Result<(), SimError> {
    require(bytes.len() <= FILE_MAX, "length of the file", bytes.len() as f64, "at most 67108864 bytes")
}
