//! How deep boxes are in one another and in level ground: the separating axis test, on all pairs.

use pita_sim::{DMat3, DVec3};

use crate::yardstick::scene::{RigidScene, Shape};
use crate::yardstick::trace::BodyState;

/// Edges whose cross product is shorter are parallel: faces tell their distance.
const PARALLEL: f64 = 1e-2;

/// Half extents of all bodies, which are boxes.
pub fn half_extents(scene: &RigidScene) -> Vec<DVec3> {
    let half = |shape| if let Shape::Box(half) = shape { half } else { DVec3::ZERO };
    scene.bodies().map(|body| half(body.shape)).collect()
}

/// Deepest penetration between two boxes, or of a box below y = 0, m; 0 where nothing touches.
pub fn deepest(boxes: &[BodyState], half_extents: &[DVec3]) -> f64 {
    let solids: Vec<Solid> = boxes.iter().zip(half_extents).map(|(state, &half)| Solid::new(state, half)).collect();
    let mut deepest = solids.iter().map(|solid| -solid.lowest()).fold(0.0, f64::max);
    for (i, a) in solids.iter().enumerate() {
        for b in &solids[i + 1..] {
            let reach = a.radius + b.radius;
            if a.position.distance_squared(b.position) < reach * reach {
                deepest = deepest.max(overlap(a, b));
            }
        }
    }
    deepest
}

struct Solid {
    position: DVec3,
    /// Columns are the box's axes in the world.
    axes: DMat3,
    half: DVec3,
    radius: f64,
}

impl Solid {
    fn new(state: &BodyState, half: DVec3) -> Self {
        let axes = DMat3::from_quat(state.rotation.normalize());
        Self { position: state.position, axes, half, radius: half.length() }
    }

    fn lowest(&self) -> f64 {
        self.position.y - self.reach(DVec3::Y)
    }

    /// From the centre to the furthest point along `axis`, m.
    fn reach(&self, axis: DVec3) -> f64 {
        (self.axes.transpose() * axis).abs().dot(self.half)
    }
}

/// Least overlap along the fifteen axes, m; negative where the boxes are apart.
fn overlap(a: &Solid, b: &Solid) -> f64 {
    let columns = |solid: &Solid| [solid.axes.x_axis, solid.axes.y_axis, solid.axes.z_axis];
    let (of_a, of_b) = (columns(a), columns(b));
    let edges = of_a.iter().flat_map(|a| of_b.iter().map(|b| a.cross(*b)));
    let edges = edges.filter(|edge| edge.length() > PARALLEL).map(DVec3::normalize);
    let apart = b.position - a.position;
    let along = |axis: DVec3| a.reach(axis) + b.reach(axis) - axis.dot(apart).abs();
    of_a.into_iter().chain(of_b).chain(edges).map(along).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pita_sim::DQuat;

    fn cube(x: f64, y: f64, z: f64, rotation: DQuat) -> BodyState {
        let (velocity, angular_velocity) = (DVec3::ZERO, DVec3::ZERO);
        BodyState { position: DVec3::new(x, y, z), rotation, velocity, angular_velocity }
    }

    #[track_caller]
    fn expect(boxes: &[BodyState], depth: f64) {
        let found = deepest(boxes, &vec![DVec3::splat(0.5); boxes.len()]);
        assert!((found - depth).abs() < 1e-12, "{found} is not {depth}");
    }

    #[test]
    fn faces_edges_and_the_ground() {
        let (straight, half) = (DQuat::IDENTITY, 0.5f64.sqrt());
        let eighth = std::f64::consts::FRAC_PI_4;
        expect(&[cube(0.0, 0.48, 0.0, straight)], 0.02);
        expect(&[cube(0.0, half - 0.03, 0.0, DQuat::from_rotation_x(eighth))], 0.03);
        expect(&[cube(0.0, 2.0, 0.0, straight), cube(0.99, 2.3, 0.0, straight)], 0.01);
        expect(&[cube(0.0, 2.0, 0.0, straight), cube(1.01, 2.3, 0.0, straight)], 0.0);
        // Two edges crosswise, each box standing on its edge: apart along y, through the cross product alone.
        let below = cube(0.0, 2.0, 0.0, DQuat::from_rotation_x(eighth));
        expect(&[below, cube(0.0, 2.0 + 2.0 * half - 0.05, 0.0, DQuat::from_rotation_z(eighth))], 0.05);
        expect(&[below, cube(0.0, 2.0 + 2.0 * half + 0.05, 0.0, DQuat::from_rotation_z(eighth))], 0.0);
    }
}
