//! The audit of energy: it knows what was put in, and notices what comes from nowhere.

use std::sync::Arc;

use pita_sim::dof::{BlockSize, Columns, Inertia, LocalState, PointMasses};
use pita_sim::{
    Anchor, BallJointDesc, Collider, DMat3, DVec3, Dof, DofKind, FigureDesc, Frame, JointDrive, PartPoint, PdControl,
    PdDesc, RigidBodyDesc, Settings, Shape, SolverSettings, SpringDesc, StaticDesc, World,
};

use super::DT;

fn world() -> World {
    World::new(Settings { audit_energy: true, ..Settings::at(DT) }).unwrap()
}

fn cube(at: DVec3) -> RigidBodyDesc {
    let shape = Shape::Box { half: DVec3::splat(0.5) };
    let inertia = shape.inertia(10.0);
    RigidBodyDesc { collider: Some(Collider::new(shape, 0.5)), ..RigidBodyDesc::new(at, 10.0, inertia) }
}

/// A force, a torque and a controller: what they put in is what the cube has, less what the scheme dissipates.
#[test]
fn what_is_put_in_is_no_gain() {
    let mut world = world();
    let body = world.add_rigid_body(cube(DVec3::Y * 50.0)).unwrap();
    let drive = JointDrive::Position { frequency: 1.0, damping_ratio: 0.5 };
    let control = PdControl { target: DVec3::new(3.0, 52.0, 0.0), target_velocity: DVec3::ZERO };
    let at = Anchor::body(body, DVec3::ZERO);
    world.add_pd(PdDesc { at, drive, max_force: f64::INFINITY, control }).unwrap();
    let end = Anchor::world(DVec3::new(0.0, 55.0, 0.0));
    let spring = SpringDesc { a: at, b: end, rest_length: 1.0, stiffness: 200.0, damping: 5.0 };
    world.add_spring(spring).unwrap();
    let (mut put_in, mut gained, start) = (0.0, 0.0, world.energy().total());
    for _ in 0..60 {
        let position = world.position(body).unwrap();
        world.apply_force(body, DVec3::new(30.0, 0.0, 10.0), position).unwrap();
        world.apply_torque(body, DVec3::new(5.0, 5.0, 0.0)).unwrap();
        let report = world.step();
        assert!(report.energy_gain < 1e-3, "{report:?}");
        put_in += report.work_put_in;
        gained += report.energy_gain;
    }
    let end = world.energy().total();
    assert!((start + put_in + gained - end).abs() < 1e-6 * end.abs(), "{start} + {put_in} + {gained} is not {end}");
    assert!(put_in.abs() > 100.0 && gained < -1.0, "{put_in} J put in, {gained} J gained");
}

/// Ten cubes fall on each other: contacts only take.
#[test]
fn a_falling_heap_has_no_burst() {
    let mut world = world();
    let ground = Shape::HalfSpace { normal: DVec3::Y };
    let ground =
        StaticDesc { collider: Collider::new(ground, 0.5), position: DVec3::ZERO, rotation: Default::default() };
    world.add_static(ground).unwrap();
    for i in 0..10 {
        let (x, y) = (0.3 * f64::from(i % 3), 1.0 + 1.3 * f64::from(i));
        world.add_rigid_body(cube(DVec3::new(x, y, 0.2 * f64::from(i % 2)))).unwrap();
    }
    for tick in 0..300 {
        let report = world.step();
        assert!(!report.is_energy_burst(), "tick {tick}: {report:?}");
    }
    assert!(world.report().kinetic_energy < 1.0);
}

/// Chains of cubes on ball joints, thrown at one another with far too little work allowed: what is not solved may be open
/// and deep, but gains nothing.
#[test]
fn what_is_not_solved_gains_nothing() {
    let solver = SolverSettings { budget: Some(3_000), ..SolverSettings::default() };
    let mut world = World::new(Settings { audit_energy: true, solver, ..Settings::at(DT) }).unwrap();
    for chain in 0..8 {
        let side = if chain % 2 == 0 { -1.0 } else { 1.0 };
        let velocity = DVec3::new(-15.0 * side, 0.0, 0.0);
        let start = DVec3::new(4.0 * side, 1.2 * f64::from(chain / 2), 0.0);
        let links = [0.0, 1.1, 2.2, 3.3].map(|x| {
            let angular_velocity = DVec3::new(3.0, 5.0, -4.0) * side;
            let body = RigidBodyDesc { velocity, angular_velocity, ..cube(start + DVec3::X * (x * side)) };
            world.add_rigid_body(body).unwrap()
        });
        for pair in links.windows(2) {
            let end = |body, x: f64| Anchor::body(body, DVec3::X * (x * side));
            world.add_ball_joint(BallJointDesc::new(end(pair[0], 0.55), end(pair[1], -0.55))).unwrap();
        }
    }
    let mut stopped = 0;
    for tick in 0..90 {
        let report = world.step();
        stopped += report.out_of_budget_islands;
        assert!(report.energy_gain < 1e-3 * report.kinetic_energy + 10.0, "tick {tick}: {report:?}");
    }
    assert!(stopped > 30, "{stopped} islands ran out of budget");
}

/// A point that pushes itself along, which no potential does.
struct Perpetual(PointMasses);

/// N.
const PUSH: f64 = 500.0;

impl Dof for Perpetual {
    fn kind(&self) -> DofKind {
        DofKind::Own("perpetual")
    }

    fn blocks(&self) -> &[BlockSize] {
        &[BlockSize { positions: 3, rates: 3 }]
    }

    fn parts(&self) -> u32 {
        1
    }

    fn frame(&self, _at: PartPoint, q: &[f64], v: &[f64]) -> Frame<f64> {
        Frame::point(DVec3::from_slice(q), DVec3::from_slice(v))
    }

    fn jacobian(&self, _at: PartPoint, _q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
        let mut columns = Columns::default();
        (0..3).for_each(|i| columns[i][i] = 1.0);
        visit(0, &columns);
    }

    fn inertia(&self) -> Inertia<'_> {
        Inertia::Points(&self.0)
    }

    fn energy(&self, at: &LocalState, gradient: &mut [f64]) -> f64 {
        gradient[0] -= PUSH;
        -PUSH * (at.q1[0] - at.q0[0])
    }

    fn stored_energy(&self, _at: &LocalState) -> f64 {
        0.0
    }

    fn point_stiffness(&self, _at: &LocalState, _own: &mut [DMat3], _pairs: &mut [DMat3]) {}
}

#[test]
fn energy_from_nowhere_is_noticed() {
    let mut masses = PointMasses::new(1);
    masses.diagonal[0] = 1.0;
    for audit_energy in [true, false] {
        let mut world = World::new(Settings { audit_energy, ..Settings::at(DT) }).unwrap();
        let (dof, q, v) = (Arc::new(Perpetual(masses.clone())), vec![0.0; 3], vec![0.0; 3]);
        world.add_figure(FigureDesc { dof, q, v, colliders: Vec::new() }).unwrap();
        let bursts = (0..30).filter(|_| world.step().is_energy_burst()).count();
        assert_eq!(bursts > 20, audit_energy, "{bursts} of 30 ticks");
    }
}
