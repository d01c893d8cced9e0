//! Loose things to knock over: one body, no logic.

use pita_sim::{BodyId, Shape, SimError, World};
use serde::Deserialize;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key, ShapeFile};
use crate::assembly::{Assembly, Piece};
use crate::kinds::{ActorKind, Site};
use crate::spawn::Pose;
use glam::DVec3;

/// Keys of `kind = "prop"`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PropParameters {
    /// Its shape, around its place.
    pub shape: ShapeFile,
    /// Name of its material.
    pub material: String,
    /// Kg.
    pub mass: f64,
}

/// A loose thing.
pub struct Prop {
    info: ActorInfo,
    assembly: Assembly,
    home: Pose,
}

impl ActorKind for Prop {
    const KIND: &'static str = "prop";
    type Parameters = PropParameters;

    fn check(parameters: &PropParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        let PropParameters { shape, material, mass } = parameters;
        key.at("shape").require(shape.is_bounded(), "half_space", "box, ball, capsule or cylinder")?;
        shape.check(&key.at("shape"))?;
        file.check_material(&key.at("material"), material)?;
        key.at("mass").number(*mass, 0.01, 1e6, "kg")
    }

    fn add(site: &mut Site, parameters: &PropParameters) -> Result<Self, SimError> {
        let PropParameters { shape, material, mass } = parameters;
        let piece = Piece::new(Shape::from(shape), *mass, site.material(material), DVec3::ZERO);
        Self::of_piece(site, Self::KIND, piece)
    }
}

impl Prop {
    /// A loose thing of any kind.
    fn of_piece(site: &mut Site, kind: &'static str, piece: Piece) -> Result<Self, SimError> {
        let mut assembly = Assembly::at(site.pose);
        assembly.add(site.world, piece)?;
        Ok(Self { info: site.info(kind, assembly.parts()), assembly, home: site.pose })
    }
}

impl Actor for Prop {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.assembly.bodies()
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.assembly.place(world, pose)
    }
}
