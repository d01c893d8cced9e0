//! Bodies in lattices against the solids that they embed, closed forms, and what they are asked to look like.

use std::sync::Arc;

use pita_sim::mass::{Density, Polyhedron};
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Anchor, BallJointDesc, Collider, DQuat, DVec3, DofKind, FigureDesc, Lattice, LatticeDesc, PartCollider, RestShape,
    Shape, World,
};

use super::{ground, weightless, world};

/// A tower with a pointed roof, 2 m high.
fn tower() -> Vec<DVec3> {
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let mut points = vec![corner(0.1, 2.0, 0.0)];
    for (x, z) in [(-0.3, -0.3), (0.3, -0.3), (-0.3, 0.3), (0.3, 0.3)] {
        points.extend([corner(x, 0.0, z), corner(0.8 * x, 1.5, 0.8 * z)]);
    }
    points
}

fn desc() -> LatticeDesc {
    LatticeDesc {
        min: DVec3::new(-0.3, 0.0, -0.3),
        max: DVec3::new(0.3, 2.0, 0.3),
        cells: [1, 4, 1],
        material: Elastic::new(1e6, 0.3).unwrap(),
        density: Density::constant(500.0),
        damping: 0.0,
    }
}

fn lattice(desc: LatticeDesc) -> Lattice {
    Lattice::new(&Polyhedron::of_hull(&tower()).unwrap(), desc).unwrap()
}

fn figure(body: Lattice, at: DVec3) -> FigureDesc {
    let (q, v) = (body.placed(at, DQuat::IDENTITY), body.still());
    FigureDesc { dof: Arc::new(body), q, v, colliders: Vec::new() }
}

/// Mass, centre of mass and inertia are the solid's: in how it falls and spins.
#[test]
fn a_body_weighs_and_spins_as_its_solid() {
    let density = Density { at_origin: 500.0, gradient: DVec3::new(100.0, -50.0, 20.0) };
    let solid = Polyhedron::of_hull(&tower()).unwrap();
    let props = solid.mass_properties(density).unwrap();
    let (spin, drift) = (DVec3::new(0.3, -1.2, 0.7), DVec3::new(2.0, 0.0, -1.0));
    let mut moving = figure(lattice(LatticeDesc { density, ..desc() }), DVec3::ZERO);
    for (v, q) in moving.v.chunks_exact_mut(3).zip(moving.q.chunks_exact(3)) {
        v.copy_from_slice(&(drift + spin.cross(DVec3::from_slice(q))).to_array());
    }
    let mut world = world();
    let id = world.add_figure(moving).unwrap();
    let momentum = world.momentum();
    let linear = props.mass * (drift + spin.cross(props.centre));
    let angular = props.inertia() * spin + props.centre.cross(linear);
    assert!((world.mass(id).unwrap() / props.mass - 1.0).abs() < 1e-9);
    assert!((momentum.linear - linear).length() < 1e-9 * linear.length());
    assert!((momentum.angular - angular).length() < 1e-9 * angular.length());
    let height = world.energy().gravitational / (props.mass * 9.81);
    assert!((height - props.centre.y).abs() < 1e-9, "{height}");
}

#[test]
fn vertices_go_where_their_cells_go() {
    let body = lattice(desc());
    let places: Vec<_> = tower().iter().map(|&p| body.at(p).unwrap()).collect();
    assert!(body.at(DVec3::new(0.0, -0.1, 0.0)).is_none());
    let mut world = weightless();
    let turn = DQuat::from_rotation_z(0.4);
    let q = body.placed(DVec3::X, turn);
    let id = world.add_figure(FigureDesc { q, ..figure(body, DVec3::ZERO) }).unwrap();
    assert_eq!(world.slice(id).unwrap().kind, DofKind::Lattice);
    for (point, at) in tower().into_iter().zip(places) {
        let frame = world.frame(id, at).unwrap();
        assert!((DVec3::from(frame.position) - (DVec3::X + turn * point)).length() < 1e-12);
    }
}

/// Asked to bend and twist, it does, and goes back when it is asked to.
#[test]
fn a_tower_takes_the_shape_it_is_asked_for() {
    let mut world = weightless();
    let body = lattice(LatticeDesc { damping: 0.05, ..desc() });
    let top = body.at(DVec3::Y * 2.0).unwrap();
    let id = world.add_figure(figure(body, DVec3::ZERO)).unwrap();
    let feet: Vec<_> = [(-0.3, -0.3), (0.3, -0.3), (-0.3, 0.3), (0.3, 0.3)].map(|(x, z)| DVec3::new(x, 0.0, z)).into();
    for &foot in &feet {
        let at = lattice(desc()).at(foot).unwrap();
        let joint = BallJointDesc::new(Anchor::part(id, at.part, at.point), Anchor::world(foot));
        world.add_ball_joint(joint).unwrap();
    }
    let place = |world: &World| DVec3::from(world.frame(id, top).unwrap().position);
    for shape in [
        RestShape { bend: 0.5, ..RestShape::default() },
        RestShape { scale: DVec3::new(1.0, 1.3, 1.0), twist: 0.4, ..RestShape::default() },
        RestShape::default(),
    ] {
        world.set_controls(id, &shape.numbers()).unwrap();
        (0..150).for_each(|_| drop(world.step().clone()));
        // An arc of radius 1 / bend; the axis itself is not twisted away.
        let (arc, height) = (2.0 * shape.bend, 2.0 * shape.scale.y);
        let wanted = if arc > 0.0 {
            DVec3::new((1.0 - arc.cos()) / shape.bend, arc.sin() / shape.bend, 0.0)
        } else {
            DVec3::Y * height
        };
        let error = place(&world) - wanted;
        assert!(error.length() < 0.1, "{shape:?}: {}", place(&world));
        assert!(world.energy().kinetic < 1e-3, "{}", world.energy().kinetic);
    }
    assert!((place(&world) - DVec3::Y * 2.0).length() < 0.01, "{}", place(&world));
}

#[test]
fn a_crushed_body_recovers_keeps_its_momentum_and_never_gains_energy() {
    let mut world = weightless();
    let mut crushed = figure(lattice(desc()), DVec3::ZERO);
    for (i, x) in crushed.q.iter_mut().enumerate() {
        *x += 0.25 * (i as f64 * 7.1).sin();
    }
    crushed.v.fill(0.5);
    world.add_figure(crushed).unwrap();
    let (momentum, first) = (world.momentum().linear, world.energy().total());
    let mut energy = first;
    for _ in 0..150 {
        world.step();
        let now = world.energy().total();
        assert!(now < energy + 1e-5 * first, "{energy} {now}");
        energy = now;
    }
    let mass = momentum.x / 0.5;
    assert!((world.momentum().linear - momentum).length() < 1e-3 * mass);
    assert!(world.energy().elastic < 1e-4 * first, "{} of {first}", world.energy().elastic);
}

/// Its hull's vertices are its colliders.
#[test]
fn a_body_falls_on_its_vertices_and_rests() {
    let mut world = world();
    ground(&mut world);
    let body = lattice(LatticeDesc { damping: 0.02, ..desc() });
    let ball = |&point: &DVec3| PartCollider {
        at: body.at(point).unwrap(),
        collider: Collider::new(Shape::Ball { radius: 0.05 }, 0.5),
    };
    let colliders = tower().iter().map(ball).collect();
    let id = world.add_figure(FigureDesc { colliders, ..figure(body, DVec3::Y) }).unwrap();
    (0..240).for_each(|_| drop(world.step().clone()));
    let slice = world.slice(id).unwrap();
    let fastest = slice.v.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    assert!(fastest < 0.01, "{fastest} m/s");
    let lowest = slice.q.chunks_exact(3).map(|p| p[1]).fold(f64::INFINITY, f64::min);
    assert!((0.02..0.06).contains(&lowest), "{lowest} m");
}

/// A beam that leans out from a wall on joints, in 10 × 2 × 2 cells, against Timoshenko's. Trilinear cells cannot bend,
/// they shear: n square ones across the thickness are too stiff by 1 / 2n², one part in eight here.
#[test]
fn a_cantilever_in_a_lattice_sags() {
    let (length, thickness, young) = (2.0, 0.4, 1e8);
    let max = DVec3::new(length, thickness, thickness);
    let corners: Vec<_> =
        (0..8).map(|c| max * DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64)).collect();
    let beam = LatticeDesc {
        min: DVec3::ZERO,
        max,
        cells: [10, 2, 2],
        material: Elastic::new(young, 0.0).unwrap(),
        density: Density::constant(1000.0),
        damping: 0.3,
    };
    let body = Lattice::new(&Polyhedron::of_hull(&corners).unwrap(), beam).unwrap();
    let tip = body.at(max * DVec3::new(1.0, 0.5, 0.5)).unwrap();
    let walls: Vec<_> = (0..9).map(|i| DVec3::new(0.0, 0.2 * f64::from(i % 3), 0.2 * f64::from(i / 3))).collect();
    let places: Vec<_> = walls.iter().map(|&wall| body.at(wall).unwrap()).collect();
    let mut world = world();
    let id = world.add_figure(figure(body, DVec3::ZERO)).unwrap();
    for (&wall, at) in walls.iter().zip(&places) {
        let joint = BallJointDesc::new(Anchor::part(id, at.part, at.point), Anchor::world(wall));
        let joint = BallJointDesc { tolerance: 1e-5, ..joint };
        world.add_ball_joint(joint).unwrap();
    }
    (0..150).for_each(|_| drop(world.step().clone()));
    let sag = 0.2 - DVec3::from(world.frame(id, tip).unwrap().position).y;
    let (area, inertia, weight) = (thickness.powi(2), thickness.powi(4) / 12.0, 1000.0 * thickness.powi(2) * 9.81);
    let theory = weight * length.powi(4) / (8.0 * young * inertia)
        + weight * length.powi(2) / (2.0 * (5.0 / 6.0) * (young / 2.0) * area);
    let ratio = sag / theory;
    assert!((ratio * 1.125 - 1.0).abs() < 0.03, "{ratio}");
}

#[test]
fn bad_lattices_are_refused_by_name() {
    let solid = Polyhedron::of_hull(&tower()).unwrap();
    let refused = |desc| Lattice::new(&solid, desc).unwrap_err().to_string();
    assert_eq!(
        refused(LatticeDesc { max: DVec3::new(0.3, 1.9, 0.3), ..desc() }),
        "the solid does not lie inside the lattice"
    );
    assert!(refused(LatticeDesc { max: desc().min, ..desc() }).starts_with("size of the lattice is 0"));
    assert!(refused(LatticeDesc { cells: [1, 0, 1], ..desc() }).starts_with("cells of the lattice is 0"));
    assert!(refused(LatticeDesc { cells: [u32::MAX; 3], ..desc() }).starts_with("cells of the lattice"));
    assert!(refused(LatticeDesc { density: Density::constant(0.0), ..desc() }).starts_with("density is 0"));
    assert!(refused(LatticeDesc { damping: f64::NAN, ..desc() }).starts_with("damping is NaN"));
    let mut world = world();
    let id = world.add_figure(figure(lattice(desc()), DVec3::ZERO)).unwrap();
    let mut refused = |shape: RestShape| world.set_controls(id, &shape.numbers()).unwrap_err().to_string();
    let plain = RestShape::default();
    assert!(refused(RestShape { scale: DVec3::splat(0.01), ..plain }).starts_with("scale of the rest shape is 0.01"));
    assert!(refused(RestShape { twist: 200.0, ..plain }).starts_with("twist of the rest shape is 200"));
    assert!(refused(RestShape { bend: 20.0, ..plain }).contains("inside out"));
}
