//! What must not hurt: bad arguments, stale handles, absurd speeds.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Anchor, Articulated, AxleControl, AxleDesc, BallJointDesc, Collider, DQuat, DVec3, Dof, FigureDesc, FiniteElements,
    JointDesc, JointDrive, JointKind, JointLimit, JointMotor, PartCollider, PartDesc, PartPoint, ParticleDesc,
    PdControl, PdDesc, RigidBodyDesc, Settings, Shape, SimError, SpringDesc, StaticDesc, UniversalJointDesc, World,
};

use super::{DT, cube, ground, particle, world};

fn refused<T>(result: Result<T, SimError>, expected: &str) {
    match result {
        Ok(_) => panic!("accepted, expected: {expected}"),
        Err(error) => assert!(error.to_string().contains(expected), "{error}, expected: {expected}"),
    }
}

#[test]
fn bad_values_are_named() {
    let mut world = world();
    let good = RigidBodyDesc::new(DVec3::ZERO, 1.0, DVec3::ONE);
    refused(
        world.add_rigid_body(RigidBodyDesc { mass: 0.0, ..good.clone() }),
        "mass is 0, allowed is 1e-6 to below 1e9 kg",
    );
    refused(world.add_rigid_body(RigidBodyDesc { mass: f64::NAN, ..good.clone() }), "mass is NaN");
    refused(
        world.add_rigid_body(RigidBodyDesc { inertia: DVec3::new(1.0, -1.0, 1.0), ..good.clone() }),
        "inertia is -1",
    );
    refused(world.add_rigid_body(RigidBodyDesc { position: DVec3::NAN, ..good.clone() }), "position is NaN");
    refused(world.add_rigid_body(RigidBodyDesc { velocity: DVec3::X * 1e10, ..good.clone() }), "velocity is 1");
    let rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    refused(world.add_rigid_body(RigidBodyDesc { rotation, ..good }), "rotation is 0");
    let collider = Some(Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5));
    let moving = RigidBodyDesc { collider, ..RigidBodyDesc::new(DVec3::ZERO, 1.0, DVec3::ONE) };
    refused(world.add_rigid_body(moving), "a half-space cannot move");
    let shape = Shape::Ball { radius: -1.0 };
    let piece = StaticDesc::new(Collider::new(shape, 0.5));
    refused(world.add_static(piece), "radius is -1");
    let position = DVec3::INFINITY;
    refused(
        world.add_particle(ParticleDesc { position, velocity: DVec3::ZERO, mass: 1.0, collider: None }),
        "position",
    );
    refused(World::new(Settings::at(0.0)), "dt is 0");
    refused(World::new(Settings { threads: 0, ..Settings::at(0.1) }), "threads is 0, allowed is 1 to 64");
}

#[test]
fn joints_to_nothing_are_refused() {
    let mut world = world();
    let (a, b) = (cube(&mut world, DVec3::ZERO), cube(&mut world, DVec3::X * 2.0));
    let p = particle(&mut world, DVec3::Y, DVec3::ZERO, 1.0);
    let joint = |a, b| BallJointDesc::new(Anchor::body(a, DVec3::ZERO), Anchor::body(b, DVec3::X));
    refused(world.add_ball_joint(joint(a, a)), "both ends are at the same body");
    refused(world.add_ball_joint(joint(a, p)), "a particle has no point but its own");
    let ends = (Anchor::world(DVec3::ZERO), Anchor::world(DVec3::X));
    refused(
        world.add_spring(SpringDesc { a: ends.0, b: ends.1, rest_length: 1.0, stiffness: 1.0, damping: 0.0 }),
        "same",
    );
    let control = AxleControl { steer: f64::NAN, ..AxleControl::default() };
    let axle = AxleDesc { chassis: a, wheel: b, hub: DVec3::ZERO, stiffness: 1.0, damping: 1.0, control };
    refused(world.add_axle(axle), "steer is NaN");
    world.remove_body(b);
    refused(world.add_ball_joint(joint(a, b)), "does not exist");
    refused(world.set_velocity(b, DVec3::ZERO, DVec3::ZERO), "does not exist");
    assert_eq!(world.position(b), None);
}

/// A handle of a removed body does not reach the body that took its place.
#[test]
fn handles_go_stale() {
    let mut world = world();
    let old = cube(&mut world, DVec3::ZERO);
    let serial = world.serial(old);
    world.remove_body(old);
    let new = cube(&mut world, DVec3::X);
    assert_ne!(old, new);
    assert_eq!(world.velocity(old), None);
    assert_ne!(world.serial(new), serial);
}

/// The fastest spins and speeds that are accepted neither hang a tick nor hurt the neighbours.
#[test]
fn absurd_motion_is_survived() {
    let mut world = world();
    ground(&mut world);
    let bystander = cube(&mut world, DVec3::new(-50.0, 0.5, 0.0));
    let wild = cube(&mut world, DVec3::Y * 0.6);
    let spin = DVec3::new(1e8, -9e8, 3e8);
    world.set_velocity(wild, DVec3::new(9e8, -9e8, 1.0), spin).unwrap();
    for _ in 0..30 {
        world.step();
    }
    let here = world.position(bystander).unwrap();
    assert!((here - DVec3::new(-50.0, 0.5, 0.0)).length() < 1e-2, "{here}");
    assert!(world.slices().all(|slice| slice.q.iter().chain(slice.v).all(|x| x.is_finite())));
}

/// Articulated figures with the fastest rates that are accepted, with motors that ask for the impossible, and with parts
/// a million times as heavy as those that carry them: nothing becomes non-finite, and the neighbours do not notice.
#[test]
fn absurd_figures_are_survived() {
    let kinds = [
        JointKind::Hinge { axis: DVec3::Z },
        JointKind::Universal { axes: [DVec3::X, DVec3::Y] },
        JointKind::Ball,
        JointKind::Slider { axis: DVec3::X },
        JointKind::Free,
    ];
    for (speed, heavy) in [(1e8, 1.0), (1e3, 1e6), (30.0, 1e6)] {
        let mut world = world();
        let bystander = cube(&mut world, DVec3::new(-50.0, 100.0, 0.0));
        let part = |(i, kind): (u32, JointKind)| {
            let drive = JointDrive::Position { frequency: 2.0, damping_ratio: 1.0 };
            let motor = (kind != JointKind::Free).then_some(JointMotor { drive, max_force: f64::INFINITY });
            let limits = vec![JointLimit::range(-1e-3, 1e-3); usize::from(matches!(kind, JointKind::Hinge { .. }))];
            let joint = JointDesc { motor, limits, ..JointDesc::new(kind).at(DVec3::X * 0.5, DVec3::X * -0.5) };
            let unit = Shape::Box { half: DVec3::splat(0.3) }.mass_properties(Density::constant(1.0)).unwrap();
            let mass = unit.scaled_to(if i == 4 { heavy } else { 1.0 }).unwrap();
            PartDesc { name: format!("link {i}"), mass, parent: i.checked_sub(1), joint }
        };
        let figure = Articulated::new((0..).zip(kinds).map(part).collect()).unwrap();
        let (q, mut v) = (figure.rest(), figure.still());
        v.iter_mut().enumerate().for_each(|(i, v)| *v = if i % 2 == 0 { speed } else { -speed });
        let figure = world.add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap();
        let mut controls = world.controls(figure).unwrap().to_vec();
        controls[0] = 1e8;
        world.set_controls(figure, &controls).unwrap();
        controls[0] = f64::NAN;
        refused(world.set_controls(figure, &controls), "NaN");
        refused(world.set_controls(figure, &controls[1..]), "as many as the body has");
        for _ in 0..60 {
            world.step();
        }
        let fallen = 9.81 * DT * DT * 60.0 * 61.0 / 2.0;
        assert!((world.position(bystander).unwrap().y - 100.0 + fallen).abs() < 1e-9);
        assert!(world.slices().all(|slice| slice.q.iter().chain(slice.v).all(|x| x.is_finite())));
        assert!(speed > 1e7 || !world.is_quarantined(figure), "{speed} {heavy}");
    }
}

/// A body that is pushed out of all bounds is quarantined alone: what hangs on it and what stands by go on, its forces do
/// not pile up, and a new pose brings it back.
#[test]
fn a_body_out_of_bounds_is_quarantined_alone() {
    let mut world = world();
    ground(&mut world);
    let (bystander, partner) =
        (cube(&mut world, DVec3::new(-9.0, 0.5, 0.0)), cube(&mut world, DVec3::new(9.0, 0.5, 0.0)));
    let light = particle(&mut world, DVec3::new(9.0, 3.0, 0.0), DVec3::ZERO, 1e-6);
    let (a, b) = (Anchor::body(partner, DVec3::ZERO), Anchor::body(light, DVec3::ZERO));
    world.add_spring(SpringDesc { a, b, rest_length: 2.5, stiffness: 1e-9, damping: 0.0 }).unwrap();
    world.step();
    let place = world.position(light).unwrap();
    for tick in 0..30 {
        world.apply_force(light, DVec3::Y * 9e8, place).unwrap();
        let report = world.step();
        assert_eq!(report.quarantined, usize::from(tick == 0), "tick {tick}");
    }
    assert!(world.is_quarantined(light) && world.position(light) == Some(place));
    for (id, x) in [(bystander, -9.0), (partner, 9.0)] {
        assert!(!world.is_quarantined(id));
        assert!((world.position(id).unwrap() - DVec3::new(x, 0.5, 0.0)).length() < 1e-2);
    }
    world.set_pose(light, place, DQuat::IDENTITY).unwrap();
    world.step();
    assert!(!world.is_quarantined(light) && world.velocity(light).unwrap().length() < 1.0);
}

/// The report tells the depth that there is, not the part of it that a tick may recover.
#[test]
fn deep_overlap_is_reported_in_full() {
    let mut world = world();
    ground(&mut world);
    cube(&mut world, DVec3::Y * -0.3);
    let depth = world.step().worst_penetration;
    assert!((0.6..0.81).contains(&depth), "{depth}");
}

/// What a joint held apart collides again when the joint is gone; a second joint goes on holding it apart.
#[test]
fn removed_joints_let_bodies_collide_again() {
    let mut world = world();
    let (a, b) = (cube(&mut world, DVec3::ZERO), cube(&mut world, DVec3::X));
    let desc = BallJointDesc::new(Anchor::body(a, DVec3::X * 0.5), Anchor::body(b, DVec3::X * -0.5));
    let joints = [world.add_ball_joint(desc).unwrap(), world.add_ball_joint(desc).unwrap()];
    for (left, expected) in [(joints[0], false), (joints[1], true)] {
        assert!(world.remove_ball_joint(left));
        world.step();
        assert_eq!(world.contacts().count() > 0, expected);
    }
}

/// Bodies inside one another are pushed apart at no more than the recovery speed a contact: four of them here.
#[test]
fn boxes_inside_one_another_do_not_explode() {
    let mut world = world();
    ground(&mut world);
    let boxes: Vec<_> = (0..5).map(|i| cube(&mut world, DVec3::new(0.0, 0.5 + 0.01 * f64::from(i), 0.0))).collect();
    for _ in 0..300 {
        world.step();
        for &id in &boxes {
            assert!(world.velocity(id).unwrap().length() < 12.5, "{}", world.velocity(id).unwrap());
        }
    }
}

/// Settings with which products of numbers would overflow are refused, and so are materials made by hand, solids that
/// weigh nothing or everything, and colliders nowhere.
#[test]
fn numbers_that_overflow_are_refused_by_name() {
    let with = |change: fn(&mut Settings)| {
        let mut settings = Settings::at(DT);
        change(&mut settings);
        World::new(settings)
    };
    refused(with(|s| s.dt = 1e-300), "dt is 0");
    refused(with(|s| s.solver.tolerance = 1e300), "solver.tolerance");
    refused(with(|s| s.solver.joint_stiffness = 1e300), "solver.joint_stiffness");
    refused(with(|s| s.contact.normal_stiffness = f64::MAX), "contact.normal_stiffness");
    refused(with(|s| s.contact.tangent_stiffness = 1e-300), "contact.tangent_stiffness");
    refused(with(|s| s.contact.transition = 1e-300), "contact.transition");
    refused(with(|s| s.contact.recovery_speed = 1e300), "contact.recovery_speed");
    refused(with(|s| s.contact.margin = f64::MAX), "contact.margin");

    let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [1, 1, 1]).unwrap();
    let density = Density::constant(1000.0);
    for (lambda, mu, expected) in
        [(1e5, f64::NAN, "mu"), (1e5, -1.0, "mu"), (-1e5, 1e5, "lambda"), (1e300, 1e5, "lambda")]
    {
        refused(FiniteElements::new(&mesh, Elastic { lambda, mu }, density, &[]), expected);
    }
    refused(Shape::Ball { radius: 1e-200 }.mass_properties(density), "mass is 0");
    refused(MassProperties::of_point(1e300, DVec3::ZERO), "mass is 1");

    let mut world = world();
    let dof: Arc<dyn Dof> =
        Arc::new(FiniteElements::new(&mesh, Elastic::new(1e5, 0.3).unwrap(), density, &[]).unwrap());
    let q: Vec<f64> = mesh.nodes().iter().flat_map(|node| node.to_array()).collect();
    let at = PartPoint { part: 0, point: DVec3::NAN };
    let colliders = vec![PartCollider { at, collider: Collider::new(Shape::Ball { radius: 0.1 }, 0.5) }];
    refused(world.add_figure(FigureDesc { dof, v: vec![0.0; q.len()], q, colliders }), "place of a collider is NaN");
    let ends = (Anchor::world(DVec3::ZERO), Anchor::body(cube(&mut world, DVec3::X), DVec3::ZERO));
    let spring = SpringDesc { a: ends.0, b: ends.1, rest_length: 1e300, stiffness: 1.0, damping: 0.0 };
    refused(world.add_spring(spring), "rest_length");
    let parallel = UniversalJointDesc::new(ends.0, ends.1, DVec3::X, -DVec3::X);
    refused(world.add_universal_joint(parallel), "sine of the angle between the axes is 0");
}

/// A first-order motor that is to be there at once, in a long tick.
#[test]
fn the_fastest_motor_of_the_longest_tick_is_finite() {
    let mut world = World::new(Settings { gravity: DVec3::ZERO, ..Settings::at(1.0) }).unwrap();
    let body = cube(&mut world, DVec3::ZERO);
    let drive = JointDrive::Velocity { time_constant: 1e-3 };
    let control = PdControl { target: DVec3::ZERO, target_velocity: DVec3::X };
    let at = Anchor::body(body, DVec3::ZERO);
    world.add_pd(PdDesc { at, drive, max_force: f64::INFINITY, control }).unwrap();
    world.step();
    assert!(!world.is_quarantined(body));
    assert!((world.velocity(body).unwrap() - DVec3::X).length() < 1e-3, "{}", world.velocity(body).unwrap());
}
