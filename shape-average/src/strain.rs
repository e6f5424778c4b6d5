//! Strain of a deformation, cell by cell.

use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{
    CellProbe, Data, Field, Lane, Point, Reads, ScalarField, compiled_once, mutant, probe_cells,
    tensor,
};
use serde::Serialize;

/// Cell means of the strain of a deformation, in the memory order of the cells: how much it stretches
/// lengths, areas and volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct StrainMaps {
    /// `|D phi|`, the Frobenius norm; `sqrt(D)` for a rigid motion.
    pub norm: Vec<f64>,
    /// `|cof D phi|`; `sqrt(D)` for a rigid motion, and equal to `|D phi|` in 2D.
    pub cofactor: Vec<f64>,
    /// `det D phi`; one where the volume is preserved.
    pub determinant: Vec<f64>,
}

/// The range of a map over an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StrainRange {
    /// The least value of a cell.
    pub least: f64,
    /// The mean over the cells.
    pub mean: f64,
    /// The greatest value of a cell.
    pub greatest: f64,
}

/// The ranges of all maps over an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StrainRanges {
    /// Of `|D phi|`.
    pub norm: StrainRange,
    /// Of `|cof D phi|`.
    pub cofactor: StrainRange,
    /// Of `det D phi`.
    pub determinant: StrainRange,
}

impl StrainMaps {
    /// Computes the means for the deformation `x + u(x)`.
    pub fn new<const D: usize>(displacement: &Field<f64, D, D>) -> Self {
        strain_maps(displacement)
    }

    fn new_in<const D: usize>(displacement: &Field<f64, D, D>) -> Self {
        let data = Data::<f64>::default();
        let maps = probe_cells(displacement.grid(), &Probe, data, displacement.as_slice());
        let mut maps: Vec<Vec<f64>> = maps;
        let mut last = || maps.pop().unwrap_or_default();
        let (determinant, cofactor, norm) = (last(), last(), last());
        Self {
            norm,
            cofactor,
            determinant,
        }
    }

    /// Computes the ranges over some of the cells, such as those of [`cells_inside`]; `None` if there are none.
    pub fn ranges(&self, cells: &[usize]) -> Option<StrainRanges> {
        let of = |map: &[f64]| StrainRange::over(map, cells);
        Some(StrainRanges {
            norm: of(&self.norm)?,
            cofactor: of(&self.cofactor)?,
            determinant: of(&self.determinant)?,
        })
    }
}

impl StrainRange {
    /// Computes the range of a map over some of the cells; `None` if there are none.
    pub fn over(map: &[f64], cells: &[usize]) -> Option<Self> {
        let values = cells.iter().map(|&cell| map[cell]);
        let start = (f64::INFINITY, 0.0, f64::NEG_INFINITY);
        let (least, sum, greatest) =
            values.fold(start, |(a, sum, b), x| (a.min(x), sum + x, b.max(x)));
        (!cells.is_empty()).then(|| Self {
            least,
            mean: sum / cells.len() as f64,
            greatest,
        })
    }
}

/// Returns the cells of an object: those with a mean indicator of at least one half. The indicator of
/// an object thinner than its transition may be less everywhere; its cells are those with at least half of
/// the largest mean. Every object has cells.
pub fn cells_inside<const D: usize>(indicator: &ScalarField<f64, D>) -> Vec<usize> {
    let (grid, chi) = (indicator.grid(), indicator.as_slice());
    let strides = grid.strides();
    let corner = |c: usize| (0..D).map(|k| (c >> k & 1) * strides[k]).sum::<usize>();
    let corners: Vec<usize> = (0..1usize << D).map(corner).collect();
    let sum = |cell: usize| -> f64 {
        let first = grid.node_index(grid.cell(cell));
        corners.iter().map(|offset| chi[first + offset]).sum()
    };
    let half = 0.5 * corners.len() as f64;
    let whole: Vec<usize> = (0..grid.n_cells())
        .filter(|&cell| sum(cell) >= half)
        .collect();
    if !whole.is_empty() {
        return whole;
    }
    let most = (0..grid.n_cells()).map(sum).fold(0.0, f64::max);
    (0..grid.n_cells())
        .filter(|&cell| sum(cell) >= 0.5 * most)
        .collect()
}

compiled_once! {
    fn strain_maps<'a, D>(displacement: &'a Field<f64, D, D>) -> StrainMaps = StrainMaps::new_in;
}

struct Probe;

impl Reads for Probe {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for Probe {
    const OUTPUTS: usize = 3;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let gradient = tensor::add_identity(&point.gradient);
        let cofactor = tensor::cofactor(&gradient);
        let mut out = [L::zero(); MAX_CELL_DATA];
        let square = tensor::contract(&gradient, &gradient);
        out[0] = mutant!(square.sqrt(), StrainRoot => square);
        out[1] = tensor::contract(&cofactor, &cofactor).sqrt();
        out[2] = tensor::determinant_with(&gradient, &cofactor);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Grid;

    /// A box is stretched by 2, 3 and 5 along its axes, and then turned.
    #[test]
    fn a_stretch_has_its_invariants() {
        let (sin, cos) = 0.6f64.sin_cos();
        let u = Field::from_fn(Grid::<3>::cube(5), |[x, y, z]| {
            let [a, b, c] = [2.0 * x, 3.0 * y, 5.0 * z];
            [cos * a - sin * b - x, sin * a + cos * b - y, c - z]
        });
        let maps = StrainMaps::new(&u);
        let all: Vec<usize> = (0..u.grid().n_cells()).collect();
        let ranges = maps.ranges(&all).unwrap();
        let expected = [
            (ranges.norm, 38f64.sqrt()),
            (ranges.cofactor, (36.0f64 + 100.0 + 225.0).sqrt()),
            (ranges.determinant, 30.0),
        ];
        for (range, exact) in expected {
            // Rounding of differences of positions of order one over a spacing of 1/4.
            for value in [range.least, range.mean, range.greatest] {
                assert!((value / exact - 1.0).abs() < 1e-13, "{value} {exact}");
            }
        }
        assert_eq!(maps.ranges(&[]), None);
    }

    #[test]
    fn an_object_has_the_cells_within_it() {
        let half = ScalarField::from_fn(Grid::<2>::cube(9), |[x, _]| [f64::from(x < 0.45)]);
        // Columns 0 to 2 lie in it; of the cells of column 3 one half of the corners does.
        let cells = cells_inside(&half);
        assert_eq!(cells.len(), 4 * 8);
        assert!(cells.iter().all(|cell| cell % 8 < 4));
    }

    #[test]
    fn an_object_thinner_than_its_indicator_has_the_cells_around_it() {
        // One row of nodes is just inside, as of a plate of half a spacing.
        let plate = ScalarField::from_fn(Grid::<2>::cube(9), |[x, _]| {
            [(0.55 - 2.0 * (x - 0.5).abs()).max(0.0)]
        });
        let cells = cells_inside(&plate);
        assert_eq!(cells.len(), 2 * 8);
        assert!(cells.iter().all(|cell| (3..5).contains(&(cell % 8))));
    }
}
