//! The density as printed in the lecture notes, for checks of values.

use crate::error::{LawError, require};
use crate::hypotheses::{Growth, Hypotheses};
use crate::isotropic::{Curvatures, Slopes, lame_moduli, stress, tangent};
use crate::kinematics::{Kinematics, Volume};
use crate::moduli::LameModuli;
use crate::stored_energy::StoredEnergy;
use crate::terms::{PowerVolume, VolumeTerm};
use fe_grid::{Lane, Tensor};

const NAME: &str = "seed_literal";

/// Parameters of [`SeedLiteral`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeedParameters {
    /// `a1` of the norm term.
    pub norm: f64,
    /// `a2` of the cofactor term.
    pub cofactor: f64,
    /// `a3` of the volume term.
    pub volume: f64,
    /// Half of the even exponent `p`, at least 1.
    pub half_norm_exponent: u32,
    /// Half of the even exponent `q`, at least 1.
    pub half_cofactor_exponent: u32,
    /// `r >= 1` of the growing power of the determinant.
    pub expansion: f64,
    /// `s > 0` of its inverse power.
    pub compression: f64,
}

/// `W = a1 (|A|^2 - 3)^(p/2) + a2 (|cof A|^2 - 3)^(q/2) + a3 (D^-s + s/r D^r - (r+s)/r)`.
///
/// Not intended for computations: it is not stress free for `p = 2`, has no shear stiffness for
/// `p = 4`, and is not defined under compression for odd `p`; the 3 is used in 2D as well. It
/// serves to check values, and to demonstrate these defects in tests.
#[derive(Clone, Copy, Debug)]
pub struct SeedLiteral<const D: usize> {
    parameters: SeedParameters,
    volume: PowerVolume,
}

impl<const D: usize> SeedLiteral<D> {
    /// Creates the density as printed.
    ///
    /// # Errors
    /// [`LawError::Parameter`] for coefficients that are not finite or exponents out of range.
    pub fn new(parameters: SeedParameters) -> Result<Self, LawError> {
        let p = &parameters;
        require(true, NAME, "a1", p.norm, "finite")?;
        require(true, NAME, "a2", p.cofactor, "finite")?;
        require(true, NAME, "a3", p.volume, "finite")?;
        require(p.expansion >= 1.0, NAME, "r", p.expansion, "at least 1")?;
        require(p.compression > 0.0, NAME, "s", p.compression, "positive")?;
        let halves = [p.half_norm_exponent, p.half_cofactor_exponent];
        for (name, half) in ["p", "q"].into_iter().zip(halves) {
            let exponent = 2.0 * f64::from(half);
            require(half >= 1, NAME, name, exponent, "even and at least 2")?;
        }
        Ok(Self {
            parameters,
            volume: PowerVolume {
                slope: 0.0,
                compression: p.volume,
                compression_exponent: p.compression,
                expansion: p.volume * p.compression / p.expansion,
                expansion_exponent: p.expansion,
            },
        })
    }

    #[inline(always)]
    fn slopes<L: Lane>(&self, x: L, y: L, volume: &Volume<L>) -> Slopes<L> {
        let p = &self.parameters;
        Slopes {
            norm: shifted_power_slope(x, p.half_norm_exponent).scale(p.norm),
            cofactor: shifted_power_slope(y, p.half_cofactor_exponent).scale(p.cofactor),
            volume: self.volume.slope_excess(volume),
        }
    }

    #[inline(always)]
    fn curvatures<L: Lane>(&self, x: L, y: L, volume: &Volume<L>) -> Curvatures<L> {
        let p = &self.parameters;
        Curvatures {
            norm: shifted_power_curvature(x, p.half_norm_exponent).scale(p.norm),
            cofactor: shifted_power_curvature(y, p.half_cofactor_exponent).scale(p.cofactor),
            volume: self.volume.curvature(volume),
        }
    }

    #[inline(always)]
    fn value_at<L: Lane>(&self, state: &Kinematics<L, D>) -> L {
        let p = &self.parameters;
        let (x, y) = shifted_norms(state);
        let norms = x.powi(p.half_norm_exponent).scale(p.norm)
            + y.powi(p.half_cofactor_exponent).scale(p.cofactor);
        state
            .volume
            .barred(norms + self.volume.remainder(&state.volume))
    }
}

/// `|A|^2 - 3` and `|cof A|^2 - 3`.
#[inline(always)]
fn shifted_norms<L: Lane, const D: usize>(state: &Kinematics<L, D>) -> (L, L) {
    let shift = L::splat(D as f64 - 3.0);
    (
        state.norm_excess() + shift,
        state.cofactor_norm_excess() + shift,
    )
}

/// `n x^(n-1)`.
#[inline(always)]
fn shifted_power_slope<L: Lane>(x: L, n: u32) -> L {
    x.powi(n - 1).scale(f64::from(n))
}

/// `n (n-1) x^(n-2)`.
#[inline(always)]
fn shifted_power_curvature<L: Lane>(x: L, n: u32) -> L {
    x.powi(n.saturating_sub(2)).scale(f64::from(n * (n - 1)))
}

impl<const D: usize> StoredEnergy<D> for SeedLiteral<D> {
    #[inline(always)]
    fn value<L: Lane>(&self, h: &Tensor<L, D>) -> L {
        self.value_at(&Kinematics::new(h, false))
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        let state = Kinematics::new(h, false);
        let (x, y) = shifted_norms(&state);
        let slopes = self.slopes(x, y, &state.volume);
        (self.value_at(&state), stress(&state, &slopes))
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        let state = Kinematics::new(h, false);
        let (x, y) = shifted_norms(&state);
        let slopes = self.slopes(x, y, &state.volume);
        let curvatures = self.curvatures(x, y, &state.volume);
        tangent(&state, &slopes, &curvatures, true, b)
    }

    /// Returns the moduli of the Hessian at the identity restricted to symmetric matrices; the
    /// identity may be prestressed, and then rotations have nonzero energy too.
    fn moduli(&self) -> LameModuli {
        let shifted = D as f64 - 3.0;
        let volume = Volume::of_determinant(1.0);
        lame_moduli::<D>(
            &self.slopes(shifted, shifted, &volume),
            &self.curvatures(shifted, shifted, &volume),
        )
    }

    fn hypotheses(&self) -> Hypotheses {
        Hypotheses {
            stress_free: false,
            polyconvex: false,
            minimum_on_rotations: false,
            ..Hypotheses::of_polyconvex(D, Growth::default())
        }
    }

    fn name(&self) -> &'static str {
        NAME
    }
}
