//! Props: they stand, give way, break, tip, open and wobble.

use pita_game::{Arena, ArenaEvent, Controls};
use pita_sim::{BodyId, DQuat, DVec3, PartPoint};

use crate::test_track::{FLAT, FULL_THROTTLE, SETTINGS, TestTrack};

/// Flat ground with an actor of `kind`, and one place for a car, at the origin.
fn with(kind: &str, keys: &str) -> TestTrack {
    let ground =
        FLAT.replace("[[spawn_grids]]\ncount = [8, 8]\nspacing = [8.0, 6.0]", "[[spawns]]\nposition = [0, 0, 0]");
    TestTrack::new(&format!("{ground}\n[[actors]]\nkind = \"{kind}\"\nmaterial = \"asphalt\"\n{keys}\n"), SETTINGS)
}

fn run(track: &mut TestTrack, seconds: f64) {
    for _ in 0..(30.0 * seconds) as usize {
        track.tick();
    }
}

fn bodies(arena: &Arena, kind: &str) -> Vec<BodyId> {
    let id = arena.actors().find(|actor| actor.kind == kind).expect("there is one").id;
    arena.actor(id).expect("described above").bodies().to_vec()
}

#[test]
fn crates_and_barrels_stand_on_their_places_and_fall_asleep() {
    for kind in ["crate", "barrel"] {
        let mut track = with(kind, "position = [30, 0, 40]\ncopies = [2, 1, 2]\nspacing = [3, 0, 3]");
        let before: Vec<_> = track.arena.world().bodies().iter().map(|&id| track.arena.world().position(id)).collect();
        run(&mut track, 3.0);
        let world = track.arena.world();
        assert_eq!(world.body_count(), 4);
        for (&id, before) in world.bodies().iter().zip(before) {
            let moved = world.position(id).unwrap() - before.unwrap();
            assert!(moved.length() < 2e-3 && world.is_asleep(id), "a {kind} moved {moved}");
        }
    }
}

/// A fence stands for itself and against a push; a car goes through it, and it is whole again when it is placed anew.
#[test]
fn fences_break_at_a_force() {
    let mut track = with("fence", "position = [30, 0, -6]\nyaw = -90\nboards = 6");
    let boards = bodies(&track.arena, "fence");
    run(&mut track, 3.0);
    let world = track.arena.world();
    assert!(boards.iter().all(|&board| world.is_asleep(board)), "an untouched fence is still");
    let upright = |track: &TestTrack, board: BodyId| (track.arena.world().rotation(board).unwrap() * DVec3::Y).y > 0.99;
    assert!(boards.iter().all(|&board| upright(&track, board)));
    track.enter(0);
    track.tick();
    let mut splinters = 0;
    for _ in 0..30 * 8 {
        track.drive(0, FULL_THROTTLE);
        track.tick();
        let is_splinters = |event: &&ArenaEvent| matches!(event, ArenaEvent::Effect(e) if e.kind == "splinters");
        splinters += track.arena.events().iter().filter(is_splinters).count();
    }
    assert!(track.car(0).position.x > 40.0, "the car is through: {:?}", track.car(0));
    assert!(splinters >= 2, "{splinters} joints broke");
    assert!(boards.iter().any(|&board| !upright(&track, board)), "boards lie about");
    assert_eq!(track.arena.world().report().quarantined, 0);
}

#[test]
fn a_strong_fence_holds_a_car() {
    let mut track = with("fence", "position = [12, 0, -6]\nyaw = -90\nboards = 6\nstrength = 1e9\nmass = 500");
    track.enter(0);
    track.tick();
    track.run(4.0, Controls { throttle: 0.3, ..FULL_THROTTLE });
    let car = track.car(0).position;
    assert!(car.x > 8.0 && car.x < 12.0, "{car}");
}

#[test]
fn a_seesaw_tips_under_a_load() {
    let mut track = with(
        "seesaw",
        "position = [30, 0, 40]\n[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nmass = 200\nposition = [33, 1.5, 40]",
    );
    let plank = bodies(&track.arena, "seesaw")[0];
    run(&mut track, 3.0);
    let along = track.arena.world().rotation(plank).unwrap() * DVec3::X;
    assert!(along.y < -0.15, "the loaded end is down: {along}");
    let middle = track.arena.world().position(plank).unwrap();
    assert!(middle.distance(DVec3::new(30.0, 0.8, 40.0)) < 5e-3, "{middle}");
}

#[test]
fn a_drawbridge_opens_and_closes_by_the_clock() {
    let mut track = with(
        "drawbridge",
        "position = [30, 0.5, 40]\nsize = [6, 0.3, 4]\nopens_deg = 60\nspeed_deg = 30\ndown_and_up = [4, 4]",
    );
    let leaf = bodies(&track.arena, "drawbridge")[0];
    let angle = |track: &TestTrack| {
        let along = track.arena.world().rotation(leaf).unwrap() * DVec3::X;
        along.y.asin().to_degrees()
    };
    run(&mut track, 3.5);
    assert!(angle(&track).abs() < 0.5, "down: {}", angle(&track));
    run(&mut track, 4.0);
    assert!((angle(&track) - 60.0).abs() < 0.5, "up: {}", angle(&track));
    run(&mut track, 4.0);
    assert!(angle(&track).abs() < 0.5, "down again: {}", angle(&track));
}

/// Its surface has no gaps: what is smaller than its cells does not fall in, wherever it lies.
#[test]
fn a_small_thing_lies_on_a_jelly() {
    let pebble =
        "[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nmass = 1\nsize = 0.2\nposition = [30.5, 2.2, 40.5]";
    let mut track = with("jelly", &format!("position = [30, 0.5, 40]\n{pebble}"));
    run(&mut track, 4.0);
    let world = track.arena.world();
    let at = world.position(bodies(&track.arena, "crate")[0]).unwrap();
    let jelly = bodies(&track.arena, "jelly")[0];
    let beneath = world.frame(jelly, PartPoint { part: 7, point: DVec3::new(0.5, 1.5, 0.5) }).unwrap().position;
    let height = at.y - DVec3::from(beneath).y;
    assert!((0.08..0.13).contains(&height), "its middle is {height} m above the jelly's top");
}

/// It sags a little, carries a crate, and keeps its volume.
#[test]
fn a_jelly_wobbles_and_springs_back() {
    let mut track = with(
        "jelly",
        "position = [30, 0.5, 40]\n[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nmass = 30\nposition = [30, 3, 40]",
    );
    let jelly = bodies(&track.arena, "jelly")[0];
    let height = |track: &TestTrack| {
        let q = track.arena.world().slice(jelly).unwrap().q.to_vec();
        let y = q.iter().skip(1).step_by(3);
        y.clone().fold(f64::NEG_INFINITY, |a, &b| a.max(b)) - y.fold(f64::INFINITY, |a, &b| a.min(b))
    };
    let mut least = f64::INFINITY;
    for _ in 0..30 * 6 {
        track.tick();
        least = least.min(height(&track));
    }
    let world = track.arena.world();
    assert!(least < 1.45 && least > 0.7, "it gives way: {least}");
    assert!(height(&track) > 1.3, "and comes back: {}", height(&track));
    let crate_ = world.position(bodies(&track.arena, "crate")[0]).unwrap();
    assert!(crate_.y > 1.4, "it carries the crate: {crate_}");
    assert!(world.frame(jelly, PartPoint { part: 0, point: DVec3::Y }).is_some());
    assert_eq!(world.report().quarantined, 0);
}

/// Key-framed free-form deformation of what has dynamics and collides: it grows, twists and bends in turn, and carries what
/// stands on it.
#[test]
fn a_jelly_dances_to_its_key_frames() {
    let keys = "position = [30, 0.5, 40]\nsize = [0.8, 2, 0.8]\ncells = [1, 4, 1]\nstiffness = 1e6\nwarp_period = 8\n\
                warp = [{ at = 0 }, { at = 2, scale = [1, 1.5, 1] }, { at = 4, twist = 0.4 }, { at = 6, bend = [0.3, 0] }]";
    let load = "[[actors]]\nkind = \"crate\"\nmaterial = \"asphalt\"\nsize = 0.5\nmass = 5\nposition = [30, 2.5, 40]";
    let mut track = with("jelly", &format!("{keys}\n{load}"));
    track.arena.audit_energy();
    let [jelly, load] = ["jelly", "crate"].map(|kind| bodies(&track.arena, kind)[0]);
    // The middle of its top off that of its foot, and an edge of the top.
    let top = |track: &TestTrack| {
        let place = |part, x, y| {
            let at = PartPoint { part, point: DVec3::new(x, y, 0.0) };
            DVec3::from(track.arena.world().frame(jelly, at).unwrap().position)
        };
        let [left, right] = [-0.4, 0.4].map(|x| place(3, x, 2.0));
        (0.5 * (left + right) - place(0, 0.0, 0.0), right - left)
    };
    // Key-frames, and where the same deformation puts those points.
    let wanted = [
        (60, DVec3::Y * 3.0, DVec3::X * 0.8),
        (120, DVec3::Y * 2.0, DQuat::from_rotation_y(0.8) * DVec3::X * 0.8),
        (180, DVec3::new(1.0 - 0.6f64.cos(), 0.6f64.sin(), 0.0) / 0.3, DQuat::from_rotation_z(-0.6) * DVec3::X * 0.8),
        (240, DVec3::Y * 2.0, DVec3::X * 0.8),
    ];
    let (mut tick, mut highest) = (0, 0.0f64);
    for (until, middle, edge) in wanted {
        while tick < until {
            track.tick();
            tick += 1;
            assert!(!track.arena.world().report().is_energy_burst(), "{:?}", track.arena.world().report());
            highest = highest.max(track.arena.world().position(load).unwrap().y);
        }
        let is = top(&track);
        assert!(is.0.distance(middle) < 0.08 && is.1.distance(edge) < 0.08, "tick {tick}: {is:?} of {middle}, {edge}");
    }
    let end = track.arena.world().position(load).unwrap();
    assert!(highest > 3.1 && end.distance(DVec3::new(30.0, 2.25, 40.0)) < 0.1, "the crate: {highest} m, {end}");
    assert_eq!((track.arena.world().report().quarantined, track.arena.logic().lost), (0, 0));
}

/// Who is not touched costs nothing.
#[test]
fn a_jelly_that_is_left_alone_falls_asleep() {
    let mut track = with("jelly", "position = [30, 0, 40]\ncopies = [2, 1, 1]\nspacing = [5, 0, 0]");
    run(&mut track, 6.0);
    assert_eq!(track.arena.world().report().asleep, 2);
}
