use super::*;
use pita_protocol::message::Controls;
use std::sync::atomic::{AtomicU32, Ordering};

const LIMITS: Limits = Limits {
    players: 2,
    spectators: 1,
    input_timeout_ms: 5000,
    resume_grace_ms: 0,
    inputs_per_tick: 4,
    bytes_per_s: 64_000,
};

fn player(name: &str) -> Wish<'_> {
    Wish { name, role: Role::Player, bytes_per_s: None, cells_along: false }
}

fn join(sessions: &mut Sessions, role: Role, now_ms: u64) -> Result<SessionId, JoinRefusal> {
    static EPOCHS: AtomicU32 = AtomicU32::new(1);
    let secrets = secrets(EPOCHS.fetch_add(1, Ordering::Relaxed));
    let name = &format!("Wu {}", secrets.epoch);
    sessions.join(Wish { name, role, bytes_per_s: None, cells_along: false }, secrets, now_ms)
}

fn secrets(epoch: u32) -> Secrets {
    Secrets { epoch, key: SessionKey([epoch as u8; 32]) }
}

fn packet(epoch: u32, sequences: &[u32]) -> InputPacket {
    let frames =
        sequences.iter().map(|&sequence| InputFrame { sequence, tick: 0, controls: Controls::default() }).collect();
    InputPacket { epoch, snapshot_tick: 0, snapshots_before: 0, leave: false, frames }
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
    let mut sessions = Sessions::new(LIMITS, &[]);
    let first = join(&mut sessions, Role::Player, 0).unwrap();
    let second = join(&mut sessions, Role::Player, 0).unwrap();
    assert_eq!((first.slot, second.slot), (0, 1));
    assert_eq!(join(&mut sessions, Role::Player, 0), Err(JoinRefusal::Full), "the arena holds two players");
    let spectator = join(&mut sessions, Role::Spectator, 0).unwrap();
    assert_eq!(join(&mut sessions, Role::Spectator, 0), Err(JoinRefusal::Full), "there is one place to watch from");
    assert_eq!((sessions.count(), taken(&mut sessions).len()), (3, 3));

    sessions.token_disappeared(spectator, 1);
    assert_eq!(join(&mut sessions, Role::Spectator, 0), Err(JoinRefusal::Full));
    assert_eq!(taken(&mut sessions).len(), 1);
    let again = join(&mut sessions, Role::Spectator, 0).unwrap();
    assert_eq!(again.slot, spectator.slot);
    assert_ne!(again.epoch, spectator.epoch);
}

#[test]
fn an_old_epoch_neither_drives_nor_ends_the_slots_new_session() {
    let mut sessions = Sessions::new(LIMITS, &[]);
    let old = join(&mut sessions, Role::Player, 0).unwrap();
    sessions.token_disappeared(old, 1);
    taken(&mut sessions);
    let new = join(&mut sessions, Role::Player, 0).unwrap();
    assert_eq!(new.slot, old.slot);
    assert_eq!(sessions.receive(0, &packet(old.epoch, &[9]), 1, 1), Err(InputRefusal::NoSession));
    sessions.token_disappeared(old, 1);
    assert_eq!(sessions.count(), 1);
    for slot in [1, 2, 3, u16::MAX] {
        assert_eq!(sessions.receive(slot, &packet(new.epoch, &[9]), 1, 1), Err(InputRefusal::NoSession));
        assert!(sessions.key(slot).is_none());
    }
}

#[test]
fn what_is_new_in_a_packet_goes_on_and_nothing_goes_on_twice() {
    let mut sessions = Sessions::new(LIMITS, &[]);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    let mut receive =
        |sequences: &[u32], tick| match sessions.receive(id.slot, &packet(id.epoch, sequences), tick, 1)? {
            Received::Inputs(fresh) => Ok(fresh.iter().map(|frame| frame.sequence).collect::<Vec<_>>()),
            Received::Left => panic!("nobody left"),
        };
    assert_eq!(receive(&[1, 2, 3], 1), Ok(vec![1, 2, 3]));
    assert_eq!(receive(&[1, 2, 3], 2), Err(InputRefusal::Stale));
    assert_eq!(receive(&[2], 2), Err(InputRefusal::Stale));
    assert_eq!(receive(&[2, 3, 4], 2), Ok(vec![4]));
}

#[test]
fn a_flood_is_cut_until_the_next_tick() {
    let mut sessions = Sessions::new(LIMITS, &[]);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    let mut refused = |sequences: &[u32], tick| sessions.receive(id.slot, &packet(id.epoch, sequences), tick, 1).err();
    assert_eq!([&[1, 2][..], &[3], &[3, 4]].map(|sequences| refused(sequences, 10)), [None; 3]);
    assert_eq!([&[5][..], &[1]].map(|sequences| refused(sequences, 10)), [Some(InputRefusal::Flood); 2]);
    assert_eq!(refused(&[5], 11), None);
}

#[test]
fn leaving_ends_the_session_whatever_the_sequence() {
    let mut sessions = Sessions::new(LIMITS, &[]);
    let id = join(&mut sessions, Role::Player, 0).unwrap();
    sessions.receive(id.slot, &packet(id.epoch, &[5]), 1, 1).unwrap();
    let leave = InputPacket { leave: true, ..packet(id.epoch, &[5]) };
    assert_eq!(sessions.receive(id.slot, &leave, 1, 1), Ok(Received::Left));
    assert_eq!(sessions.receive(id.slot, &leave, 1, 1), Err(InputRefusal::NoSession));
    assert_eq!(taken(&mut sessions)[1], ended(id, EndReason::Left));
}

#[test]
fn silence_ends_players_and_spectators() {
    let mut sessions = Sessions::new(LIMITS, &[]);
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
    let mut sessions = Sessions::new(LIMITS, &[]);
    sessions.close();
    assert_eq!(join(&mut sessions, Role::Player, 0), Err(JoinRefusal::Closing));
}

#[test]
fn names_are_taken_once_and_banned_ones_never() {
    let mut sessions = Sessions::new(LIMITS, &["Mallory".to_owned()]);
    let mut join = |name: &str, epoch| sessions.join(player(name), secrets(epoch), 0);
    assert!(join("Wu", 1).is_ok());
    assert_eq!(join(" wU ", 2), Err(JoinRefusal::NameTaken));
    assert_eq!(join("mallorY", 3), Err(JoinRefusal::Banned));
    assert!(join("Ann", 4).is_ok());
    assert_eq!(join("Bob", 5), Err(JoinRefusal::Full));
}

/// A player without a connection since 1000 ms, who has 3000 ms to come back.
fn away() -> (Sessions, SessionId) {
    let mut sessions = Sessions::new(Limits { resume_grace_ms: 3000, ..LIMITS }, &[]);
    let id = sessions.join(player("Wu"), secrets(77), 0).unwrap();
    sessions.receive(id.slot, &packet(id.epoch, &[40]), 1, 900).unwrap();
    sessions.token_disappeared(id, 1000);
    taken(&mut sessions);
    assert_eq!(sessions.count(), 0);
    (sessions, id)
}

#[test]
fn a_lost_player_has_a_grace_time_in_which_its_name_and_slot_are_kept() {
    let (mut sessions, id) = away();
    sessions.expire(4000);
    assert_eq!(taken(&mut sessions), []);
    assert_eq!(sessions.join(player("Wu"), secrets(1), 4000), Err(JoinRefusal::NameTaken));
    sessions.expire(4001);
    assert_eq!(taken(&mut sessions), [ended(id, EndReason::ConnectionLost)]);
}

#[test]
fn a_connection_that_comes_back_goes_on_as_if_nothing_had_been() {
    let (mut sessions, id) = away();
    sessions.token_appeared(id, 3000);
    sessions.expire(7000);
    assert_eq!((sessions.count(), taken(&mut sessions)), (1, Vec::new()));
    let (mut sessions, id) = away();
    assert!(sessions.receive(id.slot, &packet(id.epoch, &[41]), 2, 3000).is_ok());
    sessions.expire(7000);
    assert_eq!((sessions.count(), taken(&mut sessions)), (1, Vec::new()));
}

#[test]
fn whoever_proves_it_resumes_once_in_the_same_slot_with_a_new_epoch_and_key() {
    let (mut sessions, id) = away();
    let of =
        |id: SessionId, key| ResumeProof { slot: id.slot, epoch: id.epoch, proof: seal::prove(id.slot, id.epoch, key) };
    let good = of(id, &SessionKey([77; 32]));
    let elsewhere = SessionId { slot: 1, ..id };
    let wish = Wish { bytes_per_s: Some(9_000), cells_along: true, ..player("Nobody") };
    for bad in [
        of(id, &SessionKey([78; 32])),
        of(elsewhere, &SessionKey([77; 32])),
        of(SessionId { epoch: 76, ..id }, &SessionKey([77; 32])),
    ] {
        assert_eq!(sessions.resume(&bad, wish, secrets(5), 2000), Err(JoinRefusal::Over));
    }
    let to = SessionId { epoch: 78, ..id };
    assert_eq!(sessions.resume(&good, wish, secrets(78), 2000), Ok(to));
    assert_eq!(sessions.resume(&good, wish, secrets(79), 2000), Err(JoinRefusal::Over));
    assert_eq!(
        (sessions.count(), taken(&mut sessions)),
        (1, vec![Change::Resumed { from: id, to, bytes_per_s: 9_000, cells_along: true }])
    );
    // The old connection's words are too late, and the new one counts from 1.
    sessions.token_disappeared(id, 2001);
    assert_eq!(sessions.receive(id.slot, &packet(id.epoch, &[41]), 3, 2002), Err(InputRefusal::NoSession));
    assert!(sessions.receive(to.slot, &packet(to.epoch, &[1]), 3, 2002).is_ok());
    sessions.expire(7002);
    assert_eq!((sessions.count(), sessions.key(to.slot)), (1, Some(&SessionKey([78; 32]))));
    // Also before anybody has noticed that the connection is gone.
    assert!(sessions.resume(&of(to, &SessionKey([78; 32])), wish, secrets(80), 7003).is_ok());
}

#[test]
fn sessions_say_a_few_things_at_once_and_then_one_by_one() {
    let mut sessions = Sessions::new(LIMITS, &[]);
    let id = join(&mut sessions, Role::Spectator, 0).unwrap();
    let mut sequence = 0;
    let mut say = |sessions: &mut Sessions, text: &str, now_ms| {
        sequence += 1;
        sessions.say(id.slot, &SayRequest { epoch: id.epoch, sequence, text: text.to_owned() }, now_ms)
    };
    for _ in 0..SAID_AT_ONCE {
        assert_eq!(say(&mut sessions, "hello\n", 1000), Ok(()));
    }
    assert_eq!(say(&mut sessions, "hello", 1000), Err(SayRefusal::TooOften { wait_ms: 1500 }));
    assert_eq!(say(&mut sessions, "hello", 2499), Err(SayRefusal::TooOften { wait_ms: 1 }));
    assert_eq!(say(&mut sessions, "hello", 2500), Ok(()));
    assert_eq!(say(&mut sessions, "\u{202e}", 60_000), Err(SayRefusal::Empty));
    let old = SayRequest { epoch: id.epoch, sequence: 3, text: "hello".to_owned() };
    assert_eq!(sessions.say(id.slot, &old, 60_000), Err(SayRefusal::NotYours), "a repetition");
    let foreign = SayRequest { epoch: id.epoch + 1, sequence: 99, text: "hello".to_owned() };
    assert_eq!(sessions.say(id.slot, &foreign, 60_000), Err(SayRefusal::NotYours));
    assert_eq!(sessions.say(999, &foreign, 60_000), Err(SayRefusal::NotYours));
    let mut changes = Vec::new();
    sessions.take_changes(&mut changes);
    let said = |change: &&Change| **change == Change::Said { slot: id.slot, text: "hello".to_owned() };
    assert_eq!(changes.iter().filter(said).count(), 5);
}
