//! The density of the dissipation of a path's steps at the nodes.

use crate::cells::object_cells;
use crate::error::GeodesicError;
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{
    CellProbe, Data, Field, Grid, Lane, Point, Reads, ScalarField, compiled_once, probe_cells,
};
use hyperelastic::{CompiledLaw, LawSpec};

/// Computes the density `K^2 W(D phi_k)` of a step's dissipation on the shape that the step
/// deforms, `{level_set > 0}`: its integral over the shape is `K^2 W_k`, which tends to the rate of
/// dissipation of the fluid as `K` grows.
///
/// The value at a node is the mean over the adjacent cells that meet the shape, or zero if there
/// are none: the dissipation of the void is excluded.
///
/// # Errors
/// [`GeodesicError::GridsDiffer`], and [`GeodesicError::Law`] if the law cannot be constructed.
pub fn dissipation_density<const D: usize>(
    level_set: &ScalarField<f64, D>,
    displacement: &Field<f64, D, D>,
    steps: usize,
    law: &LawSpec,
) -> Result<ScalarField<f64, D>, GeodesicError> {
    let grid = *level_set.grid();
    if *displacement.grid() != grid {
        return Err(GeodesicError::GridsDiffer);
    }
    let cells = density_of_cells(&grid, displacement.as_slice(), &law.compile()?);
    let rate = (steps * steps) as f64;
    Ok(at_nodes(&grid, &cells, &object_cells(level_set), rate))
}

compiled_once! {
    /// Computes the means of `W(D phi)` over the cells.
    fn density_of_cells<'a, D>(
        grid: &'a Grid<D>,
        displacement: &'a [f64],
        law: &'a CompiledLaw<D>,
    ) -> Vec<f64> = density_of_cells_in;
}

fn density_of_cells_in<const D: usize>(
    grid: &Grid<D>,
    displacement: &[f64],
    law: &CompiledLaw<D>,
) -> Vec<f64> {
    let found = probe_cells(grid, &Density { law }, Data::default(), displacement);
    found.into_iter().next().unwrap_or_default()
}

/// `W(1 + h)` of a displacement gradient `h`.
struct Density<'a, const D: usize> {
    law: &'a CompiledLaw<D>,
}

impl<const D: usize> Reads for Density<'_, D> {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for Density<'_, D> {
    const OUTPUTS: usize = 1;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let mut out = [L::zero(); MAX_CELL_DATA];
        out[0] = self.law.value(&point.gradient);
        out
    }
}

/// Averages cell values to the nodes, over the cells that are marked and finite.
fn at_nodes<const D: usize>(
    grid: &Grid<D>,
    cells: &[f64],
    marked: &[bool],
    factor: f64,
) -> ScalarField<f64, D> {
    let strides = grid.strides();
    let mut counts = vec![0u32; grid.n_nodes()];
    let mut field = ScalarField::zeros(*grid);
    let sums = field.as_mut_slice();
    for (cell, &value) in cells.iter().enumerate() {
        // A folded cell has no density; the certificate reports it.
        if !marked[cell] || !value.is_finite() {
            continue;
        }
        let first = grid.node_index(grid.cell(cell));
        for corner in 0..1usize << D {
            let offset: usize = (0..D).map(|k| (corner >> k & 1) * strides[k]).sum();
            sums[first + offset] += value;
            counts[first + offset] += 1;
        }
    }
    for (sum, &count) in sums.iter_mut().zip(&counts) {
        if count > 0 {
            *sum *= factor / f64::from(count);
        }
    }
    field
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::tensor;
    use hyperelastic::{LogDet, StoredEnergy};

    fn check<const D: usize>() {
        let grid = Grid::<D>::cube(17);
        let radius = |x: [f64; D]| x.map(|x| (x - 0.5).powi(2)).iter().sum::<f64>().sqrt();
        let shape = ScalarField::from_fn(grid, |x| [0.25 - radius(x)]);
        let stretch = 0.07;
        // Uniform dilation, and a fold far from the shape.
        let displacement = Field::from_fn(grid, |x| {
            x.map(|y| {
                if x[0] < 0.07 {
                    -4.0 * y
                } else {
                    stretch * (y - 0.5)
                }
            })
        });
        let spec = LawSpec::default();
        let density = dissipation_density(&shape, &displacement, 4, &spec).unwrap();
        let law = LogDet::<D>::new(spec.moduli).unwrap();
        let exact = 16.0 * law.value(&tensor::diagonal::<f64, D>(stretch));
        for (index, &value) in density.as_slice().iter().enumerate() {
            let distance = radius(grid.position(grid.node(index)));
            if distance < 0.25 {
                // Rounding of a gradient of 1/16 and of the logarithm near 1.
                assert!((value / exact - 1.0).abs() < 1e-11, "{value} {exact}");
            } else if distance > 0.25 + 2.0 * grid.spacing() * (D as f64).sqrt() {
                assert_eq!(value, 0.0);
            }
        }
    }

    #[test]
    fn a_stretch_has_the_density_of_its_law_on_the_shape_and_none_elsewhere() {
        check::<2>();
        check::<3>();
    }

    #[test]
    fn fields_of_different_grids_are_refused() {
        let shape = ScalarField::<f64, 2>::zeros(Grid::cube(9));
        let step = Field::zeros(Grid::cube(17));
        let found = dissipation_density(&shape, &step, 1, &LawSpec::default());
        assert!(matches!(found, Err(GeodesicError::GridsDiffer)));
    }
}
