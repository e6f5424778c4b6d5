//! Boxes that overlap, found by a tree.

use levelset::bounds;

/// Boxes in a leaf.
const LEAF: usize = 8;

/// The least and the greatest coordinates of a box.
pub(crate) type Bounds<const D: usize> = [[f64; D]; 2];

/// The box around points, larger by a margin to every side.
pub(crate) fn around<const D: usize>(points: &[[f64; D]], margin: f64) -> Bounds<D> {
    let [low, high] = bounds(points.iter().copied());
    [low.map(|x| x - margin), high.map(|x| x + margin)]
}

fn overlap<const D: usize>(a: &Bounds<D>, b: &Bounds<D>) -> bool {
    (0..D).all(|k| a[0][k] <= b[1][k] && b[0][k] <= a[1][k])
}

struct Node<const D: usize> {
    bounds: Bounds<D>,
    /// First box of a leaf; the right child of an inner node, whose left child follows it.
    first: u32,
    /// Number of boxes of a leaf, zero in an inner node.
    count: u32,
}

/// A tree over boxes.
pub(crate) struct Tree<const D: usize> {
    boxes: Vec<Bounds<D>>,
    /// The numbers of the boxes in the order of the leaves.
    order: Vec<u32>,
    nodes: Vec<Node<D>>,
}

impl<const D: usize> Tree<D> {
    pub(crate) fn new(boxes: Vec<Bounds<D>>) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(boxes.len() / 2),
            boxes,
            order: Vec::new(),
        };
        if !order.is_empty() {
            tree.split(&mut order, 0);
        }
        tree.order = order;
        tree
    }

    fn split(&mut self, order: &mut [u32], first: usize) {
        let own = order.iter().map(|&i| self.boxes[i as usize]);
        let bounds = own.reduce(|a, b| {
            [
                std::array::from_fn(|k| a[0][k].min(b[0][k])),
                std::array::from_fn(|k| a[1][k].max(b[1][k])),
            ]
        });
        let Some(bounds) = bounds else { return };
        let index = self.nodes.len();
        self.nodes.push(Node {
            bounds,
            first: first as u32,
            count: order.len() as u32,
        });
        if order.len() <= LEAF {
            return;
        }
        let side = |k: &usize| bounds[1][*k] - bounds[0][*k];
        let axis = (0..D).max_by(|a, b| side(a).total_cmp(&side(b)));
        let axis = axis.unwrap_or(0);
        let centre = |i: u32| self.boxes[i as usize][0][axis] + self.boxes[i as usize][1][axis];
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| {
            centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
        });
        let (left, right) = order.split_at_mut(middle);
        self.split(left, first);
        self.nodes[index].first = self.nodes.len() as u32;
        self.nodes[index].count = 0;
        self.split(right, first + middle);
    }

    /// The box with a number.
    pub(crate) fn bounds(&self, number: usize) -> &Bounds<D> {
        &self.boxes[number]
    }

    /// Visits the numbers of the boxes that overlap a region.
    pub(crate) fn visit(&self, region: &Bounds<D>, mut visit: impl FnMut(usize)) {
        let mut open = Vec::new();
        if !self.nodes.is_empty() {
            open.push(0);
        }
        while let Some(index) = open.pop() {
            let node: &Node<D> = &self.nodes[index as usize];
            if !overlap(&node.bounds, region) {
                continue;
            }
            if node.count == 0 {
                open.push(node.first);
                open.push(index + 1);
                continue;
            }
            let first = node.first as usize;
            for &number in &self.order[first..first + node.count as usize] {
                if overlap(&self.boxes[number as usize], region) {
                    visit(number as usize);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_boxes_that_overlap_are_found() {
        // Of a row of squares with sides of 1.5 at distances of 1.
        let squares = (0..100).map(|i| {
            let x = f64::from(i);
            around(&[[x, 0.0], [x + 1.5, 1.5]], 0.0)
        });
        let tree = Tree::new(squares.collect());
        for (region, expected) in [
            ([[10.2, 0.5], [10.3, 0.6]], vec![9, 10]),
            ([[10.2, 2.0], [10.3, 3.0]], vec![]),
            ([[98.7, 0.0], [400.0, 0.0]], vec![98, 99]),
        ] {
            let mut found = Vec::new();
            tree.visit(&region, |number| found.push(number));
            found.sort_unstable();
            assert_eq!(found, expected);
        }
        Tree::<2>::new(Vec::new()).visit(&[[0.0; 2], [1.0; 2]], |_| unreachable!());
    }
}
