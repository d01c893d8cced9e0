//! Bodies of general kinds within an island: all of them, and the material points at which something acts on them.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::attachment::{Attachment, Follows, Influence};
use super::block::{Block, Entry, zero};
use super::figure::{Figure, part_momentum, world_inertia};
use super::pull_back::{add_block, inertia_block, pull_back};
use crate::collide::Foot;
use crate::dof::{ABSENT, Columns, FigureBody, Frame, Inertia, PartPoint, Twist};
use crate::potential::gravity::Gravity;
use crate::potential::{BetweenFrames, Wrench};

/// Takes blocks of a symmetric matrix.
pub(crate) trait Blocks {
    /// Adds at (row, column), row not above column; (column, row) is its transpose. Rates from R on get nothing.
    fn add<const R: usize>(&mut self, row: u32, column: u32, block: &Block<R>);

    /// The same for a block of points: `block` and `mass` times the identity.
    fn add_point(&mut self, row: u32, column: u32, block: &DMat3, mass: f64);
}

/// All figures of an island and their attachments.
#[derive(Default)]
pub(crate) struct Figures {
    list: Vec<Figure>,
    /// Figures of this tick; those after them keep their memory for later.
    used: usize,
    pub attachments: Vec<Attachment>,
    influences: Vec<Influence>,
    /// Gradient on each attachment.
    wrenches: Vec<Wrench>,
    /// Hessian on each attachment.
    hessians: Vec<Block<6>>,
    /// Whether the figures' second derivatives have to be positive semidefinite.
    definite: bool,
}

/// How many of the last attachments are looked at for one that a new one can share: those of the other contact points of
/// the same pair of colliders.
const SHARED: usize = 4;

impl Figures {
    pub fn clear(&mut self) {
        self.used = 0;
        self.attachments.clear();
        self.influences.clear();
        self.definite = false;
    }

    /// From now on second derivatives are positive semidefinite. Answers whether that changes anything.
    pub fn require_definite(&mut self) -> bool {
        let changes = !self.definite && self.used > 0;
        self.definite = true;
        changes
    }

    pub fn list(&self) -> &[Figure] {
        &self.list[..self.used]
    }

    /// Whether there are figures whose points carry the mass.
    pub fn have_points(&self) -> bool {
        self.list().iter().any(|figure| matches!(figure.dof.inertia(), Inertia::Points(_)))
    }

    /// Adds a figure with blocks at `blocks`. Answers its index.
    pub fn add(&mut self, body: &FigureBody, blocks: impl Iterator<Item = u32>, [q, v]: [&[f64]; 2], dt: f64) -> u32 {
        if self.used == self.list.len() {
            self.list.push(Figure::new(&body.dof));
        }
        let figure = &mut self.list[self.used];
        figure.dof = Arc::clone(&body.dof);
        figure.start(blocks, [q, v], body);
        figure.prepare(dt);
        self.used += 1;
        self.used as u32 - 1
    }

    /// Attaches the parts' centres of mass, where parts carry the mass.
    pub fn attach_parts(&mut self, index: u32, dt: f64, gravity: Gravity) {
        let dof = Arc::clone(&self.list[index as usize].dof);
        let start = self.attachments.len() as u32;
        self.list[index as usize].free_momenta.clear();
        if let Inertia::Parts(parts) = dof.inertia() {
            for (part, inertia) in (0..).zip(parts) {
                let k = self.attach(index, PartPoint { part, point: inertia.centre }, Follows::Figure);
                let momentum = part_momentum(&self.attachments[k as usize].start, inertia.mass, inertia.inertia);
                let fall = Wrench { force: (gravity.fall(dt) * inertia.mass).into(), torque: Wrench::ZERO.torque };
                let mut free = momentum;
                free += fall;
                self.list[index as usize].free_momenta.push(free);
            }
        }
        self.list[index as usize].parts = start..self.attachments.len() as u32;
    }

    /// Makes a frame of a material point. Answers its index among the attachments.
    pub fn attach(&mut self, figure: u32, at: PartPoint, follows: Follows) -> u32 {
        let Self { list, attachments, influences, .. } = self;
        let owner = &list[figure as usize];
        let follows = match follows {
            Follows::Place if !owner.dof.is_linear(at) => Follows::Figure,
            _ => follows,
        };
        let same = |a: &Attachment| (a.figure, a.at, a.follows) == (figure, at, follows);
        if let Some(back) = attachments.iter().rev().take(SHARED).position(same) {
            return (attachments.len() - 1 - back) as u32;
        }
        let first = influences.len();
        let mut visit = |own_block: usize, columns: &Columns| {
            let (block, size) = (owner.blocks[own_block], owner.dof.blocks()[own_block].rates);
            influences.push(Influence { block, own_block: own_block as u32, size, columns: *columns });
        };
        let start = if follows == Follows::Place {
            owner.dof.place_jacobian(at, &owner.q0, &mut visit);
            let [position, velocity] = owner.dof.point(at, &owner.q0, &owner.v0);
            Frame::point(position, velocity)
        } else {
            owner.dof.frame_and_jacobian(at, &owner.q0, &owner.v0, &mut visit)
        };
        let movers = &influences[first..];
        let (mass, inverse_inertia) = (owner.mass_at(at, movers), owner.inverse_inertia_at(at, movers));
        let influences = (first as u32, influences.len() as u32);
        attachments.push(Attachment { figure, at, follows, influences, start, mass, inverse_inertia });
        attachments.len() as u32 - 1
    }

    /// Makes a frame of a point between vertices, which turns as the body does there. Answers its index among the
    /// attachments.
    pub fn attach_foot(&mut self, figure: u32, foot: &Foot) -> u32 {
        let Self { list, influences, .. } = self;
        let owner = &list[figure as usize];
        let first = influences.len();
        let mut position = DVec3::ZERO;
        for &(at, weight) in foot.iter().filter(|(_, weight)| *weight > 0.0) {
            position += weight * owner.dof.point(at, &owner.q0, &owner.v0)[0];
            owner.dof.jacobian(at, &owner.q0, &mut |own_block, columns| {
                add_influence(influences, first, owner, own_block, weight, columns);
            });
        }
        let range = (first as u32, influences.len() as u32);
        let movers = &influences[first..];
        let vertex = foot[0].0;
        let (mass, inverse_inertia) = (owner.mass_at(vertex, movers), owner.inverse_inertia_at(vertex, movers));
        // No other attachment is at the same place.
        let at = PartPoint { part: ABSENT, point: position };
        let Twist { linear, angular } = owner.twist(movers, &owner.v0);
        let start = Frame { angular: angular.into(), ..Frame::point(position, linear) };
        let follows = Follows::Start;
        self.attachments.push(Attachment { figure, at, follows, influences: range, start, mass, inverse_inertia });
        self.attachments.len() as u32 - 1
    }

    /// How blocks move attachment `k`.
    pub fn influences(&self, k: usize) -> &[Influence] {
        let (start, end) = self.attachments[k].influences;
        &self.influences[start as usize..end as usize]
    }

    /// Moves everything to the rates `u`. `frames` are the island's: one for each of the `u`, then the attachments'.
    pub fn move_to<const D: usize>(&mut self, u: &[Entry<D>], dt: f64, frames: &mut Vec<Frame<f64>>) {
        for figure in &mut self.list[..self.used] {
            figure.move_to(u, dt, frames);
        }
        for attachment in &self.attachments {
            let figure = &self.list[attachment.figure as usize];
            let (start, end) = attachment.influences;
            let influences = &mut self.influences[start as usize..end as usize];
            frames.push(attachment.frame(figure, influences));
        }
    }

    /// Whether one of the figures is made of parts.
    pub fn have_parts(&self) -> bool {
        self.list().iter().any(|figure| !figure.parts.is_empty())
    }

    /// Forgets the gradient on attachments.
    pub fn begin_gradient(&mut self) {
        self.wrenches.clear();
        self.wrenches.resize(self.attachments.len(), Wrench::ZERO);
    }

    /// Adds to the gradient on attachment `k`.
    pub fn push(&mut self, k: usize, wrench: Wrench) {
        self.wrenches[k] += wrench;
    }

    /// Adds the figures' own residuals and everything that acts on attachments. Answers the energy.
    pub fn evaluate<const D: usize>(
        &mut self,
        dt: f64,
        gravity: Gravity,
        frames: &[Frame<f64>],
        residual: &mut [Entry<D>],
    ) -> f64 {
        let attached = &frames[residual.len()..];
        let mut energy = 0.0;
        for figure in &mut self.list[..self.used] {
            energy += figure.evaluate(dt, gravity, attached, &mut self.wrenches, residual);
        }
        for (k, wrench) in self.wrenches.iter().enumerate().filter(|(_, wrench)| **wrench != Wrench::ZERO) {
            let numbers = wrench.numbers();
            // Nothing turns a place.
            let rows = if self.attachments[k].follows == Follows::Place { 3 } else { 6 };
            for influence in self.influences(k) {
                let entry = &mut residual[influence.block as usize];
                for (entry, column) in entry.iter_mut().zip(&influence.columns) {
                    *entry += column.iter().zip(&numbers).take(rows).map(|(c, w)| c * w).sum::<f64>();
                }
            }
        }
        energy
    }

    /// Forgets the Hessian on attachments.
    pub fn begin_hessian(&mut self) {
        self.hessians.clear();
        self.hessians.resize(self.attachments.len(), zero());
    }

    /// Adds to the Hessian on attachment `k` what a term has there at its `end`.
    pub fn stiffen(&mut self, k: usize, term: &impl BetweenFrames, end: usize, factor: f64) {
        let target = &mut self.hessians[k];
        if self.attachments[k].follows == Follows::Place {
            add_block(target, &term.own::<3>(end), factor);
        } else {
            add_block(target, &term.own::<6>(end), factor);
        }
    }

    /// Hands over the blocks of the figures' inertia, of their own potentials, and of what acts on single attachments.
    pub fn assemble(&mut self, dt: f64, frames: &[Frame<f64>], blocks: &mut impl Blocks) {
        let attached = &frames[frames.len() - self.attachments.len()..];
        for (index, figure) in (0..).zip(&mut self.list[..self.used]) {
            figure.load(index, &self.attachments, &self.wrenches, attached);
            figure.stiffen_points(dt, self.definite);
            match figure.dof.inertia() {
                Inertia::Points(masses) => figure.assemble_points(masses, dt * dt, blocks),
                Inertia::Parts(parts) => {
                    for ((k, part), &geometric) in (figure.parts.start as usize..).zip(parts).zip(&figure.geometric) {
                        let turning = world_inertia(&attached[k], part.inertia) + geometric * dt;
                        add_block(&mut self.hessians[k], &inertia_block(part.mass, turning), 1.0);
                    }
                    figure.assemble_stiffness(dt, self.definite, blocks);
                }
            }
        }
        for (k, hessian) in self.hessians.iter().enumerate() {
            pull_back(hessian, self.attachments[k].follows == Follows::Place, self.influences(k), blocks);
        }
    }

    /// Hands `pair` every pair of different blocks that [`Figures::assemble`] touches.
    pub fn couplings(&self, pair: &mut impl FnMut(u32, u32)) {
        for figure in self.list() {
            let blocks = &figure.blocks;
            figure.dof.couplings(&mut |a, b| pair(blocks[a], blocks[b]));
            if let Inertia::Points(masses) = figure.dof.inertia() {
                masses.off_diagonal.iter().for_each(|&(a, b, _)| pair(blocks[a as usize], blocks[b as usize]));
            }
        }
        for k in 0..self.attachments.len() {
            let influences = self.influences(k);
            for (i, a) in influences.iter().enumerate() {
                influences[..i].iter().for_each(|b| pair(a.block, b.block));
            }
        }
    }

    /// Hands `pair` the two blocks of every pair of points, in the order in which [`Figures::assemble`] adds them.
    pub fn point_pairs(&self, pair: &mut impl FnMut(u32, u32)) {
        for figure in self.list() {
            if let Inertia::Points(masses) = figure.dof.inertia() {
                let blocks = &figure.blocks;
                masses.off_diagonal.iter().for_each(|&(a, b, _)| pair(blocks[a as usize], blocks[b as usize]));
            }
        }
    }
}

/// Adds how a block moves a vertex to the influences from `first` on; what does not move it is left out.
fn add_influence(
    influences: &mut Vec<Influence>,
    first: usize,
    owner: &Figure,
    own_block: usize,
    weight: f64,
    columns: &Columns,
) {
    let size = owner.dof.blocks()[own_block].rates;
    if columns[..usize::from(size)].iter().flatten().all(|&x| x == 0.0) {
        return;
    }
    let block = owner.blocks[own_block];
    let known = influences[first..].iter().position(|influence| influence.block == block);
    let place = known.map_or(influences.len(), |known| first + known);
    if known.is_none() {
        influences.push(Influence { block, own_block: own_block as u32, size, columns: Columns::default() });
    }
    let sums = influences[place].columns.iter_mut().flatten();
    sums.zip(columns.iter().flatten()).for_each(|(sum, x)| *sum += weight * x);
}
