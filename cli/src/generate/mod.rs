//! Shapes that the program draws itself, as functions whose sign tells inside from outside.
//!
//! Every shape is drawn about the origin and [`Placed`] into the unit box. [`area_share`] samples
//! it on a grid: the value at a node is the share of the box of one spacing about it that lies
//! inside, so that the level 1/2 follows the boundary to a small part of a cell.

mod blob;
pub mod command;
mod family;
mod letter;
mod outline;
mod solid;

use fe_grid::{Grid, ScalarField, parallel};

pub use blob::Blob;
pub use family::{Family, Member, family, letters};
pub use letter::{Letter, letter};
pub use outline::{Outline, Pen};
pub use solid::{Bar, Cross, Ellipsoid, Star};

/// A shape given by a function: positive inside, zero on the boundary, negative outside.
pub trait Implicit<const D: usize>: Sync {
    /// The function. Near the boundary it is the signed distance to first order.
    fn value(&self, point: [f64; D]) -> f64;

    /// The function is nowhere larger in size than this multiple of the distance to the boundary.
    fn stretch(&self) -> f64 {
        1.0
    }
}

/// A shape turned about its origin and put into the unit box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<S, const D: usize> {
    /// The shape, drawn about the origin.
    pub shape: S,
    /// Angle in degrees from the first axis towards the second; about the third axis in 3D.
    pub rotation: f64,
    /// Where the shape's origin is put.
    pub centre: [f64; D],
}

impl<S, const D: usize> Placed<S, D> {
    /// The shape with its origin in the middle of the unit box, not turned.
    pub fn centred(shape: S) -> Self {
        Self {
            shape,
            rotation: 0.0,
            centre: [0.5; D],
        }
    }
}

impl<S: Implicit<D>, const D: usize> Implicit<D> for Placed<S, D> {
    fn value(&self, point: [f64; D]) -> f64 {
        let mut local: [f64; D] = std::array::from_fn(|k| point[k] - self.centre[k]);
        let (sin, cos) = self.rotation.to_radians().sin_cos();
        (local[0], local[1]) = (
            cos * local[0] + sin * local[1],
            cos * local[1] - sin * local[0],
        );
        self.shape.value(local)
    }

    fn stretch(&self) -> f64 {
        self.shape.stretch()
    }
}

impl<S: Implicit<D> + ?Sized, const D: usize> Implicit<D> for &S {
    fn value(&self, point: [f64; D]) -> f64 {
        (**self).value(point)
    }

    fn stretch(&self) -> f64 {
        (**self).stretch()
    }
}

/// The share of the box of one spacing about each node that lies inside a shape.
pub fn area_share<const D: usize>(shape: &impl Implicit<D>, grid: Grid<D>) -> ScalarField<f64, D> {
    let mut field = ScalarField::zeros(grid);
    let row = grid.nodes_per_axis()[0];
    parallel::for_each_chunk(field.as_mut_slice(), row, 1, &|j, values| {
        for (i, value) in values.iter_mut().enumerate() {
            let centre = grid.position(grid.node(j * row + i));
            *value = box_share(shape, centre, grid.spacing());
        }
    });
    field
}

/// Share of a box of side `h` that lies inside. Boxes that the boundary may cross are cut into
/// pieces; in a piece the boundary is taken for a plane across its middle axis.
fn box_share<const D: usize>(shape: &impl Implicit<D>, centre: [f64; D], h: f64) -> f64 {
    let value = shape.value(centre);
    let reach = 0.5 * h * (D as f64).sqrt();
    if value.abs() > shape.stretch() * reach {
        return f64::from(u8::from(value > 0.0));
    }
    let pieces = if D == 2 { 8usize } else { 4 };
    let side = h / pieces as f64;
    let total: f64 = (0..pieces.pow(D as u32))
        .map(|mut index| {
            let point = centre.map(|c| {
                let i = index % pieces;
                index /= pieces;
                c - 0.5 * h + (i as f64 + 0.5) * side
            });
            (0.5 + shape.value(point) / side).clamp(0.0, 1.0)
        })
        .sum();
    total / pieces.pow(D as u32) as f64
}

/// Makes a grey image of shares of area: grey values `contrast` apart about the middle, and normal
/// noise of this standard deviation.
pub fn make_grey(values: &mut [f64], contrast: f64, noise: f64, seed: u64) {
    let mut random = Random::new(seed);
    for value in values {
        *value = 0.5 + contrast * (*value - 0.5) + noise * random.normal();
    }
}

/// Random numbers that are the same everywhere: SplitMix64 (Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number in `[0, 1)`.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        // 53 bits fit a double exactly.
        (z >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number of the standard normal distribution (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        // A logarithm of zero is avoided: `1 - u` lies in `(0, 1]`.
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// The next number in `[low, high)`.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_share_of_a_disk_and_a_ball_is_their_volume() {
        let disk = Placed::<_, 2>::centred(Ellipsoid { radii: [0.25; 2] });
        let share = area_share(&disk, Grid::cube(65));
        let area = share.as_slice().iter().sum::<f64>() / 64.0f64.powi(2);
        // Pieces of h/8: the curvature of the boundary within a piece costs about 1e-5.
        assert_relative_eq!(area, std::f64::consts::PI / 16.0, epsilon = 2e-5);
        let ball = Placed::<_, 3>::centred(Ellipsoid { radii: [0.3; 3] });
        let share = area_share(&ball, Grid::cube(33));
        let volume = share.as_slice().iter().sum::<f64>() / 32.0f64.powi(3);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.027;
        // Pieces of h/4 cut by slanted planes are taken as cut across an axis: about 1e-4.
        assert_relative_eq!(volume, exact, epsilon = 1e-4);
    }

    #[test]
    fn turning_goes_from_x_to_y() {
        let bar = Placed {
            shape: Ellipsoid { radii: [0.4, 0.1] },
            rotation: 90.0,
            centre: [0.5, 0.5],
        };
        assert!(bar.value([0.5, 0.85]) > 0.0);
        assert!(bar.value([0.85, 0.5]) < 0.0);
        let tilted = Placed {
            rotation: 30.0,
            ..bar
        };
        assert!(tilted.value([0.5 + 0.3, 0.5 + 0.17]) > 0.0);
        assert!(tilted.value([0.5 + 0.3, 0.5 - 0.17]) < 0.0);
    }

    #[test]
    fn noise_is_normal() {
        let mut values = vec![1.0; 40_000];
        make_grey(&mut values, 0.4, 0.1, 3);
        let n = values.len() as f64;
        let moment = |k: i32| {
            values
                .iter()
                .map(|v| ((v - 0.7) / 0.1).powi(k))
                .sum::<f64>()
                / n
        };
        // Standard errors of the moments of so many numbers are .005, .007 and .05.
        assert!(moment(1).abs() < 0.02 && (moment(2) - 1.0).abs() < 0.03);
        assert!((moment(4) - 3.0).abs() < 0.2);
    }

    #[test]
    fn random_numbers_are_those_of_the_published_generator() {
        // First output of SplitMix64 with seed 0 is 0xe220a8397b1dcdaf.
        let expected = (0xe220_a839_7b1d_cdafu64 >> 11) as f64 / (1u64 << 53) as f64;
        assert_eq!(Random::new(0).uniform(), expected);
    }
}
