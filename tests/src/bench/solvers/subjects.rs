//! What is solved: the yardstick's scenes, and bodies that bend.

use std::sync::Arc;

use pita_game::scene::Scene;
use pita_sim::mass::{Density, Polyhedron};
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{
    Collider, DQuat, DVec3, FigureDesc, FiniteElements, Lattice, LatticeDesc, PartCollider, Settings, Shape,
    StaticDesc, World,
};

use crate::bench::EntryError;
use crate::yardstick::scene::Content;
use crate::yardstick::{TICK_HZ, catalogue};

/// A world to be solved.
pub struct Subject {
    /// For tables and plots.
    pub name: &'static str,
    /// What is in it.
    pub what: &'static str,
    /// Ready for its first tick.
    pub world: fn() -> Result<World, EntryError>,
}

/// All of them.
pub const SUBJECTS: &[Subject] = &[
    Subject { name: "sheep", what: "100 sheep of 4 bodies and 3 ball joints, dropped", world: || rigid("sheep100") },
    Subject { name: "car", what: "16 cars that drive in circles", world: || rigid("cars16") },
    Subject { name: "chain", what: "a hanging chain with a heavy end", world: || rigid("chain") },
    Subject { name: "pile", what: "100 boxes that fall on a heap", world: || rigid("pile100") },
    Subject { name: "jelly", what: "a block of jelly of 750 tetrahedra that is pushed aside", world: jelly },
    Subject {
        name: "lattice",
        what: "a tower in a lattice of 54 cells that lands on an edge and rocks",
        world: lattice,
    },
];

fn rigid(name: &str) -> Result<World, EntryError> {
    match catalogue::content(name) {
        Some(Content::Rigid(_, scene)) => Ok(Scene::parse(&scene.to_string(), &Settings::at(TICK_HZ.recip()))?.world),
        _ => Err(format!("the yardstick has no rigid scene '{name}'").into()),
    }
}

/// A cube of 1 m that stands on its lower face and is thrown to the side.
fn jelly() -> Result<World, EntryError> {
    const CELLS: [u32; 3] = [5, 5, 5];
    let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::ONE, CELLS)?;
    let floor = (0..).zip(mesh.nodes()).filter(|(_, node)| node.y < 1e-6).map(|(index, _)| index);
    let floor: Vec<u32> = floor.collect();
    let jelly = FiniteElements::new(&mesh, Elastic::new(2e5, 0.4)?, Density::constant(1000.0), &floor)?;
    let (q, mut v) = (jelly.rest(), jelly.still());
    v.iter_mut().step_by(3).for_each(|x| *x = 2.0);
    let mut world = World::new(Settings::at(TICK_HZ.recip()))?;
    world.add_figure(FigureDesc { dof: Arc::new(jelly), q, v, colliders: Vec::new() })?;
    Ok(world)
}

/// A tower of 2 m with a pointed roof that starts to fall from a height of 0.2 m, tilted by 0.2 rad. It lands on its
/// vertices: balls of 5 cm.
fn lattice() -> Result<World, EntryError> {
    const HALF: f64 = 0.3;
    let mut vertices = vec![DVec3::Y * 2.0];
    for (x, z) in [(-HALF, -HALF), (HALF, -HALF), (-HALF, HALF), (HALF, HALF)] {
        vertices.extend([DVec3::new(x, 0.0, z), DVec3::new(0.8 * x, 1.5, 0.8 * z)]);
    }
    let desc = LatticeDesc {
        min: DVec3::new(-HALF, 0.0, -HALF),
        max: DVec3::new(HALF, 2.0, HALF),
        cells: [3, 6, 3],
        material: Elastic::new(5e5, 0.3)?,
        density: Density::constant(500.0),
        damping: 0.01,
    };
    let tower = Lattice::new(&Polyhedron::of_hull(&vertices)?, desc)?;
    let collider = Collider::new(Shape::Ball { radius: 0.05 }, 0.5);
    let at = vertices.iter().filter_map(|&vertex| tower.at(vertex));
    let colliders = at.map(|at| PartCollider { at, collider: collider.clone() }).collect();
    let (q, v) = (tower.placed(DVec3::Y * 0.2, DQuat::from_rotation_z(0.2)), tower.still());
    let mut world = World::new(Settings::at(TICK_HZ.recip()))?;
    world.add_static(StaticDesc::new(Collider::new(Shape::HalfSpace { normal: DVec3::Y }, 0.5)))?;
    world.add_figure(FigureDesc { dof: Arc::new(tower), q, v, colliders })?;
    Ok(world)
}
