//! Formulas of the notes that do not hold as they are printed, each shown to fail.
//!
//! The broken run replaces the printed formula by the corrected one: the failure must then not be
//! found.

use fe_grid::{Grid, tensor};
use hyperelastic::{LameModuli, SeedLiteral, SeedParameters, StoredEnergy};
use levelset::Arctan;
use phasefield::{ElasticWeight, InterfaceLength, Profile};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::curves::rectangle;
use crate::tools::matrices::{Sequence, norm};
use crate::tools::pointwise::{dissipation, law, response};
use crate::tools::shapes::ball;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "misprint-density",
        reference: "section 4, (I₁ − 3)^(p/2)",
        claim: "The density as printed is not stress free for p = 2, and without shear stiffness for \
                p = 4; for odd p it is not defined under compression",
        broken: "the density is the corrected one, a₁|A|^p + a₂|cof A|^q + Γ(D)",
        run: printed_density,
    },
    Statement {
        name: "misprint-consistency",
        reference: "section 6, (*)",
        claim: "With μ tr((A + Aᵀ)²), as \"μ/tr\" is read, the condition is that of a fluid of \
                four times the shear modulus",
        broken: "the factor is μ/4",
        run: printed_consistency,
    },
    Statement {
        name: "misprint-arctan-weight",
        reference: "section 6, E_deform",
        claim: "The arctan as elastic weight stiffens all of the void: its tails are a hundred \
                times the stiffness δ that the void should have",
        broken: "the weight is the compact step",
        run: arctan_weight,
    },
    Statement {
        name: "misprint-half-length",
        reference: "section 4, L^ε",
        claim: "With the factor ½ in front, L^ε of the optimal profile is half the length of the \
                interface",
        broken: "the factor is left out",
        run: half_length,
    },
];

fn printed_density(setting: Setting) -> Result<Outcome, VerifyError> {
    let seed = |half: u32| {
        SeedLiteral::<3>::new(SeedParameters {
            norm: 1.0,
            cofactor: 0.0,
            volume: 1.0,
            half_norm_exponent: half,
            half_cofactor_exponent: 1,
            expansion: 2.0,
            compression: 2.0,
        })
    };
    let corrected = law("power", 1.0, 1.0)?;
    let zero = tensor::zero::<f64, 3>();
    let stress = if setting.is_broken() {
        norm(&response(&corrected, &zero, &zero)?.stress)
    } else {
        norm(&seed(1)?.gradient(&zero).1)
    };
    let mut outcome = Outcome::default();
    outcome.value(
        "|W_,A(1)| for p = 2",
        stress,
        2.0 * 3f64.sqrt(),
        1e-12,
        "2a₁|1|: the volume term has no slope to hold it",
    );
    let mut shear = zero;
    (shear[0][1], shear[1][0]) = (1.0, 1.0);
    let stiffness = if setting.is_broken() {
        norm(&response(&corrected, &zero, &shear)?.action)
    } else {
        norm(&seed(2)?.hessian_action(&zero, &shear))
    };
    outcome.at_most(
        "|W_,AA(1)[shear]| for p = 4",
        stiffness,
        1e-14,
        "a square of I₁ − 3, which is of second order itself, up to rounding",
    );
    Ok(outcome)
}

fn printed_consistency(setting: Setting) -> Result<Outcome, VerifyError> {
    let moduli = LameModuli::new(1.3, 0.8)?;
    let spec = law("logdet", 1.3, 0.8)?;
    let mut outcome = Outcome::default();
    let mut numbers = Sequence::new(10);
    let factor = setting.ingredient(1.0, 0.25);
    let (mut printed, mut true_law) = (0.0f64, 0.0f64);
    for _ in 0..50 {
        let mut b = numbers.matrix::<3>();
        // Without a trace only mu counts.
        let mean = tensor::trace(&b) / 3.0;
        for (i, row) in b.iter_mut().enumerate() {
            row[i] -= mean;
        }
        let twice = tensor::add(&b, &tensor::transpose(&b));
        let right = factor * moduli.mu * tensor::contract(&twice, &twice);
        let action = response(&spec, &tensor::zero(), &b)?.action;
        printed = printed.max((right / dissipation(moduli, &b) - 4.0).abs());
        true_law = true_law.max((0.5 * tensor::contract(&action, &b) / right - 0.25).abs());
    }
    outcome.at_most(
        "largest | right side/diss[B] − 4 |",
        printed,
        1e-12,
        "|B + Bᵀ|² = 4|ε|², up to rounding",
    );
    outcome.at_most(
        "largest | ½W_,AA(1)[B]:B/right side − ¼ | of a consistent law",
        true_law,
        1e-12,
        "so that the printed condition misses the moduli by four",
    );
    Ok(outcome)
}

fn arctan_weight(setting: Setting) -> Result<Outcome, VerifyError> {
    let delta = 1e-4;
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let h = grid.spacing();
    let distance = ball(grid, 0.25);
    // The notes take the width of the match, the spacing.
    let (arctan, compact) = (Arctan::new(h)?, ElasticWeight::new(h, delta)?);
    let printed = |d: f64| {
        let step: f64 = arctan.value(d);
        (1.0 - delta) * step + delta
    };
    let weight = |d: f64| setting.ingredient(printed(d), compact.value(d));
    // Well outside of any interface.
    let far = distance.as_slice().iter().filter(|d| **d < -0.1);
    let (mut sum, mut count, mut off) = (0.0, 0.0, 0.0f64);
    for d in far {
        sum += weight(*d);
        count += 1.0;
        let tail = h / (std::f64::consts::PI * d.abs());
        off = off.max(((weight(*d) - delta) / tail - 1.0).abs());
    }
    let mut outcome = Outcome::default();
    outcome.at_least(
        "mean weight farther than 0.1 from the shape, over δ",
        sum / count / delta,
        100.0,
        "ε/(π d) at d = 0.25, with ε = h = 1/64 or 1/128",
    );
    outcome.at_most(
        "largest | (weight − δ)/(ε/(π d)) − 1 | there",
        off,
        0.01,
        "the tail of the arctan, but for (ε/d)²/3 and δ",
    );
    Ok(outcome)
}

fn half_length(setting: Setting) -> Result<Outcome, VerifyError> {
    let factor = setting.ingredient(0.5, 1.0);
    let grid = Grid::<2>::dyadic(setting.effort(8, 9));
    let width = 8.0 * grid.spacing();
    let square = rectangle(grid, [0.25; 2], [0.75; 2]);
    let v = Profile::new(width)?.phase_field(&square);
    let length = InterfaceLength {
        interface_width: width,
    };
    let mut outcome = Outcome::default();
    outcome.value(
        "½∫ε|∇v|² + (v − 1)²/(4ε) over the length of a square, ε = 8h",
        factor * length.of(&grid, v.as_slice()) / (2.0 - (4.0 - std::f64::consts::PI) * width),
        0.5,
        5e-3,
        "the length of parallel curves, integrated over the profile; (h/ε)²/6 of the elements",
    );
    Ok(outcome)
}
