//! Meshes of an arena: files beside its own, read through the caller.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use pita_sim::collide::TriangleMesh;
use pita_sim::geometry::Geometry;

use super::{ArenaError, ArenaFile, Key, WarpFile};
use crate::free_form;

/// Most triangles of an arena: the description that clients join with has a hull for each, and 2 MiB for all.
const TRIANGLES_MAX: usize = 16_384;

/// Longest name of a file, bytes.
const NAME_MAX: usize = 128;

impl ArenaFile {
    /// Names of the files that its statics are made of, each once.
    pub fn mesh_names(&self) -> BTreeSet<&str> {
        self.statics.iter().filter_map(|piece| piece.mesh.as_deref()).collect()
    }

    /// Reads the meshes of statics, each file once. `read` answers the bytes of a file in the folder of the arena's file, or why not.
    ///
    /// # Errors
    /// [`ArenaError`] naming the static, the file and what is wrong with it.
    pub fn read_meshes(&mut self, read: impl Fn(&str) -> Result<Vec<u8>, String>) -> Result<(), ArenaError> {
        let mut triangles = 0;
        let mut known: BTreeMap<String, Arc<TriangleMesh>> = BTreeMap::new();
        for (i, piece) in self.statics.iter_mut().enumerate() {
            let copies = piece.block().count();
            let Some(name) = &piece.mesh else { continue };
            let key = Key::new("statics").index(i).at("mesh");
            let plain = match known.get(name) {
                Some(surface) => surface.clone(),
                None => known.entry(name.clone()).or_insert(surface(&key, name, &read)?).clone(),
            };
            let surface = match piece.warp {
                Some(warp) => warped(&key, &plain, warp)?,
                None => plain,
            };
            triangles += copies * surface.triangles().len();
            key.count(triangles, 1, TRIANGLES_MAX, "triangles, those of copies and earlier meshes included")?;
            piece.surface = Some(surface);
        }
        Ok(())
    }
}

/// The surface in the file `name`, which the static at `key` is made of.
fn surface(
    key: &Key,
    name: &str,
    read: impl Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Arc<TriangleMesh>, ArenaError> {
    let bytes = read(name).map_err(|reason| key.refuse(name, &format!("a readable file ({reason})")))?;
    let surface = Geometry::from_file(name, &bytes).and_then(|geometry| geometry.surface());
    surface.map(Arc::new).map_err(|source| ArenaError::Engine { key: format!("{key}, {name}"), source })
}

/// The surface of the static at `key` with its points deformed.
fn warped(key: &Key, plain: &TriangleMesh, warp: WarpFile) -> Result<Arc<TriangleMesh>, ArenaError> {
    let mut points = plain.vertices().to_vec();
    let lowest = points.iter().map(|point| point.y).fold(f64::INFINITY, f64::min);
    free_form::deform(&warp.free_form(lowest), &mut points);
    let surface = TriangleMesh::new(&points, plain.triangles());
    surface.map(Arc::new).map_err(|source| ArenaError::Engine { key: format!("{key}, warped"), source })
}

/// `Err` unless `name` leads to nowhere but the arena's folder and those below it.
pub(super) fn check_name(key: &Key, name: &str) -> Result<(), ArenaError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    let inside = name.split('/').all(|part| !part.is_empty() && !part.starts_with('.'));
    let fits = name.len() <= NAME_MAX && name.chars().all(allowed) && inside;
    key.require(
        fits,
        name,
        "a path below the arena's folder: 1 to 128 of a-z A-Z 0-9 - _ . /, no part begins with a dot",
    )
}
