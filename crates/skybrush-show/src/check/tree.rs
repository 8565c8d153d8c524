//! A tree of boxes that finds the pairs of drones which may come near each other in a time slab.

use super::curve::Bounds;

const LEAF: usize = 4;

/// A drone's box in a time slab.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Bounds,
    /// Whether it is in the air at any time of the slab.
    pub(super) airborne: bool,
    /// Whether it is on the ground at any time of the slab.
    pub(super) grounded: bool,
}

impl Item {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, airborne: false, grounded: false };

    fn join(&mut self, other: &Self) {
        self.bounds.join(&other.bounds);
        self.airborne |= other.airborne;
        self.grounded |= other.grounded;
    }
}

/// What to do with the pairs.
pub(super) trait Visitor {
    /// How near two boxes must be to matter, m; may shrink as pairs are visited.
    fn reach_m(&mut self, a: &Item, b: &Item) -> f64;
    /// Looks at a pair whose boxes are within reach; `a < b`.
    fn visit(&mut self, a: usize, b: usize);
}

#[derive(Clone, Copy, Debug)]
struct Node {
    item: Item,
    /// Range of `order` that the node covers.
    from: u32,
    to: u32,
    /// Right child; the left one follows the node. 0: a leaf.
    right: u32,
}

/// The tree: median splits along the longest side.
#[derive(Debug)]
pub(super) struct Tree<'a> {
    items: &'a [Item],
    order: Vec<u32>,
    nodes: Vec<Node>,
}

impl<'a> Tree<'a> {
    pub(super) fn new(items: &'a [Item]) -> Self {
        let mut tree = Self {
            items,
            order: (0..items.len() as u32).collect(),
            nodes: Vec::with_capacity(items.len()),
        };
        if !items.is_empty() {
            tree.build(0, items.len());
        }
        tree
    }

    fn build(&mut self, from: usize, to: usize) {
        let mut item = Item::EMPTY;
        for index in &self.order[from..to] {
            item.join(&self.items[*index as usize]);
        }
        let here = self.nodes.len();
        self.nodes.push(Node { item, from: from as u32, to: to as u32, right: 0 });
        if to - from <= LEAF {
            return;
        }
        let axis = (item.bounds.high - item.bounds.low).imax();
        let middle = from.midpoint(to);
        let items = self.items;
        let centre = |index: u32| {
            let bounds = &items[index as usize].bounds;
            bounds.low[axis] + bounds.high[axis]
        };
        self.order[from..to].select_nth_unstable_by(middle - from, |a, b| {
            centre(*a).total_cmp(&centre(*b)).then(a.cmp(b))
        });
        self.build(from, middle);
        self.nodes[here].right = self.nodes.len() as u32;
        self.build(middle, to);
    }

    /// Visits every pair of different items whose boxes are within reach.
    pub(super) fn pairs(&self, visitor: &mut impl Visitor) {
        let mut stack: Vec<(u32, u32)> = Vec::new();
        if !self.nodes.is_empty() {
            stack.push((0, 0));
        }
        while let Some((first, second)) = stack.pop() {
            let (a, b) = (&self.nodes[first as usize], &self.nodes[second as usize]);
            if first == second {
                if a.right == 0 {
                    for i in a.from..a.to {
                        for j in i + 1..a.to {
                            self.candidate(i, j, visitor);
                        }
                    }
                } else {
                    stack.extend([
                        (first + 1, a.right),
                        (a.right, a.right),
                        (first + 1, first + 1),
                    ]);
                }
                continue;
            }
            if !within_reach(&a.item, &b.item, visitor) {
                continue;
            }
            match (a.right, b.right) {
                (0, 0) => {
                    for i in a.from..a.to {
                        for j in b.from..b.to {
                            self.candidate(i, j, visitor);
                        }
                    }
                }
                (_, 0) => stack.extend([(first + 1, second), (a.right, second)]),
                (0, _) => stack.extend([(first, second + 1), (first, b.right)]),
                _ if a.to - a.from >= b.to - b.from => {
                    stack.extend([(first + 1, second), (a.right, second)]);
                }
                _ => stack.extend([(first, second + 1), (first, b.right)]),
            }
        }
    }

    fn candidate(&self, i: u32, j: u32, visitor: &mut impl Visitor) {
        let (i, j) = (self.order[i as usize] as usize, self.order[j as usize] as usize);
        if within_reach(&self.items[i], &self.items[j], visitor) {
            visitor.visit(i.min(j), i.max(j));
        }
    }
}

fn within_reach(a: &Item, b: &Item, visitor: &mut impl Visitor) -> bool {
    let reach_m = visitor.reach_m(a, b);
    reach_m > 0.0 && a.bounds.distance_squared(&b.bounds) < reach_m * reach_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    struct Within(f64, BTreeSet<(usize, usize)>);

    impl Visitor for Within {
        fn reach_m(&mut self, _: &Item, _: &Item) -> f64 {
            self.0
        }
        fn visit(&mut self, a: usize, b: usize) {
            assert!(self.1.insert((a, b)), "visited twice");
        }
    }

    proptest! {
        #[test]
        fn finds_the_pairs_that_all_pairs_would(
            corners in proptest::collection::vec(
                ((0.0..50.0_f64, 0.0..50.0_f64, 0.0..9.0_f64), (0.0..5.0_f64, 0.0..20.0_f64)), 0..80),
            reach_m in 0.1..20.0_f64,
        ) {
            let items: Vec<_> = corners.iter().map(|((x, y, z), (w, h))| {
                let low = Vector3::new(*x, *y, *z);
                let bounds = Bounds { low, high: low + Vector3::new(*w, 0.0, *h) };
                Item { bounds, airborne: true, grounded: false }
            }).collect();
            let mut visitor = Within(reach_m, BTreeSet::new());
            Tree::new(&items).pairs(&mut visitor);
            let mut expected = BTreeSet::new();
            for i in 0..items.len() {
                for j in i + 1..items.len() {
                    if items[i].bounds.distance_squared(&items[j].bounds) < reach_m * reach_m {
                        expected.insert((i, j));
                    }
                }
            }
            prop_assert_eq!(visitor.1, expected);
        }
    }
}
