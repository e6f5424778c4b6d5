//! Closed plane curves as polygons.

use fe_grid::{Grid, ScalarField};
use levelset::Contour;
use levelset::polygon::{self, sides};

/// A point, or a vector, of the plane.
pub(super) type Point = [f64; 2];

/// A closed polygon with the object to its left; the first point is not repeated at the end.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    pub points: Vec<Point>,
}

/// The point of a curve next to another point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub distance: f64,
    pub point: Point,
    /// The segment from point `segment` to the next.
    pub segment: usize,
    /// The place on it, from 0 to 1.
    pub share: f64,
}

pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

/// `a + t b`.
pub(super) fn plus(a: Point, t: f64, b: Point) -> Point {
    [a[0] + t * b[0], a[1] + t * b[1]]
}

pub(super) fn norm(a: Point) -> f64 {
    a[0].hypot(a[1])
}

impl Curve {
    /// The curve of a contour that encloses the largest area, holes and other parts being left out.
    /// `None` where there is no closed curve.
    pub fn outer<const D: usize>(contour: &Contour<D>) -> Option<Self> {
        // In the plane the last two coordinates are the only ones.
        let flat = contour.points().iter().map(|p| [p[0], p[1]]).collect();
        let segments = contour.simplices().iter().map(|s| [s[0], s[1]]).collect();
        let curves = Contour::new(flat, segments).ok()?.polylines().into_iter();
        let closed = curves.filter(|curve| curve.closed && curve.points.len() > 2);
        let closed = closed.map(|curve| Self {
            points: curve.points,
        });
        closed.max_by(|a, b| a.area().total_cmp(&b.area()))
    }

    /// The enclosed area.
    pub fn area(&self) -> f64 {
        polygon::area(&self.points)
    }

    pub fn length(&self) -> f64 {
        sides(&self.points).map(|[a, b]| norm(minus(b, a))).sum()
    }

    /// The same curve by `n` points at equal distances along it, from the same first point.
    pub fn resampled(&self, n: usize) -> Self {
        let spacing = self.length() / n as f64;
        let mut points = Vec::with_capacity(n);
        let mut before = 0.0;
        for [a, b] in sides(&self.points) {
            let length = norm(minus(b, a));
            while points.len() < n {
                let along = points.len() as f64 * spacing - before;
                if along > length || length == 0.0 {
                    break;
                }
                points.push(plus(a, along / length, minus(b, a)));
            }
            before += length;
        }
        // Rounding may keep the last from being reached.
        while points.len() < n {
            points.push(self.points[0]);
        }
        Self { points }
    }

    /// The nearest point.
    pub fn nearest(&self, x: Point) -> Foot {
        let mut best = Foot {
            distance: f64::INFINITY,
            point: x,
            segment: 0,
            share: 0.0,
        };
        for (segment, [a, b]) in sides(&self.points).enumerate() {
            let (side, ray) = (minus(b, a), minus(x, a));
            let square = side[0] * side[0] + side[1] * side[1];
            let along = ray[0] * side[0] + ray[1] * side[1];
            let share = if square > 0.0 {
                (along / square).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let point = plus(a, share, side);
            let distance = norm(minus(x, point));
            if distance < best.distance {
                best = Foot {
                    distance,
                    point,
                    segment,
                    share,
                };
            }
        }
        best
    }

    /// The signed distance at the nodes of a plane grid, positive inside.
    pub fn signed_distance<const D: usize>(&self, grid: Grid<D>) -> ScalarField<f64, D> {
        ScalarField::from_fn(grid, |x| {
            let x = [x[0], x[1]];
            let sign = if polygon::encloses(&self.points, x) {
                1.0
            } else {
                -1.0
            };
            [sign * self.nearest(x).distance]
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A circle by `n` points.
    pub fn circle(centre: Point, radius: f64, n: usize) -> Curve {
        let at = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        let point = |k| {
            [
                centre[0] + radius * at(k).cos(),
                centre[1] + radius * at(k).sin(),
            ]
        };
        Curve {
            points: (0..n).map(point).collect(),
        }
    }

    #[test]
    fn a_square_has_its_area_length_and_distances() {
        let square = Curve {
            points: vec![[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]],
        };
        assert_relative_eq!(square.area(), 0.25);
        assert_relative_eq!(square.length(), 2.0);
        let eight = square.resampled(8);
        assert_eq!(eight.points[1], [0.5, 0.25]);
        assert_eq!(eight.points[7], [0.25, 0.5]);
        let u = square.signed_distance(Grid::<2>::cube(9));
        assert_relative_eq!(u.sample([0.5, 0.5])[0], 0.25);
        assert_relative_eq!(u.sample([0.0, 0.0])[0], -0.25 * 2f64.sqrt());
    }

    #[test]
    fn the_outer_curve_of_a_ring_is_the_larger() {
        let ring = ScalarField::from_fn(Grid::<2>::cube(65), |[x, y]: [f64; 2]| {
            [0.1 - ((x - 0.5).hypot(y - 0.5) - 0.3).abs()]
        });
        let contour = levelset::contour(&ring, 0.0, levelset::BoxEdge::Closed).unwrap();
        let outer = Curve::outer(&contour).unwrap();
        assert_relative_eq!(
            outer.area(),
            std::f64::consts::PI * 0.16,
            max_relative = 3e-3
        );
    }
}
