//! What a tick allocates once it is warm: nothing, whatever the kind of DOF.
//!
//! A binary and a single test of its own, because the allocator counts for the whole process.

use std::alloc::System;
use std::sync::Arc;

use pita_sim::collide::{Compound, Piece};
use pita_sim::mass::{Density, MassProperties, Polyhedron};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, Collider, DQuat, DVec3, Dof, FigureDesc, FiniteElements, JointDesc,
    JointKind, Lattice, LatticeDesc, Natural, NaturalDesc, NaturalPart, PartCollider, PartDesc, PartPoint,
    RigidBodyDesc, Settings, Shape, StaticDesc, World,
};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static COUNTER: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Ticks until every buffer has its size.
const WARM_UP: usize = 400;
const TICKS: usize = 100;

const SHAPE: Shape = Shape::Capsule { half_length: 0.2, radius: 0.1 };

/// Body, head and two legs: where each is, and where it meets the body.
const PARTS: [(DVec3, DVec3); 4] = [
    (DVec3::ZERO, DVec3::ZERO),
    (DVec3::new(0.5, 0.2, 0.0), DVec3::new(0.3, 0.1, 0.0)),
    (DVec3::new(-0.2, -0.3, 0.0), DVec3::new(-0.2, -0.1, 0.0)),
    (DVec3::new(0.2, -0.3, 0.0), DVec3::new(0.2, -0.1, 0.0)),
];

fn mass() -> MassProperties {
    SHAPE.mass_properties(Density::constant(100.0)).unwrap()
}

fn collider() -> Collider {
    Collider::new(SHAPE, 0.5)
}

fn add(world: &mut World, dof: Arc<dyn Dof>, q: Vec<f64>, collides: &[PartPoint]) {
    let v = vec![0.0; dof.blocks().iter().map(|block| usize::from(block.rates)).sum()];
    let colliders = collides.iter().map(|&at| PartCollider { at, collider: collider() }).collect();
    world.add_figure(FigureDesc { dof, q, v, colliders }).unwrap();
}

fn centres() -> [PartPoint; 4] {
    [0, 1, 2, 3].map(|part| PartPoint { part, point: DVec3::ZERO })
}

/// The sheep as rigid bodies on ball joints.
fn bodies(world: &mut World) {
    let body = |(centre, _): (DVec3, DVec3)| RigidBodyDesc {
        collider: Some(collider()),
        ..RigidBodyDesc::new(DVec3::Y + centre, mass().mass, mass().principal().0)
    };
    let ids: Vec<BodyId> = PARTS.iter().map(|&part| world.add_rigid_body(body(part)).unwrap()).collect();
    for (&id, (centre, meets)) in ids.iter().zip(PARTS).skip(1) {
        let desc = BallJointDesc::new(Anchor::body(ids[0], meets), Anchor::body(id, meets - centre));
        world.add_ball_joint(desc).unwrap();
    }
}

/// In independent coordinates.
fn articulated(world: &mut World) {
    let part = |(i, (centre, meets)): (usize, (DVec3, DVec3))| {
        let (kind, parent) = if i == 0 { (JointKind::Free, None) } else { (JointKind::Ball, Some(0)) };
        PartDesc { name: "part".into(), mass: mass(), parent, joint: JointDesc::new(kind).at(meets, meets - centre) }
    };
    let figure = Articulated::new(PARTS.into_iter().enumerate().map(part).collect()).unwrap();
    let mut q = figure.rest();
    q[1] = 1.0;
    add(world, Arc::new(figure), q, &centres());
}

/// In natural coordinates: four tetrahedra, each of which shares a point with the first.
fn natural(world: &mut World) {
    let mut desc = NaturalDesc::default();
    for (i, (centre, meets)) in (0u32..).zip(PARTS) {
        let corners = DVec3::AXES.map(|axis| meets + 0.2 * axis);
        let first = desc.points.len() as u32;
        let points = if i == 0 {
            desc.points.extend(PARTS[1..].iter().map(|&(_, meets)| meets).chain([DVec3::new(0.0, 0.2, 0.2)]));
            vec![0, 1, 2, 3]
        } else {
            assert!((desc.points[i as usize - 1] - meets).length() < 1e-12);
            desc.points.extend(corners);
            vec![i - 1, first, first + 1, first + 2]
        };
        let (name, rotation) = ("part".into(), DQuat::IDENTITY);
        desc.parts.push(NaturalPart { name, points, position: centre, rotation, mass: mass() });
    }
    let figure = Natural::new(desc.with_edges()).unwrap();
    let q = figure.placed(DVec3::Y, DQuat::IDENTITY);
    add(world, Arc::new(figure), q, &centres());
}

/// Twenty links, of which the first hangs from the world.
fn chain(world: &mut World) {
    let mut last = Anchor::world(DVec3::Y * 8.0);
    for i in 0..20 {
        let place = DVec3::new(0.4 * f64::from(i) + 0.2, 8.0, 0.0);
        let link = RigidBodyDesc::new(place, mass().mass, mass().principal().0);
        let link = world.add_rigid_body(link).unwrap();
        world.add_ball_joint(BallJointDesc::new(last, Anchor::body(link, DVec3::X * -0.2))).unwrap();
        last = Anchor::body(link, DVec3::X * 0.2);
    }
}

fn jelly(world: &mut World) {
    let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [3, 2, 2]).unwrap();
    let material = Elastic::new(1e5, 0.3).unwrap();
    let jelly = FiniteElements::new(&mesh, material, Density::constant(1000.0), &[]).unwrap().damped(0.01).unwrap();
    let at: Vec<_> = [0, 3, 8, 11].iter().map(|&node| jelly.at_node(node).unwrap()).collect();
    let q = jelly.placed(DVec3::Y * 0.5, DQuat::IDENTITY);
    add(world, Arc::new(jelly), q, &at);
}

/// The same, on hulls that deform, and a table on it.
fn jelly_of_hulls(world: &mut World) {
    let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [2, 1, 2]).unwrap();
    let material = Elastic::new(1e5, 0.3).unwrap();
    let jelly = FiniteElements::new(&mesh, material, Density::constant(300.0), &[]).unwrap().damped(0.01).unwrap();
    let hulls = jelly.surface_hulls(0.02, 0.5);
    let (q, v) = (jelly.placed(DVec3::Y * 0.5, DQuat::IDENTITY), jelly.still());
    let desc = FigureDesc { dof: Arc::new(jelly), q, v, colliders: Vec::new() };
    world.add_figure_with_hulls(desc, hulls).unwrap();
    let foot = |x: f64| Piece::new(collider(), DVec3::X * x, 100.0);
    let compound = Compound::new(vec![foot(-0.2), foot(0.3)]).unwrap();
    world.add_compound(&compound, DVec3::new(0.5, 2.0, 0.5), DQuat::IDENTITY).unwrap();
}

fn lattice(world: &mut World) {
    let corners: Vec<DVec3> =
        (0..8u8).map(|i| DVec3::from_array([1, 2, 4].map(|b| f64::from(u8::from(i & b > 0))))).collect();
    let solid = Polyhedron::of_hull(&corners).unwrap();
    let material = Elastic::new(1e5, 0.3).unwrap();
    let (min, max, density) = (DVec3::ZERO, DVec3::ONE, Density::constant(500.0));
    let lattice = Lattice::new(&solid, LatticeDesc { min, max, cells: [2, 2, 2], material, density, damping: 0.01 });
    let lattice = lattice.unwrap();
    let at: Vec<_> = corners.iter().map(|&corner| lattice.at(corner).unwrap()).collect();
    let q = lattice.placed(DVec3::Y * 0.5, DQuat::IDENTITY);
    add(world, Arc::new(lattice), q, &at);
}

/// What asks at every step of its way, as a wheel at a kerb does, whether it would meet a wall.
fn ask(world: &mut World, id: BodyId) -> usize {
    (0..100).filter(|&i| world.meets_static(id, DVec3::new(0.01 * f64::from(i), 0.5, 0.0)).unwrap()).count()
}

#[test]
fn a_warm_tick_allocates_nothing() {
    questions_allocate_nothing();
    ticks_allocate_nothing();
}

fn questions_allocate_nothing() {
    let mut world = World::new(Settings::at(1.0 / 30.0)).unwrap();
    let wall = Collider::new(Shape::Box { half: DVec3::new(0.1, 0.5, 1.0) }, 0.5);
    world.add_static(StaticDesc { position: DVec3::new(1.0, 0.5, 0.0), ..StaticDesc::new(wall) }).unwrap();
    let wheel = Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 };
    let desc = RigidBodyDesc::new(DVec3::Y * 0.5, 25.0, wheel.inertia(25.0));
    let id = world.add_rigid_body(RigidBodyDesc { collider: Some(Collider::new(wheel, 0.5)), ..desc }).unwrap();
    world.step();
    let met = ask(&mut world, id);
    assert!((10..90).contains(&met), "{met} of 100 places are in the wall");
    let region = Region::new(COUNTER);
    assert_eq!(ask(&mut world, id), met);
    let change = region.change();
    assert_eq!(change.allocations + change.reallocations, 0, "{change:?} in 100 questions");
}

fn ticks_allocate_nothing() {
    type Scene = (&'static str, fn(&mut World));
    let scenes: [Scene; 7] = [
        ("sheep of bodies", bodies),
        ("sheep in independent coordinates", articulated),
        ("sheep in natural coordinates", natural),
        ("chain", chain),
        ("jelly", jelly),
        ("jelly of hulls", jelly_of_hulls),
        ("lattice", lattice),
    ];
    for (name, build) in scenes {
        let mut world = World::new(Settings::at(1.0 / 30.0)).unwrap();
        let ground = Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5);
        world.add_static(StaticDesc::new(ground)).unwrap();
        build(&mut world);
        for _ in 0..WARM_UP {
            world.step();
        }
        let region = Region::new(COUNTER);
        for _ in 0..TICKS {
            world.step();
        }
        let change = region.change();
        let made = change.allocations + change.reallocations;
        assert_eq!(made, 0, "{name}: {change:?} in {TICKS} ticks, at last {:?}", world.report());
    }
}
