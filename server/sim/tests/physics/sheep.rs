//! The sheep, the talk's worked example: a body, a head and two legs on three ball joints (yardstick, `sheepN`). Its parts
//! are defined here, once for every form, and the form in independent coordinates is tested.

use std::sync::Arc;

use pita_sim::mass::{Density, MassProperties};
use pita_sim::{
    Anchor, Articulated, BallJointDesc, BodyId, Collider, DQuat, DVec3, FigureDesc, JointDesc, JointKind, PartCollider,
    PartDesc, PartPoint, Settings, Shape, World,
};

use super::{DT, ground, weightless, world};

/// A box of the sheep. Part frames have their origin at the centre and are parallel where the sheep stands.
pub struct SheepPart {
    pub name: &'static str,
    /// Half of the edges, m.
    pub half: DVec3,
    /// kg.
    pub mass: f64,
    /// Where the centre is from that of the body, m.
    pub centre: DVec3,
    /// Its ball joint in the body's frame and in its own, m; the body has none.
    pub joint: Option<[DVec3; 2]>,
}

/// Indices of the parts.
pub const HEAD: u32 = 1;

/// Where it is held when it hangs, in the head's frame, m.
pub const EAR: DVec3 = DVec3::new(0.0, 0.175, 0.1);

/// Body, head, front leg and hind leg.
pub const PARTS: [SheepPart; 4] = [
    SheepPart { name: "body", half: DVec3::new(0.5, 0.3, 0.25), mass: 40.0, centre: DVec3::ZERO, joint: None },
    SheepPart {
        name: "head",
        half: DVec3::splat(0.175),
        mass: 5.0,
        centre: DVec3::new(0.675, 0.3, 0.0),
        joint: Some([DVec3::new(0.5, 0.2, 0.0), DVec3::new(-0.175, -0.1, 0.0)]),
    },
    leg("front leg", 0.35),
    leg("hind leg", -0.35),
];

const fn leg(name: &'static str, x: f64) -> SheepPart {
    SheepPart {
        name,
        half: DVec3::new(0.075, 0.25, 0.075),
        mass: 3.0,
        centre: DVec3::new(x, -0.55, 0.0),
        joint: Some([DVec3::new(x, -0.3, 0.0), DVec3::new(0.0, 0.25, 0.0)]),
    }
}

impl SheepPart {
    pub fn shape(&self) -> Shape {
        Shape::Box { half: self.half }
    }

    /// By integration over the box.
    pub fn mass_properties(&self) -> MassProperties {
        let unit = self.shape().mass_properties(Density::constant(1.0)).unwrap();
        unit.scaled_to(self.mass).unwrap()
    }
}

/// Where the parts are and how they are turned.
pub type Poses = [(DVec3, DQuat); 4];

/// The sheep in independent coordinates: 6 of its body, 3 of each of 3 ball joints.
pub fn articulated() -> Articulated {
    let part = |part: &SheepPart| {
        let kind = if part.joint.is_some() { JointKind::Ball } else { JointKind::Free };
        let [in_body, in_part] = part.joint.unwrap_or_default();
        PartDesc {
            name: part.name.into(),
            mass: part.mass_properties(),
            parent: part.joint.map(|_| 0),
            joint: JointDesc::new(kind).at(in_body, in_part),
        }
    };
    Articulated::new(PARTS.iter().map(part).collect()).unwrap()
}

/// Q of the articulated sheep whose parts are at `poses`.
pub fn coordinates(poses: &Poses) -> Vec<f64> {
    let (position, rotation) = poses[0];
    let joints = poses[1..].iter().flat_map(|(_, turned)| (rotation.inverse() * *turned).to_array());
    position.to_array().into_iter().chain(rotation.to_array()).chain(joints).collect()
}

/// Adds the articulated sheep at rest.
pub fn add_articulated(world: &mut World, q: Vec<f64>, colliders: bool) -> BodyId {
    let dof = articulated();
    let collider = |(part, desc): (u32, &SheepPart)| PartCollider {
        at: PartPoint { part, point: DVec3::ZERO },
        collider: Collider::new(desc.shape(), 0.5),
    };
    let colliders = if colliders { (0..).zip(&PARTS).map(collider).collect() } else { Vec::new() };
    let v = dof.still();
    world.add_figure(FigureDesc { dof: Arc::new(dof), q, v, colliders }).unwrap()
}

/// Poses of the parts of an articulated sheep.
pub fn poses(world: &World, sheep: BodyId) -> Poses {
    std::array::from_fn(|part| {
        let frame = world.frame(sheep, PartPoint { part: part as u32, point: DVec3::ZERO }).unwrap();
        (frame.position.into(), DQuat::from_mat3(&frame.rotation.value()).normalize())
    })
}

/// The sheep as it hangs still by its ear from the world's origin, turned about it by 10 degrees.
pub fn hung_and_turned() -> Poses {
    let mut world = world();
    let q = coordinates(&PARTS.each_ref().map(|part| (part.centre - PARTS[1].centre - EAR, DQuat::IDENTITY)));
    let sheep = add_articulated(&mut world, q, false);
    hang(&mut world, sheep, HEAD);
    // Implicit Euler takes the swing out of it; what turns about the vertical has no friction, and does not matter.
    (0..1800).for_each(|_| drop(world.step().clone()));
    let turn = DQuat::from_rotation_z(10f64.to_radians());
    poses(&world, sheep).map(|(position, rotation)| (turn * position, turn * rotation))
}

/// Nails a part's ear to the world's origin.
pub fn hang(world: &mut World, body: BodyId, part: u32) {
    let ear = Anchor::part(body, part, EAR);
    world.add_ball_joint(BallJointDesc::new(ear, Anchor::world(DVec3::ZERO))).unwrap();
}

/// Centre of mass of parts that are at `poses`.
pub fn centre_of_mass(poses: &Poses) -> DVec3 {
    let mass: f64 = PARTS.iter().map(|part| part.mass).sum();
    poses.iter().zip(&PARTS).map(|((position, _), part)| *position * part.mass).sum::<DVec3>() / mass
}

/// Time between the first two instants at which a swing passes the middle the same way, s; `step` makes a tick of `dt`
/// and answers where the swing is.
pub fn period(dt: f64, mut step: impl FnMut() -> f64) -> f64 {
    let (mut crossings, mut before) = (Vec::new(), step());
    for tick in 1..(10.0 / dt) as u32 {
        let now = step();
        if before > 0.0 && now <= 0.0 {
            crossings.push(dt * (f64::from(tick) + before / (before - now)));
        }
        if let [first, second] = crossings[..] {
            return second - first;
        }
        before = now;
    }
    panic!("it does not swing");
}

/// Hung by an ear and let go at 10 degrees: a tick of 1/30 s shows the period of a sixteenth of it within 2 %.
#[test]
fn the_articulated_sheep_swings_by_its_ear() {
    let start = coordinates(&hung_and_turned());
    let [coarse, fine] = [1.0, 16.0].map(|ticks| {
        let mut world = World::new(Settings::at(DT / ticks)).unwrap();
        let sheep = add_articulated(&mut world, start.clone(), false);
        hang(&mut world, sheep, HEAD);
        period(DT / ticks, || {
            world.step();
            assert!(world.report().worst_joint_gap < 1e-3, "{:?}", world.report());
            assert!(world.report().iterations <= 8, "{:?}", world.report());
            centre_of_mass(&poses(&world, sheep)).x
        })
    });
    assert!((coarse / fine - 1.0).abs() < 0.02, "{coarse} s, {fine} s");
}

/// Set down on its feet it stands, until it falls over.
#[test]
fn the_articulated_sheep_lands_on_its_feet() {
    let mut world = world();
    ground(&mut world);
    let q = coordinates(&PARTS.each_ref().map(|part| (part.centre + DVec3::Y * 1.8, DQuat::IDENTITY)));
    let sheep = add_articulated(&mut world, q, true);
    for tick in 0..200 {
        world.step();
        let report = world.report();
        assert_eq!(report.unconverged_islands, 0, "tick {tick}: {report:?}");
        assert!(report.worst_penetration < 0.02, "tick {tick}: {report:?}");
    }
    let height = world.position(sheep).unwrap().y;
    assert!((height - 0.8).abs() < 1e-3, "{height}");
    assert!(world.slice(sheep).unwrap().v[..3].iter().all(|v| v.abs() < 0.05));
}

/// Thrown with 7 rad/s it tumbles: every part keeps to its joints, momentum is kept to what the solver leaves, energy
/// falls, and of the angular momentum a ninth is lost in half a second, as independent coordinates do.
#[test]
fn the_articulated_sheep_tumbles() {
    let mut world = weightless();
    let q = coordinates(&PARTS.each_ref().map(|part| (part.centre, DQuat::IDENTITY)));
    let sheep = add_articulated(&mut world, q.clone(), false);
    let mut v = vec![0.0; 15];
    v[3..6].copy_from_slice(&[3.0, 5.0, 4.0]);
    world.set_slice(sheep, &q, &v).unwrap();
    let (start, mut energy) = (world.momentum(), world.energy().total());
    for tick in 0..150 {
        world.step();
        let (now, momentum) = (world.energy().total(), world.momentum());
        assert!(now < energy, "tick {tick}: {energy} J to {now}");
        energy = now;
        assert!((momentum.linear - start.linear).length() < 0.01 * 51.0, "tick {tick}: {momentum:?}");
        let kept = momentum.angular.dot(start.angular) / start.angular.length_squared();
        assert!((0.5..1.0).contains(&kept) && (tick > 15 || kept > 0.88), "tick {tick}: {kept}");
        assert!(world.report().iterations <= 5, "tick {tick}: {:?}", world.report());
    }
}
