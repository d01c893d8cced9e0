//! Runs a scene on rapier: f32, one thread, sleeping off, otherwise at its defaults or at a named setting.

use std::fmt::{self, Display, Formatter};

use pita_sim::{DQuat, DVec3};
use rapier3d::prelude::*;

use super::TICK_HZ;
use super::scene::{self, Content, Item};
use super::trace::{BodyState, Engine};

/// How rapier runs a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Full steps a tick, collision detection included.
    pub steps: u32,
    /// Solver iterations (its own internal sub-steps) a step; its default where there is none.
    pub iterations: Option<usize>,
}

impl Setting {
    /// Its defaults, one step a tick.
    pub const DEFAULT: Self = Self { steps: 1, iterations: None };
}

impl Display for Setting {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.iterations.map_or(Ok(()), |iterations| write!(f, "iters={iterations} "))?;
        write!(f, "k={}", self.steps)
    }
}

/// Rapier with a scene in it.
pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    soft: Option<SoftBodyHandle>,
    steps: u32,
}

impl Rapier {
    /// The scene at `setting`.
    pub fn new(content: &Content, setting: Setting) -> Self {
        let mut this = Self { world: PhysicsWorld::new(), bodies: Vec::new(), soft: None, steps: setting.steps };
        let parameters = &mut this.world.integration_parameters;
        parameters.dt = 1.0 / (TICK_HZ as f32 * setting.steps as f32);
        parameters.num_solver_iterations = setting.iterations.unwrap_or(parameters.num_solver_iterations);
        match content {
            Content::Rigid(_, scene) => {
                this.world.gravity = vector(scene.gravity);
                for item in &scene.items {
                    this.add(item);
                }
            }
            Content::Beam(beam) => this.add_beam(beam),
        }
        this
    }

    fn add(&mut self, item: &Item) {
        match item {
            Item::Plane(plane) => {
                let shape = SharedShape::halfspace(vector(plane.normal).normalize());
                self.world.insert_collider(ColliderBuilder::new(shape).friction(plane.friction as f32), None);
            }
            Item::Body(body) => self.add_body(body),
            Item::Ball(ball) => self.add_ball(ball),
            Item::Wheel(wheel) => self.add_wheel(wheel),
        }
    }

    fn add_body(&mut self, body: &scene::Body) {
        let mass = MassProperties::new(Vector::ZERO, body.mass as f32, vector(body.inertia));
        let handle = self.world.insert_body(
            RigidBodyBuilder::dynamic()
                .pose(Pose::from_parts(vector(body.position), body.rotation.as_quat()))
                .linvel(vector(body.velocity))
                .angvel(vector(body.angular_velocity))
                .can_sleep(false)
                // Without this it holds back wheels.
                .allow_fast_rotation(true)
                .additional_mass_properties(mass),
        );
        if body.collides {
            let shape = match body.shape {
                scene::Shape::Box(half) => SharedShape::cuboid(half.x as f32, half.y as f32, half.z as f32),
                scene::Shape::Sphere(radius) => SharedShape::ball(radius as f32),
                scene::Shape::Capsule { radius, half_length } => {
                    SharedShape::capsule_x(half_length as f32, radius as f32)
                }
            };
            let collider = ColliderBuilder::new(shape).density(0.0).friction(body.friction as f32);
            self.world.insert_collider(collider, Some(handle));
        }
        self.bodies.push(handle);
    }

    fn add_ball(&mut self, ball: &scene::Ball) {
        let a = match ball.a {
            Some(index) => self.bodies[index],
            None => self.world.insert_body(RigidBodyBuilder::fixed()),
        };
        let joint = SphericalJointBuilder::new()
            .local_anchor1(vector(ball.point_a))
            .local_anchor2(vector(ball.point_b))
            .contacts_enabled(false);
        self.world.insert_impulse_joint(a, self.bodies[ball.b], joint);
    }

    fn add_wheel(&mut self, wheel: &scene::Wheel) {
        let locked = JointAxesMask::LIN_X | JointAxesMask::LIN_Z | JointAxesMask::ANG_X | JointAxesMask::ANG_Y;
        let hub = Pose::from_parts(vector(wheel.hub), Rotation::from_rotation_y(wheel.steer as f32));
        let gain = if wheel.torque_max > 0.0 { wheel.gain } else { 0.0 };
        let joint = GenericJointBuilder::new(locked)
            .local_frame1(hub)
            .contacts_enabled(false)
            .motor_model(JointAxis::LinY, MotorModel::ForceBased)
            .motor_position(JointAxis::LinY, 0.0, wheel.stiffness as f32, wheel.damping as f32)
            .motor_model(JointAxis::AngZ, MotorModel::ForceBased)
            .motor_velocity(JointAxis::AngZ, wheel.target_speed as f32, gain as f32)
            .motor_max_force(JointAxis::AngZ, wheel.torque_max as f32);
        self.world.insert_impulse_joint(self.bodies[wheel.chassis], self.bodies[wheel.wheel], joint);
    }

    fn add_beam(&mut self, beam: &scene::Beam) {
        let half = vector(0.5 * beam.size);
        let [nx, ny, nz] = beam.cells.map(|cells| cells as usize + 1);
        let material = SoftBodyMaterial {
            young_modulus: beam.young_modulus as f32,
            poisson_ratio: beam.poisson_ratio as f32,
            elastic_damping_ratio: 0.05,
            ..SoftBodyMaterial::default()
        };
        let body = SoftBodyBuilder::cuboid(Vector::new(half.x, 0.0, 0.0), half, nx, ny, nz)
            .cell_model(SoftBodyCellModel::NeoHookean)
            .material(material)
            .solver(SoftBodySolver::Fem)
            .mass(beam.mass() as f32)
            .no_surface_collider()
            .can_sleep(false);
        let clamped: Vec<u32> =
            (0..).zip(body.particle_positions()).filter(|(_, p)| p.x < 1e-4).map(|(index, _)| index).collect();
        self.soft = Some(self.world.insert_soft_body(body.pinned_particles(clamped)));
    }
}

impl Engine for Rapier {
    fn tick(&mut self) {
        for _ in 0..self.steps {
            self.world.step();
        }
    }

    fn record(&self, into: &mut Vec<BodyState>) {
        into.extend(self.bodies.iter().map(|&handle| {
            let body = &self.world.bodies[handle];
            BodyState {
                position: body.translation().as_dvec3(),
                rotation: body.rotation().as_dquat(),
                velocity: body.linvel().as_dvec3(),
                angular_velocity: body.angvel().as_dvec3(),
            }
        }));
        let nodes = self.soft.iter().flat_map(|&handle| self.world.soft_bodies[handle].particles());
        into.extend(nodes.map(|node| BodyState {
            position: node.position().as_dvec3(),
            rotation: DQuat::IDENTITY,
            velocity: node.velocity().as_dvec3(),
            angular_velocity: DVec3::ZERO,
        }));
    }
}

fn vector(v: DVec3) -> Vector {
    v.as_vec3()
}
