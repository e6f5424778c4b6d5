//! Isotropic laws of the form `W(A) = f(|A|^2) + g(|cof A|^2) + k(det A)`.

use crate::kinematics::{Kinematics, Volume};
use crate::moduli::LameModuli;
use crate::terms::{NormTerm, VolumeTerm};
use fe_grid::{Lane, Tensor, mutant, tensor};

/// A sum of three terms that is stress free at the identity: `2 f' + 2 (d-1) g' + k' = 0` there.
///
/// The slopes are chosen accordingly by the constructors. The relation is used in the evaluation:
/// terms of first order in `h` are omitted from the value, and terms of order zero from the stress,
/// so that neither is a small difference of large numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Isotropic<F, G, K, const D: usize> {
    pub norm: F,
    pub cofactor: G,
    pub volume: K,
}

/// First derivatives of the three terms.
pub(crate) struct Slopes<L> {
    pub norm: L,
    pub cofactor: L,
    pub volume: L,
}

/// Second derivatives of the three terms.
pub(crate) struct Curvatures<L> {
    pub norm: L,
    pub cofactor: L,
    pub volume: L,
}

impl<F: NormTerm, G: NormTerm, K: VolumeTerm, const D: usize> Isotropic<F, G, K, D> {
    #[inline(always)]
    fn value_at<L: Lane>(&self, state: &Kinematics<L, D>) -> L {
        let h = &state.displacement_gradient;
        let mut value = tensor::contract(h, h).mul_add(
            L::splat(self.norm.slope()),
            state.volume_second_order.scale(self.volume.slope()),
        );
        if self.norm.curved() {
            value += self.norm.remainder(state.norm_excess());
        }
        if self.cofactor.present() {
            let k = &state.cofactor_excess;
            let quadratic = tensor::contract(k, k)
                + (state.cofactor_second_order + state.cofactor_second_order);
            value = quadratic.mul_add(L::splat(self.cofactor.slope()), value);
            value += self.cofactor.remainder(state.cofactor_norm_excess());
        }
        value += self.volume.remainder(&state.volume);
        state.volume.barred(value)
    }

    #[inline(always)]
    pub fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        self.value_at(&Kinematics::new(h, K::LOGARITHM))
    }

    /// Computes value and stress, both times a weight. `2 f' (h - (cof A - 1)) + 2 g' C + c cof A`,
    /// without the terms that cancel by the choice of slopes, in powers of `h` and `cof A - 1`.
    #[inline(always)]
    pub fn weighted_gradient<L: Lane>(&self, h: &Tensor<L, D>, weight: L) -> (L, Tensor<L, D>) {
        let state = Kinematics::new(h, K::LOGARITHM);
        let norm = self.norm.slope_excess(state.norm_excess());
        let mut along_cofactor = self.volume.slope_excess(&state.volume);
        if self.norm.curved() {
            along_cofactor += norm + norm;
        }
        let norm_slope = (L::splat(self.norm.slope()) + norm).scale(2.0) * weight;
        let mut stress = tensor::scale(h, norm_slope);
        if self.cofactor.present() {
            let excess = self.cofactor.slope_excess(state.cofactor_norm_excess());
            along_cofactor = excess.mul_add(L::splat(2.0 * (D as f64 - 1.0)), along_cofactor);
            let slope = (L::splat(self.cofactor.slope()) + excess).scale(2.0) * weight;
            stress = tensor::add_scaled(&stress, slope, &state.cofactor_norm_slope_excess());
        }
        along_cofactor *= weight;
        let along_excess = along_cofactor - norm_slope;
        let mut stress = tensor::add_scaled(&stress, along_excess, &state.cofactor_excess);
        for i in 0..D {
            stress[i][i] += along_cofactor;
        }
        (self.value_at(&state) * weight, stress)
    }

    #[inline(always)]
    pub fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        let state = Kinematics::new(h, false);
        let x = state.norm_excess();
        let y = state.cofactor_norm_excess();
        let slopes = Slopes {
            norm: L::splat(self.norm.slope()) + self.norm.slope_excess(x),
            cofactor: L::splat(self.cofactor.slope()) + self.cofactor.slope_excess(y),
            volume: L::splat(self.volume.slope()) + self.volume.slope_excess(&state.volume),
        };
        let curvatures = Curvatures {
            norm: self.norm.curvature(x),
            cofactor: self.cofactor.curvature(y),
            volume: self.volume.curvature(&state.volume),
        };
        tangent(&state, &slopes, &curvatures, self.cofactor.present(), b)
    }

    /// Computes the sum of the three terms at independent arguments.
    pub fn polyconvex_value(
        &self,
        a: &Tensor<f64, D>,
        cofactor: &Tensor<f64, D>,
        determinant: f64,
    ) -> f64 {
        let excess = |a: &Tensor<f64, D>| tensor::contract(a, a) - D as f64;
        let (x, y) = (excess(a), excess(cofactor));
        let volume = Volume::of_determinant(determinant);
        let value = self.norm.slope() * x
            + self.norm.remainder(x)
            + self.cofactor.slope() * y
            + self.cofactor.remainder(y)
            + self.volume.slope() * volume.excess
            + self.volume.remainder(&volume);
        volume.barred(value)
    }

    pub fn moduli(&self) -> LameModuli {
        lame_moduli::<D>(
            &Slopes {
                norm: self.norm.slope(),
                cofactor: self.cofactor.slope(),
                volume: self.volume.slope(),
            },
            &Curvatures {
                norm: self.norm.curvature(0.0),
                cofactor: self.cofactor.curvature(0.0),
                volume: self.volume.curvature(&Volume::of_determinant(1.0)),
            },
        )
    }
}

/// Computes `W_,A = 2 f' A + 2 g' C + k' cof A`, for laws that are not stress free.
#[inline(always)]
pub(crate) fn stress<L: Lane, const D: usize>(
    state: &Kinematics<L, D>,
    slopes: &Slopes<L>,
) -> Tensor<L, D> {
    let along_cofactor = tensor::scale(&state.cofactor, slopes.volume);
    let stress = tensor::add_scaled(
        &along_cofactor,
        slopes.norm.scale(2.0),
        &state.deformation_gradient,
    );
    tensor::add_scaled(
        &stress,
        slopes.cofactor.scale(2.0),
        &state.cofactor_norm_slope(),
    )
}

/// `W_,AA[B] = 2 f' B + 4 f'' (A:B) A + 2 g' C'[B] + 4 g'' (C:B) C + k'' (cof A:B) cof A
/// + k' (cof A)'[B]`.
#[inline(always)]
pub(crate) fn tangent<L: Lane, const D: usize>(
    state: &Kinematics<L, D>,
    slopes: &Slopes<L>,
    curvatures: &Curvatures<L>,
    cofactor_present: bool,
    b: &Tensor<L, D>,
) -> Tensor<L, D> {
    let a = &state.deformation_gradient;
    let cofactor_derivative = tensor::cofactor_derivative(a, b);
    let mut out = tensor::scale(&cofactor_derivative, slopes.volume);
    let along_cofactor = tensor::contract(&state.cofactor, b) * curvatures.volume;
    out = tensor::add_scaled(&out, along_cofactor, &state.cofactor);
    out = tensor::add_scaled(&out, slopes.norm.scale(2.0), b);
    let along_a = (tensor::contract(a, b) * curvatures.norm).scale(4.0);
    out = tensor::add_scaled(&out, along_a, a);
    if cofactor_present {
        let derivative = state.cofactor_norm_slope_derivative(b, &cofactor_derivative);
        let factor = mutant!(2.0, CofactorTangent => 1.0);
        out = tensor::add_scaled(&out, slopes.cofactor.scale(factor), &derivative);
        let slope = state.cofactor_norm_slope();
        let along_slope = (tensor::contract(&slope, b) * curvatures.cofactor).scale(4.0);
        out = tensor::add_scaled(&out, along_slope, &slope);
    }
    out
}

/// Computes the moduli of the quadratic form of [`tangent`] at the identity, on symmetric matrices.
///
/// With `e` symmetric, `C'(1)[e] = 2 tr(e) 1` in 3D and `e` in 2D, `cof'(1)[e] = tr(e) 1 - e`.
pub(crate) fn lame_moduli<const D: usize>(
    slopes: &Slopes<f64>,
    curvatures: &Curvatures<f64>,
) -> LameModuli {
    let d = D as f64;
    let cofactor_shear = if D == 2 { slopes.cofactor } else { 0.0 };
    LameModuli {
        lambda: 4.0 * curvatures.norm
            + 4.0 * (d - 1.0).powi(2) * curvatures.cofactor
            + 4.0 * (d - 2.0) * slopes.cofactor
            + curvatures.volume
            + slopes.volume,
        mu: slopes.norm + cofactor_shear - 0.5 * slopes.volume,
    }
}
