//! The engine against closed forms, conservation laws and itself.

mod absurd;
mod articulated;
mod bad_geometry;
mod closed_form;
mod collisions;
mod compounds;
mod contact_events;
mod contact_loads;
mod couplings;
mod determinism;
mod elasticity;
mod embedded_hulls;
mod energy_audit;
mod fast_things;
mod figures;
mod fine_phase;
mod hostile;
mod joints;
mod lattice;
mod loops;
mod natural;
mod near_misses;
mod over_determined;
mod own_kind;
mod potentials;
mod queries;
mod recovery;
mod rest;
mod restitution;
mod second_look;
mod sheep;
mod sheep_forms;
mod sleep;
mod solvers;
mod surfaces;
mod tolerance;
mod wheels;

use pita_sim::{BodyId, Collider, DVec3, ParticleDesc, RigidBodyDesc, Settings, Shape, StaticDesc, World};

/// The talk's tick, s.
const DT: f64 = 1.0 / 30.0;

fn world() -> World {
    World::new(Settings::at(DT)).unwrap()
}

fn weightless() -> World {
    World::new(Settings { gravity: DVec3::ZERO, sleep: None, ..Settings::at(DT) }).unwrap()
}

/// A world whose solver leaves next to nothing: what it does is the scheme's.
fn precise(gravity: DVec3) -> World {
    let mut settings = Settings { gravity, sleep: None, ..Settings::at(DT) };
    settings.solver.tolerance = 3e-9;
    settings.solver.forcing = 1e-6;
    // What closed forms say of rods is said of stiff ones.
    settings.solver.joint_stiffness = 3e4;
    World::new(settings).unwrap()
}

fn particle(world: &mut World, position: DVec3, velocity: DVec3, mass: f64) -> BodyId {
    world.add_particle(ParticleDesc { position, velocity, mass, collider: None }).unwrap()
}

fn body(world: &mut World, shape: Shape, mass: f64, position: DVec3, friction: f64) -> BodyId {
    let inertia = shape.inertia(mass);
    let collider = Some(Collider::new(shape, friction));
    world.add_rigid_body(RigidBodyDesc { collider, ..RigidBodyDesc::new(position, mass, inertia) }).unwrap()
}

fn cube(world: &mut World, position: DVec3) -> BodyId {
    body(world, Shape::Box { half: DVec3::splat(0.5) }, 1000.0, position, 0.5)
}

fn ground(world: &mut World) {
    let shape = Shape::HalfSpace { normal: DVec3::Y };
    world.add_static(StaticDesc::new(Collider::new(shape, 0.5))).unwrap();
}
