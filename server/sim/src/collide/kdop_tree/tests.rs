//! The tree against the quadratic loop, whatever happens to it.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::collide::kdop::{Directions, Slabs};

/// What a test does to a tree.
#[derive(Clone, Debug)]
enum Deed {
    Insert(DVec3, DVec3),
    Remove(prop::sample::Index),
    Move(prop::sample::Index, DVec3),
    Look,
}

fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(range).prop_map(DVec3::from_array)
}

fn deed() -> impl Strategy<Value = Deed> {
    let index = any::<prop::sample::Index>;
    prop_oneof![
        4 => (vector(-10.0..10.0), vector(0.0..2.0)).prop_map(|(at, size)| Deed::Insert(at, size)),
        1 => index().prop_map(Deed::Remove),
        3 => (index(), vector(-3.0..3.0)).prop_map(|(which, by)| Deed::Move(which, by)),
        1 => Just(Deed::Look),
    ]
}

/// A tree and the same leaves as a list.
struct Both<const H: usize> {
    tree: KdopTree<H>,
    leaves: Vec<(Leaf, u32, Kdop<H>)>,
    /// Pairs that were found and not touched since.
    known: Vec<(u32, u32)>,
    items: u32,
}

impl<const H: usize> Both<H>
where
    Slabs: Directions<H>,
{
    fn new() -> Self {
        Self { tree: KdopTree::default(), leaves: Vec::new(), known: Vec::new(), items: 0 }
    }

    fn act(&mut self, deed: &Deed) {
        match deed {
            Deed::Insert(at, size) => {
                let bounds = Kdop::of_points([*at, *at + *size]);
                self.leaves.push((self.tree.insert(self.items, bounds), self.items, bounds));
                self.items += 1;
            }
            Deed::Remove(which) if !self.leaves.is_empty() => {
                let (leaf, item, _) = self.leaves.swap_remove(which.index(self.leaves.len()));
                self.tree.remove(leaf);
                self.known.retain(|&(a, b)| a != item && b != item);
            }
            Deed::Move(which, by) if !self.leaves.is_empty() => {
                let which = which.index(self.leaves.len());
                let (leaf, item, bounds) = &mut self.leaves[which];
                *bounds = bounds.swept(*by);
                if self.tree.update(*leaf, bounds) {
                    self.known.retain(|&(a, b)| a != *item && b != *item);
                }
            }
            _ => self.look(),
        }
    }

    /// The search finds what the quadratic loop finds among bounds as wide as the tree keeps them, each pair once.
    fn look(&mut self) {
        self.tree.refit();
        self.check();
        let known = &mut self.known;
        PairSearch::default().within(&self.tree, |a, b| {
            let pair = (a.min(b), a.max(b));
            if !known.contains(&pair) {
                known.push(pair);
            }
        });
        self.tree.settle();
        let mut nothing = 0;
        PairSearch::default().within(&self.tree, |_, _| nothing += 1);
        assert_eq!(nothing, 0, "nothing has changed");
        self.known.sort_unstable();
        let mut kept: Vec<_> = self.leaves.iter().map(|&(leaf, item, _)| (item, self.kept(leaf))).collect();
        kept.sort_unstable_by_key(|&(item, _)| item);
        let pairs = kept.iter().enumerate().flat_map(|(i, a)| kept[i + 1..].iter().map(move |b| (a, b)));
        let expected: Vec<_> = pairs.filter(|(a, b)| a.1.overlaps(&b.1)).map(|(a, b)| (a.0, b.0)).collect();
        assert_eq!(self.known, expected);
        self.ask();
    }

    fn kept(&self, Leaf(leaf): Leaf) -> Kdop<H> {
        self.tree.bounds[leaf as usize]
    }

    /// Every query finds what lies there.
    fn ask(&self) {
        for &(_, item, bounds) in &self.leaves {
            let mut found = Vec::new();
            self.tree.overlapping(&bounds, |other| found.push(other));
            let mut rays = Vec::new();
            let centre = DVec3::from_array(std::array::from_fn(|i| bounds.doubled_centre(i) / 2.0));
            self.tree.cast(centre - DVec3::X * 40.0, DVec3::X, 40.0 + 1e-9, |other| {
                rays.push(other);
                40.0 + 1e-9
            });
            let mut near = Vec::new();
            self.tree.nearest(centre, 1e-9, |other| {
                near.push(other);
                1e-9
            });
            for list in [&found, &rays, &near] {
                assert!(list.contains(&item), "{item} not in one of {found:?} {rays:?} {near:?}");
            }
            let missed = self.leaves.iter().find(|(_, item, other)| other.overlaps(&bounds) && !found.contains(item));
            assert!(missed.is_none(), "{missed:?}");
        }
    }

    /// Every node contains what is below it, knows its parent, and no node is lost.
    fn check(&self) {
        let mut seen = 0;
        let mut stack: Vec<_> = Some((self.tree.root, NONE)).filter(|(root, _)| *root != NONE).into_iter().collect();
        while let Some((node, parent)) = stack.pop() {
            seen += 1;
            let Node { parent: known, children, .. } = self.tree.nodes[node as usize];
            assert_eq!(known, parent);
            for child in children.into_iter().filter(|&child| child != NONE) {
                assert!(self.tree.bounds[node as usize].contains(&self.tree.bounds[child as usize]));
                stack.push((child, node));
            }
        }
        assert_eq!(seen, (2 * self.leaves.len()).saturating_sub(1));
        assert_eq!(seen + self.tree.free.len(), self.tree.nodes.len());
    }
}

proptest! {
    #[test]
    fn finds_what_the_quadratic_loop_finds(deeds in prop::collection::vec(deed(), 0..120)) {
        let (mut small, mut large) = (Both::<3>::new(), Both::<13>::new());
        for deed in deeds.iter().chain([&Deed::Look]) {
            small.act(deed);
            large.act(deed);
        }
    }

    #[test]
    fn pairs_of_two_trees(
        a in prop::collection::vec((vector(-5.0..5.0), vector(0.0..2.0)), 0..40),
        b in prop::collection::vec((vector(-5.0..5.0), vector(0.0..2.0)), 0..40),
    ) {
        let bounds = |list: &[(DVec3, DVec3)]| -> Vec<_> {
            list.iter().map(|&(at, size)| Kdop::<7>::of_points([at, at + size])).collect()
        };
        let (a, b) = (bounds(&a), bounds(&b));
        let tree = |bounds: &[Kdop<7>]| {
            let mut tree = KdopTree::default();
            for (item, &bounds) in (0..).zip(bounds) {
                tree.insert(item, bounds);
            }
            tree.refit();
            tree
        };
        let mut found = Vec::new();
        PairSearch::default().between(&tree(&a), &tree(&b), |a, b| found.push((a as usize, b as usize)));
        found.sort_unstable();
        let all = (0..a.len()).flat_map(|i| (0..b.len()).map(move |j| (i, j)));
        prop_assert_eq!(found, all.filter(|&(i, j)| a[i].overlaps(&b[j])).collect::<Vec<_>>());
    }
}

/// What drives through a crowd does not leave long bounds behind, and a crowd that comes one by one makes no list of the
/// tree.
#[test]
fn degraded_subtrees_are_built_anew() {
    let place = |i: u32| DVec3::new(f64::from(i % 40), 0.0, f64::from(i / 40));
    let cube = |at: DVec3| Kdop::<7>::of_points([at, at + DVec3::splat(0.6)]);
    let mut tree = KdopTree::default();
    for i in 0..1600 {
        tree.insert(i, cube(place(i)));
        if i % 3 == 0 {
            tree.refit();
        }
    }
    let guest = tree.insert(2000, cube(DVec3::ZERO));
    tree.refit();
    let best = {
        let mut anew = KdopTree::default();
        (0..1600).for_each(|i| {
            anew.insert(i, cube(place(i)));
        });
        anew.refit();
        anew.nodes[anew.root as usize].cost
    };
    for step in 0..400 {
        let at = DVec3::new(0.1 * f64::from(step), 0.3, 37.0 - 0.05 * f64::from(step));
        tree.update(guest, &cube(at));
        tree.refit();
        tree.settle();
        let cost = tree.nodes[tree.root as usize].cost;
        assert!(cost < 1.4 * best, "step {step}: {cost} instead of {best}");
        let mut found = 0;
        tree.overlapping(&cube(at), |_| found += 1);
        assert!((1..10).contains(&found), "step {step}: {found}");
    }
}
