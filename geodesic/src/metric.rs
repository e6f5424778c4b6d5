//! The quadratic form underlying the metrics of both forms: corotational elasticity, and the
//! Gauss–Newton matrices of mismatches.

use crate::mismatch::Visibility;
use fe_grid::composition::Interpolant;
use fe_grid::engine::MAX_CELL_DATA;
use fe_grid::{CellProbe, Data, Grid, Lane, Point, Reads, probe_cells, tensor};
use hyperelastic::{Corotational, FoldBarrier, LameModuli};
use levelset::{Arctan, Compact, Step};

/// A level set that a deformation is composed with, for its mismatch.
#[derive(Clone, Copy)]
pub(crate) struct ComposedLevel<'a, const D: usize> {
    /// The level set.
    pub end: Interpolant<'a, f64, D>,
    /// The visibility weight.
    pub visibility: Visibility<'a, D>,
    /// Share of the mismatch that is measured on the start domain.
    pub share: f64,
}

/// A level set that a deformation carries, for its mismatch on the end domain.
#[derive(Clone, Copy)]
pub(crate) struct CarriedLevel<'a, const D: usize> {
    /// The level set.
    pub start: Interpolant<'a, f64, D>,
    /// The smooth step of the mismatch.
    pub step: Compact,
    /// The visibility weight.
    pub visibility: Visibility<'a, D>,
    /// Share of the mismatch that is measured on the end domain.
    pub share: f64,
}

/// Lower bound of the determinant in the metric.
const LEAST_DETERMINANT: f64 = 1e-3;

/// Elasticity of an object in a void, with the mismatch of its level sets.
#[derive(Clone, Copy)]
pub(crate) struct ElasticForm<'a, const D: usize> {
    pub moduli: LameModuli,
    /// The smooth indicator of the elastic weight.
    pub indicator: Step,
    /// The smooth step of the mismatch.
    pub step: Arctan,
    /// Factor of the elastic part.
    pub stiffness: f64,
    /// The barrier against folding, and the actual stiffness of the void.
    pub barrier: FoldBarrier,
    pub void_stiffness: f64,
    /// Weight of the mismatches; at zero they are left out.
    pub mismatch_weight: f64,
    /// The level sets that are composed with the deformation.
    pub composed: &'a [ComposedLevel<'a, D>],
    /// The level sets that are carried by the deformation.
    pub carried: &'a [CarriedLevel<'a, D>],
}

/// Computes the form at a displacement of the object `{start > 0}`: the law and its data per cell.
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
        regularisation: Corotational::<D>::REGULARISATION
            * Corotational::<D>::LEAST_VOID_STIFFNESS
            * form.stiffness
            * form.moduli.mu,
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
        let chi = self.indicator.value(point.coefficient[0]);
        let void = L::splat(Corotational::<D>::LEAST_VOID_STIFFNESS);
        let a = tensor::add_identity(&point.gradient);
        let cofactor = tensor::cofactor(&a);
        let det = tensor::determinant_with(&a, &cofactor).max(L::splat(LEAST_DETERMINANT));
        let square = tensor::contract(&cofactor, &cofactor);
        let compression = square / (det * det).scale(D as f64) - L::one();
        let delta = L::splat(self.void_stiffness);
        let law = chi.mul_add(L::one() - delta, delta);
        let stiffened = (law * compression.max(L::zero())).scale(0.5);
        let held = self.barrier.curvature(det) * square;
        let moduli = self.moduli.lambda + 2.0 * self.moduli.mu;
        let stiffness = (chi.mul_add(L::one() - void, void) + stiffened).scale(self.stiffness)
            + held.scale(1.0 / moduli);
        let mut out = Corotational::at_point(stiffness, &point.gradient);
        if self.mismatch_weight > 0.0 {
            let deformed = point.deformed_position();
            for level in self.composed {
                let (s, slope) = level.end.sample(&deformed);
                let (weight, _) = level.visibility.weight(&point.position, &deformed);
                let derivative = self.step.derivative(s);
                let curvature = (derivative * derivative * weight)
                    .scale(2.0 * level.share * self.mismatch_weight);
                Corotational::add_outer(&mut out, curvature, &slope);
            }
            for level in self.carried {
                // (H'(u) Dpsi^-T Du)^2 det Dpsi: the level set on the end domain is u o psi^-1.
                let (s, slope) = level.start.sample(&point.position);
                let (weight, _) = level.visibility.weight(&point.position, &deformed);
                let derivative = level.step.derivative(s);
                let mut carried = [L::zero(); D];
                for i in 0..D {
                    for k in 0..D {
                        carried[i] = cofactor[i][k].mul_add(slope[k], carried[i]);
                    }
                }
                let curvature = (derivative * derivative * weight / det)
                    .scale(2.0 * level.share * self.mismatch_weight);
                Corotational::add_outer(&mut out, curvature, &carried);
            }
        }
        out
    }

    #[inline(always)]
    fn finish<L: Lane>(&self, means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        Corotational::<D>::from_means(means)
    }
}
