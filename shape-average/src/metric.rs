//! The metric of one shape's displacement: Gauss–Newton for the mismatch, corotational for the
//! elastic energy, inverted by one multigrid cycle.

use crate::level::LevelShapes;
use crate::params::{AverageParams, Precision};
use fe_grid::composition::{Interpolant, MatchDensity};
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::multigrid::{MultigridParams, WorkSpace};
use fe_grid::{CellProbe, Data, Element, GridError, Lane, Point, Reads, probe_cells};
use hyperelastic::{Corotational, CorotationalMultigrid};
use phasefield::{Masked, Mismatch};

/// Parameters of a cycle at half the cost of the default one; the number of iterations of the
/// minimiser hardly increases.
const CYCLE: MultigridParams = MultigridParams {
    smoothing_steps: 1,
    smoothing_range: 0.25,
    direct_unknowns: 100,
    in_halves: false,
};
/// Lower bound of the weights; with weight zero the metric would not be definite.
const LEAST_WEIGHT: f64 = 1e-6;

/// The inverse metric of one shape.
pub(crate) struct ShapeMetric<const D: usize> {
    cycle: CorotationalMultigrid<D>,
}

impl<const D: usize> ShapeMetric<D> {
    /// Computes the metric at a displacement, for given weights of the elastic energy and the
    /// mismatch, and for the average, component by component.
    pub fn new(
        shapes: &LevelShapes<D>,
        shape: usize,
        params: &AverageParams,
        (elastic_weight, mismatch_weight): (f64, f64),
        average: &[f64],
        displacement: &[f64],
        work_space: &WorkSpace<f32>,
    ) -> Result<Self, GridError> {
        let grid = *shapes.grid();
        let elastic_weight = elastic_weight.max(LEAST_WEIGHT);
        let void_stiffness = params
            .void_stiffness
            .max(Corotational::<D>::LEAST_VOID_STIFFNESS);
        let mismatch = Mismatch {
            interface_width: shapes.interface_width(),
            scale: mismatch_weight,
        };
        let mut cells: Vec<Vec<f32>> = Vec::new();
        for (component, average) in average.chunks_exact(grid.n_nodes()).enumerate() {
            let mut coefficients = vec![shapes.indicators[shape].as_slice()];
            coefficients.extend(shapes.match_coefficients(shape, component));
            let data = Data {
                coefficients: &coefficients,
                cells: &[],
            };
            let average = Interpolant::new(grid, average);
            // The elastic part is in the data of the first component; the others add their mismatch.
            let stiffness = if component == 0 { elastic_weight } else { 0.0 };
            let stiffness = [stiffness, void_stiffness];
            let own = if shapes.seen().is_empty() {
                let probe = MetricProbe::new(stiffness, mismatch, average);
                probe_cells(&grid, &probe, data, displacement)
            } else {
                let probe = MetricProbe::new(stiffness, Masked(mismatch), average);
                probe_cells(&grid, &probe, data, displacement)
            };
            if component == 0 {
                cells = own;
                continue;
            }
            for (sum, term) in cells.iter_mut().flatten().zip(own.into_iter().flatten()) {
                *sum += term;
            }
        }
        let moduli = params.law.moduli;
        let law = Corotational {
            moduli,
            regularisation: Corotational::<D>::REGULARISATION
                * void_stiffness
                * elastic_weight
                * moduli.mu,
            rotations: true,
            factored: false,
        };
        let cycle = MultigridParams {
            in_halves: params.precision_on(&grid) == Precision::Mixed,
            ..CYCLE
        };
        let cycle = CorotationalMultigrid::new(grid, law, cells, cycle)?;
        Ok(Self {
            cycle: cycle.with_work_space(work_space.clone()),
        })
    }

    /// Applies the inverse metric.
    pub fn apply_in<T: Element>(&self, x: &[T], y: &mut [T]) {
        self.cycle.apply_in(x, y);
    }
}

/// The data of [`Corotational`] at a state: the mean stiffness of a cell, the rotation of its
/// mean deformation gradient, and the mean of the Gauss–Newton matrix of the mismatch.
struct MetricProbe<'a, F, const D: usize> {
    stiffness: f64,
    void_stiffness: f64,
    mismatch: F,
    average: Interpolant<'a, f64, D>,
}

impl<'a, F, const D: usize> MetricProbe<'a, F, D> {
    fn new(
        [stiffness, void_stiffness]: [f64; 2],
        mismatch: F,
        average: Interpolant<'a, f64, D>,
    ) -> Self {
        Self {
            stiffness,
            void_stiffness,
            mismatch,
            average,
        }
    }
}

impl<F: MatchDensity, const D: usize> Reads for MetricProbe<'_, F, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1 + F::COEFFICIENTS;
    const CELL_DATA: usize = 0;
}

impl<F: MatchDensity, const D: usize> CellProbe<D, D> for MetricProbe<'_, F, D> {
    const OUTPUTS: usize = Corotational::<D>::CELL_DATA;

    #[inline(always)]
    fn probe<L: Lane>(&self, point: &Point<L, D, D>) -> [L; MAX_CELL_DATA] {
        let delta = self.void_stiffness;
        let kappa = point.coefficient[0].mul_add(L::splat(1.0 - delta), L::splat(delta));
        let mut out = Corotational::at_point(kappa.scale(self.stiffness), &point.gradient);
        let (s, slope) = self.average.sample(&point.deformed_position());
        // The coefficients of the mismatch follow the indicator.
        let all = &point.coefficient;
        let coefficient = std::array::from_fn(|k| all.get(k + 1).copied().unwrap_or(L::zero()));
        let (_, _, curvature) = self.mismatch.derivatives(s, &coefficient);
        Corotational::add_outer(&mut out, curvature, &slope);
        out
    }

    #[inline(always)]
    fn finish<L: Lane>(&self, means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        Corotational::<D>::from_means(means)
    }
}
