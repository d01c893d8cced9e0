//! The tables of an arena file, as serde reads them: types and defaults, no ranges.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use pita_sim::Shape;
use pita_sim::collide::TriangleMesh;
use serde::Deserialize;

use super::block::Block;
use super::{
    AiFile, Angles, DriverFile, MaterialFile, MaterialPairFile, ParameterFile, PrecisionFile, ShapeFile, SleepFile,
    SolverFile, WarpFile,
};
use crate::combat::CombatParameters;
use crate::free_form;
use crate::vehicle::VehicleParameters;

/// A whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArenaFile {
    /// Name in key expressions.
    pub name: String,
    /// What a person calls it.
    pub title: String,
    /// Slots.
    pub max_players: u16,
    /// Acceleration downwards, m/s².
    #[serde(default = "standard_gravity")]
    pub gravity: f64,
    /// How the engine integrates.
    #[serde(default)]
    pub solver: SolverFile,
    /// When what is still leaves the tick.
    #[serde(default)]
    pub sleep: SleepFile,
    /// What who runs the arena may choose, by name.
    #[serde(default)]
    pub parameters: BTreeMap<String, ParameterFile>,
    /// Box of the world.
    #[serde(default)]
    pub bounds: BoundsFile,
    /// How fine the state is sent.
    #[serde(default)]
    pub precision: PrecisionFile,
    /// Surfaces, by name.
    pub materials: BTreeMap<String, MaterialFile>,
    /// Pairs of surfaces whose contacts are not as the rule says.
    #[serde(default)]
    pub material_pairs: Vec<MaterialPairFile>,
    /// Geometry that never moves.
    #[serde(default)]
    pub statics: Vec<StaticFile>,
    /// Single spawn points.
    #[serde(default)]
    pub spawns: Vec<SpawnFile>,
    /// Rectangles of spawn points.
    #[serde(default)]
    pub spawn_grids: Vec<SpawnGridFile>,
    /// What everybody drives.
    #[serde(default)]
    pub vehicle: VehicleParameters,
    /// Things with logic, in the order in which they are built.
    #[serde(default)]
    pub actors: Vec<ActorFile>,
    /// Closed routes, by name.
    #[serde(default)]
    pub routes: BTreeMap<String, RouteFile>,
    /// The arena's own cars.
    #[serde(default)]
    pub drivers: Vec<DriverFile>,
    /// Those who fill empty places; nobody without the table.
    pub ai: Option<AiFile>,
    /// Health, weapons and rounds; nobody fights without the table.
    pub combat: Option<CombatParameters>,
}

fn standard_gravity() -> f64 {
    9.81
}

/// Box of the world: what leaves it is put back.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoundsFile {
    /// Least x, y, z, m.
    pub min: [f64; 3],
    /// Greatest x, y, z, m.
    pub max: [f64; 3],
}

impl BoundsFile {
    /// The largest coordinate, in size, m.
    pub fn reach_m(&self) -> f64 {
        self.min.iter().chain(&self.max).fold(0.0, |reach, x| f64::max(reach, x.abs()))
    }
}

impl Default for BoundsFile {
    fn default() -> Self {
        Self { min: [-5_000.0, -20.0, -5_000.0], max: [5_000.0, 1_000.0, 5_000.0] }
    }
}

impl BoundsFile {
    /// Whether `point` is in the box.
    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min.into()).all() && point.cmple(self.max.into()).all()
    }
}

/// A piece of static geometry.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaticFile {
    /// Its shape; either this or a mesh.
    pub shape: Option<ShapeFile>,
    /// Its surface of triangles: name of an OBJ or glTF file in the folder of the arena's file, or below.
    pub mesh: Option<String>,
    /// What [`ArenaFile::read_meshes`] read.
    #[serde(skip)]
    pub surface: Option<Arc<TriangleMesh>>,
    /// How its points are deformed, those of a mesh or a box; what is lowest of it stays where it is.
    pub warp: Option<WarpFile>,
    /// Name of its material.
    pub material: String,
    /// Its centre, m.
    #[serde(default)]
    pub position: [f64; 3],
    /// Deg, see [`Angles`].
    #[serde(default)]
    pub yaw: f64,
    /// Deg.
    #[serde(default)]
    pub pitch: f64,
    /// Deg.
    #[serde(default)]
    pub roll: f64,
    /// How many along x, y and z.
    #[serde(default = "one_of_each")]
    pub copies: [usize; 3],
    /// Distance of neighbours along x, y and z, m.
    #[serde(default)]
    pub spacing: [f64; 3],
}

impl StaticFile {
    /// The block that it is one of, or all of.
    pub fn block(&self) -> Block {
        Block { first: self.position, copies: self.copies, spacing: self.spacing }
    }

    /// What it collides with; `None` for a mesh that was not read.
    pub fn collides(&self) -> Option<Shape> {
        let Some(shape) = self.shape.as_ref().map(Shape::from) else { return self.surface.clone().map(Shape::Mesh) };
        let Some(warp) = self.warp else { return Some(shape) };
        let lowest = if let Shape::Box { half } = shape { -half.y } else { 0.0 };
        free_form::deform_shape(&warp.free_form(lowest), &shape)
    }

    /// Its angles.
    pub fn angles(&self) -> Angles {
        Angles { yaw: self.yaw, pitch: self.pitch, roll: self.roll }
    }
}

/// A spawn point.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpawnFile {
    /// Point of the ground, m.
    pub position: [f64; 3],
    /// Heading, deg to the left of +x.
    #[serde(default)]
    pub yaw: f64,
}

/// A rectangle of spawn points around a centre.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpawnGridFile {
    /// Point of the ground in the middle, m.
    #[serde(default)]
    pub center: [f64; 3],
    /// Points along x and z.
    pub count: [usize; 2],
    /// Distance of neighbours along x and z, m.
    pub spacing: [f64; 2],
    /// Heading, deg to the left of +x.
    #[serde(default)]
    pub yaw: f64,
}

/// An actor, or a block of equal ones.
#[derive(Clone, Debug, Deserialize)]
pub struct ActorFile {
    /// Name of its kind.
    pub kind: String,
    /// What a person calls it; the kind where it is left out.
    pub name: Option<String>,
    /// Place of the first, m; what of it is there is the kind's affair.
    pub position: [f64; 3],
    /// Heading, deg to the left of +x.
    #[serde(default)]
    pub yaw: f64,
    /// How many along x, y and z.
    #[serde(default = "one_of_each")]
    pub copies: [usize; 3],
    /// Distance of neighbours along x, y and z, m.
    #[serde(default)]
    pub spacing: [f64; 3],
    /// All other keys: the kind's own.
    #[serde(flatten)]
    pub parameters: toml::Table,
}

impl ActorFile {
    /// What a person calls it.
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.kind)
    }

    /// The block that it is one of, or all of.
    pub fn block(&self) -> Block {
        Block { first: self.position, copies: self.copies, spacing: self.spacing }
    }
}

fn one_of_each() -> [usize; 3] {
    [1; 3]
}

/// A closed route.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RouteFile {
    /// Its corners in x and z, m.
    pub corners: Vec<[f64; 2]>,
}
