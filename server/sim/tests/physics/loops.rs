//! Loops: joints, rods and springs between two parts of one figure.

use std::sync::Arc;

use pita_sim::dof::PointRod;
use pita_sim::mass::{Density, MassProperties};
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, DQuat, DVec3, FigureDesc, HingeDesc, JointDesc, JointKind, Natural,
    NaturalDesc, NaturalPart, PartDesc, PartPoint, RodDesc, Shape, SpringDesc, World,
};

use super::{DT, precise, weightless};

const G: f64 = 9.81;
const LENGTH: f64 = 0.8;
const WIDTH: f64 = 1.2;
const PLATFORM: f64 = 3.0;
const LINK: f64 = 0.4;

fn bob(mass: f64, at: DVec3) -> MassProperties {
    let ball = Shape::Ball { radius: 1e-3 }.mass_properties(Density::constant(1.0)).unwrap();
    MassProperties { centre: at, ..ball.scaled_to(mass).unwrap() }
}

/// A swing of two links and a platform between them, a tree that ends at the second link's lower end.
fn swing(world: &mut World, angle: f64) -> BodyId {
    let part = |name: &str, mass, parent, joint| PartDesc { name: name.into(), mass, parent, joint };
    let hinge = |at: DVec3| JointDesc::new(JointKind::Hinge { axis: DVec3::Z }).at(at, DVec3::ZERO);
    let (middle, end) = (DVec3::Y * (-LENGTH / 2.0), DVec3::Y * -LENGTH);
    let parts = vec![
        part("left link", bob(LINK, middle), None, hinge(DVec3::ZERO)),
        part("platform", bob(PLATFORM, DVec3::X * (WIDTH / 2.0)), Some(0), hinge(end)),
        part("right link", bob(LINK, middle), None, hinge(DVec3::X * WIDTH)),
    ];
    let figure = Articulated::new(parts).unwrap();
    let (q, v) = (vec![angle, -angle, angle], figure.still());
    world.add_figure(FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() }).unwrap()
}

/// The loop's two ends: on the platform, and on the right link.
fn ends(swing: BodyId) -> [Anchor; 2] {
    [Anchor::part(swing, 1, DVec3::X * WIDTH), Anchor::part(swing, 2, DVec3::Y * -LENGTH)]
}

/// A parallelogram swings with ω² = g Σ m r / Σ m r² as implicit Euler samples it, its platform level, however it is closed.
#[test]
fn a_parallelogram_swings_level() {
    let close: [fn(&mut World, [Anchor; 2]); 2] = [
        |world, [a, b]| assert!(world.add_ball_joint(BallJointDesc::new(a, b)).is_ok()),
        |world, [a, b]| assert!(world.add_hinge(HingeDesc::new(a, b, DVec3::Z, DVec3::Z)).is_ok()),
    ];
    for close in close {
        let mut world = precise(DVec3::Y * -G);
        let start = 1e-2;
        let swing = swing(&mut world, start);
        close(&mut world, ends(swing));
        let omega = (G * (PLATFORM + LINK) / (PLATFORM + LINK / 2.0) / LENGTH).sqrt();
        let (turn, kept) = ((omega * DT).atan(), 1.0 / (1.0 + (omega * DT).powi(2)).sqrt());
        for n in 1..=90 {
            world.step();
            let expected = start * kept.powi(n) * (f64::from(n) * turn).cos();
            let q = world.slice(swing).unwrap().q;
            assert!((q[0] - expected).abs() < 1e-3 * start, "tick {n}: {} {expected}", q[0]);
            assert!((q[0] + q[1]).abs() < 1e-3 * start, "tick {n}: the platform is tilted by {}", q[0] + q[1]);
            assert_eq!(world.report().open_joints, 0, "tick {n}");
        }
    }
}

/// A chain of four points whose ends a rod holds together turns as a square, and keeps its momentum.
#[test]
fn a_ring_of_points_is_closed_by_a_rod() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let part = |(i, &position): (usize, &DVec3)| {
        let (name, rotation) = (format!("corner {i}"), DQuat::IDENTITY);
        NaturalPart { name, points: vec![i as u32], position, rotation, mass: bob(1.0, DVec3::ZERO) }
    };
    let mut desc = NaturalDesc { points: corners.to_vec(), ..NaturalDesc::default() };
    desc.parts = corners.iter().enumerate().map(part).collect();
    desc.rods = (0..3).map(|i| PointRod::new([i, i + 1], 1.0)).collect();
    let ring = Natural::new(desc).unwrap();
    let q = ring.placed(DVec3::ZERO, DQuat::IDENTITY);
    let v = ring.moving(&q, DVec3::new(0.5, 0.5, 0.0), DVec3::X, DVec3::Z * 3.0);
    let mut world = weightless();
    let id = world.add_figure(FigureDesc { dof: Arc::new(ring), q, v, colliders: Vec::new() }).unwrap();
    let ends = [0, 3].map(|part| Anchor::part(id, part, DVec3::ZERO));
    world.add_rod(RodDesc::new(ends[0], ends[1], 1.0)).unwrap();
    for tick in 0..60 {
        world.step();
        let place = |part| DVec3::from(world.frame(id, PartPoint { part, point: DVec3::ZERO }).unwrap().position);
        let gap = (place(0).distance(place(3)) - 1.0).abs();
        assert!(gap < 1e-3, "tick {tick}: {gap}");
        let momentum = world.momentum().linear;
        assert!((momentum - 4.0 * DVec3::X).length() < 1e-2, "tick {tick}: {momentum}");
    }
}

#[test]
fn one_part_is_no_loop() {
    let mut world = weightless();
    let swing = swing(&mut world, 0.0);
    let [a, b] = [DVec3::ZERO, DVec3::X].map(|point| Anchor::part(swing, 1, point));
    let spring = SpringDesc { a, b, rest_length: 1.0, stiffness: 1.0, damping: 0.0 };
    let error = world.add_spring(spring).unwrap_err().to_string();
    assert!(error.contains("both ends are at the same part of a figure"), "{error}");
    let far = Anchor::part(swing, 7, DVec3::ZERO);
    let error = world.add_spring(SpringDesc { a: far, ..spring }).unwrap_err().to_string();
    assert!(error.contains("part of an anchor is 7"), "{error}");
}
