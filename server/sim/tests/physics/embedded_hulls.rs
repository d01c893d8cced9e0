//! Hulls whose vertices are embedded in DOF: jellies, bodies in lattices and sheep rest, carry and are stopped.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties, Polyhedron};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    BodyId, Collider, DQuat, DVec3, EmbeddedHull, FigureDesc, FiniteElements, Lattice, LatticeDesc, Natural,
    NaturalDesc, NaturalPart, PartPoint, QueryFilter, Settings, Shape, StaticDesc, World,
};

use super::{DT, body, ground, weightless, world};

const RADIUS: f64 = 0.02;

/// A block of rubber of 1 × 0.6 × 0.6 m, its frame's origin amid its foot.
pub fn jelly(young: f64, cells: [u32; 3]) -> FiniteElements {
    let mesh = TetrahedralMesh::of_box(DVec3::new(-0.5, 0.0, -0.3), DVec3::new(0.5, 0.6, 0.3), cells).unwrap();
    let material = Elastic::new(young, 0.3).unwrap();
    FiniteElements::new(&mesh, material, Density::constant(200.0), &[]).unwrap().damped(0.02).unwrap()
}

pub fn add_jelly(world: &mut World, body: FiniteElements, position: DVec3, rotation: DQuat) -> BodyId {
    let hulls = body.surface_hulls(RADIUS, 0.5);
    let (q, v) = (body.placed(position, rotation), body.still());
    let desc = FigureDesc { dof: Arc::new(body), q, v, colliders: Vec::new() };
    world.add_figure_with_hulls(desc, hulls).unwrap()
}

/// Corners of a box, bit 0, 1, 2 for the upper x, y, z.
fn corners(min: DVec3, max: DVec3) -> Vec<DVec3> {
    let pick = |i: usize, axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
    (0..8).map(|i| DVec3::new(pick(i, 0), pick(i, 1), pick(i, 2))).collect()
}

const MIN: DVec3 = DVec3::new(-0.5, 0.0, -0.3);
const MAX: DVec3 = DVec3::new(0.5, 0.6, 0.3);

/// The same block in a lattice.
fn in_lattice() -> Lattice {
    let desc = LatticeDesc {
        min: MIN,
        max: MAX,
        cells: [2, 2, 2],
        material: Elastic::new(2e5, 0.3).unwrap(),
        density: Density::constant(200.0),
        damping: 0.02,
    };
    Lattice::new(&Polyhedron::of_hull(&corners(MIN, MAX)).unwrap(), desc).unwrap()
}

fn add_lattice(world: &mut World, position: DVec3, rotation: DQuat) -> BodyId {
    let body = in_lattice();
    // A hull for every cell.
    let size = (MAX - MIN) / 2.0;
    let cell = |corner: DVec3| body.hull(&corners(corner, corner + size), RADIUS, 0.5).unwrap();
    let hulls = corners(MIN, MIN + size).into_iter().map(cell).collect();
    let (q, v) = (body.placed(position, rotation), vec![0.0; body.rest().len()]);
    world.add_figure_with_hulls(FigureDesc { dof: Arc::new(body), q, v, colliders: Vec::new() }, hulls).unwrap()
}

/// Deepest overlap found at the start of this tick, m.
fn depth(world: &World) -> f64 {
    world.contacts().map(|contact| -contact.gap).fold(0.0, f64::max)
}

fn points(world: &World, id: BodyId) -> Vec<DVec3> {
    world.slice(id).unwrap().q.chunks_exact(3).map(DVec3::from_slice).collect()
}

fn fastest(world: &World, id: BodyId) -> f64 {
    world.slice(id).unwrap().v.iter().fold(0.0, |a, v| a.max(v.abs()))
}

/// Dropped from half a metre, tilted, a jelly of either kind comes to rest on the ground, on every vertex that is below.
#[test]
fn a_jelly_rests_on_the_ground() {
    type Add = fn(&mut World) -> BodyId;
    let drop: [(&str, Add); 3] = [
        ("one cell", |world| add_jelly(world, jelly(2e5, [1, 1, 1]), DVec3::Y * 0.5, DQuat::from_rotation_z(0.3))),
        ("elements", |world| add_jelly(world, jelly(2e5, [3, 2, 2]), DVec3::Y * 0.5, DQuat::from_rotation_z(0.3))),
        ("lattice", |world| add_lattice(world, DVec3::Y * 0.5, DQuat::from_rotation_z(0.3))),
    ];
    for (name, add) in drop {
        let mut world = world();
        ground(&mut world);
        let id = add(&mut world);
        let mut deepest = 0.0f64;
        for tick in 0..240 {
            let report = world.step().clone();
            deepest = deepest.max(depth(&world));
            assert!(report.unconverged_islands == 0, "{name}, tick {tick}: {report:?}");
        }
        assert!(deepest < 0.02, "{name}: {deepest} m");
        assert!(depth(&world) < 1.5e-3, "{name}: {} m at rest", depth(&world));
        assert!(fastest(&world, id) < 0.01, "{name}: {} m/s", fastest(&world, id));
        let lowest = points(&world, id).iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        assert!((RADIUS - 2e-3..RADIUS + 2e-3).contains(&lowest), "{name}: {lowest} m");
    }
}

/// A jelly falls on a box that stands on the ground and stays on it; momentum goes through it into the ground.
#[test]
fn a_jelly_rests_on_a_box() {
    for young in [5e4, 2e5, 1e6] {
        let mut world = world();
        ground(&mut world);
        let pedestal = body(&mut world, Shape::Box { half: DVec3::new(0.7, 0.25, 0.5) }, 80.0, DVec3::Y * 0.25, 0.5);
        let id = add_jelly(&mut world, jelly(young, [3, 2, 2]), DVec3::new(0.05, 1.0, 0.02), DQuat::IDENTITY);
        let mut deepest = 0.0f64;
        for tick in 0..300 {
            let report = world.step().clone();
            deepest = deepest.max(depth(&world));
            assert!(report.quarantined == 0 && report.unconverged_islands == 0, "{young}, tick {tick}: {report:?}");
        }
        assert!(deepest < 0.02, "{young} Pa: {deepest} m");
        assert!(depth(&world) < 2e-3, "{young} Pa: {} m at rest", depth(&world));
        assert!(fastest(&world, id) < 0.01, "{young} Pa: {} m/s", fastest(&world, id));
        let lowest = points(&world, id).iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        assert!((0.5 + RADIUS - lowest).abs() < 3e-3, "{young} Pa: {lowest} m");
        let box_at = world.position(pedestal).unwrap();
        assert!((box_at - DVec3::Y * 0.25).length() < 0.02, "{young} Pa: {box_at}");
    }
}

/// Boxes and balls lie on a jelly, and two jellies on each other.
#[test]
fn a_jelly_carries() {
    let mut world = world();
    ground(&mut world);
    let lower = add_jelly(&mut world, jelly(2e5, [3, 2, 2]), DVec3::Y * RADIUS, DQuat::IDENTITY);
    let upper = add_lattice(&mut world, DVec3::Y * 0.7, DQuat::IDENTITY);
    let crate_on_top = body(&mut world, Shape::Box { half: DVec3::splat(0.15) }, 10.0, DVec3::Y * 1.6, 0.5);
    let mut deepest = 0.0f64;
    for _ in 0..300 {
        world.step();
        deepest = deepest.max(depth(&world));
    }
    assert!(deepest < 0.02, "{deepest} m");
    assert!(fastest(&world, lower).max(fastest(&world, upper)) < 0.02);
    let top = world.position(crate_on_top).unwrap();
    assert!(top.y > 1.3 && top.y < 1.45 && top.x.abs() < 0.1, "{top}");
}

/// A force on a vertex is one on the body: two jellies that hit each other keep their momentum.
#[test]
fn colliding_jellies_keep_their_momentum() {
    let mut world = weightless();
    let a = add_jelly(&mut world, jelly(1e5, [2, 1, 1]), DVec3::X * -0.8, DQuat::from_rotation_x(0.2));
    let b = add_jelly(&mut world, jelly(1e5, [2, 1, 1]), DVec3::X * 0.8, DQuat::from_rotation_x(-0.3));
    for (id, speed) in [(a, 3.0), (b, -1.0)] {
        let q = world.slice(id).unwrap().q.to_vec();
        let v: Vec<_> = (0..q.len()).map(|i| if i % 3 == 0 { speed } else { 0.0 }).collect();
        world.set_slice(id, &q, &v).unwrap();
    }
    let start = world.momentum().linear;
    let energy = world.energy().total();
    for tick in 0..60 {
        world.step();
        assert!(depth(&world) < 0.02, "{} m deep in tick {tick}", depth(&world));
        assert!(world.energy().total() < 1.001 * energy, "tick {tick}");
    }
    let lost = (world.momentum().linear - start).length() / start.length();
    assert!(lost < 1e-2, "{lost}");
    let speed = |id| points(&world, id).iter().map(|p| p.x).sum::<f64>() / points(&world, id).len() as f64;
    assert!(speed(b) - speed(a) > 0.9, "{} {}", speed(a), speed(b));
}

/// A creature in natural coordinates, a trunk on four legs, of capsules between its points: it walks into a wall, is
/// stopped by it, and does not get into it.
#[test]
fn a_creature_of_capsules_walks_into_a_wall() {
    let trunk =
        [DVec3::new(-0.4, 0.6, 0.0), DVec3::new(0.4, 0.6, 0.0), DVec3::new(0.0, 0.9, 0.2), DVec3::new(0.0, 0.9, -0.2)];
    let props: MassProperties =
        Shape::Box { half: DVec3::new(0.5, 0.2, 0.2) }.mass_properties(Density::constant(250.0)).unwrap();
    let desc = NaturalDesc {
        points: trunk.to_vec(),
        rods: Vec::new(),
        parts: vec![NaturalPart {
            name: "trunk".into(),
            points: vec![0, 1, 2, 3],
            position: DVec3::Y * 0.7,
            rotation: DQuat::IDENTITY,
            mass: props,
        }],
    };
    let creature = Natural::new(desc.with_edges()).unwrap();
    let at = |x: f64, y: f64, z: f64| PartPoint { part: 0, point: DVec3::new(x, y - 0.7, z) };
    let legs = [(0.35, 0.15), (0.35, -0.15), (-0.35, 0.15), (-0.35, -0.15)];
    let leg = |(x, z): (f64, f64)| EmbeddedHull::new(vec![at(x, 0.6, z), at(x, 0.1, z)], 0.1, 0.1);
    let mut hulls: Vec<_> = legs.into_iter().map(leg).collect();
    hulls.push(EmbeddedHull::new(vec![at(-0.4, 0.75, 0.0), at(0.5, 0.75, 0.0)], 0.2, 0.1));
    let mut world = World::new(Settings { sleep: None, ..Settings::at(DT) }).unwrap();
    ground(&mut world);
    let wall = Collider::new(Shape::Box { half: DVec3::new(0.05, 2.0, 3.0) }, 0.1);
    world.add_static(StaticDesc { position: DVec3::X * 3.0, ..StaticDesc::new(wall) }).unwrap();
    let q = creature.placed(DVec3::ZERO, DQuat::IDENTITY);
    let v = vec![0.0; q.len()];
    let desc = FigureDesc { dof: Arc::new(creature), q, v, colliders: Vec::new() };
    let id = world.add_figure_with_hulls(desc, hulls).unwrap();
    let mut nose = 0.0f64;
    for tick in 0..180 {
        // What walks: a push that a friction of 0.1 does not hold.
        world.apply_force_at(id, at(0.0, 0.7, 0.0), DVec3::X * 100.0).unwrap();
        world.step();
        assert!(depth(&world) < 0.01, "{} m deep in tick {tick}", depth(&world));
        let middle = world.frame(id, at(0.0, 0.7, 0.0)).unwrap().place(DVec3::ZERO);
        nose = nose.max(middle.x);
        assert!(middle.y > 0.5, "tick {tick}: it fell, {middle}");
    }
    // Its nose, 0.5 m in front and 0.2 m thick, is at the wall.
    assert!((nose - (2.95 - 0.7)).abs() < 5e-3, "{nose}");
    let hit = world.ray_cast(DVec3::new(nose, 5.0, 0.0), DVec3::NEG_Y, 10.0, &QueryFilter::ALL).unwrap().unwrap();
    assert!((hit.point.y - 0.95).abs() < 0.01, "{hit:?}");
}

/// Friction at the surface has the extrusion radius for a lever: what slides on one vertex with a radius comes to roll.
#[test]
fn a_vertex_with_a_radius_rolls() {
    const REACH: f64 = 0.3;
    let middle = PartPoint { part: 0, point: DVec3::ZERO };
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|corner| (corner - DVec3::splat(0.25)) * 0.4);
    let mass = Shape::Ball { radius: REACH }.mass_properties(Density::constant(500.0)).unwrap();
    let part = NaturalPart {
        name: "ball".into(),
        points: vec![0, 1, 2, 3],
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        mass,
    };
    let desc = NaturalDesc { points: corners.to_vec(), rods: Vec::new(), parts: vec![part] };
    let ball = Natural::new(desc.with_edges()).unwrap();
    let mut world = World::new(Settings { sleep: None, ..Settings::at(DT) }).unwrap();
    ground(&mut world);
    let q = ball.placed(DVec3::Y * REACH, DQuat::IDENTITY);
    let v = ball.moving(&q, DVec3::Y * REACH, DVec3::X * 4.0, DVec3::ZERO);
    let desc = FigureDesc { dof: Arc::new(ball), q, v, colliders: Vec::new() };
    let id = world.add_figure_with_hulls(desc, vec![EmbeddedHull::new(vec![middle], REACH, 0.5)]).unwrap();
    (0..12).for_each(|_| drop(world.step().clone()));
    let frame = world.frame(id, middle).unwrap();
    let (speed, spin) = (DVec3::from(frame.linear).x, DVec3::from(frame.angular).z);
    // It slid for a quarter of a second; with nothing to turn it, it would slide for 0.8 s and stop.
    assert!(speed > 2.0 && speed < 3.2, "{speed} m/s");
    assert!((speed + REACH * spin).abs() < 0.02, "{speed} m/s, {spin} rad/s");
}

#[test]
fn bad_hulls_are_refused_by_name() {
    let body = jelly(1e5, [1, 1, 1]);
    let mut world = world();
    let good = body.surface_hulls(RADIUS, 0.5)[0].vertices().to_vec();
    let mut refused = |hull: EmbeddedHull| {
        let (q, v) = (body.rest(), body.still());
        let desc = FigureDesc { dof: Arc::new(body.clone()), q, v, colliders: Vec::new() };
        world.add_figure_with_hulls(desc, vec![hull]).unwrap_err().to_string()
    };
    assert!(refused(EmbeddedHull::new(vec![], RADIUS, 0.5)).starts_with("hull 0: vertices is 0"));
    assert!(refused(EmbeddedHull::new(vec![good[0]; 257], RADIUS, 0.5)).starts_with("hull 0: vertices is 257"));
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(EmbeddedHull::new(good.clone(), radius, 0.5)).starts_with("hull 0: radius is"));
    }
    assert!(refused(EmbeddedHull::new(good.clone(), RADIUS, -1.0)).starts_with("hull 0: friction is -1"));
    let stray = PartPoint { part: 99, ..good[0] };
    assert!(refused(EmbeddedHull::new(vec![good[0], stray], RADIUS, 0.5)).starts_with("hull 0: vertex 1: part is 99"));
    let nowhere = PartPoint { point: DVec3::NAN, ..good[0] };
    assert!(refused(EmbeddedHull::new(vec![nowhere], RADIUS, 0.5)).starts_with("hull 0: vertex 0: place is NaN"));
    assert!(in_lattice().hull(&[MIN, DVec3::Y * 9.0], RADIUS, 0.5).unwrap_err().to_string().starts_with("point 1"));
}
