//! The scenes themselves, number by number those of the kit's `scenes.py`.
//!
//! Expressions keep the order of operations that the kit has: sums of floating-point numbers depend on it, and a test
//! compares the result bit by bit.

use pita_sim::{DQuat, DVec3};

use super::scene::{Ball, Beam, Body, Content, Family, Item, Plane, RigidScene, Shape, Wheel};

/// m/s².
const GRAVITY: f64 = 9.81;
/// 10 s.
const TICKS: usize = 300;
/// Coulomb's, of everything but the cars.
const FRICTION: f64 = 0.5;

/// An entry of the catalogue.
struct Entry {
    name: &'static str,
    content: fn() -> Content,
}

const CATALOGUE: &[Entry] = &[
    Entry { name: "pile100", content: || Content::Rigid(Family::Pile, pile(100, 5)) },
    Entry { name: "pile500", content: || Content::Rigid(Family::Pile, pile(500, 10)) },
    Entry { name: "pile1000", content: || Content::Rigid(Family::Pile, pile(1000, 10)) },
    Entry { name: "pilethrown500", content: || Content::Rigid(Family::Pile, thrown(500)) },
    Entry { name: "stack10", content: || Content::Rigid(Family::Stack, stack(10)) },
    Entry { name: "stack20", content: || Content::Rigid(Family::Stack, stack(20)) },
    Entry { name: "sheep100", content: || Content::Rigid(Family::Sheep, sheep(100, 10)) },
    Entry { name: "sheep400", content: || Content::Rigid(Family::Sheep, sheep(400, 20)) },
    Entry { name: "chain", content: || Content::Rigid(Family::Chain, chain()) },
    Entry { name: "cars16", content: || Content::Rigid(Family::Cars, cars(16, 4)) },
    Entry { name: "cars64", content: || Content::Rigid(Family::Cars, cars(64, 8)) },
    Entry { name: "cars128", content: || Content::Rigid(Family::Cars, cars(128, 16)) },
    Entry { name: "spin", content: || Content::Rigid(Family::Spin, spin()) },
    Entry { name: "slope45", content: || Content::Rigid(Family::Stick, slope(0.45)) },
    Entry { name: "slope55", content: || Content::Rigid(Family::Slide, slope(0.55)) },
    Entry { name: "soft", content: || Content::Beam(BEAM) },
];

const BEAM: Beam = Beam {
    ticks: TICKS,
    size: DVec3::new(2.0, 0.4, 0.4),
    cells: [10, 2, 2],
    density: 1000.0,
    young_modulus: 1e7,
    poisson_ratio: 0.3,
};

/// What the scenes are called, in the kit's order.
pub fn names() -> impl Iterator<Item = &'static str> {
    CATALOGUE.iter().map(|entry| entry.name)
}

/// What is in the scene of that name.
pub fn content(name: &str) -> Option<Content> {
    CATALOGUE.iter().find(|entry| entry.name == name).map(|entry| (entry.content)())
}

/// Uniform in [-1, 1): splitmix64 of counter 8 i + k.
fn random(i: usize, k: u64) -> f64 {
    let mut z = (8 * i as u64 + k).wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 * (-52f64).exp2() - 1.0
}

/// A solid box at rest.
fn solid_box(half: DVec3, mass: f64, position: DVec3) -> Body {
    let DVec3 { x, y, z } = half;
    let inertia = DVec3::new(mass / 3.0 * (y * y + z * z), mass / 3.0 * (x * x + z * z), mass / 3.0 * (x * x + y * y));
    at_rest(Shape::Box(half), mass, inertia, position)
}

/// A solid ball at rest.
fn solid_sphere(radius: f64, mass: f64, position: DVec3) -> Body {
    at_rest(Shape::Sphere(radius), mass, DVec3::splat(0.4 * mass * radius * radius), position)
}

fn at_rest(shape: Shape, mass: f64, inertia: DVec3, position: DVec3) -> Body {
    Body {
        shape,
        mass,
        inertia,
        position,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        friction: FRICTION,
        collides: true,
    }
}

/// Turn about y.
fn yaw(angle: f64) -> DQuat {
    DQuat::from_xyzw(0.0, (angle / 2.0).sin(), 0.0, (angle / 2.0).cos())
}

fn turned_about_y(angle: f64, v: DVec3) -> DVec3 {
    let (s, c) = (angle.sin(), angle.cos());
    DVec3::new(c * v.x + s * v.z, v.y, -s * v.x + c * v.z)
}

/// Ground, and nothing on it yet.
fn level(friction: f64) -> RigidScene {
    let items = vec![Item::Plane(Plane { normal: DVec3::Y, friction })];
    RigidScene { ticks: TICKS, gravity: DVec3::new(0.0, -GRAVITY, 0.0), items }
}

fn pile(count: usize, side: usize) -> RigidScene {
    let mut scene = level(FRICTION);
    for i in 0..count {
        let [ix, iz, iy] = [i % side, i / side % side, i / (side * side)];
        let offset = 0.35 * (iy % 2) as f64 - 0.35 * (side - 1) as f64;
        let x = 0.7 * ix as f64 + offset + 0.07 * random(i, 0);
        let z = 0.7 * iz as f64 + offset + 0.07 * random(i, 1);
        let cube = solid_box(DVec3::splat(0.25), 0.125, DVec3::new(x, 1.0 + 0.7 * iy as f64, z));
        scene.items.push(Item::Body(Body { rotation: yaw(0.1 * random(i, 2)), ..cube }));
    }
    scene
}

fn thrown(count: usize) -> RigidScene {
    let mut scene = level(FRICTION);
    for i in 0..count {
        let [ix, iz, iy] = [i % 10, i / 10 % 10, i / 100].map(|n| n as f64);
        let [w, x, y, z] = [3, 4, 5, 6].map(|k| random(i, k));
        let length = (w * w + x * x + y * y + z * z).sqrt();
        let across = |n: f64, k: u64| 0.95 * (n - 4.5) + 0.07 * random(i, k);
        let position = DVec3::new(across(ix, 0), 1.2 + 0.95 * iy, across(iz, 1));
        scene.items.push(Item::Body(Body {
            rotation: DQuat::from_xyzw(x / length, y / length, z / length, w / length),
            velocity: DVec3::new(0.0, -10.0, 0.0),
            angular_velocity: DVec3::from_array([0, 1, 2].map(|k| 10.0 * random(i + count, k))),
            ..solid_box(DVec3::splat(0.25), 0.125, position)
        }));
    }
    scene
}

fn stack(count: usize) -> RigidScene {
    let mut scene = level(FRICTION);
    for i in 0..count {
        let cube = solid_box(DVec3::splat(0.5), 1000.0, DVec3::new(0.0, 0.5 + i as f64, 0.0));
        scene.items.push(Item::Body(cube));
    }
    scene
}

fn sheep(count: usize, side: usize) -> RigidScene {
    let mut scene = level(FRICTION);
    let middle = (side - 1) as f64 / 2.0;
    for i in 0..count {
        let angle = 0.1 * random(i, 0);
        let velocity = DVec3::new(0.5 * random(i, 1), 0.0, 0.5 * random(i, 2));
        let origin = DVec3::new(1.5 * ((i % side) as f64 - middle), 1.8, 1.2 * ((i / side) as f64 - middle));
        let part = |half: [f64; 3], mass, at: [f64; 3]| {
            let position = origin + turned_about_y(angle, DVec3::from_array(at));
            Item::Body(Body { rotation: yaw(angle), velocity, ..solid_box(half.into(), mass, position) })
        };
        let body = 4 * i;
        let joint = |b, point_a: [f64; 3], point_b: [f64; 3]| {
            Item::Ball(Ball { a: Some(body), b, point_a: point_a.into(), point_b: point_b.into() })
        };
        scene.items.extend([
            part([0.5, 0.3, 0.25], 40.0, [0.0, 0.0, 0.0]),
            part([0.175, 0.175, 0.175], 5.0, [0.675, 0.3, 0.0]),
            part([0.075, 0.25, 0.075], 3.0, [0.35, -0.55, 0.0]),
            part([0.075, 0.25, 0.075], 3.0, [-0.35, -0.55, 0.0]),
            joint(body + 1, [0.5, 0.2, 0.0], [-0.175, -0.1, 0.0]),
            joint(body + 2, [0.35, -0.3, 0.0], [0.0, 0.25, 0.0]),
            joint(body + 3, [-0.35, -0.3, 0.0], [0.0, 0.25, 0.0]),
        ]);
    }
    scene
}

fn chain() -> RigidScene {
    const LINKS: usize = 20;
    const LENGTH: f64 = 0.25;
    let (r, m) = (0.03, 0.5);
    let h = LENGTH / 2.0 - r;
    // A cylinder and two half spheres of one density.
    let cylinder = m * 2.0 * h / (2.0 * h + 4.0 * r / 3.0);
    let spheres = m * (4.0 * r / 3.0) / (2.0 * h + 4.0 * r / 3.0);
    let along = cylinder * r * r / 2.0 + spheres * 0.4 * r * r;
    let across = cylinder * (r * r / 4.0 + h * h / 3.0) + spheres * (0.4 * r * r + h * h + 0.75 * r * h);
    let end = DVec3::new(LENGTH / 2.0, 0.0, 0.0);

    let mut scene = RigidScene { items: Vec::new(), ..level(FRICTION) };
    for i in 0..LINKS {
        let link = at_rest(
            Shape::Capsule { radius: r, half_length: h },
            m,
            DVec3::new(along, across, across),
            DVec3::new(LENGTH * (i as f64 + 0.5), 0.0, 0.0),
        );
        let (a, point_a) = if i == 0 { (None, DVec3::ZERO) } else { (Some(i - 1), end) };
        let point_b = DVec3::new(-end.x, 0.0, 0.0);
        scene.items.push(Item::Body(Body { collides: false, ..link }));
        scene.items.push(Item::Ball(Ball { a, b: i, point_a, point_b }));
    }
    let radius = 0.5;
    let weight = solid_sphere(radius, 500.0, DVec3::new(LENGTH * LINKS as f64 + radius, 0.0, 0.0));
    let point_b = DVec3::new(-radius, 0.0, 0.0);
    scene.items.push(Item::Body(Body { collides: false, ..weight }));
    scene.items.push(Item::Ball(Ball { a: Some(LINKS - 1), b: LINKS, point_a: end, point_b }));
    scene
}

fn cars(count: usize, row: usize) -> RigidScene {
    const SPEED: f64 = 15.0;
    const RADIUS: f64 = 0.35;
    const STEER: f64 = 0.065;
    let mut scene = level(1.0);
    // Starts at the sag that it has at rest.
    let sag = 1200.0 * GRAVITY / 4.0 / 40e3;
    let velocity = DVec3::new(SPEED, 0.0, 0.0);
    for i in 0..count {
        let chassis = 5 * i;
        let origin = DVec3::new(8.0 * (i % row) as f64, RADIUS + 0.5 - sag, 6.0 * (i / row) as f64);
        let shell = solid_box(DVec3::new(2.0, 0.5, 0.9), 1200.0, origin);
        scene.items.push(Item::Body(Body { velocity, friction: 1.0, ..shell }));
        for corner in 0..4 {
            let (x, z) = ([1.3, -1.3][corner / 2], [0.8, -0.8][corner % 2]);
            let is_front = corner < 2;
            let steer = if is_front { STEER } else { 0.0 };
            let tyre = solid_sphere(RADIUS, 25.0, DVec3::new(origin.x + x, RADIUS, origin.z + z));
            scene.items.push(Item::Body(Body {
                rotation: yaw(steer),
                velocity,
                angular_velocity: turned_about_y(steer, DVec3::new(0.0, 0.0, -SPEED / RADIUS)),
                friction: 1.0,
                ..tyre
            }));
            scene.items.push(Item::Wheel(Wheel {
                chassis,
                wheel: chassis + 1 + corner,
                hub: DVec3::new(x, -0.5, z),
                steer,
                stiffness: 40e3,
                damping: 4e3,
                torque_max: if is_front { 0.0 } else { 400.0 },
                target_speed: -SPEED / RADIUS,
                gain: 100.0,
            }));
        }
    }
    scene
}

fn spin() -> RigidScene {
    let body = Body {
        angular_velocity: DVec3::new(0.01, 5.0, 0.01),
        collides: false,
        ..at_rest(Shape::Sphere(0.5), 1.0, DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO)
    };
    RigidScene { ticks: 1800, gravity: DVec3::ZERO, items: vec![Item::Body(body)] }
}

fn slope(tangent: f64) -> RigidScene {
    let angle = tangent.atan();
    let normal = DVec3::new(angle.sin(), angle.cos(), 0.0);
    let rotation = DQuat::from_xyzw(0.0, 0.0, -(angle / 2.0).sin(), (angle / 2.0).cos());
    let cube = Body { rotation, ..solid_box(DVec3::splat(0.5), 1000.0, 0.5 * normal) };
    let plane = Plane { normal, friction: FRICTION };
    let items = vec![Item::Plane(plane), Item::Body(cube)];
    RigidScene { ticks: 90, items, ..level(FRICTION) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hashes of the scenes as they are in the kit.
    const GOLDEN: &[(&str, &str)] = &[
        ("pile100", "7eb567b1be98d643"),
        ("pile500", "cfe5e3029320dbe6"),
        ("pile1000", "5b37fb65a7428fae"),
        ("pilethrown500", "dcbde15709dcccea"),
        ("stack10", "afc671f4325e41a4"),
        ("stack20", "02a5ca246efa36ce"),
        ("sheep100", "1e8d8670236c704e"),
        ("sheep400", "7fd343d5dabf09f8"),
        ("chain", "fcc0471aaa946d5d"),
        ("cars16", "6434427892aa8556"),
        ("cars64", "67d12d9a98bf1b41"),
        ("cars128", "d5175c04805cc9b1"),
        ("spin", "348e9f66e23c0206"),
        ("slope45", "c40195ac5a5d5cc8"),
        ("slope55", "7da37ba8f8ebfccf"),
    ];

    /// Numbers to nine decimals: mathematical libraries may differ in the last bit of a sine.
    fn hash(scene: &RigidScene) -> String {
        let rounded = |word: &str| match word.parse::<f64>() {
            // Adding 0 turns -0 into 0.
            Ok(number) => format!("{:.9}", (number * 1e9).round() / 1e9 + 0.0),
            Err(_) => word.to_owned(),
        };
        let text: Vec<String> = scene.to_string().split_whitespace().map(rounded).collect();
        blake3::hash(text.join(" ").as_bytes()).to_hex()[..16].to_owned()
    }

    #[test]
    fn scenes_are_the_golden_ones() {
        let hashes = names().filter_map(|name| match content(name)? {
            Content::Rigid(_, scene) => Some((name, hash(&scene))),
            Content::Beam(_) => None,
        });
        let hashes: Vec<_> = hashes.collect();
        let golden: Vec<_> = GOLDEN.iter().map(|&(name, hash)| (name, hash.to_owned())).collect();
        assert_eq!(hashes, golden);
    }

    #[test]
    fn a_scene_is_a_scene_file() {
        for name in names() {
            let Some(Content::Rigid(_, scene)) = content(name) else { continue };
            let read = pita_game::scene::Scene::parse(&scene.to_string(), &pita_sim::Settings::at(1.0 / 30.0)).unwrap();
            assert_eq!((read.ticks, read.bodies.len()), (scene.ticks, scene.bodies().count()), "{name}");
        }
    }

    #[test]
    fn the_beam_has_the_nodes_and_the_mass_that_the_kit_says() {
        assert_eq!(BEAM.nodes(), 99);
        assert!((BEAM.mass() - 320.0).abs() < 1e-9);
    }
}
