//! Pairs of colliders, random and degenerate, each with the reference's own idea of it.

use pita_sim::collide::At;
use pita_sim::{Collider, DQuat, DVec3, Shape};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::reference::{Core, Solid, signed_distance};

/// Kinds of pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Anything anywhere.
    Random,
    /// Boxes and hulls whose faces are parallel.
    ParallelFaces,
    /// Boxes turned so that two edges are parallel.
    ParallelEdges,
    /// Shapes a thousandth as thick as they are long.
    Slivers,
    /// Points, segments, triangles and coplanar hulls: no volume at all.
    Flat,
    /// Moved together until the gap is between −0.1 mm and 0.1 mm.
    NearlyTouching,
    /// Kilometres apart.
    Far,
    /// One in the other.
    Deep,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::Random,
        Self::ParallelFaces,
        Self::ParallelEdges,
        Self::Slivers,
        Self::Flat,
        Self::NearlyTouching,
        Self::Far,
        Self::Deep,
    ];

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::ParallelFaces => "parallel faces",
            Self::ParallelEdges => "parallel edges",
            Self::Slivers => "slivers",
            Self::Flat => "no volume",
            Self::NearlyTouching => "nearly touching",
            Self::Far => "far",
            Self::Deep => "deep",
        }
    }
}

/// A collider at a place.
#[derive(Clone)]
pub struct Item {
    shape: Shape,
    /// For the engine.
    pub collider: Collider,
    /// m.
    pub position: DVec3,
    /// Shape to world.
    pub rotation: DQuat,
}

impl std::fmt::Debug for Item {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { shape, position, rotation, .. } = self;
        write!(f, "{shape:?} at {position:?} turned {rotation:?}")
    }
}

impl Item {
    fn new(shape: Shape, position: DVec3, rotation: DQuat) -> Self {
        Self { collider: Collider::new(shape.clone(), 0.5), shape, position, rotation }
    }

    /// As the engine takes it.
    pub fn at(&self) -> At<'_> {
        At { collider: &self.collider, position: self.position, rotation: self.rotation }
    }

    /// As the reference takes it.
    pub fn solid(&self) -> Solid {
        let place = |p: DVec3| self.position + self.rotation * p;
        let points = |points: &[DVec3]| Core::Points(points.iter().map(|&p| place(p)).collect());
        match &self.shape {
            Shape::Ball { radius } => Solid { core: points(&[DVec3::ZERO]), radius: *radius },
            Shape::Box { half } => {
                let corners: Vec<_> = (0..8).map(|i| *half * corner(i)).collect();
                Solid { core: points(&corners), radius: 0.0 }
            }
            Shape::Capsule { half_length, radius } => {
                Solid { core: points(&[DVec3::X * *half_length, DVec3::NEG_X * *half_length]), radius: *radius }
            }
            Shape::Cylinder { half_length, radius, rounding } => {
                let (half, inner) = (half_length - rounding, radius - rounding);
                let core =
                    Core::Cylinder { centre: self.position, axis: self.rotation * DVec3::Z, half, radius: inner };
                Solid { core, radius: *rounding }
            }
            Shape::Hull { points: p, radius } => Solid { core: points(p), radius: *radius },
            other => unreachable!("no pair has {other:?}"),
        }
    }
}

fn corner(i: u32) -> DVec3 {
    let sign = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
    DVec3::new(sign(1), sign(2), sign(4))
}

/// Makes pairs, the same ones for the same seed.
pub struct Pairs(StdRng);

impl Pairs {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(StdRng::seed_from_u64(seed))
    }

    fn number(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    fn vector(&mut self, reach: f64) -> DVec3 {
        DVec3::new(self.number(-reach, reach), self.number(-reach, reach), self.number(-reach, reach))
    }

    fn rotation(&mut self) -> DQuat {
        loop {
            let (v, w) = (self.vector(1.0), self.number(-1.0, 1.0));
            let length = v.length_squared() + w * w;
            if (0.01..1.0).contains(&length) {
                return DQuat::from_xyzw(v.x, v.y, v.z, w).normalize();
            }
        }
    }

    fn one_of(&mut self, count: u32) -> u32 {
        self.0.random_range(0..count)
    }

    /// Twenty points in a ball of 0.5 m.
    #[allow(dead_code, reason = "the tests, which share this file, do without")]
    pub fn cloud(&mut self) -> Vec<DVec3> {
        (0..20).map(|_| self.direction() * 0.5).collect()
    }

    /// A unit vector.
    pub fn direction(&mut self) -> DVec3 {
        self.rotation() * DVec3::X
    }

    /// A pair of a kind.
    pub fn pair(&mut self, kind: Kind) -> [Item; 2] {
        match kind {
            Kind::Random => self.spread(1.5, Self::shape),
            Kind::ParallelFaces => self.parallel_faces(),
            Kind::ParallelEdges => self.parallel_edges(),
            Kind::Slivers => self.spread(1.0, Self::sliver),
            Kind::Flat => self.spread(1.0, Self::flat),
            Kind::NearlyTouching => self.nearly_touching(),
            Kind::Far => self.spread(10_000.0, Self::shape),
            Kind::Deep => self.spread(0.2, Self::shape),
        }
    }

    fn spread(&mut self, reach: f64, shape: fn(&mut Self) -> Shape) -> [Item; 2] {
        // Where both are is no matter, except to rounding.
        let middle = self.vector(100.0);
        [(); 2].map(|()| {
            let (shape, at, rotation) = (self.accepted(shape), middle + self.vector(reach), self.rotation());
            Item::new(shape, at, rotation)
        })
    }

    /// A shape that the engine takes: it refuses a hull as flat as a sheet without a radius by name.
    fn accepted(&mut self, shape: fn(&mut Self) -> Shape) -> Shape {
        loop {
            let shape = shape(self);
            if shape.validate().is_ok() {
                return shape;
            }
        }
    }

    fn half(&mut self) -> DVec3 {
        DVec3::new(self.number(0.05, 1.0), self.number(0.05, 1.0), self.number(0.05, 1.0))
    }

    fn shape(&mut self) -> Shape {
        match self.one_of(6) {
            0 => Shape::Ball { radius: self.number(0.05, 1.0) },
            1 => Shape::Capsule { half_length: self.number(0.05, 1.0), radius: self.number(0.02, 0.5) },
            2 => {
                let (half_length, radius) = (self.number(0.05, 1.0), self.number(0.05, 1.0));
                let rounding = if self.one_of(2) == 0 { 0.0 } else { 0.3 * half_length.min(radius) };
                Shape::Cylinder { half_length, radius, rounding }
            }
            3 => Shape::Box { half: self.half() },
            4 => self.hull(4, 4),
            _ => self.hull(5, 12),
        }
    }

    fn hull(&mut self, least: u32, most: u32) -> Shape {
        let count = least + self.one_of(most - least + 1);
        let points = (0..count).map(|_| self.vector(0.8)).collect();
        let radius = if self.one_of(2) == 0 { 0.0 } else { self.number(0.001, 0.1) };
        Shape::Hull { points, radius }
    }

    fn sliver(&mut self) -> Shape {
        let thickness = 10f64.powf(self.number(-4.0, -2.0));
        match self.one_of(4) {
            0 => Shape::Box { half: self.half() * DVec3::new(1.0, thickness, 1.0) },
            1 => Shape::Box { half: self.half() * DVec3::new(1.0, thickness, thickness) },
            2 => Shape::Cylinder { half_length: thickness, radius: self.number(0.1, 1.0), rounding: 0.0 },
            _ => match self.hull(4, 10) {
                Shape::Hull { points, radius } => {
                    let points = points.into_iter().map(|p| p * DVec3::new(1.0, thickness, 1.0)).collect();
                    Shape::Hull { points, radius }
                }
                other => other,
            },
        }
    }

    fn flat(&mut self) -> Shape {
        let count = [1, 2, 3, 4, 8][self.one_of(5) as usize];
        let points = (0..count).map(|_| self.vector(0.8).with_y(0.0)).collect();
        Shape::Hull { points, radius: 10f64.powf(self.number(-6.0, -1.0)) }
    }

    fn parallel_faces(&mut self) -> [Item; 2] {
        let (a, b) = (self.half(), self.half());
        let turn = if self.one_of(2) == 0 { DQuat::IDENTITY } else { self.rotation() };
        let gap = [0.0, 1e-9, 1e-4, -1e-4, 0.3, -0.05][self.one_of(6) as usize];
        let slide = self.vector(1.0);
        let quarters = f64::from(self.one_of(4)) * std::f64::consts::FRAC_PI_2;
        let spin = DQuat::from_rotation_y(if self.one_of(2) == 0 { quarters } else { slide.x });
        let place = turn * DVec3::new(slide.x, a.y + b.y + gap, slide.z);
        let as_hull = |half: DVec3, hull: bool| {
            let points = (0..8).map(|i| half * corner(i)).collect();
            if hull { Shape::Hull { points, radius: 0.0 } } else { Shape::Box { half } }
        };
        let hulls = [self.one_of(2) == 0, self.one_of(2) == 0];
        [Item::new(as_hull(a, hulls[0]), DVec3::ZERO, turn), Item::new(as_hull(b, hulls[1]), place, turn * spin)]
    }

    fn parallel_edges(&mut self) -> [Item; 2] {
        let halves = [self.half(), self.half()];
        let turn = self.rotation();
        let apart = turn * DVec3::new(self.number(-0.5, 0.5), self.number(-2.0, 2.0), self.number(-2.0, 2.0));
        let spins = [self.number(0.0, 6.3), self.number(0.0, 6.3)].map(DQuat::from_rotation_x);
        [
            Item::new(Shape::Box { half: halves[0] }, DVec3::ZERO, turn * spins[0]),
            Item::new(Shape::Box { half: halves[1] }, apart, turn * spins[1]),
        ]
    }

    fn nearly_touching(&mut self) -> [Item; 2] {
        let [a, mut b] = self.spread(2.0, Self::shape);
        let wanted = 10f64.powf(self.number(-10.0, -4.0)) * if self.one_of(2) == 0 { 1.0 } else { -1.0 };
        let now = signed_distance(&a.solid(), &b.solid());
        b.position += now.normal * (wanted - now.gap);
        [a, b]
    }
}
