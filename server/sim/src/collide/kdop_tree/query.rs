//! Questions to a tree from outside: by bounds, along a ray, around a point.
//!
//! They go from node to node without a stack, so that any number of readers may ask at once.

use glam::DVec3;

use super::{KdopTree, NONE, Node};
use crate::collide::kdop::{Directions, Kdop, SlabRay, Slabs};

impl<const H: usize> KdopTree<H> {
    /// Hands `found` the items of all leaves whose bounds overlap `bounds`; in no order.
    pub fn overlapping(&self, bounds: &Kdop<H>, mut found: impl FnMut(u32)) {
        self.visit(|kept| kept.overlaps(bounds), &mut found);
    }

    /// Hands `hit` the items of all leaves whose bounds a ray from `origin` along the unit vector `direction` meets
    /// within its length, in no order. What `hit` answers is the ray's length from then on, m.
    pub fn cast(&self, origin: DVec3, direction: DVec3, length: f64, mut hit: impl FnMut(u32) -> f64)
    where
        Slabs: Directions<H>,
    {
        let ray = SlabRay::new(origin, direction);
        let limit = std::cell::Cell::new(length);
        self.visit(|kept| kept.is_hit(&ray, limit.get()), &mut |item| limit.set(hit(item)));
    }

    /// Hands `near` the items of all leaves that may be nearer to `point` than `distance`, in no order. What `near`
    /// answers is the distance from then on, m.
    pub fn nearest(&self, point: DVec3, distance: f64, mut near: impl FnMut(u32) -> f64)
    where
        Slabs: Directions<H>,
    {
        let limit = std::cell::Cell::new(distance);
        self.visit(|kept| kept.distance(point) <= limit.get(), &mut |item| limit.set(near(item)));
    }

    /// Hands `found` the leaves to which `enters` leads.
    fn visit(&self, enters: impl Fn(&Kdop<H>) -> bool, found: &mut impl FnMut(u32)) {
        let mut node = self.root;
        while let Some(&Node { children: [left, _], item, .. }) = self.nodes.get(node as usize) {
            let entered = enters(&self.bounds[node as usize]);
            if entered && left != NONE {
                node = left;
                continue;
            }
            if entered {
                found(item);
            }
            node = self.after(node);
        }
    }

    /// The first node beyond the subtree of `node`.
    fn after(&self, mut node: u32) -> u32 {
        while let Some(above) = self.nodes.get(self.nodes[node as usize].parent as usize) {
            if above.children[0] == node {
                return above.children[1];
            }
            node = self.nodes[node as usize].parent;
        }
        NONE
    }
}
