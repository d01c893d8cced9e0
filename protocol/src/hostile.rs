//! Messages from senders who mean harm: noise, and genuine ones that were spoilt. Decoding answers errors, whatever comes.

use proptest::prelude::*;

use crate::admin::{AdminReply, AdminRequest};
use crate::message::*;
use crate::{Message, PROTOCOL_VERSION, decode, encode};

/// Decodes `bytes` as each type of message; answers how many took them.
fn decode_as_all(bytes: &[u8]) -> usize {
    fn is<T: Message>(bytes: &[u8]) -> usize {
        usize::from(decode::<T>(bytes).is_ok())
    }
    let joining =
        is::<JoinRequest>(bytes) + is::<JoinReply>(bytes) + is::<Description>(bytes) + is::<ArenaSource>(bytes);
    let flowing =
        is::<InputPacket>(bytes) + is::<Snapshot>(bytes) + is::<CellSnapshot>(bytes) + is::<EventMessage>(bytes);
    let asked = is::<Status>(bytes) + is::<TicksRequest>(bytes) + is::<TickRecords>(bytes);
    let cells = is::<KeyframesRequest>(bytes) + is::<Keyframes>(bytes);
    let said = is::<SayRequest>(bytes) + is::<SayReply>(bytes) + is::<AdminRequest>(bytes) + is::<AdminReply>(bytes);
    joining + flowing + asked + cells + said
}

/// One of each that flows all the time, with something in every list.
fn genuine() -> Vec<Vec<u8>> {
    let cell = CellId { x: -3, z: 7 };
    let controls = Controls { throttle: 0.5, brake: 0.0, steer: -0.5, buttons: 3 };
    let frames = (1..=3).map(|sequence| InputFrame { sequence, tick: 7, controls }).collect();
    let keyframes = vec![Keyframe { tick: 3, dof: vec![9; 20] }, Keyframe { tick: 5, dof: vec![8; 20] }];
    let (ack, dof) = (InputAck::default(), vec![7; 40]);
    let (cells, event_sequence) = (Some(vec![CellGrant { cell, layers: 3 }]), 300);
    let departures = vec![Departure { to: CellId::EVERYWHERE, bodies: vec![1, 500, 70_000] }];
    vec![
        encode(&InputPacket { epoch: 1, snapshot_tick: 6, snapshots_before: 5, leave: false, frames }),
        encode(&Snapshot { epoch: 9, tick: 1, ack, event_sequence, cells, dof: dof.clone() }),
        encode(&CellSnapshot { cell, tick: 9, keyframe_age: 3, departures, dof }),
        encode(&KeyframesRequest { cells: vec![KeyframesWanted { cell, have: 1 << 40 }] }),
        encode(&Keyframes { cells: vec![CellKeyframes { cell, keyframes }] }),
    ]
}

#[test]
fn each_is_decoded_as_what_it_is_and_as_nothing_else() {
    assert!(genuine().iter().all(|bytes| decode_as_all(bytes) == 1));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    /// With each noise thirty messages: as it is, as the body of every kind, and written over genuine ones.
    #[test]
    fn nothing_panics(noise in prop::collection::vec(any::<u8>(), 1..300), at in any::<prop::sample::Index>(), cut in any::<bool>()) {
        decode_as_all(&noise);
        let mut framed = [&[PROTOCOL_VERSION as u8, 0][..], &noise].concat();
        for kind in 1..=24 {
            framed[1] = kind;
            prop_assert!(decode_as_all(&framed) <= 1);
        }
        for mut bytes in genuine() {
            let from = at.index(bytes.len());
            match cut {
                true => bytes.truncate(from),
                false => bytes.iter_mut().skip(from).zip(noise.iter().take(3)).for_each(|(byte, noise)| *byte ^= noise),
            }
            prop_assert!(decode_as_all(&bytes) <= 1);
        }
    }
}
