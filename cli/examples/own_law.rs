//! A stored energy density of one's own, in an average, a geodesic and principal components.
//!
//! ```sh
//! cargo run --release --package shapespace --example own_law
//! ```

use std::error::Error;

use fe_grid::minimise::Silent;
use fe_grid::{Grid, Lane, ScalarField, Tensor, tensor};
use geodesic::{GeodesicParams, geodesic};
use hyperelastic::{
    CompiledLaw, Growth, Hypotheses, LameModuli, LawSpec, StoredEnergy, register_law,
};
use shape_average::{AverageParams, average};
use shape_pca::{Average, Compound, Pca, PcaParams};

/// The compressible neo-Hookean law with a quadratic volume term,
/// `W(A) = mu/2 (|A|^2 - d - 2 ln J) + lambda/2 (J - 1)^2`, `J = det A`.
#[derive(Clone, Copy, Debug)]
pub struct NeoHookean {
    moduli: LameModuli,
}

impl NeoHookean {
    /// The law with these moduli.
    pub fn new(moduli: LameModuli) -> Self {
        Self { moduli }
    }
}

/// `J`, `J - 1`, `A^-T` and `cof A` of a displacement gradient; `J` is not a number where it is not
/// positive.
#[inline(always)]
fn kinematics<L: Lane, const D: usize>(h: &Tensor<L, D>) -> (L, L, Tensor<L, D>, Tensor<L, D>) {
    let a = tensor::add_identity(h);
    let cofactor = tensor::cofactor(&a);
    let excess = tensor::determinant_excess(h);
    let j = excess + L::one();
    let j = L::select(L::zero().less(j), j, L::splat(f64::NAN));
    let inverse_transpose = tensor::scale(&cofactor, L::one() / j);
    (j, excess, inverse_transpose, cofactor)
}

impl<const D: usize> StoredEnergy<D> for NeoHookean {
    #[inline(always)]
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        let (j, excess, ..) = kinematics(h);
        let shear = tensor::squared_norm_excess(h) - excess.ln_1p().scale(2.0);
        let volume = excess * excess;
        let value = shear.scale(0.5 * self.moduli.mu) + volume.scale(0.5 * self.moduli.lambda);
        L::select(L::zero().less(j), value, L::splat(f64::INFINITY))
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        let (_, excess, inverse_transpose, cofactor) = kinematics(h);
        let a = tensor::add_identity(h);
        let shear = tensor::sub(&a, &inverse_transpose);
        let volume = tensor::scale(&cofactor, excess.scale(self.moduli.lambda));
        let stress = tensor::add(&tensor::scale(&shear, L::splat(self.moduli.mu)), &volume);
        (self.value(h), stress)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        let (_, excess, inverse_transpose, cofactor) = kinematics(h);
        // d(A^-T)[b] = -A^-T b^T A^-T and d(cof A)[b] = (cof A : b) A^-T - cof A b^T A^-T.
        let turned = tensor::product_transposed(&inverse_transpose, b);
        let turned = tensor::product(&turned, &inverse_transpose);
        let shear = tensor::add(b, &turned);
        let along = tensor::contract(&cofactor, b);
        let bent = tensor::sub(
            &tensor::scale(&inverse_transpose, along),
            &tensor::product(
                &tensor::product_transposed(&cofactor, b),
                &inverse_transpose,
            ),
        );
        let volume = tensor::add(
            &tensor::scale(&cofactor, along),
            &tensor::scale(&bent, excess),
        );
        tensor::add(
            &tensor::scale(&shear, L::splat(self.moduli.mu)),
            &tensor::scale(&volume, L::splat(self.moduli.lambda)),
        )
    }

    fn moduli(&self) -> LameModuli {
        self.moduli
    }

    fn hypotheses(&self) -> Hypotheses {
        Hypotheses {
            dimension: D,
            frame_indifferent: true,
            isotropic: true,
            stress_free: true,
            polyconvex: true,
            barrier: true,
            minimum_on_rotations: true,
            growth: Growth {
                norm: 2.0,
                cofactor: 2.0 / (D as f64 - 1.0),
                expansion: if self.moduli.lambda > 0.0 {
                    2.0
                } else {
                    2.0 / D as f64
                },
                compression: 0.0,
            },
        }
    }

    fn name(&self) -> &'static str {
        "neo_hookean"
    }
}

/// What three disks give under the law: the radius of their average, the length of the geodesic from
/// the first to the last, and the share of the variance in the first mode.
#[derive(Clone, Copy, Debug)]
pub struct Results {
    /// Radius of the disk that has the area of the average.
    pub radius: f64,
    /// Length of the geodesic.
    pub length: f64,
    /// Share of the first mode in the variance.
    pub first_mode: f64,
}

/// Computes all three with a law of any name.
///
/// # Errors
/// Those of the computations.
pub fn compute(law: LawSpec) -> Result<Results, Box<dyn Error>> {
    let grid = Grid::<2>::dyadic(5);
    let disk =
        |radius: f64| ScalarField::from_fn(grid, |[x, y]| [radius - (x - 0.5).hypot(y - 0.5)]);
    let disks = [disk(0.2), disk(0.24), disk(0.28)];
    let params = AverageParams {
        law,
        ..AverageParams::default()
    };
    let mean = average(&disks, &params, &mut Silent)?;
    let area = levelset::Moments::of_density(&mean.average_indicator)?.volume;
    let path = GeodesicParams {
        law,
        steps: 4,
        ..GeodesicParams::default()
    };
    let path = geodesic(&disks[0], &disks[2], &path, &mut Silent)?;
    let modes = PcaParams {
        law,
        ..PcaParams::default()
    };
    let object = Average::of_result(&mean, &params)?;
    let pca = Pca::new(&object, &Compound::new(&object, &modes)?, 2, &mut Silent)?;
    let variances = &pca.modes.eigenvalues;
    Ok(Results {
        radius: (area / std::f64::consts::PI).sqrt(),
        length: path.length(),
        first_mode: variances[0] / variances.iter().sum::<f64>(),
    })
}

// ANCHOR: register
/// Registers the law and returns its specification.
///
/// # Errors
/// [`hyperelastic::LawError::NameTaken`] the second time.
pub fn registered(moduli: LameModuli) -> Result<LawSpec, Box<dyn Error>> {
    let law = register_law(
        "neo_hookean",
        |moduli| Ok(CompiledLaw::new(NeoHookean::new(moduli))),
        |moduli| Ok(CompiledLaw::new(NeoHookean::new(moduli))),
    )?;
    Ok(law.with(moduli))
}
// ANCHOR_END: register

fn main() -> Result<(), Box<dyn Error>> {
    let law = registered(LameModuli::new(1.0, 1.0)?)?;
    let Results {
        radius,
        length,
        first_mode,
    } = compute(law)?;
    println!(
        "three disks of radius 0.20, 0.24 and 0.28 under the law {}",
        law.law
    );
    println!("radius of the average      {radius:.4}");
    println!("length of the geodesic     {length:.4}");
    println!("variance in the first mode {:.1} %", 100.0 * first_mode);
    Ok(())
}
