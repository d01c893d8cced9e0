//! Wavefront OBJ: vertices and faces; groups, normals, textures and materials are passed over.

use tobj::{LoadError, LoadOptions};

use super::{Geometry, check_size};
use crate::error::SimError;

impl Geometry {
    /// Reads an OBJ file. Faces with more than three corners are cut into fans.
    ///
    /// # Errors
    /// [`SimError`] naming what cannot be read, and for a file that is too large or has too much in it.
    pub fn from_obj(bytes: &[u8]) -> Result<Self, SimError> {
        check_size(bytes)?;
        let options = LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
        // Materials are in other files.
        let without_materials = |_: &std::path::Path| Err(LoadError::OpenFileFailed);
        let (models, _) = tobj::load_obj_buf(&mut &*bytes, &options, without_materials)
            .map_err(|error| SimError::Unusable { what: "it is no OBJ file" }.of(format!("OBJ: {error}")))?;
        let mut geometry = Self::default();
        for tobj::Model { mesh, .. } in &models {
            let (places, _) = mesh.positions.as_chunks::<3>();
            let (triangles, _) = mesh.indices.as_chunks::<3>();
            geometry.add(places.iter().map(|&place| place.into()), triangles.iter().copied())?;
        }
        Ok(geometry)
    }
}
