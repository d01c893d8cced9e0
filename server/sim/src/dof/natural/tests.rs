//! Kinematics by finite differences, mass, and what is refused.

use glam::DMat3;
use proptest::prelude::*;

use super::*;
use crate::mass::{Density, MassProperties};
use crate::{Shape, potential::elasticity::Principal};

fn vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
}

fn block(mass: f64) -> MassProperties {
    let shape = Shape::Box { half: DVec3::new(0.3, 0.2, 0.1) };
    shape.mass_properties(Density::constant(1.0)).unwrap().scaled_to(mass).unwrap()
}

fn part(points: &[u32], position: DVec3, mass: MassProperties) -> NaturalPart {
    NaturalPart { name: "thing".into(), points: points.to_vec(), position, rotation: DQuat::from_rotation_z(0.4), mass }
}

/// A tetrahedron with a box in it, and a line of two of its points' further ones with a rod and a bob.
fn figure() -> NaturalDesc {
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::X * 2.0, DVec3::X * 2.0 + DVec3::Y];
    let line = MassProperties { mass: 2.0, centre: DVec3::ZERO, moments: DMat3::from_diagonal(DVec3::splat(0.2)) };
    let parts = vec![
        part(&[0, 1, 2, 3], DVec3::new(0.2, 0.3, -0.1), block(5.0)),
        NaturalPart { rotation: DQuat::IDENTITY, ..part(&[1, 4], DVec3::X * 1.4, line) },
        part(&[5], DVec3::ONE, block(0.5)),
    ];
    let rods = vec![PointRod::new([4, 5], 1.0)];
    NaturalDesc { points, rods, parts }.with_edges()
}

fn error(change: impl FnOnce(&mut NaturalDesc)) -> String {
    let mut desc = figure();
    change(&mut desc);
    Natural::new(desc).unwrap_err().to_string()
}

proptest! {
    /// Velocity, angular velocity and Jacobian are the derivatives of position and rotation, bent out of shape or not.
    #[test]
    fn kinematics_are_their_own_derivatives(
        point in vector(), turn in vector(), dents in prop::collection::vec(vector(), 6), v in prop::collection::vec(vector(), 6),
    ) {
        let figure = Natural::new(figure()).unwrap();
        let mut q = figure.placed(DVec3::ONE, DQuat::from_scaled_axis(turn * 2.0));
        q.iter_mut().zip(dents.iter().flat_map(DVec3::to_array)).for_each(|(q, dent)| *q += 0.1 * dent);
        let v: Vec<f64> = v.iter().flat_map(DVec3::to_array).collect();
        for part in 0..3 {
            let at = PartPoint { part, point };
            let frame = figure.frame(at, &q, &v);
            let h = 1e-6;
            let moved = |h: f64| {
                let q: Vec<f64> = q.iter().zip(&v).map(|(q, v)| q + h * v).collect();
                figure.frame(at, &q, &v)
            };
            let (above, below) = (moved(h), moved(-h));
            let velocity = (DVec3::from(above.position) - DVec3::from(below.position)) / (2.0 * h);
            prop_assert!((velocity - DVec3::from(frame.linear)).length() < 1e-7, "part {part}");
            let rate = (above.rotation.value() - below.rotation.value()) * (0.5 / h);
            let spin = rate * frame.rotation.value().transpose();
            let spin = DVec3::new(spin.y_axis.z, spin.z_axis.x, spin.x_axis.y);
            prop_assert!((spin - DVec3::from(frame.angular)).length() < 1e-6, "part {part}: {spin} {:?}", frame.angular);
            let mut sum = [0.0; 6];
            figure.jacobian(at, &q, &mut |block, columns| {
                for (column, rate) in columns.iter().zip(&v[3 * block..3 * block + 3]) {
                    sum.iter_mut().zip(column).for_each(|(sum, x)| *sum += x * rate);
                }
            });
            prop_assert!((DVec3::from_slice(&sum) - DVec3::from(frame.linear)).length() < 1e-12);
            prop_assert!((DVec3::from_slice(&sum[3..]) - DVec3::from(frame.angular)).length() < 1e-12);
        }
    }

    /// The constant mass matrix has the mass, the centre of mass and the inertia of the solids in it.
    #[test]
    fn the_mass_matrix_is_that_of_its_parts(position in vector(), turn in vector(), velocity in vector(), spin in vector()) {
        let desc = NaturalDesc { rods: Vec::new(), parts: figure().parts[..1].to_vec(), points: figure().points[..4].to_vec() };
        let NaturalPart { position: at, rotation, .. } = desc.parts[0];
        let figure = Natural::new(desc.with_edges()).unwrap();
        let turn = DQuat::from_scaled_axis(turn);
        let q = figure.placed(position, turn);
        let props = block(5.0).moved(at, rotation).moved(position, turn);
        let v = figure.moving(&q, props.centre, velocity, spin);
        let desc = super::super::FigureDesc { dof: std::sync::Arc::new(figure), q, v, colliders: Vec::new() };
        let (q, v) = (desc.q.clone(), desc.v.clone());
        let motion = super::super::FigureBody::new(desc, Vec::new()).motion(&q, &v);
        let angular = props.inertia() * spin;
        prop_assert!((motion.momentum - 5.0 * velocity).length() < 1e-12);
        prop_assert!((motion.moment - 5.0 * props.centre).length() < 1e-12);
        prop_assert!((motion.angular_momentum - props.centre.cross(5.0 * velocity) - angular).length() < 1e-12);
        prop_assert!((motion.energy - 2.5 * velocity.length_squared() - 0.5 * spin.dot(angular)).abs() < 1e-12);
    }
}

/// Frames of what has its shape are those of a rigid body; a part in two points turns the shortest way.
#[test]
fn parts_follow_rigid_motions() {
    let figure = Natural::new(figure()).unwrap();
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 0.7));
    let q = figure.placed(DVec3::X * 3.0, turn);
    let v = figure.moving(&q, DVec3::X * 3.0, DVec3::Y, DVec3::Z * 2.0);
    for (index, part) in (0..).zip(&figure.description().parts) {
        let frame = figure.frame(PartPoint { part: index, point: DVec3::ZERO }, &q, &v);
        let place = DVec3::X * 3.0 + turn * part.position;
        if index < 2 {
            assert!((DVec3::from(frame.position) - place).length() < 1e-12);
            assert!(
                (DVec3::from(frame.linear) - DVec3::Y - (DVec3::Z * 2.0).cross(place - DVec3::X * 3.0)).length() < 1e-9
            );
        }
        if index == 0 {
            assert!((frame.rotation.value() - DMat3::from_quat(turn * part.rotation)).x_axis.length() < 1e-12);
            assert!((DVec3::from(frame.angular) - DVec3::Z * 2.0).length() < 1e-12);
        }
    }
    let line = figure.frame(PartPoint { part: 1, point: DVec3::X }, &q, &v);
    assert!((line.place(DVec3::ZERO) - (DVec3::X * 3.0 + turn * (DVec3::X * 2.4))).length() < 1e-12);
}

/// What is squashed flat or turned inside out still has a rotation, and one that does not jump.
#[test]
fn crushed_parts_have_finite_frames() {
    let figure = Natural::new(figure()).unwrap();
    let mut q = figure.placed(DVec3::ZERO, DQuat::IDENTITY);
    for height in [0.5, 0.0, -0.5] {
        q[11] = height;
        let mut v = vec![0.0; q.len()];
        v[11] = -1.0;
        for part in 0..3 {
            let frame = figure.frame(PartPoint { part, point: DVec3::ONE }, &q, &v);
            assert!(frame.place(DVec3::ONE).is_finite() && frame.angular.value().length() < 100.0);
            assert!((frame.rotation.value().determinant() - 1.0).abs() < 1e-12);
        }
    }
    assert!(Principal::of(DMat3::ZERO).u.is_finite());
}

#[test]
fn bad_figures_are_refused_by_name() {
    let refusals = [
        (error(|f| f.points[3] = DVec3::X * f64::NAN), "point 3: position is NaN"),
        (error(|f| f.points.clear()), "number of points is 0"),
        (error(|f| f.rods[0].points[1] = 9), "rod 0 (points 4 and 9): point is 9"),
        (error(|f| f.rods[0].points = [4, 4]), "both ends are at the same point"),
        (error(|f| f.rods[0].length = 1.01), "rod 0 (points 4 and 5): length is 1.01"),
        (error(|f| f.rods[0].length = 0.0), "length is 0"),
        (error(|f| f.points[5] = f.points[4]), "rod 0 (points 4 and 5): length is 1"),
        (error(|f| f.rods[0].tolerance = -1.0), "tolerance is -1"),
        (error(|f| _ = f.rods.remove(0)), "point 5: no rods lead from here to point 0"),
        (error(|f| _ = f.rods.remove(1)), "part 0 (thing): two of its points have no rod"),
        (error(|f| f.parts[0].points[3] = 2), "part 0 (thing): it is embedded in a point twice"),
        (error(|f| _ = f.parts[0].points.pop()), "part 0 (thing): a part is embedded in 1, 2 or 4 points"),
        (error(|f| f.parts[0].mass.mass = 0.0), "part 0 (thing): mass is 0"),
        (error(|f| f.parts[0].rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0)), "part 0 (thing): rotation is 2"),
        (error(|f| f.parts[1].position.y += 0.1), "part 1 (thing): its centre of mass is not on the line"),
        (error(|f| f.parts[0].mass.moments = DMat3::ZERO), "has no mass of its own"),
        (error(|f| _ = f.parts.pop()), "point 5: has no mass of its own"),
    ];
    for (message, expected) in refusals {
        assert!(message.contains(expected), "{message:?} lacks {expected:?}");
    }
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.5, 0.5, 1e-3)];
    let desc = NaturalDesc {
        points: flat.to_vec(),
        rods: Vec::new(),
        parts: vec![part(&[0, 1, 2, 3], DVec3::ZERO, block(1.0))],
    };
    assert!(Natural::new(desc.with_edges()).unwrap_err().to_string().contains("in a plane"));
    let figure = Natural::new(figure()).unwrap();
    let mut q = figure.placed(DVec3::ZERO, DQuat::IDENTITY);
    q[15] += 5.0;
    assert!(figure.check(&q, &[]).unwrap_err().to_string().contains("rod 0 (points 4 and 5)"));
}
