//! Shapes on grids: the fraction of area or volume around each node, and grey images.

use fe_grid::{Grid, ScalarField, parallel};

use crate::implicit::Implicit;
use crate::random::Random;

/// The fraction of the box of one spacing around each node that lies inside a shape.
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

/// Fraction of a box of side `h` that lies inside. Boxes that may contain the boundary are
/// subdivided; in a piece the boundary is approximated by a plane across its main axis.
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

/// Converts fractions of area to a grey image: grey values `contrast` apart, symmetric about
/// mid-grey, and normal noise of this standard deviation.
pub fn make_grey(values: &mut [f64], contrast: f64, noise: f64, seed: u64) {
    let mut random = Random::new(seed);
    for value in values {
        *value = 0.5 + contrast * (*value - 0.5) + noise * random.normal();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::placed::Placed;
    use crate::solid::Ellipsoid;
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
}
