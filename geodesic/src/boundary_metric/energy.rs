//! The dissipation of a velocity and its parts.

use super::cut::{CutPoint, ObjectCells};
use super::shape::{corner_gradients, offset};
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{
    CellProbe, Data, Field, Lane, Point, Reads, ScalarField, Tensor, compiled_once, mutant,
    probe_cells, tensor,
};
use hyperelastic::{LameModuli, ViscousDissipation};

/// `(lambda/2 + mu/d) (tr e)^2`, and the whole `lambda/2 (tr e)^2 + mu tr(e^2)`.
struct Rates {
    form: ViscousDissipation,
}

impl Rates {
    #[inline(always)]
    fn at<L: Lane, const D: usize>(&self, gradient: &Tensor<L, D>) -> [L; 2] {
        let mean = tensor::trace(gradient).scale(1.0 / D as f64);
        let dilation = tensor::diagonal::<L, D>(mean);
        [self.form.rate(&dilation), self.form.rate(gradient)]
    }
}

impl Reads for Rates {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for Rates {
    const OUTPUTS: usize = 2;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let mut out = [L::zero(); MAX_CELL_DATA];
        [out[0], out[1]] = self.at(&point.gradient);
        out
    }
}

/// The dissipation of a velocity on an object.
#[derive(Clone, Debug)]
pub(super) struct Dissipation<const D: usize> {
    /// By change of volume.
    pub volume: f64,
    /// All of it.
    pub total: f64,
    /// In the box, as if it were all object.
    pub everywhere: f64,
    /// The means over the occupied parts of all cells.
    rates: Vec<f64>,
}

compiled_once! {
    /// Computes the dissipation of a velocity on an object.
    pub(super) fn dissipation<'a, D>(
        velocity: &'a Field<f64, D, D>,
        cells: &'a ObjectCells<D>,
        moduli: LameModuli,
    ) -> Dissipation<D> = dissipation_in;
}

fn dissipation_in<const D: usize>(
    velocity: &Field<f64, D, D>,
    cells: &ObjectCells<D>,
    moduli: LameModuli,
) -> Dissipation<D> {
    let form = Rates {
        form: ViscousDissipation { moduli },
    };
    let grid = cells.grid;
    let mut means = probe_cells(&grid, &form, Data::default(), velocity.as_slice()).into_iter();
    let mut volumes: Vec<f64> = means.next().unwrap_or_default();
    let mut rates: Vec<f64> = means.next().unwrap_or_default();
    let everywhere = grid.cell_volume() * rates.iter().sum::<f64>();
    for (cell, points) in &cells.cut {
        let mut sums = [0.0; 2];
        for point in points {
            let gradient = gradient_at(velocity, *cell, point);
            for (sum, rate) in sums.iter_mut().zip(form.at::<f64, D>(&gradient)) {
                *sum += point.weight * rate;
            }
        }
        let fraction = cells.fractions[*cell];
        volumes[*cell] = sums[0] / fraction;
        rates[*cell] = sums[1] / fraction;
    }
    let sum = |rates: &[f64]| {
        let parts = rates.iter().zip(&cells.fractions);
        let parts = parts.map(|(r, &f)| r * mutant!(f, MetricCutWhole => f.ceil()));
        grid.cell_volume() * parts.sum::<f64>()
    };
    Dissipation {
        volume: sum(&volumes),
        total: sum(&rates),
        everywhere,
        rates,
    }
}

/// The gradient of a velocity at a point of a cell.
fn gradient_at<const D: usize>(
    velocity: &Field<f64, D, D>,
    cell: usize,
    point: &CutPoint<D>,
) -> Tensor<f64, D> {
    let grid = velocity.grid();
    let (first, strides) = (grid.node_index(grid.cell(cell)), grid.strides());
    let slopes = corner_gradients(&point.local, grid.spacing());
    let mut gradient = tensor::zero::<f64, D>();
    for (c, slope) in slopes.iter().enumerate().take(1 << D) {
        let value = velocity.at(first + offset(&strides, c));
        for i in 0..D {
            for k in 0..D {
                gradient[i][k] += value[i] * slope[k];
            }
        }
    }
    gradient
}

impl<const D: usize> Dissipation<D> {
    /// Computes the density of the dissipation at the nodes: the mean over the adjacent cells, weighted
    /// by their occupied fractions; zero where all of them are void.
    pub fn density(&self, cells: &ObjectCells<D>) -> ScalarField<f64, D> {
        let grid = cells.grid;
        let strides = grid.strides();
        let mut weights = vec![0.0; grid.n_nodes()];
        let mut density = ScalarField::zeros(grid);
        let sums = density.as_mut_slice();
        for (cell, (fraction, rate)) in cells.fractions.iter().zip(&self.rates).enumerate() {
            if *fraction <= 0.0 {
                continue;
            }
            let first = grid.node_index(grid.cell(cell));
            for corner in 0..1usize << D {
                let node = first + offset(&strides, corner);
                sums[node] += fraction * rate;
                weights[node] += fraction;
            }
        }
        for (sum, weight) in sums.iter_mut().zip(&weights) {
            if *weight > 0.0 {
                *sum /= weight;
            }
        }
        density
    }
}
