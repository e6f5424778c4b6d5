//! The quadratic form that the metrics of both forms are made of: corotational elasticity, and
//! the Gauss–Newton matrix of a match.

use fe_grid::composition::Interpolant;
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{CellProbe, Data, Grid, Lane, Point, Reads, probe_cells};
use hyperelastic::{Corotational, LameModuli};
use levelset::{Arctan, Step};

/// Share of the void's stiffness that regularises the metric.
const REGULARISATION: f64 = 1e-3;
/// Least stiffness of the void in the metric: the void has to give way without folding.
const METRIC_VOID_STIFFNESS: f64 = 0.1;

/// Elasticity of an object in a void, with the match of its level set.
#[derive(Clone, Copy)]
pub(crate) struct ElasticForm<'a, const D: usize> {
    pub moduli: LameModuli,
    /// The smooth indicator of the elastic weight.
    pub indicator: Step,
    /// The smooth step of the match.
    pub step: Arctan,
    /// A factor of the elastic part.
    pub stiffness: f64,
    /// Weight of the match; at zero it is left out.
    pub match_weight: f64,
    /// The level set that is composed with the deformation.
    pub end: Interpolant<'a, f64, D>,
}

/// The form at a displacement of the object `{start > 0}`: the law and its data per cell.
pub(crate) fn corotational<const D: usize>(
    grid: &Grid<D>,
    form: &ElasticForm<'_, D>,
    start: &[f64],
    displacement: &[f64],
) -> (Corotational<D>, Vec<Vec<f32>>) {
    let coefficients = [start];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let law = Corotational {
        moduli: form.moduli,
        regularisation: REGULARISATION * METRIC_VOID_STIFFNESS * form.stiffness,
    };
    (law, probe_cells(grid, form, data, displacement))
}

impl<const D: usize> Reads for ElasticForm<'_, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> CellProbe<D, D> for ElasticForm<'_, D> {
    const OUTPUTS: usize = Corotational::<D>::CELL_DATA;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let mut out = [L::zero(); MAX_CELL_DATA];
        let chi = self.indicator.value(point.coefficient[0]);
        let void = L::splat(METRIC_VOID_STIFFNESS);
        out[0] = chi.mul_add(L::one() - void, void).scale(self.stiffness);
        for i in 0..D {
            for k in 0..D {
                out[1 + i * D + k] = point.gradient[i][k];
            }
        }
        if self.match_weight > 0.0 {
            let mut deformed = point.position;
            for k in 0..D {
                deformed[k] += point.value[k];
            }
            let (s, slope) = self.end.sample(&deformed);
            let derivative = self.step.derivative(s);
            let curvature = (derivative * derivative).scale(2.0 * self.match_weight);
            for i in 0..D {
                for j in i..D {
                    out[Corotational::<D>::mass_entry(i, j)] = curvature * slope[i] * slope[j];
                }
            }
        }
        out
    }

    #[inline(always)]
    fn finish<L: Lane>(&self, means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        Corotational::<D>::from_means(means)
    }
}
