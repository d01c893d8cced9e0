#![allow(dead_code)]
#[path="game/test_track.rs"] mod test_track;
use crate::test_track::*;
use pita_game::Controls;
fn show(track: &TestTrack, label: &str) {
    let c = track.car(0);
    let local = c.rotation.inverse() * c.velocity;
    let r = track.arena.world().report();
    println!(
        "{label} t={:.2} pos=({:.2},{:.3},{:.2}) v=({:.2},{:.2},{:.2}) yaw={:.1} up={:.3} newton={} lin={} pen={:.4} gap={:.4} res={:.1e} wheels={:?}",
        track.arena.tick() as f64 / 30.,
        c.position.x,
        c.position.y,
        c.position.z,
        local.x,
        local.y,
        local.z,
        c.yaw().to_degrees(),
        c.upright(),
        r.newton_iterations,
        r.linear_iterations,
        r.worst_penetration,
        r.worst_joint_gap,
        r.residual,
        (1..=4)
            .map(|i| {
                let w = track.part(0, i);
                let l = c.rotation.inverse() * (w.position - c.position);
                (l.y * 1000.0).round()
            })
            .collect::<Vec<_>>()
    );
}
#[test]
fn ramp() {
    let ramp = "\n[[statics]]\nshape.box.half = [4.0, 0.2, 3.0]\nmaterial = \"asphalt\"\nposition = [40.0, 0.636, 0.0]\npitch = 12.0\n";
    let spawn = FLAT.replace("count = [8, 8]", "count = [1, 1]");
    let mut track = TestTrack::new(&format!("{spawn}{ramp}"), SETTINGS);
    track.enter(0);
    for i in 0..300 {
        track.run(1.0 / 30.0, FULL_THROTTLE);
        if i > 60 {
            show(&track, "ramp");
        }
    }
}
#[test]
fn steer() {
    let mut track = TestTrack::with_parked_car();
    track.run_until(8.0, FULL_THROTTLE, |t| t.speed() > 20.0);
    for _ in 0..150 {
        track.run(1.0 / 30.0, Controls { steer: 1.0, throttle: 0.3, ..Controls::default() });
        show(&track, "steer");
    }
}
#[test]
fn measure() {
    let mut track = TestTrack::with_parked_car();
    let t = track.run_until(20.0, FULL_THROTTLE, |t| t.speed() > 100.0 / 3.6);
    println!("0-100: {t:.2} s");
    let mut track = TestTrack::with_parked_car();
    for i in 0..300 {
        track.run(1.0 / 30.0, FULL_THROTTLE);
        if i % 10 == 0 {
            show(&track, "accel");
        }
    }
    for _ in 0..100 {
        track.run(1.0 / 30.0, FULL_BRAKE);
        show(&track, "brake");
    }
}
#[test]
fn gyro() {
    use pita_sim::*;
    for (spin, yaw, roll) in [
        (0.0, 1.0, 0.0),
        (-57.0, 0.1, 0.0),
        (-57.0, 0.5, 0.0),
        (-57.0, 0.5, 0.5),
        (-57.0, 3.0, 0.0),
        (-57.0, 0.0, 3.0),
        (-20.0, 3.0, 0.0),
        (-120., 1.0, 0.),
    ] {
        let mut w = World::new(Settings { gravity: DVec3::ZERO, ..Settings::at(1.0 / 30.0) }).unwrap();
        let half = DVec3::new(1.9, 0.3, 0.85);
        let chassis = w
            .add_rigid_body(RigidBodyDesc {
                angular_velocity: DVec3::new(roll, yaw, 0.0),
                ..RigidBodyDesc::new(DVec3::Y * 5.0, 1100.0, Shape::Box { half }.inertia(1100.0))
            })
            .unwrap();
        let cyl = Shape::Cylinder { half_length: 0.12, radius: 0.35, rounding: 0.04 };
        for x in [-1.3, 1.3] {
            for z in [-0.8, 0.8] {
                let hub = DVec3::new(x, -0.25, z);
                let wheel = w
                    .add_rigid_body(RigidBodyDesc {
                        velocity: DVec3::new(roll, yaw, 0.0).cross(hub),
                        angular_velocity: DVec3::new(roll, yaw, spin),
                        ..RigidBodyDesc::new(DVec3::Y * 5.0 + hub, 25.0, cyl.inertia(25.0))
                    })
                    .unwrap();
                w.add_axle(AxleDesc {
                    chassis,
                    wheel,
                    hub,
                    stiffness: 4e4,
                    damping: 4e3,
                    control: AxleControl::default(),
                })
                .unwrap();
            }
        }
        println!("--- spin {spin} yaw {yaw} roll {roll}");
        for t in 0..40 {
            let r = w.step().clone();
            if t < 3 || t % 8 == 0 || r.residual > 1e-3 {
                println!(
                    "{t} newton={} lin={} eval={} res={:.1e} gap={:.1e} w={:.3} L={:.2}",
                    r.newton_iterations,
                    r.linear_iterations,
                    r.evaluations,
                    r.residual,
                    r.worst_joint_gap,
                    w.angular_velocity(chassis).unwrap(),
                    w.momentum().angular
                );
            }
        }
    }
}
