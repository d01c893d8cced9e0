//! Messages with their bytes, in `golden/messages.txt`: what `PROTOCOL.md` says of them, field by field.
//!
//! ```text
//! name hex-bytes
//! ```

use crate::admin::{AdminAction, AdminReply, AdminRequest};
use crate::dof::Precision;
use crate::message::*;
use crate::seal::{SessionKey, prove, seal};
use crate::{decode, encode};

const GOLDEN: &str = include_str!("../golden/messages.txt");
const HERE: CellId = CellId { x: -1, z: 300 };

fn parts() -> Vec<PartDescription> {
    let part = |slice, mount, shape| PartDescription { slice, mount, rotation: [0.0, 0.0, 0.0, 1.0], shape };
    let axis = [0.0, 1.0, 0.0];
    let joint =
        |motion| ChainJoint { motion, start: 7, in_parent: axis, in_part: [0.5; 3], rest: [0.0, 0.0, 0.0, 1.0] };
    let motions = [
        JointMotion::Fixed,
        JointMotion::Hinge { axis },
        JointMotion::Universal { axes: [axis, [1.0, 0.0, 0.0]] },
        JointMotion::Ball,
        JointMotion::Slider { axis },
        JointMotion::Free,
    ];
    let points = vec![[0.0; 3], axis, [1.0; 3]];
    let node = MountNode { point: 2, weight: 0.25, gradient: axis };
    let line = Mount::Line { points: [0, 300], share: 0.5, direction: axis, offset: [0.0; 3] };
    let vertex = Vertex { nodes: vec![(1, 0.5), (2, 0.5)], position: [0.0; 3] };
    vec![
        part(1, Mount::Body { offset: axis }, Shape::HalfSpace { normal: axis }),
        part(2, Mount::Chain { joints: motions.map(joint).into(), offset: axis }, Shape::Ball { radius: 0.5 }),
        part(
            3,
            Mount::Points { nodes: vec![node], position: axis, deformation: [axis; 3] },
            Shape::Box { half: [1.0, 2.0, 3.0] },
        ),
        part(4, line, Shape::Capsule { half_length: 1.0, radius: 0.5 }),
        part(5, Mount::Skin { vertices: vec![vertex; 3] }, Shape::Hull { points: points.clone(), radius: 0.125 }),
        part(6, Mount::Own, Shape::Cylinder { half_length: 1.0, radius: 0.5, rounding: 0.125 }),
        part(7, Mount::Own, Shape::Mesh { points, triangles: vec![[0, 1, 2]] }),
    ]
}

fn actor() -> ActorDescription {
    ActorDescription { id: 70_000, kind: "vehicle".into(), name: "Wu".into(), slot: Some(3), parts: parts() }
}

fn description() -> Description {
    let shape = Shape::HalfSpace { normal: [0.0, 1.0, 0.0] };
    Description {
        arena: "golden".into(),
        title: "Golden".into(),
        tick: 5_000_000_000,
        event_sequence: 251,
        gravity: [0.0, -9.75, 0.0],
        precision: Precision::default(),
        scores: vec![(70_000, 4)],
        statics: vec![StaticDescription { shape, position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] }],
        actors: vec![actor()],
    }
}

fn events() -> Vec<Event> {
    let effect =
        Effect { kind: "dust".into(), actor: 7, position: [1.0, 2.0, 3.0], direction: [0.0, 0.5, 0.0], strength: 0.75 };
    vec![
        Event::ActorAdded(ActorDescription { slot: None, parts: Vec::new(), ..actor() }),
        Event::ActorRemoved { id: 7 },
        Event::Joined { slot: 3, name: "Wu".into() },
        Event::Left { slot: 3, reason: "left".into() },
        Event::Said { slot: 3, text: "hello".into() },
        Event::Effect(effect),
        Event::KnockedOut { actor: 7, by: Some(9) },
        Event::Scored { actor: 7, points: 2 },
        Event::RoundEnded { number: 1, winner: None },
        Event::RoundBegan { number: 2 },
        Event::Closing { reason: "the server ends".into() },
    ]
}

fn refusals() -> Vec<Refusal> {
    vec![
        Refusal::Version { server: 7, client: 6 },
        Refusal::Malformed("why".into()),
        Refusal::Full { slots: 300 },
        Refusal::NameTaken { name: "Wu".into() },
        Refusal::Banned { name: "Wu".into() },
        Refusal::Over,
        Refusal::Closing,
        Refusal::Ended { reason: "left".into() },
    ]
}

fn flowing(key: &SessionKey) -> Vec<(&'static str, Vec<u8>)> {
    let controls = Controls { throttle: 0.5, brake: 0.0, steer: -1.0, buttons: 9 };
    let frames = vec![InputFrame { sequence: 1, tick: 300, controls }];
    let packet = InputPacket { epoch: 77, snapshot_tick: 299, snapshots_before: 5, leave: false, frames };
    let mut ack = InputAck { sequence: 1, tick: 300, received: 2, slack_ms: -3, ..InputAck::default() };
    ack.fates.set(0, InputFate::Applied { late_ticks: 2 });
    let cells = Some(vec![CellGrant { cell: HERE, layers: 4 }, CellGrant { cell: CellId::WHOLE, layers: 2 }]);
    let cells = cells.map(|mut cells| {
        cells.sort_by_key(|grant| grant.cell);
        cells
    });
    let departures = vec![Departure { to: CellId::EVERYWHERE, bodies: vec![1, 70_000] }];
    let keyframes = vec![Keyframe { tick: 9, dof: vec![1, 2] }];
    vec![
        ("InputPacket", encode(&packet)),
        ("sealed_InputPacket", seal(&packet, key, "pita/golden/input/3")),
        ("Snapshot", encode(&Snapshot { epoch: 77, tick: 300, ack, event_sequence: 4, cells, dof: vec![9, 8, 7] })),
        ("CellSnapshot", encode(&CellSnapshot { cell: HERE, tick: 300, keyframe_age: 5, departures, dof: vec![1] })),
        ("KeyframesRequest", encode(&KeyframesRequest { cells: vec![KeyframesWanted { cell: HERE, have: 9 }] })),
        ("Keyframes", encode(&Keyframes { cells: vec![CellKeyframes { cell: HERE, keyframes }] })),
    ]
}

fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let key = SessionKey(std::array::from_fn(|i| i as u8));
    let resume = Some(ResumeProof { slot: 3, epoch: 77, proof: prove(3, 77, &key) });
    let join =
        JoinRequest { name: "Wu".into(), role: Role::Spectator, bytes_per_s: Some(8000), cells_along: true, resume };
    let accepted = JoinAccepted {
        slot: 3,
        epoch: 77,
        session_key: key.clone(),
        tick_hz: 30,
        input_timeout_ms: 5000,
        actor: Some(70_000),
        description: description(),
    };
    let files = vec![SourceFile { name: "hill.obj".into(), content: vec![1, 2, 3] }];
    let mut all = vec![
        ("JoinRequest", encode(&join)),
        ("JoinReply", encode(&JoinReply::Accepted(Box::new(accepted)))),
        ("Description", encode(&description())),
        ("ArenaSource", encode(&ArenaSource { toml: "name = \"golden\"".into(), files })),
        ("SayRequest", encode(&SayRequest { epoch: 77, sequence: 1, text: "hello".into() })),
        ("SayReply", encode(&SayReply::Said)),
        ("SayReply", encode(&SayReply::Refused(SayRefusal::TooOften { wait_ms: 1500 }))),
        ("TicksRequest", encode(&TicksRequest { since: 300 })),
        ("TickRecords", encode(&TickRecords { records: vec![TickRecord { tick: 300, ..TickRecord::default() }] })),
        ("Status", encode(&Status { arena: "golden".into(), uptime_s: 0.5, ..Status::default() })),
        ("AdminRequest", encode(&AdminRequest::Challenge)),
        ("AdminRequest", encode(&AdminRequest::Do { challenge: [7; 16], action: AdminAction::Reload })),
        ("AdminReply", encode(&AdminReply::answered(true, ["done".to_owned()]))),
    ];
    all.extend(refusals().into_iter().map(|refusal| ("JoinReply", encode(&JoinReply::Refused(refusal)))));
    let event = |(sequence, event)| ("EventMessage", encode(&EventMessage { sequence, tick: 300, event }));
    all.extend((1..).zip(events()).map(event));
    all.extend(flowing(&key));
    all
}

fn text() -> String {
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    samples().iter().map(|(name, bytes)| format!("{name} {}\n", hex(bytes))).collect()
}

#[test]
fn messages_have_the_bytes_that_were_written_down() {
    for (ours, golden) in text().lines().zip(GOLDEN.lines()) {
        assert_eq!(ours, golden);
    }
    assert_eq!(text().lines().count(), GOLDEN.lines().count());
    let joined = samples().into_iter().find(|(name, _)| *name == "JoinReply").expect("one of them");
    assert!(decode::<JoinReply>(&joined.1).is_ok());
}

/// Writes the vectors anew after a change of the protocol: `cargo test -p pita-protocol write_golden -- --ignored`.
#[test]
#[ignore = "writes into the repository"]
fn write_golden_messages() {
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/golden/messages.txt"), text()).unwrap();
}
