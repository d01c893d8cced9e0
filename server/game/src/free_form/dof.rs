//! The degrees of freedom of a deformation: a kind of DOF of the game's own ([`pita_sim::Dof`]), so that the integrator
//! moves what is drawn like everything else, with an ease of its own, and the network sends it.

use glam::{DMat3, DVec3};
use pita_sim::dof::{BlockSize, Columns, Inertia, LocalState, PointMasses};
use pita_sim::{Dof, DofKind, Frame, PartPoint, PdGains};

use super::Appearance;

/// Blocks of three numbers.
const BLOCKS: usize = Appearance::NUMBERS / 3;

/// An [`Appearance`] as Q: its numbers, each of mass 1 on a damped spring towards the number that the controls ask for.
pub struct AppearanceDof {
    masses: PointMasses,
    /// Of the springs: how the numbers follow what they are asked to be.
    gains: PdGains,
    /// What stands for its place where somebody asks for one, m.
    place: DVec3,
    /// Nothing here has weight: what the world's gravity, m/s², does to the numbers is taken back.
    gravity: DVec3,
}

impl AppearanceDof {
    /// The numbers of something at `place`, m, in a world with `gravity`, m/s².
    pub fn new(place: DVec3, gravity: DVec3, gains: PdGains) -> Self {
        let mut masses = PointMasses::new(BLOCKS);
        masses.diagonal.fill(1.0);
        Self { masses, gains, place, gravity }
    }
}

impl Dof for AppearanceDof {
    fn kind(&self) -> DofKind {
        DofKind::Own("appearance")
    }

    fn blocks(&self) -> &[BlockSize] {
        &[BlockSize { positions: 3, rates: 3 }; BLOCKS]
    }

    fn parts(&self) -> u32 {
        1
    }

    /// It moves no point of the world.
    fn frame(&self, _at: PartPoint, _q: &[f64], _v: &[f64]) -> Frame<f64> {
        Frame::point(self.place, DVec3::ZERO)
    }

    fn jacobian(&self, _at: PartPoint, _q: &[f64], _visit: &mut dyn FnMut(usize, &Columns)) {}

    fn inertia(&self) -> Inertia<'_> {
        Inertia::Points(&self.masses)
    }

    /// The numbers that are asked for.
    fn controls(&self) -> Vec<f64> {
        Appearance::PLAIN.numbers().to_vec()
    }

    fn energy(&self, at: &LocalState, gradient: &mut [f64]) -> f64 {
        let weight = self.gravity.to_array().into_iter().cycle();
        let PdGains { stiffness, damping } = self.gains;
        let mut energy = 0.0;
        for (i, (gradient, weight)) in gradient.iter_mut().zip(weight).enumerate() {
            let (off, rate) = (at.q1[i] - at.controls[i], at.v1[i]);
            energy += 0.5 * (stiffness * off * off + damping * at.dt * rate * rate) + weight * at.q1[i];
            *gradient += stiffness * off + damping * rate + weight;
        }
        energy
    }

    fn point_stiffness(&self, at: &LocalState, own: &mut [DMat3], _pairs: &mut [DMat3]) {
        let stiffness = self.gains.stiffness + self.gains.damping / at.dt;
        own.iter_mut().for_each(|block| *block += DMat3::IDENTITY * stiffness);
    }
}
