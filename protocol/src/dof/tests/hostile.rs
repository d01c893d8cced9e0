//! Against senders who mean harm: errors, bounded memory, and what comes after is decoded as if nothing had been.

use super::super::ans::{self, Coder};
use super::super::residual::Models;
use super::*;

/// Messages to each decoder.
const MESSAGES: u32 = 200_000;

/// A decoder with a past, a snapshot that it can decode next, and its tick.
fn midstream(seed: u64) -> (Decoder, Vec<u8>, u64) {
    let mut toys = Toys::new(seed, 25);
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    for tick in 1..20 {
        toys.step();
        let snapshot = encoder.encode(tick, &toys.state(), &[]);
        decoder.decode(tick, &snapshot).unwrap();
        encoder.acknowledge(tick, u32::MAX);
    }
    toys.step();
    toys.add();
    (decoder, encoder.encode(20, &toys.state(), &[]), 20)
}

#[test]
fn flipped_bits_are_noticed_and_change_nothing() {
    let (mut decoder, snapshot, tick) = midstream(3);
    let before = decoder.newest().cloned();
    let mut passed = 0;
    for bit in 0..snapshot.len() * 8 {
        let mut flipped = snapshot.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        passed += u32::from(decoder.decode(tick, &flipped).is_ok());
    }
    // The check has 16 bits; bits at the very end may mean nothing.
    assert!(passed < 8, "{passed} of {}", snapshot.len() * 8);
    if passed == 0 {
        assert_eq!(decoder.newest().cloned(), before);
    }
    assert!(decoder.decode(tick, &snapshot).is_ok());
}

#[test]
fn what_is_cut_short_is_an_error() {
    let (mut decoder, snapshot, tick) = midstream(4);
    for length in 0..snapshot.len().saturating_sub(2) {
        assert!(decoder.decode(tick, &snapshot[..length]).is_err(), "length {length}");
    }
}

/// What is made of `genuine` in the next round: noise, or a copy that was overwritten here and there, had bits flipped, was
/// cut short, or goes on.
fn spoilt(dice: &mut Dice, genuine: &[u8], into: &mut Vec<u8>) {
    into.clear();
    let noise = |dice: &mut Dice, n: u64| (0..dice.roll(n)).map(|_| dice.roll(256) as u8).collect::<Vec<_>>();
    let kind = dice.roll(5);
    if kind == 0 {
        into.extend(noise(dice, 120));
        if let Some(flags) = into.first_mut() {
            *flags &= 5;
        }
        return;
    }
    into.extend_from_slice(genuine);
    match kind {
        1 => into.truncate(dice.roll(genuine.len() as u64) as usize),
        2 => into.extend(noise(dice, 40)),
        _ => {
            for _ in 0..1 + dice.roll(5) {
                let at = dice.roll(genuine.len() as u64) as usize;
                into[at] = if kind == 3 { dice.roll(256) as u8 } else { into[at] ^ 1 << dice.roll(8) };
            }
        }
    }
}

#[test]
fn a_stream_takes_no_harm() {
    let (mut decoder, snapshot, tick) = midstream(4);
    let (mut dice, mut bytes, mut passed) = (Dice(1234), Vec::new(), 0);
    for round in 0..MESSAGES {
        spoilt(&mut dice, &snapshot, &mut bytes);
        let of = if round % 3 == 0 { dice.roll(u64::MAX) } else { tick };
        passed += u32::from(bytes != snapshot && decoder.decode(of, &bytes).is_ok());
        assert!(decoder.remembered() <= HISTORY);
    }
    // Sixteen bits of check let one in 65536 pass.
    assert!(passed < 40, "{passed} of {MESSAGES}");
}

#[test]
fn a_cell_takes_no_harm() {
    let mut toys = Toys::new(5, 25);
    let (mut encoder, mut decoder) = (CellEncoder::new(Cadence::default()), CellDecoder::default());
    let mut published = Vec::new();
    let mut last = toys.state();
    for tick in 1..60 {
        toys.step();
        last = toys.state();
        if let Some(due) = encoder.due(tick, &last) {
            published.push((tick, encoder.encode(tick, &last, due, &[])));
        }
    }
    // Readers have what came before the last ticks. To one of them what is spoilt is said to be keyframes, which it would
    // keep; the other is to decode the rest after the flood.
    let (before, after) = published.split_at(published.len() - 12);
    let mut victim = CellDecoder::default();
    for (tick, coded) in before {
        let is_keyframe = coded.keyframe_age == 0;
        decoder.decode(*tick, &coded.dof, is_keyframe).unwrap();
        victim.decode(*tick, &coded.dof, is_keyframe).unwrap();
    }
    let (mut dice, mut bytes, mut passed) = (Dice(4321), Vec::new(), 0);
    for round in 0..MESSAGES as usize {
        let (tick, genuine) = &published[round % published.len()];
        spoilt(&mut dice, &genuine.dof, &mut bytes);
        let of = if round % 3 == 0 { dice.roll(u64::MAX) } else { *tick };
        let is_keyframe = dice.roll(2) == 0;
        let reader = if is_keyframe { &mut victim } else { &mut decoder };
        passed += u32::from(bytes != genuine.dof && reader.decode(of, &bytes, is_keyframe).is_ok());
        assert!(reader.frames() <= 8);
    }
    assert!(passed < 40, "{passed} of {MESSAGES}");
    let mut frame = None;
    for (tick, coded) in after {
        frame = Some(decoder.decode(*tick, &coded.dof, coded.keyframe_age == 0).unwrap());
    }
    assert_eq!(known(&frame.unwrap()), told(&last));
}

/// A body of 4096 groups, and 16383 more of which a fraction of a bit says that they are alike: 64 MB in some hundred bytes,
/// which are refused before they are claimed.
#[test]
fn few_bytes_cannot_claim_much_memory() {
    let mut bytes = vec![0, 0, 0];
    for steps in [1000u32, 1500, 1000, 200] {
        bytes.extend(steps.to_le_bytes());
    }
    let (mut choices, mut models) = (Vec::new(), Models::new());
    let mut coder = ans::Encoder::new(&mut choices);
    models.flag(&mut coder, 0, true);
    models.number(&mut coder, 0, 0);
    models.number(&mut coder, 1, BODIES_MAX as u32);
    for body in 0..BODIES_MAX {
        models.number(&mut coder, 2, 0);
        models.flag(&mut coder, 1, false);
        models.flag(&mut coder, 2, body > 0);
        if body == 0 {
            coder.raw(kind::LATTICE.into(), 8);
            coder.raw(BODY_GROUPS_MAX as u32, 16);
            (0..BODY_GROUPS_MAX).for_each(|_| _ = coder.raw(Group::Point as u32, 3));
        }
    }
    coder.finish(&mut bytes);
    assert!(bytes.len() < 2000, "{} bytes", bytes.len());
    let refused = Decoder::default().decode(1, &bytes);
    assert!(matches!(refused, Err(WireError::Content { field: "groups of new bodies", .. })), "{refused:?}");
}
