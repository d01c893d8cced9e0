//! Bodies of general kinds: pushed at a point of a part, joined to others at it, and driven there.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties, Polyhedron};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, DQuat, DVec3, Dof, Driven, FigureDesc, FiniteElements, FixedJointDesc,
    HingeDesc, JointDesc, JointKind, Lattice, LatticeDesc, Motor, MotorDesc, Natural, NaturalDesc, NaturalPart,
    PartDesc, PartPoint, RigidBodyDesc, RodDesc, Settings, Shape, SliderDesc, UniversalJointDesc, World,
};

use super::{DT, particle, precise, weightless};

fn brick(mass: f64) -> MassProperties {
    let shape = Shape::Box { half: DVec3::new(0.3, 0.2, 0.1) };
    shape.mass_properties(Density::constant(1.0)).unwrap().scaled_to(mass).unwrap()
}

/// A brick that flies, and one that a hinge holds to it.
fn articulated() -> (Arc<dyn Dof>, Vec<f64>) {
    let part = |name: &str, parent, joint| PartDesc { name: name.into(), mass: brick(3.0), parent, joint };
    let arm = JointDesc::new(JointKind::Hinge { axis: DVec3::Z }).at(DVec3::X * 0.3, DVec3::X * -0.3);
    let parts = vec![part("root", None, JointDesc::new(JointKind::Free)), part("arm", Some(0), arm)];
    let figure = Articulated::new(parts).unwrap();
    let q = figure.rest();
    (Arc::new(figure), q)
}

/// Two bricks in tetrahedra that share a point.
fn natural() -> (Arc<dyn Dof>, Vec<f64>) {
    let middle = DVec3::X * 0.3;
    let corners = [-DVec3::X * 0.5, DVec3::Y * 0.4, DVec3::Z * 0.4];
    let mirrored = corners.map(|corner| 2.0 * middle - corner);
    let points = [middle].into_iter().chain(corners).chain(mirrored).collect();
    let part = |name: &str, points: [u32; 4], position| NaturalPart {
        name: name.into(),
        points: points.to_vec(),
        position,
        rotation: DQuat::IDENTITY,
        mass: brick(3.0),
    };
    let parts = vec![part("root", [0, 1, 2, 3], DVec3::ZERO), part("arm", [0, 4, 5, 6], DVec3::X * 0.6)];
    let figure = Natural::new(NaturalDesc { points, rods: Vec::new(), parts }.with_edges()).unwrap();
    let q = figure.placed(DVec3::ZERO, DQuat::IDENTITY);
    (Arc::new(figure), q)
}

fn jelly() -> (Arc<dyn Dof>, Vec<f64>) {
    let mesh = TetrahedralMesh::of_box(DVec3::splat(-0.2), DVec3::splat(0.2), [2, 1, 1]).unwrap();
    let figure = FiniteElements::new(&mesh, Elastic::new(1e6, 0.3).unwrap(), Density::constant(100.0), &[]).unwrap();
    let q = figure.rest();
    (Arc::new(figure), q)
}

fn lattice() -> (Arc<dyn Dof>, Vec<f64>) {
    let corner = |i: u8| DVec3::from_array([1, 2, 4].map(|bit| if i & bit == 0 { -0.2 } else { 0.2 }));
    let solid = Polyhedron::of_hull(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
    let (material, density) = (Elastic::new(1e6, 0.3).unwrap(), Density::constant(100.0));
    let (min, max) = (DVec3::splat(-0.2), DVec3::splat(0.2));
    let desc = LatticeDesc { min, max, cells: [2, 1, 1], material, density, damping: 0.0 };
    let figure = Lattice::new(&solid, desc).unwrap();
    let q = figure.rest();
    (Arc::new(figure), q)
}

fn add(world: &mut World, (dof, q): (Arc<dyn Dof>, Vec<f64>)) -> BodyId {
    let v = vec![0.0; dof.blocks().iter().map(|block| usize::from(block.rates)).sum()];
    world.add_figure(FigureDesc { dof, q, v, colliders: Vec::new() }).unwrap()
}

fn rigid(world: &mut World, mass: f64, position: DVec3) -> BodyId {
    let inertia = Shape::Box { half: DVec3::splat(0.1) }.inertia(mass);
    world.add_rigid_body(RigidBodyDesc::new(position, mass, inertia)).unwrap()
}

/// Who is put somewhere else starts there anew: what was to push it where it was does not push it there.
#[test]
fn what_is_put_elsewhere_forgets_what_was_to_push_it() {
    let mut world = weightless();
    let (solid, figure) = (rigid(&mut world, 2.0, DVec3::X), add(&mut world, natural()));
    let still = world.slice(figure).map(|slice| (slice.q.to_vec(), vec![0.0; slice.v.len()])).unwrap();
    let (pushed, kept) = (PartPoint { part: 0, point: DVec3::ZERO }, DVec3::Z * 6.0);
    for body in [solid, figure] {
        world.apply_force_at(body, pushed, DVec3::X * 1e4).unwrap();
    }
    world.apply_torque(solid, DVec3::X * 1e4).unwrap();
    world.set_pose(solid, DVec3::X * 5.0, DQuat::IDENTITY).unwrap();
    world.set_velocity(solid, DVec3::ZERO, DVec3::ZERO).unwrap();
    world.set_slice(figure, &still.0, &still.1).unwrap();
    // What is asked for afterwards counts.
    world.apply_force(solid, kept, DVec3::X * 5.0).unwrap();
    world.step();
    let expected = kept * DT / 2.0;
    assert!((world.velocity(solid).unwrap() - expected).length() < 1e-9, "{:?}", world.velocity(solid));
    assert!(world.angular_velocity(solid).unwrap().length() < 1e-9);
    assert!(world.slice(figure).unwrap().v.iter().all(|v| v.abs() < 1e-6), "{:?}", world.slice(figure));
}

/// A force gives its impulse, and its moment as far as nothing moves within the tick, whatever it acts on; and it is for
/// one tick.
#[test]
fn a_push_at_a_point_of_any_kind_is_its_impulse() {
    type Build = fn(&mut World) -> (BodyId, u32);
    let builds: [Build; 6] = [
        |world| (particle(world, DVec3::X, DVec3::ZERO, 2.0), 0),
        |world| (rigid(world, 2.0, DVec3::X), 0),
        |world| (add(world, articulated()), 1),
        |world| (add(world, natural()), 1),
        |world| (add(world, jelly()), 4),
        |world| (add(world, lattice()), 1),
    ];
    for (i, build) in builds.into_iter().enumerate() {
        let mut world = precise(DVec3::ZERO);
        let (body, part) = build(&mut world);
        let force = DVec3::new(0.3, -0.2, 0.5);
        let point = if i == 0 { DVec3::ZERO } else { DVec3::new(0.15, 0.1, -0.05) };
        let at = PartPoint { part, point };
        let place = world.frame(body, at).unwrap().place(DVec3::ZERO);
        world.apply_force_at(body, at, force / 2.0).unwrap();
        world.apply_force_at(body, at, force / 2.0).unwrap();
        world.step();
        let momentum = world.momentum();
        assert!((momentum.linear - force * DT).length() < 1e-7, "{i}: {}", momentum.linear / DT);
        let moment = place.cross(force * DT);
        assert!((momentum.angular - moment).length() < 2e-2 * moment.length(), "{i}: {} {moment}", momentum.angular);
        let frame = world.frame(body, at).unwrap();
        assert!(DVec3::from(frame.linear).dot(force) > 0.0, "{i}");
        world.step();
        assert!((world.momentum().linear - momentum.linear).length() < 1e-7, "{i}");
        let error = world.apply_force_at(body, PartPoint { part: 99, point }, force).unwrap_err().to_string();
        assert!(error.contains("at.part is 99"), "{error}");
        assert!(world.apply_force_at(body, PartPoint { part, point: DVec3::NAN }, force).is_err());
        assert!(world.apply_force_at(body, at, DVec3::INFINITY).is_err());
    }
    let mut world = weightless();
    let figure = add(&mut world, natural());
    assert!(world.apply_force(figure, DVec3::X, DVec3::ZERO).is_err());
}

/// What sleeps wakes where it is pushed.
#[test]
fn a_push_wakes_a_figure() {
    let mut world = World::new(Settings { gravity: DVec3::ZERO, ..Settings::at(DT) }).unwrap();
    let figure = add(&mut world, natural());
    for _ in 0..300 {
        world.step();
    }
    assert!(world.is_asleep(figure));
    world.apply_force_at(figure, PartPoint { part: 0, point: DVec3::ZERO }, DVec3::Y * 6.0).unwrap();
    world.step();
    assert!((world.momentum().linear - DVec3::Y * 6.0 * DT).length() < 1e-3, "{}", world.momentum().linear);
}

/// A quarantined figure does not hoard its pushes.
#[test]
fn pushes_on_a_quarantined_figure_are_forgotten() {
    let mut world = weightless();
    let figure = add(&mut world, natural());
    let at = PartPoint { part: 0, point: DVec3::ZERO };
    for _ in 0..5 {
        for _ in 0..200 {
            world.apply_force_at(figure, at, DVec3::Y * 9e8).unwrap();
        }
        world.step();
    }
    assert!(world.is_quarantined(figure));
    let (q, v) = (natural().1, vec![0.0; 21]);
    world.set_slice(figure, &q, &v).unwrap();
    world.step();
    assert!(world.momentum().linear.length() < 1e-9);
}

/// Every joint between a part in natural coordinates and a rigid body: held to its tolerance, momentum kept.
#[test]
fn joints_of_every_kind_hold_on_natural_coordinates() {
    for kind in 0..6 {
        let mut world = precise(DVec3::ZERO);
        let figure = add(&mut world, natural());
        let tip = DVec3::X * 0.9;
        let bob = rigid(&mut world, 2.0, tip + DVec3::X * 0.1);
        world.set_velocity(bob, DVec3::new(0.2, 1.0, -0.5), DVec3::new(1.0, 0.5, -0.3)).unwrap();
        let (a, b) = (Anchor::part(figure, 1, DVec3::X * 0.3), Anchor::body(bob, DVec3::X * -0.1));
        let added = match kind {
            0 => world.add_ball_joint(BallJointDesc::new(a, b)).is_ok(),
            1 => world.add_hinge(HingeDesc::new(a, b, DVec3::Y, DVec3::Y)).is_ok(),
            2 => world.add_fixed_joint(FixedJointDesc::new(a, b)).is_ok(),
            3 => world.add_slider(SliderDesc::new(a, b, DVec3::X)).is_ok(),
            4 => world.add_universal_joint(UniversalJointDesc::new(a, b, DVec3::Y, DVec3::Z)).is_ok(),
            _ => world.add_rod(RodDesc::new(a, Anchor::body(bob, DVec3::ZERO), 0.1)).is_ok(),
        };
        assert!(added, "joint {kind}");
        let (linear, energy) = (world.momentum().linear, world.energy().total());
        for tick in 0..60 {
            let report = world.step().clone();
            assert!(report.open_joints == 0 && report.worst_joint_gap <= 1e-3, "joint {kind}, tick {tick}: {report:?}");
            assert!(world.energy().total() < energy * (1.0 + 1e-6), "joint {kind}, tick {tick}");
        }
        assert!((world.momentum().linear - linear).length() < 1e-5, "joint {kind}");
        let tip = world.frame(figure, PartPoint { part: 1, point: DVec3::X * 0.3 }).unwrap();
        assert!(DVec3::from(tip.linear).length() > 0.05, "joint {kind}: the figure comes along");
    }
}

/// A motor between the outer part of a figure and a rigid wheel reaches its speed, no faster than its limit allows, and
/// what it gives to the wheel it takes from the figure.
#[test]
fn a_motor_on_a_part_of_a_figure_drives_a_wheel() {
    for (dof, hub) in [(articulated(), DVec3::X * 0.3), (natural(), DVec3::X * 0.3)] {
        let mut world = precise(DVec3::ZERO);
        let figure = add(&mut world, dof);
        let place = world.frame(figure, PartPoint { part: 1, point: hub }).unwrap().place(DVec3::ZERO);
        let inertia = Shape::Cylinder { half_length: 0.05, radius: 0.2, rounding: 0.01 }.inertia(1.0);
        let wheel = world.add_rigid_body(RigidBodyDesc::new(place, 1.0, inertia)).unwrap();
        let hinge = HingeDesc::new(Anchor::part(figure, 1, hub), Anchor::body(wheel, DVec3::ZERO), DVec3::Z, DVec3::Z);
        let hinge = world.add_hinge(hinge).unwrap();
        let motor = Motor { target_speed: 10.0, gain: 1e3, max_torque: 0.5 };
        world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor }).unwrap();
        let mut spun = 0.0;
        for tick in 0..60 {
            let report = world.step().clone();
            assert!(report.open_joints == 0 && report.residual < 1e-8, "tick {tick}: {report:?}");
            let spin = world.angular_velocity(wheel).unwrap().z;
            assert!(spin - spun < (0.5 / inertia.z + 1e-6) * DT, "tick {tick}: {spun} {spin}");
            spun = spin;
        }
        let carrier = world.frame(figure, PartPoint { part: 1, point: hub }).unwrap();
        let speed = spun - DVec3::from(carrier.angular).z;
        assert!((speed - 10.0).abs() < 0.1 && spun > 5.0, "{speed} {spun}");
        assert!(world.momentum().linear.length() < 1e-6, "{}", world.momentum().linear);
    }
}

/// Figures of two kinds, joined to each other.
#[test]
fn figures_are_joined_to_figures() {
    let mut world = precise(DVec3::ZERO);
    let (a, b) = (add(&mut world, articulated()), add(&mut world, natural()));
    let q: Vec<f64> = natural().1.chunks(3).flat_map(|p| [p[0] + 1.2, p[1], p[2]]).collect();
    world.set_slice(b, &q, &[0.0; 21]).unwrap();
    let joint = BallJointDesc::new(Anchor::part(a, 1, DVec3::X * 0.3), Anchor::part(b, 0, DVec3::X * -0.3));
    world.add_ball_joint(joint).unwrap();
    let at = PartPoint { part: 1, point: DVec3::ZERO };
    for tick in 0..60 {
        world.apply_force_at(b, at, DVec3::Y * 5.0).unwrap();
        let report = world.step().clone();
        assert!(report.open_joints == 0 && report.unconverged_islands == 0, "tick {tick}: {report:?}");
    }
    let expected = DVec3::Y * 5.0 * 60.0 * DT;
    assert!((world.momentum().linear - expected).length() < 1e-4, "{}", world.momentum().linear);
    assert!(DVec3::from(world.frame(a, at).unwrap().linear).y > 0.05);
}
