//! Bytes with their meaning, in `golden/stream.txt`: what a decoder in any language must make of them.
//!
//! ```text
//! tick hex-bytes id@tick:largest/s,s,s;largest/s,s,s id@tick:...
//! ```

use std::fmt::Write;

use super::*;

const GOLDEN: &str = include_str!("../../golden/stream.txt");

fn meaning(frame: &Frame) -> String {
    let mut text = String::new();
    for (body, tick) in frame.bodies() {
        let groups: Vec<_> = frame.groups(body).iter().map(|group| group.value).collect();
        let groups = groups.iter().map(|value| {
            let steps = value.steps.map(|s| s.to_string()).join(",");
            format!("{}/{steps}", value.largest)
        });
        let _ = write!(text, " {}@{tick}:{}", body.id, groups.collect::<Vec<_>>().join(";"));
    }
    text
}

fn bytes_of(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2).map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).unwrap()).collect()
}

#[test]
fn golden_vectors_decode_to_what_they_mean() {
    let mut decoder = Decoder::default();
    let mut count = 0;
    for line in GOLDEN.lines().filter(|line| !line.starts_with('#')) {
        let mut fields = line.splitn(3, ' ');
        let mut next = || fields.next().unwrap();
        let (tick, bytes, expected) = (next().parse().unwrap(), bytes_of(next()), next());
        let frame = decoder.decode(tick, &bytes).unwrap_or_else(|error| panic!("tick {tick}: {error}"));
        assert_eq!(meaning(&frame).trim(), expected, "tick {tick}");
        count += 1;
    }
    assert!(count > 20);
}

/// Writes the vectors anew after a change of the protocol: `cargo test -p pita-protocol write_golden -- --ignored`.
#[test]
#[ignore = "writes into the repository"]
fn write_golden_vectors() {
    let mut out = String::from("# tick, bytes of dof, and the frame after it: id@tick:largest/steps;largest/steps\n");
    let mut encoder = Encoder::default();
    let mut decoder = Decoder::default();
    let precision = Precision { point: 500, rotation: 1000, scalar: 1000, rate: 100 };
    for tick in 1..=30u64 {
        let mut state = State::new(precision).unwrap();
        let t = tick as f64;
        let spin = (0.03 * t).sin();
        let chassis = [0.3 * t, (0.05 * t * (30.0 - t)).max(0.5), -2.0, 0.0, spin, 0.0, (1.0 - spin * spin).sqrt()];
        let wheel = [1.2, -0.4, 0.7, 0.0, 0.0, (0.7 * t).sin(), (0.7 * t).cos()];
        state.push(3, kind::RIGID_BODY, None, &[Group::Point, Group::Rotation], &chassis).unwrap();
        state.push(5, kind::RIGID_BODY, Some(3), &[Group::Point, Group::Hinge], &wheel).unwrap();
        if !(10..20).contains(&tick) {
            let joints = [Group::Point, Group::Rotation, Group::Scalar, Group::Scalar];
            let figure = [0.0, 1.0, 0.01 * t * t, 0.6, 0.0, 0.0, 0.8, 0.1 * t, -0.2];
            state.push(9, kind::ARTICULATED, None, &joints, &figure).unwrap();
        }
        let rates = [Group::Point, Group::Rate];
        state.push(12, kind::PARTICLE, None, &rates, &[7.0, 7.0, -0.1 * t, 0.0, 0.0, -3.0]).unwrap();
        let chosen: Vec<_> = state.bodies().iter().map(|body| tick % 4 > 0 || body.id != 12).collect();
        let bytes = encoder.encode(tick, &state, &chosen);
        let frame = decoder.decode(tick, &bytes).unwrap();
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(out, "{tick} {hex}{}", meaning(&frame)).unwrap();
        if tick > 3 && tick % 7 > 0 {
            encoder.acknowledge(tick - 2, 0b101);
        }
    }
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/golden/stream.txt"), out).unwrap();
}
