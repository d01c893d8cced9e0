//! Broad phases side by side: k-DOP trees, parry's tree of boxes, sweep and prune.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhLeafUpdateStatus, BvhWorkspace};
use pita_sim::collide::kdop::{Directions, Kdop, Slabs};
use pita_sim::collide::kdop_tree::{KdopTree, Leaf, PairSearch};

use super::swarm::Hull;

/// How much wider than asked for parry's tree keeps its leaves, m: as much as ours.
const FAT: f64 = 0.05;

/// A broad phase.
pub trait BroadPhase {
    /// Bounds of all hulls, tightly.
    fn bound(&mut self, hulls: &[Hull]);

    /// Takes the bounds over.
    fn update(&mut self);

    /// Finds the pairs whose bounds overlap, the smaller index first, in any order.
    fn search(&mut self, pairs: &mut Vec<(u32, u32)>);

    /// Whether two bounds overlap: the test by itself.
    fn test(&self, a: usize, b: usize) -> bool;
}

/// Pairs that are known for as long as neither side leaves its wide bounds.
#[derive(Default)]
struct Known {
    pairs: Vec<(u32, u32)>,
    changed: Vec<bool>,
}

impl Known {
    /// Forgets what has changed.
    fn purge(&mut self) {
        let Self { pairs, changed } = self;
        pairs.retain(|&(a, b)| !changed[a as usize] && !changed[b as usize]);
    }

    /// Those that pass a test of tight bounds.
    fn filter(&self, pairs: &mut Vec<(u32, u32)>, overlap: impl Fn(usize, usize) -> bool) {
        pairs.extend(self.pairs.iter().copied().filter(|&(a, b)| overlap(a as usize, b as usize)));
    }
}

/// A tree of k-DOPs.
pub struct KdopContender<const H: usize> {
    tree: KdopTree<H>,
    leaves: Vec<Leaf>,
    bounds: Vec<Kdop<H>>,
    search: PairSearch,
    known: Known,
}

impl<const H: usize> Default for KdopContender<H> {
    fn default() -> Self {
        let (tree, search, known) = (KdopTree::default(), PairSearch::default(), Known::default());
        Self { tree, leaves: Vec::new(), bounds: Vec::new(), search, known }
    }
}

impl<const H: usize> BroadPhase for KdopContender<H>
where
    Slabs: Directions<H>,
{
    fn bound(&mut self, hulls: &[Hull]) {
        self.bounds.clear();
        self.bounds.extend(hulls.iter().map(|hull| Kdop::of_points(hull.points.iter().copied())));
    }

    fn update(&mut self) {
        let Self { tree, leaves, bounds, known, .. } = self;
        known.changed.clear();
        if leaves.is_empty() {
            leaves.extend((0..).zip(bounds.iter()).map(|(item, &bounds)| tree.insert(item, bounds)));
            known.changed.resize(leaves.len(), true);
        } else {
            known.changed.extend(leaves.iter().zip(bounds.iter()).map(|(&leaf, bounds)| tree.update(leaf, bounds)));
        }
        tree.refit();
    }

    fn search(&mut self, pairs: &mut Vec<(u32, u32)>) {
        let Self { tree, bounds, search, known, .. } = self;
        known.purge();
        search.within(tree, |a, b| known.pairs.push((a.min(b), a.max(b))));
        tree.settle();
        known.filter(pairs, |a, b| bounds[a].overlaps(&bounds[b]));
    }

    fn test(&self, a: usize, b: usize) -> bool {
        self.bounds[a].overlaps(&self.bounds[b])
    }
}

fn aabb(hull: &Hull) -> Aabb {
    let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mins, maxs) = hull.points.iter().fold(ends, |(low, high), &p| (low.min(p), high.max(p)));
    Aabb { mins, maxs }
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.mins.cmple(b.maxs).all() && b.mins.cmple(a.maxs).all()
}

/// Parry's tree, used as rapier uses it: leaves change when they leave their wide bounds.
#[derive(Default)]
pub struct ParryContender {
    tree: Bvh,
    workspace: BvhWorkspace,
    bounds: Vec<Aabb>,
    known: Known,
}

impl BroadPhase for ParryContender {
    fn bound(&mut self, hulls: &[Hull]) {
        self.bounds.clear();
        self.bounds.extend(hulls.iter().map(aabb));
    }

    fn update(&mut self) {
        let Self { tree, workspace, bounds, known } = self;
        known.changed.clear();
        for (i, &bounds) in (0..).zip(bounds.iter()) {
            let status = tree.insert_or_update_partially(bounds, i, FAT);
            known.changed.push(!matches!(status, BvhLeafUpdateStatus::Unchanged));
        }
        tree.optimize_incremental(workspace);
        tree.refit(workspace);
    }

    fn search(&mut self, pairs: &mut Vec<(u32, u32)>) {
        let Self { tree, workspace, bounds, known } = self;
        known.purge();
        tree.traverse_bvtt_single_tree::<true>(workspace, &mut |a, b| {
            if known.changed[a as usize] || known.changed[b as usize] {
                known.pairs.push((a.min(b), a.max(b)));
            }
        });
        known.filter(pairs, |a, b| overlap(&bounds[a], &bounds[b]));
    }

    fn test(&self, a: usize, b: usize) -> bool {
        overlap(&self.bounds[a], &self.bounds[b])
    }
}

/// Sweep and prune along x: what PITA had before its trees.
#[derive(Default)]
pub struct SweepContender {
    order: Vec<u32>,
    bounds: Vec<Aabb>,
}

impl BroadPhase for SweepContender {
    fn bound(&mut self, hulls: &[Hull]) {
        self.bounds.clear();
        self.bounds.extend(hulls.iter().map(aabb));
    }

    fn update(&mut self) {
        let Self { order, bounds } = self;
        if order.len() != bounds.len() {
            order.extend(order.len() as u32..bounds.len() as u32);
        }
        // What is nearly sorted is sorted again in linear time.
        order.sort_by(|&a, &b| bounds[a as usize].mins.x.total_cmp(&bounds[b as usize].mins.x));
    }

    fn search(&mut self, pairs: &mut Vec<(u32, u32)>) {
        for (place, &i) in self.order.iter().enumerate() {
            let this = &self.bounds[i as usize];
            for &j in &self.order[place + 1..] {
                let other = &self.bounds[j as usize];
                if other.mins.x > this.maxs.x {
                    break;
                }
                if overlap(this, other) {
                    pairs.push((i.min(j), i.max(j)));
                }
            }
        }
    }

    fn test(&self, a: usize, b: usize) -> bool {
        overlap(&self.bounds[a], &self.bounds[b])
    }
}

/// Oriented boxes, pair by pair: the talk's measure of what tighter bounds cost. They have no tree here.
#[derive(Default)]
pub struct OrientedContender {
    boxes: Vec<(DVec3, [DVec3; 3], DVec3)>,
}

impl BroadPhase for OrientedContender {
    fn bound(&mut self, hulls: &[Hull]) {
        self.boxes.clear();
        self.boxes.extend(hulls.iter().map(|hull| {
            let axes = [hull.axes.x_axis, hull.axes.y_axis, hull.axes.z_axis];
            let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let local = hull.points.iter().map(|&p| DVec3::from_array(axes.map(|axis| axis.dot(p))));
            let (low, high) = local.fold(ends, |(low, high), p| (low.min(p), high.max(p)));
            (hull.axes * ((low + high) / 2.0), axes, (high - low) / 2.0)
        }));
    }

    fn update(&mut self) {}

    fn search(&mut self, pairs: &mut Vec<(u32, u32)>) {
        let all = (0..self.boxes.len()).flat_map(|i| (i + 1..self.boxes.len()).map(move |j| (i, j)));
        pairs.extend(all.filter(|&(i, j)| self.test(i, j)).map(|(i, j)| (i as u32, j as u32)));
    }

    /// The fifteen axes along which two boxes can be apart.
    fn test(&self, a: usize, b: usize) -> bool {
        let ((centre_a, axes_a, half_a), (centre_b, axes_b, half_b)) = (&self.boxes[a], &self.boxes[b]);
        let between = *centre_b - *centre_a;
        let reach = |axes: &[DVec3; 3], half: &DVec3, axis: DVec3| {
            (0..3).map(|i| half[i] * axes[i].dot(axis).abs()).sum::<f64>()
        };
        let apart =
            |axis: DVec3| between.dot(axis).abs() > reach(axes_a, half_a, axis) + reach(axes_b, half_b, axis) + 1e-12;
        let faces = axes_a.iter().chain(axes_b).any(|&axis| apart(axis));
        !(faces || axes_a.iter().any(|x| axes_b.iter().any(|y| apart(x.cross(*y)))))
    }
}
