//! Energies of deformations on grids, under any law by its name.

use fe_grid::pullback::Derivatives;
use fe_grid::{Field, Grid, VectorField};
use hyperelastic::LawSpec;
use shape_pca::{PcaError, Source, evaluate};

/// `int ((1 - delta) chi + delta) W(Dphi)` of a displacement.
///
/// # Errors
/// Those of the law, and where the deformation folds.
pub fn elastic_energy<const D: usize>(
    law: &LawSpec,
    void_stiffness: f64,
    displacement: &VectorField<f64, D>,
    indicator: &[f64],
) -> Result<f64, PcaError> {
    let source = Source {
        weight: 1.0,
        displacement: displacement.as_slice(),
        indicator,
    };
    let grid = displacement.grid();
    let value = Derivatives::Value;
    Ok(evaluate(grid, &law.compile()?, void_stiffness, &[source], &[], value)?.value)
}

/// The displacement of a deformation.
pub fn displacement<const D: usize>(
    grid: Grid<D>,
    deformation: impl Fn([f64; D]) -> [f64; D],
) -> VectorField<f64, D> {
    Field::from_fn(grid, |x| {
        let y = deformation(x);
        std::array::from_fn(|i| y[i] - x[i])
    })
}

/// A smooth deformation of moderate strain, without any symmetry.
pub fn smooth<const D: usize>(x: [f64; D]) -> [f64; D] {
    std::array::from_fn(|k| {
        let across = x[(k + 1) % D];
        x[k] + 0.04 * (3.0 * across + 1.7 * x[k] + k as f64).sin() + 0.03 * across * across
    })
}
