//! The DOF of a sheep in the talk's three forms: natural coordinates (13 points, 39 DOF, 24 rods), independent coordinates
//! (15), and rigid bodies with ball joints (24 − 9). To what steers it they are the same: points of four parts.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, Collider, Dof, FigureDesc, Frame, JointDesc, JointKind, Material,
    Natural, NaturalDesc, NaturalPart, PartCollider, PartDesc, PartPoint, RigidBodyDesc, SimError, World,
};
use serde::Deserialize;

use super::anatomy::{BODY, PARTS, POINTS, Part, STANDING, points_of};
use crate::Pose;
use crate::part::PartInfo;

/// What the DOF of a sheep are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Points in space and rods between them.
    #[default]
    Natural,
    /// A root and joint coordinates.
    Articulated,
    /// Rigid bodies and joints between them.
    Rigid,
}

/// The parts of a sheep in the world.
pub struct Rig {
    /// One figure, or a rigid body for each part.
    bodies: Vec<BodyId>,
    /// Kinematics of the figure.
    figure: Option<Figure>,
}

/// A figure and its Q as it stands.
enum Figure {
    Natural(Arc<Natural>),
    Articulated(Arc<Articulated>),
}

impl Rig {
    /// Adds a sheep that stands on the ground at `pose`.
    ///
    /// # Errors
    /// What the engine says.
    pub fn add(world: &mut World, form: Form, material: Material, pose: Pose) -> Result<Self, SimError> {
        match form {
            Form::Rigid => Ok(Self { bodies: add_rigid(world, material, pose)?, figure: None }),
            Form::Natural => Self::add_figure(world, Figure::Natural(Arc::new(natural()?)), material, pose),
            Form::Articulated => Self::add_figure(world, Figure::Articulated(Arc::new(articulated()?)), material, pose),
        }
    }

    fn add_figure(world: &mut World, figure: Figure, material: Material, pose: Pose) -> Result<Self, SimError> {
        let collider = |(part, desc): (u32, &Part)| PartCollider {
            at: PartPoint { part, point: DVec3::ZERO },
            collider: Collider::new(desc.shape(), material),
        };
        let colliders = (0..).zip(&PARTS).map(collider).collect();
        let (q, v) = figure.standing(pose);
        let dof = match &figure {
            Figure::Natural(dof) => dof.clone() as Arc<dyn Dof>,
            Figure::Articulated(dof) => dof.clone(),
        };
        let body = world.add_figure(FigureDesc { dof, q, v, colliders })?;
        Ok(Self { bodies: vec![body], figure: Some(figure) })
    }

    /// One figure, or a rigid body for each part.
    pub fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// A point of a part.
    pub fn anchor(&self, part: u32, point: DVec3) -> Anchor {
        match self.figure {
            Some(_) => Anchor::part(self.bodies[0], part, point),
            None => Anchor::body(self.bodies[part as usize], point),
        }
    }

    /// Where a part is and how it moves.
    ///
    /// # Errors
    /// Where it is gone.
    pub fn frame(&self, world: &World, part: u32) -> Result<Frame<f64>, SimError> {
        let Anchor { body, part, point } = self.anchor(part, DVec3::ZERO);
        let frame = body.and_then(|body| world.frame(body, PartPoint { part, point }));
        frame.ok_or(SimError::Gone { what: "a part of the sheep" })
    }

    /// What is seen of it: a box for each part.
    pub fn parts(&self, world: &World) -> Vec<PartInfo> {
        let part = |(part, desc): (u32, &Part)| match self.figure {
            Some(_) => PartInfo::at(world, self.bodies[0], PartPoint { part, point: DVec3::ZERO }, desc.shape()),
            None => PartInfo::new(world, self.bodies[part as usize], desc.shape()),
        };
        (0..).zip(&PARTS).map(part).collect()
    }

    /// Stands it on the ground at `pose`, at rest.
    ///
    /// # Errors
    /// What the engine says.
    pub fn place(&self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        if let Some(figure) = &self.figure {
            let (q, v) = figure.standing(pose);
            return world.set_slice(self.bodies[0], &q, &v);
        }
        for (&body, part) in self.bodies.iter().zip(&PARTS) {
            world.set_pose(body, centre(pose) + pose.rotation() * part.centre, pose.rotation())?;
            world.set_velocity(body, DVec3::ZERO, DVec3::ZERO)?;
        }
        Ok(())
    }
}

/// Centre of the body of a sheep that stands at `pose`, m.
fn centre(pose: Pose) -> DVec3 {
    pose.position + DVec3::Y * STANDING
}

impl Figure {
    /// Q and Q' of a sheep that stands still.
    fn standing(&self, pose: Pose) -> (Vec<f64>, Vec<f64>) {
        match self {
            Self::Natural(dof) => (dof.placed(centre(pose), pose.rotation()), vec![0.0; 3 * POINTS]),
            Self::Articulated(dof) => {
                let joints = PARTS[1..].iter().flat_map(|_| DQuat::IDENTITY.to_array());
                let root = centre(pose).to_array().into_iter().chain(pose.rotation().to_array());
                (root.chain(joints).collect(), dof.still())
            }
        }
    }
}

fn natural() -> Result<Natural, SimError> {
    let mut desc = NaturalDesc { points: vec![DVec3::ZERO; POINTS], ..NaturalDesc::default() };
    for (i, part) in PARTS.iter().enumerate() {
        for (point, place) in points_of(i).into_iter().zip(part.points) {
            desc.points[point as usize] = part.centre + place;
        }
        let (name, points, mass) = (part.name.into(), points_of(i).to_vec(), part.mass_properties()?);
        let (position, rotation) = (part.centre, DQuat::IDENTITY);
        desc.parts.push(NaturalPart { name, points, position, rotation, mass });
    }
    Natural::new(desc.with_edges())
}

fn articulated() -> Result<Articulated, SimError> {
    let part = |part: &Part| {
        let kind = if part.joint.is_some() { JointKind::Ball } else { JointKind::Free };
        let [in_body, in_part] = part.joint.unwrap_or_default();
        Ok(PartDesc {
            name: part.name.into(),
            mass: part.mass_properties()?,
            parent: part.joint.map(|_| BODY),
            joint: JointDesc::new(kind).at(in_body, in_part),
        })
    };
    Articulated::new(PARTS.iter().map(part).collect::<Result<_, SimError>>()?)
}

fn add_rigid(world: &mut World, material: Material, pose: Pose) -> Result<Vec<BodyId>, SimError> {
    let mut bodies = Vec::with_capacity(PARTS.len());
    for part in &PARTS {
        let position = centre(pose) + pose.rotation() * part.centre;
        let body = world.add_rigid_body(RigidBodyDesc {
            rotation: pose.rotation(),
            collider: Some(Collider::new(part.shape(), material)),
            ..RigidBodyDesc::new(position, part.mass, part.shape().inertia(part.mass))
        })?;
        bodies.push(body);
        if let Some([in_body, in_part]) = part.joint {
            let joint = BallJointDesc::new(Anchor::body(bodies[0], in_body), Anchor::body(body, in_part));
            world.add_ball_joint(joint)?;
        }
    }
    Ok(bodies)
}
