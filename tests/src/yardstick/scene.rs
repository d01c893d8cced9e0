//! What a scene is: data that any engine can be built from, and its text in the grammar of
//! [`pita_game::scene`], which is the kit's.

use std::fmt::{self, Display, Formatter};

use pita_sim::{DQuat, DVec3};

/// Rigid scenes that show the same and are judged alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Cubes fall into a heap and come to rest.
    Pile,
    /// A column of boxes stands.
    Stack,
    /// Ragdolls of four boxes fall.
    Sheep,
    /// A light chain swings a heavy ball.
    Chain,
    /// Cars drive a circle.
    Cars,
    /// A body spins about its middle axis.
    Spin,
    /// A cube sticks to a slope.
    Stick,
    /// A cube slides down a slope.
    Slide,
}

/// What is in a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Rigid bodies with joints, and what they show.
    Rigid(Family, RigidScene),
    /// An elastic beam that sags.
    Beam(Beam),
}

impl Content {
    /// Ticks that the scene runs.
    pub fn ticks(&self) -> usize {
        match self {
            Self::Rigid(_, scene) => scene.ticks,
            Self::Beam(beam) => beam.ticks,
        }
    }
}

/// Rigid bodies, joints and ground. Its text is a `.scene` file.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidScene {
    /// Ticks that the scene runs.
    pub ticks: usize,
    /// m/s².
    pub gravity: DVec3,
    /// In the order of the file, which is the order in which engines get them.
    pub items: Vec<Item>,
}

/// A line of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A static half-space through the origin.
    Plane(Plane),
    /// A rigid body.
    Body(Body),
    /// A ball joint.
    Ball(Ball),
    /// A driven, steered and sprung wheel.
    Wheel(Wheel),
}

/// A static half-space through the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Out of the ground, unit length.
    pub normal: DVec3,
    /// Coulomb's.
    pub friction: f64,
}

/// A rigid body; its frame has the centre of mass as origin and the principal axes of inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its collision shape.
    pub shape: Shape,
    /// kg.
    pub mass: f64,
    /// Principal moments, kg m².
    pub inertia: DVec3,
    /// Of the centre of mass, m.
    pub position: DVec3,
    /// Body to world.
    pub rotation: DQuat,
    /// Of the centre of mass, m/s.
    pub velocity: DVec3,
    /// In world axes, rad/s.
    pub angular_velocity: DVec3,
    /// Coulomb's.
    pub friction: f64,
    /// Whether it touches anything.
    pub collides: bool,
}

/// A collision shape about the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Half extents, m.
    Box(DVec3),
    /// Radius, m.
    Sphere(f64),
    /// Along the body's x, m.
    Capsule {
        /// Of the two half spheres.
        radius: f64,
        /// From the middle to the centre of a half sphere.
        half_length: f64,
    },
}

/// A ball joint. Its two bodies do not collide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// First body; `None` is the world.
    pub a: Option<usize>,
    /// Second body.
    pub b: usize,
    /// Anchor in the frame of `a`, m.
    pub point_a: DVec3,
    /// Anchor in the frame of `b`, m.
    pub point_b: DVec3,
}

/// Lets a wheel slide along its chassis' y and spin about its own z, and nothing else. The two do not collide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// The body that carries it.
    pub chassis: usize,
    /// The wheel.
    pub wheel: usize,
    /// Where the wheel's centre is when the spring is at rest, in the chassis' frame, m.
    pub hub: DVec3,
    /// Turn about the chassis' y, rad.
    pub steer: f64,
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// Largest torque of the motor, N m.
    pub torque_max: f64,
    /// Spin that the motor wants, rad/s.
    pub target_speed: f64,
    /// Of the motor, N m s.
    pub gain: f64,
}

/// A cantilever of hexahedral cells along x, clamped where x = 0, released straight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Ticks that the scene runs.
    pub ticks: usize,
    /// Length, height and width, m. The beam reaches from 0 to `size.x` and lies about the x axis.
    pub size: DVec3,
    /// Cells along x, y, z; there is one node more along each.
    pub cells: [u32; 3],
    /// kg/m³.
    pub density: f64,
    /// Pa.
    pub young_modulus: f64,
    /// No unit.
    pub poisson_ratio: f64,
}

impl RigidScene {
    /// The bodies; joints name them by their place here.
    pub fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.items.iter().filter_map(|item| if let Item::Body(body) = item { Some(body) } else { None })
    }
}

impl Beam {
    /// Number of nodes.
    pub fn nodes(&self) -> u32 {
        self.cells.iter().map(|cells| cells + 1).product()
    }

    /// kg.
    pub fn mass(&self) -> f64 {
        self.density * self.size.element_product()
    }
}

impl Display for RigidScene {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "ticks {}\ngravity {}", self.ticks, Numbers(&self.gravity.to_array()))?;
        self.items.iter().try_for_each(|item| writeln!(f, "{item}"))
    }
}

impl Display for Item {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plane(plane) => {
                write!(f, "plane {}", Numbers(&[&plane.normal.to_array()[..], &[plane.friction]].concat()))
            }
            Self::Body(body) => write!(f, "body {body}"),
            Self::Ball(ball) => {
                let a = ball.a.map_or("-1".to_owned(), |a| a.to_string());
                write!(
                    f,
                    "ball {a} {} {} {}",
                    ball.b,
                    Numbers(&ball.point_a.to_array()),
                    Numbers(&ball.point_b.to_array())
                )
            }
            Self::Wheel(w) => {
                let motor = [w.steer, w.stiffness, w.damping, w.torque_max, w.target_speed, w.gain];
                write!(f, "wheel {} {} {} {}", w.chassis, w.wheel, Numbers(&w.hub.to_array()), Numbers(&motor))
            }
        }
    }
}

impl Display for Body {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (shape, size) = match self.shape {
            Shape::Box(half) => ("box", half.to_array()),
            Shape::Sphere(radius) => ("sphere", [radius, 0.0, 0.0]),
            Shape::Capsule { radius, half_length } => ("capsule", [radius, half_length, 0.0]),
        };
        let DQuat { x, y, z, w } = self.rotation;
        let (position, velocity, spin) = (self.position, self.velocity, self.angular_velocity);
        let numbers = [
            &size[..],
            &[self.mass],
            &self.inertia.to_array(),
            &position.to_array(),
            &[w, x, y, z],
            &velocity.to_array(),
            &spin.to_array(),
            &[self.friction],
        ];
        write!(f, "{shape} {} {}", Numbers(&numbers.concat()), u8::from(self.collides))
    }
}

/// Numbers in full precision with a space between two.
struct Numbers<'a>(&'a [f64]);

impl Display for Numbers<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.0.iter().enumerate().try_for_each(|(i, x)| write!(f, "{}{x:?}", if i == 0 { "" } else { " " }))
    }
}
