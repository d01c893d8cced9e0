//! Runs a scene on our engine, from the same text that a user would write.

use pita_game::scene::{Scene as SceneFile, SceneError};
use pita_sim::{DQuat, DVec3, Settings};

use super::TICK_HZ;
use super::scene::Content;
use super::trace::{BodyState, Engine, Trouble};

/// Our engine with a scene in it, one step a tick.
pub struct Ours {
    scene: SceneFile,
    trouble: Trouble,
}

/// Why a scene cannot run.
#[derive(Debug, thiserror::Error)]
pub enum OursError {
    /// The engine refuses it.
    #[error(transparent)]
    Refused(#[from] SceneError),
    /// The engine lacks the kind of DOF.
    #[error("there are no finite elements yet")]
    NoFiniteElements,
}

impl Ours {
    /// The scene with the daemon's settings, on `threads` threads.
    ///
    /// # Errors
    /// [`OursError`]
    pub fn new(content: &Content, threads: usize) -> Result<Self, OursError> {
        match content {
            Content::Rigid(_, scene) => {
                let settings = Settings { threads, ..Settings::at(TICK_HZ.recip()) };
                let scene = SceneFile::parse(&scene.to_string(), &settings)?;
                Ok(Self { scene, trouble: Trouble::default() })
            }
            Content::Beam(_) => Err(OursError::NoFiniteElements),
        }
    }
}

impl Engine for Ours {
    fn tick(&mut self) {
        let report = self.scene.world.step();
        self.trouble.unconverged_ticks += usize::from(report.unconverged_islands > 0);
        self.trouble.quarantined += report.quarantined;
    }

    fn record(&self, into: &mut Vec<BodyState>) {
        let world = &self.scene.world;
        // No body of a scene is ever removed, so each of them has a state.
        into.extend(self.scene.bodies.iter().map(|&id| BodyState {
            position: world.position(id).unwrap_or(DVec3::NAN),
            rotation: world.rotation(id).unwrap_or(DQuat::NAN),
            velocity: world.velocity(id).unwrap_or(DVec3::NAN),
            angular_velocity: world.angular_velocity(id).unwrap_or(DVec3::NAN),
        }));
    }

    fn trouble(&self) -> Option<Trouble> {
        Some(self.trouble)
    }
}
