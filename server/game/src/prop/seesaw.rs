//! A seesaw: a plank on a hinge, whose ends come down to the ground.

use pita_sim::{Anchor, BodyId, DVec3, HingeDesc, Shape, SimError, World};
use serde::Deserialize;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key};
use crate::assembly::{Assembly, Piece};
use crate::kinds::{ActorKind, Site};
use crate::spawn::Pose;

/// Keys of `kind = "seesaw"`: a plank along its heading, its middle above its place.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeesawParameters {
    /// Name of its material.
    pub material: String,
    /// Half length, half thickness and half width of the plank, m.
    #[serde(default = "half")]
    pub half: [f64; 3],
    /// Of its middle above the ground, m.
    #[serde(default = "height")]
    pub height: f64,
    /// Of the plank, kg.
    #[serde(default = "mass")]
    pub mass: f64,
}

fn half() -> [f64; 3] {
    [4.0, 0.1, 1.5]
}

fn height() -> f64 {
    0.8
}

fn mass() -> f64 {
    300.0
}

/// A plank on a hinge.
pub struct Seesaw {
    info: ActorInfo,
    plank: Assembly,
    home: Pose,
}

impl ActorKind for Seesaw {
    const KIND: &'static str = "seesaw";
    type Parameters = SeesawParameters;

    fn check(parameters: &SeesawParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        let SeesawParameters { material, half, height, mass } = parameters;
        file.check_material(&key.at("material"), material)?;
        half.iter().enumerate().try_for_each(|(i, &h)| key.at("half").index(i).number(h, 0.02, 50.0, "m"))?;
        key.at("height").number(*height, half[1], 50.0, "m, at least half.1")?;
        key.at("mass").number(*mass, 1.0, 1e5, "kg")
    }

    fn add(site: &mut Site, parameters: &SeesawParameters) -> Result<Self, SimError> {
        let mut plank = Assembly::at(site.pose);
        let shape = Shape::Box { half: parameters.half.into() };
        let (middle, material) = (DVec3::Y * parameters.height, site.material(&parameters.material));
        let body = plank.add(site.world, Piece::new(shape, parameters.mass, material, middle))?;
        let (a, b) = (Anchor::world(plank.point(middle)), Anchor::body(body, DVec3::ZERO));
        site.world.add_hinge(HingeDesc::new(a, b, site.pose.rotation() * DVec3::Z, DVec3::Z))?;
        Ok(Self { info: site.info(Self::KIND, plank.parts()), plank, home: site.pose })
    }
}

impl Actor for Seesaw {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.plank.bodies()
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    /// Its hinge stays where it is: so does the plank, whatever the pose.
    fn place(&mut self, world: &mut World, _pose: Pose) -> Result<(), SimError> {
        self.plank.place(world, self.home)
    }
}
