//! Every public constructor and setter with numbers that make no sense: what is refused is refused with an error, what is
//! accepted is stepped, nothing panics, and no number of the state becomes anything but finite.

use std::iter::Cycle;
use std::sync::Arc;
use std::vec::IntoIter;

use pita_sim::dof::PointRod;
use pita_sim::mass::{Density, MassProperties, Polyhedron, embedded_mass, lattice_cell_mass, tetrahedron_mass};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Anchor, AngleLimitDesc, Articulated, AxleControl, AxleDesc, BallJointDesc, BodyId, Collider, DMat3, DQuat, DVec3,
    DistanceLimitDesc, Dof, Driven, FigureDesc, FiniteElements, FixedJointDesc, HingeDesc, JointDesc, JointDrive,
    JointKind, JointLimit, JointMotor, JointSpring, Lattice, LatticeDesc, LimitRange, Motor, MotorDesc, Natural,
    NaturalDesc, NaturalPart, PartCollider, PartDesc, PartPoint, ParticleDesc, PdControl, PdDesc, RigidBodyDesc,
    RodDesc, Settings, Shape, SimError, SliderDesc, SpringDesc, StaticDesc, UniversalJointDesc, World,
};
use proptest::prelude::*;

/// One in this many numbers is absurd.
const RARE: u32 = 24;

/// Numbers of a case: most of them ordinary, so that descriptions are accepted now and then.
fn numbers() -> impl Strategy<Value = Vec<f64>> {
    let absurd = prop::sample::select(vec![
        0.0,
        -0.0,
        -1.0,
        1e-320,
        -1e-320,
        f64::MIN_POSITIVE,
        1e-150,
        1e-30,
        1e-12,
        1e-7,
        1e3,
        1e6,
        -1e6,
        9.9e8,
        -9.9e8,
        1e12,
        1e15,
        1e100,
        1e200,
        f64::MAX,
        f64::MIN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ]);
    prop::collection::vec(prop_oneof![RARE => 0.05..1.5f64, 2 => -1.5..1.5f64, 1 => absurd], 400)
}

/// Hands out the numbers of a case.
struct Draw {
    numbers: Cycle<IntoIter<f64>>,
    choices: Cycle<IntoIter<u8>>,
}

impl Draw {
    fn new(numbers: Vec<f64>, choices: Vec<u8>) -> Self {
        Self { numbers: numbers.into_iter().cycle(), choices: choices.into_iter().cycle() }
    }

    fn number(&mut self) -> f64 {
        self.numbers.next().unwrap_or(1.0)
    }

    /// Below `n`.
    fn choice(&mut self, n: usize) -> usize {
        usize::from(self.choices.next().unwrap_or(0)) % n
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    /// A unit quaternion as a rule.
    fn rotation(&mut self) -> DQuat {
        let raw = DQuat::from_xyzw(self.number(), self.number(), self.number(), self.number());
        if self.choice(16) == 0 { raw } else { raw.normalize() }
    }

    fn vectors(&mut self, n: usize) -> Vec<DVec3> {
        (0..n).map(|_| self.vector()).collect()
    }

    fn shape(&mut self) -> Shape {
        match self.choice(7) {
            0 => Shape::HalfSpace { normal: if self.choice(2) == 0 { DVec3::Y } else { self.vector() } },
            1 => Shape::Ball { radius: self.number() },
            2 => Shape::Box { half: self.vector() },
            3 => Shape::Capsule { half_length: self.number(), radius: self.number() },
            4 => {
                let (half_length, radius, rounding) = (self.number(), self.number(), self.number() / 10.0);
                Shape::Cylinder { half_length, radius, rounding }
            }
            _ => {
                let n = 3 + self.choice(8);
                let radius = if self.choice(2) == 0 { 0.0 } else { self.number() };
                Shape::Hull { points: self.vectors(n), radius }
            }
        }
    }

    fn collider(&mut self) -> Option<Collider> {
        (self.choice(4) > 0).then(|| Collider::new(self.shape(), self.number()))
    }

    fn density(&mut self) -> Density {
        let at_origin = 100.0 * self.number();
        let gradient = if self.choice(3) == 0 { self.vector() } else { DVec3::ZERO };
        Density { at_origin, gradient }
    }

    fn mass(&mut self) -> MassProperties {
        let ordinary = MassProperties { mass: 1.0, centre: DVec3::ZERO, moments: DMat3::from_diagonal(DVec3::ONE) };
        match self.choice(6) {
            0 => MassProperties::of_point(self.number(), self.vector()).unwrap_or(ordinary),
            1 => {
                let moments = DMat3::from_cols(self.vector(), self.vector(), self.vector());
                MassProperties { mass: self.number(), centre: self.vector(), moments }
            }
            2 => MassProperties { moments: DMat3::from_diagonal(self.vector()), ..ordinary },
            _ => {
                let density = self.density();
                let one = self.shape().mass_properties(density).unwrap_or(ordinary);
                let other = one.moved(self.vector(), self.rotation());
                let both = MassProperties::combined([one, other]).unwrap_or(ordinary);
                let _ = (both.principal(), both.inertia_about(self.vector()), self.shape().inertia(self.number()));
                both.scaled_to(self.number()).unwrap_or(both)
            }
        }
    }

    fn joint_kind(&mut self) -> JointKind {
        match self.choice(6) {
            0 => JointKind::Fixed,
            1 => JointKind::Hinge { axis: self.vector() },
            2 => JointKind::Universal { axes: [self.vector(), self.vector()] },
            3 => JointKind::Ball,
            4 => JointKind::Slider { axis: self.vector() },
            _ => JointKind::Free,
        }
    }

    fn drive(&mut self) -> JointDrive {
        match self.choice(2) {
            0 => JointDrive::Position { frequency: self.number(), damping_ratio: 1.0 + self.number() },
            _ => JointDrive::Velocity { time_constant: self.number() },
        }
    }

    fn joint(&mut self) -> JointDesc {
        let (kind, tolerance) = (self.joint_kind(), self.number().min(0.5));
        let range = match (kind, self.choice(2)) {
            (JointKind::Ball, 0) => LimitRange::Swing { axis: self.vector(), upper: self.number() },
            (JointKind::Ball, _) => {
                LimitRange::Twist { axis: self.vector(), lower: -self.number(), upper: self.number() }
            }
            _ => LimitRange::Coordinate { index: self.choice(3) as u8, lower: -self.number(), upper: self.number() },
        };
        let limits = vec![JointLimit { range, tolerance }; self.choice(3) / 2];
        let spring = (self.choice(4) == 0).then(|| JointSpring { stiffness: self.number(), damping: self.number() });
        let motor = (self.choice(4) == 0).then(|| JointMotor { drive: self.drive(), max_force: self.number() });
        JointDesc {
            kind,
            in_parent: self.vector(),
            in_part: self.vector(),
            rest: self.rotation(),
            limits,
            spring,
            motor,
        }
    }

    fn articulated(&mut self) -> Result<(Arc<dyn Dof>, Vec<f64>), SimError> {
        let part = |i: usize| {
            let parent =
                if self.choice(16) == 0 { Some(self.choice(9) as u32) } else { i.checked_sub(1).map(|i| i as u32) };
            PartDesc { name: format!("part {i}"), mass: self.mass(), parent, joint: self.joint() }
        };
        let figure = Articulated::new((0..3).map(part).collect())?;
        let q = figure.rest();
        Ok((Arc::new(figure), q))
    }

    fn natural(&mut self) -> Result<(Arc<dyn Dof>, Vec<f64>), SimError> {
        let points = if self.choice(2) == 0 {
            vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, self.vector()]
        } else {
            self.vectors(5)
        };
        let part = |points: &[u32], draw: &mut Self| NaturalPart {
            name: "part".into(),
            points: points.to_vec(),
            position: draw.vector(),
            rotation: draw.rotation(),
            mass: draw.mass(),
        };
        let mut parts = vec![part(&[0, 1, 2, 3], self), part(&[4], self)];
        if self.choice(8) == 0 {
            parts.push(part(&[3, 4], self));
        }
        let mut rods = vec![PointRod::new([3, 4], points[3].distance(points[4]))];
        if self.choice(8) == 0 {
            let points = [self.choice(6) as u32, self.choice(6) as u32];
            rods.push(PointRod { points, length: self.number(), tolerance: self.number() });
        }
        let figure = Natural::new(NaturalDesc { points, rods, parts }.with_edges())?;
        let q = figure.placed(DVec3::Y, DQuat::IDENTITY);
        Ok((Arc::new(figure), q))
    }

    fn elastic(&mut self) -> Result<Elastic, SimError> {
        match self.choice(4) {
            0 => Ok(Elastic { lambda: 1e5 * self.number(), mu: 1e5 * self.number() }),
            _ => Elastic::new(1e5 * self.number(), 0.2 * self.number()),
        }
    }

    fn mesh(&mut self) -> Result<TetrahedralMesh, SimError> {
        match self.choice(3) {
            0 => TetrahedralMesh::new(self.vectors(4), vec![[0, 1, 2, 3]]),
            1 => TetrahedralMesh::of_box(self.vector(), self.vector() * 2.0, [1, 2, 1]),
            _ => TetrahedralMesh::of_box(DVec3::ZERO, self.vector(), [self.choice(3) as u32, 1, 2]),
        }
    }

    fn finite_elements(&mut self) -> Result<(Arc<dyn Dof>, Vec<f64>), SimError> {
        let (mesh, fixed) = (self.mesh()?, [self.choice(40) as u32]);
        let fixed = &fixed[..self.choice(2)];
        let density = self.density();
        let body = FiniteElements::new(&mesh, self.elastic()?, density, fixed)?.damped(self.number())?;
        let q = body.placed(DVec3::Y, DQuat::IDENTITY);
        Ok((Arc::new(body), q))
    }

    fn solid(&mut self) -> Result<Polyhedron, SimError> {
        if self.choice(4) == 0 {
            let triangle = |draw: &mut Self| [0; 3].map(|_| draw.choice(5) as u32);
            let triangles = match self.choice(2) {
                0 => vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
                _ => (0..4).map(|_| triangle(self)).collect(),
            };
            Polyhedron::of_surface(self.vectors(4), triangles)
        } else {
            let n = self.choice(12);
            Polyhedron::of_hull(&self.vectors(n))
        }
    }

    fn lattice(&mut self) -> Result<(Arc<dyn Dof>, Vec<f64>), SimError> {
        let solid = self.solid()?;
        let (min, max) = match self.choice(4) {
            0 => (self.vector(), self.vector() * 3.0),
            _ => (DVec3::splat(-2.0), DVec3::splat(2.0)),
        };
        let cells = [1, 1 + self.choice(2) as u32, self.choice(3) as u32];
        let desc =
            LatticeDesc { min, max, cells, material: self.elastic()?, density: self.density(), damping: self.number() };
        let body = Lattice::new(&solid, desc)?;
        let _ = body.at(self.vector());
        let q = body.placed(DVec3::Y, DQuat::IDENTITY);
        Ok((Arc::new(body), q))
    }

    fn add_body(&mut self, world: &mut World) -> Result<BodyId, SimError> {
        let figure = match self.choice(9) {
            0 => {
                let (position, velocity, mass) = (self.vector(), self.vector(), self.number());
                return world.add_particle(ParticleDesc { position, velocity, mass, collider: self.collider() });
            }
            1 | 2 => {
                return world.add_rigid_body(RigidBodyDesc {
                    position: self.vector(),
                    rotation: self.rotation(),
                    velocity: self.vector(),
                    angular_velocity: self.vector(),
                    mass: self.number(),
                    inertia: self.vector(),
                    collider: self.collider(),
                });
            }
            3 | 7 | 8 => self.articulated(),
            4 => self.natural(),
            5 => self.finite_elements(),
            _ => self.lattice(),
        };
        let (dof, q) = figure?;
        let rates: usize = dof.blocks().iter().map(|block| usize::from(block.rates)).sum();
        let v = (0..rates).map(|_| self.number()).collect();
        let at = PartPoint { part: self.choice(3) as u32, point: self.vector() };
        let colliders = self.collider().map(|collider| PartCollider { at, collider }).into_iter().collect();
        world.add_figure(FigureDesc { dof, q, v, colliders })
    }

    fn anchor(&mut self, bodies: &[BodyId]) -> Anchor {
        let point = if self.choice(2) == 0 { DVec3::ZERO } else { self.vector() };
        match bodies.get(self.choice(bodies.len() + 1)) {
            Some(&body) => Anchor { body: Some(body), part: self.choice(8) as u32 / 7, point },
            None => Anchor::world(point),
        }
    }

    fn motor(&mut self) -> Motor {
        Motor { target_speed: self.number(), gain: self.number(), max_torque: self.number() }
    }

    fn axle_control(&mut self) -> AxleControl {
        AxleControl { steer: self.number(), drive: self.motor(), brake: self.number() }
    }

    fn pd_control(&mut self) -> PdControl {
        PdControl { target: self.vector(), target_velocity: self.vector() }
    }

    fn add_potential(&mut self, world: &mut World, bodies: &[BodyId]) -> Result<(), SimError> {
        let (a, b) = (self.anchor(bodies), self.anchor(bodies));
        let (tolerance, tilt) = if self.choice(4) == 0 { (self.number(), self.number()) } else { (1e-3, 1e-3) };
        let (axis_a, axis_b) = (self.vector(), self.vector());
        match self.choice(10) {
            0 => {
                let (rest_length, stiffness, damping) = (self.number(), self.number(), self.number());
                world.add_spring(SpringDesc { a, b, rest_length, stiffness, damping }).map(|_| ())
            }
            1 => world.add_rod(RodDesc { a, b, length: self.number(), tolerance }).map(|_| ()),
            2 => world.add_ball_joint(BallJointDesc { a, b, tolerance }).map(|_| ()),
            3 => {
                let hinge = world.add_hinge(HingeDesc { a, b, axis_a, axis_b, tolerance, tilt })?;
                let (lower, upper) = (-self.number(), self.number());
                let limit = world.add_angle_limit(AngleLimitDesc { hinge, lower, upper, tolerance });
                let motor = world.add_motor(MotorDesc { joint: Driven::Hinge(hinge), motor: self.motor() })?;
                world.set_motor(motor, self.motor())?;
                limit.map(|_| ())
            }
            4 => {
                let desc = UniversalJointDesc { a, b, axis_a, axis_b, tolerance, tilt };
                world.add_universal_joint(desc).map(|_| ())
            }
            5 => world.add_fixed_joint(FixedJointDesc { a, b, tolerance, tilt }).map(|_| ()),
            6 => {
                let slider = world.add_slider(SliderDesc { a, b, axis_a, tolerance, tilt })?;
                world.add_motor(MotorDesc { joint: Driven::Slider(slider), motor: self.motor() }).map(|_| ())
            }
            7 => {
                let (at_least, at_most) = (self.number(), self.number() + 1.0);
                world.add_distance_limit(DistanceLimitDesc { a, b, at_least, at_most, tolerance }).map(|_| ())
            }
            8 => {
                let (Some(chassis), Some(wheel)) = (a.body, b.body) else { return Ok(()) };
                let (hub, stiffness, damping) = (self.vector(), self.number(), self.number());
                let control = self.axle_control();
                let axle = world.add_axle(AxleDesc { chassis, wheel, hub, stiffness, damping, control })?;
                world.set_axle(axle, self.axle_control())
            }
            _ => {
                let (drive, max_force, control) = (self.drive(), self.number(), self.pd_control());
                let pd = world.add_pd(PdDesc { at: a, drive, max_force, control })?;
                world.set_pd(pd, self.pd_control())
            }
        }
    }

    /// Moves, pushes and steers a body.
    fn disturb(&mut self, world: &mut World, body: BodyId) -> Result<(), SimError> {
        let _ = world.frame(body, PartPoint { part: self.choice(4) as u32, point: self.vector() });
        match self.choice(6) {
            0 => world.set_pose(body, self.vector(), self.rotation()),
            1 => world.set_velocity(body, self.vector(), self.vector()),
            2 => world.apply_force(body, self.vector(), self.vector()),
            3 => {
                let slice = world.slice(body).map(|slice| (slice.q.to_vec(), slice.v.to_vec()));
                let (mut q, mut v) = slice.unwrap_or_default();
                q.iter_mut().for_each(|x| *x += 0.01 * self.number());
                v.iter_mut().for_each(|x| *x = self.number());
                world.set_slice(body, &q, &v)
            }
            _ => {
                let mut controls = world.controls(body).unwrap_or_default().to_vec();
                controls.iter_mut().for_each(|x| *x += self.number() / 4.0);
                world.set_controls(body, &controls)
            }
        }
    }

    fn settings(&mut self) -> Settings {
        let mut settings = Settings::at(1.0 / 30.0);
        if self.choice(4) == 0 {
            settings.dt = self.number();
            settings.gravity = self.vector();
            let solver = &mut settings.solver;
            for x in [&mut solver.tolerance, &mut solver.forcing, &mut solver.relaxation, &mut solver.joint_stiffness] {
                if self.choice(4) == 0 {
                    *x = self.number();
                }
            }
            let contact = &mut settings.contact;
            for x in [
                &mut contact.normal_stiffness,
                &mut contact.tangent_stiffness,
                &mut contact.transition,
                &mut contact.recovery_speed,
                &mut contact.margin,
            ] {
                if self.choice(4) == 0 {
                    *x = self.number();
                }
            }
        }
        settings
    }
}

/// A world with things in it that pull at each other.
fn world_of(draw: &mut Draw) -> Option<(World, Vec<BodyId>)> {
    let mut world = World::new(draw.settings()).ok()?;
    let collider = Collider::new(draw.shape(), draw.number());
    let piece = StaticDesc { collider, position: draw.vector(), rotation: draw.rotation() };
    let _ = world.add_static(piece);
    let bodies: Vec<BodyId> = (0..8).filter_map(|_| draw.add_body(&mut world).ok()).take(4).collect();
    for _ in 0..6 {
        let _ = draw.add_potential(&mut world, &bodies);
    }
    Some((world, bodies))
}

fn assert_finite(world: &World) {
    for slice in world.slices() {
        assert!(slice.q.iter().chain(slice.v).all(|x| x.is_finite()), "{slice:?}");
    }
}

proptest! {
    #[test]
    fn worlds_of_absurd_things_are_refused_or_stepped(numbers in numbers(), choices in prop::collection::vec(any::<u8>(), 301)) {
        let mut draw = Draw::new(numbers, choices);
        if let Some((mut world, bodies)) = world_of(&mut draw) {
            assert_finite(&world);
            for tick in 0..4 {
                for &body in &bodies {
                    if draw.choice(4) == 0 {
                        let _ = draw.disturb(&mut world, body);
                    }
                }
                if let (3, Some(&body)) = (tick, bodies.first()) {
                    world.remove_body(body);
                }
                world.step();
                assert_finite(&world);
            }
            let _ = (world.energy(), world.momentum(), world.contacts().count());
        }
    }

    #[test]
    fn absurd_solids_have_mass_or_are_refused(numbers in numbers(), choices in prop::collection::vec(any::<u8>(), 301)) {
        let mut draw = Draw::new(numbers, choices);
        for _ in 0..4 {
            let density = draw.density();
            if let Ok(solid) = draw.solid() {
                if let Ok(mass) = solid.mass_properties(density) {
                    prop_assert!(mass.mass > 0.0 && mass.mass.is_finite() && mass.centre.is_finite(), "{:?}", mass);
                }
                let _ = lattice_cell_mass(draw.vector(), draw.vector() * 2.0, &solid, density);
            }
            if let Ok(mass) = draw.shape().mass_properties(density) {
                prop_assert!(mass.mass > 0.0 && mass.mass.is_finite() && mass.centre.is_finite(), "{:?}", mass);
            }
            let corners = [draw.vector(), draw.vector(), draw.vector(), draw.vector()];
            if let Ok(mass) = tetrahedron_mass(&corners, density) {
                prop_assert!(mass.as_flattened().iter().all(|m| m.is_finite()), "{:?}", mass);
            }
            let mass = draw.mass();
            let _ = embedded_mass(&corners, &mass);
        }
    }
}
