//! A DOF kind of a game's own, with nothing but the public interface: a free particle in polar coordinates, which has to
//! fly along a straight line.
//!
//! `cargo run -p pita-sim --example own_kind`

mod polar;

use pita_sim::{DVec3, Settings, SimError, World};
use polar::PolarParticle;

fn main() -> Result<(), SimError> {
    let dt = 1.0 / 30.0;
    let mut settings = Settings { gravity: DVec3::ZERO, ..Settings::at(dt) };
    // What is left of the residual is left in the velocity; the table is to show the scheme.
    settings.solver.tolerance = 1e-9;
    let mut world = World::new(settings)?;
    let (mass, radius, speed) = (2.0, 1.0, 1.0);
    // At (1, 0), and off along y: at first nothing but the angle changes.
    let particle = world.add_figure(PolarParticle::describe(mass, [radius, 0.0], [0.0, speed / radius]))?;
    println!("{:>5} {:>10} {:>14} {:>10} {:>14}", "t, s", "r, m", "exact r, m", "energy, J", "exact energy, J");
    for tick in 0..=150 {
        if tick % 15 == 0 {
            let t = f64::from(tick) * dt;
            let r = world.slice(particle).map_or(f64::NAN, |slice| slice.q[0]);
            let exact = DVec3::new(radius, speed * t, 0.0).length();
            let (energy, kept) = (world.energy().total(), 0.5 * mass * speed * speed);
            println!("{t:>5.1} {r:>10.4} {exact:>14.4} {energy:>10.6} {kept:>14.6}");
        }
        world.step();
    }
    Ok(())
}
