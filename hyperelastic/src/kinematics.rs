//! Kinematic quantities of a displacement gradient, evaluated without cancellation for small
//! strains.

use crate::scalar::{LogarithmParts, is_small};
use fe_grid::{Lane, Tensor, mutant, tensor};

/// The determinant and the quantities derived from it for the volume terms.
#[derive(Clone, Copy)]
pub(crate) struct Volume<L> {
    /// `det - 1`.
    pub excess: L,
    /// `det`.
    pub determinant: L,
    /// `1 / det`; NaN if the determinant is not positive, which propagates to the derivatives.
    pub inverse: L,
    /// `1 / det - 1`.
    pub inverse_excess: L,
    /// `det - 1 - ln det`; undefined if the determinant is not positive, and zero if it was not
    /// requested.
    pub excess_minus_logarithm: L,
}

impl<L: Lane> Volume<L> {
    /// Creates the quantities from the determinant of `1 + h`, and `det - 1` summed from `h`
    /// without cancellation; `logarithm` requests the logarithm as well.
    ///
    /// The sum is accurate if it is small. Otherwise the determinant itself is: that of a matrix
    /// with a vanishing row is exactly zero, while the sum is a rounding error.
    ///
    /// The logarithm needs a quotient `a / b` besides `1 / det`. Both are computed from the single
    /// division `1 / (b det)`.
    #[inline(always)]
    pub fn new(determinant: L, small_excess: L, logarithm: bool) -> Self {
        let small = is_small(small_excess);
        let excess = L::select(small, small_excess, determinant - L::one());
        let (inverse, excess_minus_logarithm) = if logarithm {
            let parts = LogarithmParts::new(excess, small, determinant);
            let both = L::one() / (parts.denominator * determinant);
            let quotient = (parts.numerator * determinant) * both;
            (
                parts.denominator * both,
                parts.excess_minus_logarithm(excess, quotient),
            )
        } else {
            (L::one() / determinant, L::zero())
        };
        let positive = L::zero().less(determinant);
        let inverse = L::select(positive, inverse, L::splat(f64::NAN));
        Self {
            excess,
            determinant,
            inverse,
            inverse_excess: -(excess * inverse),
            excess_minus_logarithm,
        }
    }

    /// Creates the quantities from the determinant alone.
    #[inline(always)]
    pub fn of_determinant(determinant: L) -> Self {
        Self::new(determinant, determinant - L::one(), true)
    }

    /// Returns the value if the determinant is positive, else infinity.
    #[inline(always)]
    pub fn barred(&self, value: L) -> L {
        let folded = L::splat(mutant!(f64::INFINITY, Barrier => 1.0));
        L::select(L::zero().less(self.determinant), value, folded)
    }
}

/// `A = 1 + h`, its cofactor matrix and determinant, each with its excess over the identity's.
#[derive(Clone, Copy)]
pub(crate) struct Kinematics<L, const D: usize> {
    /// `h`.
    pub displacement_gradient: Tensor<L, D>,
    /// `A`.
    pub deformation_gradient: Tensor<L, D>,
    /// `cof A - 1`.
    pub cofactor_excess: Tensor<L, D>,
    /// `cof A`.
    pub cofactor: Tensor<L, D>,
    /// `tr(cof A - 1) - (d-1) tr h`: `tr cof h` in 3D, zero in 2D.
    pub cofactor_second_order: L,
    /// `det A - 1 - tr h`.
    pub volume_second_order: L,
    /// The determinant.
    pub volume: Volume<L>,
}

impl<L: Lane, const D: usize> Kinematics<L, D> {
    /// Computes the quantities of a displacement gradient; `logarithm` requests that of the
    /// determinant.
    #[inline(always)]
    pub fn new(h: &Tensor<L, D>, logarithm: bool) -> Self {
        let minors = tensor::cofactor(h);
        let cofactor_excess = tensor::cofactor_excess(h, &minors);
        let mut volume_second_order = tensor::determinant_with(h, &minors);
        let mut cofactor_second_order = L::zero();
        if D == 3 {
            cofactor_second_order = tensor::trace(&minors);
            let traces = mutant!(cofactor_second_order, VolumeSecondOrder => L::zero());
            volume_second_order += traces;
        }
        let deformation_gradient = tensor::add_identity(h);
        let cofactor = tensor::cofactor(&deformation_gradient);
        let determinant = tensor::determinant_with(&deformation_gradient, &cofactor);
        Self {
            displacement_gradient: *h,
            deformation_gradient,
            cofactor,
            cofactor_excess,
            cofactor_second_order,
            volume_second_order,
            volume: Volume::new(
                determinant,
                tensor::trace(h) + volume_second_order,
                logarithm,
            ),
        }
    }

    /// Returns `|A|^2 - d`.
    #[inline(always)]
    pub fn norm_excess(&self) -> L {
        tensor::squared_norm_excess(&self.displacement_gradient)
    }

    /// Returns `|cof A|^2 - d`.
    #[inline(always)]
    pub fn cofactor_norm_excess(&self) -> L {
        tensor::squared_norm_excess(&self.cofactor_excess)
    }

    /// Returns `C`, with `C : B = cof A : (cof A)'[B]`: half the derivative of `|cof A|^2`.
    #[inline(always)]
    pub fn cofactor_norm_slope(&self) -> Tensor<L, D> {
        if D == 2 {
            self.deformation_gradient
        } else {
            tensor::cofactor_derivative(&self.deformation_gradient, &self.cofactor)
        }
    }

    /// Returns `C - (d-1) cof A`, without cancellation for small `h`.
    ///
    /// In 3D `C = A x cof A` with the bilinear product of [`tensor::cofactor_derivative`];
    /// both factors are expanded about the identity, where `1 x 1 = 2`.
    #[inline(always)]
    pub fn cofactor_norm_slope_excess(&self) -> Tensor<L, D> {
        let (h, k) = (&self.displacement_gradient, &self.cofactor_excess);
        if D == 2 {
            return tensor::sub(h, k);
        }
        let linear = tensor::cofactor_derivative_at_identity(&tensor::add(h, k));
        let linear = tensor::add_scaled(&linear, L::splat(-2.0), k);
        tensor::add(&linear, &tensor::cofactor_derivative(h, k))
    }

    /// Derivative of [`Self::cofactor_norm_slope`] in direction `b`, given that of the cofactor
    /// matrix.
    #[inline(always)]
    pub fn cofactor_norm_slope_derivative(
        &self,
        b: &Tensor<L, D>,
        cofactor_derivative: &Tensor<L, D>,
    ) -> Tensor<L, D> {
        if D == 2 {
            return *b;
        }
        tensor::add(
            &tensor::cofactor_derivative(b, &self.cofactor),
            &tensor::cofactor_derivative(&self.deformation_gradient, cofactor_derivative),
        )
    }
}
