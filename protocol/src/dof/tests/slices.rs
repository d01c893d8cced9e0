//! What becomes of frames that no server of ours has: numbers, all of them finite, and few to look at.

use super::super::predict::{Ahead, Line, Turn};
use super::super::slice::CARRIER_GROUPS_MAX;
use super::*;

const PRECISION: Precision = Precision { point: 1, rotation: 64, scalar: 1, rate: 1 };

/// A group that went from one value to another within a tick.
fn group(group: Group, largest: u8, [before, now]: [[i32; 3]; 2]) -> Option<GroupState> {
    let fineness = PRECISION.fineness();
    let value = |steps| {
        let largest = if group == Group::Rotation { largest } else { 0 };
        Some(Quantised { group, largest, steps }).filter(|value| value.check(&fineness).is_ok())
    };
    let (before, now) = (value(before)?, value(now)?);
    let mut state = GroupState::first(before);
    match group {
        Group::Rotation => state.follow(&Turn::of(&state, Ahead::of(1), &fineness), now),
        _ => state.follow(&Line::of(&state, Ahead::of(1), &fineness), now),
    }
    Some(state)
}

/// A frame of bodies with these parents and groups.
fn frame(bodies: Vec<(Option<u32>, Vec<GroupState>)>) -> Frame {
    let mut frame = Frame::empty(PRECISION);
    for (id, (parent, groups)) in (0..).zip(bodies) {
        let start = frame.groups.len() as u32;
        frame.bodies.push(Body { id, kind: kind::RIGID_BODY, parent, start, groups: groups.len() as u16 });
        frame.ticks.push(0);
        frame.groups.extend(groups);
    }
    frame
}

fn steps() -> impl Strategy<Value = [i32; 3]> {
    prop_oneof![
        prop::array::uniform3(-32i32..32),
        prop::array::uniform3(-STEPS_MAX..=STEPS_MAX),
        (-STEPS_MAX..=STEPS_MAX, -STEPS_MAX..=STEPS_MAX, -32i32..32).prop_map(|(x, y, z)| [x, y, z]),
    ]
}

fn any_group() -> impl Strategy<Value = GroupState> {
    let parts = (prop::sample::select(&Group::ALL[..]), 0u8..4, [steps(), steps()]);
    parts.prop_filter_map("steps that the group has", |(of, largest, steps)| group(of, largest, steps))
}

fn any_body() -> impl Strategy<Value = (Option<u32>, Vec<GroupState>)> {
    (prop::option::of(0u32..8), prop::collection::vec(any_group(), 1..5))
}

proptest! {
    #[test]
    fn whatever_is_decoded_is_finite(bodies in prop::collection::vec(any_body(), 1..8)) {
        // A parent has a lower id: the stream cannot say otherwise.
        let below = |(id, (parent, groups)): (u32, (Option<u32>, _))| (parent.filter(|parent| *parent < id), groups);
        for slice in frame((0..).zip(bodies).map(below).collect()).slices(1000.0) {
            prop_assert!(slice.q.iter().chain(&slice.v).all(|x| x.is_finite()), "{slice:?}");
        }
    }
}

/// What is looked at for each body that hangs on it has few numbers: bodies on a body with four thousand points, that on
/// another such one, and so on, would be looked at for a long time. Where such bodies are is not known.
#[test]
fn what_carries_others_is_small() {
    let point = group(Group::Point, 0, [[0; 3]; 2]).unwrap();
    let turn = group(Group::Rotation, 3, [[0; 3]; 2]).unwrap();
    let placed = |more: usize| [vec![point, turn], vec![point; more]].concat();
    let shown = |more: usize| {
        let chain = (0..7u32).map(|id| (id.checked_sub(1), placed(more)));
        let carried = (0..1000).map(|_| (Some(6), placed(0)));
        frame(chain.chain(carried).collect()).slices(30.0).len()
    };
    assert_eq!(shown(CARRIER_GROUPS_MAX - 2), 1007);
    assert_eq!(shown(CARRIER_GROUPS_MAX - 1), 1, "only what hangs on nothing");
}
