//! Hinges, sliders, fixed joints, limits and motors between any two kinds.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use pita_sim::mass::Density;
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Anchor, AngleLimitDesc, Articulated, BodyId, DVec3, DistanceLimitDesc, Driven, FigureDesc, FiniteElements,
    FixedJointDesc, HingeDesc, HingeId, JointDesc, JointDrive, JointKind, Motor, MotorDesc, PartDesc, PartPoint,
    PdControl, PdDesc, RigidBodyDesc, Shape, SliderDesc, World,
};

use super::{DT, particle, precise, weightless, world};

const G: f64 = 9.81;

fn rigid(world: &mut World, mass: f64, half: DVec3, position: DVec3) -> BodyId {
    let inertia = Shape::Box { half }.inertia(mass);
    world.add_rigid_body(RigidBodyDesc::new(position, mass, inertia)).unwrap()
}

/// A bar of 1.2 m along −y on a hinge about z at the origin.
fn pendulum(world: &mut World, mass: f64) -> (BodyId, HingeId) {
    let half = DVec3::new(0.02, 0.6, 0.02);
    let bar = rigid(world, mass, half, DVec3::Y * -0.6);
    let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(bar, DVec3::Y * 0.6));
    (bar, world.add_hinge(HingeDesc::new(a, b, DVec3::Z, DVec3::Z * 2.0)).unwrap())
}

/// Implicit Euler turns the phase by atan(ω dt) a tick and leaves 1/√(1 + ω²dt²) of the swing.
#[test]
fn a_pendulum_on_a_hinge_keeps_its_plane_its_period_and_its_decay() {
    let mut world = precise(DVec3::Y * -G);
    let (bar, hinge) = pendulum(&mut world, 2.0);
    let (inertia, rate) = (2.0 * (0.04f64.powi(2) + 1.2f64.powi(2)) / 12.0 + 2.0 * 0.36, 1e-2);
    let omega = (2.0 * G * 0.6 / inertia).sqrt();
    world.set_velocity(bar, DVec3::X * 0.6 * rate, DVec3::Z * rate).unwrap();
    let (turn, kept) = ((omega * DT).atan(), 1.0 / (1.0 + (omega * DT).powi(2)).sqrt());
    for n in 1..=120 {
        let report = world.step().clone();
        // sin(n φ)/ω is where a swing through 0 at `rate` is after n ticks.
        let expected = rate / omega * kept.powi(n) * (f64::from(n) * turn).sin();
        let angle = world.hinge_angle(hinge).unwrap();
        assert!((angle - expected).abs() < 2e-2 * rate / omega, "tick {n}: {angle} {expected}");
        assert!(world.position(bar).unwrap().z.abs() < 1e-6, "tick {n}");
        assert!(report.worst_joint_gap <= 1e-3 && report.worst_joint_tilt <= 1e-3 && report.open_joints == 0);
    }
}

/// Loads across the axis tilt it by no more than the tolerance, and the turn about it stays free.
#[test]
fn a_hinge_carries_a_load_far_off_its_axis() {
    for (door, load) in [(20.0, 0.1), (1.0, 1000.0)] {
        let mut world = world();
        let post = rigid(&mut world, 50.0, DVec3::new(0.1, 1.0, 0.1), DVec3::ZERO);
        let foot = Anchor::body(post, DVec3::Y * -1.0);
        world.add_fixed_joint(FixedJointDesc::new(Anchor::world(DVec3::Y * -1.0), foot)).unwrap();
        let leaf = rigid(&mut world, door, DVec3::new(0.5, 0.9, 0.03), DVec3::X * 0.6);
        let (a, b) = (Anchor::body(post, DVec3::X * 0.1), Anchor::body(leaf, DVec3::X * -0.5));
        let hinge = world.add_hinge(HingeDesc::new(a, b, DVec3::Y, DVec3::Y)).unwrap();
        let weight = rigid(&mut world, load, DVec3::splat(0.2), DVec3::X * 1.3);
        let (a, b) = (Anchor::body(leaf, DVec3::X * 0.5), Anchor::body(weight, DVec3::X * -0.2));
        world.add_fixed_joint(FixedJointDesc::new(a, b)).unwrap();
        // Turns about the hinge at 1 rad/s.
        for (body, arm) in [(leaf, 0.5), (weight, 1.2)] {
            world.set_velocity(body, DVec3::Z * -arm, DVec3::Y).unwrap();
        }
        for tick in 0..150 {
            let report = world.step();
            let held = report.worst_joint_gap <= 1e-3 && report.worst_joint_tilt <= 1e-3 && report.open_joints == 0;
            assert!(held, "{door} kg carry {load} kg, tick {tick}: {report:?}");
        }
        assert!(world.hinge_angle(hinge).unwrap().abs() > 0.5, "{:?}", world.hinge_angle(hinge));
    }
}

/// It falls along its axis as if it were free, and hangs on to its line across it.
#[test]
fn a_slider_is_free_along_its_axis_alone() {
    let mut world = world();
    let axis = DVec3::new(0.6, -0.8, 0.0);
    let sledge = rigid(&mut world, 3.0, DVec3::new(0.2, 0.1, 0.3), DVec3::ZERO);
    let off_centre = DVec3::new(0.1, 0.1, 0.2);
    let (a, b) = (Anchor::world(off_centre), Anchor::body(sledge, off_centre));
    world.add_slider(SliderDesc::new(a, b, axis)).unwrap();
    for n in 1..=60 {
        let report = world.step();
        assert!(report.worst_joint_gap <= 1e-3 && report.worst_joint_tilt <= 1e-3, "tick {n}: {report:?}");
        let n = f64::from(n);
        let (expected, position) = (0.8 * G * DT * DT * n * (n + 1.0) / 2.0, world.position(sledge).unwrap());
        assert!((position.dot(axis) - expected).abs() < 2e-3 + 1e-3 * expected, "tick {n}: {position} {expected}");
        assert!((position - axis * position.dot(axis)).length() < 2e-3, "tick {n}: {position}");
    }
}

/// Turn in the tick after one of `theta`, rad, of bodies that turn as one: `own` is the inertia about their centres,
/// `orbital` that of their masses about the axis. A centre steps along chords, I θ' + m r² sin θ' = I θ + m r² (sin(θ + θ') −
/// sin θ'); without inertia of its own that is tan θ' = sin θ / (2 − cos θ).
fn next_turn(theta: f64, own: f64, orbital: f64) -> f64 {
    let mut next = theta;
    for _ in 0..20 {
        let error = own * (next - theta) + orbital * (2.0 * next.sin() - (theta + next).sin());
        next -= error / (own + orbital * (2.0 * next.cos() - (theta + next).cos()));
    }
    next
}

/// Ten tonnes on a kilogram, spinning and flying: one body, with one body's momentum, which decays as it must.
#[test]
fn a_fixed_joint_welds_and_keeps_momentum() {
    for masses in [[1.0, 1.0], [1.0, 1e4], [1e4, 1.0]] {
        let mut world = weightless();
        let half = |m: f64| if m > 100.0 { DVec3::new(0.5, 0.3, 0.5) } else { DVec3::new(0.5, 0.1, 0.2) };
        let centre = 0.5 * (masses[1] - masses[0]) / (masses[0] + masses[1]);
        let [a, b] =
            [(masses[0], -0.5), (masses[1], 0.5)].map(|(m, x)| rigid(&mut world, m, half(m), DVec3::X * (x - centre)));
        let desc = FixedJointDesc::new(Anchor::body(a, DVec3::X * 0.5), Anchor::body(b, DVec3::X * -0.5));
        world.add_fixed_joint(desc).unwrap();
        let (rate, mut own, mut orbital) = (3.0, 0.0, 0.0);
        for (body, m) in [(a, masses[0]), (b, masses[1])] {
            let x = world.position(body).unwrap();
            world.set_velocity(body, DVec3::X * 2.0 + DVec3::Y.cross(x) * rate, DVec3::Y * rate).unwrap();
            own += Shape::Box { half: half(m) }.inertia(m).y;
            orbital += m * x.length_squared();
        }
        let (before, mut turn) = (world.momentum(), rate * DT);
        for tick in 0..90 {
            let report = world.step();
            let held = report.worst_joint_gap <= 1e-3 && report.worst_joint_tilt <= 1e-3 && report.open_joints == 0;
            assert!(held, "{masses:?}, tick {tick}: {report:?}");
            turn = next_turn(turn, own, orbital);
            for body in [a, b] {
                let spin = world.angular_velocity(body).unwrap();
                assert!((spin - DVec3::Y * turn / DT).length() < 0.02 * rate, "{masses:?}, tick {tick}: {spin} {turn}");
            }
        }
        let after = world.momentum().linear - before.linear;
        assert!(after.length() < 1e-3 * before.linear.length(), "{masses:?}: {after}");
    }
}

/// A bar that whirls about its end, held by a hinge to a post that cannot move.
#[test]
fn an_off_axis_mass_on_a_hinge_decays_as_documented() {
    let mut world = precise(DVec3::ZERO);
    let (bar, hinge) = pendulum(&mut world, 2.0);
    let rate = 8.0;
    world.set_velocity(bar, DVec3::X * 0.6 * rate, DVec3::Z * rate).unwrap();
    let (own, orbital) = (Shape::Box { half: DVec3::new(0.02, 0.6, 0.02) }.inertia(2.0).z, 2.0 * 0.36);
    let mut turn = 0.0;
    for tick in 0..60 {
        let before = world.hinge_angle(hinge).unwrap();
        world.step();
        let turned = (world.hinge_angle(hinge).unwrap() - before).rem_euclid(2.0 * PI);
        // The first tick starts along the tangent instead of a chord.
        turn = if tick == 0 { turned } else { next_turn(turn, own, orbital) };
        assert!((turned - turn).abs() < 1e-2 * turn, "tick {tick}: {turned} {turn}");
    }
}

/// Talk, "Velocity Potential": what is left of the difference shrinks by 1/(1 + dt Kd/m) a tick, and never above the
/// largest force.
#[test]
fn a_first_order_controller_approaches_its_velocity() {
    let mut world = weightless();
    let (mass, time_constant) = (4.0, 0.25);
    let body = rigid(&mut world, mass, DVec3::splat(0.5), DVec3::ZERO);
    let control = PdControl { target: DVec3::ZERO, target_velocity: DVec3::X * 3.0 };
    let at = Anchor::body(body, DVec3::ZERO);
    let drive = JointDrive::Velocity { time_constant };
    let pd = world.add_pd(PdDesc { at, drive, max_force: 1e3, control }).unwrap();
    let gain = mass * ((DT / time_constant).exp() - 1.0) / DT;
    for n in 1..=30 {
        world.step();
        let expected = 3.0 * (1.0 - (1.0 + DT * gain / mass).powi(-n));
        let speed = world.velocity(body).unwrap().x;
        assert!((speed - expected).abs() < 1e-9, "tick {n}: {speed} {expected}");
    }
    assert!(world.remove_pd(pd));
    let drive = JointDrive::Velocity { time_constant: 1e-3 };
    let before = world.velocity(body).unwrap();
    world
        .add_pd(PdDesc { at, drive, max_force: 6.0, control: PdControl { target_velocity: -DVec3::X, ..control } })
        .unwrap();
    world.step();
    let change = world.velocity(body).unwrap() - before;
    assert!((change.x + 6.0 / mass * DT).abs() < 1e-3, "{change}");
}

/// A rigid body hangs by a hinge, fixed, or on a slider, from an articulated part and from an elastic body.
#[test]
fn joints_hold_between_kinds() {
    let jelly = |world: &mut World| {
        let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [2, 2, 2]).unwrap();
        let fixed: Vec<u32> = (0..).zip(mesh.nodes()).filter(|(_, node)| node.y > 0.99).map(|(i, _)| i).collect();
        let solid = Elastic::new(1e6, 0.3).unwrap();
        let body = FiniteElements::new(&mesh, solid, Density::constant(1000.0), &fixed).unwrap();
        let node = (0..).zip(mesh.nodes()).find(|(_, p)| p.distance(DVec3::new(0.5, 0.0, 0.5)) < 0.1).unwrap().0;
        let (q, v, at) = (body.rest(), body.still(), body.at_node(node).unwrap());
        (world.add_figure(FigureDesc { dof: Arc::new(body), q, v, colliders: Vec::new() }).unwrap(), at)
    };
    let arm = |world: &mut World| {
        let shape = Shape::Box { half: DVec3::new(0.1, 0.5, 0.1) };
        let mass = shape.mass_properties(Density::constant(1.0)).unwrap().scaled_to(5.0).unwrap();
        let joint = JointDesc::new(JointKind::Hinge { axis: DVec3::Z }).at(DVec3::ZERO, DVec3::Y * 0.5);
        let part = PartDesc { name: "arm".into(), mass, parent: None, joint };
        let figure = Articulated::new(vec![part]).unwrap();
        let (q, v) = (figure.rest(), figure.still());
        let at = PartPoint { part: 0, point: DVec3::Y * -0.5 };
        (world.add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap(), at)
    };
    for (kind, joint) in [0, 1].into_iter().flat_map(|kind| [0, 1, 2].map(|joint| (kind, joint))) {
        let mut world = world();
        let (figure, at) = if kind == 0 { jelly(&mut world) } else { arm(&mut world) };
        let place = DVec3::from(world.frame(figure, at).unwrap().position);
        let bob = rigid(&mut world, 2.0, DVec3::new(0.2, 0.1, 0.1), place + DVec3::X * 0.2);
        let (a, b) = (Anchor::part(figure, at.part, at.point), Anchor::body(bob, DVec3::X * -0.2));
        match joint {
            0 => assert!(world.add_hinge(HingeDesc::new(a, b, DVec3::Z, DVec3::Z)).is_ok()),
            1 => assert!(world.add_fixed_joint(FixedJointDesc::new(a, b)).is_ok()),
            _ => assert!(world.add_slider(SliderDesc::new(a, b, DVec3::Y)).is_ok()),
        }
        let steers = JointDrive::Velocity { time_constant: 1.0 };
        let control = PdControl { target: DVec3::ZERO, target_velocity: DVec3::Z * 0.1 };
        world.add_pd(PdDesc { at: a, drive: steers, max_force: 1.0, control }).unwrap();
        let start = world.energy().total();
        for tick in 0..30 {
            let report = world.step().clone();
            let held = report.worst_joint_gap <= 1e-3 && report.worst_joint_tilt <= 1e-3 && report.open_joints == 0;
            assert!(held && report.unconverged_islands == 0, "kind {kind}, joint {joint}, tick {tick}: {report:?}");
            assert!(world.energy().total() < start + 0.1, "kind {kind}, joint {joint}, tick {tick}");
        }
    }
}

/// A beam of a kilogram, welded to the world, carries ten tonnes at its end.
#[test]
fn a_welded_bracket_of_a_kilogram_carries_ten_tonnes() {
    let mut world = world();
    let bracket = rigid(&mut world, 1.0, DVec3::new(0.25, 0.05, 0.05), DVec3::X * 0.25);
    let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(bracket, DVec3::X * -0.25));
    world.add_fixed_joint(FixedJointDesc::new(a, b)).unwrap();
    let load = rigid(&mut world, 1e4, DVec3::splat(0.5), DVec3::X);
    let (a, b) = (Anchor::body(bracket, DVec3::X * 0.25), Anchor::body(load, DVec3::X * -0.5));
    let joint = world.add_fixed_joint(FixedJointDesc::new(a, b)).unwrap();
    for tick in 0..60 {
        let report = world.step();
        let held = report.worst_joint_gap <= 1e-3 && report.worst_joint_tilt <= 1e-3 && report.open_joints == 0;
        assert!(held, "tick {tick}: {report:?}");
    }
    let sag = world.position(load).unwrap().y;
    assert!(sag.abs() < 5e-3 && world.velocity(load).unwrap().length() < 1e-2, "{sag}");
    assert!(world.remove_fixed_joint(joint) && !world.remove_fixed_joint(joint));
    world.step();
    assert!((world.velocity(load).unwrap().y + G * DT).abs() < 1e-2);
}

#[test]
fn a_rope_goes_taut_at_its_length() {
    for mass in [0.1, 1000.0] {
        let mut world = world();
        let bob = particle(&mut world, DVec3::ZERO, DVec3::ZERO, mass);
        let rope = DistanceLimitDesc::rope(Anchor::world(DVec3::X * 0.5), Anchor::body(bob, DVec3::ZERO), 2.0);
        let rope = world.add_distance_limit(rope).unwrap();
        let mut longest = 0.0f64;
        for n in 1..=300 {
            let report = world.step();
            assert!(report.open_joints == 0 && report.worst_joint_gap <= 1e-3, "{mass} kg, tick {n}: {report:?}");
            let position = world.position(bob).unwrap();
            longest = longest.max((position - DVec3::X * 0.5).length());
            let n = f64::from(n);
            if n < 15.0 {
                assert!((position.y + G * DT * DT * n * (n + 1.0) / 2.0).abs() < 1e-9, "slack it falls freely");
            }
        }
        assert!(longest > 1.999 && longest <= 2.001, "{longest}");
        assert!(world.remove_distance_limit(rope) && !world.remove_distance_limit(rope));
    }
}

#[test]
fn a_stop_keeps_things_apart() {
    let mut world = weightless();
    let [a, b] = [-1.0, 1.0].map(|x| particle(&mut world, DVec3::X * x, DVec3::X * -5.0 * x, 1.0));
    let stop = DistanceLimitDesc::stop(Anchor::body(a, DVec3::ZERO), Anchor::body(b, DVec3::ZERO), 0.5);
    world.add_distance_limit(stop).unwrap();
    for tick in 0..60 {
        let report = world.step();
        assert!(report.open_joints == 0, "tick {tick}: {report:?}");
        let apart = world.position(b).unwrap().x - world.position(a).unwrap().x;
        assert!(apart >= 0.499, "tick {tick}: {apart}");
    }
}

/// It falls from level and is stopped, at whatever angle the limit is, also across half a turn.
#[test]
fn an_angle_limit_stops_a_swinging_hinge() {
    for (lower, upper, rests) in [(-0.5, 0.3, 0.3), (-3.0 * PI / 4.0, PI / 4.0, PI / 4.0), (-1.0, 2.5, FRAC_PI_2)] {
        let mut world = world();
        let (bar, hinge) = pendulum(&mut world, 2.0);
        // Gravity pulls towards +x: the pendulum would hang at a quarter turn.
        world.add_angle_limit(AngleLimitDesc::new(hinge, lower, upper)).unwrap();
        for tick in 0..240 {
            world.apply_force(bar, DVec3::new(2.0 * G, 2.0 * G, 0.0), world.position(bar).unwrap()).unwrap();
            let report = world.step();
            assert!(report.open_joints == 0 && report.worst_joint_tilt <= 1e-3, "to {upper}, tick {tick}: {report:?}");
            let angle = world.hinge_angle(hinge).unwrap();
            assert!(angle < upper + 1.1e-3 && angle > lower - 1.1e-3, "to {upper}, tick {tick}: {angle}");
        }
        let angle = world.hinge_angle(hinge).unwrap();
        // What does not reach its limit swings on, and fades slowly.
        let near = if rests == upper { 2e-2 } else { 0.3 };
        assert!((angle - rests).abs() < near, "{angle}, expected {rests}");
    }
}

#[test]
fn motors_reach_their_speed_with_limited_push() {
    let mut world = weightless();
    let frame = Anchor::world(DVec3::ZERO);
    let wheel = rigid(&mut world, 6.0, DVec3::splat(0.5), DVec3::ZERO);
    let hinge = HingeDesc::new(frame, Anchor::body(wheel, DVec3::ZERO), DVec3::Z, DVec3::Z);
    let hinge = world.add_hinge(hinge).unwrap();
    let sledge = rigid(&mut world, 5.0, DVec3::splat(0.5), DVec3::ZERO);
    let slider = SliderDesc::new(frame, Anchor::body(sledge, DVec3::ZERO), DVec3::X);
    let slider = world.add_slider(slider).unwrap();
    // 1 kg m², 5 kg: the limit alone lasts for a second.
    let motor = |target_speed: f64, max_torque| Motor { target_speed, gain: 1e4, max_torque };
    let turns = world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor: motor(8.0, 8.0) }).unwrap();
    let slides = MotorDesc { joint: Driven::Slider(slider), motor: motor(-2.0, 10.0) };
    let slides = world.add_motor(slides).unwrap();
    for n in 1..=45 {
        world.step();
        let (spin, speed) = (world.angular_velocity(wheel).unwrap().z, world.velocity(sledge).unwrap().x);
        let (expected, expected_speed) = ((8.0 * DT * f64::from(n)).min(8.0), (-2.0 * DT * f64::from(n)).max(-2.0));
        assert!((spin - expected).abs() < 5e-3, "tick {n}: {spin} {expected}");
        assert!((speed - expected_speed).abs() < 5e-3, "tick {n}: {speed} {expected_speed}");
    }
    world.set_motor(turns, motor(0.0, 4.0)).unwrap();
    assert_eq!(world.motor(turns).unwrap().max_torque, 4.0);
    for _ in 0..15 {
        world.step();
    }
    assert!((world.angular_velocity(wheel).unwrap().z - 6.0).abs() < 5e-3);
    assert!(world.remove_hinge(hinge) && world.motor(turns).is_none() && world.motor(slides).is_some());
    assert!(world.remove_slider(slider) && !world.remove_motor(slides));
}

#[test]
fn bad_joints_are_refused_by_name() {
    let mut world = world();
    let body = rigid(&mut world, 1.0, DVec3::splat(0.5), DVec3::ZERO);
    let dot = particle(&mut world, DVec3::ZERO, DVec3::ZERO, 1.0);
    let (a, b) = (Anchor::world(DVec3::ZERO), Anchor::body(body, DVec3::ZERO));
    let hinge = HingeDesc::new(a, b, DVec3::Z, DVec3::Z);
    let refused = |answer: Result<HingeId, pita_sim::SimError>, name: &str| {
        let message = answer.unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    };
    refused(world.add_hinge(HingeDesc { axis_a: DVec3::ZERO, ..hinge }), "axis_a");
    refused(world.add_hinge(HingeDesc { axis_b: DVec3::NAN, ..hinge }), "axis_b");
    refused(world.add_hinge(HingeDesc { tolerance: 0.0, ..hinge }), "tolerance");
    refused(world.add_hinge(HingeDesc { tilt: 2.0, ..hinge }), "tilt");
    refused(world.add_hinge(HingeDesc { a: b, ..hinge }), "same body");
    refused(world.add_hinge(HingeDesc { b: Anchor::part(body, 1, DVec3::ZERO), ..hinge }), "part");
    refused(world.add_hinge(HingeDesc { b: Anchor::body(dot, DVec3::ZERO), ..hinge }), "particle");
    let hinge = world.add_hinge(hinge).unwrap();
    let limit = AngleLimitDesc::new(hinge, 0.0, 1.0);
    let upper = world.add_angle_limit(AngleLimitDesc { upper: 7.0, ..limit }).unwrap_err();
    assert!(upper.to_string().contains("upper"));
    let rope = world.add_distance_limit(DistanceLimitDesc { at_least: 3.0, ..DistanceLimitDesc::rope(a, b, 2.0) });
    assert!(rope.unwrap_err().to_string().contains("at_most"));
    let motor = Motor { gain: f64::NAN, ..Motor::default() };
    let refused = world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor }).unwrap_err();
    assert!(refused.to_string().contains("gain"));
    assert!(world.remove_body(body) && !world.remove_hinge(hinge));
    assert!(world.add_angle_limit(limit).unwrap_err().to_string().contains("hinge"));
    world.step();
}
