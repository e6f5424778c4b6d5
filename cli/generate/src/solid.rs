//! Shapes composed of boxes and balls. In 3D the flat ones are given a thickness.

use crate::implicit::Implicit;

/// A disk, ellipse, ball or ellipsoid about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid<const D: usize> {
    /// Semi-axes.
    pub radii: [f64; D],
}

impl<const D: usize> Implicit<D> for Ellipsoid<D> {
    /// `(1 - k) / |grad k|` with `k = |x / r|`: the distance for equal axes, else to first order.
    fn value(&self, point: [f64; D]) -> f64 {
        let k = norm(&std::array::from_fn::<_, D, _>(|i| {
            point[i] / self.radii[i]
        }));
        let slope = norm(&std::array::from_fn::<_, D, _>(|i| {
            point[i] / (self.radii[i] * self.radii[i])
        }));
        if k < 1e-9 {
            return self.radii.iter().copied().fold(f64::INFINITY, f64::min);
        }
        (1.0 - k) * k / slope
    }

    fn stretch(&self) -> f64 {
        let longest = self.radii.iter().copied().fold(0.0, f64::max);
        let shortest = self.radii.iter().copied().fold(f64::INFINITY, f64::min);
        longest / shortest
    }
}

/// A bar of two arms that meet at an angle, rounded off at the joint; the origin is its centroid.
/// 180 degrees give a rectangle. The joint points to larger `y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    length: f64,
    width: f64,
    /// Direction of the right arm; the left one is its mirror image.
    arm: [f64; 2],
    /// Height of the joint over the centroid.
    joint: f64,
}

impl Bar {
    /// A bar of two arms of half the length each, with the given inner angle in degrees.
    pub fn new(length: f64, width: f64, angle: f64) -> Self {
        let (sin, cos) = (0.5 * angle).to_radians().sin_cos();
        let mut bar = Self {
            length,
            width,
            arm: [sin, -cos],
            joint: 0.0,
        };
        bar.joint = -bar.centroid_height();
        bar
    }

    /// Height of the centroid over the joint, by the midpoint rule.
    fn centroid_height(&self) -> f64 {
        const CELLS: usize = 600;
        let reach = 0.5 * self.length + self.width;
        let side = 2.0 * reach / CELLS as f64;
        let middle = |i: usize| (i as f64 + 0.5) * side - reach;
        let (mut area, mut moment) = (0.0, 0.0);
        for j in 0..CELLS {
            for i in 0..CELLS {
                let share = (0.5 + self.flat_value([middle(i), middle(j)]) / side).clamp(0.0, 1.0);
                area += share;
                moment += share * middle(j);
            }
        }
        moment / area
    }

    /// Value of the flat bar at a point relative to the centroid.
    fn flat_value(&self, [x, y]: [f64; 2]) -> f64 {
        let (x, y) = (x.abs(), y - self.joint);
        let along = x * self.arm[0] + y * self.arm[1];
        let across = -x * self.arm[1] + y * self.arm[0];
        let half = 0.25 * self.length;
        let arm = box_value([along - half, across], [half, 0.5 * self.width]);
        arm.max(0.5 * self.width - x.hypot(y))
    }
}

impl<const D: usize> Implicit<D> for Bar {
    fn value(&self, point: [f64; D]) -> f64 {
        thickened(point, 0.5 * self.width, |flat| self.flat_value(flat))
    }
}

/// A cross of four arms, the left and the right one bent half-way out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cross {
    /// Length of an arm from the middle to its end.
    pub arm: f64,
    /// Width of the arms.
    pub width: f64,
    /// Angles by which the outer halves of the left and right arm are bent towards larger `y`, in
    /// degrees.
    pub bend: [f64; 2],
}

impl Cross {
    fn flat_value(&self, point: [f64; 2]) -> f64 {
        let upright = box_value(point, [0.5 * self.width, self.arm]);
        let [left, right] = self.bend;
        upright
            .max(self.side_arm([-point[0], point[1]], left))
            .max(self.side_arm(point, right))
    }

    /// The arm to the right, bent by an angle.
    fn side_arm(&self, [x, y]: [f64; 2], bend: f64) -> f64 {
        let (quarter, half_width) = (0.25 * self.arm, 0.5 * self.width);
        let inner = box_value([x - quarter, y], [quarter, half_width]);
        let (sin, cos) = bend.to_radians().sin_cos();
        let (x, y) = (x - 2.0 * quarter, y);
        let (along, across) = (cos * x + sin * y, cos * y - sin * x);
        let outer = box_value([along - quarter, across], [quarter, half_width]);
        inner.max(outer).max(half_width - x.hypot(y))
    }
}

impl<const D: usize> Implicit<D> for Cross {
    fn value(&self, point: [f64; D]) -> f64 {
        thickened(point, 0.5 * self.width, |flat| self.flat_value(flat))
    }
}

/// A disk with protruding pins, evenly spaced except for the first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Star {
    /// Number of pins.
    pub pins: usize,
    /// Radius of the disk.
    pub radius: f64,
    /// Distance of the pins' ends from the middle.
    pub reach: f64,
    /// Width of the pins.
    pub width: f64,
    /// Angle by which the first pin, which points along `x`, is moved towards the second, in
    /// degrees.
    pub first_pin: f64,
}

impl Star {
    fn flat_value(&self, [x, y]: [f64; 2]) -> f64 {
        let half = 0.5 * (self.reach - 0.5 * self.width);
        let pin = |k: usize| {
            let mut angle = 360.0 * k as f64 / self.pins as f64;
            if k == 0 {
                angle += self.first_pin;
            }
            let (sin, cos) = angle.to_radians().sin_cos();
            let (along, across) = (cos * x + sin * y, cos * y - sin * x);
            let shaft = box_value([along - half, across], [half, 0.5 * self.width]);
            shaft.max(0.5 * self.width - (along - 2.0 * half).hypot(across))
        };
        (0..self.pins)
            .map(pin)
            .fold(self.radius - x.hypot(y), f64::max)
    }
}

impl<const D: usize> Implicit<D> for Star {
    fn value(&self, point: [f64; D]) -> f64 {
        thickened(point, 0.5 * self.radius, |flat| self.flat_value(flat))
    }
}

/// A flat shape, in 3D cut off at `|z| = half`.
pub(crate) fn thickened<const D: usize>(
    point: [f64; D],
    half: f64,
    flat: impl Fn([f64; 2]) -> f64,
) -> f64 {
    let value = flat([point[0], point[1]]);
    if D < 3 {
        return value;
    }
    let across = half - point[2].abs();
    if value < 0.0 && across < 0.0 {
        return -value.hypot(across);
    }
    value.min(across)
}

/// Signed distance to a box about the origin, positive inside.
pub(crate) fn box_value<const D: usize>(point: [f64; D], half: [f64; D]) -> f64 {
    let excess: [f64; D] = std::array::from_fn(|k| point[k].abs() - half[k]);
    let outside = norm(&excess.map(|e| e.max(0.0)));
    if outside > 0.0 {
        -outside
    } else {
        -excess.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

fn norm<const D: usize>(vector: &[f64; D]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::{Placed, area_share};
    use super::*;
    use approx::assert_relative_eq;
    use fe_grid::Grid;

    fn moments<const D: usize>(shape: impl Implicit<D>, nodes: usize) -> (f64, [f64; D]) {
        let grid = Grid::<D>::cube(nodes);
        let share = area_share(&Placed::centred(shape), grid);
        let (mut mass, mut first) = (0.0, [0.0; D]);
        for (index, value) in share.as_slice().iter().enumerate() {
            mass += value;
            let x = grid.position(grid.node(index));
            for k in 0..D {
                first[k] += value * x[k];
            }
        }
        (mass * grid.cell_volume(), first.map(|m| m / mass))
    }

    #[test]
    fn bars_have_the_area_and_centroid_they_should() {
        let (area, centroid) = moments::<2>(Bar::new(0.6, 0.12, 180.0), 129);
        assert_relative_eq!(area, 0.6 * 0.12, epsilon = 1e-6);
        assert_relative_eq!(centroid[1], 0.5, epsilon = 1e-6);
        let (area, centroid) = moments::<2>(Bar::new(0.6, 0.12, 118.0), 129);
        // Two arms, less the kite in which they overlap, plus the sector of the disc at the joint.
        let turn = (180.0f64 - 118.0).to_radians();
        let kite = 0.06 * 0.06 * (0.5 * turn).tan();
        let exact = 2.0 * 0.3 * 0.12 - kite + 0.5 * 0.06 * 0.06 * turn;
        // The corners of the arms are rounded by the sampling: 1e-5.
        assert_relative_eq!(area, exact, epsilon = 1e-5);
        assert_relative_eq!(centroid[0], 0.5, epsilon = 1e-12);
        assert_relative_eq!(centroid[1], 0.5, epsilon = 1e-5);
        let (volume, _) = moments::<3>(Bar::new(0.6, 0.12, 180.0), 51);
        // Faces across the axes are sampled exactly, the rounded edges cost less than 1e-3.
        assert_relative_eq!(volume, 0.6 * 0.12 * 0.12, max_relative = 1e-3);
    }

    #[test]
    fn the_joint_of_a_bent_bar_points_up_in_y() {
        let bar = Bar::new(0.6, 0.12, 118.0);
        assert!(bar.value([0.0, 0.1]) > 0.0);
        assert!(bar.value([0.0, -0.05]) < 0.0);
        assert!(bar.value([0.22, -0.08]) > 0.0);
    }

    #[test]
    fn a_flat_ellipse_keeps_its_first_order_distance() {
        let ellipse = Ellipsoid { radii: [0.3, 0.1] };
        assert_relative_eq!(ellipse.value([0.301, 0.0]), -0.001, max_relative = 0.01);
        assert_relative_eq!(ellipse.value([0.0, 0.099]), 0.001, max_relative = 0.02);
        assert_eq!(ellipse.value([0.0, 0.0]), 0.1);
        assert_relative_eq!(ellipse.stretch(), 3.0, epsilon = 1e-12);
    }

    #[test]
    fn bends_and_pins_move_what_they_name() {
        let cross = Cross {
            arm: 0.3,
            width: 0.1,
            bend: [0.0, 40.0],
        };
        assert!(cross.value([-0.28, 0.0]) > 0.0);
        assert!(cross.value([0.28, 0.0]) < 0.0);
        assert!(cross.value([0.25, 0.09]) > 0.0);
        let star = Star {
            pins: 4,
            radius: 0.15,
            reach: 0.33,
            width: 0.06,
            first_pin: 45.0,
        };
        assert!(star.value([0.3, 0.0]) < 0.0);
        assert!(star.value([0.2, 0.2]) > 0.0);
        assert!(star.value([-0.3, 0.0]) > 0.0);
        assert!(Implicit::<3>::value(&star, [-0.3, 0.0, 0.1]) < 0.0);
    }
}
