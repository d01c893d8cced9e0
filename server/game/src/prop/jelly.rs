//! A jelly: an elastic block in a lattice, which wobbles, and springs back when it is driven through. With key-frames it
//! dances: they deform what it is at rest, and elasticity takes it there.

use std::sync::{Arc, OnceLock};

use pita_sim::mass::{Density, Polyhedron};
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{BodyId, DVec3, EmbeddedHull, FigureDesc, Lattice, LatticeDesc, Material, Shape, SimError, World};
use serde::Deserialize;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key, WarpKeyFile, check_warp, key_frames};
use crate::free_form::{KeyFrames, Warp};
use crate::kinds::{ActorKind, Site};
use crate::part::PartInfo;
use crate::spawn::Pose;
use crate::step::Step;

/// Poisson's ratio: nearly, but not quite, as incompressible as water; cells of a lattice lock nearer to one half.
const POISSON: f64 = 0.4;
/// Time constant of internal damping, s.
const DAMPING: f64 = 0.05;
/// Radius by which the hulls of its cells are extruded, in the shortest edge of the cells.
const ROUNDING: f64 = 0.1;

/// Least and largest stretch that a lattice can be told.
const SCALES: [f64; 2] = [0.1, 10.0];

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
    /// Key-frames of what it is at rest.
    #[serde(default)]
    pub warp: Vec<WarpKeyFile>,
    /// After which they begin again, s.
    #[serde(default)]
    pub warp_period: f64,
    /// All copies have the same.
    #[serde(skip)]
    lattice: OnceLock<Arc<Lattice>>,
}

impl JellyParameters {
    /// The block at rest, of which masses are computed once.
    fn lattice(&self) -> Result<Arc<Lattice>, SimError> {
        if let Some(lattice) = self.lattice.get() {
            return Ok(lattice.clone());
        }
        let lattice = Arc::new(lattice_of(self)?);
        Ok(self.lattice.get_or_init(|| lattice).clone())
    }
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
    dance: Option<KeyFrames<{ Warp::NUMBERS }>>,
}

impl ActorKind for Jelly {
    const KIND: &'static str = "jelly";
    type Parameters = JellyParameters;

    fn check(parameters: &JellyParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        let JellyParameters { material, size, cells, density, stiffness, warp, warp_period, .. } = parameters;
        file.check_material(&key.at("material"), material)?;
        for axis in 0..3 {
            key.at("size").index(axis).number(size[axis], 0.2, 20.0, "m")?;
            key.at("cells").index(axis).count(cells[axis] as usize, 1, 6, "cells")?;
        }
        key.at("density").number(*density, 1.0, 2e4, "kg/m^3")?;
        key.at("stiffness").number(*stiffness, 100.0, 1e9, "Pa")?;
        check_warp(key, warp, *warp_period)?;
        for (i, frame) in warp.iter().enumerate() {
            let key = key.at("warp").index(i).at("bend").index(1);
            key.require(frame.bend[1] == 0.0, frame.bend[1], "0: a jelly bends towards its x alone")?;
        }
        Ok(())
    }

    fn add(site: &mut Site, parameters: &JellyParameters) -> Result<Self, SimError> {
        let lattice = parameters.lattice()?;
        let hulls = hulls(&lattice, parameters, site.material(&parameters.material))?;
        let (q, v) = (lattice.placed(site.pose.position, site.pose.rotation()), lattice.still());
        let figure = FigureDesc { dof: lattice.clone(), q, v, colliders: Vec::new() };
        let body = site.world.add_figure_with_hulls(figure, hulls)?;
        let points: Vec<_> = surface(parameters).collect();
        let places: Vec<_> = points.iter().filter_map(|&node| lattice.at(node)).collect();
        let skin = PartInfo::skin(site.world, body, &places, Shape::Hull { points, radius: 0.0 });
        let dance = key_frames(&parameters.warp, parameters.warp_period);
        Ok(Self { info: site.info(Self::KIND, vec![skin]), lattice, bodies: [body], home: site.pose, dance })
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

/// The grid of nodes, or of cells, that is `counts` long: those at its surface.
fn at_surface(counts: [u32; 3]) -> impl Iterator<Item = DVec3> {
    let [nx, ny, nz] = counts;
    let all = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
    let is_outside = move |at: &[u32; 3]| (0..3).any(|axis| at[axis] == 0 || at[axis] + 1 == counts[axis]);
    all.filter(is_outside).map(|at| DVec3::from(at.map(f64::from)))
}

/// Nodes of the block's surface in its own frame, m.
fn surface(parameters: &JellyParameters) -> impl Iterator<Item = DVec3> {
    let (min, max) = corners(parameters);
    let cells = DVec3::from(parameters.cells.map(f64::from));
    at_surface(parameters.cells.map(|n| n + 1)).map(move |node| min + (max - min) * node / cells)
}

/// A hull of each cell at the surface, which deforms with it; what is dented so has a dent. All together reach as far as
/// the block.
fn hulls(lattice: &Lattice, parameters: &JellyParameters, material: Material) -> Result<Vec<EmbeddedHull>, SimError> {
    let (min, max) = corners(parameters);
    let cell = (max - min) / DVec3::from(parameters.cells.map(f64::from));
    let radius = ROUNDING * cell.min_element();
    let corner = |of: DVec3, i: usize| {
        let step = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        (min + cell * (of + step)).clamp(min + radius, max - radius)
    };
    let hull = |of: DVec3| lattice.hull(&[0, 1, 2, 3, 4, 5, 6, 7].map(|i| corner(of, i)), radius, material);
    at_surface(parameters.cells).map(hull).collect()
}

impl Actor for Jelly {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        let Some(dance) = &self.dance else { return Ok(()) };
        let warp = Warp::of_numbers(dance.at(step.tick as f64 * step.dt));
        // Between key-frames the cubic goes past them by a little.
        let scale = warp.scale.clamp(DVec3::splat(SCALES[0]), DVec3::splat(SCALES[1]));
        let rest = Warp { scale, bend: warp.bend.with_y(0.0), ..warp }.rest_shape()?;
        step.world.set_controls(self.bodies[0], &rest.numbers())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        let (q, v) = (self.lattice.placed(pose.position, pose.rotation()), self.lattice.still());
        world.set_slice(self.bodies[0], &q, &v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_share_what_is_computed_of_them_at_rest() {
        let parameters: JellyParameters = toml::from_str("material = \"rubber\"").unwrap();
        let [first, second] = [parameters.lattice().unwrap(), parameters.lattice().unwrap()];
        assert!(Arc::ptr_eq(&first, &second));
    }
}
