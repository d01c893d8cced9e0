//! A body of a general kind within an island: its blocks of unknowns, its candidate state, and its own residual and
//! Hessian. What acts on its material points is [`Figures`](super::figures::Figures)'s.

use std::ops::Range;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::attachment::{Attachment, Follows, Influence, trace};
use super::block::Entry;
use super::figures::Blocks;
use crate::dof::{Dof, FigureBody, Frame, Inertia, LocalState, PartInertia, PartLoad, PartPoint, PointMasses, Twist};
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
    pub parts: Range<u32>,
    /// Momentum that each part would have at the end of the tick without potentials.
    pub free_momenta: Vec<Wrench>,
    loads: Vec<PartLoad>,
    /// Stiffness of each part against turns that comes from its loads, N m s.
    pub geometric: Vec<DMat3>,
    /// Of points: stiffness of each by itself and of each pair of the mass matrix, N/m.
    own_stiffness: Vec<DMat3>,
    pair_stiffness: Vec<DMat3>,
}

impl Figure {
    pub fn new(dof: &Arc<dyn Dof>) -> Self {
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

    pub fn start(&mut self, blocks: impl Iterator<Item = u32>, [q, v]: [&[f64]; 2], body: &FigureBody) {
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

    pub fn prepare(&mut self, dt: f64) {
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

    /// The twist that rates give what `influences` move.
    pub fn twist(&self, influences: &[Influence], rates: &[f64]) -> Twist {
        let mut twist = Twist::REST;
        for influence in influences {
            let rates = &rates[self.offsets[influence.own_block as usize] as usize..];
            for (column, &rate) in influence.columns.iter().zip(&rates[..usize::from(influence.size)]) {
                twist.linear += DVec3::from_slice(column) * rate;
                twist.angular += DVec3::from_slice(&column[3..]) * rate;
            }
        }
        twist
    }

    /// What resists a force at a material point, kg.
    pub fn mass_at(&self, at: PartPoint, influences: &[Influence]) -> f64 {
        match self.dof.inertia() {
            Inertia::Parts(parts) => parts[at.part as usize].mass,
            Inertia::Points(masses) => {
                let inverse = |i: &Influence| i.columns[0][0].powi(2) / masses.diagonal[i.own_block as usize];
                influences.iter().map(inverse).sum::<f64>().recip()
            }
        }
    }

    /// What a torque turns at a material point, mean over axes, 1/(kg m²).
    pub fn inverse_inertia_at(&self, at: PartPoint, influences: &[Influence]) -> f64 {
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

    pub fn move_to<const D: usize>(&mut self, u: &[Entry<D>], dt: f64, frames: &mut [Frame<f64>]) {
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

    pub fn evaluate<const D: usize>(
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

    /// Work of its own potentials, and of what code asked to act, where it was last evaluated, J.
    pub fn work(&self, dt: f64) -> f64 {
        -dt * self.gradient.iter().zip(&self.v1).map(|(gradient, rate)| gradient * rate).sum::<f64>()
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
    pub fn load(&mut self, index: u32, attachments: &[Attachment], wrenches: &[Wrench], attached: &[Frame<f64>]) {
        let Self { dof, loads, geometric, parts, q1, .. } = self;
        loads.clear();
        geometric.clear();
        geometric.resize(parts.len(), DMat3::ZERO);
        let mine = attachments.iter().zip(wrenches).filter(|(a, _)| a.figure == index && a.follows != Follows::Start);
        loads.extend(mine.map(|(attachment, wrench)| PartLoad { at: attachment.at, impulse: wrench.force.into() }));
        let centres = &attached[parts.start as usize..parts.end as usize];
        dof.geometric_stiffness(q1, centres, loads, &mut |part, stiffness| geometric[part] += stiffness);
    }

    /// Finds the stiffness of points.
    pub fn stiffen_points(&mut self, dt: f64, definite: bool) {
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

    pub fn assemble_points(&self, masses: &PointMasses, factor: f64, blocks: &mut impl Blocks) {
        for ((&block, &m), stiffness) in self.blocks.iter().zip(&masses.diagonal).zip(&self.own_stiffness) {
            blocks.add_point(block, block, &(*stiffness * factor), m);
        }
        for (&(i, j, m), stiffness) in masses.off_diagonal.iter().zip(&self.pair_stiffness) {
            let [row, column] = [i, j].map(|i| self.blocks[i as usize]);
            blocks.add_point(row, column, &(*stiffness * factor), m);
        }
    }

    pub fn assemble_stiffness(&self, dt: f64, definite: bool, blocks: &mut impl Blocks) {
        self.dof.stiffness(&self.local_state(dt, definite), &mut |row, column, block| {
            let scaled = block.map(|r| r.map(|x| x * dt * dt));
            blocks.add(self.blocks[row], self.blocks[column], &scaled);
        });
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
