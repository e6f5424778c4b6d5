//! The interface of a law.

use crate::hypotheses::Hypotheses;
use crate::moduli::LameModuli;
use fe_grid::{Lane, Tensor, tensor};

/// A stored energy density `W`, as a function of the displacement gradient `h = Dphi - 1`.
///
/// Using `h` and not `A = 1 + h` preserves the digits of small strains in the value and in the
/// derivatives. All methods act elementwise on the lanes, do not allocate and do not depend on a
/// mesh.
///
/// **Inadmissible states.** If `det(1 + h) <= 0`, or `h` is NaN, the value is `+infinity` and the
/// derivatives are NaN; callers check the value. Only a law whose [`Hypotheses::barrier`] is false,
/// such as linear elasticity, is finite there.
pub trait StoredEnergy<const D: usize>: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// Returns `W(1 + h)`; `+infinity` if `det(1 + h) <= 0`.
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L;

    /// Returns the value and the first Piola–Kirchhoff stress `W_,A(1 + h)`.
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>);

    /// Returns `w W(1 + h)` and `w W_,A(1 + h)`. A law that is a combination of a few matrices can
    /// weight their coefficients instead of the entries of the stress.
    #[inline(always)]
    fn weighted_gradient<L: Lane>(&self, h: &Tensor<L, D>, weight: L) -> (L, Tensor<L, D>) {
        let (value, stress) = self.gradient(h);
        (value * weight, tensor::scale(&stress, weight))
    }

    /// Returns `W_,AA(1 + h)[b]`, the derivative of the stress in direction `b`.
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D>;

    /// Returns the moduli of the linearisation: `W_,AA(1)[b] : b = lambda (tr e)^2 + 2 mu tr(e^2)`,
    /// `e = sym b`.
    fn moduli(&self) -> LameModuli;

    /// Returns the hypotheses that the law satisfies.
    fn hypotheses(&self) -> Hypotheses;

    /// Returns the name by which the law is selected.
    fn name(&self) -> &'static str;
}

/// A law given as a function of `A`, `cof A` and `det A` as independent arguments.
///
/// The function is convex if [`Hypotheses::polyconvex`] holds.
pub trait PolyconvexForm<const D: usize>: StoredEnergy<D> {
    /// Returns `W^(a, cofactor, determinant)`; `+infinity` if `determinant <= 0`. Equals
    /// [`StoredEnergy::value`] on arguments that belong to one matrix.
    fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64;
}
