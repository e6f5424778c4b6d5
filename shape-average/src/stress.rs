//! The stress in a deformed shape.

use crate::error::AverageError;
use fe_grid::{Field, ScalarField, Tensor, compiled_once, mutant};
use hyperelastic::{LawSpec, cauchy_stress};

compiled_once! {
    /// Computes the Cauchy stress `sigma = det(A)^-1 W_,A(A) A^T`, `A = 1 + Du`, of a displacement at
    /// the nodes of the undeformed shape, row by row: entry `i D + j` is the field of `sigma_ij`. `Du`
    /// is the mean of the differences to both neighbours along each axis. NaN where a deformation
    /// folds.
    ///
    /// # Errors
    /// Those of the law.
    pub fn cauchy_stress_at_nodes<'a, D>(
        law: &'a LawSpec,
        displacement: &'a Field<f64, D, D>,
    ) -> Result<Vec<ScalarField<f64, D>>, AverageError> = stress_at_nodes;
}

fn stress_at_nodes<const D: usize>(
    law: &LawSpec,
    displacement: &Field<f64, D, D>,
) -> Result<Vec<ScalarField<f64, D>>, AverageError> {
    let law = law.compile::<D>()?;
    let grid = *displacement.grid();
    let nodes = grid.nodes_per_axis();
    let mut stresses = vec![Vec::with_capacity(grid.n_nodes()); D * D];
    for index in 0..grid.n_nodes() {
        let node = grid.node(index);
        let mut stride = 1;
        let mut gradient: Tensor<f64, D> = [[0.0; D]; D];
        for k in 0..D {
            let low = index - stride * usize::from(node[k] > 0);
            let high = index + stride * usize::from(node[k] + 1 < nodes[k]);
            let apart = (high - low) as f64 / stride as f64 * grid.spacing();
            let apart = mutant!(apart, StressSpacing => 0.5 * apart);
            let (before, after) = (displacement.at(low), displacement.at(high));
            for i in 0..D {
                gradient[i][k] = (after[i] - before[i]) / apart;
            }
            stride *= nodes[k];
        }
        let sigma = cauchy_stress(&gradient, &law.gradient(&gradient).1);
        for (entry, stress) in stresses.iter_mut().zip(sigma.as_flattened()) {
            entry.push(*stress);
        }
    }
    stresses
        .into_iter()
        .map(|entry| Ok(ScalarField::from_vec(grid, entry)?))
        .collect()
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
