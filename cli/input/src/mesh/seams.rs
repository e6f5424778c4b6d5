//! Faces inside of an object: where closed parts of a surface touch in a part of a face, or overlap.
//!
//! Distances are those to the boundary of the object, to which such faces do not belong. Faces of opposite
//! orientation that lie on each other are found by the area that they have in common, and of parts that cross each
//! other the triangles inside.

use fe_grid::tensor::determinant;
use levelset::bounds;

use super::mend::SAME;
use crate::nearby::{Tree, around};

/// Cosine of the angle between the normals of faces that may lie on each other.
const OPPOSITE: f64 = -0.9;
/// Pairs of triangles, and of a triangle and a line, that are compared.
const MOST_PAIRS: usize = 1 << 28;

/// A point in the middle of a triangle, by its shares of the corners; the line from it meets no edges of regular
/// meshes.
const MIDDLE: [f64; 3] = [0.3137, 0.3391, 0.3472];

type Triangle = [[f64; 3]; 3];
type Plane = [[f64; 2]; 3];

/// The faces inside of the object that a closed surface encloses.
pub(crate) fn faces_inside(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Inside {
    let [low, high] = bounds(points.iter().copied());
    let largest = points
        .iter()
        .flatten()
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    let tolerance = SAME * norm(&minus(&high, &low)).max(largest);
    Seams::new(points, triangles, tolerance).inside()
}

/// A surface whose triangles are compared.
struct Seams<'a> {
    points: &'a [[f64; 3]],
    triangles: &'a [[u32; 3]],
    /// The distance up to which faces lie on each other.
    tolerance: f64,
}

/// The faces inside of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Inside {
    /// Twice the area where faces of opposite orientation lie on each other.
    pub common: f64,
    /// Area of the triangles that lie inside, where triangles cross.
    pub crossed: f64,
}

impl<'a> Seams<'a> {
    fn new(points: &'a [[f64; 3]], triangles: &'a [[u32; 3]], tolerance: f64) -> Self {
        Self {
            points,
            triangles,
            tolerance,
        }
    }

    /// The faces inside; as far as they were found, where triangles are too many to compare all.
    fn inside(&self) -> Inside {
        let all = (0..self.triangles.len()).map(|i| around(&self.corners(i), self.tolerance));
        let tree = Tree::new(all.collect());
        let mut found = Inside::default();
        let mut crosses = false;
        let mut left = MOST_PAIRS;
        for one in 0..self.triangles.len() {
            let a = self.corners(one);
            tree.visit(tree.bounds(one), |other| {
                if other <= one || left == 0 {
                    return;
                }
                left -= 1;
                let b = self.corners(other);
                found.common += 2.0 * self.common(&a, &b);
                let [s, t] = [one, other].map(|i| self.triangles[i]);
                if !crosses && !s.iter().any(|corner| t.contains(corner)) {
                    crosses = cross(&a, &b, self.tolerance) || cross(&b, &a, self.tolerance);
                }
            });
        }
        if crosses {
            found.crossed = self.crossed(&tree, left);
        }
        found
    }

    fn corners(&self, number: usize) -> Triangle {
        self.triangles[number].map(|corner| self.points[corner as usize])
    }

    /// The area where two triangles of opposite orientation lie on each other.
    fn common(&self, a: &Triangle, b: &Triangle) -> f64 {
        let normals = [normal(a), normal(b)];
        let sizes = normals.map(|n| norm(&n));
        if dot(&normals[0], &normals[1]) > OPPOSITE * sizes[0] * sizes[1] {
            return 0.0;
        }
        let (large, small, n, size) = if sizes[0] >= sizes[1] {
            (a, b, normals[0], sizes[0])
        } else {
            (b, a, normals[1], sizes[1])
        };
        let far = |p: &[f64; 3]| dot(&n, &minus(p, &large[0])).abs() / size;
        if small.iter().any(|p| far(p) > self.tolerance) {
            return 0.0;
        }
        // Areas in a plane of coordinates are smaller by the share of the normal along the third one.
        let axis = main_axis(&n);
        let flat = |t: &Triangle| t.map(|p| [p[(axis + 1) % 3], p[(axis + 2) % 3]]);
        let area = overlap(&flat(large), &flat(small)) * size / n[axis].abs();
        let rim = (0..3).map(|k| norm(&minus(&small[k], &small[(k + 1) % 3])));
        // Neighbours that are folded by rounding are no face.
        if area > self.tolerance * rim.sum::<f64>() {
            area
        } else {
            0.0
        }
    }

    /// The area of the triangles with the object on both sides of their middle.
    fn crossed(&self, tree: &Tree<3>, mut left: usize) -> f64 {
        let mut sum = 0.0;
        for own in 0..self.triangles.len() {
            let corners = self.corners(own);
            let n = normal(&corners);
            let axis = main_axis(&n);
            let middle: [f64; 3] =
                std::array::from_fn(|k| (0..3).map(|i| MIDDLE[i] * corners[i][k]).sum());
            let mut low = middle;
            low[axis] = f64::NEG_INFINITY;
            let mut number = 0;
            tree.visit(&[low, middle], |other| {
                if other == own || left == 0 {
                    return;
                }
                left -= 1;
                let corners = self.corners(other);
                if is_below(&corners, axis, &middle) {
                    // A triangle whose normal points backwards is entered.
                    number += if normal(&corners)[axis] < 0.0 { 1 } else { -1 };
                }
            });
            let beyond = number + if n[axis] < 0.0 { 1 } else { -1 };
            if number != 0 && beyond != 0 && left > 0 {
                sum += 0.5 * norm(&n);
            }
        }
        sum
    }
}

fn minus(p: &[f64; 3], q: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| p[k] - q[k])
}

fn dot(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    (0..3).map(|k| p[k] * q[k]).sum()
}

fn norm(p: &[f64; 3]) -> f64 {
    dot(p, p).sqrt()
}

/// The normal of a triangle, whose length is twice the area.
fn normal(t: &Triangle) -> [f64; 3] {
    let (u, v) = (minus(&t[1], &t[0]), minus(&t[2], &t[0]));
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        u[i] * v[j] - u[j] * v[i]
    })
}

fn main_axis(n: &[f64; 3]) -> usize {
    let largest = (0..3).max_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs()));
    largest.unwrap_or(0)
}

/// Whether an edge of one triangle goes through another one, by more than a tolerance.
fn cross(edges: &Triangle, face: &Triangle, tolerance: f64) -> bool {
    let volume = |a: &[f64; 3], b: &[f64; 3], c: &[f64; 3], d: &[f64; 3]| {
        determinant(&[minus(a, d), minus(b, d), minus(c, d)])
    };
    let least = tolerance * norm(&normal(face));
    (0..3).any(|k| {
        let (p, q) = (&edges[k], &edges[(k + 1) % 3]);
        let sides = [p, q].map(|x| volume(&face[0], &face[1], &face[2], x));
        if sides[0] * sides[1] >= 0.0 || sides.iter().any(|x| x.abs() <= least) {
            return false;
        }
        let along = minus(q, p);
        let turns = [0, 1, 2].map(|i| {
            let (a, b) = (&face[i], &face[(i + 1) % 3]);
            let least = tolerance * norm(&minus(b, a)) * norm(&along);
            let turn = volume(a, b, q, p);
            if turn.abs() > least { turn } else { 0.0 }
        });
        turns.iter().all(|x| *x > 0.0) || turns.iter().all(|x| *x < 0.0)
    })
}

/// Whether the line along an axis that ends at a point goes through a triangle.
fn is_below(t: &Triangle, axis: usize, end: &[f64; 3]) -> bool {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let sides = [0, 1, 2].map(|k| {
        let (p, q) = (&t[(k + 1) % 3], &t[(k + 2) % 3]);
        (q[u] - p[u]) * (end[v] - p[v]) - (q[v] - p[v]) * (end[u] - p[u])
    });
    let inside = sides.iter().all(|x| *x > 0.0) || sides.iter().all(|x| *x < 0.0);
    if !inside {
        return false;
    }
    let sum: f64 = sides.iter().sum();
    let height = (0..3).map(|k| sides[k] * t[k][axis]).sum::<f64>() / sum;
    height < end[axis]
}

fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// The area that two triangles in a plane have in common.
fn overlap(one: &Plane, other: &Plane) -> f64 {
    let sign = turn(one[0], one[1], one[2]).signum();
    let mut rest = other.to_vec();
    for k in 0..3 {
        let (p, q) = (one[k], one[(k + 1) % 3]);
        let height = |r: [f64; 2]| sign * turn(p, q, r);
        let mut cut = Vec::with_capacity(rest.len() + 1);
        for (i, &r) in rest.iter().enumerate() {
            let next = rest[(i + 1) % rest.len()];
            let (here, there) = (height(r), height(next));
            if here >= 0.0 {
                cut.push(r);
            }
            if (here >= 0.0) != (there >= 0.0) {
                let share = here / (here - there);
                cut.push(std::array::from_fn(|k| r[k] + share * (next[k] - r[k])));
            }
        }
        rest = cut;
    }
    let fan = rest.windows(2).map(|pair| turn(rest[0], pair[0], pair[1]));
    0.5 * fan.sum::<f64>().abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use test_support::cuboid;

    fn block(
        points: &mut Vec<[f64; 3]>,
        triangles: &mut Vec<[u32; 3]>,
        low: [f64; 3],
        high: [f64; 3],
    ) {
        let first = points.len() as u32;
        let (corners, faces) = cuboid(low, high);
        points.extend(corners);
        triangles.extend(faces.into_iter().map(|t| t.map(|corner| first + corner)));
    }

    /// What lies inside of a block of 4 x 3 x 3 and another one.
    fn with(low: [f64; 3], high: [f64; 3]) -> Inside {
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        block(&mut points, &mut triangles, [0.0; 3], [4.0, 3.0, 3.0]);
        block(&mut points, &mut triangles, low, high);
        let (sin, cos) = 0.4f64.sin_cos();
        let turned = points.iter().map(|p| {
            let x = cos * p[0] - sin * p[1];
            let y = sin * p[0] + cos * p[1];
            [x, cos * y - sin * p[2], sin * y + cos * p[2]]
        });
        let turned: Vec<_> = turned.collect();
        let [straight, found] =
            [&points, &turned].map(|points| Seams::new(points, &triangles, 1e-6).inside());
        assert!(
            (straight.common - found.common).abs() < 1e-9,
            "{straight:?} {found:?}"
        );
        assert!(
            (straight.crossed - found.crossed).abs() < 1e-9,
            "{straight:?} {found:?}"
        );
        found
    }

    #[test]
    fn faces_that_lie_on_each_other_in_part_are_measured() {
        let standing = with([4.0, 0.5, 0.5], [6.0, 2.5, 2.5]);
        assert!((standing.common - 8.0).abs() < 1e-9, "{standing:?}");
        let beside = with([4.0, 2.0, -1.0], [6.0, 5.0, 1.0]);
        assert!((beside.common - 2.0).abs() < 1e-9, "{beside:?}");
        // Apart, along an edge, and with the same orientation.
        for (low, high) in [
            ([4.1, 0.5, 0.5], [6.0, 2.5, 2.5]),
            ([4.0, 3.0, 0.0], [6.0, 5.0, 3.0]),
            ([0.5, 0.5, 1.0], [2.0, 2.0, 2.0]),
        ] {
            assert_eq!(with(low, high), Inside::default());
        }
    }

    #[test]
    fn triangles_inside_of_parts_that_cross_are_measured() {
        let thin = with([3.999, 0.5, 0.5], [6.0, 2.5, 2.5]);
        assert_eq!(thin.common, 0.0);
        // The smaller face, and the middles of the triangles of the larger one.
        assert!(thin.crossed >= 4.0, "{thin:?}");
    }
}
