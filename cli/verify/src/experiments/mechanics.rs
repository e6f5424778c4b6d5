//! Stresses, areas and volumes of deformations, and the fluid.

use fe_grid::{Tensor, tensor};
use hyperelastic::{LameModuli, ViscousDissipation, cauchy_stress};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::matrices::{Sequence, inverse, minus_identity, norm, stretches};
use crate::tools::pointwise::{density, law, response};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "laws-derivatives",
        reference: "section 3, W_,A and W_,AA",
        claim: "Stress and tangent of every law are the derivatives of its energy",
        broken: "the stress is that of 1.02 λ",
        run: derivatives,
    },
    Statement {
        name: "laws-nanson",
        reference: "section 3, |Dφ|, cof Dφ, det Dφ",
        claim: "A deformation changes lines by A, areas by cof A and volumes by det A, and \
                cof A = det A A⁻ᵀ",
        broken: "areas are changed by A",
        run: |setting| Ok(nanson(setting)),
    },
    Statement {
        name: "laws-cauchy",
        reference: "section 3, Cauchy stress",
        claim: "σ = (det A)⁻¹W_,A Aᵀ is symmetric, carries the forces of the first Piola–Kirchhoff \
                stress on deformed areas, and is no stress of rotations",
        broken: "the law is that of linear elasticity",
        run: cauchy,
    },
    Statement {
        name: "laws-viscous-stress",
        reference: "section 2, σ = δ diss",
        claim: "The stress of the fluid, λ tr ε 1 + 2με, is the derivative of diss[v], and works with \
                twice its rate; rigid motions have none",
        broken: "the stress is that of 1.1 μ",
        run: viscous_stress,
    },
    Statement {
        name: "laws-shear-flow",
        reference: "section 2, shear flow, K_c",
        claim: "Between plates at a distance H the shear stress is μv/H, and even compression has the \
                modulus K_c = λ + 2μ/d",
        broken: "the plates are at the distance 1.1 H",
        run: shear_flow,
    },
];

const NAMES: [&str; 6] = [
    "logdet",
    "logdet_barrier",
    "power",
    "inverse:logdet",
    "inverse:power",
    "linear",
];

/// The largest relative errors of central differences of the energy and of the stress, over a step.
fn off<const D: usize>(name: &str, t: f64, wrong: f64) -> Result<[f64; 2], VerifyError> {
    let (spec, other) = (law(name, 1.3, 0.8)?, law(name, wrong * 1.3, 0.8)?);
    let mut numbers = Sequence::new(21);
    let mut worst = [0.0f64; 2];
    for _ in 0..20 {
        let h = minus_identity(&numbers.stretch::<D>(0.8, 1.3));
        let b = numbers.matrix::<D>();
        let at = |t: f64| tensor::add_scaled(&h, t, &b);
        let found = response(&other, &h, &b)?;
        let slope = (density(&spec, &at(t))? - density(&spec, &at(-t))?) / (2.0 * t);
        let along = tensor::contract(&found.stress, &b);
        worst[0] = worst[0].max((slope - along).abs() / norm(&found.stress));
        let [above, below] = [
            response(&spec, &at(t), &b)?.stress,
            response(&spec, &at(-t), &b)?.stress,
        ];
        let change = tensor::scale(&tensor::sub(&above, &below), 0.5 / t);
        let difference = norm(&tensor::sub(&change, &found.action));
        worst[1] = worst[1].max(difference / norm(&found.action));
    }
    Ok(worst)
}

fn derivatives(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let wrong = setting.ingredient(1.0, 1.02);
    let (mut stresses, mut tangents) = (Vec::new(), Vec::new());
    for t in [4e-3, 2e-3, 1e-3] {
        let mut worst = [0.0f64; 2];
        for name in NAMES {
            for found in [off::<2>(name, t, wrong)?, off::<3>(name, t, wrong)?] {
                for i in 0..2 {
                    worst[i] = if found[i].is_nan() {
                        f64::NAN
                    } else {
                        worst[i].max(found[i])
                    };
                }
            }
        }
        stresses.push((t, worst[0]));
        tangents.push((t, worst[1]));
    }
    let reason = "central differences; the largest of six laws in 2D and 3D at twenty states";
    outcome.order(
        "|W_,A:B − difference of W|",
        "t",
        stresses,
        2.0,
        0.1,
        reason,
    );
    outcome.order(
        "|W_,AA[B] − difference of W_,A|",
        "t",
        tangents,
        2.0,
        0.1,
        reason,
    );
    Ok(outcome)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn applied(a: &Tensor<f64, 3>, x: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|k| a[i][k] * x[k]).sum())
}

fn size(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn minus(x: [f64; 3], y: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| x[i] - y[i])
}

fn nanson(setting: Setting) -> Outcome {
    let mut numbers = Sequence::new(22);
    let (mut areas, mut volumes, mut cofactors) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..100 {
        let a = numbers.stretch::<3>(0.5, 1.6);
        let [p, q, r] = [0; 3].map(|_| [0; 3].map(|_| numbers.between(-1.0, 1.0)));
        let cofactor = tensor::cofactor(&a);
        let seen = setting.ingredient(cofactor, a);
        let deformed = cross(applied(&a, p), applied(&a, q));
        let difference = minus(applied(&seen, cross(p, q)), deformed);
        areas = areas.max(size(difference) / size(deformed));
        let volume = |p, q, r: [f64; 3]| -> f64 {
            let n = cross(p, q);
            (0..3).map(|i| n[i] * r[i]).sum()
        };
        let ratio = volume(applied(&a, p), applied(&a, q), applied(&a, r)) / volume(p, q, r);
        let exact = tensor::determinant(&setting.ingredient(a, cofactor));
        volumes = volumes.max((ratio / exact - 1.0).abs());
        let transposed = tensor::transpose(&inverse(&a));
        let expected = tensor::scale(&transposed, tensor::determinant(&a));
        cofactors = cofactors.max(norm(&tensor::sub(&seen, &expected)) / norm(&expected));
    }
    let mut outcome = Outcome::default();
    let reason = "rounding of products of matrices with stretches from .5 to 1.6";
    outcome.at_most(
        "largest |cof A(p × q) − Ap × Aq|, relative",
        areas,
        1e-10,
        reason,
    );
    outcome.at_most(
        "largest |det A/(ratio of volumes) − 1|",
        volumes,
        1e-9,
        "the same; random volumes may be a thousandth",
    );
    outcome.at_most(
        "largest |cof A − det A A⁻ᵀ|, relative",
        cofactors,
        1e-12,
        reason,
    );
    outcome
}

fn cauchy(setting: Setting) -> Result<Outcome, VerifyError> {
    let (mut skew, mut forces, mut turned) = (0.0f64, 0.0f64, 0.0f64);
    for name in setting.ingredient(&NAMES[..5], &["linear"]) {
        let spec = law(name, 1.3, 0.8)?;
        let mut numbers = Sequence::new(23);
        for _ in 0..50 {
            let a = numbers.stretch::<3>(0.7, 1.4);
            let h = minus_identity(&a);
            let piola = response(&spec, &h, &h)?.stress;
            let sigma = cauchy_stress(&h, &piola);
            let scale = norm(&sigma);
            let antisymmetric = tensor::sub(&sigma, &tensor::transpose(&sigma));
            skew = skew.max(norm(&antisymmetric) / scale);
            // On the deformed area cof A n the force is that of the undeformed one.
            let deformed = tensor::transpose(&inverse(&a));
            let deformed = tensor::scale(&deformed, tensor::determinant(&a));
            let difference = tensor::sub(&tensor::product(&sigma, &deformed), &piola);
            forces = forces.max(norm(&difference) / norm(&piola));
            let q = minus_identity(&numbers.rotation::<3>());
            turned = turned.max(norm(&cauchy_stress(&q, &response(&spec, &q, &q)?.stress)));
        }
    }
    let mut outcome = Outcome::default();
    outcome.at_most(
        "largest |σ − σᵀ|/|σ|",
        skew,
        1e-10,
        "balance of momentum, by frame indifference, up to rounding",
    );
    outcome.at_most(
        "largest |σ cof A − W_,A|/|W_,A|",
        forces,
        1e-11,
        "the same force on the same matter",
    );
    outcome.at_most("largest |σ| of a rotation", turned, 1e-12, "rounding");
    Ok(outcome)
}

fn viscous_stress(setting: Setting) -> Result<Outcome, VerifyError> {
    let fluid = ViscousDissipation {
        moduli: LameModuli::new(1.3, 0.8)?,
    };
    let seen = ViscousDissipation {
        moduli: LameModuli::new(1.3, setting.ingredient(1.0, 1.1) * 0.8)?,
    };
    let mut numbers = Sequence::new(24);
    let (mut slopes, mut work, mut named) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..50 {
        let (v, b) = (numbers.matrix::<3>(), numbers.matrix::<3>());
        let stress = seen.stress(&v);
        // A quadratic form: central differences are exact.
        let at = |t: f64| fluid.rate(&tensor::add_scaled(&v, t, &b));
        let slope = at(0.5) - at(-0.5);
        slopes = slopes.max((slope - tensor::contract(&stress, &b)).abs());
        work = work.max((tensor::contract(&stress, &v) - 2.0 * fluid.rate(&v)).abs());
        let strain = tensor::symmetric_part(&v);
        let mut written = tensor::scale(&strain, 1.6);
        for i in 0..3 {
            written[i][i] += 1.3 * tensor::trace(&strain);
        }
        named = named.max(norm(&tensor::sub(&stress, &written)));
    }
    let mut outcome = Outcome::default();
    let reason = "an identity of quadratic forms, up to rounding";
    outcome.at_most("largest |σ:B − δdiss[B]|", slopes, 1e-12, reason);
    outcome.at_most("largest |σ:Dv − 2 diss[v]|", work, 1e-12, reason);
    outcome.at_most("largest |σ − (λ tr ε 1 + 2με)|", named, 1e-12, reason);
    Ok(outcome)
}

fn shear_flow(setting: Setting) -> Result<Outcome, VerifyError> {
    let (lambda, mu) = (1.3, 0.8);
    let fluid = ViscousDissipation {
        moduli: LameModuli::new(lambda, mu)?,
    };
    let (speed, distance) = (0.7, 0.25);
    let apart = setting.ingredient(1.0, 1.1) * distance;
    let mut outcome = Outcome::default();
    let mut flow = [[0.0; 3]; 3];
    flow[0][1] = speed / apart;
    let stress = fluid.stress(&flow);
    outcome.value(
        "shear stress over μv/H",
        stress[0][1] / (mu * speed / distance),
        1.0,
        1e-12,
        "Newton's law, in closed form",
    );
    outcome.value(
        "rate of dissipation over ½μ(v/H)²",
        fluid.rate(&flow) / (0.5 * mu * (speed / distance).powi(2)),
        1.0,
        1e-12,
        "half the work of the plates, since diss is half of σ:ε",
    );
    // Even compression: the pressure is K_c times the rate of the volume.
    for (d, pressure) in [
        (2.0, fluid.stress(&scaled::<2>(setting))[0][0]),
        (3.0, fluid.stress(&scaled::<3>(setting))[0][0]),
    ] {
        outcome.value(
            format!("pressure over K_c tr ε of even compression, {d}D"),
            pressure / ((lambda + 2.0 * mu / d) * d * 0.1),
            1.0,
            1e-12,
            "K_c = λ + 2μ/d",
        );
    }
    Ok(outcome)
}

/// Even expansion at the rate .1, slower between plates that are farther apart.
fn scaled<const D: usize>(setting: Setting) -> Tensor<f64, D> {
    stretches([1.0 + 0.1 / setting.ingredient(1.0, 1.1); D])
}
