//! Free-form deformations against closed forms, key-frames, and a lattice that follows one by its own dynamics.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::DVec2;

use pita_game::free_form::{Axis, FreeForm, KeyFrames, Warp, deform, deform_shape};
use pita_sim::mass::{Density, Polyhedron};
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{DQuat, DVec3, FigureDesc, Lattice, LatticeDesc, RestShape, Settings, Shape, World};

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).length() < 1e-9
}

fn up() -> Axis {
    Axis::up_from(DVec3::ZERO)
}

/// Volume of a shape of unit density, m³.
fn volume(shape: &Shape) -> f64 {
    shape.mass_properties(Density::constant(1.0)).unwrap().mass
}

#[test]
fn a_twist_turns_a_section_by_its_height() {
    let twist = FreeForm::twist(up(), 0.5);
    for height in [0.0, 0.7, 2.0, -3.0] {
        let turned = twist.apply(DVec3::new(1.0, height, 0.0));
        assert!((turned.y - height).abs() < 1e-12 && (turned.with_y(0.0).length() - 1.0).abs() < 1e-12);
        let angle = f64::atan2(-turned.z, turned.x);
        assert!((angle - 0.5 * height).abs() < 1e-12, "{height} m: {angle}");
    }
}

#[test]
fn a_scale_multiplies_volume_and_a_stretch_keeps_it() {
    let body = Shape::Box { half: DVec3::new(0.3, 1.0, 0.4) };
    let axis = Axis { base: DVec3::new(2.0, -1.0, 0.5), rotation: DQuat::from_rotation_z(0.4) };
    let scaled = deform_shape(&[FreeForm::scale(axis, DVec3::new(2.0, 0.5, 3.0))], &body).unwrap();
    assert!((volume(&scaled) / volume(&body) - 3.0).abs() < 1e-9);
    for factor in [0.2, 1.0, 4.0] {
        let stretched = deform_shape(&[FreeForm::stretch(axis, factor)], &body).unwrap();
        assert!((volume(&stretched) / volume(&body) - 1.0).abs() < 1e-9, "{factor}");
    }
    assert_eq!(deform_shape(&[], &Shape::Ball { radius: 1.0 }), None);
}

/// The axis becomes a circle of radius 1 / curvature and keeps its length; sections stay at right angles to it.
#[test]
fn a_bend_is_an_arc() {
    let (curvature, radius) = (0.25, 4.0);
    let bend = FreeForm::bend(up(), curvature);
    let centre = DVec3::X * radius;
    let mut length = 0.0;
    for i in 0..100 {
        let [a, b] = [0, 1].map(|next| bend.apply(DVec3::Y * (0.05 * f64::from(i + next))));
        assert!((a.distance(centre) - radius).abs() < 1e-9);
        length += a.distance(b);
    }
    assert!((length - 5.0).abs() < 1e-3, "{length}");
    let (inner, outer) = (bend.apply(DVec3::new(1.0, 3.0, 0.0)), bend.apply(DVec3::new(-1.0, 3.0, 0.0)));
    assert!((inner.distance(centre) - 3.0).abs() < 1e-9 && (outer.distance(centre) - 5.0).abs() < 1e-9);
    // A quarter of the circle: up has become towards x.
    assert!(near(bend.apply(DVec3::Y * (FRAC_PI_2 * radius)), DVec3::new(radius, radius, 0.0)));
}

#[test]
fn deformations_follow_one_another() {
    let shift = Axis::up_from(DVec3::new(0.0, 1.0, 0.0));
    let chain = [FreeForm::scale(up(), DVec3::splat(2.0)), FreeForm::twist(shift, PI / 6.0)];
    let mut points = vec![DVec3::new(0.5, 2.0, 0.0), DVec3::ZERO];
    deform(&chain, &mut points);
    // Twice as high is 3 m above the second axis' base: a quarter turn.
    assert!(near(points[0], DVec3::new(0.0, 4.0, -1.0)), "{points:?}");
    let warp = Warp { bend: DVec2::new(0.0, 0.25), twist: 0.3, ..Warp::NONE };
    let mut bent = [DVec3::Y * (FRAC_PI_2 * 4.0)];
    deform(&warp.free_form(DVec3::ZERO), &mut bent);
    assert!(near(bent[0], DVec3::new(0.0, 4.0, 4.0)), "{bent:?}");
    assert_eq!(Warp::of_numbers(warp.numbers()), warp);
    assert!(warp.rest_shape().is_err());
}

/// Value and rate are continuous across keys, through the end of a period too, and every key is reached.
#[test]
fn key_frames_are_reached_with_continuous_rates() {
    let keys = vec![(0.0, [0.0, 1.0]), (0.5, [2.0, 1.0]), (2.0, [-1.0, 3.0]), (2.5, [0.5, 0.0])];
    for period in [None, Some(4.0)] {
        let frames = KeyFrames::new(keys.clone(), period).unwrap();
        let (step, mut times) = (1e-6, vec![0.0, 0.5, 2.0, 2.5]);
        keys.iter().for_each(|(time, numbers)| assert_eq!(frames.at(*time), *numbers));
        times.extend(period);
        for time in times {
            let [before, at, after] = [-step, 0.0, step].map(|off| frames.at(time + off));
            for i in 0..2 {
                let (left, right) = ((at[i] - before[i]) / step, (after[i] - at[i]) / step);
                assert!((left - right).abs() < 1e-4, "{period:?}, {time} s: {left} {right}");
            }
        }
        if let Some(period) = period {
            assert!((frames.at(0.3 + 3.0 * period)[0] - frames.at(0.3)[0]).abs() < 1e-12);
        } else {
            assert_eq!((frames.at(-5.0), frames.at(9.0)), ([0.0, 1.0], [0.5, 0.0]));
        }
    }
    // A line stays a line.
    let line = KeyFrames::new((0..5).map(|i| (f64::from(i), [2.0 * f64::from(i)])).collect(), None).unwrap();
    assert!((line.at(2.3)[0] - 4.6).abs() < 1e-12);
    let refused = |keys, period| KeyFrames::<1>::new(keys, period).unwrap_err().to_string();
    assert!(refused(vec![], None).contains("key-frames is 0"));
    assert!(refused(vec![(1.0, [0.0]), (1.0, [1.0])], None).contains("rise"));
    assert!(refused(vec![(f64::NAN, [0.0])], None).contains("finite"));
    assert!(refused(vec![(0.0, [0.0]), (1.0, [0.0])], Some(0.5)).contains("period"));
}

/// The dynamic kind: the lattice is DOF, its rest shape follows key-frames, and its top goes where the same warp puts the
/// point, with the dynamics that elasticity gives it.
#[test]
fn a_lattice_follows_key_frames_by_its_dynamics() {
    let half = DVec3::new(0.3, 1.0, 0.3);
    let corners = (0..8).map(|i| {
        let sign = |bit: i32| if i & bit == 0 { -1.0 } else { 1.0 };
        DVec3::Y + half * DVec3::new(sign(1), sign(2), sign(4))
    });
    let points: Vec<_> = corners.collect();
    let desc = LatticeDesc {
        min: DVec3::new(-0.3, 0.0, -0.3),
        max: DVec3::new(0.3, 2.0, 0.3),
        cells: [1, 4, 1],
        material: Elastic::new(1e6, 0.0).unwrap(),
        density: Density::constant(300.0),
        damping: 0.05,
    };
    let body = Lattice::new(&Polyhedron::of_hull(&points).unwrap(), desc).unwrap();
    let top = body.at(DVec3::Y * 2.0).unwrap();
    let bottom = body.at(DVec3::ZERO).unwrap();
    let mut world = World::new(Settings { gravity: DVec3::ZERO, sleep: None, ..Settings::at(1.0 / 30.0) }).unwrap();
    let (q, v) = (body.placed(DVec3::ZERO, DQuat::IDENTITY), body.still());
    let id = world.add_figure(FigureDesc { dof: Arc::new(body), q, v, colliders: Vec::new() }).unwrap();
    let stretched = Warp { scale: DVec3::new(0.8, 1.5, 0.8), ..Warp::NONE };
    let frames = KeyFrames::new(vec![(0.0, Warp::NONE.numbers()), (2.0, stretched.numbers())], None).unwrap();
    let length = |world: &World| {
        let place = |at| DVec3::from(world.frame(id, at).unwrap().position);
        place(top).distance(place(bottom))
    };
    for tick in 0..150 {
        let warp = Warp::of_numbers(frames.at(f64::from(tick) / 30.0));
        let rest: RestShape = warp.rest_shape().unwrap();
        world.set_controls(id, &rest.numbers()).unwrap();
        world.step();
        let wanted = 2.0 * warp.scale.y;
        assert!((length(&world) - wanted).abs() < 0.15, "tick {tick}: {} of {wanted}", length(&world));
    }
    assert!((length(&world) - 3.0).abs() < 0.02, "{}", length(&world));
}
