//! Shapes drawn as closed outlines of straight lines and elliptic arcs.

use crate::implicit::Implicit;

/// Number of segments of a full turn of an arc.
const PIECES_PER_TURN: f64 = 128.0;

/// Draws one closed curve.
#[derive(Clone, Debug, Default)]
pub struct Pen {
    points: Vec<[f64; 2]>,
}

impl Pen {
    /// Starts at a point.
    pub fn start(point: [f64; 2]) -> Self {
        Self {
            points: vec![point],
        }
    }

    /// A polygon.
    pub fn polygon(points: &[[f64; 2]]) -> Self {
        Self {
            points: points.to_vec(),
        }
    }

    /// A straight line to a point.
    pub fn line(mut self, point: [f64; 2]) -> Self {
        self.points.push(point);
        self
    }

    /// A line to the start of an arc of an axis-parallel ellipse, and the arc. Angles in degrees,
    /// from the first axis towards the second.
    pub fn arc(mut self, centre: [f64; 2], radii: [f64; 2], from: f64, to: f64) -> Self {
        let pieces = ((to - from).abs() / 360.0 * PIECES_PER_TURN)
            .ceil()
            .max(1.0) as usize;
        for i in 0..=pieces {
            let angle = from + (to - from) * i as f64 / pieces as f64;
            let (sin, cos) = angle.to_radians().sin_cos();
            self.points
                .push([centre[0] + radii[0] * cos, centre[1] + radii[1] * sin]);
        }
        self
    }

    /// A whole ellipse.
    pub fn ellipse(centre: [f64; 2], radii: [f64; 2]) -> Self {
        let mut pen = Self::default().arc(centre, radii, 0.0, 360.0);
        // First and last point are the same.
        pen.points.pop();
        pen
    }
}

/// A shape bounded by closed curves; a point is inside where it is inside an odd number of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    curves: Vec<Vec<[f64; 2]>>,
}

impl Outline {
    /// A shape from its curves, moved and scaled so that the middle of its bounding box is the
    /// origin and its longer side has the given length.
    pub fn new(curves: Vec<Pen>, side: f64) -> Self {
        let mut curves: Vec<Vec<[f64; 2]>> = curves.into_iter().map(|pen| pen.points).collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in curves.iter().flatten() {
            for k in 0..2 {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
        let scale = side / f64::max(high[0] - low[0], high[1] - low[1]);
        for point in curves.iter_mut().flatten() {
            *point = [0, 1].map(|k| scale * (point[k] - 0.5 * (low[k] + high[k])));
        }
        Self { curves }
    }

    /// The curves, each closed from its last point to its first.
    pub fn curves(&self) -> &[Vec<[f64; 2]>] {
        &self.curves
    }
}

impl Implicit<2> for Outline {
    /// The signed distance.
    fn value(&self, [x, y]: [f64; 2]) -> f64 {
        let (mut square, mut inside) = (f64::INFINITY, false);
        for curve in &self.curves {
            for (i, &[bx, by]) in curve.iter().enumerate() {
                let [ax, ay] = curve[(i + curve.len() - 1) % curve.len()];
                let (ux, uy, px, py) = (bx - ax, by - ay, x - ax, y - ay);
                let length = ux * ux + uy * uy;
                let t = if length > 0.0 {
                    ((px * ux + py * uy) / length).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                square = square.min((px - t * ux).powi(2) + (py - t * uy).powi(2));
                if (ay > y) != (by > y) && px < py * ux / uy {
                    inside = !inside;
                }
            }
        }
        if inside {
            square.sqrt()
        } else {
            -square.sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_ring_of_a_square_and_a_circle_has_exact_distances() {
        let square = Pen::polygon(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        let ring = Outline::new(vec![square, Pen::ellipse([2.0, 2.0], [1.0, 1.0])], 4.0);
        assert_relative_eq!(ring.value([1.75, 0.0]), 0.25, epsilon = 1e-12);
        assert_relative_eq!(ring.value([3.0, 3.0]), -2f64.sqrt(), epsilon = 1e-12);
        // A polygon of 128 sides: its middle is 1 - cos(pi / 128) nearer than the circle.
        assert_relative_eq!(ring.value([0.0, 0.0]), -1.0, epsilon = 4e-4);
        assert_relative_eq!(ring.value([0.0, 1.25]), 0.25, epsilon = 4e-4);
    }
}
