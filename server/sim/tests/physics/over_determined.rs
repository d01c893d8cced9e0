//! Joints that say the same several times ("just how much designers enjoy over-determined systems"), and joints of every
//! kind under heavy loads: solved, held, and in few iterations.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties};
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, DQuat, DVec3, Dof, Driven, FigureDesc, FixedJointDesc, HingeDesc,
    JointDesc, JointKind, Motor, MotorDesc, Natural, NaturalDesc, NaturalPart, PartDesc, PartPoint, RigidBodyDesc,
    RodDesc, Shape, SliderDesc, UniversalJointDesc, World,
};

use super::{particle, weightless, world};

const PLANK: Shape = Shape::Box { half: DVec3::new(0.5, 0.05, 0.2) };

/// A plank of 1 m along x, one end of which is at `start`.
fn plank(world: &mut World, start: DVec3, rotation: DQuat, mass: f64) -> BodyId {
    let desc = RigidBodyDesc::new(start + rotation * DVec3::X * 0.5, mass, PLANK.inertia(mass));
    world.add_rigid_body(RigidBodyDesc { rotation, ..desc }).unwrap()
}

fn origin() -> Anchor {
    Anchor::world(DVec3::ZERO)
}

/// The plank's ends.
fn near(body: BodyId) -> Anchor {
    Anchor::body(body, DVec3::X * -0.5)
}

fn far(body: BodyId) -> Anchor {
    Anchor::body(body, DVec3::X * 0.5)
}

/// A tick that solves everything and leaves no joint open. Answers its iterations.
fn step(world: &mut World, what: &str) -> usize {
    let report = world.step();
    assert!(report.open_joints == 0 && report.unconverged_islands == 0, "{what}: {report:?}");
    report.iterations
}

/// A door on three hinges, welded to a beam twice, which a rod holds as well: every DOF is held several times.
#[test]
fn joints_that_say_the_same_are_solved() {
    let mut world = world();
    let door = plank(&mut world, DVec3::ZERO, DQuat::IDENTITY, 30.0);
    for z in [-0.2, 0.0, 0.2].map(|z| DVec3::Z * z) {
        let b = Anchor::body(door, DVec3::X * -0.5 + z);
        world.add_hinge(HingeDesc::new(Anchor::world(z), b, DVec3::Z, DVec3::Z)).unwrap();
    }
    let beam = plank(&mut world, DVec3::X, DQuat::IDENTITY, 10.0);
    for _ in 0..2 {
        world.add_fixed_joint(FixedJointDesc::new(far(door), near(beam))).unwrap();
    }
    world.add_rod(RodDesc::new(origin(), far(beam), 2.0)).unwrap();
    let iterations: usize = (0..120).map(|tick| step(&mut world, &format!("tick {tick}"))).sum();
    assert!(iterations < 480, "{iterations}");
    let lowest = world.position(beam).unwrap();
    assert!(lowest.length() < 1.502 && lowest.z.abs() < 2e-3, "{lowest}");
}

/// Light planks carry a heavy one, by every kind of joint, also where the load wants to turn what is locked.
#[test]
fn joints_of_every_kind_hold_heavy_loads() {
    type Join = fn(&mut World, Anchor, Anchor);
    let joins: [(&str, Join); 5] = [
        ("ball", |w, a, b| _ = w.add_ball_joint(BallJointDesc::new(a, b)).unwrap()),
        ("hinge", |w, a, b| _ = w.add_hinge(HingeDesc::new(a, b, DVec3::Y, DVec3::Y)).unwrap()),
        ("fixed", |w, a, b| _ = w.add_fixed_joint(FixedJointDesc::new(a, b)).unwrap()),
        ("slider", |w, a, b| _ = w.add_slider(SliderDesc::new(a, b, DVec3::Z)).unwrap()),
        ("universal", |w, a, b| _ = w.add_universal_joint(UniversalJointDesc::new(a, b, DVec3::Y, DVec3::Z)).unwrap()),
    ];
    for (name, join) in joins {
        let mut world = world();
        let light = [0.0, 1.0].map(|x| plank(&mut world, DVec3::X * x, DQuat::IDENTITY, 1.0));
        let load = plank(&mut world, DVec3::X * 2.0, DQuat::IDENTITY, 1000.0);
        join(&mut world, origin(), near(light[0]));
        join(&mut world, far(light[0]), near(light[1]));
        join(&mut world, far(light[1]), near(load));
        let iterations: usize = (0..60).map(|tick| step(&mut world, &format!("{name}, tick {tick}"))).sum();
        assert!(iterations < 300, "{name}: {iterations}");
    }
}

/// Two shafts at an angle of β: tan θ' = cos β tan θ, so the second is between cos β and 1/cos β times as fast.
#[test]
fn a_universal_joint_hands_on_a_turn() {
    let mut world = weightless();
    let bend = DQuat::from_rotation_y(0.5);
    let a = plank(&mut world, DVec3::ZERO, DQuat::IDENTITY, 20.0);
    let b = plank(&mut world, DVec3::X, bend, 20.0);
    let hinge = world.add_hinge(HingeDesc::new(origin(), near(a), DVec3::X, DVec3::X)).unwrap();
    let end = Anchor::world(DVec3::X + bend * DVec3::X);
    world.add_hinge(HingeDesc::new(end, far(b), bend * DVec3::X, DVec3::X)).unwrap();
    let joint = UniversalJointDesc::new(far(a), near(b), DVec3::Z, DVec3::Y);
    let joint = world.add_universal_joint(joint).unwrap();
    let motor = Motor { target_speed: 3.0, gain: 1e3, max_torque: 1e6 };
    world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor }).unwrap();
    let spin = |world: &World, body| world.angular_velocity(body).unwrap();
    let (mut slowest, mut fastest) = (f64::MAX, 0.0f64);
    for tick in 0..90 {
        step(&mut world, &format!("tick {tick}"));
        let ratio = spin(&world, b).dot(bend * DVec3::X) / spin(&world, a).x;
        (slowest, fastest) = (slowest.min(ratio), fastest.max(ratio));
    }
    let cosine = 0.5f64.cos();
    assert!((slowest / cosine - 1.0).abs() < 0.02 && (fastest * cosine - 1.0).abs() < 0.02, "{slowest} {fastest}");
    assert!(world.remove_universal_joint(joint) && !world.remove_universal_joint(joint));
}

#[test]
fn bad_universal_joints_are_refused_by_name() {
    let mut world = world();
    let body = plank(&mut world, DVec3::ZERO, DQuat::IDENTITY, 1.0);
    let dot = Anchor::body(particle(&mut world, DVec3::ZERO, DVec3::ZERO, 1.0), DVec3::ZERO);
    let good = UniversalJointDesc::new(origin(), near(body), DVec3::X, DVec3::Y);
    let bad = [
        (UniversalJointDesc { axis_a: DVec3::ZERO, ..good }, "axis_a"),
        (UniversalJointDesc { axis_b: DVec3::INFINITY, ..good }, "axis_b"),
        (UniversalJointDesc { tilt: 0.0, ..good }, "tilt"),
        (UniversalJointDesc { tolerance: f64::NAN, ..good }, "tolerance"),
        (UniversalJointDesc { a: near(body), ..good }, "same body"),
        (UniversalJointDesc { b: dot, ..good }, "particle"),
    ];
    for (desc, expected) in bad {
        let message = world.add_universal_joint(desc).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

/// A box of 1 kg as one part of a figure about the origin, in independent or in natural coordinates.
fn boxed(natural: bool) -> (Arc<dyn Dof>, Vec<f64>, Vec<f64>) {
    let shape = Shape::Box { half: DVec3::splat(0.2) };
    let mass: MassProperties = shape.mass_properties(Density::constant(1.0)).unwrap().scaled_to(1.0).unwrap();
    if natural {
        let points = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let points = points.map(|p| DVec3::from_array(p) * 0.2).to_vec();
        let (position, rotation) = (DVec3::ZERO, DQuat::IDENTITY);
        let part = NaturalPart { name: "box".into(), points: vec![0, 1, 2, 3], position, rotation, mass };
        let figure = Natural::new(NaturalDesc { points, rods: Vec::new(), parts: vec![part] }.with_edges()).unwrap();
        let q = figure.placed(DVec3::ZERO, DQuat::IDENTITY);
        return (Arc::new(figure), q, vec![0.0; 12]);
    }
    let part = PartDesc { name: "box".into(), mass, parent: None, joint: JointDesc::new(JointKind::Free) };
    let figure = Articulated::new(vec![part]).unwrap();
    let (q, v) = (figure.rest(), figure.still());
    (Arc::new(figure), q, v)
}

/// A figure hinged to the world carries a rigid body on a fixed joint and a particle on a ball joint: all swing together,
/// whichever the figure's coordinates are.
#[test]
fn figures_of_both_kinds_swing_alike() {
    let [independent, natural] = [false, true].map(|natural| {
        let mut world = world();
        let (dof, q, v) = boxed(natural);
        let figure = world.add_figure(FigureDesc { dof, q, v, colliders: Vec::new() }).unwrap();
        let at = |point: DVec3| Anchor::part(figure, 0, point);
        let pivot = DVec3::X * -0.2;
        let hinge = HingeDesc::new(Anchor::world(pivot), at(pivot), DVec3::Z, DVec3::Z);
        let hinge = world.add_hinge(hinge).unwrap();
        let plank = plank(&mut world, DVec3::X * 0.2, DQuat::IDENTITY, 2.0);
        world.add_fixed_joint(FixedJointDesc::new(at(DVec3::X * 0.2), near(plank))).unwrap();
        let corner = DVec3::new(0.0, 0.2, 0.2);
        let bob = particle(&mut world, corner, DVec3::ZERO, 0.1);
        world.add_ball_joint(BallJointDesc::new(at(corner), Anchor::body(bob, DVec3::ZERO))).unwrap();
        let brake = Motor { target_speed: 0.0, gain: 2.0, max_torque: 1e6 };
        world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor: brake }).unwrap();
        for tick in 0..20 {
            step(&mut world, &format!("natural {natural}, tick {tick}"));
        }
        let end = world.frame(figure, PartPoint { part: 0, point: DVec3::X * 0.2 }).unwrap();
        let held = world.frame(plank, PartPoint { part: 0, point: DVec3::X * -0.5 }).unwrap();
        assert!(end.place(DVec3::ZERO).distance(held.place(DVec3::ZERO)) < 1e-3);
        world.position(plank).unwrap()
    });
    assert!(independent.y < -0.3 && independent.distance(natural) < 0.02, "{independent} {natural}");
}
