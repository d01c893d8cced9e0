//! What moves a sheep: PD controllers on points of its parts, and nothing else. The same for all forms.

use glam::{DQuat, DVec3};
use pita_sim::{JointDrive, PdControl, PdDesc, PdId, SimError, World};

use super::anatomy::{
    BODY, CROWN, FOOT, FRONT_HIP, FRONT_LEG, HEAD, HIND_HIP, HIND_LEG, LEG, MASS, MUZZLE, NECK, NECK_IN_HEAD,
};
use super::rig::Rig;

/// What is held where: part and point in the part's frame, m. Nose and tail of the body hold its heading and pitch, back
/// and belly its roll; a second point of the head keeps that from rolling on.
const HELD: [(u32, DVec3); 8] = [
    (BODY, DVec3::new(0.5, 0.0, 0.0)),
    (BODY, DVec3::new(-0.5, 0.0, 0.0)),
    (BODY, DVec3::new(0.0, 0.3, 0.0)),
    (BODY, DVec3::new(0.0, -0.3, 0.0)),
    (FRONT_LEG, FOOT),
    (HIND_LEG, FOOT),
    (HEAD, MUZZLE),
    (HEAD, CROWN),
];

/// How a muscle follows its target: within a quarter of a second and not past it.
const DRIVE: JointDrive = JointDrive::Position { frequency: 2.5, damping_ratio: 1.0 };

/// Largest force of a muscle, N: two of them raise half as much again as the sheep weighs, and a car throws it about.
const STRENGTH: f64 = 0.75 * MASS * 9.81;

/// How a sheep wants to hold itself at the end of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// Where the middle of its body shall be, m.
    pub centre: DVec3,
    /// How fast that shall move, m/s.
    pub velocity: DVec3,
    /// Heading, rad to the left of +x.
    pub yaw: f64,
    /// How far it is turned over about its length, rad.
    pub roll: f64,
    /// Forward swing of the front leg and backward swing of the hind leg, rad.
    pub stride: f64,
    /// How far the head is raised, rad; negative where it grazes.
    pub head: f64,
}

impl Posture {
    /// Where each of the held points shall be, m.
    fn targets(&self) -> [DVec3; HELD.len()] {
        let turn = DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(self.roll);
        let foot = |hip: DVec3, swing: f64| hip + LEG * DVec3::new(swing.sin(), -swing.cos(), 0.0);
        let nod = DQuat::from_rotation_z(self.head);
        let of_head = |point: DVec3| NECK + nod * (point - NECK_IN_HEAD);
        let [nose, tail, back, belly] = [0, 1, 2, 3].map(|i: usize| HELD[i].1);
        let feet = [foot(FRONT_HIP, self.stride), foot(HIND_HIP, -self.stride)];
        [nose, tail, back, belly, feet[0], feet[1], of_head(MUZZLE), of_head(CROWN)]
            .map(|place| self.centre + turn * place)
    }
}

/// The controllers; a sheep that is limp has none.
#[derive(Default)]
pub struct Muscles {
    controllers: Option<[PdId; HELD.len()]>,
}

impl Muscles {
    /// Whether they hold it.
    pub fn are_tense(&self) -> bool {
        self.controllers.is_some()
    }

    /// Lets go of everything.
    pub fn relax(&mut self, world: &mut World) {
        for controller in self.controllers.take().into_iter().flatten() {
            world.remove_pd(controller);
        }
    }

    /// Works towards a posture.
    ///
    /// # Errors
    /// What the engine says.
    pub fn hold(&mut self, world: &mut World, rig: &Rig, posture: &Posture) -> Result<(), SimError> {
        let controls = posture.targets().map(|target| PdControl { target, target_velocity: posture.velocity });
        if let Some(controllers) = self.controllers {
            return controllers.into_iter().zip(controls).try_for_each(|(id, control)| world.set_pd(id, control));
        }
        let mut added = [PdId::default(); HELD.len()];
        for (id, ((part, point), control)) in added.iter_mut().zip(HELD.into_iter().zip(controls)) {
            let at = rig.anchor(part, point);
            *id = world.add_pd(PdDesc { at, drive: DRIVE, max_force: STRENGTH, control })?;
        }
        self.controllers = Some(added);
        Ok(())
    }
}
