//! How a deformation strains the box, cell by cell.

use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{CellProbe, Data, Field, Lane, Point, Reads, probe_cells, tensor};

/// Means over the cells of a deformation's grid, cells in memory order.
#[derive(Clone, Debug, PartialEq)]
pub struct StrainMaps {
    /// `|D phi|`, the Frobenius norm; `sqrt(D)` where nothing is strained.
    pub norm: Vec<f64>,
    /// `det D phi`; one where no volume changes.
    pub determinant: Vec<f64>,
}

impl StrainMaps {
    /// Of the deformation `x + u(x)`.
    pub fn new<const D: usize>(displacement: &Field<f64, D, D>) -> Self {
        let data = Data::<f64>::default();
        let maps = probe_cells(displacement.grid(), &Probe, data, displacement.as_slice());
        let mut maps: Vec<Vec<f64>> = maps;
        let determinant = maps.pop().unwrap_or_default();
        let norm = maps.pop().unwrap_or_default();
        Self { norm, determinant }
    }
}

struct Probe;

impl Reads for Probe {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for Probe {
    const OUTPUTS: usize = 2;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let gradient = tensor::add_identity(&point.gradient);
        let mut out = [L::zero(); MAX_CELL_DATA];
        out[0] = tensor::contract(&gradient, &gradient).sqrt();
        out[1] = tensor::determinant(&gradient);
        out
    }
}
