//! What every law answers.

use crate::hypotheses::Hypotheses;
use crate::moduli::LameModuli;
use fe_grid::{Lane, Tensor, tensor};

/// A stored energy density `W`, as a function of the displacement gradient `h = Dphi - 1`.
///
/// Taking `h` and not `A = 1 + h` keeps the digits of small strains in the value and in the
/// derivatives. All methods are elementwise over the lanes, never allocate and never see a mesh.
///
/// **Inadmissible states.** Where `det(1 + h) <= 0`, or `h` is not a number, the value is
/// `+infinity` and the derivatives are NaN; a caller looks at the value. Only a law whose
/// [`Hypotheses::barrier`] is false, such as linear elasticity, is finite there.
pub trait StoredEnergy<const D: usize>: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// `W(1 + h)`; `+infinity` where `det(1 + h) <= 0`.
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L;

    /// Value and first Piola–Kirchhoff stress `W_,A(1 + h)`.
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>);

    /// `w W(1 + h)` and `w W_,A(1 + h)`. A law that is made of a few matrices weights their
    /// coefficients instead of the entries of the stress.
    #[inline(always)]
    fn weighted_gradient<L: Lane>(&self, h: &Tensor<L, D>, weight: L) -> (L, Tensor<L, D>) {
        let (value, stress) = self.gradient(h);
        (value * weight, tensor::scale(&stress, weight))
    }

    /// `W_,AA(1 + h)[b]`, the derivative of the stress in direction `b`.
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D>;

    /// Moduli of the linearisation: `W_,AA(1)[b] : b = lambda (tr e)^2 + 2 mu tr(e^2)`, `e = sym b`.
    fn moduli(&self) -> LameModuli;

    /// What the law satisfies.
    fn hypotheses(&self) -> Hypotheses;

    /// The name that the law is asked for by.
    fn name(&self) -> &'static str;
}

/// A law that is known as a function of `A`, `cof A` and `det A` taken as independent arguments.
///
/// The function is convex where [`Hypotheses::polyconvex`] holds.
pub trait PolyconvexForm<const D: usize>: StoredEnergy<D> {
    /// `W^(a, cofactor, determinant)`; `+infinity` where `determinant <= 0`. Equals
    /// [`StoredEnergy::value`] on arguments that belong to one matrix.
    fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64;
}
