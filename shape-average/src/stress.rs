//! The stress that a deformation leaves in its shape.
//!
//! All laws are compiled here for both dimensions, once, as in `elastic`.

use crate::error::AverageError;
use fe_grid::{Field, ScalarField, Tensor};
use hyperelastic::{LawError, LawSpec, LawVisitor, StoredEnergy, cauchy_stress};

/// The Cauchy stress `sigma = det(A)^-1 W_,A(A) A^T`, `A = 1 + Du`, of a displacement at the nodes of
/// the undeformed shape, row by row: entry `i D + j` is the field of `sigma_ij`. `Du` is the mean of
/// the differences to both neighbours along each axis. NaN where a deformation folds.
///
/// # Errors
/// Those of the law.
pub fn cauchy_stress_at_nodes<const D: usize>(
    law: &LawSpec,
    displacement: &Field<f64, D, D>,
) -> Result<Vec<ScalarField<f64, D>>, AverageError> {
    const { assert!(D == 2 || D == 3) };
    let grid = *displacement.grid();
    let nodes = grid.nodes_per_axis();
    let mut gradients = Vec::with_capacity(D * D * grid.n_nodes());
    for index in 0..grid.n_nodes() {
        let node = grid.node(index);
        let mut stride = 1;
        let mut columns = [[0.0; D]; D];
        for (k, column) in columns.iter_mut().enumerate() {
            let low = index - stride * usize::from(node[k] > 0);
            let high = index + stride * usize::from(node[k] + 1 < nodes[k]);
            let apart = (high - low) as f64 / stride as f64 * grid.spacing();
            let (before, after) = (displacement.at(low), displacement.at(high));
            *column = std::array::from_fn(|i| (after[i] - before[i]) / apart);
            stride *= nodes[k];
        }
        gradients.extend((0..D * D).map(|entry| columns[entry % D][entry / D]));
    }
    let stresses = if D == 2 {
        in_the_plane(law, &gradients)?
    } else {
        in_space(law, &gradients)?
    };
    let entry = |e: usize| stresses.iter().skip(e).step_by(D * D).copied().collect();
    (0..D * D)
        .map(|e| Ok(ScalarField::from_vec(grid, entry(e))?))
        .collect()
}

#[inline(never)]
fn in_the_plane(law: &LawSpec, gradients: &[f64]) -> Result<Vec<f64>, LawError> {
    law.visit::<2, _>(Visitor { gradients })
}

#[inline(never)]
fn in_space(law: &LawSpec, gradients: &[f64]) -> Result<Vec<f64>, LawError> {
    law.visit::<3, _>(Visitor { gradients })
}

struct Visitor<'a> {
    gradients: &'a [f64],
}

impl<const D: usize> LawVisitor<D> for Visitor<'_> {
    type Output = Vec<f64>;

    fn visit<W: StoredEnergy<D>>(self, law: W) -> Vec<f64> {
        let stress = |gradient: &[f64]| {
            let h: Tensor<f64, D> =
                std::array::from_fn(|i| std::array::from_fn(|j| gradient[i * D + j]));
            let sigma = cauchy_stress(&h, &law.gradient(&h).1);
            sigma.into_iter().flatten().collect::<Vec<f64>>()
        };
        self.gradients
            .chunks_exact(D * D)
            .flat_map(stress)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::{Grid, VectorField};
    use hyperelastic::LameModuli;

    /// Of a small homogeneous strain the stress is that of linear elasticity; a rotation that follows
    /// turns it.
    #[test]
    fn a_homogeneous_strain_has_the_stress_of_hooke() {
        let (lambda, mu) = (1.3, 0.7);
        let moduli = LameModuli { lambda, mu };
        let law = LawSpec::new("logdet", moduli).unwrap();
        let small = 1e-5;
        let turn = |[x, y]: [f64; 2]| {
            let (sin, cos) = 0.4f64.sin_cos();
            [cos * x - sin * y, sin * x + cos * y]
        };
        for rotated in [false, true] {
            let u = VectorField::<f64, 2>::from_fn(Grid::cube(9), |[x, y]| {
                let strained = [x + small * (2.0 * x + y), y + small * (x - y)];
                let [a, b] = if rotated { turn(strained) } else { strained };
                [a - x, b - y]
            });
            let sigma = cauchy_stress_at_nodes(&law, &u).unwrap();
            // Strain ((2, 1), (1, -1)) of trace 1; turned, R sigma R^T.
            let flat = [lambda + 4.0 * mu, 2.0 * mu, 2.0 * mu, lambda - 2.0 * mu];
            let first = turn([flat[0], flat[2]]);
            let second = turn([flat[1], flat[3]]);
            let above = turn([first[0], second[0]]);
            let below = turn([first[1], second[1]]);
            let exact = if rotated {
                [above[0], above[1], below[0], below[1]]
            } else {
                flat
            };
            for (field, exact) in sigma.iter().zip(exact) {
                for s in field.as_slice() {
                    // Second order in the strain.
                    assert!((s / small - exact).abs() < 2e-4, "{s} {exact}");
                }
            }
        }
    }
}
