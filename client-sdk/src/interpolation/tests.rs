//! Tests of the interpolation buffer, without any network.

use super::*;
use pita_protocol::dof::kind;
use proptest::prelude::*;

const BODY: [Group; 2] = [Group::Point, Group::Rotation];
const PERIOD_S: f64 = 1.0 / 30.0;

fn buffer(frames_max: usize) -> InterpolationBuffer {
    let settings = InterpolationSettings { frames_max, ..InterpolationSettings::default() };
    InterpolationBuffer::new(settings, PERIOD_S)
}

fn particle(tick: u64, id: u32, x: f32, v: f32) -> Slice {
    let groups = vec![Group::Point];
    Slice { id, kind: kind::PARTICLE, tick, groups, q: vec![x, 0.0, 0.0], v: vec![v, 0.0, 0.0] }
}

fn body(tick: u64, rotation: Quat, spin: Vec3) -> Slice {
    let q = [0.0, 1.0, 0.0].into_iter().chain(rotation.to_array()).collect();
    let v = [0.0; 3].into_iter().chain(spin.to_array()).collect();
    Slice { id: 1, kind: kind::RIGID_BODY, tick, groups: BODY.to_vec(), q, v }
}

fn rotation_at(buffer: &InterpolationBuffer, tick: f64) -> Quat {
    Quat::from_slice(&buffer.sample(tick).unwrap()[0].q[3..7])
}

/// A particle at `x = tick` with speed 30 m/s, at each of `ticks`.
fn steady(ticks: impl IntoIterator<Item = u64>, frames_max: usize) -> InterpolationBuffer {
    let mut buffer = buffer(frames_max);
    for tick in ticks {
        buffer.insert(Frame { tick, slices: vec![particle(tick, 1, tick as f32, 30.0)] });
    }
    buffer
}

fn x_at(buffer: &InterpolationBuffer, tick: f64) -> f32 {
    buffer.sample(tick).unwrap()[0].q[0]
}

#[test]
fn an_empty_buffer_knows_nothing() {
    assert_eq!(buffer(4).sample(1.0), None);
    assert_eq!(buffer(4).span(), None);
}

proptest! {
    /// Steady motion comes out exactly, whatever the order, repeats and gaps of the frames.
    #[test]
    fn steady_motion_is_exact(ticks in prop::collection::vec(100u64..130, 2..40), at in 0.0..1.0f64) {
        let buffer = steady(ticks.iter().copied(), 64);
        let (first, last) = buffer.span().unwrap();
        prop_assert_eq!((Some(&first), Some(&last)), (ticks.iter().min(), ticks.iter().max()));
        let tick = first as f64 + at * (last - first) as f64;
        prop_assert!((f64::from(x_at(&buffer, tick)) - tick).abs() < 1e-3);
    }

    #[test]
    fn the_newest_frames_are_kept_in_order_and_bounded(ticks in prop::collection::vec(0u64..1000, 1..60)) {
        let buffer = steady(ticks.iter().copied(), 8);
        prop_assert!(buffer.frames.len() <= 8);
        prop_assert!(buffer.frames.iter().zip(buffer.frames.iter().skip(1)).all(|(a, b)| a.tick < b.tick));
        let newest = ticks.iter().copied().max();
        prop_assert_eq!(buffer.span().map(|(_, newest)| newest), newest);
    }

    /// Finite numbers in, finite numbers out, whatever they are.
    #[test]
    fn any_finite_state_stays_finite(
        a in prop::collection::vec(prop::num::f32::NORMAL | prop::num::f32::ZERO, 13),
        b in prop::collection::vec(prop::num::f32::NORMAL | prop::num::f32::ZERO, 13),
        tick in -10.0..30.0f64,
    ) {
        let mut buffer = buffer(4);
        for (tick, n) in [(0, a), (3, b)] {
            let slice = Slice { q: n[..7].to_vec(), v: n[7..].to_vec(), ..body(tick, Quat::IDENTITY, Vec3::ZERO) };
            buffer.insert(Frame { tick, slices: vec![slice] });
        }
        let slices = buffer.sample(tick).unwrap();
        prop_assert!(slices[0].q.iter().chain(&slices[0].v).all(|x| x.is_finite()), "{:?}", slices[0]);
    }

    /// The orientation between two frames lies on the shortest arc, also where one is stored with the other sign.
    #[test]
    fn orientations_take_the_shortest_arc(angle in 0.01..3.0f32, t in 0.0..1.0f64, flip: bool) {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        let end = Quat::from_axis_angle(axis, angle);
        let mut buffer = buffer(4);
        buffer.insert(Frame { tick: 10, slices: vec![body(10, Quat::IDENTITY, Vec3::ZERO)] });
        buffer.insert(Frame { tick: 11, slices: vec![body(11, if flip { -end } else { end }, Vec3::ZERO)] });
        let expected = Quat::from_axis_angle(axis, angle * t as f32);
        prop_assert!(rotation_at(&buffer, 10.0 + t).angle_between(expected) < 2e-3);
    }
}

#[test]
fn extrapolates_along_the_rate_for_a_bounded_time() {
    let buffer = steady([10, 11], 8);
    assert!((x_at(&buffer, 14.0) - 14.0).abs() < 1e-3);
    // 250 ms are 7.5 ticks.
    assert!((x_at(&buffer, 18.5) - 18.5).abs() < 1e-3);
    assert!((x_at(&buffer, 1e9) - 18.5).abs() < 1e-3);
    assert_eq!(x_at(&buffer, 3.0), 10.0);
}

#[test]
fn extrapolates_spin_about_world_axes() {
    let start = Quat::from_rotation_x(0.4);
    let mut buffer = buffer(4);
    buffer.insert(Frame { tick: 10, slices: vec![body(10, start, Vec3::new(0.0, 3.0, 0.0))] });
    let expected = Quat::from_rotation_y(3.0 * 3.0 / 30.0) * start;
    assert!(rotation_at(&buffer, 13.0).angle_between(expected) < 1e-3);
}

#[test]
fn slices_that_come_and_go_do_so_at_a_tick() {
    let mut buffer = buffer(4);
    buffer.insert(Frame { tick: 10, slices: vec![particle(10, 1, 0.0, 0.0), particle(10, 3, 5.0, 0.0)] });
    buffer.insert(Frame { tick: 12, slices: vec![particle(12, 2, 9.0, 0.0), particle(12, 3, 7.0, 0.0)] });
    let between = buffer.sample(11.0).unwrap();
    assert_eq!(between.iter().map(|s| (s.id, s.q[0])).collect::<Vec<_>>(), [(1, 0.0), (3, 6.0)]);
    let after = buffer.sample(12.0).unwrap();
    assert_eq!(after.iter().map(|s| s.id).collect::<Vec<_>>(), [2, 3]);
}

/// Frames that did not carry a body do not hold it up: it goes from one of its own states to the next.
#[test]
fn bodies_that_come_seldom_move_all_the_same() {
    let mut buffer = buffer(8);
    for tick in 10..=18 {
        let carried = tick / 4 * 4;
        let seldom = particle(carried, 2, 2.0 * carried as f32, 60.0);
        buffer.insert(Frame { tick, slices: vec![particle(tick, 1, tick as f32, 30.0), seldom] });
    }
    for tenths in 120..=160 {
        let tick = f64::from(tenths) * 0.1;
        let shown = buffer.sample(tick).unwrap();
        assert!((f64::from(shown[0].q[0]) - tick).abs() < 1e-3 && (f64::from(shown[1].q[0]) - 2.0 * tick).abs() < 1e-3);
    }
    // Its newest state is of 16: from there it is carried on.
    assert!((buffer.sample(18.5).unwrap()[1].q[0] - 37.0).abs() < 1e-3);
}

/// Every rotation of a slice goes along its arc, wherever it stands in the slice.
#[test]
fn figures_turn_at_their_joints() {
    let figure = |tick: u64, angle: f32| {
        let groups = vec![Group::Scalar, Group::Rotation, Group::Scalar];
        let q = [angle].into_iter().chain(Quat::from_rotation_x(angle).to_array()).chain([1.0]).collect();
        Slice { id: 1, kind: kind::ARTICULATED, tick, groups, q, v: vec![0.3, 0.3, 0.0, 0.0, 0.0] }
    };
    let mut buffer = buffer(4);
    buffer.insert(Frame { tick: 10, slices: vec![figure(10, 0.0)] });
    buffer.insert(Frame { tick: 20, slices: vec![figure(20, 0.1)] });
    for (tick, angle) in [(15.0, 0.05), (20.0, 0.1), (23.0, 0.13)] {
        let shown = buffer.sample(tick).unwrap();
        let turn = Quat::from_slice(&shown[0].q[1..5]);
        assert!((shown[0].q[0] - angle).abs() < 1e-4 && turn.angle_between(Quat::from_rotation_x(angle)) < 1e-3);
    }
}
