use super::*;
use pita_protocol::message::InputFrame;

const ID: SessionId = SessionId { slot: 1, epoch: 7 };
const PERIOD_NS: u64 = 33_000_000;

fn now(tick: u64) -> Now {
    Now { tick, ns: tick * PERIOD_NS }
}

/// Meant for `tick`, arrived as tick `at` began.
fn arrival(sequence: u32, tick: u64, at: u64, throttle: f32) -> Arrival {
    let controls = Controls { throttle, ..Controls::default() };
    Arrival { id: ID, frame: InputFrame { sequence, tick, controls }, at_ns: at * PERIOD_NS }
}

/// A player took its seat at tick 100.
fn seated() -> Drivers {
    let mut drivers = Drivers::new(2, 15, PERIOD_NS);
    drivers.enter(ID, 100);
    drivers
}

fn driven(drivers: &mut Drivers, tick: u64) -> (f64, bool) {
    let mut commands = Vec::new();
    drivers.drive(now(tick), &mut commands);
    match &commands[..] {
        [Command::Drive { slot: 1, controls }] => (controls.throttle, controls.reset),
        other => panic!("{other:?}"),
    }
}

fn ack(drivers: &Drivers) -> InputAck {
    let mut acks = Vec::new();
    drivers.acks(&mut acks);
    assert_eq!((acks.len(), acks[0].0), (1, ID));
    acks[0].1
}

fn fates(drivers: &Drivers) -> [InputFate; 4] {
    [0, 1, 2, 3].map(|behind| ack(drivers).fates.get(behind).unwrap())
}

#[test]
fn an_input_waits_for_its_tick_and_holds_until_its_driver_has_been_silent_for_too_long() {
    let mut drivers = seated();
    for arrival in [arrival(2, 103, 100, 1.0), arrival(1, 102, 100, 0.5)] {
        drivers.hear(&arrival, now(101));
    }
    assert_eq!([101, 102, 103, 104].map(|tick| driven(&mut drivers, tick).0), [0.0, 0.5, 1.0, 1.0]);
    assert_eq!((ack(&drivers).sequence, ack(&drivers).tick), (2, 103));
    assert_eq!(fates(&drivers)[..2], [InputFate::Applied { late_ticks: 0 }; 2]);
    assert_eq!((driven(&mut drivers, 115).0, driven(&mut drivers, 116).0), (1.0, 0.0));
    assert_eq!(drivers.counts(), InputCounts { in_time: 2, ..InputCounts::default() });
}

#[test]
fn a_late_input_is_applied_at_once_and_one_overtaken_is_passed_over() {
    let mut drivers = seated();
    drivers.hear(&arrival(3, 99, 101, 1.0), now(102));
    assert_eq!(driven(&mut drivers, 102), (1.0, false));
    let missing = InputFate::Missing;
    assert_eq!(fates(&drivers), [InputFate::Applied { late_ticks: 3 }, missing, missing, missing]);
    assert_eq!(drivers.counts().missing, 2);
    drivers.hear(&arrival(2, 98, 102, 0.25), now(103));
    assert_eq!(driven(&mut drivers, 103), (1.0, false));
    assert_eq!(fates(&drivers)[1], InputFate::Superseded);
    assert_eq!(drivers.counts(), InputCounts { late: 1, superseded: 1, missing: 1, ..InputCounts::default() });
}

#[test]
fn of_several_that_are_due_the_newest_is_driven() {
    let mut drivers = seated();
    for (sequence, throttle) in [(1, 0.1), (3, 0.3), (2, 0.2)] {
        drivers.hear(&arrival(sequence, 101, 100, throttle), now(101));
    }
    assert!((driven(&mut drivers, 101).0 - 0.3).abs() < 1e-6);
    let superseded = InputFate::Superseded;
    assert_eq!(fates(&drivers)[..3], [InputFate::Applied { late_ticks: 0 }, superseded, superseded]);
    assert_eq!(drivers.counts(), InputCounts { in_time: 1, superseded: 2, ..InputCounts::default() });
}

#[test]
fn what_is_too_early_is_refused_and_said_so() {
    let mut drivers = seated();
    drivers.hear(&arrival(1, 102 + EARLY_MAX_TICKS, 100, 1.0), now(101));
    drivers.hear(&arrival(2, 101 + EARLY_MAX_TICKS, 100, 1.0), now(101));
    assert_eq!((ack(&drivers).received, driven(&mut drivers, 101).0), (2, 0.0));
    assert_eq!(driven(&mut drivers, 101 + EARLY_MAX_TICKS).0, 0.0, "silent for too long by then");
    assert_eq!(fates(&drivers)[..2], [InputFate::Applied { late_ticks: 0 }, InputFate::Early]);
}

#[test]
fn slack_is_from_the_arrival_to_the_tick_that_was_meant() {
    let mut drivers = seated();
    drivers.hear(&Arrival { at_ns: 101 * PERIOD_NS - 10_000_000, ..arrival(1, 102, 0, 0.0) }, now(101));
    assert_eq!((ack(&drivers).received, ack(&drivers).slack_ms), (1, 43));
    drivers.hear(&Arrival { at_ns: 101 * PERIOD_NS - 10_000_000, ..arrival(2, 100, 0, 0.0) }, now(101));
    assert_eq!((ack(&drivers).received, ack(&drivers).slack_ms), (2, -23));
    drivers.hear(&arrival(3, u64::MAX, 0, 0.0), now(101));
    assert_eq!(ack(&drivers).slack_ms, i16::MAX);
    driven(&mut drivers, 102);
    assert_eq!(drivers.waits_us(), [43_000], "of the two that were due the newer one, the late one");
}

#[test]
fn reset_is_pressed_for_one_tick_also_where_its_input_is_passed_over() {
    let mut drivers = seated();
    let mut pressed = arrival(1, 101, 100, 0.0);
    pressed.frame.controls.buttons = buttons::RESET;
    drivers.hear(&pressed, now(101));
    drivers.hear(&arrival(2, 101, 100, 0.5), now(101));
    assert_eq!(driven(&mut drivers, 101), (0.5, true));
    assert_eq!(driven(&mut drivers, 102), (0.5, false));
}

#[test]
fn strangers_do_not_drive() {
    let mut drivers = Drivers::new(2, 15, PERIOD_NS);
    drivers.hear(&arrival(1, 1, 1, 1.0), now(1));
    drivers.enter(ID, 1);
    for id in [SessionId { epoch: 6, ..ID }, SessionId { slot: 0, ..ID }, SessionId { slot: 9, ..ID }] {
        drivers.hear(&Arrival { id, ..arrival(5, 1, 1, 1.0) }, now(1));
    }
    assert_eq!(driven(&mut drivers, 1), (0.0, false));
    drivers.leave(ID.slot);
    let mut commands = Vec::new();
    drivers.drive(now(2), &mut commands);
    assert!(commands.is_empty());
}

#[test]
fn no_choice_of_sequences_and_ticks_takes_time_or_memory() {
    let mut drivers = seated();
    for (sequence, tick) in [(u32::MAX - 2, u64::MAX), (1, 0), (u32::MAX - 1, 0), (u32::MAX, 101), (3, 101)] {
        drivers.hear(&arrival(sequence, tick, 0, 1.0), now(101));
    }
    (0..100).for_each(|n| drivers.hear(&arrival(n, 110, 0, 1.0), now(101)));
    driven(&mut drivers, 101);
    assert_eq!(ack(&drivers).sequence, u32::MAX);
    assert!(drivers.counts().missing < FATES_MAX as u64);
}

/// The wire's bits are the game's.
#[test]
fn every_button_does_what_its_name_says() {
    let none = GameControls::of([0.25, 0.5, -1.0], 0);
    assert_eq!(none, GameControls { throttle: 0.25, brake: 0.5, steer: -1.0, ..GameControls::default() });
    for (button, held) in [
        (buttons::REVERSE, GameControls { reverse: true, ..none }),
        (buttons::HANDBRAKE, GameControls { handbrake: true, ..none }),
        (buttons::RESET, GameControls { reset: true, ..none }),
        (buttons::BOOST, GameControls { boost: true, ..none }),
        (buttons::JUMP, GameControls { jump: true, ..none }),
        (buttons::FIRE, GameControls { fire: true, ..none }),
        (buttons::NEXT_WEAPON, GameControls { next_weapon: true, ..none }),
    ] {
        let mut drivers = seated();
        let controls = Controls { throttle: 0.25, brake: 0.5, steer: -1.0, buttons: button };
        let mut arrival = arrival(1, 101, 100, 0.0);
        arrival.frame.controls = controls;
        drivers.hear(&arrival, now(101));
        let mut commands = Vec::new();
        drivers.drive(now(101), &mut commands);
        assert_eq!(commands, [Command::Drive { slot: 1, controls: held }], "button {button}");
    }
}
