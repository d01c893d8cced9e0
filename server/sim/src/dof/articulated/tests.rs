//! Kinematics against finite differences; what is refused.

use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::mass::{Density, MassProperties};
use crate::{BodyId, FigureDesc, Settings, Shape, World};

fn solid() -> MassProperties {
    Shape::Box { half: DVec3::new(0.1, 0.2, 0.3) }.mass_properties(Density::constant(100.0)).unwrap()
}

fn part(name: &str, parent: Option<u32>, joint: JointDesc) -> PartDesc {
    PartDesc { name: name.into(), mass: solid(), parent, joint }
}

fn vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
}

fn kind() -> impl Strategy<Value = JointKind> {
    let axis = || vector().prop_filter("an axis", |a| a.length() > 0.1);
    prop_oneof![
        Just(JointKind::Fixed),
        Just(JointKind::Ball),
        Just(JointKind::Free),
        axis().prop_map(|axis| JointKind::Hinge { axis }),
        axis().prop_map(|axis| JointKind::Slider { axis }),
        axis().prop_map(|a| JointKind::Universal { axes: [a, a.any_orthogonal_vector() + a] }),
    ]
}

/// A tree of six parts of which something moves.
fn figure() -> impl Strategy<Value = Articulated> {
    let joint = (kind(), vector(), vector(), vector()).prop_map(|(kind, in_parent, in_part, turn)| JointDesc {
        rest: DQuat::from_scaled_axis(turn * 2.0),
        ..JointDesc::new(kind).at(in_parent, in_part)
    });
    let parts = prop::collection::vec((joint, any::<prop::sample::Index>(), 0..6u8), 6);
    parts.prop_filter_map("nothing moves", |parts| {
        let part = |(i, (joint, parent, root)): (usize, (JointDesc, prop::sample::Index, u8))| {
            let parent = (i > 0 && root > 0).then(|| parent.index(i.max(1)) as u32);
            part(&format!("p{i}"), parent, joint)
        };
        Articulated::new(parts.into_iter().enumerate().map(part).collect()).ok()
    })
}

/// A state from as many numbers as are needed, by a step from rest.
fn state(figure: &Articulated, numbers: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut numbers = numbers.iter().copied().cycle();
    let mut draw = || figure.still().iter().map(|_| numbers.next().unwrap()).collect::<Vec<_>>();
    let (moved, v) = (draw(), draw());
    let mut q = figure.rest();
    figure.step(&figure.rest(), &moved, 1.0, &mut q);
    (q, v)
}

/// Twist from `a` to `b` over `dt`, to second order where `a` and `b` lie on either side of the middle.
fn difference(a: &Frame<f64>, b: &Frame<f64>, dt: f64) -> [DVec3; 2] {
    let linear = (DVec3::from(b.position) - DVec3::from(a.position)) / dt;
    let turn: DMat3 = b.rotation.value() * a.rotation.value().transpose();
    [linear, DQuat::from_mat3(&turn).to_scaled_axis() / dt]
}

proptest! {
    /// The frame's twist, as written, is that of central differences along the step, and J v.
    #[test]
    fn frames_move_as_they_say(
        figure in figure(), numbers in prop::collection::vec(-2.0..2.0f64, 37), point in vector(), part in 0..6u32,
    ) {
        let (q, v) = state(&figure, &numbers);
        let at = PartPoint { part, point };
        let frame = figure.frame(at, &q, &v);
        let h = 1e-5;
        let [before, after] = [-h, h].map(|h| {
            let mut moved = q.clone();
            figure.step(&q, &v, h, &mut moved);
            figure.frame(at, &moved, &v)
        });
        let by_difference = difference(&before, &after, 2.0 * h);
        let mut by_columns = [DVec3::ZERO; 2];
        let starts: Vec<usize> =
            figure.blocks.iter().scan(0, |sum, b| Some(std::mem::replace(sum, *sum + usize::from(b.rates)))).collect();
        figure.jacobian(at, &q, &mut |block, columns| {
            let rates = v[starts[block]..].iter().take(usize::from(figure.blocks[block].rates));
            for (column, rate) in columns.iter().zip(rates) {
                by_columns[0] += DVec3::from_slice(column) * *rate;
                by_columns[1] += DVec3::from_slice(&column[3..]) * *rate;
            }
        });
        for (i, written) in [frame.linear, frame.angular].into_iter().map(DVec3::from).enumerate() {
            prop_assert!((by_columns[i] - written).length() < 1e-9, "{} {written}", by_columns[i]);
            prop_assert!((by_difference[i] - written).length() < 1e-5 * (1.0 + written.length()), "{by_difference:?} {written}");
        }
    }

    /// What a joint does not leave stays as it was: the two points of it meet, and axes keep to each other.
    #[test]
    fn joints_hold(figure in figure(), numbers in prop::collection::vec(-2.0..2.0f64, 37)) {
        let (q, v) = state(&figure, &numbers);
        for (index, PartDesc { parent, joint, .. }) in (0u32..).zip(figure.descriptions()) {
            let frame = |part: Option<u32>, point| {
                part.map_or(Frame::point(point, DVec3::ZERO), |part| figure.frame(PartPoint { part, point }, &q, &v))
            };
            let (base, carried) = (frame(*parent, joint.in_parent), frame(Some(index), joint.in_part));
            let gap = DVec3::from(carried.position) - DVec3::from(base.position);
            let turn = |v: DVec3| DVec3::from(base.arm(v));
            let turned = |v: DVec3| DVec3::from(carried.arm(joint.rest.inverse() * v));
            match joint.kind {
                JointKind::Fixed => prop_assert!((turn(DVec3::ONE) - turned(DVec3::ONE)).length() < 1e-9),
                JointKind::Hinge { axis } => prop_assert!((turn(axis) - turned(axis)).length() < 1e-9),
                JointKind::Universal { axes: [a, b] } => {
                    prop_assert!((turn(a).dot(turned(b)) - a.dot(b)).abs() < 1e-9);
                }
                JointKind::Slider { axis } => {
                    prop_assert!(gap.cross(turn(axis)).length() < 1e-9);
                    prop_assert!((turn(DVec3::ONE) - turned(DVec3::ONE)).length() < 1e-9);
                }
                JointKind::Ball | JointKind::Free => {}
            }
            if !matches!(joint.kind, JointKind::Slider { .. } | JointKind::Free) {
                prop_assert!(gap.length() < 1e-9, "{gap}");
            }
        }
    }
}

/// An arm on a joint with a spring, a motor and limits, all of which push.
fn driven(kind: JointKind, limits: Vec<JointLimit>, max_force: f64) -> Articulated {
    let spring = Some(JointSpring { stiffness: 30.0, damping: 2.0 });
    let drive = JointDrive::Position { frequency: 1.0, damping_ratio: 1.0 };
    let motor = Some(JointMotor { drive, max_force });
    let joint = JointDesc { limits, spring, motor, ..JointDesc::new(kind).at(DVec3::ZERO, DVec3::new(0.1, -0.3, 0.2)) };
    Articulated::new(vec![part("arm", None, joint)]).unwrap()
}

fn limited() -> impl Strategy<Value = (JointKind, Vec<JointLimit>)> {
    let limit = |range| JointLimit { range, tolerance: 0.05 };
    let coordinate = move |index| limit(LimitRange::Coordinate { index, lower: -0.2, upper: 0.3 });
    let (a, b) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 2.0, 1.0));
    let swing = limit(LimitRange::Swing { axis: a, upper: 0.4 });
    let twist = limit(LimitRange::Twist { axis: b, lower: -0.1, upper: 0.2 });
    prop_oneof![
        Just((JointKind::Hinge { axis: a }, vec![coordinate(0)])),
        Just((JointKind::Slider { axis: a }, vec![coordinate(0)])),
        Just((JointKind::Universal { axes: [a, b] }, vec![coordinate(0), coordinate(1)])),
        Just((JointKind::Ball, vec![swing])),
        Just((JointKind::Ball, vec![twist])),
    ]
}

const DT: f64 = 1.0 / 30.0;

/// Energy, gradient and Hessian of a figure's own potentials at a state displaced by `h`, rate × dt, along rate `i`.
fn potentials(figure: &Articulated, at: &LocalState, i: usize, h: f64) -> (f64, Vec<f64>, Vec<f64>) {
    let n = at.v1.len();
    let (mut q1, mut v1) = (at.q1.to_vec(), at.v1.to_vec());
    v1[i] += h / DT;
    figure.step(at.q0, &v1, DT, &mut q1);
    let at = LocalState { q1: &q1, v1: &v1, ..*at };
    let (mut gradient, mut hessian) = (vec![0.0; n], vec![0.0; n * n]);
    let energy = figure.energy(&at, &mut gradient);
    figure.stiffness(&at, &mut |_, _, block| {
        (0..n * n).for_each(|k| hessian[k] += block[k / n][k % n]);
    });
    (energy, gradient, hessian)
}

proptest! {
    /// Gradients and Hessians are those of central differences. Where a motor of several rates is at its limit the
    /// energy is an estimate, so none is there. Of what bends on the way the Hessian has the positive part.
    #[test]
    fn joint_potentials_derive(
        (kind, limits) in limited(), numbers in prop::collection::vec(-0.7..0.7f64, 13), strong in any::<bool>(),
    ) {
        let single = kind.size().is_some_and(|size| size.rates == 1);
        let figure = driven(kind, limits, if strong || !single { f64::INFINITY } else { 0.5 });
        let (q0, v0) = state(&figure, &numbers);
        let v1: Vec<_> = v0.iter().map(|v| v * 3.0 + 0.5).collect();
        let (mut q1, mut prepared, controls) = (q0.clone(), Vec::new(), figure.controls());
        figure.step(&q0, &v1, DT, &mut q1);
        let at = LocalState { dt: DT, q0: &q0, v0: &v0, q1: &q1, v1: &v1, controls: &controls, prepared: &[], definite: true };
        figure.prepare(&at, &mut prepared);
        let at = LocalState { prepared: &prepared, ..at };
        let (_, gradient, hessian) = potentials(&figure, &at, 0, 0.0);
        let n = v1.len();
        let size = gradient.iter().fold(1.0, |size: f64, g| size.max(g.abs()));
        let stiff = hessian.iter().fold(1.0, |size: f64, g| size.max(g.abs()));
        for i in 0..n {
            let h = 1e-6;
            let [below, above] = [-h, h].map(|h| potentials(&figure, &at, i, h));
            let slope = (above.0 - below.0) / (2.0 * h);
            prop_assert!((slope - gradient[i]).abs() < 1e-3 * size, "{i}: {slope} {}", gradient[i]);
            let (found, curvature) = (hessian[i * n + i], (above.1[i] - below.1[i]) / (2.0 * h));
            let exact = n < 3 && strong;
            prop_assert!(found >= 0.0 && found > curvature - 1e-2 * stiff, "{i}: {found} {curvature}");
            prop_assert!(!exact || found < curvature + 1e-2 * stiff, "{i}: {found} {curvature}");
        }
    }
}

fn refusal(parts: Vec<PartDesc>) -> String {
    Articulated::new(parts).unwrap_err().to_string()
}

#[test]
fn what_is_wrong_is_named() {
    let free = || part("body", None, JointDesc::new(JointKind::Free));
    let hinge = |axis| JointDesc::new(JointKind::Hinge { axis });
    let leg = |parent, joint| vec![free(), part("left leg", parent, joint)];
    assert_eq!(refusal(vec![]), "number of parts is 0, allowed is 1 to 64");
    assert_eq!(
        refusal(leg(Some(1), hinge(DVec3::X))),
        "part 1 (left leg): parent is 1, allowed is the index of an earlier part"
    );
    assert_eq!(refusal(leg(Some(0), hinge(DVec3::ZERO))), "part 1 (left leg): the joint's axis is zero");
    assert!(refusal(leg(Some(0), hinge(DVec3::NAN))).contains("part 1 (left leg): axis of the joint is NaN"));
    let parallel = JointDesc::new(JointKind::Universal { axes: [DVec3::X, -DVec3::X] });
    assert!(refusal(leg(Some(0), parallel)).contains("sine of the angle between the axes"));
    let mut massless = leg(Some(0), hinge(DVec3::X));
    massless[1].mass.mass = 0.0;
    assert!(refusal(massless).contains("part 1 (left leg): mass is 0"));
    let mut point = leg(Some(0), hinge(DVec3::X));
    point[1].mass = MassProperties::of_point(1.0, DVec3::X).unwrap();
    assert!(refusal(point).contains("part 1 (left leg): smallest moment of inertia"));
    let far = hinge(DVec3::X).at(DVec3::X * f64::INFINITY, DVec3::ZERO);
    assert!(refusal(leg(Some(0), far)).contains("part 1 (left leg): the joint's point in the parent"));
    assert!(
        refusal(vec![part("wall", None, JointDesc::new(JointKind::Fixed))]).contains("nothing of the figure can move")
    );
}

fn add(world: &mut World, figure: &Articulated, q: Vec<f64>) -> Result<BodyId, SimError> {
    let (dof, v) = (std::sync::Arc::new(figure.clone()), figure.still());
    world.add_figure(FigureDesc { dof, q, v, colliders: Vec::new() })
}

#[test]
fn states_that_are_none_are_refused() {
    let figure = Articulated::new(vec![part("body", None, JointDesc::new(JointKind::Free))]).unwrap();
    let mut world = World::new(Settings::at(1.0 / 30.0)).unwrap();
    let mut q = figure.rest();
    q[6] = 0.0;
    let error = add(&mut world, &figure, q.clone()).unwrap_err().to_string();
    assert_eq!(error, "part 0 (body): rotation at the joint is 0, allowed is a quaternion of length 1");
    assert!(add(&mut world, &figure, vec![0.0; 6]).is_err());
    let id = add(&mut world, &figure, figure.rest()).unwrap();
    assert!(world.set_slice(id, &q, &figure.still()).is_err());
    assert!(world.set_slice(id, &figure.rest(), &figure.still()).is_ok());
}

/// Links along x whose ends are pulled outwards: there the geometric stiffness is positive, and all of it is handed over.
/// Σ impulse · x is then flat to first order, and its second differences over the joints' rates are Jᵀ G J.
#[test]
fn geometric_stiffness_is_the_second_difference_of_what_pulls() {
    for kind in
        [JointKind::Hinge { axis: DVec3::Z }, JointKind::Ball, JointKind::Universal { axes: [DVec3::Y, DVec3::Z] }]
    {
        let link = |i: u32| {
            let in_parent = if i == 0 { DVec3::ZERO } else { DVec3::X * 0.7 };
            part("link", i.checked_sub(1), JointDesc::new(kind).at(in_parent, DVec3::X * -0.3))
        };
        let figure = Articulated::new((0..4).map(link).collect()).unwrap();
        // The tip as well, beyond the centres of mass.
        let loads: Vec<_> = (0..4).map(|part| (part, DVec3::ZERO)).chain([(3, DVec3::X * 0.5)]).collect();
        let pulls = [2.0, 1.0, 3.0, 0.5, 4.0].map(|pull| DVec3::X * -pull);
        let place = |q: &[f64]| -> f64 {
            let at =
                |&(part, point): &(u32, DVec3)| figure.frame(PartPoint { part, point }, q, &figure.still()).position;
            loads.iter().map(at).zip(pulls).map(|(x, pull)| pull.dot(x.into())).sum()
        };
        let (q, n) = (figure.rest(), figure.still().len());
        let h = 1e-3;
        let moved = |i: usize, j: usize, a: f64, b: f64| {
            let (mut v, mut q1) = (vec![0.0; n], q.clone());
            v[i] += a * h;
            v[j] += b * h;
            figure.step(&q, &v, 1.0, &mut q1);
            place(&q1)
        };
        let mut stiffness = vec![DMat3::ZERO; 4];
        let centres: Vec<_> =
            (0..4).map(|part| figure.frame(PartPoint { part, point: DVec3::ZERO }, &q, &figure.still())).collect();
        let mut pulled: Vec<_> = loads
            .iter()
            .zip(pulls)
            .map(|(&(part, point), impulse)| PartLoad { at: PartPoint { part, point }, impulse })
            .collect();
        figure.geometric_stiffness(&q, &centres, &mut pulled, &mut |part, g| stiffness[part] += g);
        let mut turns = vec![vec![DVec3::ZERO; n]; 4];
        for (part, turns) in (0..).zip(&mut turns) {
            figure.jacobian(PartPoint { part, point: DVec3::ZERO }, &q, &mut |block, columns| {
                figure.rates_of(block).zip(columns).for_each(|(i, c)| turns[i] = DVec3::from_slice(&c[3..]));
            });
        }
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let second =
                moved(i, j, 1.0, 1.0) - moved(i, j, 1.0, -1.0) - moved(i, j, -1.0, 1.0) + moved(i, j, -1.0, -1.0);
            let expected = second / (4.0 * h * h);
            let found: f64 = stiffness.iter().zip(&turns).map(|(g, turns)| turns[i].dot(*g * turns[j])).sum();
            assert!((found - expected).abs() < 1e-4, "{kind:?} ({i}, {j}): {found} {expected}");
        }
    }
}
