//! Meshes of tetrahedra: made of boxes, and checked.

use glam::DVec3;

use crate::error::{SimError, require, require_vector};

/// Most nodes and most elements of a mesh.
pub const MESH_MAX: usize = 100_000;

/// An element is flat where its volume is below this fraction of the cube of its longest edge.
const FLATTEST: f64 = 1e-6;

/// Nodes and tetrahedra between them, in the body's frame, m.
#[derive(Clone, Debug, PartialEq)]
pub struct TetrahedralMesh {
    nodes: Vec<DVec3>,
    elements: Vec<[u32; 4]>,
}

impl TetrahedralMesh {
    /// A mesh of elements whose last three nodes turn counterclockwise seen from outside.
    ///
    /// # Errors
    /// [`SimError`] naming the first node or element that is not finite, names no node, is flat, or inside out, or a
    /// node that no element holds.
    pub fn new(nodes: Vec<DVec3>, elements: Vec<[u32; 4]>) -> Result<Self, SimError> {
        require((4..=MESH_MAX).contains(&nodes.len()), "nodes", nodes.len() as f64, "4 to 100000")?;
        require((1..=MESH_MAX).contains(&elements.len()), "elements", elements.len() as f64, "1 to 100000")?;
        nodes.iter().try_for_each(|&node| require_vector(node, "nodes"))?;
        let mut held = vec![false; nodes.len()];
        for (index, element) in elements.iter().enumerate() {
            check(&nodes, element).map_err(|what| SimError::Unusable { what }.of(format!("element {index}")))?;
            element.iter().for_each(|&node| held[node as usize] = true);
        }
        match held.iter().position(|held| !held) {
            Some(node) => Err(SimError::Unusable { what: "no element holds it" }.of(format!("node {node}"))),
            None => Ok(Self { nodes, elements }),
        }
    }

    /// A box from `min` to `max` cut into cells, five tetrahedra each. Neighbours are mirror images, so that their faces
    /// meet.
    ///
    /// Node (i, j, k) of the lattice has index i + (nx + 1) (j + (ny + 1) k).
    ///
    /// # Errors
    /// [`SimError`] where the box is empty or not finite, or the cells are none or too many.
    pub fn of_box(min: DVec3, max: DVec3, cells: [u32; 3]) -> Result<Self, SimError> {
        require_vector(min, "min")?;
        require_vector(max, "max")?;
        let thinnest = (max - min).min_element();
        require(thinnest > 0.0, "size of the box", thinnest, "above 0 m")?;
        let count: f64 = cells.iter().map(|&n| f64::from(n) + 1.0).product();
        let some = cells.iter().all(|&n| n > 0) && count <= MESH_MAX as f64 / 5.0;
        require(some, "nodes of the box", count, "1 cell or more each way, 20000 nodes or fewer")?;
        let [nx, ny, nz] = cells;
        let of_lattice = |i: u32, j: u32, k: u32| i + (nx + 1) * (j + (ny + 1) * k);
        let step = (max - min) / DVec3::new(f64::from(nx), f64::from(ny), f64::from(nz));
        let mut nodes = Vec::with_capacity(count as usize);
        let mut elements = Vec::new();
        for (i, j, k) in lattice([nx + 1, ny + 1, nz + 1]) {
            nodes.push(min + step * DVec3::new(f64::from(i), f64::from(j), f64::from(k)));
        }
        for (i, j, k) in lattice(cells) {
            let corner = |c: usize| of_lattice(i + (c as u32 & 1), j + (c as u32 >> 1 & 1), k + (c as u32 >> 2 & 1));
            let mirrored = (i + j + k) % 2 == 1;
            elements.extend(FIVE.map(|element| {
                // Mirrored in x: which turns an element inside out, and swapping two nodes turns it back.
                let [a, b, c, d] = element.map(|c| corner(if mirrored { c ^ 1 } else { c }));
                if mirrored { [a, c, b, d] } else { [a, b, c, d] }
            }));
        }
        Self::new(nodes, elements)
    }

    /// Places of the nodes, m.
    pub fn nodes(&self) -> &[DVec3] {
        &self.nodes
    }

    /// Nodes of every element.
    pub fn elements(&self) -> &[[u32; 4]] {
        &self.elements
    }

    /// Places of an element's nodes.
    pub fn corners(&self, element: usize) -> [DVec3; 4] {
        self.elements[element].map(|node| self.nodes[node as usize])
    }
}

/// A cube's corners, bit 0, 1, 2 for the upper x, y, z, as four tetrahedra cut off and the one that is left.
const FIVE: [[usize; 4]; 5] = [[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]];

fn lattice([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = (u32, u32, u32)> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j, k))))
}

/// What is wrong with an element.
fn check(nodes: &[DVec3], element: &[u32; 4]) -> Result<(), &'static str> {
    if element.iter().any(|&node| node as usize >= nodes.len()) {
        return Err("it names a node that does not exist");
    }
    is_upright(element.map(|node| nodes[node as usize]))
}

/// `Err` with what is wrong where corners are flat, mirrored or not finite.
pub(crate) fn is_upright([a, b, c, d]: [DVec3; 4]) -> Result<(), &'static str> {
    let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
    let edges = [b - a, c - a, d - a, c - b, d - b, d - c];
    let least = FLATTEST * edges.iter().map(|e| e.length()).fold(0.0, f64::max).powi(3);
    if volume > least {
        Ok(())
    } else if volume < -least {
        Err("it is inside out: swap two of its nodes")
    } else {
        Err("it is flat")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volumes(mesh: &TetrahedralMesh) -> Vec<f64> {
        (0..mesh.elements().len())
            .map(|e| {
                let [a, b, c, d] = mesh.corners(e);
                (b - a).cross(c - a).dot(d - a) / 6.0
            })
            .collect()
    }

    #[test]
    fn a_box_is_filled_and_its_cells_meet() {
        let size = DVec3::new(2.0, 0.6, 0.4);
        let mesh = TetrahedralMesh::of_box(DVec3::ONE, DVec3::ONE + size, [5, 3, 2]).unwrap();
        assert_eq!((mesh.nodes().len(), mesh.elements().len()), (6 * 4 * 3, 5 * 30));
        let volume: f64 = volumes(&mesh).iter().sum();
        assert!((volume - size.element_product()).abs() < 1e-12, "{volume}");
        // Every face has another element behind it, or lies on the surface.
        let mut faces = std::collections::BTreeMap::<Vec<u32>, u32>::new();
        for element in mesh.elements() {
            for out in 0..4 {
                let mut face: Vec<_> = (0..4).filter(|&i| i != out).map(|i| element[i]).collect();
                face.sort_unstable();
                *faces.entry(face).or_insert(0) += 1;
            }
        }
        let surface = faces.values().filter(|&&count| count == 1).count();
        assert!(faces.values().all(|&count| count <= 2));
        assert_eq!(surface, 2 * 2 * (5 * 3 + 3 * 2 + 5 * 2));
        let place = mesh.nodes()[1 + 6 * (2 + 4)];
        assert!((place - DVec3::ONE - DVec3::new(0.4, 0.4, 0.2)).length() < 1e-12);
    }

    #[test]
    fn what_is_no_mesh_is_named() {
        let cube = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [1, 1, 1]).unwrap();
        type Elements = Vec<[u32; 4]>;
        let with = |change: fn(&mut Vec<DVec3>, &mut Elements)| {
            let (mut nodes, mut elements) = (cube.nodes.clone(), cube.elements.clone());
            change(&mut nodes, &mut elements);
            TetrahedralMesh::new(nodes, elements).unwrap_err().to_string()
        };
        assert_eq!(with(|_, e| e[3].swap(0, 1)), "element 3: it is inside out: swap two of its nodes");
        assert_eq!(with(|_, e| e[2][1] = e[2][0]), "element 2: it is flat");
        assert_eq!(with(|_, e| e[4][0] = 8), "element 4: it names a node that does not exist");
        assert_eq!(with(|n, _| n.push(DVec3::ZERO)), "node 8: no element holds it");
        assert!(with(|n, _| n[0].x = f64::NAN).contains("nodes is NaN"));
        assert!(with(|_, e| e.clear()).contains("elements is 0"));
        assert!(TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ZERO, [1, 1, 1]).is_err());
        assert!(TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [1, 0, 1]).is_err());
        assert!(TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [u32::MAX; 3]).is_err());
    }
}
