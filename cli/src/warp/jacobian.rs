//! How much the deformations of inputs onto an average change volumes, seen from the average.

use fe_grid::{Field, Grid, ScalarField, parallel};

use super::fields::{SAMPLES_AT_ONCE, Space, inverted, of_space, write_both};
use crate::error::CliError;
use crate::output::nifti::{Values, write_volume};
use crate::output::{ResultDir, numbered};

/// `det Dφ` at the points of the average: where `φ` carries a point of the input there, the volume around it
/// after the deformation over that before.
struct Jacobian<'a, const D: usize> {
    /// The displacement back to the input.
    inverse: &'a Field<f64, D, D>,
    /// Means of the determinant on the cells of the input, at their middles.
    of_cells: ScalarField<f64, D>,
}

impl<'a, const D: usize> Jacobian<'a, D> {
    fn new(inverse: &'a Field<f64, D, D>, determinant: &[f64]) -> Result<Self, CliError> {
        let grid = inverse.grid();
        let middles = Grid::with_nodes(grid.cells_per_axis(), grid.spacing())?;
        let of_cells = ScalarField::from_vec(middles, determinant.to_vec())?;
        Ok(Self { inverse, of_cells })
    }

    /// Interpolated between the middles of cells.
    fn at(&self, place: [f64; D]) -> f32 {
        let back = self.inverse.sample(place);
        let half = 0.5 * self.of_cells.grid().spacing();
        let source = std::array::from_fn(|k| place[k] + back[k] - half);
        self.of_cells.sample(source)[0] as f32
    }

    /// At every place of a list.
    fn values(&self, count: usize, place: impl Fn(usize) -> [f64; D] + Sync) -> Vec<f32> {
        let mut values = vec![0.0; count];
        parallel::for_each_chunk(&mut values, SAMPLES_AT_ONCE, 1, &|chunk, values| {
            for (i, value) in values.iter_mut().enumerate() {
                *value = self.at(place(chunk * SAMPLES_AT_ONCE + i));
            }
        });
        values
    }
}

/// Writes the deformations of inputs onto a shape in this space, their inverses and how they change volumes,
/// `jacobian_000.nii.gz` on the samples of the volume of the shape; returns the same at the nodes, for results
/// in files. `determinants` are the means of the determinant on the cells of every input.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_warps<'a, const D: usize>(
    directory: &ResultDir,
    average: Option<&Space<D>>,
    of_input: impl Fn(usize) -> Option<Space<D>> + Sync,
    displacements: &[Field<f64, D, D>],
    determinants: impl Iterator<Item = &'a [f64]>,
) -> Result<Vec<Field<f32, D, 1>>, CliError> {
    if !directory.has_files() {
        return Ok(Vec::new());
    }
    let pairs = displacements.iter().zip(determinants).enumerate();
    parallel::try_map(pairs, &|(number, (displacement, determinant))| {
        let grid = *displacement.grid();
        let inverse = inverted(displacement);
        let jacobian = Jacobian::new(&inverse, determinant)?;
        let nodes = jacobian.values(grid.n_nodes(), |node| grid.position(grid.node(node)));
        let at_nodes = Field::from_vec(grid, nodes)?;
        let Some(average) = average else {
            return Ok(at_nodes);
        };
        if let Some(lattice) = average.lattice(&grid) {
            let unit = |index: usize| average.unit(of_space(lattice.position(index)));
            let values = jacobian.values(lattice.count(), unit);
            let file = directory.file(numbered("jacobian", number, "nii.gz"));
            write_volume(&file, &lattice, &Values::Numbers(&values))?;
        }
        if let Some(subject) = of_input(number) {
            write_both(
                directory,
                number,
                [&subject, average],
                [displacement, &inverse],
            )?;
        }
        Ok(at_nodes)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shape_average::StrainMaps;

    /// A map that widens one half and narrows the other, where its determinant is known at the images.
    #[test]
    fn determinants_stand_where_points_are_carried_to() {
        let grid = Grid::<2>::cube(65);
        // x + a sin(2 pi x) along the first axis.
        let (a, turn) = (0.08, std::f64::consts::TAU);
        let u = Field::from_fn(grid, |x| [a * (turn * x[0]).sin(), 0.0]);
        let maps = StrainMaps::new(&u);
        let inverse = inverted(&u);
        let jacobian = Jacobian::new(&inverse, &maps.determinant).unwrap();
        for start in [0.13, 0.4, 0.5, 0.77] {
            let image = start + a * (turn * start).sin();
            let expected = 1.0 + a * turn * (turn * start).cos();
            let found = f64::from(jacobian.at([image, 0.3]));
            assert!(
                (found - expected).abs() < 2e-3,
                "{start} {found} {expected}"
            );
        }
        // Volumes of the input, from the average: the mean of 1 / det.
        let values = jacobian.values(grid.n_nodes(), |node| grid.position(grid.node(node)));
        let inner = values.iter().enumerate().filter(|(node, _)| {
            let [i, j] = grid.node(*node);
            i < 64 && j < 64
        });
        let mean = inner.map(|(_, det)| f64::from(*det).recip()).sum::<f64>() / 4096.0;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    }
}
