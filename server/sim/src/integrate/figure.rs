//! Bodies of general kinds within an island: their blocks of unknowns, the material points at which something acts on
//! them, and their own residual.

use std::ops::Range;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::attachment::{Attachment, Influence, trace};
use super::block::{Block, Entry, zero};
use super::pull_back::{add_block, inertia_block, multiplied, projected};
use crate::collide::Foot;
use crate::dof::{
    ABSENT, Columns, Dof, FigureBody, Frame, Inertia, LocalState, PartInertia, PartLoad, PartPoint, PointMasses, Twist,
};
use crate::potential::Wrench;
use crate::potential::gravity::Gravity;

/// A body of a general kind in an island.
pub(crate) struct Figure {
    pub dof: Arc<dyn Dof>,
    /// Index in the island of each of its blocks.
    pub blocks: Vec<u32>,
    /// Where each block's rates start among the body's.
    pub offsets: Vec<u32>,
    pub q0: Vec<f64>,
    pub v0: Vec<f64>,
    pub q1: Vec<f64>,
    pub v1: Vec<f64>,
    controls: Vec<f64>,
    /// What code asked to act on each rate, N or N m.
    force: Vec<f64>,
    prepared: Vec<f64>,
    gradient: Vec<f64>,
    /// The parts' centres of mass among the attachments; empty where points carry the mass.
    parts: Range<u32>,
    /// Momentum that each part would have at the end of the tick without potentials.
    free_momenta: Vec<Wrench>,
    loads: Vec<PartLoad>,
    /// Stiffness of each part against turns that comes from its loads, N m s.
    geometric: Vec<DMat3>,
    /// Of points: stiffness of each by itself and of each pair of the mass matrix, N/m.
    own_stiffness: Vec<DMat3>,
    pair_stiffness: Vec<DMat3>,
}

/// Takes blocks of a symmetric matrix.
pub(crate) trait Blocks {
    /// Adds at (row, column), row not above column; (column, row) is its transpose.
    fn add(&mut self, row: u32, column: u32, block: &Block<6>);

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
                let k = self.attach(index, PartPoint { part, point: inertia.centre }, false);
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
    pub fn attach(&mut self, figure: u32, at: PartPoint, frozen: bool) -> u32 {
        let same = |a: &Attachment| (a.figure, a.at, a.frozen) == (figure, at, frozen);
        if let Some(back) = self.attachments.iter().rev().take(SHARED).position(same) {
            return (self.attachments.len() - 1 - back) as u32;
        }
        let Self { list, influences, .. } = self;
        let owner = &list[figure as usize];
        let first = influences.len() as u32;
        owner.dof.jacobian(at, &owner.q0, &mut |own_block, columns| {
            let (block, size) = (owner.blocks[own_block], owner.dof.blocks()[own_block].rates);
            influences.push(Influence { block, own_block: own_block as u32, size, columns: *columns });
        });
        let range = (first, influences.len() as u32);
        let start = owner.dof.frame(at, &owner.q0, &owner.v0);
        let movers = &influences[first as usize..];
        let (mass, inverse_inertia) = (owner.mass_at(at, movers), owner.inverse_inertia_at(at, movers));
        self.attachments.push(Attachment { figure, at, frozen, influences: range, start, mass, inverse_inertia });
        self.attachments.len() as u32 - 1
    }

    /// Makes a frame, which does not turn, of a point between vertices. Answers its index among the attachments.
    pub fn attach_foot(&mut self, figure: u32, foot: &Foot) -> u32 {
        let Self { list, influences, .. } = self;
        let owner = &list[figure as usize];
        let first = influences.len();
        let (mut position, mut velocity) = (DVec3::ZERO, DVec3::ZERO);
        for &(at, weight) in foot.iter().filter(|(_, weight)| *weight > 0.0) {
            let [place, moves] = owner.dof.point(at, &owner.q0, &owner.v0);
            position += weight * place;
            velocity += weight * moves;
            owner.dof.jacobian(at, &owner.q0, &mut |own_block, columns| {
                add_influence(influences, first, owner, own_block, weight, columns);
            });
        }
        let range = (first as u32, influences.len() as u32);
        let mass = owner.mass_at(foot[0].0, &influences[first..]);
        // No other attachment is at the same place.
        let at = PartPoint { part: ABSENT, point: position };
        let start = Frame::point(position, velocity);
        let (frozen, inverse_inertia) = (true, 0.0);
        self.attachments.push(Attachment { figure, at, frozen, influences: range, start, mass, inverse_inertia });
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
        for k in 0..self.attachments.len() {
            let wrench = self.wrenches[k].numbers();
            for influence in self.influences(k) {
                let entry = &mut residual[influence.block as usize];
                for (entry, column) in entry.iter_mut().zip(&influence.columns) {
                    *entry += (0..6).map(|i| column[i] * wrench[i]).sum::<f64>();
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

    /// Adds to the Hessian on attachment `k`.
    pub fn stiffen(&mut self, k: usize, block: &Block<6>, factor: f64) {
        add_block(&mut self.hessians[k], block, factor);
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
            let influences = self.influences(k);
            for b in influences {
                let half = multiplied(hessian, &b.columns);
                for a in influences.iter().filter(|a| a.block >= b.block) {
                    blocks.add(a.block, b.block, &projected(&a.columns, a.size, &half));
                }
            }
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

impl Figure {
    fn new(dof: &Arc<dyn Dof>) -> Self {
        Self {
            dof: Arc::clone(dof),
            blocks: Vec::new(),
            offsets: Vec::new(),
            q0: Vec::new(),
            v0: Vec::new(),
            q1: Vec::new(),
            v1: Vec::new(),
            controls: Vec::new(),
            force: Vec::new(),
            prepared: Vec::new(),
            gradient: Vec::new(),
            parts: 0..0,
            free_momenta: Vec::new(),
            loads: Vec::new(),
            geometric: Vec::new(),
            own_stiffness: Vec::new(),
            pair_stiffness: Vec::new(),
        }
    }

    fn start(&mut self, blocks: impl Iterator<Item = u32>, [q, v]: [&[f64]; 2], body: &FigureBody) {
        self.blocks.clear();
        self.blocks.extend(blocks);
        self.offsets.clear();
        let mut offset = 0;
        for size in self.dof.blocks() {
            self.offsets.push(offset);
            offset += u32::from(size.rates);
        }
        let state = [(&mut self.q0, q), (&mut self.q1, q), (&mut self.v0, v), (&mut self.v1, v)];
        let asked = [(&mut self.controls, &*body.controls), (&mut self.force, &*body.force)];
        for (mine, theirs) in state.into_iter().chain(asked) {
            mine.clear();
            mine.extend_from_slice(theirs);
        }
    }

    fn prepare(&mut self, dt: f64) {
        let mut prepared = std::mem::take(&mut self.prepared);
        prepared.clear();
        self.dof.prepare(&self.local_state(dt, false), &mut prepared);
        self.prepared = prepared;
    }

    /// Island index and own rates of each block.
    fn shares(&self) -> impl Iterator<Item = (usize, Range<usize>)> + '_ {
        let ranges = self.offsets.iter().zip(self.dof.blocks());
        let ranges = ranges.map(|(&start, size)| start as usize..start as usize + usize::from(size.rates));
        self.blocks.iter().map(|&block| block as usize).zip(ranges)
    }

    /// What resists a force at a material point, kg.
    fn mass_at(&self, at: PartPoint, influences: &[Influence]) -> f64 {
        match self.dof.inertia() {
            Inertia::Parts(parts) => parts[at.part as usize].mass,
            Inertia::Points(masses) => {
                let inverse = |i: &Influence| i.columns[0][0].powi(2) / masses.diagonal[i.own_block as usize];
                influences.iter().map(inverse).sum::<f64>().recip()
            }
        }
    }

    /// What a torque turns at a material point, mean over axes, 1/(kg m²).
    fn inverse_inertia_at(&self, at: PartPoint, influences: &[Influence]) -> f64 {
        let trace = match self.dof.inertia() {
            Inertia::Parts(parts) => trace(parts[at.part as usize].inertia.inverse()),
            Inertia::Points(masses) => {
                let squared = |column: &[f64; 6]| DVec3::from_slice(&column[3..]).length_squared();
                let turn = |i: &Influence| i.columns.iter().map(squared).sum::<f64>();
                influences.iter().map(|i| turn(i) / masses.diagonal[i.own_block as usize]).sum()
            }
        };
        trace / 3.0
    }

    fn local_state(&self, dt: f64, definite: bool) -> LocalState<'_> {
        let Self { q0, v0, q1, v1, controls, prepared, .. } = self;
        LocalState { dt, q0, v0, q1, v1, controls, prepared, definite }
    }

    fn move_to<const D: usize>(&mut self, u: &[Entry<D>], dt: f64, frames: &mut [Frame<f64>]) {
        let mut v1 = std::mem::take(&mut self.v1);
        for (block, rates) in self.shares() {
            let size = rates.len();
            v1[rates].copy_from_slice(&u[block][..size]);
        }
        self.v1 = v1;
        self.dof.step(&self.q0, &self.v1, dt, &mut self.q1);
        if let Inertia::Points(_) = self.dof.inertia() {
            for (i, &block) in self.blocks.iter().enumerate() {
                let (position, velocity) = (DVec3::from_slice(&self.q1[3 * i..]), DVec3::from_slice(&self.v1[3 * i..]));
                frames[block as usize] = Frame::point(position, velocity);
            }
        }
    }

    fn evaluate<const D: usize>(
        &mut self,
        dt: f64,
        gravity: Gravity,
        attached: &[Frame<f64>],
        wrenches: &mut [Wrench],
        residual: &mut [Entry<D>],
    ) -> f64 {
        let mut gradient = std::mem::take(&mut self.gradient);
        gradient.clear();
        gradient.resize(self.v1.len(), 0.0);
        let mut energy = self.dof.energy(&self.local_state(dt, false), &mut gradient);
        for (i, force) in self.force.iter().enumerate() {
            gradient[i] -= force;
            energy -= force * dt * (self.v1[i] - self.v0[i]);
        }
        for (block, rates) in self.shares() {
            for (entry, g) in residual[block].iter_mut().zip(&gradient[rates]) {
                *entry += dt * g;
            }
        }
        self.gradient = gradient;
        let dof = Arc::clone(&self.dof);
        energy += match dof.inertia() {
            Inertia::Points(masses) => self.evaluate_points(masses, gravity.fall(dt), residual),
            Inertia::Parts(parts) => {
                let all = (self.parts.start as usize..).zip(parts).zip(&self.free_momenta);
                all.map(|((k, part), &free)| {
                    let mut change = part_momentum(&attached[k], part.mass, part.inertia);
                    change += Wrench { force: -free.force, torque: -free.torque };
                    wrenches[k] += change;
                    0.5 * (change.force.dot(change.force) / part.mass + turning_energy(&attached[k], part, change))
                })
                .sum()
            }
        };
        energy
    }

    /// M (v1 − v0 − g dt), and half its product with that difference.
    fn evaluate_points<const D: usize>(&self, masses: &PointMasses, fall: DVec3, residual: &mut [Entry<D>]) -> f64 {
        let change = |i: usize| DVec3::from_slice(&self.v1[3 * i..]) - DVec3::from_slice(&self.v0[3 * i..]) - fall;
        let mut energy = 0.0;
        let mut add = |i: usize, momentum: DVec3| {
            let entry = &mut residual[self.blocks[i] as usize];
            (0..3).for_each(|k| entry[k] += momentum[k]);
        };
        for (i, &m) in masses.diagonal.iter().enumerate() {
            let change = change(i);
            add(i, m * change);
            energy += 0.5 * m * change.length_squared();
        }
        for &(i, j, m) in &masses.off_diagonal {
            let (i, j) = (i as usize, j as usize);
            let (a, b) = (change(i), change(j));
            add(i, m * b);
            add(j, m * a);
            energy += m * a.dot(b);
        }
        energy
    }

    /// Finds the geometric stiffness of what pulls at the candidate. Where derivatives are frozen there is none.
    fn load(&mut self, index: u32, attachments: &[Attachment], wrenches: &[Wrench], attached: &[Frame<f64>]) {
        let Self { dof, loads, geometric, parts, q1, .. } = self;
        loads.clear();
        geometric.clear();
        geometric.resize(parts.len(), DMat3::ZERO);
        let mine = attachments.iter().zip(wrenches).filter(|(a, _)| a.figure == index && !a.frozen);
        loads.extend(mine.map(|(attachment, wrench)| PartLoad { at: attachment.at, impulse: wrench.force.into() }));
        let centres = &attached[parts.start as usize..parts.end as usize];
        dof.geometric_stiffness(q1, centres, loads, &mut |part, stiffness| geometric[part] += stiffness);
    }

    /// Finds the stiffness of points.
    fn stiffen_points(&mut self, dt: f64, definite: bool) {
        let Inertia::Points(masses) = self.dof.inertia() else { return };
        let sizes = [masses.diagonal.len(), masses.off_diagonal.len()];
        let (mut own, mut pairs) = (std::mem::take(&mut self.own_stiffness), std::mem::take(&mut self.pair_stiffness));
        for (blocks, size) in [&mut own, &mut pairs].into_iter().zip(sizes) {
            blocks.clear();
            blocks.resize(size, DMat3::ZERO);
        }
        self.dof.point_stiffness(&self.local_state(dt, definite), &mut own, &mut pairs);
        (self.own_stiffness, self.pair_stiffness) = (own, pairs);
    }

    fn assemble_points(&self, masses: &PointMasses, factor: f64, blocks: &mut impl Blocks) {
        for ((&block, &m), stiffness) in self.blocks.iter().zip(&masses.diagonal).zip(&self.own_stiffness) {
            blocks.add_point(block, block, &(*stiffness * factor), m);
        }
        for (&(i, j, m), stiffness) in masses.off_diagonal.iter().zip(&self.pair_stiffness) {
            let [row, column] = [i, j].map(|i| self.blocks[i as usize]);
            blocks.add_point(row, column, &(*stiffness * factor), m);
        }
    }

    fn assemble_stiffness(&self, dt: f64, definite: bool, blocks: &mut impl Blocks) {
        self.dof.stiffness(&self.local_state(dt, definite), &mut |row, column, block| {
            let scaled = block.map(|r| r.map(|x| x * dt * dt));
            blocks.add(self.blocks[row], self.blocks[column], &scaled);
        });
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
    let linear = |column: &[f64; 6]| DVec3::from_slice(column) * weight;
    if columns[..usize::from(size)].iter().all(|column| linear(column) == DVec3::ZERO) {
        return;
    }
    let block = owner.blocks[own_block];
    let known = influences[first..].iter().position(|influence| influence.block == block);
    let place = known.map_or(influences.len(), |known| first + known);
    if known.is_none() {
        influences.push(Influence { block, own_block: own_block as u32, size, columns: Columns::default() });
    }
    for (sum, column) in influences[place].columns.iter_mut().zip(columns) {
        let added = DVec3::from_slice(&sum[..]) + linear(column);
        sum[..3].copy_from_slice(&added.to_array());
    }
}

/// Twice the energy of an angular momentum, J; none for what does not turn.
fn turning_energy(frame: &Frame<f64>, part: &PartInertia, momentum: Wrench) -> f64 {
    let momentum = DVec3::from(momentum.torque);
    if momentum == DVec3::ZERO {
        return 0.0;
    }
    momentum.dot(world_inertia(frame, part.inertia).inverse() * momentum)
}

/// R I Rᵀ.
pub(crate) fn world_inertia(frame: &Frame<f64>, local: DMat3) -> DMat3 {
    let r = frame.rotation.value();
    r * local * r.transpose()
}

/// Momentum and angular momentum about the centre of mass of a part whose centre of mass is the frame's origin.
pub(crate) fn part_momentum(frame: &Frame<f64>, mass: f64, inertia: DMat3) -> Wrench {
    let Twist { linear, angular } = frame.twist();
    Wrench { force: (mass * linear).into(), torque: (world_inertia(frame, inertia) * angular).into() }
}
