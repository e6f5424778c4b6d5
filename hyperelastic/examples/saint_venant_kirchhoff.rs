//! A stored energy density of one's own: the law of Saint Venant and Kirchhoff,
//! `W = mu |E|^2 + lambda/2 (tr E)^2` with the Green strain `E = (A^T A - 1) / 2`.
//!
//! It is written once for every lane type; from the registry it can be named like the built-in laws.
//!
//! ```sh
//! cargo run --release -p hyperelastic --example saint_venant_kirchhoff
//! ```

use fe_grid::minimise::compare_with_differences;
use fe_grid::random::noise;
use fe_grid::{Lane, Tensor, tensor};
use hyperelastic::{
    CompiledLaw, Growth, Hypotheses, LameModuli, LawError, LawSpec, StoredEnergy, register_law,
};

/// The law, which is not polyconvex and has no barrier against compression.
#[derive(Clone, Copy, Debug)]
struct SaintVenantKirchhoff(LameModuli);

impl SaintVenantKirchhoff {
    /// The second Piola–Kirchhoff stress `2 mu E + lambda tr(E)` of a strain.
    #[inline(always)]
    fn second_piola<L: Lane, const D: usize>(&self, strain: &Tensor<L, D>) -> Tensor<L, D> {
        let mut stress = tensor::scale(strain, L::splat(2.0 * self.0.mu));
        let pressure = tensor::trace(strain).scale(self.0.lambda);
        for k in 0..D {
            stress[k][k] += pressure;
        }
        stress
    }

    /// `A = 1 + h` and `E = (h + h^T + h^T h) / 2`, free of cancellation at small strains.
    #[inline(always)]
    fn strain<L: Lane, const D: usize>(h: &Tensor<L, D>) -> (Tensor<L, D>, Tensor<L, D>) {
        let sum = tensor::add(
            &tensor::add(h, &tensor::transpose(h)),
            &tensor::transposed_product(h, h),
        );
        (tensor::add_identity(h), tensor::scale(&sum, L::splat(0.5)))
    }
}

// ANCHOR: law
impl<const D: usize> StoredEnergy<D> for SaintVenantKirchhoff {
    #[inline(always)]
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        let (_, strain) = Self::strain(h);
        tensor::contract(&strain, &self.second_piola(&strain)).scale(0.5)
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        let (a, strain) = Self::strain(h);
        (
            self.value(h),
            tensor::product(&a, &self.second_piola(&strain)),
        )
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        let (a, strain) = Self::strain(h);
        let change = tensor::symmetric_part(&tensor::transposed_product(&a, b));
        tensor::add(
            &tensor::product(b, &self.second_piola(&strain)),
            &tensor::product(&a, &self.second_piola(&change)),
        )
    }
    // ANCHOR_END: law

    fn moduli(&self) -> LameModuli {
        self.0
    }

    fn hypotheses(&self) -> Hypotheses {
        Hypotheses {
            dimension: D,
            frame_indifferent: true,
            isotropic: true,
            stress_free: true,
            polyconvex: false,
            barrier: false,
            minimum_on_rotations: false,
            growth: Growth {
                norm: 4.0,
                cofactor: 0.0,
                expansion: 0.0,
                compression: 0.0,
            },
        }
    }

    fn name(&self) -> &'static str {
        "saint_venant_kirchhoff"
    }
}

fn main() -> Result<(), LawError> {
    register_law(
        "saint_venant_kirchhoff",
        |moduli| Ok(CompiledLaw::new(SaintVenantKirchhoff(moduli))),
        |moduli| Ok(CompiledLaw::new(SaintVenantKirchhoff(moduli))),
    )?;
    let law = LawSpec::new("saint_venant_kirchhoff", LameModuli::new(1.0, 1.0)?)?.compile::<2>()?;
    let logdet = LawSpec::new("logdet", LameModuli::new(1.0, 1.0)?)?.compile::<2>()?;
    println!("stretch along one axis   saint_venant_kirchhoff   logdet");
    for stretch in [0.1, 0.5, 0.9, 1.0, 1.1, 1.5, 2.0] {
        let h = [[stretch - 1.0, 0.0], [0.0, 0.0]];
        println!(
            "{stretch:>22}   {:>22.5}   {:>6.5}",
            law.value(&h),
            logdet.value(&h)
        );
    }

    // The stress against differences of the energy, at a random displacement gradient.
    let tensor_of = |x: &[f64]| [[x[0], x[1]], [x[2], x[3]]];
    let [x, direction] = [noise(4, 1), noise(4, 2)];
    let (_, stress) = law.gradient::<f64>(&tensor_of(&x));
    let errors = compare_with_differences(&x, &direction, &stress.concat(), &[1e-2, 1e-3], |x| {
        Ok::<f64, LawError>(law.value(&tensor_of(x)))
    });
    for (step, error) in errors? {
        println!("error of the stress against a difference of step {step:.0e}: {error:.1e}");
    }
    Ok(())
}
