//! Runs a scene on our engine: a rigid one from the same text that a user would write.

use std::sync::Arc;

use pita_game::scene::{Scene as SceneFile, SceneError};
use pita_server::trace::states;
use pita_sim::mass::Density;
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{DQuat, DVec3, FigureDesc, FiniteElements, Settings, SimError, World};

use super::scene::{Beam, Content};
use super::trace::{BodyState, Engine, Trouble};

/// Our engine with a scene in it, one step a tick.
pub struct Ours {
    world: World,
    trouble: Trouble,
}

/// Why a scene cannot run.
#[derive(Debug, thiserror::Error)]
pub enum OursError {
    /// The engine refuses a line of its text.
    #[error(transparent)]
    Line(#[from] SceneError),
    /// The engine refuses something else about it.
    #[error(transparent)]
    Refused(#[from] SimError),
}

impl Ours {
    /// The scene in a world of `settings`.
    ///
    /// # Errors
    /// [`OursError`]
    pub fn new(content: &Content, settings: &Settings) -> Result<Self, OursError> {
        let world = match content {
            Content::Rigid(_, scene) => SceneFile::parse(&scene.to_string(), settings)?.world,
            Content::Beam(beam) => world_of_beam(beam, settings)?,
        };
        Ok(Self { world, trouble: Trouble::default() })
    }
}

/// A world with an elastic beam in it: tetrahedra of Saint Venant-Kirchhoff material, undamped. The clamped nodes are no
/// DOF and leave no trace.
///
/// # Errors
/// [`SimError`] naming what is out of range.
pub fn world_of_beam(beam: &Beam, settings: &Settings) -> Result<World, SimError> {
    let across = 0.5 * beam.size.with_x(0.0);
    let mesh = TetrahedralMesh::of_box(-across, beam.size - across, beam.cells)?;
    let clamped: Vec<u32> = (0..).zip(mesh.nodes()).filter(|(_, node)| node.x == 0.0).map(|(node, _)| node).collect();
    let material = Elastic::new(beam.young_modulus, beam.poisson_ratio)?;
    let body = FiniteElements::new(&mesh, material, Density::constant(beam.density), &clamped)?;
    let (q, v) = (body.rest(), body.still());
    // The kit's rules: nothing sleeps.
    let mut world = World::new(Settings { sleep: None, ..settings.clone() })?;
    world.add_figure(FigureDesc { dof: Arc::new(body), q, v, colliders: Vec::new() })?;
    Ok(world)
}

impl Engine for Ours {
    fn tick(&mut self) {
        let report = self.world.step();
        self.trouble.unconverged_ticks += usize::from(report.unconverged_islands > 0);
        self.trouble.quarantined += report.quarantined;
    }

    fn record(&self, into: &mut Vec<BodyState>) {
        // Scenes have rigid bodies and finite elements, and both have states.
        let states = self.world.slices().flat_map(states).flatten();
        into.extend(states.map(|[x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz]| BodyState {
            position: DVec3::new(x, y, z),
            rotation: DQuat::from_xyzw(qx, qy, qz, qw),
            velocity: DVec3::new(vx, vy, vz),
            angular_velocity: DVec3::new(wx, wy, wz),
        }));
    }

    fn trouble(&self) -> Option<Trouble> {
        Some(self.trouble)
    }
}
