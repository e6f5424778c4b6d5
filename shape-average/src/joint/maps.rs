//! Strain of a deformation, cell by cell.

use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{CellProbe, Data, Field, Lane, Point, Reads, probe_cells, tensor};

/// Cell means of the strain of a deformation, in the memory order of the cells.
#[derive(Clone, Debug, PartialEq)]
pub struct StrainMaps {
    /// `|D phi|`, the Frobenius norm; `sqrt(D)` for a rigid motion.
    pub norm: Vec<f64>,
    /// `det D phi`; one where the volume is preserved.
    pub determinant: Vec<f64>,
}

impl StrainMaps {
    /// Computes the means for the deformation `x + u(x)`.
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
