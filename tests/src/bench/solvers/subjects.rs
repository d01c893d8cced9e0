//! What is solved: the yardstick's scenes, and bodies that bend.

use std::sync::Arc;

use pita_game::scene::Scene;
use pita_sim::mass::Density;
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{DVec3, FigureDesc, FiniteElements, Settings, World};

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
