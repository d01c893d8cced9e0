//! A fence of boards that break off where something hits them hard.

use pita_sim::{Anchor, BodyId, DVec3, FixedJointDesc, JointId, Shape, SimError, World};
use serde::Deserialize;

use crate::actor::{Actor, ActorInfo, WhenLost};
use crate::arena_file::{ArenaError, ArenaFile, Key};
use crate::assembly::{Assembly, Piece};
use crate::breakable::Breakable;
use crate::kinds::{ActorKind, Site};
use crate::spawn::Pose;
use crate::step::Step;

/// Boards stand so far above the ground, m: they are held by their posts, not by the ground.
const CLEARANCE: f64 = 0.05;
/// Gap between neighbouring boards, m.
const GAP: f64 = 0.02;
/// Half the thickness of a board, m.
const HALF_THICKNESS: f64 = 0.04;
/// Force that throws splinters as far as they go, in strengths of a joint.
const LOUDEST: f64 = 4.0;

/// Keys of `kind = "fence"`: a row of boards from its place along its heading.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FenceParameters {
    /// Name of its material.
    pub material: String,
    /// Number of boards.
    pub boards: usize,
    /// Length of a board, m.
    #[serde(default = "length")]
    pub length: f64,
    /// Height of a board, m.
    #[serde(default = "height")]
    pub height: f64,
    /// Of a board, kg.
    #[serde(default = "mass")]
    pub mass: f64,
    /// Force that breaks a board off the ground or off its neighbour, N.
    #[serde(default = "strength")]
    pub strength: f64,
}

fn length() -> f64 {
    2.0
}

fn height() -> f64 {
    1.0
}

fn mass() -> f64 {
    20.0
}

fn strength() -> f64 {
    4_000.0
}

/// A row of boards, each held by the ground and by its neighbours.
pub struct Fence {
    info: ActorInfo,
    boards: Assembly,
    joints: Breakable,
    home: Pose,
    parameters: FenceParameters,
}

impl ActorKind for Fence {
    const KIND: &'static str = "fence";
    type Parameters = FenceParameters;

    fn check(parameters: &FenceParameters, key: &Key, file: &ArenaFile) -> Result<(), ArenaError> {
        file.check_material(&key.at("material"), &parameters.material)?;
        key.at("boards").count(parameters.boards, 1, 64, "boards")?;
        key.at("length").number(parameters.length, 0.2, 10.0, "m")?;
        key.at("height").number(parameters.height, 0.2, 10.0, "m")?;
        key.at("mass").number(parameters.mass, 0.1, 1e4, "kg")?;
        key.at("strength").number(parameters.strength, 1.0, 1e9, "N")
    }

    fn add(site: &mut Site, parameters: &FenceParameters) -> Result<Self, SimError> {
        let mut boards = Assembly::at(site.pose);
        let half = DVec3::new(0.5 * (parameters.length - GAP), 0.5 * parameters.height, HALF_THICKNESS);
        for board in 0..parameters.boards {
            let centre = DVec3::new((board as f64 + 0.5) * parameters.length, CLEARANCE + half.y, 0.0);
            let material = site.material(&parameters.material);
            boards.add(site.world, Piece::new(Shape::Box { half }, parameters.mass, material, centre))?;
        }
        let info = site.info(Self::KIND, boards.parts());
        let (parameters, home) = (parameters.clone(), site.pose);
        let mut fence = Self { info, boards, joints: Breakable::default(), home, parameters };
        fence.join(site.world)?;
        Ok(fence)
    }
}

impl Fence {
    /// Nails every board to the ground and to the board before it.
    fn join(&mut self, world: &mut World) -> Result<(), SimError> {
        let FenceParameters { length, height, strength, .. } = self.parameters;
        let foot = DVec3::NEG_Y * (0.5 * height + CLEARANCE);
        let mut join = |a: Anchor, b: Anchor| {
            let joint = world.add_fixed_joint(FixedJointDesc::new(a, b))?;
            self.joints.add(JointId::Fixed(joint), strength);
            Ok(())
        };
        for (i, &board) in self.boards.bodies().iter().enumerate() {
            let ground = self.boards.point(DVec3::X * ((i as f64 + 0.5) * length));
            join(Anchor::world(ground), Anchor::body(board, foot))?;
        }
        for pair in self.boards.bodies().windows(2) {
            let edge = DVec3::X * (0.5 * length);
            join(Anchor::body(pair[0], edge), Anchor::body(pair[1], -edge))?;
        }
        Ok(())
    }
}

impl Actor for Fence {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.boards.bodies()
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        for broken in self.joints.give_way(step.world) {
            let loudness = broken.force.length() / (LOUDEST * self.parameters.strength);
            step.effect("splinters", broken.at, broken.force.normalize_or_zero(), loudness);
        }
        Ok(())
    }

    fn when_lost(&self) -> WhenLost {
        WhenLost::Home(self.home)
    }

    /// Boards that lie about are taken back, and nailed anew.
    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.joints.clear(world);
        self.boards.place(world, pose)?;
        self.join(world)
    }
}
