//! Static surfaces of triangles: meshes and height fields, checked and repaired.
//!
//! A surface is one-sided: triangles turn counterclockwise seen from where bodies are. What lies behind a triangle is not
//! pushed back by it.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TriMeshFlags, Triangle, TrianglePseudoNormals};

use crate::error::{SimError, require, require_vector};

/// Most triangles of a surface, and most vertices.
pub const TRIANGLES_MAX: usize = 1_000_000;

/// A triangle has no area where it is lower than this fraction of its longest side.
const FLATTEST: f64 = 1e-9;

/// A checked surface of triangles, m.
#[derive(Clone)]
pub struct TriangleMesh {
    surface: TriMesh,
    repairs: Repairs,
}

/// What was done to a surface, and what is odd about it and was left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Vertices at the very place of another one, merged with it.
    pub merged_vertices: usize,
    /// Triangles without area, dropped.
    pub flat_triangles: usize,
    /// Triangles between the same corners as another one, dropped.
    pub repeated_triangles: usize,
    /// Edges with one triangle only: the rim, and holes. Bodies can get through holes and around rims.
    pub open_edges: usize,
    /// Edges whose two triangles face opposite ways, or that have more than two.
    pub odd_edges: usize,
}

impl std::fmt::Display for Repairs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { merged_vertices, flat_triangles, repeated_triangles, open_edges, odd_edges } = self;
        write!(f, "merged {merged_vertices} vertices, dropped {flat_triangles} triangles without area and ")?;
        write!(f, "{repeated_triangles} repeated ones; {open_edges} edges are open, {odd_edges} are odd")
    }
}

impl std::fmt::Debug for TriangleMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TriangleMesh of {} triangles", self.surface.num_triangles())
    }
}

impl PartialEq for TriangleMesh {
    fn eq(&self, other: &Self) -> bool {
        self.surface.vertices() == other.surface.vertices() && self.surface.indices() == other.surface.indices()
    }
}

impl TriangleMesh {
    /// A surface of triangles between vertices.
    ///
    /// # Errors
    /// [`SimError`] naming the first vertex that is not finite or triangle that names no vertex; for too many of either,
    /// and where no triangle has an area.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, SimError> {
        require((3..=TRIANGLES_MAX).contains(&vertices.len()), "vertices", vertices.len() as f64, "3 to 1000000")?;
        require((1..=TRIANGLES_MAX).contains(&triangles.len()), "triangles", triangles.len() as f64, "1 to 1000000")?;
        for (index, &vertex) in vertices.iter().enumerate() {
            require_vector(vertex, "position").map_err(|reason| reason.of(format!("vertex {index}")))?;
        }
        for (index, triangle) in triangles.iter().enumerate() {
            if let Some(&corner) = triangle.iter().find(|&&corner| corner as usize >= vertices.len()) {
                let outside =
                    SimError::OutOfRange { what: "corner", value: f64::from(corner), allowed: "the index of a vertex" };
                return Err(outside.of(format!("triangle {index}")));
            }
        }
        let mut repairs = Repairs::default();
        let (vertices, places) = merged(vertices, &mut repairs);
        let triangles = triangles.iter().map(|triangle| triangle.map(|corner| places[corner as usize]));
        let triangles = sound(&vertices, triangles, &mut repairs);
        if triangles.is_empty() {
            return Err(SimError::Unusable { what: "no triangle of the surface has an area" });
        }
        count_edges(&triangles, &mut repairs);
        let surface = TriMesh::with_flags(vertices, triangles, TriMeshFlags::FIX_INTERNAL_EDGES);
        let surface = surface.map_err(|_| SimError::Unusable { what: "the triangles make no surface" })?;
        Ok(Self { surface, repairs })
    }

    /// A height field: `heights` of a grid of `columns` points along x, row by row along z, `spacing` apart both ways,
    /// from the origin on, m.
    ///
    /// # Errors
    /// [`SimError`] for fewer than two rows or columns, a row that is not full, a spacing that is not above 0, and a
    /// height that is not finite.
    pub fn of_height_field(heights: &[f64], columns: usize, spacing: f64) -> Result<Self, SimError> {
        require(spacing > 0.0 && spacing < 1e6, "spacing", spacing, "above 0, below 1e6 m")?;
        let rows = heights.len().checked_div(columns).unwrap_or(0);
        require(columns >= 2, "columns", columns as f64, "2 or more")?;
        let full = rows >= 2 && rows * columns == heights.len();
        require(full, "heights", heights.len() as f64, "two or more full rows of columns")?;
        require(heights.len() <= TRIANGLES_MAX / 2, "heights", heights.len() as f64, "at most 500000")?;
        let vertex = |(i, &height): (usize, &f64)| {
            DVec3::new((i % columns) as f64 * spacing, height, (i / columns) as f64 * spacing)
        };
        let vertices: Vec<_> = heights.iter().enumerate().map(vertex).collect();
        let cells = (0..rows - 1).flat_map(|row| (0..columns - 1).map(move |column| row * columns + column));
        let triangles: Vec<_> = cells
            .flat_map(|first| {
                let [a, b, c, d] = [first, first + 1, first + columns, first + columns + 1].map(|i| i as u32);
                [[a, c, b], [b, c, d]]
            })
            .collect();
        Self::new(&vertices, &triangles)
    }

    /// What was done to it.
    pub fn repairs(&self) -> Repairs {
        self.repairs
    }

    /// Its vertices, m.
    pub fn vertices(&self) -> &[DVec3] {
        self.surface.vertices()
    }

    /// Corners of its triangles, counterclockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.surface.indices()
    }

    /// How far a ray along the unit vector `direction` gets, m, and the normal of the surface there; from either side.
    pub(super) fn ray(&self, from: DVec3, direction: DVec3, length: f64) -> Option<(f64, DVec3)> {
        let hit = self.surface.cast_local_ray_and_get_normal(&Ray::new(from, direction), length, false)?;
        Some((hit.time_of_impact, hit.normal))
    }

    /// Triangles whose bounds meet a box, in an order that does not change; with the normals that their neighbours leave
    /// them.
    pub(super) fn in_box(&self, min: DVec3, max: DVec3) -> impl Iterator<Item = (Triangle, TrianglePseudoNormals)> {
        let bounds = Aabb::new(min, max);
        let found: Vec<u32> = self.surface.bvh().intersect_aabb(&bounds).collect();
        found.into_iter().filter_map(|i| Some((self.surface.triangle(i), self.surface.triangle_normal_constraints(i)?)))
    }
}

/// The places that differ, and which of them each vertex is at.
fn merged(vertices: &[DVec3], repairs: &mut Repairs) -> (Vec<DVec3>, Vec<u32>) {
    let mut known = BTreeMap::new();
    let mut kept = Vec::new();
    let places = vertices.iter().map(|&vertex| {
        // Adding 0 makes 0 of −0.
        let key = (vertex + DVec3::ZERO).to_array().map(f64::to_bits);
        *known.entry(key).or_insert_with(|| {
            kept.push(vertex);
            kept.len() as u32 - 1
        })
    });
    let places = places.collect();
    repairs.merged_vertices = vertices.len() - kept.len();
    (kept, places)
}

/// The triangles that have an area, each once.
fn sound(vertices: &[DVec3], triangles: impl Iterator<Item = [u32; 3]>, repairs: &mut Repairs) -> Vec<[u32; 3]> {
    let mut known = BTreeSet::new();
    let mut kept = Vec::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| vertices[corner as usize]);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let mut corners = triangle;
        corners.sort_unstable();
        if (b - a).cross(c - a).length() <= FLATTEST * longest {
            repairs.flat_triangles += 1;
        } else if known.insert(corners) {
            kept.push(triangle);
        } else {
            repairs.repeated_triangles += 1;
        }
    }
    kept
}

/// Counts what is odd about edges.
fn count_edges(triangles: &[[u32; 3]], repairs: &mut Repairs) {
    let mut edges = BTreeMap::<(u32, u32), [u32; 2]>::new();
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] += 1;
        }
    }
    repairs.open_edges = edges.values().filter(|ways| ways.iter().sum::<u32>() == 1).count();
    repairs.odd_edges = edges.values().filter(|ways| ways.iter().any(|&n| n > 1)).count();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_surface_is_repaired_and_told_or_refused_by_name() {
        let vertices = [DVec3::ZERO, DVec3::X, DVec3::Z, DVec3::X, DVec3::new(1.0, 0.0, 1.0)];
        let triangles = [[0, 2, 1], [2, 0, 1], [3, 2, 4], [0, 1, 3]];
        let mesh = TriangleMesh::new(&vertices, &triangles).unwrap();
        let expected =
            Repairs { merged_vertices: 1, flat_triangles: 1, repeated_triangles: 1, open_edges: 4, odd_edges: 0 };
        assert_eq!(mesh.repairs(), expected);
        assert_eq!(mesh.triangles().len(), 2);
        let error = |vertices: &[DVec3], triangles: &[[u32; 3]]| {
            TriangleMesh::new(vertices, triangles).unwrap_err().to_string()
        };
        let bad = [DVec3::ZERO, DVec3::NAN, DVec3::X];
        assert!(error(&bad, &[[0, 1, 2]]).starts_with("vertex 1: position is NaN"));
        assert_eq!(
            error(&vertices, &[[0, 2, 1], [0, 1, 9]]),
            "triangle 1: corner is 9, allowed is the index of a vertex"
        );
        assert!(error(&vertices, &[]).contains("triangles is 0"));
        assert!(error(&vertices, &[[0, 1, 3]]).contains("no triangle"));
        assert!(TriangleMesh::of_height_field(&[0.0; 7], 3, 1.0).is_err());
        assert!(TriangleMesh::of_height_field(&[0.0; 9], 0, 1.0).is_err());
        assert_eq!(TriangleMesh::of_height_field(&[0.0; 9], 3, 1.0).unwrap().triangles().len(), 8);
    }
}
