//! A beam of rubber, clamped at one end and let go: finite elements with nothing but the public interface, and what they
//! cost.
//!
//! `cargo run --release -p pita-sim --example soft_beam`

use std::sync::Arc;
use std::time::Instant;

use pita_sim::mass::Density;
use pita_sim::mesh::TetrahedralMesh;
use pita_sim::potential::elasticity::Elastic;
use pita_sim::{DVec3, FigureDesc, FiniteElements, Settings, SimError, World};

const LENGTH: f64 = 2.0;

fn main() -> Result<(), SimError> {
    let mesh = TetrahedralMesh::of_box(DVec3::ZERO, DVec3::new(LENGTH, 0.4, 0.4), [10, 2, 2])?;
    let nodes_where = |chosen: fn(f64) -> bool| {
        let nodes = (0..).zip(mesh.nodes()).filter(move |(_, node)| chosen(node.x));
        nodes.map(|(index, _)| index).collect::<Vec<u32>>()
    };
    let (clamped, tip) = (nodes_where(|x| x < 1e-6), nodes_where(|x| x > LENGTH - 1e-6));
    let beam = FiniteElements::new(&mesh, Elastic::new(10e6, 0.3)?, Density::constant(1000.0), &clamped)?;
    let tip: Vec<usize> = tip.iter().filter_map(|&node| beam.point_of_node(node)).collect();

    let mut world = World::new(Settings::at(1.0 / 30.0))?;
    let (q, v) = (beam.rest(), beam.still());
    let beam = world.add_figure(FigureDesc { dof: Arc::new(beam), q, v, colliders: Vec::new() })?;
    let height = |world: &World| {
        let q = world.slice(beam).map_or(&[][..], |slice| slice.q);
        tip.iter().map(|&point| q[3 * point + 1]).sum::<f64>() / tip.len() as f64
    };
    let start = height(&world);
    let (mut times, mut iterations, mut lowest, mut sag) = (Vec::new(), Vec::new(), 0.0f64, 0.0);
    for tick in 0..300 {
        let began = Instant::now();
        world.step();
        times.push(began.elapsed().as_secs_f64() * 1e3);
        iterations.push(world.report().iterations);
        let sunk = height(&world) - start;
        lowest = lowest.min(sunk);
        sag += if tick < 150 { 0.0 } else { sunk / 150.0 };
    }
    times.sort_by(f64::total_cmp);
    iterations.sort_unstable();
    println!("tick: {:.3} ms p50, {:.3} ms p99", times[150], times[297]);
    println!("Newton iterations: {} p50, {} at most", iterations[150], iterations[299]);
    println!("tip: {:.1} mm on average over the last 5 s, {:.1} mm at the lowest", 1e3 * sag, 1e3 * lowest);
    Ok(())
}
