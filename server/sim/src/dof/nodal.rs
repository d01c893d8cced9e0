//! What elements that share nodes have in common: where the nodes are, their mass matrix, where stiffness goes in it, and
//! the material.
//!
//! Shared by finite elements and lattices; knows neither.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};

use super::embedding::EmbeddedPoint;
use super::interface::{BlockSize, Columns, PointMasses};
use super::{Frame, Mount, MountNode};
use crate::error::{SimError, require};
use crate::potential::elasticity::Elastic;

/// Longest time constant of damping, s.
const DAMPING_MAX: f64 = 10.0;

/// What a kind of elements has of [`Dof`](super::Dof) by its nodes alone: kinematics and inertia. The kind has `nodes`, and
/// `embedded` answers the nodes about a material point, with the point between them.
macro_rules! moved_by_nodes {
    () => {
        fn blocks(&self) -> &[BlockSize] {
            &self.nodes.blocks
        }

        fn frame(&self, at: PartPoint, q: &[f64], v: &[f64]) -> Frame<f64> {
            let (nodes, point) = self.embedded(at);
            self.nodes.frame(nodes, &point, [q, v])
        }

        fn point(&self, at: PartPoint, q: &[f64], v: &[f64]) -> [DVec3; 2] {
            let (nodes, point) = self.embedded(at);
            self.nodes.point(nodes, &point, [q, v])
        }

        fn jacobian(&self, at: PartPoint, q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
            let (nodes, point) = self.embedded(at);
            self.nodes.jacobian(nodes, &point, q, visit);
        }

        fn frame_and_jacobian(
            &self,
            at: PartPoint,
            q: &[f64],
            v: &[f64],
            visit: &mut dyn FnMut(usize, &Columns),
        ) -> Frame<f64> {
            let (nodes, point) = self.embedded(at);
            self.nodes.frame_and_jacobian(nodes, &point, [q, v], visit)
        }

        fn is_linear(&self, _at: PartPoint) -> bool {
            true
        }

        fn place_jacobian(&self, at: PartPoint, _q: &[f64], visit: &mut dyn FnMut(usize, &Columns)) {
            let (nodes, point) = self.embedded(at);
            self.nodes.place_jacobian(nodes, &point, visit);
        }

        fn mount(&self, at: PartPoint) -> Option<Mount> {
            let (nodes, point) = self.embedded(at);
            Some(self.nodes.mount(nodes, &point))
        }

        fn inertia(&self) -> Inertia<'_> {
            Inertia::Points(&self.nodes.masses)
        }
    };
}
pub(super) use moved_by_nodes;

/// Nodes of a body of elements.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    /// Places at rest, m: of those that move first, then of those that are fixed.
    pub rest: Vec<DVec3>,
    /// Of those that move.
    pub masses: PointMasses,
    /// Of those that move.
    pub blocks: Vec<BlockSize>,
}

impl Nodes {
    /// Nodes with the mass matrix of those that move.
    pub fn new(rest: Vec<DVec3>, masses: PointMasses) -> Self {
        let blocks = vec![BlockSize { positions: 3, rates: 3 }; masses.diagonal.len()];
        Self { rest, masses, blocks }
    }

    /// Q at rest, turned about the origin and then moved.
    pub fn placed(&self, position: DVec3, rotation: DQuat) -> Vec<f64> {
        let moving = &self.rest[..self.blocks.len()];
        moving.iter().flat_map(|&node| (position + rotation * node).to_array()).collect()
    }

    /// Q' at rest.
    pub fn still(&self) -> Vec<f64> {
        vec![0.0; 3 * self.blocks.len()]
    }

    /// Whether a node is one of those that move.
    pub fn moves(&self, node: u32) -> bool {
        (node as usize) < self.blocks.len()
    }

    /// Places of an element's nodes.
    pub fn places<const N: usize>(&self, nodes: [u32; N], q: &[f64]) -> [DVec3; N] {
        nodes.map(|node| if self.moves(node) { numbers_of(node, q) } else { self.rest[node as usize] })
    }

    fn velocities<const N: usize>(&self, nodes: [u32; N], v: &[f64]) -> [DVec3; N] {
        nodes.map(|node| if self.moves(node) { numbers_of(node, v) } else { DVec3::ZERO })
    }

    /// The frame at a point of an element.
    pub fn frame<const N: usize>(&self, nodes: [u32; N], point: &EmbeddedPoint<N>, [q, v]: [&[f64]; 2]) -> Frame<f64> {
        point.frame(&self.places(nodes, q), &self.velocities(nodes, v))
    }

    /// How the frame at a point of an element follows from the nodes that move.
    pub fn mount<const N: usize>(&self, nodes: [u32; N], point: &EmbeddedPoint<N>) -> Mount {
        let (moving, fixed): (Vec<_>, Vec<_>) =
            point.mount_nodes(&nodes).into_iter().partition(|node| self.moves(node.point));
        let (mut position, mut deformation) = (DVec3::ZERO, DMat3::ZERO);
        for MountNode { point, weight, gradient } in fixed {
            let rest = self.rest[point as usize];
            position += weight * rest;
            deformation += DMat3::from_cols(rest * gradient.x, rest * gradient.y, rest * gradient.z);
        }
        Mount::Points { nodes: moving, position, deformation }
    }

    /// Place and velocity of a point of an element.
    pub fn point<const N: usize>(&self, nodes: [u32; N], point: &EmbeddedPoint<N>, [q, v]: [&[f64]; 2]) -> [DVec3; 2] {
        point.place(&self.places(nodes, q), &self.velocities(nodes, v))
    }

    /// Hands `visit` the nodes of an element that move, with the derivatives of the frame at a point of it.
    pub fn jacobian<const N: usize>(
        &self,
        nodes: [u32; N],
        point: &EmbeddedPoint<N>,
        q: &[f64],
        visit: &mut dyn FnMut(usize, &Columns),
    ) {
        point.columns(&self.places(nodes, q), self.moving(nodes, visit));
    }

    /// [`Nodes::jacobian`] and [`Nodes::frame`] in one.
    pub fn frame_and_jacobian<const N: usize>(
        &self,
        nodes: [u32; N],
        point: &EmbeddedPoint<N>,
        [q, v]: [&[f64]; 2],
        visit: &mut dyn FnMut(usize, &Columns),
    ) -> Frame<f64> {
        point.frame_and_columns(&self.places(nodes, q), &self.velocities(nodes, v), self.moving(nodes, visit))
    }

    /// The same of the place of a point alone.
    pub fn place_jacobian<const N: usize>(
        &self,
        nodes: [u32; N],
        point: &EmbeddedPoint<N>,
        visit: &mut dyn FnMut(usize, &Columns),
    ) {
        point.place_columns(self.moving(nodes, visit));
    }

    /// Tells `visit` of those nodes of an element that move.
    fn moving<const N: usize>(
        &self,
        nodes: [u32; N],
        visit: &mut dyn FnMut(usize, &Columns),
    ) -> impl FnMut(usize, &Columns) {
        move |node, columns| {
            if self.moves(nodes[node]) {
                visit(nodes[node] as usize, columns);
            }
        }
    }

    /// Adds what an element's energy has as a gradient at its nodes.
    pub fn add_gradient<const N: usize>(&self, nodes: [u32; N], of_nodes: [DVec3; N], gradient: &mut [f64]) {
        for (of_node, node) in of_nodes.into_iter().zip(nodes).filter(|&(_, node)| self.moves(node)) {
            let entry = &mut gradient[3 * node as usize..][..3];
            entry.iter_mut().zip(of_node.to_array()).for_each(|(entry, slope)| *entry += slope);
        }
    }
}

fn numbers_of(node: u32, numbers: &[f64]) -> DVec3 {
    DVec3::from_slice(&numbers[3 * node as usize..])
}

/// `Err` unless a time constant of damping, s, is one that can be had.
pub(super) fn require_damping(seconds: f64) -> Result<(), SimError> {
    require((0.0..=DAMPING_MAX).contains(&seconds), "damping", seconds, "0 to 10 s")
}

/// The material of the damping with a time constant of `seconds` in a tick of `dt`; `None` where there is none.
pub(super) fn viscosity(material: Elastic, seconds: f64, dt: f64) -> Option<Elastic> {
    let Elastic { lambda, mu } = material;
    let factor = seconds / dt;
    (factor > 0.0).then_some(Elastic { lambda: factor * lambda, mu: factor * mu })
}

/// A mass matrix that is being summed up. Nodes from its size on are fixed, and no part of it.
pub(super) struct SharedMass {
    diagonal: Vec<f64>,
    off_diagonal: BTreeMap<(u32, u32), f64>,
}

impl SharedMass {
    /// Over `points` nodes that move.
    pub fn new(points: usize) -> Self {
        Self { diagonal: vec![0.0; points], off_diagonal: BTreeMap::new() }
    }

    /// Adds an element's, kg. What a node shares with a fixed one is its own: its weight stays what it was.
    pub fn add<const N: usize>(&mut self, nodes: [u32; N], m: &[[f64; N]; N]) {
        let moves = |node: u32| (node as usize) < self.diagonal.len();
        let moving = nodes.map(moves);
        for (i, &a) in nodes.iter().enumerate().filter(|&(i, _)| moving[i]) {
            for (j, &b) in nodes.iter().enumerate() {
                if i == j || !moving[j] {
                    self.diagonal[a as usize] += m[i][j];
                } else if a > b {
                    *self.off_diagonal.entry((a, b)).or_default() += m[i][j];
                }
            }
        }
    }

    /// The sum.
    pub fn finish(self) -> PointMasses {
        let off_diagonal = self.off_diagonal.into_iter().map(|((i, j), m)| (i, j, m)).collect();
        PointMasses { diagonal: self.diagonal, off_diagonal }
    }
}

/// Where the stiffness between two nodes goes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Slot {
    /// Nowhere: a node is fixed.
    Nowhere,
    /// A node with itself.
    Own(u32),
    /// A pair of the mass matrix, in its order.
    Pair(u32),
    /// A pair that the mass matrix has the other way round.
    Transposed(u32),
}

impl Slot {
    /// Of the block at row `a`, column `b`.
    pub fn between(masses: &PointMasses, a: u32, b: u32) -> Self {
        if a.max(b) as usize >= masses.diagonal.len() {
            return Self::Nowhere;
        }
        if a == b {
            return Self::Own(a);
        }
        let pair = (a.max(b), a.min(b));
        match masses.off_diagonal.binary_search_by_key(&pair, |&(i, j, _)| (i, j)) {
            Ok(k) if a > b => Self::Pair(k as u32),
            Ok(k) => Self::Transposed(k as u32),
            Err(_) => Self::Nowhere,
        }
    }

    /// Adds a block there.
    pub fn add(self, block: DMat3, own: &mut [DMat3], pairs: &mut [DMat3]) {
        match self {
            Self::Nowhere => {}
            Self::Own(i) => own[i as usize] += block,
            Self::Pair(k) => pairs[k as usize] += block,
            Self::Transposed(k) => pairs[k as usize] += block.transpose(),
        }
    }
}
