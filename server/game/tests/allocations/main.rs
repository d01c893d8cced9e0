//! What the ticks of a car that rolls over kerbs and into a wall allocate for themselves: nothing.
//!
//! A binary and a single test of its own, because the allocator counts for the whole process.

use std::alloc::System;

use pita_game::{Arena, ArenaSettings, Command, Controls, Ports, Stage, pipeline};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static COUNTER: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const FLAT: &str = include_str!("../../../../configs/arenas/flat.toml");

/// Kerbs along the way, every two metres, and a wall at its end.
const KERBS: &str = r#"
[[statics]]
shape.box.half = [0.25, 0.08, 6.0]
material = "asphalt"
position = [6.0, 0.0, 0.0]
copies = [40, 1, 1]
spacing = [2.0, 1.0, 1.0]

[[statics]]
shape.box.half = [0.2, 1.0, 20.0]
material = "asphalt"
position = [100.0, 1.0, 0.0]
"#;

/// A player who comes and keeps the throttle down.
struct Driver {
    has_entered: bool,
}

impl Ports for Driver {
    fn begin(&mut self, _stage: Stage) {}

    fn collect(&mut self, _tick: u64, into: &mut Vec<Command>) {
        if !std::mem::replace(&mut self.has_entered, true) {
            into.push(Command::Enter { slot: 0, name: "driver".to_owned() });
        }
        into.push(Command::Drive { slot: 0, controls: Controls { throttle: 0.6, ..Controls::default() } });
    }

    fn output(&mut self, _arena: &Arena) {}

    fn end(&mut self) {}
}

#[test]
fn kerbs_allocate_nothing() {
    let text = FLAT.replace("count = [8, 8]", "count = [1, 1]") + KERBS;
    let mut arena = Arena::from_toml(&text, &ArenaSettings { tick_hz: 30, threads: 1 }).unwrap();
    let mut driver = Driver { has_entered: false };
    let x = |arena: &Arena| arena.world().slices().next().map_or(0.0, |chassis| chassis.q[0]);
    while x(&arena) < 30.0 {
        assert!(arena.tick() < 600, "it came no farther than {} m", x(&arena));
        pipeline::tick(&mut arena, &mut driver);
    }
    let (region, start) = (Region::new(COUNTER), arena.tick());
    while x(&arena) < 97.5 {
        assert!(arena.tick() < 1200, "it came no farther than {} m", x(&arena));
        pipeline::tick(&mut arena, &mut driver);
    }
    for _ in 0..30 {
        pipeline::tick(&mut arena, &mut driver);
    }
    // What has room for the ticks that follow may grow; what one tick has for itself, it gives back.
    let (change, ticks) = (region.change(), arena.tick() - start);
    assert_eq!(change.deallocations, 0, "{change:?} in {ticks} ticks");
    assert!(change.allocations < ticks as usize / 2, "{change:?} in {ticks} ticks");
}
