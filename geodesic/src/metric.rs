//! The quadratic form underlying the metrics of both forms: elasticity in the frame of the deformed cells,
//! and the matrices of mismatches.
//!
//! The matrix of a mismatch is that of Gauss and Newton, with the slope of a secant in place of one of the
//! two slopes of the step: where the step is flat but its two values differ, the tangent would lead far
//! beyond the boundary. A single node with such a direction makes every step fold, and is what the
//! line search then measures.

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

/// Values of level sets that differ by less are not told apart.
const SAME: f64 = 1e-9;
/// Lower bound of the determinant in the mismatch of carried level sets.
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
    /// Stiffness of the void, relative to the object.
    pub void_stiffness: f64,
    /// The barrier against folding.
    pub barrier: FoldBarrier,
    /// Weight of the mismatches; at zero they are left out.
    pub mismatch_weight: f64,
    /// The level sets that are composed with the deformation.
    pub composed: &'a [ComposedLevel<'a, D>],
    /// The level sets that are carried by the deformation.
    pub carried: &'a [CarriedLevel<'a, D>],
    /// Weight of the attraction of all points of the object to targets, which counts with the mismatches.
    pub attraction: f64,
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
            * form.void_stiffness
            * form.stiffness
            * form.moduli.mu,
        rotations: false,
        factored: false,
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
        let void = L::splat(self.void_stiffness);
        let stiffness = chi.mul_add(L::one() - void, void);
        let mut out = Corotational::at_point(stiffness, &point.gradient);
        if self.attraction > 0.0 && self.mismatch_weight > 0.0 {
            for k in 0..D {
                let mut unit = [L::zero(); D];
                unit[k] = L::one();
                Corotational::add_outer(&mut out, chi.scale(2.0 * self.attraction), &unit);
            }
        }
        if self.mismatch_weight > 0.0 {
            let deformed = point.deformed_position();
            let gradient = tensor::add_identity(&point.gradient);
            let cofactor = tensor::cofactor(&gradient);
            let det = tensor::determinant_with(&gradient, &cofactor);
            let det = det.max(L::splat(LEAST_DETERMINANT));
            let own = point.coefficient[0];
            for level in self.composed {
                let (s, slope) = level.end.sample(&deformed);
                let (weight, _) = level.visibility.weight(&point.position, &deformed);
                let derivative = self.step.derivative(s);
                let gap = s - own;
                let apart = L::splat(SAME * SAME).less(gap * gap);
                let secant =
                    (self.step.value(s) - self.step.value(own)) / L::select(apart, gap, L::one());
                let secant = L::select(apart, secant, derivative).max(derivative);
                let curvature =
                    (derivative * secant * weight).scale(2.0 * level.share * self.mismatch_weight);
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
                let secant = derivative.max(L::splat(level.step.mean_slope()));
                let curvature = (derivative * secant * weight / det)
                    .scale(2.0 * level.share * self.mismatch_weight);
                Corotational::add_outer(&mut out, curvature, &carried);
            }
        }
        out
    }

    #[inline(always)]
    fn finish<L: Lane>(&self, means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        let void = self.void_stiffness;
        let stiffness = means[0];
        let chi = (stiffness - L::splat(void)).scale(1.0 / (1.0 - void));
        let modulus = self.moduli.lambda + 2.0 * self.moduli.mu;
        Corotational::<D>::from_deformed_means(means, |det| {
            // The energy of a step is an integral over the deformed object. The barrier's second
            // derivative is `b'' (det F tr(Dd F^-1))^2`.
            let of_volume = chi.mul_add(det - L::one(), stiffness);
            let held = self.barrier.curvature(det) * det * det;
            of_volume.scale(self.stiffness) + held.scale(1.0 / modulus)
        })
    }
}
