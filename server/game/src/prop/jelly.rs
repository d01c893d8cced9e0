//! A jelly: an elastic block in a lattice, which wobbles, and springs back when it is driven through.

use std::sync::Arc;

use pita_sim::mass::{Density, Polyhedron};
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    BodyId, Collider, DVec3, FigureDesc, Lattice, LatticeDesc, Material, PartCollider, Shape, SimError, World,
};
use serde::Deserialize;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key};
use crate::kinds::{ActorKind, Site};
use crate::part::PartInfo;
use crate::spawn::Pose;

/// Poisson's ratio: nearly, but not quite, as incompressible as water; cells of a lattice lock nearer to one half.
const POISSON: f64 = 0.4;
/// Time constant of internal damping, s.
const DAMPING: f64 = 0.05;
/// Radius of the balls that make up its surface, in the shortest edge of its cells.
const BALL: f64 = 0.3;

/// Keys of `kind = "jelly"`: a block that stands on its place.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JellyParameters {
    /// Name of its material, for its surface.
    pub material: String,
    /// Length, height and width, m.
    #[serde(default = "size")]
    pub size: [f64; 3],
    /// Cells along each.
    #[serde(default = "cells")]
    pub cells: [u32; 3],
    /// Kg/m³.
    #[serde(default = "density")]
    pub density: f64,
    /// Young's modulus, Pa.
    #[serde(default = "stiffness")]
    pub stiffness: f64,
}

fn size() -> [f64; 3] {
    [2.0, 1.5, 2.0]
}

fn cells() -> [u32; 3] {
    [2, 2, 2]
}

fn density() -> f64 {
    100.0
}

fn stiffness() -> f64 {
    20_000.0
}

/// An elastic block.
pub struct Jelly {
    info: ActorInfo,
    lattice: Arc<Lattice>,
    bodies: [BodyId; 1],
    home: Pose,
}

impl ActorKind for Jelly {
    const KIND: &'static str = "jelly";
    type Parameters = JellyParameters;

    fn check(parameters: &JellyParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        let JellyParameters { material, size, cells, density, stiffness } = parameters;
        file.check_material(&key.at("material"), material)?;
        for axis in 0..3 {
            key.at("size").index(axis).number(size[axis], 0.2, 20.0, "m")?;
            key.at("cells").index(axis).count(cells[axis] as usize, 1, 6, "cells")?;
        }
        key.at("density").number(*density, 1.0, 2e4, "kg/m^3")?;
        key.at("stiffness").number(*stiffness, 100.0, 1e9, "Pa")
    }

    fn add(site: &mut Site, parameters: &JellyParameters) -> Result<Self, SimError> {
        let lattice = Arc::new(lattice_of(parameters)?);
        let colliders = balls(&lattice, parameters, site.material(&parameters.material));
        let (q, v) = (lattice.placed(site.pose.position, site.pose.rotation()), lattice.still());
        let body = site.world.add_figure(FigureDesc { dof: lattice.clone(), q, v, colliders })?;
        let points: Vec<_> = surface(parameters).collect();
        let places: Vec<_> = points.iter().filter_map(|&node| lattice.at(node)).collect();
        let skin = PartInfo::skin(site.world, body, &places, Shape::Hull { points, radius: 0.0 });
        Ok(Self { info: site.info(Self::KIND, vec![skin]), lattice, bodies: [body], home: site.pose })
    }
}

/// Lowest and highest corner of the block in its own frame, m.
fn corners(parameters: &JellyParameters) -> (DVec3, DVec3) {
    let size = DVec3::from(parameters.size);
    let min = DVec3::new(-0.5 * size.x, 0.0, -0.5 * size.z);
    (min, min + size)
}

fn lattice_of(parameters: &JellyParameters) -> Result<Lattice, SimError> {
    let (min, max) = corners(parameters);
    let block: Vec<_> = [min, max]
        .iter()
        .flat_map(|a| [min, max].map(|b| [min, max].map(|c| DVec3::new(a.x, b.y, c.z))))
        .flatten()
        .collect();
    let material = Elastic::new(parameters.stiffness, POISSON)?;
    let density = Density::constant(parameters.density);
    Lattice::new(
        &Polyhedron::of_hull(&block)?,
        LatticeDesc { min, max, cells: parameters.cells, material, density, damping: DAMPING },
    )
}

/// Nodes of the block's surface in its own frame, m.
fn surface(parameters: &JellyParameters) -> impl Iterator<Item = DVec3> {
    let (min, max) = corners(parameters);
    let [nx, ny, nz] = parameters.cells;
    let nodes = (0..=nz).flat_map(move |k| (0..=ny).flat_map(move |j| (0..=nx).map(move |i| [i, j, k])));
    let on_surface = nodes.filter(move |&[i, j, k]| i % nx == 0 || j % ny == 0 || k % nz == 0);
    let cells = DVec3::new(nx.into(), ny.into(), nz.into());
    on_surface.map(move |node| min + (max - min) * DVec3::from(node.map(f64::from)) / cells)
}

/// Balls at the nodes of the surface, just inside of it.
fn balls(lattice: &Lattice, parameters: &JellyParameters, material: Material) -> Vec<PartCollider> {
    let (min, max) = corners(parameters);
    let cell = (max - min) / DVec3::from(parameters.cells.map(f64::from));
    let radius = BALL * cell.min_element();
    let collider = Collider::new(Shape::Ball { radius }, material);
    let inside = surface(parameters).map(|node| node.clamp(min + radius, max - radius));
    let places = inside.filter_map(|node| lattice.at(node));
    places.map(|at| PartCollider { at, collider: collider.clone() }).collect()
}

impl Actor for Jelly {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        let (q, v) = (self.lattice.placed(pose.position, pose.rotation()), self.lattice.still());
        world.set_slice(self.bodies[0], &q, &v)
    }
}
