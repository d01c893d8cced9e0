//! Where parts are: poses of shapes from the Q of the slice that they follow, for every kind of DOF.
//!
//! Owns the arithmetic of [`Mount`]s. Descriptions and slices are untrusted: what does not fit together has no pose.

use glam::{DMat3, DQuat, DVec3};
use pita_protocol::{
    dof::Slice,
    message::{ChainJoint, JointMotion, Mount, MountNode, PartDescription},
};

/// Where a shape is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Of the shape's origin, m.
    pub position: DVec3,
    /// The shape's axes to the world's.
    pub rotation: DQuat,
}

impl Pose {
    const WORLD: Self = Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// A place in this frame, in the world.
    pub fn point(&self, local: DVec3) -> DVec3 {
        self.position + self.rotation * local
    }
}

/// Where `part` is drawn, its slice being `slice`. `None` for a skin, whose [vertices] each have a place of their own, for
/// a game's own kinds, and where part and slice do not fit together.
///
/// [vertices]: part_vertices
pub fn part_pose(part: &PartDescription, slice: &Slice) -> Option<Pose> {
    if part.slice != slice.id {
        return None;
    }
    let frame = frame(&part.mount, &slice.q)?;
    let pose = Pose { rotation: frame.rotation * quaternion(&part.rotation)?, ..frame };
    (pose.position.is_finite() && pose.rotation.is_finite()).then_some(pose)
}

/// Where the vertices of a skin are, in the world, m; in the order of the shape's points. `None` for what is no skin, and
/// where part and slice do not fit together.
pub fn part_vertices(part: &PartDescription, slice: &Slice) -> Option<Vec<DVec3>> {
    let Mount::Skin { vertices } = &part.mount else { return None };
    if part.slice != slice.id {
        return None;
    }
    let place = |nodes: &[(u16, f32)], fixed: &[f32; 3]| {
        let shares = nodes.iter().map(|&(number, weight)| Some(f64::from(weight) * point(&slice.q, number)?));
        Some(vector(fixed) + shares.sum::<Option<DVec3>>()?)
    };
    vertices.iter().map(|vertex| place(&vertex.nodes, &vertex.position)).collect()
}

fn frame(mount: &Mount, q: &[f32]) -> Option<Pose> {
    match mount {
        Mount::Body { offset } => {
            let rotation = if q.len() > 3 { quaternion(q.get(3..7)?)? } else { DQuat::IDENTITY };
            let body = Pose { position: vector(q.first_chunk()?), rotation };
            Some(Pose { position: body.point(vector(offset)), rotation })
        }
        Mount::Chain { joints, offset } => {
            let part = joints.iter().try_fold(Pose::WORLD, |parent, joint| carried(&parent, joint, q))?;
            Some(Pose { position: part.point(vector(offset)), rotation: part.rotation })
        }
        Mount::Points { nodes, position, deformation } => {
            let (mut at, mut gradient) = (vector(position), DMat3::from_cols_array_2d(&deformation.map(doubles)));
            for MountNode { point: number, weight, gradient: share } in nodes {
                let x = point(q, *number)?;
                at += f64::from(*weight) * x;
                let [a, b, c] = doubles(*share);
                gradient += DMat3::from_cols(x * a, x * b, x * c);
            }
            Some(Pose { position: at, rotation: rotation_of(gradient) })
        }
        Mount::Line { points: [a, b], share, direction, offset } => {
            let (start, end) = (point(q, *a)?, point(q, *b)?);
            let rest = vector(direction);
            let line = (end - start).try_normalize().unwrap_or(rest);
            let rotation = DQuat::from_rotation_arc(rest.try_normalize()?, line);
            Some(Pose { position: start.lerp(end, f64::from(*share)) + rotation * vector(offset), rotation })
        }
        Mount::Skin { .. } | Mount::Own => None,
    }
}

/// Where a part is that `joint` carries.
fn carried(parent: &Pose, joint: &ChainJoint, q: &[f32]) -> Option<Pose> {
    let q = q.get(usize::from(joint.start)..)?;
    let number = |i: usize| q.get(i).map(|&x| f64::from(x));
    let about = |axis: &[f32; 3], angle: f64| DQuat::from_scaled_axis(vector(axis).normalize_or_zero() * angle);
    let still = DQuat::IDENTITY;
    let (shift, turn) = match &joint.motion {
        JointMotion::Fixed => (DVec3::ZERO, still),
        JointMotion::Hinge { axis } => (DVec3::ZERO, about(axis, number(0)?)),
        JointMotion::Universal { axes: [a, b] } => (DVec3::ZERO, about(a, number(0)?) * about(b, number(1)?)),
        JointMotion::Ball => (DVec3::ZERO, quaternion(q.get(..4)?)?),
        JointMotion::Slider { axis } => (vector(axis) * number(0)?, still),
        JointMotion::Free => (vector(q.first_chunk()?), quaternion(q.get(3..7)?)?),
    };
    let rotation = parent.rotation * turn * quaternion(&joint.rest)?;
    let at = parent.point(vector(&joint.in_parent) + shift);
    Some(Pose { position: at - rotation * vector(&joint.in_part), rotation })
}

/// The rotation nearest to a deformation, its polar decomposition, by Müller et al. 2016: "A Robust Method to Extract the
/// Rotational Part of Deformations". What is squeezed flat or turned inside out has one too.
fn rotation_of(deformation: DMat3) -> DQuat {
    /// Each turn squares the error; from the first guess a handful suffices, and the rest is for what is nearly flat.
    const TURNS_MAX: usize = 40;
    let columns = [deformation.x_axis, deformation.y_axis, deformation.z_axis];
    let [x, y, _] = columns;
    let x = x.try_normalize().unwrap_or(DVec3::X);
    let y = (y - x * x.dot(y)).try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
    let mut rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y)));
    for _ in 0..TURNS_MAX {
        let axes = DVec3::AXES.map(|axis| rotation * axis);
        let turn: DVec3 = axes.iter().zip(columns).map(|(axis, column)| axis.cross(column)).sum();
        let length: f64 = axes.iter().zip(columns).map(|(axis, column)| axis.dot(column)).sum();
        let turn = turn / (length.abs() + 1e-9);
        rotation = (DQuat::from_scaled_axis(turn) * rotation).normalize();
        if turn.length_squared() < 1e-18 {
            break;
        }
    }
    rotation
}

fn point(q: &[f32], number: u16) -> Option<DVec3> {
    Some(vector(q.get(3 * usize::from(number)..)?.first_chunk()?))
}

fn doubles(numbers: [f32; 3]) -> [f64; 3] {
    numbers.map(f64::from)
}

fn vector(numbers: &[f32; 3]) -> DVec3 {
    DVec3::from_array(doubles(*numbers))
}

/// Of length 1; `None` where the numbers have no direction.
fn quaternion(numbers: &[f32]) -> Option<DQuat> {
    let [x, y, z, w] = *numbers.first_chunk::<4>()?;
    let unit = DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into()).normalize();
    unit.is_finite().then_some(unit)
}

#[cfg(test)]
mod tests {
    use proptest::{array::uniform3, prelude::*};

    use super::*;

    proptest! {
        #[test]
        fn stretched_turns_come_out_as_turns(
            turn in uniform3(-3.0..3.0f64),
            stretch in uniform3(0.3..3.0f64),
        ) {
            let rotation = DQuat::from_scaled_axis(DVec3::from_array(turn));
            let deformation = DMat3::from_quat(rotation) * DMat3::from_diagonal(DVec3::from_array(stretch));
            prop_assert!(rotation_of(deformation).angle_between(rotation) < 1e-5);
        }

        #[test]
        fn whatever_is_deformed_has_a_rotation(columns in uniform3(uniform3(-2.0..2.0f64))) {
            prop_assert!(rotation_of(DMat3::from_cols_array_2d(&columns)).is_normalized());
        }
    }

    #[test]
    fn what_does_not_fit_has_no_pose() {
        let slice = Slice { id: 4, kind: 1, tick: 1, groups: Vec::new(), q: vec![1.0, 2.0, 3.0], v: Vec::new() };
        let shape = pita_protocol::message::Shape::Ball { radius: 1.0 };
        let part =
            |slice, mount| PartDescription { slice, mount, rotation: [0.0, 0.0, 0.0, 1.0], shape: shape.clone() };
        let body = Mount::Body { offset: [1.0, 0.0, 0.0] };
        assert_eq!(part_pose(&part(4, body.clone()), &slice).unwrap().position, DVec3::new(2.0, 2.0, 3.0));
        assert_eq!(part_pose(&part(5, body), &slice), None, "another slice");
        let node = |point| MountNode { point, weight: 1.0, gradient: [0.0; 3] };
        let points = |point| Mount::Points { nodes: vec![node(point)], position: [0.0; 3], deformation: [[0.0; 3]; 3] };
        assert!(part_pose(&part(4, points(0)), &slice).is_some());
        assert_eq!(part_pose(&part(4, points(1)), &slice), None, "a point that is not there");
        let joint = |start| ChainJoint {
            motion: JointMotion::Ball,
            start,
            in_parent: [0.0; 3],
            in_part: [0.0; 3],
            rest: [0.0, 0.0, 0.0, 1.0],
        };
        for start in [0, 2, u16::MAX] {
            let chain = Mount::Chain { joints: vec![joint(start)], offset: [0.0; 3] };
            assert_eq!(part_pose(&part(4, chain), &slice), None, "numbers from {start} on");
        }
        assert_eq!(part_pose(&part(4, Mount::Own), &slice), None);
        assert_eq!(part_vertices(&part(4, Mount::Own), &slice), None);
    }
}
