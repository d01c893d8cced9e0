//! Every kind of DOF over the wire: where a client shows the parts is where the engine has them.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use pita_client::{part_pose, part_vertices};
use pita_game::{ActorInfo, PartInfo};
use pita_protocol::dof::{Decoder, Encoder, Precision, State, kind};
use pita_server::{crowd::Crowd, description, frame::Frame};
use pita_sim::mass::{Density, Polyhedron};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Articulated, BodyId, FigureDesc, FiniteElements, JointDesc, JointKind, Lattice, LatticeDesc, Natural, NaturalDesc,
    NaturalPart, PartDesc, PartPoint, ParticleDesc, RigidBodyDesc, Settings, Shape, World,
};

const TICK_HZ: f64 = 30.0;

/// A shape with its place in the engine.
struct Shown {
    body: BodyId,
    at: Vec<PartPoint>,
    part: PartInfo,
}

/// A world of bodies of every kind.
struct Zoo {
    world: World,
    shown: Vec<Shown>,
}

impl Zoo {
    fn new() -> Self {
        let mut zoo = Self { world: World::new(Settings::at(TICK_HZ.recip())).unwrap(), shown: Vec::new() };
        zoo.add_bodies();
        zoo.add_articulated();
        zoo.add_natural();
        zoo.add_elastic();
        zoo
    }

    fn show(&mut self, body: BodyId, part: u32, point: DVec3) {
        let at = PartPoint { part, point };
        let part = PartInfo::at(&self.world, body, at, Shape::Ball { radius: 0.1 });
        self.shown.push(Shown { body, at: vec![at], part });
    }

    fn add_bodies(&mut self) {
        let at = DVec3::new(1.0, 2.0, 3.0);
        let particle = ParticleDesc { position: at, velocity: DVec3::X, mass: 1.0, collider: None };
        let particle = self.world.add_particle(particle).unwrap();
        self.show(particle, 0, DVec3::ZERO);
        let spinning = RigidBodyDesc { angular_velocity: DVec3::ONE, ..RigidBodyDesc::new(at, 2.0, DVec3::ONE) };
        let body = self.world.add_rigid_body(spinning).unwrap();
        self.show(body, 0, DVec3::new(0.4, 0.0, 0.1));
    }

    /// One joint of every kind.
    fn add_articulated(&mut self) {
        let mass = Shape::Box { half: DVec3::new(0.2, 0.1, 0.3) }.mass_properties(Density::constant(500.0)).unwrap();
        let axis = DVec3::new(1.0, 2.0, 0.5);
        let kinds = [
            JointKind::Free,
            JointKind::Ball,
            JointKind::Hinge { axis },
            JointKind::Universal { axes: [DVec3::X, DVec3::Y] },
            JointKind::Slider { axis },
            JointKind::Fixed,
        ];
        let part = |(index, kind): (u32, JointKind)| PartDesc {
            name: format!("part {index}"),
            mass,
            parent: index.checked_sub(1),
            joint: JointDesc {
                rest: DQuat::from_rotation_y(0.3 * f64::from(index)),
                ..JointDesc::new(kind).at(DVec3::X * 0.2, DVec3::new(-0.2, 0.1, 0.0))
            },
        };
        let figure = Articulated::new((0..).zip(kinds).map(part).collect()).unwrap();
        let mut v = figure.still();
        (0..).zip(&mut v).for_each(|(i, v)| *v = 0.5 + 0.1 * f64::from(i));
        let q = figure.rest();
        let desc = FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() };
        let body = self.world.add_figure(desc).unwrap();
        (0..6).for_each(|part| self.show(body, part, DVec3::new(0.1, 0.2, 0.3)));
    }

    /// A part in four points, one in two and one in one.
    fn add_natural(&mut self) {
        let ball = Shape::Ball { radius: 0.2 }.mass_properties(Density::constant(500.0)).unwrap();
        let part = |name: &str, points: Vec<u32>, position| NaturalPart {
            name: name.to_owned(),
            points,
            position,
            rotation: DQuat::IDENTITY,
            mass: ball,
        };
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(2.0, 0.0, 0.0)];
        let parts = vec![
            part("body", vec![0, 1, 2, 3], DVec3::splat(0.25)),
            part("rod", vec![1, 4], DVec3::X * 1.5),
            part("knob", vec![4], DVec3::X * 2.0),
        ];
        let figure = Natural::new(NaturalDesc { points, rods: Vec::new(), parts }.with_edges()).unwrap();
        let q = figure.placed(DVec3::new(-5.0, 1.0, 0.0), DQuat::from_rotation_z(0.4));
        let v = figure.moving(&q, DVec3::ZERO, DVec3::X, DVec3::new(0.3, 1.0, 0.2));
        let desc = FigureDesc { dof: Arc::new(figure), q, v, colliders: Vec::new() };
        let body = self.world.add_figure(desc).unwrap();
        (0..3).for_each(|part| self.show(body, part, DVec3::new(0.0, 0.1, 0.0)));
    }

    /// A jelly that is fixed below, with its upper side as a skin, and a lattice.
    fn add_elastic(&mut self) {
        let material = Elastic::new(5e4, 0.3).unwrap();
        let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, [2, 2, 2]).unwrap();
        let on = |y: f64| (0u32..).zip(mesh.nodes()).filter(move |(_, node)| (node.y - y).abs() < 1e-6);
        let fixed: Vec<u32> = on(0.0).map(|(index, _)| index).collect();
        let jelly = FiniteElements::new(&mesh, material, Density::constant(1000.0), &fixed).unwrap();
        let top: Vec<PartPoint> = on(1.0).filter_map(|(index, _)| jelly.at_node(index)).collect();
        let (q, mut v) = (jelly.rest(), jelly.still());
        v.iter_mut().step_by(3).for_each(|x| *x = 1.0);
        let elements = jelly_parts(&jelly);
        let body = self.world.add_figure(FigureDesc { dof: Arc::new(jelly), q, v, colliders: Vec::new() }).unwrap();
        (0..elements).for_each(|part| self.show(body, part, DVec3::new(0.3, 0.2, 0.6)));
        let points = top.iter().map(|at| at.point).collect();
        let part = PartInfo::skin(&self.world, body, &top, Shape::Hull { points, radius: 0.0 });
        self.shown.push(Shown { body, at: top, part });

        let solid = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| [-1.0, 1.0].map(|z| DVec3::new(x, y, z))));
        let (min, max) = (DVec3::splat(-1.0), DVec3::splat(1.0));
        let density = Density::constant(500.0);
        let desc = LatticeDesc { min, max, cells: [2, 1, 3], material, density, damping: 0.0 };
        let lattice = Lattice::new(&Polyhedron::of_hull(solid.as_flattened().as_flattened()).unwrap(), desc).unwrap();
        let at = lattice.at(DVec3::new(0.4, -0.3, 0.8)).unwrap();
        let (q, mut v) = (lattice.placed(DVec3::Y * 9.0, DQuat::from_rotation_x(2.0)), lattice.still());
        (0..).zip(&mut v).for_each(|(i, v)| *v = 0.1 * f64::from(i % 5));
        let body = self.world.add_figure(FigureDesc { dof: Arc::new(lattice), q, v, colliders: Vec::new() }).unwrap();
        self.show(body, at.part, at.point);
    }
}

fn jelly_parts(jelly: &FiniteElements) -> u32 {
    use pita_sim::Dof;
    jelly.parts()
}

/// Thirty ticks of a stream. Steps of a millimetre, and of 1/1500 at each of five joints one after the other, allow for so
/// much.
#[test]
fn clients_show_parts_of_every_kind_where_the_engine_has_them() {
    let mut zoo = Zoo::new();
    let parts = zoo.shown.iter().map(|shown| shown.part.clone()).collect();
    let info = ActorInfo { id: 1, kind: "zoo", name: String::new(), slot: None, parts };
    let described = description::actor(&info);
    assert_eq!(described.parts.len(), zoo.shown.len(), "each of these shapes is one on the wire");
    let (mut encoder, mut decoder) = (Encoder::default(), Decoder::default());
    let mut state = State::new(Precision::default()).unwrap();
    for tick in 1..=30 {
        zoo.world.step();
        let mut frame = Frame::default();
        // As actors of their own: bodies are not attached to each other.
        frame.copy_state(&zoo.world, std::iter::empty());
        frame.quantise(&mut state, &mut Crowd::default());
        let bytes = encoder.encode(tick, &state, &[]);
        let slices = decoder.decode(tick, &bytes).unwrap().slices(TICK_HZ);
        encoder.acknowledge(tick, 0);
        let kinds: Vec<_> = slices.iter().map(|slice| slice.kind).collect();
        let all = [kind::PARTICLE, kind::RIGID_BODY, kind::ARTICULATED, kind::NATURAL];
        assert_eq!(kinds, [&all[..], &[kind::FINITE_ELEMENTS, kind::LATTICE]].concat());
        for (shown, part) in zoo.shown.iter().zip(&described.parts) {
            let slice = slices.iter().find(|slice| slice.id == part.slice).unwrap();
            let frames = shown.at.iter().map(|&at| zoo.world.frame(shown.body, at).unwrap());
            if let Some(vertices) = part_vertices(part, slice) {
                let off = vertices.iter().zip(frames).map(|(vertex, frame)| vertex.distance(frame.position.into()));
                assert!(off.fold(0.0, f64::max) < 2e-3, "a vertex of the skin in tick {tick}");
                continue;
            }
            let pose = part_pose(part, slice).unwrap();
            let frame = frames.into_iter().next_back().unwrap();
            let off = pose.position.distance(DVec3::from(frame.position));
            let engine: DMat3 = frame.rotation.value();
            let turned = pose.rotation.angle_between(DQuat::from_mat3(&engine).normalize()).to_degrees();
            assert!(off < 8e-3 && turned < 0.6, "{:?} in tick {tick}: {off} m, {turned} degrees", part.mount);
        }
    }
}
