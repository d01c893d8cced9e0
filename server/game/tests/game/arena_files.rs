//! Arena files, good and bad.

use pita_game::arena_file::{ArenaFile, PrecisionFile, extremes, with_parameters};
use pita_game::vehicle::VehicleParameters;
use pita_game::{ActorKinds, Arena, ArenaError, Supplies};
use pita_sim::{DVec3, Method, QueryFilter, Shape, SolverSettings};

use crate::test_track::{FLAT, SETTINGS};

/// What loading `text` says.
fn refusal(text: &str) -> String {
    match Arena::from_toml(text, &SETTINGS) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn shipped_files_load() {
    for text in [Arena::DEFAULT, FLAT] {
        assert_eq!(refusal(text), "accepted");
    }
    let arena = Arena::from_toml(Arena::DEFAULT, &SETTINGS).expect("checked above");
    assert_eq!((arena.name(), arena.title()), ("proving-ground", "Proving ground"));
}

#[test]
fn arenas_choose_their_solver() {
    let text = FLAT.replacen("[materials", "[solver]\nmethod = \"sor\"\nsweeps = 9\nbudget = 77\n[materials", 1);
    let arena = Arena::from_toml(&text, &SETTINGS).expect("a good file");
    let solver = &arena.world().settings().solver;
    assert_eq!((solver.method, solver.sweeps, solver.budget), (Method::Sor, 9, Some(77)));
    assert_eq!(solver.relaxation, SolverSettings::default().relaxation);
}

#[test]
fn arenas_choose_when_things_sleep() {
    let with = |keys: &str| {
        Arena::from_toml(&FLAT.replacen("[materials", &format!("[sleep]\n{keys}\n[materials"), 1), &SETTINGS)
    };
    let sleep = |keys: &str| with(keys).expect("a good file").world().settings().sleep.clone();
    assert_eq!(sleep("time = 2").map(|sleep| (sleep.time, sleep.linear_speed)), Some((2.0, 0.01)));
    assert_eq!(sleep("enabled = false"), None);
    let Err(error) = with("time = -1") else { panic!("accepted") };
    assert!(error.to_string().contains("sleep.time is -1"), "{error}");
}

#[test]
fn arenas_choose_how_fine_they_are_sent() {
    let with =
        |tables: &str| Arena::from_toml(&FLAT.replacen("[materials", &format!("{tables}\n[materials"), 1), &SETTINGS);
    let small = "[bounds]\nmin = [-200, -20, -200]\nmax = [200, 100, 1000]";
    let precision =
        with(&format!("{small}\n[precision]\nsteps_per_m = 20000\njoint_steps = 500")).map(|a| a.precision());
    let expected = PrecisionFile { steps_per_m: Some(20_000), rotation_steps: None, joint_steps: Some(500) };
    assert_eq!(precision, Ok(expected));
    assert_eq!(with("").map(|arena| arena.precision()), Ok(PrecisionFile::default()));
    let Err(error) = with("[precision]\nsteps_per_m = 70000") else { panic!("accepted") };
    assert_eq!(error.to_string(), "precision.steps_per_m is 70000, allowed: 10 to 65536 steps a metre");
}

#[test]
fn parameters_are_chosen_by_who_runs_the_arena() {
    let text = FLAT.replace("count = [8, 8]", "count = [\"$rows\", 2]");
    let text = format!("{text}\n[parameters.rows]\ndefault = 3\nmin = 1\nmax = 5\n");
    let load = |given: &[(&str, i64)]| {
        let given = given.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        with_parameters(&text, &given).and_then(|text| ArenaFile::parse(&text))
    };
    assert_eq!(load(&[]).unwrap().spawn_grids[0].count, [3, 2]);
    assert_eq!(load(&[("rows", 5)]).unwrap().spawn_grids[0].count, [5, 2]);
    let refusal = |given: &[(&str, i64)]| load(given).err().map(|error| error.to_string()).unwrap_or_default();
    assert_eq!(refusal(&[("rows", 6)]), "parameters.rows is 6, allowed: 1 to 5");
    assert_eq!(refusal(&[("lines", 2)]), "parameters is lines, allowed: one of rows");
    let unknown = ArenaFile::parse(&text.replace("$rows", "$rovs")).err().map(|error| error.to_string());
    assert!(unknown.is_some_and(|error| error.contains("invalid type: string \"$rovs\"")));
}

#[test]
fn parameters_are_known_by_their_ends() {
    let parameter = |name: &str, [default, min, max]: [i64; 3]| {
        format!("[parameters.{name}]\ndefault = {default}\nmin = {min}\nmax = {max}\n")
    };
    let text = format!("{FLAT}\n{}{}", parameter("cars", [6, 0, 128]), parameter("storm", [0, 0, 1]));
    let chosen = |given: &[(&str, i64)]| given.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
    let expected: [std::collections::BTreeMap<String, i64>; 4] = [
        chosen(&[("cars", 0)]),
        chosen(&[("cars", 128)]),
        chosen(&[("storm", 1)]),
        chosen(&[("cars", 128), ("storm", 1)]),
    ];
    assert_eq!(extremes(&text).unwrap(), expected);
    assert!(extremes(FLAT).unwrap().is_empty());
}

/// Replacement in the flat arena's file, and what the error has to say.
const BAD: &[(&str, &str, &[&str])] = &[
    ("name = \"flat\"", "name = \"Flat Arena\"", &["name is Flat Arena", "1 to 32 of a-z 0-9 - _"]),
    ("title = \"Flat ground\"", "title = \"\"", &["title", "1 to 64 bytes"]),
    ("max_players = 64", "max_players = 0", &["max_players is 0", "1 to 1024 players"]),
    ("max_players = 64", "max_players = 1025", &["max_players is 1025", "1 to 1024 players"]),
    ("max_players = 64", "max_players = -1", &["line 5, column 15"]),
    ("max_players = 64", "max_players = 64\ngravity = nan", &["gravity is NaN", "0 to 100 m/s^2"]),
    ("[materials", "[bounds]\nmin = [0, 0, 0]\nmax = [9, -1, 9]\n[materials", &["bounds.max[1] is -1", "0 to 5000 m"]),
    (
        "[materials",
        "[bounds]\nmin = [-9, 0, -9]\nmax = [9, 9, 9]\n[materials",
        &["spawn_grids[0].corner[0] is -28", "-7.47", "a whole car is within the bounds"],
    ),
    ("[materials", "[precision]\nsteps_per_m = 9\n[materials", &["precision.steps_per_m is 9", "10 to 65536"]),
    ("[materials", "[precision]\nrotation_steps = 9000\n[materials", &["rotation_steps is 9000", "64 to 8192 steps"]),
    ("[materials", "[precision]\njoint_steps = 70000\n[materials", &["joint_steps is 70000", "10 to 65536"]),
    ("[materials", "[precision]\nrate = 1\n[materials", &["unknown field `rate`", "steps_per_m"]),
    (
        "[materials",
        "[solver]\nmethod = \"newtn\"\n[materials",
        &["line 8, column 10", "method \"newtn\" is unknown", "sor"],
    ),
    (
        "[materials",
        "[solver]\nmetod = \"newton\"\n[materials",
        &["line 8, column 1", "unknown field `metod`", "method"],
    ),
    ("[materials", "[solver]\nrelaxation = 2\n[materials", &["settings: solver.relaxation is 2", "above 0, below 2"]),
    ("[materials", "[solver]\niterations = 0\n[materials", &["settings: solver.iterations is 0", "1 to 100000"]),
    ("max_players = 64", "max_playerz = 64", &["line 5, column 1", "unknown field `max_playerz`", "max_players"]),
    ("max_players = 64", "", &["missing field `max_players`"]),
    ("friction = 1.0", "friction = -0.5", &["materials.asphalt.friction is -0.5", "0 to 5"]),
    ("friction = 1.0", "friction = inf", &["materials.asphalt.friction is inf", "0 to 5"]),
    ("friction = 1.0", "friction = 1.0\nrestitution = 1.5", &["materials.asphalt.restitution is 1.5", "0 to 1"]),
    (
        "friction = 1.0",
        "friction = 1.0\nrolling_resistance = nan",
        &["materials.asphalt.rolling_resistance is NaN", "0 to 1 m"],
    ),
    ("[materials.asphalt]", "[materials.tyre]", &["materials is \"tyre\"", "other than chassis and tyre"]),
    ("friction = 1.0", "friction = \"much\"", &["line 8, column 12", "invalid type: string \"much\""]),
    ("material = \"asphalt\"", "material = \"ice\"", &["statics[0].material is ice", "one of asphalt"]),
    (
        "shape.half_space = {}",
        "shape.box.half = [1.0, 0.0, 1.0]",
        &["statics[0].shape.box.half[1] is 0", "0.02 to 5000 m"],
    ),
    ("shape.half_space = {}", "shape.box.half = [1.0, 1.0]", &["line 11", "length 3"]),
    ("shape.half_space = {}", "shape.cone.half = 1.0", &["line 11, column 7", "unknown variant `cone`"]),
    ("shape.half_space = {}", "shape.ball.radius = nan", &["statics[0].shape.ball.radius is NaN", "0.02 to 5000 m"]),
    (
        "shape.half_space = {}",
        "shape.half_space = {}\nposition = [0, 1e9, 0]",
        &["statics[0].position[1]", "-5000 to 5000 m"],
    ),
    ("shape.half_space = {}", "shape.half_space = {}\npitch = 400", &["statics[0].pitch is 400", "-360 to 360 deg"]),
    ("count = [8, 8]", "count = [0, 8]", &["spawn_grids[0].count[0] is 0", "1 to 4096 points"]),
    ("count = [8, 8]", "count = [100, 100]", &["spawn_grids[0].count is 10000", "1 to 4096 spawn points"]),
    ("spacing = [8.0, 6.0]", "spacing = [8.0, -6.0]", &["spawn_grids[0].spacing[1] is -6", "0 to 1000 m"]),
    ("[[spawn_grids]]\ncount = [8, 8]\nspacing = [8.0, 6.0]", "", &["spawns is 0", "1 to 4096 spawn points"]),
];

#[test]
fn a_bad_file_is_refused_with_key_value_and_range() {
    let files = BAD.iter().map(|(good, bad, expected)| {
        assert!(FLAT.contains(good), "{good} is not in the file any more");
        (FLAT.replace(good, bad), *bad, *expected)
    });
    assert_refused(files);
}

/// Each of (text, what is bad in it, what the error has to say).
fn assert_refused<'a>(files: impl Iterator<Item = (String, &'a str, &'a [&'a str])>) {
    let mut wrong = String::new();
    for (text, bad, expected) in files {
        let said = refusal(&text);
        for part in expected.iter().filter(|part| !said.contains(**part)) {
            wrong += &format!("{bad}\nsaid:     {said}\nexpected: {part}\n\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Text behind the flat arena's file, and what the error has to say.
const BAD_ADDITIONS: &[(&str, &[&str])] = &[
    (
        "[[material_pairs]]\nbetween = [\"asphalt\", \"ice\"]\ncontact.friction = 0.1",
        &["material_pairs[0].between[1] is ice", "one of chassis, tyre, asphalt"],
    ),
    (
        "[[material_pairs]]\nbetween = [\"asphalt\", \"tyre\"]\ncontact.friction = 9",
        &["material_pairs[0].contact.friction is 9", "0 to 5"],
    ),
    (
        "[[material_pairs]]\nbetween = [\"asphalt\", \"tyre\"]\ncontact.friction = 1\n\
         [[material_pairs]]\nbetween = [\"tyre\", \"asphalt\"]\ncontact.friction = 2",
        &["material_pairs[1].between is tyre, asphalt", "no entry yet"],
    ),
    ("[vehicle]\nchassis_mass = 0", &["vehicle.chassis_mass is 0", "50 to 50000 kg"]),
    ("[vehicle]\nwheel_rounding = 0.5", &["vehicle.wheel_rounding is 0.5", "0 to 0.108 m"]),
    ("[vehicle]\ntrack = 5\nwheelbase = 1", &["vehicle.steering.max_deg is 35", "0 to 19 deg"]),
    (
        "[vehicle.engine]\ntorque = [[1000, 9], [1000, 9]]",
        &["vehicle.engine.torque[1][0] is 1000", "1001 to 100000 rpm"],
    ),
    ("[vehicle.engine]\ntorque = []", &["vehicle.engine.torque is 0", "1 to 32 points"]),
    ("[vehicle.gearbox]\nratios = [3, 3]", &["vehicle.gearbox.ratios[1] is 3", "0.05 to 2.99"]),
    ("[vehicle.gearbox]\ndown_rpm = 6000", &["vehicle.gearbox.down_rpm is 6000", "0 to 4180 rpm"]),
    ("[vehicle.differential]\nfront = \"shut\"", &["unknown variant `shut`", "`limited`"]),
    ("[vehicle]\nwings = 2", &["unknown field `wings`"]),
    ("[vehicle]\ndrive = \"sails\"", &["unknown variant `sails`", "`rear`"]),
    ("[[spawns]]\nposition = [0, nan, 0]", &["spawns[0].position[1] is NaN", "a whole car"]),
    (
        "[[spawns]]\nposition = [0, 49.8, 0]\n[bounds]\nmin = [-99, -9, -99]\nmax = [99, 50, 99]",
        &["spawns[0].position[1] is 49.8", "-9 to 49.", "a whole car is within the bounds"],
    ),
    (
        "[[spawns]]\nposition = [98, 0, 0]\n[bounds]\nmin = [-99, -9, -99]\nmax = [99, 50, 99]",
        &["spawns[0].position[0] is 98", "a whole car is within the bounds"],
    ),
    (
        "[[spawns]]\nposition = [90, 3, 0]\n[[statics]]\nshape.box.half = [5, 0.1, 5]\nmaterial = \"asphalt\"\nposition = [90, 3.7, 0]",
        &["spawns[0].position is [90, 3, 0]", "where a car has room"],
    ),
    (
        "[[statics]]\nshape.box.half = [0.1, 5, 0.1]\nmaterial = \"asphalt\"\nposition = [-28, 0, -15]",
        &["spawn_grids[0].point[1] is [-28, 0, -15]", "where a car has room"],
    ),
    (
        "[[actors]]\nkind = \"jelly\"\nmaterial = \"asphalt\"\ncells = [6, 6, 6]\nposition = [0, 0, 0]\ncopies = [128, 1, 128]\nspacing = [9, 0, 9]",
        &["actors[0]", "at most 65536 coordinates in all", "fewer copies"],
    ),
    (
        "[[actors]]\nkind = \"prop\"\nshape.half_space = {}\nmaterial = \"asphalt\"\nmass = 1\nposition = [0, 0, 0]",
        &["actors[0].shape is half_space", "box, ball, capsule or cylinder"],
    ),
    (
        "[[actors]]\nkind = \"prop\"\nshape.ball.radius = 1\nmaterial = \"asphalt\"\nmass = 1\nposition = [0, 0, 0]\ncopies = [4096, 4096, 4096]",
        &["actors[0].copies is 68719476736", "0 to 16384 actors in all"],
    ),
    (
        "[[actors]]\nkind = \"fence\"\nmaterial = \"asphalt\"\nboards = 64\nposition = [0, 0, 0]\ncopies = [1, 1, 1100]",
        &["actors[0]", "at most 65536 bodies"],
    ),
    ("[[actors]]\nkind = \"unicorn\"\nposition = [0, 0, 0]", &["actors[0].kind is unicorn", "one of", "prop"]),
    (
        "[[actors]]\nkind = \"prop\"\nposition = [0, 0, 0]\nshape.ball.radius = 1\nmaterial = \"asphalt\"\nmass = 1\nwings = 2",
        &["actors[0], of kind prop", "unknown field `wings`", "mass"],
    ),
    (
        "[[actors]]\nkind = \"prop\"\nposition = [0, 0, 0]\nshape.ball.radius = 1\nmaterial = \"asphalt\"\nmass = \"heavy\"",
        &["actors[0], of kind prop", "invalid type: string \"heavy\"", "mass"],
    ),
    (
        "[[actors]]\nkind = \"prop\"\nposition = [0, 0, 0]\nshape.ball.radius = 1\nmaterial = \"asphalt\"\nmass = 0",
        &["actors[0].mass is 0", "0.01 to 1000000 kg"],
    ),
    ("[[actors]]\nkind = \"prop\"\nposition = [0, -99, 0]", &["actors[0].position[1] is -99", "the bounds"]),
    ("[[actors]]\nkind = \"prop\"", &["missing field `position`"]),
    (
        "[[drivers]]\nname = \"x\"\nroute = \"moon\"\nspeed = 9",
        &["drivers[0].route is moon", "a name from [routes], which is empty"],
    ),
    ("[routes.a]\ncorners = [[0, 0]]", &["routes.a.corners is 1", "2 to 1024 corners"]),
    (
        "[routes.a]\ncorners = [[0, 0], [9, 0]]\n[[drivers]]\nname = \"x\"\nroute = \"a\"\nspeed = 9\nstart = 2",
        &["drivers[0].start is 2", "0 to 1"],
    ),
    ("[[[", &["line 18, column 3"]),
];

#[test]
fn a_bad_addition_is_refused_with_key_value_and_range() {
    assert_refused(BAD_ADDITIONS.iter().map(|(bad, expected)| (format!("{FLAT}\n{bad}\n"), *bad, *expected)));
}

#[test]
fn a_file_that_is_too_long_is_not_read() {
    let said = refusal(&" ".repeat((1 << 20) + 1));
    assert!(said.contains("length of the file is 1048577") && said.contains("1 to 1048576 bytes"), "{said}");
}

#[test]
fn settings_are_checked_too() {
    let settings = pita_game::ArenaSettings { tick_hz: 0, ..SETTINGS };
    let Err(error) = Arena::from_toml(FLAT, &settings) else { panic!("accepted") };
    assert!(matches!(&error, ArenaError::OutOfRange { key, .. } if key == "tick_hz"), "{error}");
}

#[test]
fn the_default_arena_explains_every_key_of_the_vehicle() {
    let all = toml::Table::try_from(VehicleParameters::default()).expect("plain numbers");
    let file: toml::Table = Arena::DEFAULT.parse().expect("it loads");
    for (key, value) in &all {
        assert_eq!(file["vehicle"][key], *value, "{key} is said to be the default");
    }
    let start = Arena::DEFAULT.find("[vehicle]").expect("there is one");
    let lines = Arena::DEFAULT[start..].lines().take_while(|line| !line.starts_with("# ---"));
    for line in lines.filter(|line| line.contains(" = ")) {
        let explained = line.split_once('#').is_some_and(|(_, comment)| comment.contains(':'));
        assert!(explained, "{line} has no range");
    }
}

/// A mesh is read from beside the arena's file, carries what drives on it, and is refused by name.
#[test]
fn statics_may_be_meshes() {
    let with = |mesh: &str| {
        let piece = format!("[[statics]]\nmesh = \"{mesh}\"\nmaterial = \"asphalt\"\nposition = [0.0, 2.0, 0.0]\n");
        FLAT.replacen("[[statics]]", &format!("{piece}[[statics]]"), 1)
    };
    let square = "v -9 0 -9\nv 9 0 -9\nv -9 0 9\nv 9 0 9\nf 1 3 4 2\n";
    let reads = std::cell::Cell::new(0);
    let read = |name: &str| match name {
        "level/square.obj" => {
            reads.set(reads.get() + 1);
            Ok(square.as_bytes().to_vec())
        }
        _ => Err("no such file".to_owned()),
    };
    let supplies = Supplies { kinds: &ActorKinds::none(), read: &read };
    let load = |mesh: &str| Arena::from_toml_with(&with(mesh), &SETTINGS, &supplies).map_err(|error| error.to_string());
    let arena = load("level/square.obj").expect("a good file");
    assert!(matches!(&arena.statics()[0].shape, Shape::Mesh(mesh) if mesh.triangles().len() == 2));
    // However many statics are made of it, it is read once.
    let (one, before) = (with("level/square.obj"), reads.get());
    let piece = &one[one.find("[[statics]]").unwrap()..one.rfind("[[statics]]").unwrap()];
    let many = one.replacen(piece, &piece.repeat(50), 1);
    let arena = Arena::from_toml_with(&many, &SETTINGS, &supplies).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((arena.statics().len(), reads.get() - before), (51, 1));
    for (mesh, expected) in [
        ("square.obj", "statics[0].mesh is square.obj, allowed: a readable file (no such file)"),
        ("../square.obj", "statics[0].mesh is ../square.obj, allowed: a path below"),
        ("/etc/passwd", "allowed: a path below"),
        ("level//square.obj", "allowed: a path below"),
    ] {
        let error = load(mesh).err().unwrap_or_default();
        assert!(error.contains(expected), "{error}, expected: {expected}");
    }
    assert!(refusal(&with("level/square.obj")).contains("no file of this name comes with the game"));
    let both = with("a.obj").replacen("mesh =", "shape.half_space = {}\nmesh =", 1);
    assert!(refusal(&both).contains("either shape or mesh"), "{}", refusal(&both));
}

/// Free-form deformation of what never moves: a box is scaled and twisted from its foot up, a mesh is bent to an arc, and both
/// collide where they are then.
#[test]
fn statics_may_be_warped() {
    let pieces = "[[statics]]\nshape.box.half = [1.0, 1.0, 0.5]\nwarp = { scale = [1, 2, 1], twist = 0.3926990816987241 }\n\
                  material = \"asphalt\"\nposition = [20.0, 1.0, 40.0]\n\
                  [[statics]]\nmesh = \"wall.obj\"\nwarp = { bend = [0.25, 0] }\nmaterial = \"asphalt\"\nposition = [40.0, 0.0, 40.0]\n";
    let wall: String = (0..=8).map(|i| format!("v 0 {0} -2\nv 0 {0} 2\n", i)).collect();
    let faces: String =
        (0..8).map(|i| format!("f {} {} {} {}\n", 2 * i + 1, 2 * i + 2, 2 * i + 4, 2 * i + 3)).collect();
    let wall = wall + &faces;
    let read = |_: &str| Ok(wall.as_bytes().to_vec());
    let supplies = Supplies { kinds: &ActorKinds::none(), read: &read };
    let text = |pieces: &str| FLAT.replacen("[[statics]]", &format!("{pieces}[[statics]]"), 1);
    let load = |pieces: &str| Arena::from_toml_with(&text(pieces), &SETTINGS, &supplies);
    let arena = load(pieces).unwrap_or_else(|e| panic!("{e}"));
    let Shape::Hull { points, .. } = &arena.statics()[0].shape else { panic!("{:?}", arena.statics()[0].shape) };
    // 4 m high now, and a quarter turn from foot to top.
    let has = |wanted: DVec3| points.iter().any(|point| point.distance(wanted) < 1e-9);
    assert!(has(DVec3::new(1.0, -1.0, 0.5)) && has(DVec3::new(0.5, 3.0, -1.0)), "{points:?}");
    let Shape::Mesh(mesh) = &arena.statics()[1].shape else { panic!("{:?}", arena.statics()[1].shape) };
    // An arc of 8 m and 4 m of radius.
    let tip = DVec3::new(4.0 - 4.0 * 2.0f64.cos(), 4.0 * 2.0f64.sin(), 2.0);
    assert!(mesh.vertices().iter().any(|point| point.distance(tip) < 1e-6), "{:?}", mesh.vertices());
    let hit = arena.world().ray_cast(DVec3::new(30.0, 3.6, 40.0), DVec3::X, 20.0, &QueryFilter::ALL).unwrap();
    let at = hit.expect("the wall leans over").point;
    assert!((at.x - 44.0 + 4.0 * 0.9f64.asin().cos()).abs() < 0.1, "{at}");
    for (bad, expected) in [
        (pieces.replace("box.half = [1.0, 1.0, 0.5]", "ball.radius = 1"), "statics[0].warp is of what has no corners"),
        (pieces.replace("bend = [0.25, 0]", "bend = [0, 2]"), "statics[1].warp.bend[1] is 2, allowed: -1 to 1 rad/m"),
        (pieces.replace("[1, 2, 1]", "[1, 0, 1]"), "statics[0].warp.scale[1] is 0, allowed: 0.1 to 10"),
    ] {
        let error = load(&bad).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(expected), "{error}, expected: {expected}");
    }
}

/// Every copy of a mesh is in the description that clients join with.
#[test]
fn triangles_are_counted_with_copies() {
    let piece = "[[statics]]\nmesh = \"square.obj\"\nmaterial = \"asphalt\"\ncopies = [4096, 1, 1]\n";
    let text = FLAT.replacen("[[spawn_grids]]", &format!("{piece}[[spawn_grids]]"), 1);
    let text = text.replacen("[[statics]]\nshape.half_space = {}\nmaterial = \"asphalt\"\n", "", 1);
    let hexagon = "v 3 0 0\nv 2 0 3\nv -2 0 3\nv -3 0 0\nv -2 0 -3\nv 2 0 -3\nv 1 0 -4\nf 1 7 6 5 4 3 2\n";
    let supplies = Supplies { kinds: &ActorKinds::none(), read: &|_| Ok(hexagon.as_bytes().to_vec()) };
    let Err(error) = Arena::from_toml_with(&text, &SETTINGS, &supplies) else { panic!("accepted") };
    assert!(error.to_string().starts_with("statics[0].mesh is 20480, allowed: 1 to 16384 triangles"), "{error}");
}

/// What would be lost where it is placed is refused.
#[test]
fn actors_are_within_the_bounds_with_all_that_is_theirs() {
    let bounds = "[bounds]\nmin = [-100.0, -20.0, -100.0]\nmax = [100.0, 80.0, 100.0]\n";
    let fence = "[[actors]]\nkind = \"fence\"\nmaterial = \"asphalt\"\nboards = 64\nposition = [0.0, 0.0, 50.0]\n";
    let said = refusal(&format!("{FLAT}{bounds}{fence}"));
    assert!(said.starts_with("actors[0]: ") && said.contains("bounds"), "{said}");
    assert_eq!(refusal(&format!("{FLAT}{bounds}{}", fence.replace("64", "40"))), "accepted");
}
