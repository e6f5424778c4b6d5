//! The energy of the inverse deformation.

use crate::hypotheses::{Growth, Hypotheses};
use crate::kinematics::{Kinematics, Volume};
use crate::moduli::LameModuli;
use crate::stored_energy::{PolyconvexForm, StoredEnergy};
use fe_grid::{Lane, Tensor, mutant, tensor};

/// The inverse model `W_inv(A) = det A  W(A^-1)`: the stored energy of the inverse deformation,
/// integrated over the undeformed side (Definition 4.5). Same moduli as `W`; polyconvex if `W` is.
///
/// # Derivation
/// Write `G = A^-1`, `M = G^T = A^-T`, `C = cof A`, `w = W(G)`, `S = W_,A(G)`. From
/// `G'[B] = -G B G` and `D M = C`,
/// `W_inv,A = w C - C S M`. A second derivative, with `M'[B] = -M B^T M`, `S' = W_,AA(G)[G'[B]]`,
/// `w' = S : G'[B]`, gives
/// `W_inv,AA[B] = w' C + w C'[B] - C'[B] S M - C S' M - C S M'[B]`.
///
/// The displacement gradient of the inverse is `G - 1 = -G h`, without cancellation.
#[derive(Clone, Copy, Debug)]
pub struct Inverse<W> {
    base: W,
}

impl<W> Inverse<W> {
    /// Creates the inverse model of a law.
    pub fn new(base: W) -> Self {
        Self { base }
    }

    /// Returns the law of the inverse deformation.
    pub fn base(&self) -> &W {
        &self.base
    }
}

/// Returns `A^-T` and `A^-1 - 1`.
#[inline(always)]
fn inverted<L: Lane, const D: usize>(state: &Kinematics<L, D>) -> (Tensor<L, D>, Tensor<L, D>) {
    let inverse_transpose = tensor::scale(&state.cofactor, state.volume.inverse);
    let h = &state.displacement_gradient;
    let g = tensor::transposed_product(&inverse_transpose, h);
    (inverse_transpose, tensor::scale(&g, -L::one()))
}

impl<const D: usize, W: StoredEnergy<D>> StoredEnergy<D> for Inverse<W> {
    #[inline(always)]
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        let state = Kinematics::new(h, false);
        let (_, g) = inverted(&state);
        let volume = &state.volume;
        let factor = mutant!(volume.determinant, InverseVolume => L::one());
        volume.barred(factor * self.base.value(&g))
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        let state = Kinematics::new(h, false);
        let (m, g) = inverted(&state);
        let (w, s) = self.base.gradient(&g);
        let pulled = tensor::product(&tensor::product(&state.cofactor, &s), &m);
        let along_cofactor = mutant!(w, InverseStress => L::zero());
        let stress = tensor::sub(&tensor::scale(&state.cofactor, along_cofactor), &pulled);
        let volume = &state.volume;
        (volume.barred(volume.determinant * w), stress)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        let state = Kinematics::new(h, false);
        let (m, g) = inverted(&state);
        let c = &state.cofactor;
        let (w, s) = self.base.gradient(&g);
        // M' = -M B^T M, and G' is its transpose.
        let m_derivative = tensor::product(&tensor::product_transposed(&m, b), &m);
        let sign = mutant!(-L::one(), InverseTangent => L::one());
        let m_derivative = tensor::scale(&m_derivative, sign);
        let g_derivative = tensor::transpose(&m_derivative);
        let c_derivative = tensor::cofactor_derivative(&state.deformation_gradient, b);
        let w_derivative = tensor::contract(&s, &g_derivative);
        let s_derivative = self.base.hessian_action(&g, &g_derivative);
        let mut c_s = tensor::product(&c_derivative, &s);
        c_s = tensor::add(&c_s, &tensor::product(c, &s_derivative));
        let mut pulled = tensor::product(&c_s, &m);
        let last = tensor::product(&tensor::product(c, &s), &m_derivative);
        pulled = tensor::add(&pulled, &last);
        let out = tensor::add_scaled(&tensor::scale(c, w_derivative), w, &c_derivative);
        tensor::sub(&out, &pulled)
    }

    fn moduli(&self) -> LameModuli {
        self.base.moduli()
    }

    fn hypotheses(&self) -> Hypotheses {
        let base = self.base.hypotheses();
        Hypotheses {
            growth: inverse_growth(base.growth).completed(D),
            // D W(A^-1) >= c D^(1-r) as D tends to zero.
            barrier: base.barrier && base.growth.expansion > 1.0,
            ..base
        }
    }

    fn name(&self) -> &'static str {
        match self.base.name() {
            "logdet" => "inverse:logdet",
            "logdet_barrier" => "inverse:logdet_barrier",
            "power" => "inverse:power",
            "power_two_term" => "inverse:power_two_term",
            _ => "inverse",
        }
    }
}

/// Growth of `D W(A^-1)`, for `W` growing as `|A|^p + |cof A|^q + D^r + D^-s`.
///
/// `D |A^-1|^p = |cof A|^p D^(1-p)`, `D |cof A^-1|^q = |A|^q D^(1-q)`, and Young's inequality with
/// the term `D^(1+s)` eliminates the determinants: `|A|^m` with `m = (1+s) q / (q+s)`, and the same
/// for the cofactor matrix with `p`.
fn inverse_growth(base: Growth) -> Growth {
    let s = base.compression;
    let traded = |exponent: f64| {
        if exponent >= 1.0 {
            (1.0 + s) * exponent / (exponent + s)
        } else {
            0.0
        }
    };
    Growth {
        norm: traded(base.cofactor),
        cofactor: traded(base.norm),
        expansion: 1.0 + s,
        compression: (base.expansion - 1.0).max(0.0),
    }
}

impl<const D: usize, W: PolyconvexForm<D>> PolyconvexForm<D> for Inverse<W> {
    /// Returns `det W^(cof^T / det, A^T / det, 1 / det)`, the perspective of a convex function.
    fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64 {
        let inverse = 1.0 / determinant;
        let value = self.base.polyconvex_value(
            &tensor::scale(&tensor::transpose(cofactor), inverse),
            &tensor::scale(&tensor::transpose(a), inverse),
            inverse,
        );
        Volume::of_determinant(determinant).barred(determinant * value)
    }
}
