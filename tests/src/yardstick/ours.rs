//! Runs a scene on our engine, from the same text that a user would write.

use pita_game::scene::{Scene as SceneFile, SceneError};
use pita_sim::{DQuat, DVec3, Settings};

use super::TICK_HZ;
use super::scene::Content;
use super::trace::{BodyState, Engine};

/// Our engine with a scene in it, one step a tick.
pub struct Ours(SceneFile);

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
                Ok(Self(SceneFile::parse(&scene.to_string(), &settings)?))
            }
            Content::Beam(_) => Err(OursError::NoFiniteElements),
        }
    }
}

impl Engine for Ours {
    fn tick(&mut self) {
        self.0.world.step();
    }

    fn record(&self, into: &mut Vec<BodyState>) {
        let world = &self.0.world;
        // No body of a scene is ever removed, so each of them has a state.
        into.extend(self.0.bodies.iter().map(|&id| BodyState {
            position: world.position(id).unwrap_or(DVec3::NAN),
            rotation: world.rotation(id).unwrap_or(DQuat::NAN),
            velocity: world.velocity(id).unwrap_or(DVec3::NAN),
            angular_velocity: world.angular_velocity(id).unwrap_or(DVec3::NAN),
        }));
    }
}
