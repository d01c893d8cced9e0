//! What the arena does for actors: sporadic work, messages, effects, coming and going, and kinds of a game's own.

use std::sync::{Arc, Mutex};

use pita_game::arena_file::{ArenaError, ArenaFile, Key};
use pita_game::assembly::{Assembly, Piece};
use pita_game::{
    Actor, ActorInfo, ActorKind, ActorKinds, Arena, ArenaEvent, Message, Pose, Site, Step, Supplies, WhenLost, pipeline,
};
use pita_sim::{BodyId, DVec3, Shape, SimError, World};

use crate::test_track::{FLAT, Recorder, SETTINGS, TestTrack};

/// What a script is given, and what the actor that has it was told.
type Script = Box<dyn FnMut(&mut Step, &[(u32, Message)]) -> Result<(), SimError> + Send>;

/// A ball that does what its script says.
struct Scripted {
    info: ActorInfo,
    ball: Assembly,
    told: Vec<(u32, Message)>,
    script: Script,
}

impl Scripted {
    fn build(at: DVec3, script: Script) -> impl FnOnce(&mut World, u32) -> Result<Box<dyn Actor>, SimError> + Send {
        move |world, id| {
            let mut ball = Assembly::at(Pose { position: at, yaw: 0.0 });
            ball.add(world, Piece::new(Shape::Ball { radius: 0.5 }, 10.0, 0.5, DVec3::ZERO))?;
            let info = ActorInfo { id, kind: "scripted", name: "ball".to_owned(), slot: None, parts: ball.parts() };
            Ok(Box::new(Self { info, ball, told: Vec::new(), script }))
        }
    }
}

impl Actor for Scripted {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.ball.bodies()
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        (self.script)(step, &std::mem::take(&mut self.told))
    }

    fn hear(&mut self, from: u32, message: &Message) {
        self.told.push((from, *message));
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.ball.place(world, pose)
    }
}

/// Adds a ball `x` metres to the east that does what `script` says.
fn add(
    track: &mut TestTrack,
    x: f64,
    script: impl FnMut(&mut Step, &[(u32, Message)]) -> Result<(), SimError> + Send + 'static,
) -> u32 {
    track.arena.add_actor(Scripted::build(DVec3::new(x, 0.5, 0.0), Box::new(script))).unwrap()
}

#[test]
fn sporadic_work_is_spread_over_the_ticks_and_counted() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    for i in 0..40 {
        add(&mut track, 2.0 * f64::from(i), |step, _| {
            step.is_due(8);
            Ok(())
        });
    }
    let jobs: Vec<usize> = (0..16)
        .map(|_| {
            track.tick();
            track.arena.logic().sporadic
        })
        .collect();
    assert_eq!(jobs[..8].iter().sum::<usize>(), 40, "each is due once in eight ticks: {jobs:?}");
    assert_eq!(jobs[..8], jobs[8..], "in the same ticks of every eight");
    assert!(jobs.iter().all(|jobs| (3..=7).contains(jobs)), "evenly: {jobs:?}");
    assert_eq!(track.arena.logic().actors, 40);
}

#[test]
fn actors_know_of_each_other_and_tell_each_other_things() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    let heard = Arc::new(Mutex::new(Vec::new()));
    let told = heard.clone();
    let near = add(&mut track, 5.0, move |step, messages| {
        told.lock().unwrap().extend(messages.iter().map(|message| (step.tick, *message)));
        Ok(())
    });
    let far = add(&mut track, 50.0, |_, _| Ok(()));
    let seen = Arc::new(Mutex::new(Vec::new()));
    let noted = seen.clone();
    let teller = add(&mut track, 0.0, move |step, _| {
        let nearest = step.nearest(DVec3::ZERO, 10.0, |other| other.kind == "scripted");
        noted.lock().unwrap().push(nearest.map(|other| (other.id, other.position.x)));
        assert_eq!(step.others().map(|other| other.id).collect::<Vec<_>>(), [0, 1]);
        let body = step.other(1).map(|other| other.body).unwrap();
        assert_eq!(step.owner(body).map(|other| other.id), Some(1));
        step.tell(0, Message::Damage { amount: 7.0, by: None });
        step.tell(77, Message::Damage { amount: 1.0, by: None });
        Ok(())
    });
    assert_eq!((near, far, teller), (0, 1, 2));
    track.tick();
    track.tick();
    assert_eq!(seen.lock().unwrap()[0], Some((near, 5.0)));
    let damage = Message::Damage { amount: 7.0, by: None };
    assert_eq!(*heard.lock().unwrap(), [(2, (teller, damage))], "heard in one tick, acted upon in the next");
    let logic = track.arena.logic();
    assert_eq!((logic.messages, logic.refused), (1, 1), "nobody has the id 77");
}

#[test]
fn actors_come_and_go_on_request_and_nothing_stays_of_what_is_refused() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    let parent = add(&mut track, 0.0, |step, _| {
        if step.tick == 1 {
            let child = step.add(Scripted::build(
                DVec3::new(9.0, 0.5, 0.0),
                Box::new(|step, _| {
                    if step.tick == 3 {
                        step.remove_self();
                    }
                    Ok(())
                }),
            ));
            let half_built = step.add(|world, _| {
                let mut ball = Assembly::at(Pose { position: DVec3::Y, yaw: 0.0 });
                ball.add(world, Piece::new(Shape::Ball { radius: 0.5 }, 10.0, 0.5, DVec3::ZERO))?;
                Err(SimError::Unusable { what: "changed its mind" })
            });
            assert_eq!((child, half_built), (1, 2));
            step.effect("poof", DVec3::Y, DVec3::ZERO, 7.0);
        }
        Ok(())
    });
    track.tick();
    let logic = *track.arena.logic();
    assert_eq!((logic.added, logic.refused, logic.effects), (0, 0, 1));
    assert_eq!(track.arena.world().body_count(), 1, "who is asked for comes with the next tick");
    let effect = track.arena.events().iter().find_map(|event| match event {
        ArenaEvent::Effect(effect) => Some(*effect),
        _ => None,
    });
    let effect = effect.expect("one was asked for");
    assert_eq!((effect.kind, effect.actor, effect.strength), ("poof", parent, 1.0));
    track.tick();
    let logic = *track.arena.logic();
    assert_eq!((logic.added, logic.refused, logic.actors), (1, 1, 2), "it acts in the tick in which it comes");
    assert_eq!(track.arena.world().body_count(), 2);
    track.tick();
    assert!(track.arena.events().contains(&ArenaEvent::ActorRemoved(1)));
    assert_eq!((track.arena.world().body_count(), track.arena.actors().count()), (1, 1));
}

#[test]
fn players_vehicles_are_not_removed_on_request() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.enter(0);
    track.tick();
    let car = track.arena.actor_of(0).expect("entered").id;
    add(&mut track, 20.0, move |step, _| {
        step.remove(car);
        Ok(())
    });
    track.tick();
    assert_eq!((track.arena.actor_of(0).map(|actor| actor.id), track.arena.logic().refused), (Some(car), 1));
}

#[test]
fn what_is_lost_goes_unless_it_has_a_home() {
    for (when_lost, left) in [(WhenLost::Remove, 0), (WhenLost::Spawn, 1)] {
        let mut track = TestTrack::new(FLAT, SETTINGS);
        let script: Script = Box::new(|step, _| {
            if step.tick == 2 {
                return Err(SimError::Unusable { what: "an actor that cannot go on is lost" });
            }
            Ok(())
        });
        let build = Scripted::build(DVec3::new(500.0, 0.5, 0.0), script);
        let build = |world: &mut World, id| -> Result<Box<dyn Actor>, SimError> {
            Ok(Box::new(Lost(build(world, id)?, when_lost)))
        };
        track.arena.add_actor(build).unwrap();
        track.tick();
        track.tick();
        assert_eq!(track.arena.actors().count(), left, "{when_lost:?}");
        if left == 1 {
            let at = track.arena.world().position(track.arena.world().bodies()[0]).unwrap();
            assert!(at.length() < 60.0, "it is at a spawn point: {at}");
        }
    }
}

/// A scripted actor with another idea of what becomes of it.
struct Lost(Box<dyn Actor>, WhenLost);

impl Actor for Lost {
    fn describe(&self) -> &ActorInfo {
        self.0.describe()
    }

    fn bodies(&self) -> &[BodyId] {
        self.0.bodies()
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        self.0.step(step)
    }

    fn when_lost(&self) -> WhenLost {
        self.1
    }

    fn place(&mut self, world: &mut World, pose: Pose) -> Result<(), SimError> {
        self.0.place(world, pose)
    }
}

/// A kind of a game's own: a balloon, which rises.
struct Balloon {
    info: ActorInfo,
    ball: Assembly,
    lift: f64,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct BalloonParameters {
    lift: f64,
}

impl ActorKind for Balloon {
    const KIND: &'static str = "balloon";
    type Parameters = BalloonParameters;

    fn check(parameters: &BalloonParameters, key: &Key, _file: &ArenaFile) -> Result<(), ArenaError> {
        key.at("lift").number(parameters.lift, 0.0, 20.0, "N")
    }

    fn add(site: &mut Site, parameters: &BalloonParameters) -> Result<Self, SimError> {
        let mut ball = Assembly::at(site.pose);
        ball.add(site.world, Piece::new(Shape::Ball { radius: 0.5 }, 1.0, 0.5, DVec3::ZERO))?;
        Ok(Self { info: site.info(Self::KIND, ball.parts()), ball, lift: parameters.lift })
    }
}

impl Actor for Balloon {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        self.ball.bodies()
    }

    fn step(&mut self, step: &mut Step) -> Result<(), SimError> {
        let body = self.ball.bodies()[0];
        let at = step.world.position(body).ok_or(SimError::Gone { what: "the balloon" })?;
        step.world.apply_force(body, DVec3::Y * self.lift, at)
    }
}

#[test]
fn a_game_adds_kinds_of_its_own() {
    let kinds = ActorKinds::built_in().with::<Balloon>();
    let placed = |keys: &str| format!("{FLAT}\n[[actors]]\nkind = \"balloon\"\nposition = [0, 2, 0]\n{keys}\n");
    let supplies = Supplies { kinds: &kinds, read: &|_| Err(String::new()) };
    let load = |text: &str| Arena::from_toml_with(text, &SETTINGS, &supplies);
    let mut arena = load(&placed("lift = 12\nname = \"red\"\ncopies = [3, 1, 1]\nspacing = [2, 0, 0]")).unwrap();
    assert_eq!(
        arena.actors().map(|actor| (actor.kind, actor.name.as_str())).collect::<Vec<_>>(),
        [("balloon", "red"); 3]
    );
    for _ in 0..30 {
        pipeline::tick(&mut arena, &mut Recorder::default());
    }
    let height = arena.world().position(arena.world().bodies()[2]).unwrap();
    assert!(height.y > 2.9 && (height.x - 4.0).abs() < 1e-6, "{height}");
    let refusal = |keys: &str| load(&placed(keys)).err().map(|error| error.to_string()).unwrap_or_default();
    assert_eq!(refusal("lift = 99"), "actors[0].lift is 99, allowed: 0 to 20 N");
    assert!(refusal("").contains("missing field `lift`"), "{}", refusal(""));
    let Err(unknown) = Arena::from_toml(&placed("lift = 9"), &SETTINGS) else { panic!("accepted") };
    assert!(unknown.to_string().contains("actors[0].kind is balloon, allowed: one of"), "{unknown}");
}

/// What a game adds between two ticks is told of in the next one's events, once.
#[test]
fn what_comes_between_two_ticks_is_told_of() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.tick();
    let ball = add(&mut track, 5.0, |_, _| Ok(()));
    track.tick();
    track.tick();
    let is_it = |event: &&ArenaEvent| matches!(event, ArenaEvent::ActorAdded(info) if info.id == ball);
    assert_eq!(track.ports.events.iter().filter(is_it).count(), 1, "{:?}", track.ports.events);
}

/// Harm that one does oneself takes nobody's credit.
#[test]
fn a_knock_out_is_the_merit_of_who_harmed_last_and_never_ones_own() {
    let mut track = TestTrack::new(&format!("{FLAT}\n[combat]\nhealth = 100.0\n"), SETTINGS);
    track.enter(0);
    track.enter(1);
    track.tick();
    let [attacker, victim] = [0, 1].map(|slot| track.arena.actor_of(slot).expect("entered").id);
    for by in [attacker, victim] {
        add(&mut track, 30.0 + 3.0 * f64::from(by), move |step, _| {
            step.tell(victim, Message::Damage { amount: 60.0, by: Some(by) });
            step.remove_self();
            Ok(())
        });
    }
    (0..3).for_each(|_| track.tick());
    let expected = ArenaEvent::KnockedOut { actor: victim, by: Some(attacker) };
    assert!(track.ports.events.contains(&expected), "{:?}", track.ports.events);
}

/// A car of the arena's that another actor took away is missed.
#[test]
fn the_place_of_who_was_removed_is_filled_again() {
    let ai = "[routes.ring]\ncorners = [[0.0, 0.0], [40.0, 0.0], [40.0, 40.0]]\n[ai]\ndrivers = 1\nroute = \"ring\"\nspeed = 8.0\n";
    let mut track = TestTrack::new(&format!("{FLAT}\n{ai}"), SETTINGS);
    let cars = |track: &TestTrack| -> Vec<u32> {
        track.arena.actors().filter(|info| info.kind == "vehicle").map(|info| info.id).collect()
    };
    let first = cars(&track);
    assert_eq!(first.len(), 1);
    let removed = first[0];
    add(&mut track, 60.0, move |step, _| {
        if step.tick == 2 {
            step.remove(removed);
        }
        Ok(())
    });
    (0..4).for_each(|_| track.tick());
    assert!(cars(&track).len() == 1 && cars(&track) != first, "{:?}", cars(&track));
}
