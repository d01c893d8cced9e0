//! Collision procedures of actors, and the materials of an arena file.

use std::sync::{Arc, Mutex};

use pita_game::{Actor, ActorInfo, Contact, PartInfo, Partner, Response};
use pita_sim::{BodyId, Collider, DVec3, Phase, RigidBodyDesc, Shape, SimError, World};

use crate::test_track::{FLAT, SETTINGS, TestTrack};

/// What a probe was told: phase, partner, material of the other, normal, approach speed and impulse.
type Told = (Phase, Partner, String, DVec3, f64, f64);

/// A crate that remembers what it is told, and passes through what it is told to.
struct Probe {
    info: ActorInfo,
    bodies: [BodyId; 1],
    passes: fn(&Contact) -> bool,
    told: Arc<Mutex<Vec<Told>>>,
}

impl Actor for Probe {
    fn describe(&self) -> &ActorInfo {
        &self.info
    }

    fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    fn collide(&mut self, contact: &Contact) -> Response {
        let Contact { phase, partner, other, normal, approach_speed, impulse, .. } = *contact;
        let told = (phase, partner, other.material.to_owned(), normal, approach_speed, impulse);
        self.told.lock().unwrap().push(told);
        if (self.passes)(contact) { Response::Pass } else { Response::Collide }
    }
}

/// Adds a probe at `position` that moves at `velocity`; answers its id, its body, and what it will be told.
fn add_probe(
    track: &mut TestTrack,
    position: DVec3,
    velocity: DVec3,
    passes: fn(&Contact) -> bool,
) -> (u32, BodyId, Arc<Mutex<Vec<Told>>>) {
    let told = Arc::new(Mutex::new(Vec::new()));
    let shape = Shape::Box { half: DVec3::splat(0.5) };
    let mut added = None;
    let added_body = &mut added;
    let remembered = told.clone();
    let build = move |world: &mut World, id| -> Result<Box<dyn Actor>, SimError> {
        let collider = Some(Collider::new(shape.clone(), 0.0));
        let desc = RigidBodyDesc { velocity, collider, ..RigidBodyDesc::new(position, 50.0, shape.inertia(50.0)) };
        let body = world.add_rigid_body(desc)?;
        *added_body = Some(body);
        let parts = vec![PartInfo::new(world, body, shape)];
        let info = ActorInfo { id, kind: "probe", name: "probe".to_owned(), slot: None, parts };
        Ok(Box::new(Probe { info, bodies: [body], passes, told: remembered }))
    };
    let id = track.arena.add_actor(build).unwrap();
    (id, added.unwrap(), told)
}

#[test]
fn a_collision_procedure_tells_ground_from_victim() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    let far = DVec3::new(200.0, 0.5, 0.0);
    let (hitter, _, told) = add_probe(&mut track, far, DVec3::X * 8.0, |_| false);
    let (victim, _, victims) = add_probe(&mut track, far + DVec3::X * 3.0, DVec3::ZERO, |_| false);
    (0..30).for_each(|_| track.tick());
    let told = told.lock().unwrap();
    assert!(matches!(told[0], (Phase::Begin, Partner::Ground(_), _, _, _, _)), "{:?}", told[0]);
    assert!(told.iter().filter(|t| matches!(t.1, Partner::Ground(_))).all(|t| t.2 == "asphalt"));
    let met: Vec<&Told> = told.iter().filter(|t| t.1 == Partner::Actor { id: victim, kind: "probe" }).collect();
    assert_eq!(met[0].0, Phase::Begin);
    assert!((met[0].3 - DVec3::X).length() < 0.01 && (met[0].4 - 8.0).abs() < 0.1, "{:?}", met[0]);
    // 25 kg of reduced mass at 8 m/s, without restitution.
    let impulse: f64 = met.iter().map(|t| t.5).sum();
    assert!((impulse - 200.0).abs() < 5.0, "{impulse} N s");
    // The other side sees the same, the other way round.
    let victims = victims.lock().unwrap();
    let met = victims.iter().find(|t| t.1 == Partner::Actor { id: hitter, kind: "probe" }).unwrap();
    assert!((met.3 + DVec3::X).length() < 0.01 && (met.4 - 8.0).abs() < 0.1, "{met:?}");
}

#[test]
fn a_collision_that_either_side_lets_pass_does_not_happen() {
    let mut track = TestTrack::new(FLAT, SETTINGS);
    let far = DVec3::new(200.0, 0.5, 0.0);
    let ghostly = |contact: &Contact| matches!(contact.partner, Partner::Actor { .. });
    let (_, ghost, told) = add_probe(&mut track, far, DVec3::X * 8.0, ghostly);
    let (_, crate_, _) = add_probe(&mut track, far + DVec3::X * 3.0, DVec3::ZERO, |_| false);
    (0..30).for_each(|_| track.tick());
    let world = track.arena.world();
    assert!((world.velocity(ghost).unwrap().x - 8.0).abs() < 0.01, "{}", world.velocity(ghost).unwrap());
    assert!(world.velocity(crate_).unwrap().length() < 0.01, "{}", world.velocity(crate_).unwrap());
    let of_crate = |phase| told.lock().unwrap().iter().filter(|t| t.0 == phase && t.2.is_empty()).count();
    assert_eq!((of_crate(Phase::Begin), of_crate(Phase::End)), (1, 1));
}

/// Cars stop on asphalt, and slide where a pair of materials says so.
#[test]
fn an_arena_says_what_pairs_of_materials_are_like() {
    let ice = "\n[[material_pairs]]\nbetween = [\"tyre\", \"asphalt\"]\ncontact = { friction = 0.05 }\n";
    let braked = |text: &str| {
        let mut track = TestTrack::new(text, SETTINGS);
        track.enter(0);
        track.run(1.0, pita_game::Controls::default());
        track.run(3.0, crate::test_track::FULL_THROTTLE);
        track.speed()
    };
    let (dry, icy) = (braked(FLAT), braked(&format!("{FLAT}{ice}")));
    assert!(dry > 10.0 && icy < 0.05 * 9.81 * 3.0 * 1.2, "{dry} and {icy} m/s");
}
