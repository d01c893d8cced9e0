//! Loose things to knock over: one body, no logic.

use std::f64::consts::FRAC_PI_2;
use std::marker::PhantomData;

use pita_sim::{BodyId, DQuat, DVec3, Shape, SimError, World};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key, ShapeFile};
use crate::assembly::{Assembly, Piece};
use crate::kinds::{ActorKind, Site};
use crate::spawn::Pose;

/// What a loose thing of some kind is.
pub trait Loose: DeserializeOwned + Send + 'static {
    /// [`ActorKind::KIND`].
    const KIND: &'static str;

    /// As [`ActorKind::check`].
    ///
    /// # Errors
    /// [`ArenaError::OutOfRange`] for the first value that is not allowed.
    fn check(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError>;

    /// Its body.
    fn piece(&self, site: &Site) -> Piece;
}

/// A loose thing.
pub struct LooseThing<P> {
    info: ActorInfo,
    assembly: Assembly,
    home: Pose,
    parameters: PhantomData<fn() -> P>,
}

impl<P: Loose> ActorKind for LooseThing<P> {
    const KIND: &'static str = P::KIND;
    type Parameters = P;

    fn check(parameters: &P, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        parameters.check(key, file)
    }

    fn add(site: &mut Site, parameters: &P) -> Result<Self, SimError> {
        let mut assembly = Assembly::at(site.pose);
        assembly.add(site.world, parameters.piece(site))?;
        let info = site.info(P::KIND, assembly.parts());
        Ok(Self { info, assembly, home: site.pose, parameters: PhantomData })
    }
}

impl<P> Actor for LooseThing<P> {
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

/// `kind = "prop"`: a shape around its place.
pub type Prop = LooseThing<PropParameters>;
/// `kind = "crate"`: a cube that stands on its place.
pub type Crate = LooseThing<CrateParameters>;
/// `kind = "barrel"`: a cylinder that stands on its place.
pub type Barrel = LooseThing<BarrelParameters>;

/// Keys of a [`Prop`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PropParameters {
    /// Its shape.
    pub shape: ShapeFile,
    /// Name of its material.
    pub material: String,
    /// Kg.
    pub mass: f64,
}

impl Loose for PropParameters {
    const KIND: &'static str = "prop";

    fn check(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        key.at("shape").require(self.shape.is_bounded(), "half_space", "box, ball, capsule or cylinder")?;
        self.shape.check(&key.at("shape"))?;
        file.check_material(&key.at("material"), &self.material)?;
        check_mass(key, self.mass)
    }

    fn piece(&self, site: &Site) -> Piece {
        Piece::new(Shape::from(&self.shape), self.mass, site.material(&self.material), DVec3::ZERO)
    }
}

/// Keys of a [`Crate`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrateParameters {
    /// Name of its material.
    pub material: String,
    /// Length of an edge, m.
    #[serde(default = "crate_size")]
    pub size: f64,
    /// Kg.
    #[serde(default = "crate_mass")]
    pub mass: f64,
}

fn crate_size() -> f64 {
    0.8
}

fn crate_mass() -> f64 {
    40.0
}

impl Loose for CrateParameters {
    const KIND: &'static str = "crate";

    fn check(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        file.check_material(&key.at("material"), &self.material)?;
        key.at("size").number(self.size, 0.1, 10.0, "m")?;
        check_mass(key, self.mass)
    }

    fn piece(&self, site: &Site) -> Piece {
        let half = 0.5 * self.size;
        let shape = Shape::Box { half: DVec3::splat(half) };
        Piece::new(shape, self.mass, site.material(&self.material), DVec3::Y * half)
    }
}

/// Keys of a [`Barrel`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarrelParameters {
    /// Name of its material.
    pub material: String,
    /// M.
    #[serde(default = "barrel_radius")]
    pub radius: f64,
    /// M.
    #[serde(default = "barrel_height")]
    pub height: f64,
    /// Kg.
    #[serde(default = "barrel_mass")]
    pub mass: f64,
}

fn barrel_radius() -> f64 {
    0.3
}

fn barrel_height() -> f64 {
    0.9
}

fn barrel_mass() -> f64 {
    30.0
}

/// Radius of a barrel's rims, as a share of its radius or half height, whichever is less.
const RIM: f64 = 0.1;

impl Loose for BarrelParameters {
    const KIND: &'static str = "barrel";

    fn check(&self, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        file.check_material(&key.at("material"), &self.material)?;
        key.at("radius").number(self.radius, 0.05, 10.0, "m")?;
        key.at("height").number(self.height, 0.1, 10.0, "m")?;
        check_mass(key, self.mass)
    }

    fn piece(&self, site: &Site) -> Piece {
        let half_length = 0.5 * self.height;
        let rounding = RIM * half_length.min(self.radius);
        let shape = Shape::Cylinder { half_length, radius: self.radius, rounding };
        let material = site.material(&self.material);
        Piece {
            rotation: DQuat::from_rotation_x(FRAC_PI_2),
            ..Piece::new(shape, self.mass, material, DVec3::Y * half_length)
        }
    }
}

fn check_mass(key: &Key, mass: f64) -> Result<(), ArenaError> {
    key.at("mass").number(mass, 0.01, 1e6, "kg")
}
