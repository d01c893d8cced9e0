//! Shapes and mounts in the words of the wire.

use glam::{DMat3, DQuat, DVec3};
use pita_game::{PartInfo, PartMount};
use pita_protocol::message::{ChainJoint, JointMotion, Mount, MountNode, PartDescription, Shape, Vertex};
use pita_sim::JointKind;

/// Most corners of a mesh on the wire; a larger one is sent in pieces.
const CORNERS_MAX: usize = 65_536;

/// A part in the words of the wire; a surface that is too large for one mesh is several.
pub fn parts(info: &PartInfo) -> impl Iterator<Item = PartDescription> {
    let (slice, mount, rotation) = (info.slice, part_mount(&info.mount), quaternion(info.rotation));
    shapes(&info.shape).into_iter().map(move |shape| PartDescription { slice, mount: mount.clone(), rotation, shape })
}

/// A shape in the words of the wire.
pub fn shapes(shape: &pita_sim::Shape) -> Vec<Shape> {
    let shape = match shape {
        pita_sim::Shape::Mesh(mesh) => return meshes(mesh.vertices(), mesh.triangles()),
        pita_sim::Shape::HalfSpace { normal } => Shape::HalfSpace { normal: vector(*normal) },
        pita_sim::Shape::Ball { radius } => Shape::Ball { radius: *radius as f32 },
        pita_sim::Shape::Box { half } => Shape::Box { half: vector(*half) },
        pita_sim::Shape::Capsule { half_length, radius } => {
            Shape::Capsule { half_length: *half_length as f32, radius: *radius as f32 }
        }
        pita_sim::Shape::Cylinder { half_length, radius, rounding } => {
            Shape::Cylinder { half_length: *half_length as f32, radius: *radius as f32, rounding: *rounding as f32 }
        }
        pita_sim::Shape::Hull { points, radius } => {
            Shape::Hull { points: points.iter().copied().map(vector).collect(), radius: *radius as f32 }
        }
    };
    vec![shape]
}

fn meshes(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<Shape> {
    if vertices.len() <= CORNERS_MAX && triangles.len() <= CORNERS_MAX {
        let points = vertices.iter().copied().map(vector).collect();
        // Indices are below the number of vertices.
        return vec![Shape::Mesh { points, triangles: triangles.iter().map(|t| t.map(|i| i as u16)).collect() }];
    }
    let piece = |triangles: &[[u32; 3]]| Shape::Mesh {
        points: triangles.as_flattened().iter().map(|&corner| vector(vertices[corner as usize])).collect(),
        triangles: (0..triangles.len() as u16).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    };
    triangles.chunks(CORNERS_MAX / 3).map(piece).collect()
}

fn part_mount(mount: &PartMount) -> Mount {
    match mount {
        PartMount::Own => Mount::Own,
        PartMount::Rigid(mount) => rigid(mount),
        // A vertex has no axes: a place that does not lie between points cannot be one.
        PartMount::Skin(vertices) => {
            let vertices: Option<_> = vertices.iter().map(vertex).collect();
            vertices.map_or(Mount::Own, |vertices| Mount::Skin { vertices })
        }
    }
}

fn rigid(mount: &pita_sim::Mount) -> Mount {
    match mount {
        pita_sim::Mount::Body { offset } => Mount::Body { offset: vector(*offset) },
        pita_sim::Mount::Chain { joints, offset } => {
            Mount::Chain { joints: joints.iter().map(joint).collect(), offset: vector(*offset) }
        }
        pita_sim::Mount::Points { nodes, position, deformation } => Mount::Points {
            nodes: nodes.iter().map(node).collect(),
            position: vector(*position),
            deformation: columns(*deformation),
        },
        pita_sim::Mount::Line { points, share, direction, offset } => Mount::Line {
            points: points.map(number),
            share: *share as f32,
            direction: vector(*direction),
            offset: vector(*offset),
        },
    }
}

fn joint(joint: &pita_sim::MountJoint) -> ChainJoint {
    let motion = match joint.kind {
        JointKind::Fixed => JointMotion::Fixed,
        JointKind::Hinge { axis } => JointMotion::Hinge { axis: vector(axis) },
        JointKind::Universal { axes } => JointMotion::Universal { axes: axes.map(vector) },
        JointKind::Ball => JointMotion::Ball,
        JointKind::Slider { axis } => JointMotion::Slider { axis: vector(axis) },
        JointKind::Free => JointMotion::Free,
    };
    ChainJoint {
        motion,
        start: number(joint.start),
        in_parent: vector(joint.in_parent),
        in_part: vector(joint.in_part),
        rest: quaternion(joint.rest),
    }
}

fn node(node: &pita_sim::MountNode) -> MountNode {
    MountNode { point: number(node.point), weight: node.weight as f32, gradient: vector(node.gradient) }
}

fn vertex(mount: &pita_sim::Mount) -> Option<Vertex> {
    let pita_sim::Mount::Points { nodes, position, .. } = mount else { return None };
    let nodes = nodes.iter().map(|node| (number(node.point), node.weight as f32)).collect();
    Some(Vertex { nodes, position: vector(*position) })
}

/// Of a slice that the wire can carry there are fewer than 65536.
fn number(index: u32) -> u16 {
    u16::try_from(index).unwrap_or(u16::MAX)
}

/// To single precision.
pub fn vector(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

/// To single precision, x y z w.
pub fn quaternion(q: DQuat) -> [f32; 4] {
    q.as_quat().to_array()
}

fn columns(m: DMat3) -> [[f32; 3]; 3] {
    [m.x_axis, m.y_axis, m.z_axis].map(vector)
}
