//! A running arena takes another text: what changes, what stays, and what is refused.

use pita_game::arena_file::{ArenaError, ArenaFile, Key};
use pita_game::assembly::{Assembly, Piece};
use pita_game::{Actor, ActorInfo, ActorKind, ActorKinds, Controls, Reload, ReloadError, Site, Supplies};
use pita_sim::{BodyId, DVec3, Shape, SimError};

use crate::test_track::{FLAT, SETTINGS, TestTrack};

/// Flat ground with crates at both `places`, m along x.
fn text(places: [f64; 2]) -> String {
    let place =
        |x: f64| format!("[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nposition = [{x:?}, 0.0, 60.0]\n");
    format!("{FLAT}\n{}", places.map(place).concat())
}

fn between(old: &str, new: &str) -> Result<Reload, ReloadError> {
    Reload::between(old, new, &SETTINGS, &Supplies { kinds: &ActorKinds::built_in(), read: &|_| Err(String::new()) })
}

#[test]
fn actors_change_under_players_who_stay() {
    let (old, new) = (text([10.0, 20.0]), text([20.0, 30.0]));
    let mut track = TestTrack::new(&old, SETTINGS);
    track.enter(0);
    track.run(3.0, Controls { throttle: 0.5, ..Controls::default() });
    let ids = |track: &TestTrack, kind| -> Vec<u32> {
        track.arena.actors().filter(|actor| actor.kind == kind).map(|actor| actor.id).collect()
    };
    let (cars, car) = (ids(&track, "vehicle"), track.car(0));
    assert_eq!(ids(&track, "crate"), [0, 1]);
    let reload = between(&old, &new).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(reload.changes(), ["actors: 1 tables as they were, 1 built anew"]);
    track.arena.schedule(reload);
    track.tick();
    assert_eq!(ids(&track, "vehicle"), cars);
    assert!(track.car(0).position.distance(car.position) < 1.0, "the player drives on");
    let crates = ids(&track, "crate");
    assert_eq!(crates.len(), 2);
    assert!(crates[0] == 1 && crates[1] > cars[0], "one stayed, one is new: {crates:?}");
    let at = track.arena.world().position(track.arena.actor(crates[1]).unwrap().bodies()[0]).unwrap();
    assert!((at.x - 30.0).abs() < 0.01, "{at}");
    // And back again, from where it is now.
    track.arena.schedule(between(&new, &old).unwrap_or_else(|error| panic!("{error}")));
    track.tick();
    assert_eq!((ids(&track, "crate").len(), track.arena.world().body_count()), (2, 7));
}

#[test]
fn what_is_not_safe_or_not_valid_changes_nothing_and_says_so() {
    let old = text([10.0, 20.0]);
    let refusal = |new: &str| between(&old, new).err().map(|error| error.to_string()).unwrap_or_default();
    let slippery = old.replace("friction = 1.0", "friction = 0.5").replace("max_players = 64", "max_players = 9");
    let said = refusal(&slippery);
    assert!(said.starts_with("materials, max_players cannot change while the arena runs"), "{said}");
    let said = refusal(&old.replace("kind = \"crate\"", "kind = \"crane\""));
    assert!(said.contains("actors[0].kind is crane"), "{said}");
    assert_eq!(between(&old, &old).ok().map(|reload| reload.changes()), Some(Vec::new()));
}

/// Those who fill empty places follow the route that the file has now, at its speed; players stay.
#[test]
fn those_who_fill_places_come_anew() {
    let with_ai = |drivers: usize, z: f64| {
        let corners = format!("[[-60.0, {z:?}], [60.0, {z:?}]]");
        let ai = format!("[ai]\ndrivers = {drivers}\nroute = \"there\"\nspeed = 12.0\n");
        format!("{FLAT}\n[routes.there]\ncorners = {corners}\n{ai}")
    };
    let (old, new) = (with_ai(3, 0.0), with_ai(2, 40.0));
    let mut track = TestTrack::new(&old, SETTINGS);
    track.enter(0);
    track.run(2.0, Controls::default());
    let own = |track: &TestTrack| -> Vec<u32> {
        let is_own = |actor: &&pita_game::ActorInfo| actor.slot.is_none();
        track.arena.actors().filter(is_own).map(|actor| actor.id).collect()
    };
    let before = own(&track);
    assert_eq!(before.len(), 2, "three less the player");
    track.arena.schedule(between(&old, &new).unwrap_or_else(|error| panic!("{error}")));
    track.tick();
    let after = own(&track);
    assert!(after.len() == 1 && !before.contains(&after[0]), "{before:?}, then {after:?}");
    track.run(20.0, Controls::default());
    let at = track.arena.world().position(track.arena.actor(after[0]).expect("it drives").bodies()[0]).unwrap();
    assert!((at.z - 40.0).abs() < 12.0, "it follows the new route: {at}");
}

#[test]
fn new_cars_have_the_new_parameters() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.enter(0);
    track.tick();
    let new = format!("{FLAT}\n[vehicle]\nchassis_mass = 2000.0\n");
    track.arena.schedule(between(FLAT, &new).unwrap_or_else(|error| panic!("{error}")));
    track.enter(1);
    track.tick();
    let mass = |slot| {
        let id = track.arena.actor_of(slot).expect("entered").id;
        track.arena.world().mass(track.arena.actor(id).expect("listed").bodies()[0])
    };
    assert_eq!((mass(0), mass(1)), (Some(1100.0), Some(2000.0)));
}

/// Cannot be added where there are more than six bodies.
struct Shy(ActorInfo, Assembly);

#[derive(serde::Deserialize)]
struct Nothing {}

impl ActorKind for Shy {
    const KIND: &'static str = "shy";
    type Parameters = Nothing;

    fn check(_: &Nothing, _: &Key, _: &ArenaFile) -> Result<(), ArenaError> {
        Ok(())
    }

    fn add(site: &mut Site, _: &Nothing) -> Result<Self, SimError> {
        let mut ball = Assembly::at(site.pose);
        ball.add(site.world, Piece::new(Shape::Ball { radius: 0.5 }, 1.0, 0.5, DVec3::Y))?;
        if site.world.body_count() > 6 {
            return Err(SimError::Unusable { what: "too many are here" });
        }
        Ok(Self(site.info(Self::KIND, ball.parts()), ball))
    }
}

impl Actor for Shy {
    fn describe(&self) -> &ActorInfo {
        &self.0
    }

    fn bodies(&self) -> &[BodyId] {
        self.1.bodies()
    }
}

/// What can be built in an empty arena may be refused in a full one: nothing of it stays behind, and what was placed
/// before it is still the table's.
#[test]
fn what_the_running_arena_refuses_leaves_nothing_behind() {
    let kinds = ActorKinds::built_in().with::<Shy>();
    let supplies = Supplies { kinds: &kinds, read: &|_| Err(String::new()) };
    let new = format!(
        "{FLAT}\n[[actors]]\nkind = \"shy\"\nposition = [40, 0, 40]\ncopies = [3, 1, 1]\nspacing = [2, 0, 0]\n"
    );
    let change =
        |old: &str, new: &str| Reload::between(old, new, &SETTINGS, &supplies).unwrap_or_else(|e| panic!("{e}"));
    let mut track = TestTrack::new(FLAT, SETTINGS);
    track.enter(0);
    track.tick();
    track.arena.schedule(change(FLAT, &new));
    track.tick();
    assert_eq!((track.arena.actors().count(), track.arena.world().body_count()), (2, 6));
    track.arena.schedule(change(&new, FLAT));
    track.tick();
    assert_eq!((track.arena.actors().count(), track.arena.world().body_count()), (1, 5));
}
