//! A body of a general kind in the world: its [`Dof`], what it collides with, and what it remembers.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::interface::{BLOCK_RATES_MAX, Dof, Inertia, LocalState, PartPoint};
use super::{Motion, Placed};
use crate::collide::{Collider, EmbeddedHull};
use crate::elimination::minimum_degree;
use crate::error::{LARGEST, SimError, require, require_vector};
use crate::integrate::figure::part_momentum;
use crate::potential::hold::Memory;
use crate::settings::Settings;

/// A body of a general kind to be added.
pub struct FigureDesc {
    /// What it is.
    pub dof: Arc<dyn Dof>,
    /// Positions, block by block.
    pub q: Vec<f64>,
    /// Rates, block by block.
    pub v: Vec<f64>,
    /// What it collides with.
    pub colliders: Vec<PartCollider>,
}

/// A collider on a part of a body. Colliders of one body do not collide with each other.
#[derive(Clone, Debug)]
pub struct PartCollider {
    /// Where the shape's origin is; its axes are the part's.
    pub at: PartPoint,
    /// Shape and material.
    pub collider: Collider,
}

/// A figure in the world.
#[derive(Clone)]
pub(crate) struct FigureBody {
    pub dof: Arc<dyn Dof>,
    pub colliders: Vec<PartCollider>,
    pub hulls: Vec<EmbeddedHull>,
    /// What steers it.
    pub controls: Vec<f64>,
    /// What code asked to act on each rate in the coming tick, N or N m.
    pub force: Vec<f64>,
    /// Change of the rates in the last tick.
    pub change: Vec<f64>,
    /// What resists each rate at the start, kg or kg m².
    pub masses: Vec<f64>,
    /// In which order its blocks are eliminated: the place of each among them.
    pub ranks: Vec<u32>,
    /// kg.
    pub mass: f64,
    /// Of each of the kind's rods.
    pub rods: Vec<Memory>,
}

impl std::fmt::Debug for FigureBody {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.dof.kind())
    }
}

impl FigureDesc {
    /// # Errors
    /// [`SimError`] naming what is wrong.
    pub(crate) fn validate(&self, dt: f64) -> Result<(), SimError> {
        let blocks = self.dof.blocks();
        let fits = blocks.iter().all(|b| (1..=BLOCK_RATES_MAX).contains(&usize::from(b.rates)));
        if blocks.is_empty() || !fits {
            return Err(SimError::Unusable { what: "a figure needs blocks of 1 to 6 rates" });
        }
        let positions: usize = blocks.iter().map(|b| usize::from(b.positions)).sum();
        let rates: usize = blocks.iter().map(|b| usize::from(b.rates)).sum();
        require(self.q.len() == positions, "length of q", self.q.len() as f64, "the sum of the blocks' positions")?;
        require(self.v.len() == rates, "length of v", self.v.len() as f64, "the sum of the blocks' rates")?;
        for (numbers, what) in [(&self.q, "q"), (&self.v, "v")] {
            numbers.iter().try_for_each(|&x| require(x.abs() < LARGEST, what, x, "finite and below 1e9"))?;
        }
        self.dof.check(&self.q, &self.v)?;
        self.dof.check_controls(&self.dof.controls(), dt)?;
        if let Inertia::Points(masses) = self.dof.inertia() {
            let points =
                blocks.iter().all(|b| (b.positions, b.rates) == (3, 3)) && masses.diagonal.len() == blocks.len();
            if !points {
                return Err(SimError::Unusable { what: "point masses need blocks of three coordinates, one a mass" });
            }
            if masses.off_diagonal.iter().any(|&(i, j, _)| i <= j || i as usize >= blocks.len()) {
                return Err(SimError::Unusable {
                    what: "a mass between points needs two of them, the later one first",
                });
            }
            if self.dof.rods().iter().any(|rod| rod.points.iter().any(|&point| point as usize >= blocks.len())) {
                return Err(SimError::Unusable { what: "a rod is at a point that the body does not have" });
            }
        }
        if let Inertia::Parts(parts) = self.dof.inertia() {
            require(parts.len() == self.dof.parts() as usize, "inertias", parts.len() as f64, "one for every part")?;
        }
        for &m in &masses(&*self.dof, &self.q) {
            require(m > 0.0 && m < LARGEST, "mass of a coordinate", m, "above 0, below 1e9 kg or kg m²")?;
        }
        for part in &self.colliders {
            require_vector(part.at.point, "place of a collider")?;
            require(part.at.part < self.dof.parts(), "part of a collider", f64::from(part.at.part), "a part's index")?;
            part.collider.validate_moving()?;
        }
        Ok(())
    }
}

impl FigureBody {
    pub fn new(desc: FigureDesc, hulls: Vec<EmbeddedHull>) -> Self {
        let mass = match desc.dof.inertia() {
            Inertia::Parts(parts) => parts.iter().map(|part| part.mass).sum(),
            Inertia::Points(masses) => masses.total(),
        };
        let masses = masses(&*desc.dof, &desc.q);
        let (controls, change) = (desc.dof.controls(), vec![0.0; desc.v.len()]);
        let force = change.clone();
        let rods = vec![Memory::default(); desc.dof.rods().len()];
        let ranks = minimum_degree(desc.dof.blocks().len(), &couplings(&*desc.dof, &desc.q));
        Self { controls, force, change, masses, ranks, mass, rods, dof: desc.dof, colliders: desc.colliders, hulls }
    }

    /// The embedded hull with this index among what the figure collides with.
    pub fn hull(&self, index: u32) -> Option<&EmbeddedHull> {
        self.hulls.get((index as usize).checked_sub(self.colliders.len())?)
    }

    /// How much a tick like the last one changes the velocity of a collider's surface beyond what gravity does, m/s; the
    /// surface reaches `radius` from the collider's origin.
    pub fn bend(&self, placed: &Placed, q: &[f64], radius: f64, settings: &Settings) -> f64 {
        let fall = settings.gravity * settings.dt;
        match self.hull(placed.index) {
            None => {
                let change = self.dof.frame(placed.at, q, &self.change).twist();
                (change.linear - fall).length() + change.angular.length() * radius
            }
            Some(hull) => {
                let changes = hull.vertices().iter().map(|&at| self.dof.point(at, q, &self.change)[1]);
                changes.map(|change| (change - fall).length()).fold(0.0, f64::max)
            }
        }
    }

    /// Pulls at a material point with `force`, N, in the coming tick. What it does to each rate is that of where the figure
    /// is now, at `q`.
    pub fn pull(&mut self, at: PartPoint, force: DVec3, q: &[f64]) {
        let Self { dof, force: on_rates, .. } = self;
        let blocks = dof.blocks();
        dof.jacobian(at, q, &mut |block, columns| {
            let start: usize = blocks[..block].iter().map(|block| usize::from(block.rates)).sum();
            let rates = &mut on_rates[start..start + usize::from(blocks[block].rates)];
            for (on_rate, column) in rates.iter_mut().zip(columns) {
                *on_rate += DVec3::from_slice(column).dot(force);
            }
        });
    }

    /// Energy that its own potentials hold, J.
    pub fn stored_energy(&self, q: &[f64], v: &[f64], dt: f64) -> f64 {
        let mut prepared = Vec::new();
        let at =
            LocalState { dt, q0: q, v0: v, q1: q, v1: v, controls: &self.controls, prepared: &[], definite: false };
        self.dof.prepare(&at, &mut prepared);
        self.dof.stored_energy(&LocalState { prepared: &prepared, ..at })
    }

    pub fn motion(&self, q: &[f64], v: &[f64]) -> Motion {
        motion(&*self.dof, q, v)
    }
}

/// How a figure moves as a whole.
pub(crate) fn motion(dof: &dyn Dof, q: &[f64], v: &[f64]) -> Motion {
    let mut sum = Motion::default();
    match dof.inertia() {
        Inertia::Parts(parts) => {
            for (part, inertia) in (0..).zip(parts) {
                let frame = dof.frame(PartPoint { part, point: inertia.centre }, q, v);
                let momentum = part_momentum(&frame, inertia.mass, inertia.inertia);
                let (position, twist) = (DVec3::from(frame.position), frame.twist());
                let (linear, angular) = (DVec3::from(momentum.force), DVec3::from(momentum.torque));
                sum.momentum += linear;
                sum.angular_momentum += position.cross(linear) + angular;
                sum.energy += 0.5 * (linear.dot(twist.linear) + angular.dot(twist.angular));
                sum.moment += inertia.mass * position;
            }
        }
        Inertia::Points(masses) => {
            let point = |numbers: &[f64], i: usize| DVec3::from_slice(&numbers[3 * i..]);
            let mut add = |i: usize, j: usize, m: f64| {
                let (position, velocity) = (point(q, i), point(v, j));
                sum.momentum += m * velocity;
                sum.angular_momentum += position.cross(m * velocity);
                sum.energy += 0.5 * m * point(v, i).dot(velocity);
                sum.moment += m * position;
            };
            masses.diagonal.iter().enumerate().for_each(|(i, &m)| add(i, i, m));
            for &(i, j, m) in &masses.off_diagonal {
                add(i as usize, j as usize, m);
                add(j as usize, i as usize, m);
            }
        }
    }
    sum
}

/// Pairs of blocks that inertia and own potentials couple.
fn couplings(dof: &dyn Dof, q: &[f64]) -> Vec<(u32, u32)> {
    let mut pairs: Vec<_> = dof.rods().iter().map(|rod| (rod.points[0], rod.points[1])).collect();
    dof.couplings(&mut |a, b| pairs.push((a as u32, b as u32)));
    match dof.inertia() {
        Inertia::Points(masses) => pairs.extend(masses.off_diagonal.iter().map(|&(a, b, _)| (a, b))),
        Inertia::Parts(parts) => {
            for (part, inertia) in (0..).zip(parts) {
                let mut movers = Vec::new();
                let at = PartPoint { part, point: inertia.centre };
                dof.jacobian(at, q, &mut |block, _| movers.push(block as u32));
                for (i, &a) in movers.iter().enumerate() {
                    pairs.extend(movers[..i].iter().map(|&b| (a, b)));
                }
            }
        }
    }
    pairs
}

/// The diagonal of the mass matrix at `q`.
fn masses(dof: &dyn Dof, q: &[f64]) -> Vec<f64> {
    match dof.inertia() {
        Inertia::Points(masses) => masses.diagonal.iter().flat_map(|&m| [m; 3]).collect(),
        Inertia::Parts(parts) => {
            let sizes: Vec<_> = dof.blocks().iter().map(|b| usize::from(b.rates)).collect();
            let starts: Vec<usize> = sizes.iter().scan(0, |sum, n| Some(std::mem::replace(sum, *sum + n))).collect();
            let mut diagonal = vec![0.0; sizes.iter().sum()];
            let rest = vec![0.0; diagonal.len()];
            for (part, inertia) in (0..).zip(parts) {
                let at = PartPoint { part, point: inertia.centre };
                let tensor: DMat3 = crate::integrate::figure::world_inertia(&dof.frame(at, q, &rest), inertia.inertia);
                dof.jacobian(at, q, &mut |block, columns| {
                    for (k, column) in columns.iter().enumerate().take(sizes[block]) {
                        let (linear, angular) = (DVec3::from_slice(column), DVec3::from_slice(&column[3..]));
                        let m = inertia.mass * linear.length_squared() + angular.dot(tensor * angular);
                        diagonal[starts[block] + k] += m;
                    }
                });
            }
            diagonal
        }
    }
}
