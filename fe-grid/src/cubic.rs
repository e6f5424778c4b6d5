//! Cubic interpolation of nodal fields.

use crate::field::{Field, locate};
use crate::lane::Element;

/// Nodes of the interpolation along an axis.
const NODES: usize = 4;

impl<T: Element, const D: usize, const M: usize> Field<T, D, M> {
    /// Evaluates the interpolant that is cubic along every axis (Lagrange's, on the four nearest nodes inside the
    /// box), at the nearest point of the box; the multilinear one on grids of fewer than four nodes along an axis.
    ///
    /// It is exact for cubic polynomials. A field that is read through a deformation onto another grid, and whose
    /// gradients are used, is to be read in this way: half way between the nodes [`sample`](Self::sample) keeps
    /// 0.87 of the amplitude of a wave of six spacings, which is 0.75 of its energy, and this 0.97.
    pub fn sample_cubic(&self, point: [f64; D]) -> [f64; M] {
        let grid = self.grid();
        let cells = grid.cells_per_axis();
        if cells.iter().any(|&n| n + 1 < NODES) {
            return self.sample(point);
        }
        let (cell, local) = locate(grid, point);
        let (mut first, mut weights) = ([0; D], [[0.0; NODES]; D]);
        for k in 0..D {
            // The node before the point is the second of the four, but at the faces of the box.
            first[k] = cell[k].saturating_sub(1).min(cells[k] + 1 - NODES);
            weights[k] = lagrange((cell[k] - first[k]) as f64 + local[k]);
        }
        let (strides, n) = (grid.strides(), grid.n_nodes());
        let base = grid.node_index(first);
        let values = self.as_slice();
        let mut value = [0.0; M];
        for corner in 0..NODES.pow(D as u32) {
            let (mut rest, mut weight, mut index) = (corner, 1.0, base);
            for k in 0..D {
                weight *= weights[k][rest % NODES];
                index += strides[k] * (rest % NODES);
                rest /= NODES;
            }
            for (c, v) in value.iter_mut().enumerate() {
                *v += weight * values[c * n + index].to_f64();
            }
        }
        value
    }
}

/// The values at `t` of the cubic polynomials that are one at one of the points 0, 1, 2, 3 and zero at the others.
fn lagrange(t: f64) -> [f64; NODES] {
    let [a, b, c, d] = [t, t - 1.0, t - 2.0, t - 3.0];
    [
        -b * c * d / 6.0,
        a * c * d / 2.0,
        -a * b * d / 2.0,
        a * b * c / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use crate::{Field, Grid};

    proptest! {
        /// Exact for products of cubic polynomials, up to the faces, and constant beyond these.
        #[test]
        fn cubic_polynomials_are_exact(x in -0.1..1.1f64, y in -0.1..1.1f64) {
            let value = |[x, y]: [f64; 2]| [(x * x * x - 0.4 * x) * (2.0 - y * y * y), x + y];
            let field = Field::<f64, 2, 2>::from_fn(Grid::dyadic(3), value);
            let inside = [x, y].map(|x| x.clamp(0.0, 1.0));
            let expected = value(inside);
            for (found, expected) in field.sample_cubic([x, y]).iter().zip(expected) {
                prop_assert!((found - expected).abs() < 1e-13);
            }
        }
    }

    /// A wave of six spacings keeps 0.974 of its amplitude half way between the nodes, where linear interpolation
    /// keeps cos(pi/6).
    #[test]
    fn waves_keep_their_amplitude() {
        let grid = Grid::<1>::dyadic(5);
        let h = grid.spacing();
        let frequency = std::f64::consts::TAU / (6.0 * h);
        let wave = Field::<f64, 1, 1>::from_fn(grid, |[x]| [(frequency * (x - 16.5 * h)).cos()]);
        let middle = [16.5 * h];
        let linear = std::f64::consts::FRAC_PI_6.cos();
        assert!((wave.sample(middle)[0] - linear).abs() < 1e-12);
        // (9 cos(pi/6) - cos(pi/2)) / 8.
        assert!((wave.sample_cubic(middle)[0] - 9.0 / 8.0 * linear).abs() < 1e-12);
    }

    #[test]
    fn small_grids_are_interpolated_linearly() {
        let field = Field::<f64, 2, 1>::from_fn(Grid::dyadic(1), |[x, y]| [x * y]);
        assert_eq!(field.sample_cubic([0.3, 0.8]), field.sample([0.3, 0.8]));
    }
}
