//! The points that a deformation maps to given points: quadrature on the deformed domain.

use crate::compiled_once;
use crate::grid::Grid;
use crate::inverse::search_cell;
use crate::lane::{Element, Lane, LaneKernel};
use crate::lattice::Lattice;
use crate::parallel;

/// A point of a lattice, and the point of the grid that is mapped to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preimage<const D: usize> {
    /// Index of the point of the lattice in memory order.
    pub point: usize,
    /// The cell whose image contains it.
    pub cell: usize,
    /// The point in the cell, in `[0, 1]^D`.
    pub local: [f64; D],
}

compiled_once! {
    /// Computes which points are mapped to the points of a lattice by `x + u(x)`, in some of the
    /// cells: `cells[layer]` are those of a layer of cells along the last axis, and so is the result.
    ///
    /// A point on a face of two cells may be found in both. Where the deformation folds, a point of
    /// the lattice may be found several times.
    ///
    /// # Panics
    /// If the displacement does not have `D` components of the grid.
    pub fn preimages<'a, D>(
        grid: &'a Grid<D>,
        displacement: &'a [f64],
        cells: &'a [Vec<usize>],
        lattice: &'a Lattice<D>,
    ) -> Vec<Vec<Preimage<D>>> = preimages_in;
}

fn preimages_in<const D: usize>(
    grid: &Grid<D>,
    displacement: &[f64],
    cells: &[Vec<usize>],
    lattice: &Lattice<D>,
) -> Vec<Vec<Preimage<D>>> {
    assert_eq!(displacement.len(), D * grid.n_nodes());
    parallel::map(cells, &|cells| {
        f64::run_kernel(LayerSearch {
            grid,
            displacement,
            lattice,
            cells,
        })
    })
}

/// The search in some cells of a layer.
struct LayerSearch<'a, const D: usize> {
    grid: &'a Grid<D>,
    displacement: &'a [f64],
    lattice: &'a Lattice<D>,
    cells: &'a [usize],
}

impl<const D: usize> LaneKernel<f64> for LayerSearch<'_, D> {
    type Output = Vec<Preimage<D>>;

    /// Every point is a search of its own: only the fused operations of the instruction set are
    /// used, not its lanes.
    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) -> Self::Output {
        let mut found = Vec::with_capacity(self.cells.len() << D);
        for &cell in self.cells {
            search_cell(
                self.grid,
                self.displacement,
                self.grid.cell(cell),
                self.lattice,
                &mut |point, local| found.push(Preimage { point, cell, local }),
            );
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Field;

    fn check<const D: usize>() {
        let grid = Grid::<D>::cube(9);
        let h = grid.spacing();
        let lattice = Lattice::midpoints(&grid, 2);
        let layers = grid.cells_per_axis()[D - 1];
        let per_layer = grid.n_cells() / layers;
        let cells: Vec<Vec<usize>> = (0..layers)
            .map(|l| (l * per_layer..(l + 1) * per_layer).collect())
            .collect();
        // A deformation that keeps the box: every point of the lattice has one preimage.
        let displacement = Field::<f64, D, D>::from_fn(grid, |x: [f64; D]| {
            let bump: f64 = x.iter().map(|x| 4.0 * x * (1.0 - x)).product();
            std::array::from_fn(|k| bump * (0.05 + 0.03 * x[(k + 1) % D]))
        });
        let found = preimages(&grid, displacement.as_slice(), &cells, &lattice);
        let mut count = vec![0; lattice.n_points()];
        for (layer, found) in found.iter().enumerate() {
            for Preimage { point, cell, local } in found {
                assert_eq!(cell / per_layer, layer);
                let corner = grid.cell(*cell);
                let x = std::array::from_fn(|k| (corner[k] as f64 + local[k]) * h);
                let u = displacement.sample(x);
                let y = lattice.point(*point);
                for k in 0..D {
                    // Newton's method ends at a residual of 1e-13 spacings.
                    assert!((x[k] + u[k] - y[k] * h).abs() < 1e-12);
                }
                count[*point] += 1;
            }
        }
        assert!(count.iter().all(|&n| n == 1));
    }

    #[test]
    fn every_point_has_the_one_preimage_that_is_mapped_to_it() {
        check::<2>();
        check::<3>();
    }

    #[test]
    fn only_the_given_cells_are_searched() {
        let grid = Grid::<2>::cube(5);
        let lattice = Lattice::midpoints(&grid, 2);
        let cells = vec![vec![1], vec![], vec![8, 11], vec![]];
        let identity = vec![0.0; 2 * grid.n_nodes()];
        let found = preimages(&grid, &identity, &cells, &lattice);
        let counts: Vec<_> = found.iter().map(Vec::len).collect();
        assert_eq!(counts, [4, 0, 8, 0]);
    }
}
