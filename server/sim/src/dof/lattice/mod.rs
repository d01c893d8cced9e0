//! Free-form lattice (talk, "FFD"): a body of any shape embedded in a lattice of elastic cells. Q = nodes of the lattice.
//!
//! A place in the body is the trilinear combination of its cell's eight nodes, so that the body's vertices, colliders and
//! mass follow few nodes, however fine its shape. The mass matrix is integrated over the part of the solid in each cell;
//! cells without any of it are left out. Parts are the cells that are left; points of parts are given in the body's frame
//! at rest.
//!
//! A cell is as stiff as the share of it that the solid fills, by Saint Venant-Kirchhoff at 2 × 2 × 2 Gauss points. Fewer
//! points leave cells without resistance against hourglass modes. Cells cannot bend, they shear, which n square ones
//! across a thickness makes too stiff by 1 / 2n²: a cantilever of 10 × 2 × 2 cells sags 0.89 of what beam theory says.
//! (Five tetrahedra in each of the same cells: 0.64, and they would not deform as the mass does.)
//!
//! Controls reshape the body at rest: see [`RestShape`]. A tornado bends, twists and stretches, and dynamics follows.
//!
//! The scheme and its decay are those of [finite elements](crate::dof::finite_elements).
//!
//! Owns kinematics, inertia and elasticity of such bodies; knows nothing of worlds and islands.

mod rest_shape;

use glam::{DMat3, DQuat, DVec3};

pub use rest_shape::RestShape;

use super::embedding::EmbeddedPoint;
use super::interface::{BlockSize, Columns, Dof, Inertia, LocalState, PartPoint, PointMasses};
use super::nodal::{Nodes, SharedMass, Slot, moved_by_nodes, require_damping, viscosity};
use super::{DofKind, Frame, Mount};
use crate::collide::{EmbeddedHull, Material};
use crate::error::{SimError, require, require_vector};
use crate::mass::{Density, Polyhedron, lattice_cell_mass, trilinear};
use crate::potential::elasticity::{Curvature, Elastic, Tangent};

/// Most cells of a lattice.
const CELLS_MAX: usize = 4096;

/// A cell is left out where the solid weighs less than this share of what would fill it: its nodes would be too light to
/// be held by anything.
const LEAST_SHARE: f64 = 1e-6;

/// Share of the solid's mass that may be left out so.
const SLIVERS: f64 = 1e-4;

/// Corners of a cell; bit 0, 1, 2 of a corner's index says whether it is at the upper x, y, z.
const CORNERS: usize = 8;

/// Numbers of a Gauss point among what is prepared: its volume, m³, and the gradients of eight shape functions, 1/m.
const GAUSS_NUMBERS: usize = 1 + 3 * CORNERS;

/// Mass matrix of a cell over its corners, kg.
type CellMass = [[f64; CORNERS]; CORNERS];

/// How a body is embedded.
#[derive(Clone, Debug)]
pub struct LatticeDesc {
    /// Lowest corner of the lattice in the body's frame, m.
    pub min: DVec3,
    /// Highest corner, m.
    pub max: DVec3,
    /// Cells along x, y and z.
    pub cells: [u32; 3],
    /// What fills the solid.
    pub material: Elastic,
    /// Of the solid.
    pub density: Density,
    /// Time constant of internal damping, s, as [`FiniteElements::damped`](crate::FiniteElements::damped) has it.
    pub damping: f64,
}

/// A body in a lattice.
#[derive(Clone, Debug)]
pub struct Lattice {
    desc: LatticeDesc,
    /// Size of a cell at rest, m.
    size: DVec3,
    cells: Vec<Cell>,
    /// Part of each cell of the whole lattice; none where the solid has nothing there.
    parts: Vec<Option<u32>>,
    nodes: Nodes,
}

/// A cell with something in it.
#[derive(Clone, Debug)]
struct Cell {
    nodes: [u32; CORNERS],
    /// Lowest corner at rest, m.
    min: DVec3,
    /// Share of the cell that the solid fills.
    filled: f64,
    /// Of corners (i, j) with i ≥ j, row by row.
    slots: [Slot; CORNERS * (CORNERS + 1) / 2],
}

impl Lattice {
    /// A solid in a lattice.
    ///
    /// # Errors
    /// [`SimError`] naming what is out of range; where the solid does not lie inside the lattice; and where its density
    /// is not above 0.
    pub fn new(solid: &Polyhedron, desc: LatticeDesc) -> Result<Self, SimError> {
        desc.validate()?;
        let size = (desc.max - desc.min) / desc.cell_counts();
        let nodes = Nodes::new(vec![], PointMasses::default());
        let mut lattice = Self { desc, size, cells: vec![], parts: vec![], nodes };
        let (rest, masses) = lattice.fill(solid)?;
        let mut shared = SharedMass::new(rest.len());
        lattice.cells.iter().zip(&masses).for_each(|(cell, mass)| shared.add(cell.nodes, mass));
        lattice.nodes = Nodes::new(rest, shared.finish());
        let whole = solid.mass_properties(lattice.desc.density)?.mass;
        let inside = lattice.nodes.masses.total() > (1.0 - SLIVERS) * whole;
        if !inside {
            return Err(SimError::Unusable { what: "the solid does not lie inside the lattice" });
        }
        for cell in &mut lattice.cells {
            let pairs = pairs().map(|(i, j)| Slot::between(&lattice.nodes.masses, cell.nodes[i], cell.nodes[j]));
            cell.slots.iter_mut().zip(pairs).for_each(|(slot, found)| *slot = found);
        }
        Ok(lattice)
    }

    /// Finds the cells that have something in them. Answers the places of their nodes, and their mass matrices.
    fn fill(&mut self, solid: &Polyhedron) -> Result<(Vec<DVec3>, Vec<CellMass>), SimError> {
        let [nx, ny, nz] = self.desc.cells;
        let counts = [nx + 1, ny + 1, nz + 1].map(|n| n as usize);
        let mut numbers = vec![None; counts.iter().product()];
        let (mut rest, mut masses) = (Vec::new(), Vec::new());
        for (i, j, k) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j, k)))) {
            let at = |corner: u32| {
                DVec3::new(f64::from(i + (corner & 1)), f64::from(j + (corner >> 1 & 1)), f64::from(k + (corner >> 2)))
            };
            let place = |corner: u32| self.desc.min + self.size * at(corner);
            let mass = lattice_cell_mass(place(0), place(7), solid, self.desc.density)?;
            let volume = lattice_cell_mass(place(0), place(7), solid, Density::constant(1.0))?;
            let filled = volume.as_flattened().iter().sum::<f64>() / self.size.element_product();
            let is_empty = filled < LEAST_SHARE;
            self.parts.push((!is_empty).then_some(self.cells.len() as u32));
            if is_empty {
                continue;
            }
            let nodes = std::array::from_fn(|corner| {
                let whole = at(corner as u32).as_uvec3();
                let number = whole.x as usize + counts[0] * (whole.y as usize + counts[1] * whole.z as usize);
                *numbers[number].get_or_insert_with(|| {
                    rest.push(place(corner as u32));
                    rest.len() as u32 - 1
                })
            });
            self.cells.push(Cell { nodes, min: place(0), filled, slots: [Slot::Nowhere; 36] });
            masses.push(mass);
        }
        if self.cells.is_empty() {
            return Err(SimError::Unusable { what: "the solid does not lie inside the lattice" });
        }
        Ok((rest, masses))
    }

    /// Q at rest.
    pub fn rest(&self) -> Vec<f64> {
        self.placed(DVec3::ZERO, DQuat::IDENTITY)
    }

    /// Q at rest, the body's frame turned about its origin and then moved.
    pub fn placed(&self, position: DVec3, rotation: DQuat) -> Vec<f64> {
        self.nodes.placed(position, rotation)
    }

    /// Q' at rest.
    pub fn still(&self) -> Vec<f64> {
        self.nodes.still()
    }

    /// A point of the body's frame as a material point: where to put a collider, a joint or a vertex. `None` outside of
    /// the cells that have something in them.
    pub fn at(&self, point: DVec3) -> Option<PartPoint> {
        let place = (point - self.desc.min) / self.size;
        let last = self.desc.cell_counts() - DVec3::ONE;
        // A point on the upper side belongs to the last cell; rounding must not put it outside.
        let within = place.cmpge(DVec3::splat(-1e-9)).all() && place.cmple(last + DVec3::splat(1.0 + 1e-9)).all();
        let cell = place.floor().clamp(DVec3::ZERO, last).as_uvec3();
        let [nx, ny, _] = self.desc.cells;
        let number = cell.x + nx * (cell.y + ny * cell.z);
        let part = self.parts.get(number as usize).copied().flatten().filter(|_| within)?;
        Some(PartPoint { part, point })
    }

    /// The hull of points of the body's frame: what the body, or a convex piece of it, collides with.
    ///
    /// # Errors
    /// [`SimError`] naming a point outside of the cells that have something in them.
    pub fn hull(&self, points: &[DVec3], radius: f64, material: impl Into<Material>) -> Result<EmbeddedHull, SimError> {
        let vertex = |(index, &point): (usize, &DVec3)| {
            let outside = SimError::Unusable { what: "it lies outside of the lattice's cells" };
            self.at(point).ok_or_else(|| outside.of(format!("point {index}")))
        };
        let vertices = points.iter().enumerate().map(vertex).collect::<Result<_, _>>()?;
        Ok(EmbeddedHull::new(vertices, radius, material))
    }

    fn embedded(&self, at: PartPoint) -> ([u32; CORNERS], EmbeddedPoint<CORNERS>) {
        let cell = &self.cells[at.part as usize];
        let place = (at.point - cell.min) / self.size;
        let gradients = trilinear_gradients(place).map(|g| g / self.size);
        (cell.nodes, EmbeddedPoint { weights: trilinear(place), gradients })
    }

    /// Appends volume and gradients of every Gauss point with the body's rest shape at `shape`. Answers whether no cell
    /// is inside out there.
    fn prepare_gauss_points(&self, shape: &RestShape, prepared: &mut Vec<f64>) -> bool {
        let middle = (self.desc.min + self.desc.max) / 2.0;
        let foot = DVec3::new(middle.x, self.desc.min.y, middle.z);
        let mut upright = true;
        for cell in &self.cells {
            let rest = cell.nodes.map(|node| foot + shape.map(self.nodes.rest[node as usize] - foot));
            for place in gauss_points() {
                let gradients = trilinear_gradients(place);
                let column = |k: usize| gradients.iter().zip(rest).map(|(g, node)| node * g[k]).sum();
                let jacobian = DMat3::from_cols(column(0), column(1), column(2));
                let volume = jacobian.determinant() / CORNERS as f64;
                upright &= volume > 0.0;
                let to_rest = jacobian.inverse().transpose();
                prepared.push(volume * cell.filled);
                prepared.extend(gradients.iter().flat_map(|&g| (to_rest * g).to_array()));
            }
        }
        upright
    }
}

impl LatticeDesc {
    fn cell_counts(&self) -> DVec3 {
        DVec3::from_array(self.cells.map(f64::from))
    }

    fn validate(&self) -> Result<(), SimError> {
        require_vector(self.min, "min of the lattice")?;
        require_vector(self.max, "max of the lattice")?;
        let thinnest = (self.max - self.min).min_element();
        require(thinnest > 0.0, "size of the lattice", thinnest, "above 0 m")?;
        let count = self.cell_counts().element_product();
        let some = self.cells.iter().all(|&n| n > 0) && count <= CELLS_MAX as f64;
        require(some, "cells of the lattice", count, "1 or more each way, 4096 or fewer")?;
        self.material.validate()?;
        require_damping(self.damping)
    }
}

/// What was prepared, Gauss point by Gauss point of a cell: volume and gradients.
fn gauss_of(prepared: &[f64], cell: usize) -> impl Iterator<Item = (f64, [DVec3; CORNERS])> + '_ {
    let start = cell * CORNERS * GAUSS_NUMBERS;
    prepared[start..start + CORNERS * GAUSS_NUMBERS]
        .chunks_exact(GAUSS_NUMBERS)
        .map(|numbers| (numbers[0], std::array::from_fn(|corner| DVec3::from_slice(&numbers[1 + 3 * corner..]))))
}

fn deformation(x: &[DVec3; CORNERS], gradients: &[DVec3; CORNERS]) -> DMat3 {
    let column = |k: usize| x.iter().zip(gradients).map(|(&x, g)| x * g[k]).sum();
    DMat3::from_cols(column(0), column(1), column(2))
}

impl Dof for Lattice {
    fn kind(&self) -> DofKind {
        DofKind::Lattice
    }

    moved_by_nodes!();

    fn parts(&self) -> u32 {
        self.cells.len() as u32
    }

    /// The numbers of a [`RestShape`].
    fn controls(&self) -> Vec<f64> {
        RestShape::default().numbers().to_vec()
    }

    fn check_controls(&self, controls: &[f64], _dt: f64) -> Result<(), SimError> {
        let shape = RestShape::of_numbers(controls);
        shape.validate()?;
        if self.prepare_gauss_points(&shape, &mut Vec::new()) {
            Ok(())
        } else {
            Err(SimError::Unusable { what: "the rest shape turns a cell of the lattice inside out: bend it less" })
        }
    }

    fn prepare(&self, at: &LocalState, prepared: &mut Vec<f64>) {
        self.prepare_gauss_points(&RestShape::of_numbers(at.controls), prepared);
    }

    fn energy(&self, at: &LocalState, gradient: &mut [f64]) -> f64 {
        let viscosity = viscosity(self.desc.material, self.desc.damping, at.dt);
        let mut energy = 0.0;
        for (index, cell) in self.cells.iter().enumerate() {
            let [before, now] = [at.q0, at.q1].map(|q| self.nodes.places(cell.nodes, q));
            for (volume, gradients) in gauss_of(at.prepared, index) {
                let f = deformation(&now, &gradients);
                let (mut density, mut stress) = self.desc.material.guarded_energy_and_stress(f);
                if let Some(viscosity) = &viscosity {
                    let (lost, drag) = viscosity.damping_energy_and_stress(deformation(&before, &gradients), f);
                    density += lost;
                    stress += drag;
                }
                energy += volume * density;
                self.nodes.add_gradient(cell.nodes, gradients.map(|g| stress * g * volume), gradient);
            }
        }
        energy
    }

    fn point_stiffness(&self, at: &LocalState, own: &mut [DMat3], pairs_of_nodes: &mut [DMat3]) {
        let curvature = if at.definite { Curvature::Definite } else { Curvature::Natural };
        let viscosity = viscosity(self.desc.material, self.desc.damping, at.dt);
        for (index, cell) in self.cells.iter().enumerate() {
            let [before, now] = [at.q0, at.q1].map(|q| self.nodes.places(cell.nodes, q));
            let mut blocks = [DMat3::ZERO; CORNERS * (CORNERS + 1) / 2];
            for (volume, gradients) in gauss_of(at.prepared, index) {
                let f = deformation(&now, &gradients);
                let of_damping = viscosity
                    .as_ref()
                    .map(|viscosity| Tangent::of_damping(viscosity, deformation(&before, &gradients), f, curvature));
                for tangent in std::iter::once(Tangent::of(&self.desc.material, f, curvature)).chain(of_damping) {
                    let carried = gradients.map(|g| tangent.carry(g));
                    for (block, (i, j)) in blocks.iter_mut().zip(pairs()) {
                        *block += tangent.block(&carried[i], &carried[j]) * volume;
                    }
                }
            }
            cell.slots.iter().zip(blocks).for_each(|(slot, block)| slot.add(block, own, pairs_of_nodes));
        }
    }
}

/// Pairs of corners (i, j) with i ≥ j, row by row.
fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..CORNERS).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

/// The 2 × 2 × 2 points of Gauss quadrature in the unit box, each of the same weight: exact to degree 3.
fn gauss_points() -> impl Iterator<Item = DVec3> {
    let near = 0.5 - 0.5 / 3f64.sqrt();
    let along = move |corner: usize, bit: usize| if corner & bit == 0 { near } else { 1.0 - near };
    (0..CORNERS).map(move |corner| DVec3::new(along(corner, 1), along(corner, 2), along(corner, 4)))
}

/// Gradients of the weights of the unit box's corners at a place in it.
fn trilinear_gradients(place: DVec3) -> [DVec3; CORNERS] {
    let along = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { 1.0 - place[axis] } else { place[axis] };
    let slope = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
    std::array::from_fn(|c| {
        DVec3::new(
            slope(c, 0) * along(c, 1) * along(c, 2),
            along(c, 0) * slope(c, 1) * along(c, 2),
            along(c, 0) * along(c, 1) * slope(c, 2),
        )
    })
}
