use super::*;
use pita_protocol::message::InputFrame;
use std::sync::atomic::{AtomicU32, Ordering};

const LIMITS: Limits = Limits { players: 2, spectators: 1, input_timeout_ms: 5000, input_packets_per_tick: 4 };

fn join(sessions: &mut Sessions, role: Role, now_ms: u64) -> Result<SessionId, JoinRefusal> {
    static EPOCHS: AtomicU32 = AtomicU32::new(1);
    let secrets = Secrets { epoch: EPOCHS.fetch_add(1, Ordering::Relaxed), key: SessionKey([1; 32]) };
    sessions.join("Wu", role, secrets, now_ms)
}

fn packet(epoch: u32, sequences: &[u32]) -> InputPacket {
    let frames =
        sequences.iter().map(|&sequence| InputFrame { sequence, tick: 0, controls: Controls::default() }).collect();
    InputPacket { epoch, snapshot_tick: 0, leave: false, frames }
}

fn taken(sessions: &mut Sessions) -> Vec<Change> {
    let mut changes = Vec::new();
    sessions.take_changes(&mut changes);
    changes
}

fn ended(id: SessionId, reason: EndReason) -> Change {
    Change::Ended { id, role: Role::Player, reason }
}

#[test]
fn slots_are_given_in_order_and_again_only_after_the_end_was_taken() {
    let mut sessions = Sessions::new(LIMITS);
    let first = join(&mut sessions, Role::Player, 0).unwrap();
    let second = join(&mut sessions, Role::Player, 0).unwrap();
    assert_eq!((first.slot, second.slot), (0, 1));
    assert_eq!(join(&mut sessions, Role::Player, 0), Err(JoinRefusal::Full), "the arena holds two players");
    let spectator = join(&mut sessions, Role::Spectator, 0).unwrap();
    assert_eq!(join(&mut sessions, Role::Spectator, 0), Err(JoinRefusal::Full), "there is one place to watch from");
    assert_eq!((sessions.count(), taken(&mut sessions).len()), (3, 3));

    sessions.token_disappeared(spectator);
    assert_eq!(join(&mut sessions, Role::Spectator, 0), Err(JoinRefusal::Full));
    assert_eq!(taken(&mut sessions).len(), 1);
    let again = join(&mut sessions, Role::Spectator, 0).unwrap();
    assert_eq!(again.slot, spectator.slot);
    assert_ne!(again.epoch, spectator.epoch);
}

#[test]
fn an_old_epoch_neither_drives_nor_ends_the_slots_new_session() {
    let mut sessions = Sessions::new(LIMITS);
    let old = join(&mut sessions, Role::Player, 0).unwrap();
    sessions.token_disappeared(old);
    taken(&mut sessions);
    let new = join(&mut sessions, Role::Player, 0).unwrap();
    assert_eq!(new.slot, old.slot);
    assert_eq!(sessions.receive(0, &packet(old.epoch, &[9]), 1, 1), Err(InputRefusal::NoSession));
    sessions.token_disappeared(old);
    assert_eq!(sessions.count(), 1);
    for slot in [1, 2, 3, u16::MAX] {
        assert_eq!(sessions.receive(slot, &packet(new.epoch, &[9]), 1, 1), Err(InputRefusal::NoSession));
        assert!(sessions.key(slot).is_none());
    }
}

#[test]
fn the_newest_sequence_wins_and_nothing_is_applied_twice() {
    let mut sessions = Sessions::new(LIMITS);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    let mut receive = |sequences: &[u32], tick| sessions.receive(id.slot, &packet(id.epoch, sequences), tick, 1);
    assert_eq!(receive(&[1, 2, 3], 1), Ok(Received::Input { sequence: 3, controls: Controls::default() }));
    assert_eq!(receive(&[1, 2, 3], 1), Err(InputRefusal::Stale));
    assert_eq!(receive(&[2], 1), Err(InputRefusal::Stale));
    assert_eq!(receive(&[2, 3, 4], 1), Ok(Received::Input { sequence: 4, controls: Controls::default() }));
}

#[test]
fn a_press_of_reset_survives_the_loss_of_its_packet_and_is_not_repeated() {
    let mut sessions = Sessions::new(LIMITS);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    let mut with_reset = packet(id.epoch, &[1, 2, 3]);
    with_reset.frames[1].controls.buttons = buttons::RESET;
    let mut pressed = |packet: &InputPacket| match sessions.receive(id.slot, packet, 1, 1) {
        Ok(Received::Input { controls, .. }) => controls.buttons & buttons::RESET != 0,
        other => panic!("{other:?}"),
    };
    assert!(pressed(&with_reset));
    with_reset.frames.push(packet(id.epoch, &[4]).frames[0]);
    assert!(!pressed(&with_reset), "frame 2 was already looked at");
}

#[test]
fn a_flood_is_cut_until_the_next_tick() {
    let mut sessions = Sessions::new(LIMITS);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    let results: Vec<_> =
        (1..=6).map(|sequence| sessions.receive(id.slot, &packet(id.epoch, &[sequence]), 10, 1)).collect();
    assert!(results[..4].iter().all(Result::is_ok));
    assert_eq!(results[4..], [Err(InputRefusal::Flood); 2]);
    assert!(sessions.receive(id.slot, &packet(id.epoch, &[7]), 11, 1).is_ok());
}

#[test]
fn leaving_ends_the_session_whatever_the_sequence() {
    let mut sessions = Sessions::new(LIMITS);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    sessions.receive(id.slot, &packet(id.epoch, &[5]), 1, 1).unwrap();
    let leave = InputPacket { leave: true, ..packet(id.epoch, &[5]) };
    assert_eq!(sessions.receive(id.slot, &leave, 1, 1), Ok(Received::Left));
    assert_eq!(sessions.receive(id.slot, &leave, 1, 1), Err(InputRefusal::NoSession));
    assert_eq!(taken(&mut sessions)[1], ended(id, EndReason::Left));
}

#[test]
fn silence_ends_players_and_spectators() {
    let mut sessions = Sessions::new(LIMITS);
    let player = join(&mut sessions, Role::Player, 0).unwrap();
    let silent = join(&mut sessions, Role::Player, 0).unwrap();
    let spectator = join(&mut sessions, Role::Spectator, 0).unwrap();
    taken(&mut sessions);
    sessions.receive(player.slot, &packet(player.epoch, &[1]), 1, 4000).unwrap();
    sessions.receive(spectator.slot, &packet(spectator.epoch, &[1]), 1, 6000).unwrap();
    let reason = EndReason::Silent { timeout_ms: 5000 };
    sessions.expire(5000);
    assert_eq!(taken(&mut sessions), []);
    sessions.expire(5001);
    assert_eq!(taken(&mut sessions), [ended(silent, reason)]);
    sessions.expire(9001);
    assert_eq!(taken(&mut sessions), [ended(player, reason)]);
    sessions.expire(11_001);
    assert_eq!(taken(&mut sessions), [Change::Ended { id: spectator, role: Role::Spectator, reason }]);
    assert_eq!(reason.to_string(), "no input for 5 s");
}

#[test]
fn nobody_joins_a_closing_server() {
    let mut sessions = Sessions::new(LIMITS);
    sessions.close();
    assert_eq!(join(&mut sessions, Role::Player, 0), Err(JoinRefusal::Closing));
}
