//! Every potential three ways: as written, by automatic differentiation, by finite differences.

use glam::DQuat;
use proptest::prelude::*;

use super::alignment::{Aligned, Alignment};
use super::anti_roll_bar::AntiRollTerm;
use super::axle::AxleTerm;
use super::ball_joint::BallJointTerm;
use super::contact::{Approach, ContactTerm};
use super::hold::{Memory, Scale};
use super::limit::AngleLimitTerm;
use super::motor::MotorTerm;
use super::pd::PdTerm;
use super::rod::RodTerm;
use super::rolling::RollingTerm;
use super::slider::LineTerm;
use super::spring::SpringTerm;
use super::universal_joint::RightAngle;
use super::*;
use crate::autodiff::Dual;
use crate::collide::ContactPoint;
use crate::dof::articulated::JointDrive;
use crate::dof::{Node, Pose};
use crate::settings::ContactSettings;

pub(super) const DT: f64 = 1.0 / 30.0;

/// Joints with a stiffness of 1 kN/m.
const SCALE: Scale = Scale { unit: 1.0, least: 1e3, reach: 0.0, strongest: 1e9 };

/// The frame after a displacement of size `h` along its `i`th coordinate of six.
fn moved(frame: &Frame<f64>, i: usize, h: f64) -> Frame<f64> {
    let mut frame = *frame;
    let axis = DVec3::AXES[i % 3];
    if i < 3 {
        frame.position += (axis * h).into();
        frame.linear += (axis * (h / DT)).into();
    } else {
        let turned = DMat3::from_quat(DQuat::from_scaled_axis(axis * h)) * frame.rotation.value();
        frame.rotation = crate::autodiff::Mat3::constant(turned);
        frame.angular += (axis * (h / DT)).into();
    }
    frame
}

fn unit(i: usize) -> Twist {
    let axis = DVec3::AXES[i % 3];
    if i < 3 { Twist { linear: axis, ..Twist::REST } } else { Twist { angular: axis, ..Twist::REST } }
}

fn flat(wrenches: [Wrench; 2]) -> [f64; 12] {
    let [a, b] = wrenches.map(|w| [w.force.x, w.force.y, w.force.z, w.torque.x, w.torque.y, w.torque.z]);
    std::array::from_fn(|i| if i < 6 { a[i] } else { b[i - 6] })
}

fn shifted(at: &[Frame<f64>; 2], i: usize, h: f64) -> [Frame<f64>; 2] {
    let mut at = *at;
    at[i / 6] = moved(&at[i / 6], i % 6, h);
    at
}

fn evaluate(term: &impl Term, at: &[Frame<f64>; 2]) -> (f64, [f64; 12]) {
    let (energy, wrenches) = term.evaluate(DT, [&at[0], &at[1]]);
    (energy, flat(wrenches))
}

/// The gradient, as written, is the energy's, by automatic differentiation and by central differences.
pub(super) fn check_gradient(term: &impl Term, at: &[Frame<f64>; 2]) {
    let (_, written) = evaluate(term, at);
    let size = written.iter().fold(1e-9, |size: f64, g| size.max(g.abs()));
    let seed = |frame: usize| {
        let along = |i: usize| if i / 6 == frame { unit(i % 6) } else { Twist::REST };
        at[frame].along::<12>(std::array::from_fn(along), DT)
    };
    let automatic: Dual<12> = term.evaluate(DT, [&seed(0), &seed(1)]).0;
    for (i, expected) in written.into_iter().enumerate() {
        let h = 1e-6;
        let difference = (evaluate(term, &shifted(at, i, h)).0 - evaluate(term, &shifted(at, i, -h)).0) / (2.0 * h);
        assert!((automatic.tangent[i] - expected).abs() < 1e-9 * size, "{i}: AD {} {expected}", automatic.tangent[i]);
        assert!((difference - expected).abs() < 1e-4 * size, "coordinate {i}: {difference} {expected}");
    }
}

/// Derivative of the gradient by automatic differentiation, row i column j; checked against central differences to
/// `accuracy` of its largest diagonal entry.
#[allow(clippy::needless_range_loop)] // The loops run over both indices of a matrix.
pub(super) fn automatic_hessian(term: &impl Term, at: &[Frame<f64>; 2], accuracy: f64) -> [[f64; 12]; 12] {
    let mut hessian = [[0.0; 12]; 12];
    for j in 0..12 {
        let seed = |frame: usize| {
            let direction = if j / 6 == frame { unit(j % 6) } else { Twist::REST };
            at[frame].along::<1>([direction], DT)
        };
        let (_, wrenches) = term.evaluate(DT, [&seed(0), &seed(1)]);
        for (frame, w) in wrenches.into_iter().enumerate() {
            let column = [w.force.x, w.force.y, w.force.z, w.torque.x, w.torque.y, w.torque.z];
            (0..6).for_each(|i| hessian[6 * frame + i][j] = column[i].tangent[0]);
        }
    }
    let size = (0..12).map(|i| hessian[i][i].abs()).fold(1e-9, f64::max);
    for j in 0..12 {
        let h = 1e-7;
        let (above, below) = (evaluate(term, &shifted(at, j, h)).1, evaluate(term, &shifted(at, j, -h)).1);
        for i in 0..12 {
            let difference = (above[i] - below[i]) / (2.0 * h);
            assert!((difference - hessian[i][j]).abs() < accuracy * size, "({i}, {j}): {difference} {}", hessian[i][j]);
        }
    }
    hessian
}

/// The Hessian, as written, is the automatic one, to a fraction of its largest entry.
pub(super) fn check_hessian(term: &impl Term, at: &[Frame<f64>; 2], accuracy: f64) {
    let automatic = automatic_hessian(term, at, accuracy);
    let hessian = term.hessian(DT, [&at[0], &at[1]]);
    let (aa, ab, bb) = (hessian.own::<6>(0), hessian.between::<6>(), hessian.own::<6>(1));
    let size = (0..12).map(|i| automatic[i][i].abs()).fold(1e-9, f64::max);
    for (i, j) in (0..12).flat_map(|i| (0..12).map(move |j| (i, j))) {
        let written = match (i / 6, j / 6) {
            (0, 0) => aa[i][j],
            (0, _) => ab[i][j - 6],
            (_, 0) => ab[j][i - 6],
            _ => bb[i - 6][j - 6],
        };
        assert!(
            (written - automatic[i][j]).abs() < accuracy * size,
            "({i}, {j}): {written} {} of {size}",
            automatic[i][j]
        );
    }
}

pub(super) fn vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
}

pub(super) fn direction() -> impl Strategy<Value = DVec3> {
    vector().prop_filter("too short", |v| v.length() > 0.1).prop_map(DVec3::normalize)
}

pub(super) fn frame() -> impl Strategy<Value = Frame<f64>> {
    (vector(), vector(), vector(), vector()).prop_map(|(position, turn, linear, angular)| {
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(turn * 2.0));
        Frame::new(position * 3.0, rotation, linear, angular)
    })
}

pub(super) fn ends(a: DVec3, b: DVec3) -> [End; 2] {
    [End { frame: 0, point: a }, End { frame: 1, point: b }]
}

fn node(mass: f64, inertia: DVec3, at: &Frame<f64>) -> Node {
    let start = Pose { position: at.position.into(), rotation: DQuat::from_mat3(&at.rotation.value()) };
    Node {
        start,
        free_rotation: start.rotation,
        free_spin: DVec3::ZERO,
        target: Twist::REST,
        before: Twist::REST,
        impulse: Twist::REST,
        mass,
        inertia: DMat3::from_diagonal(inertia),
        inverse_inertia: DMat3::from_diagonal(inertia.recip()),
        rotates: true,
        wheel_axis: None,
        guessed_spin: None,
    }
}

fn spring(points: [DVec3; 2], rest_length: f64, damping: f64, start_length: f64) -> SpringTerm {
    // The anchors' bodies do not matter to the term.
    let [a, b] = points.map(Anchor::world);
    let desc = SpringDesc { a, b, rest_length, stiffness: 300.0, damping };
    SpringTerm::new(ends(points[0], points[1]), &desc, start_length)
}

fn contact(normal: DVec3, gap: f64, anchor: DVec3, arms: [DVec3; 2], normal_force: f64) -> ContactTerm {
    let mut point = ContactPoint::at(DVec3::ZERO, normal, gap, 0.7);
    point.anchor = anchor - normal * normal.dot(anchor);
    (point.normal_force, point.load) = (normal_force, normal_force);
    ContactTerm::new([0, 1], &point, arms, 2.0, Approach::default(), &ContactSettings::default(), DT)
}

proptest! {
    #[test]
    fn rolling_derives(
        n in vector(), turn in vector(), force in 1.0..500.0f64, speed in prop_oneof![Just(1.0), Just(1e-3)],
        t in frame(), u in frame(),
    ) {
        prop_assume!(n.length() > 0.1);
        let mut point = ContactPoint::at(DVec3::ZERO, n.normalize(), 0.0, 0.7);
        // Saturated, and not.
        (point.turn, point.normal_force) = (turn * 0.01 * speed, force);
        (point.surface.rolling_resistance, point.surface.spinning_resistance) = (0.05, 0.2);
        let contact = contact(point.normal, 0.0, DVec3::ZERO, [DVec3::ZERO; 2], force);
        let term = RollingTerm::new(contact, &point, 400.0);
        let slow = |f: Frame<f64>| Frame { angular: f.angular * speed, ..f };
        check_gradient(&term, &[slow(t), slow(u)]);
        automatic_hessian(&term, &[slow(t), slow(u)], 1e-2);
    }

    #[test]
    fn spring_derives(a in vector(), b in vector(), rest in 0.0..2.0, l0 in 0.1..2.0, t in frame(), u in frame()) {
        prop_assume!((t.place(a) - u.place(b)).length() > 0.1);
        let term = spring([a, b], rest, 7.0, l0);
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn spring_between_origins_has_the_exact_hessian_in_tension(t in frame(), u in frame()) {
        prop_assume!(DVec3::from(t.position - u.position).length() > 0.1);
        check_hessian(&spring([DVec3::ZERO; 2], 0.0, 0.0, 0.0), &[t, u], 1e-5);
    }

    #[test]
    fn rod_derives(a in vector(), b in vector(), length in 0.1..3.0f64, t in frame(), u in frame()) {
        prop_assume!((t.place(a) - u.place(b)).length() > 0.1);
        let term = RodTerm::new(ends(a, b), [length; 2], 1e-3, SCALE, Memory::default());
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn rod_of_the_right_length_has_the_exact_hessian(a in vector(), b in vector(), t in frame(), u in frame()) {
        let length = (t.place(a) - u.place(b)).length();
        prop_assume!(length > 0.1);
        let mut term = RodTerm::new(ends(a, b), [length; 2], 1e-3, SCALE, Memory::default());
        term.relinearise(DT, [&t, &u]);
        check_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn stretched_rod_between_points_has_the_exact_hessian(length in 0.1..0.9, t in frame(), u in frame()) {
        let distance = DVec3::from(t.position - u.position).length();
        prop_assume!(distance > 0.1);
        let mut term = RodTerm::new(ends(DVec3::ZERO, DVec3::ZERO), [distance * length; 2], 1e-3, SCALE, Memory::default());
        term.relinearise(DT, [&t, &u]);
        term.propose([Twist::REST; 2]);
        check_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn ball_joint_derives(a in vector(), b in vector(), t in frame(), u in frame()) {
        let term = BallJointTerm::new(ends(a, b), 1e-3, SCALE, Memory::default());
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn closed_ball_joint_has_the_exact_hessian(a in vector(), b in vector(), t in frame(), mut u in frame()) {
        u.position = t.position + t.arm(a) - u.arm(b);
        let mut term = BallJointTerm::new(ends(a, b), 1e-3, SCALE, Memory::default());
        term.relinearise(DT, [&t, &u]);
        check_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn rope_derives_taut_and_slack(a in vector(), b in vector(), length in 0.1..3.0f64, t in frame(), u in frame()) {
        let distance = (t.place(a) - u.place(b)).length();
        prop_assume!(distance > 0.1 && (distance - length).abs() > 1e-4);
        let mut term = RodTerm::new(ends(a, b), [0.0, length], 1e-3, SCALE, Memory::default());
        term.relinearise(DT, [&t, &u]);
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
        prop_assert_eq!(term.evaluate(DT, [&t, &u]).0 > 0.0, distance > length);
        if distance < length {
            check_hessian(&term, &[t, u], 1e-9);
        }
    }

    #[test]
    fn hinge_and_fixed_joint_derive(a in vector(), b in vector(), axes in prop::array::uniform6(direction()), t in frame(), u in frame()) {
        let place = BallJointTerm::new(ends(a, b), 1e-3, SCALE, Memory::default());
        let [p, q, r, s, v, w] = axes;
        let hinge = Aligned { place: place.clone(), turns: Alignment::new([[p, q]], 1e-3, SCALE, Memory::default()) };
        check_gradient(&hinge, &[t, u]);
        automatic_hessian(&hinge, &[t, u], 1e-5);
        let turns = Alignment::new([[p, q], [r, s], [v, w]], 1e-3, SCALE, Memory::default());
        let fixed = Aligned { place, turns };
        check_gradient(&fixed, &[t, u]);
        automatic_hessian(&fixed, &[t, u], 1e-5);
    }

    #[test]
    fn closed_joints_have_the_exact_hessian(a in vector(), b in vector(), axis in direction(), t in frame(), mut u in frame()) {
        u.position = t.position + t.arm(a) - u.arm(b);
        let both = |axis: DVec3| [axis, u.rotation.transposed_multiply(t.arm(axis)).into()];
        let place = BallJointTerm::new(ends(a, b), 1e-3, SCALE, Memory::default());
        let turns = Alignment::new([both(axis)], 1e-3, SCALE, Memory::default());
        let mut hinge = Aligned { place: place.clone(), turns };
        hinge.relinearise(DT, [&t, &u]);
        check_hessian(&hinge, &[t, u], 1e-5);
        let turns = Alignment::new(DVec3::AXES.map(both), 1e-3, SCALE, Memory::default());
        let mut fixed = Aligned { place, turns };
        fixed.relinearise(DT, [&t, &u]);
        check_hessian(&fixed, &[t, u], 1e-5);
    }

    #[test]
    fn universal_joint_derives(a in vector(), b in vector(), x in direction(), y in direction(), t in frame(), u in frame()) {
        let place = BallJointTerm::new(ends(a, b), 1e-3, SCALE, Memory::default());
        let term = Aligned { place, turns: RightAngle::new([x, y], 1e-3, SCALE, Memory::default()) };
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn closed_universal_joint_has_the_exact_hessian(a in vector(), b in vector(), x in direction(), t in frame(), mut u in frame()) {
        u.position = t.position + t.arm(a) - u.arm(b);
        let across = u.rotation.transposed_multiply(t.arm(x.any_orthonormal_vector())).into();
        let place = BallJointTerm::new(ends(a, b), 1e-3, SCALE, Memory::default());
        let mut term = Aligned { place, turns: RightAngle::new([x, across], 1e-3, SCALE, Memory::default()) };
        term.relinearise(DT, [&t, &u]);
        check_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn line_derives(a in vector(), b in vector(), axis in direction(), t in frame(), u in frame()) {
        let term = LineTerm::new(ends(a, b), axis, 1e-3, SCALE, Memory::default());
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn point_on_its_line_has_the_exact_hessian(a in vector(), b in vector(), axis in direction(), along in -3.0..3.0, t in frame(), mut u in frame()) {
        u.position = t.position + t.arm(a + axis * along) - u.arm(b);
        let mut term = LineTerm::new(ends(a, b), axis, 1e-3, SCALE, Memory::default());
        term.relinearise(DT, [&t, &u]);
        check_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn angle_limit_derives(axis in direction(), lower in -3.0..3.0f64, range in 0.0..3.0f64, t in frame(), u in frame()) {
        let (zero, _) = axis.any_orthonormal_pair();
        let desc = AngleLimitDesc::new(HingeId::default(), lower, lower + range);
        let term = AngleLimitTerm::new([0, 1], [[axis; 2], [zero; 2]], &desc, SCALE, Memory::default());
        // Neither at the kinks (a bound, the far side) nor where the axes are so far apart that there is no angle.
        let angle = limit::hinge_angle([[axis; 2], [zero; 2]], [&t, &u]);
        let off = (angle - lower - range / 2.0).sin_cos();
        let off = off.0.atan2(off.1).abs();
        prop_assume!((off - range / 2.0).abs() > 1e-3 && off < 3.1);
        prop_assume!(t.arm(axis).cross(u.arm(zero)).length() > 0.3);
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-4);
    }

    #[test]
    fn motor_derives(axis in direction(), target in -3.0..3.0, limit in 1.0..100.0, a in vector(), b in vector(), t in frame(), u in frame()) {
        let motor = Motor { target_speed: target, gain: 60.0, max_torque: limit };
        for term in [MotorTerm::turning([0, 1], motor, axis), MotorTerm::sliding([0, 1], motor, axis, [a, b])] {
            check_gradient(&term, &[t, u]);
            automatic_hessian(&term, &[t, u], 1e-5);
        }
        let motor = Motor { max_torque: 1e6, ..motor };
        check_hessian(&MotorTerm::turning([0, 1], motor, axis), &[t, u], 1e-5);
        check_hessian(&MotorTerm::sliding([0, 1], motor, axis, [a, b]), &[t, u], 1e-5);
    }

    #[test]
    fn axle_derives(t in frame(), u in frame(), hub in vector(), steer in -1.0..1.0, target in -3.0..3.0, brake in 0.0..200.0) {
        let control = AxleControl { steer, drive: Motor { target_speed: target, gain: 60.0, max_torque: 90.0 }, brake };
        let (chassis, wheel) = (BodyId::default(), BodyId::default());
        let desc = AxleDesc { chassis, wheel, hub, stiffness: 400.0, damping: 30.0, control };
        let nodes = [node(10.0, DVec3::new(1.0, 2.0, 2.5), &t), node(1.0, DVec3::new(0.1, 0.1, 0.2), &u)];
        let term = AxleTerm::new([0, 1], &desc, [&nodes[0], &nodes[1]], 3.0, DT);
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn axle_in_its_place_has_the_exact_hessian(t in frame(), mut u in frame(), hub in vector(), target in -3.0..3.0) {
        (u.position, u.rotation) = (t.position + t.arm(hub), t.rotation);
        let drive = Motor { target_speed: target, gain: 60.0, max_torque: 1e6 };
        let control = AxleControl { steer: 0.0, drive, brake: 0.0 };
        let (chassis, wheel) = (BodyId::default(), BodyId::default());
        let desc = AxleDesc { chassis, wheel, hub, stiffness: 400.0, damping: 0.0, control };
        let nodes = [node(10.0, DVec3::new(1.0, 2.0, 2.5), &t), node(1.0, DVec3::new(0.1, 0.1, 0.2), &u)];
        let term = AxleTerm::new([0, 1], &desc, [&nodes[0], &nodes[1]], 3.0, DT);
        check_hessian(&term, &[t, u], 1e-5);
    }

    #[test]
    fn anti_roll_bar_derives(t in frame(), u in frame(), hub in vector(), other in -0.3..0.3) {
        let (chassis, wheel, control) = (BodyId::default(), BodyId::default(), AxleControl::default());
        let axle = AxleDesc { chassis, wheel, hub, stiffness: 400.0, damping: 30.0, control };
        let term = AntiRollTerm::new([0, 1], &axle, 200.0, other);
        check_gradient(&term, &[t, u]);
        automatic_hessian(&term, &[t, u], 1e-5);
        // Where it is slack nothing bends, and what is written is exact.
        let slack = Frame { position: t.position + t.arm(hub + DVec3::Y * other), ..u };
        check_hessian(&term, &[t, slack], 1e-5);
    }

    #[test]
    fn contact_derives(
        n in vector(), gap in -0.05..0.02, anchor in vector(), a in vector(), b in vector(), force in 0.0..1e4,
        t in frame(), u in frame(),
    ) {
        prop_assume!(n.length() > 0.1);
        let slow = |f: Frame<f64>| Frame { linear: f.linear * 0.3, angular: f.angular * 0.3, ..f };
        let term = contact(n.normalize(), gap, anchor * 0.01, [a, b], force);
        check_gradient(&term, &[slow(t), slow(u)]);
        automatic_hessian(&term, &[slow(t), slow(u)], 1e-3);
    }

    #[test]
    fn frictionless_contact_has_the_exact_hessian(n in vector(), a in vector(), b in vector(), t in frame(), u in frame()) {
        prop_assume!(n.length() > 0.1);
        check_hessian(&contact(n.normalize(), -0.1, DVec3::ZERO, [a, b], 0.0), &[t, u], 1e-4);
    }

    /// Of second order, and of first: the velocity potential.
    #[test]
    fn pd_controller_derives(
        target in vector(), velocity in vector(), point in vector(), max_force in 1.0..1e4f64, t in frame(),
        drive in prop_oneof![
            Just(JointDrive::Position { frequency: 1.0, damping_ratio: 1.0 }),
            Just(JointDrive::Velocity { time_constant: 0.2 }),
        ],
    ) {
        let control = PdControl { target, target_velocity: velocity };
        let controller = |point: DVec3, max_force: f64| {
            let desc = PdDesc { at: Anchor::body(BodyId::default(), point), drive, max_force, control };
            let start = t.place(point) + target * 0.1;
            PdTerm::new(End { frame: 0, point }, &desc, drive.gains(DT).unwrap(), 5.0, start, DT)
        };
        let at = [t, Frame::WORLD];
        let (_, asked) = evaluate(&controller(point, f64::INFINITY), &at);
        // Off the kink where the limit begins.
        prop_assume!((DVec3::from_slice(&asked).length() / max_force - 1.0).abs() > 1e-3);
        let term = controller(point, max_force);
        check_gradient(&term, &at);
        automatic_hessian(&term, &at, 1e-5);
        // At a body's centre nothing bends, and what is written is exact where the force is below its limit.
        let centred = controller(DVec3::ZERO, f64::INFINITY);
        let automatic = automatic_hessian(&centred, &at, 1e-5);
        let written = centred.hessian(DT, [&at[0], &at[1]]).own::<6>(0);
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            prop_assert!((written[i][j] - automatic[i][j]).abs() < 1e-5 * automatic[0][0], "({i}, {j}): {written:?}");
        }
    }

    #[test]
    fn geometric_stiffness_is_the_positive_part(f in vector(), r in vector()) {
        let along = f.dot(r);
        let whole = (outer(f, r) + outer(r, f)) * 0.5 - DMat3::from_diagonal(DVec3::splat(along));
        let positive = geometric_stiffness(f, r);
        let negative = positive - whole;
        // Both parts are semidefinite, and they are orthogonal to each other.
        for part in [positive, negative] {
            for x in [DVec3::X, DVec3::Y, DVec3::Z, f, r, f + r, f - r, f.cross(r)] {
                prop_assert!(x.dot(part * x) > -1e-9, "{part}");
            }
        }
        let product = positive * negative;
        prop_assert!(product.x_axis.length() + product.y_axis.length() + product.z_axis.length() < 1e-6);
    }
}
