//! Properties of every stored energy density, at random points and on fields.

use fe_grid::{Grid, Tensor, tensor};
use hyperelastic::{
    Inverse, LameModuli, LawSpec, LogDet, LogDetBarrier, PolyconvexForm, Power, PowerCoefficients,
    PowerExponents,
};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::fields::{displacement, elastic_energy, smooth};
use crate::tools::matrices::{Sequence, inverse, minus_identity, norm, plane_rotation, stretches};
use crate::tools::pointwise::{density, dissipation, law, response};
use crate::tools::quadrature::disk;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "laws-frame-indifference",
        reference: "section 3, W(QA) = W(A)",
        claim: "No rotation after a deformation changes its energy, at points and on fields",
        broken: "the law is that of linear elasticity",
        run: frame_indifference,
    },
    Statement {
        name: "laws-isotropy",
        reference: "section 3, W(AQ) = W(A)",
        claim: "No rotation before a deformation changes its energy, at points and on fields",
        broken: "the law is that of linear elasticity",
        run: isotropy,
    },
    Statement {
        name: "laws-linear-rotation",
        reference: "section 3, W_lin",
        claim: "Linear elasticity charges a rotation by θ with (cos θ − 1)²(λd²/2 + μd), d = 2, \
                also for a rotation about an axis in space; a nonlinear law with nothing",
        broken: "the strain is taken as θ − 1 in place of cos θ − 1",
        run: linear_rotation,
    },
    Statement {
        name: "laws-rest",
        reference: "section 3, W(1) = 0, W_,A(1) = 0",
        claim: "Rotations are the only states of least energy, and W → ∞ as det A → 0",
        broken: "the law is that of linear elasticity",
        run: rest,
    },
    Statement {
        name: "laws-consistency",
        reference: "Lemma 6.4",
        claim: "For any λ, μ there is a law with W_,AA(1)[B]:B = λ(tr B)² + (μ/2)|B + Bᵀ|² = 2 diss[B]",
        broken: "the law has twice the μ",
        run: consistency,
    },
    Statement {
        name: "laws-polyconvexity",
        reference: "section 3, Theorem 4.2",
        claim: "W is a function Ŵ of (A, cof A, det A), and Ŵ is convex",
        broken: "the law has a volume function with β < 0",
        run: polyconvexity,
    },
    Statement {
        name: "laws-inverse",
        reference: "Definition 4.5",
        claim: "The energy of the inverse deformation is ∫ det Dφ W((Dφ)⁻¹) over the shape, and has \
                the moduli of W",
        broken: "the factor det Dφ is left out",
        run: inverse_model,
    },
];

/// The laws to which the theorems apply, for all moduli.
const NAMES: [&str; 5] = [
    "logdet",
    "logdet_barrier",
    "power",
    "inverse:logdet",
    "inverse:power",
];
const SAMPLES: usize = 200;

/// The largest of a figure over laws, dimensions and samples.
fn worst_over_laws(
    names: &[&str],
    plane: impl Fn(&LawSpec, &mut Sequence) -> Result<f64, VerifyError>,
    space: impl Fn(&LawSpec, &mut Sequence) -> Result<f64, VerifyError>,
) -> Result<f64, VerifyError> {
    let mut worst = 0.0f64;
    for name in names {
        let spec = law(name, 1.3, 0.8)?;
        let mut numbers = Sequence::new(1);
        for _ in 0..SAMPLES {
            for found in [plane(&spec, &mut numbers)?, space(&spec, &mut numbers)?] {
                // What is no number is worse than any.
                worst = if found.is_nan() {
                    f64::INFINITY
                } else {
                    worst.max(found)
                };
            }
        }
    }
    Ok(worst)
}

/// `|W(QA) - W(A)| / W(A)`, or with `AQ`.
fn turned<const D: usize>(
    spec: &LawSpec,
    numbers: &mut Sequence,
    before: bool,
) -> Result<f64, VerifyError> {
    let (a, q) = (numbers.stretch::<D>(0.6, 1.6), numbers.rotation::<D>());
    let b = if before {
        tensor::product(&a, &q)
    } else {
        tensor::product(&q, &a)
    };
    let [w, turned] = [
        density(spec, &minus_identity(&a))?,
        density(spec, &minus_identity(&b))?,
    ];
    Ok((turned - w).abs() / w.abs().max(1e-3))
}

const ROUNDING: &str = "rounding: W of order one is the rest of terms a hundred times larger";

fn frame_indifference(setting: Setting) -> Result<Outcome, VerifyError> {
    let names: &[&str] = setting.ingredient(&NAMES[..], &["linear"]);
    let mut outcome = Outcome::default();
    let worst = worst_over_laws(
        names,
        |spec, numbers| turned::<2>(spec, numbers, false),
        |spec, numbers| turned::<3>(spec, numbers, false),
    )?;
    outcome.at_most("largest |W(QA) − W(A)|/W(A)", worst, 1e-11, ROUNDING);
    let mut on_fields = 0.0f64;
    for name in names {
        let spec = law(name, 1.3, 0.8)?;
        on_fields = on_fields.max(turned_field::<2>(&spec)?);
        on_fields = on_fields.max(turned_field::<3>(&spec)?);
    }
    outcome.at_most(
        "largest |𝒲[Q∘φ + b] − 𝒲[φ]|/𝒲[φ] on grids",
        on_fields,
        1e-11,
        "rounding: a rotated field is as much a field of the grid as it was",
    );
    Ok(outcome)
}

fn turned_field<const D: usize>(spec: &LawSpec) -> Result<f64, VerifyError> {
    let grid = Grid::<D>::dyadic(if D == 2 { 4 } else { 3 });
    let ones = vec![1.0; grid.n_nodes()];
    let q = plane_rotation::<D>(0, D - 1, 0.7);
    let energy = |turn: bool| {
        let u = displacement(grid, |x| {
            let y = smooth(x);
            if turn {
                std::array::from_fn(|i| 0.2 + (0..D).map(|k| q[i][k] * y[k]).sum::<f64>())
            } else {
                y
            }
        });
        elastic_energy(spec, 0.0, &u, &ones)
    };
    let plain = energy(false)?;
    Ok((energy(true)? - plain).abs() / plain)
}

fn isotropy(setting: Setting) -> Result<Outcome, VerifyError> {
    let names: &[&str] = setting.ingredient(&NAMES[..], &["linear"]);
    let mut outcome = Outcome::default();
    let worst = worst_over_laws(
        names,
        |spec, numbers| turned::<2>(spec, numbers, true),
        |spec, numbers| turned::<3>(spec, numbers, true),
    )?;
    outcome.at_most("largest |W(AQ) − W(A)|/W(A)", worst, 1e-11, ROUNDING);
    // By a quarter turn the grid comes onto itself, and no other rotation is exact on it.
    let grid = Grid::<2>::dyadic(4);
    let ones = vec![1.0; grid.n_nodes()];
    let mut on_fields = 0.0f64;
    for name in names {
        let spec = law(name, 1.3, 0.8)?;
        // A strong deformation, that linear elasticity sees turned.
        let strong = |x: [f64; 2]| {
            let y = smooth(x);
            [1.4 * y[0] + 0.5 * y[1], y[1]]
        };
        let plain = elastic_energy(&spec, 0.0, &displacement(grid, strong), &ones)?;
        let u = displacement(grid, |[x, y]| strong([1.0 - y, x]));
        let found = elastic_energy(&spec, 0.0, &u, &ones)?;
        on_fields = on_fields.max((found - plain).abs() / plain);
    }
    outcome.at_most(
        "largest |𝒲[φ∘Q] − 𝒲[φ]|/𝒲[φ] on a grid, quarter turn",
        on_fields,
        1e-11,
        "rounding: the quadrature points come onto each other",
    );
    Ok(outcome)
}

fn linear_rotation(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("linear", 1.3, 0.8)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let (mut off, mut in_space, mut nothing) = (0.0f64, 0.0f64, 0.0f64);
    let d = 2.0;
    for angle in [0.1, 0.5, 1.0, 2.0, 3.0] {
        let strain = setting.ingredient(f64::cos(angle), angle) - 1.0;
        let expected = strain * strain * (1.3 * d * d / 2.0 + 0.8 * d);
        let plane = minus_identity(&plane_rotation::<2>(0, 1, angle));
        let space = minus_identity(&plane_rotation::<3>(1, 2, angle));
        off = off.max((density(&spec, &plane)? / expected - 1.0).abs());
        in_space = in_space.max((density(&spec, &space)? / expected - 1.0).abs());
        let nonlinear = law("logdet", 1.3, 0.8)?;
        nothing = nothing.max(density(&nonlinear, &plane)?.abs());
        let grid = Grid::<2>::dyadic(3);
        let u = displacement(grid, |[x, y]| {
            let (sin, cos) = angle.sin_cos();
            [cos * x - sin * y, sin * x + cos * y]
        });
        let field = elastic_energy(&spec, 0.0, &u, &vec![1.0; grid.n_nodes()])?;
        off = off.max((field / expected - 1.0).abs());
    }
    outcome.at_most(
        "largest relative difference to the formula, at points and on a field",
        off,
        1e-10,
        "rounding; cos θ − 1 loses three digits at θ = 0.1",
    );
    outcome.at_most(
        "the same for a rotation about an axis in space",
        in_space,
        1e-10,
        "the strain is (cos θ − 1) in the plane of the rotation alone, so that d = 2 there, too",
    );
    outcome.at_most(
        "energy of the same rotations under logdet",
        nothing,
        1e-13,
        "rounding of sums of terms of order one",
    );
    Ok(outcome)
}

fn rest(setting: Setting) -> Result<Outcome, VerifyError> {
    let names: &[&str] = setting.ingredient(&NAMES[..], &["linear"]);
    let mut outcome = Outcome::default();
    let (mut energy, mut stress, mut least) = (0.0f64, 0.0f64, f64::INFINITY);
    let (mut growing, mut folded) = (f64::INFINITY, f64::INFINITY);
    for name in names {
        let spec = law(name, 1.3, 0.8)?;
        let mut numbers = Sequence::new(2);
        for _ in 0..SAMPLES {
            let q = minus_identity(&numbers.rotation::<3>());
            let found = response(&spec, &q, &q)?;
            energy = energy.max(found.value.abs());
            stress = stress.max(norm(&found.stress));
            // Stretches off one by at least a tenth in one direction.
            let a = numbers.stretch::<3>(0.5, 0.9);
            least = least.min(density(&spec, &minus_identity(&a))?);
        }
        let thin = |t: f64| density(&spec, &stretches([t, t, t]));
        growing = growing.min(thin(1e-3)? - thin(1e-2)?);
        folded = folded.min(density(&spec, &stretches([-0.5, 1.0, 1.0]))?);
    }
    outcome.at_most("largest W on rotations", energy, 1e-13, ROUNDING);
    outcome.at_most("largest |W_,A| on rotations", stress, 1e-12, ROUNDING);
    outcome.at_least(
        "least W where all stretches are .9 or less",
        least,
        1e-3,
        "diss of a strain of .1 is .01 or more",
    );
    outcome.at_least(
        "least growth of W from stretches of 1e-2 to 1e-3",
        growing,
        1.0,
        "a logarithm, the slowest barrier of all laws, grows by (μ + λ/2) ln 1000 = 10; \
         the inverse model of logdet as 1/D",
    );
    outcome.at_least(
        "W where det A = −1/2",
        folded,
        1e300,
        "infinite: no deformation folds",
    );
    Ok(outcome)
}

fn consistency(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let mut worst = 0.0f64;
    let pairs = [
        (0.01, 1.0),
        (1.0, 1.0),
        (100.0, 1.0),
        (1.0, 0.05),
        (3.0, 7.0),
    ];
    for name in NAMES {
        for (lambda, mu) in pairs {
            let spec = law(name, lambda, setting.ingredient(1.0, 2.0) * mu)?;
            let moduli = LameModuli { lambda, mu };
            worst = worst.max(inconsistency::<2>(&spec, moduli)?);
            worst = worst.max(inconsistency::<3>(&spec, moduli)?);
        }
    }
    outcome.at_most(
        "largest |W_,AA(1)[B]:B/(2 diss[B]) − 1|, 5 laws, 5 pairs of moduli, 2D and 3D",
        worst,
        1e-10,
        "rounding: coefficients are differences of moduli that differ by a factor of a hundred",
    );
    // From the values alone, along a line.
    let moduli = LameModuli::new(0.01, 1.0)?;
    let spec = law("power", 0.01, setting.ingredient(1.0, 2.0))?;
    let mut numbers = Sequence::new(4);
    let b = numbers.matrix::<3>();
    let expected = 2.0 * dissipation(moduli, &b);
    let points = [0.1, 0.05, 0.025, 0.0125]
        .into_iter()
        .map(|t| {
            let at = |t: f64| density(&spec, &tensor::scale(&b, 0.2 * t));
            let second = (at(t)? + at(-t)?) / (0.04 * t * t);
            Ok((t, second / expected - 1.0))
        })
        .collect::<Result<Vec<_>, VerifyError>>()?;
    outcome.order(
        "|second difference of W(1 + tB)/(2 diss[B]) − 1|",
        "t",
        points,
        2.0,
        0.1,
        "central differences; W(1) = 0",
    );
    Ok(outcome)
}

/// The largest relative difference of `W_,AA(1)[B]:B` to `2 diss[B]`.
fn inconsistency<const D: usize>(spec: &LawSpec, moduli: LameModuli) -> Result<f64, VerifyError> {
    let mut numbers = Sequence::new(3);
    let mut worst = 0.0f64;
    for _ in 0..20 {
        let b = numbers.matrix::<D>();
        let action = response(spec, &tensor::zero(), &b)?.action;
        let expected = 2.0 * dissipation(moduli, &b);
        worst = worst.max((tensor::contract(&action, &b) / expected - 1.0).abs());
    }
    Ok(worst)
}

fn polyconvexity(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let moduli = LameModuli::new(1.3, 0.8)?;
    let worst = if setting.is_broken() {
        let coefficients = PowerCoefficients {
            norm: 1.0,
            cofactor: 0.0,
            compression: 0.5,
        };
        let exponents = PowerExponents {
            norm: 2.0,
            cofactor: 2.0,
            expansion: 3.0,
            compression: 2.0,
        };
        not_convex(&Power::<3>::from_coefficients(coefficients, exponents)?)
    } else {
        let found = [
            not_convex(&LogDet::<2>::new(moduli)?),
            not_convex(&LogDet::<3>::new(moduli)?),
            not_convex(&LogDetBarrier::<3>::new(moduli)?),
            not_convex(&Power::<2>::new(moduli)?),
            not_convex(&Power::<3>::new(moduli)?),
            not_convex(&Inverse::new(LogDet::<3>::new(moduli)?)),
            not_convex(&Inverse::new(Power::<3>::new(moduli)?)),
        ];
        found.into_iter().fold(f64::NEG_INFINITY, f64::max)
    };
    outcome.at_most(
        "largest (Ŵ(middle) − mean of Ŵ)/(|Ŵ| + 1) over 2000 segments",
        worst,
        1e-12,
        "not above zero but for rounding; arguments are independent of each other",
    );
    let seen = LameModuli::new(1.3, setting.ingredient(1.0, 1.1) * 0.8)?;
    let found = [
        apart(&LogDet::<3>::new(moduli)?, &LogDet::<3>::new(seen)?),
        apart(
            &LogDetBarrier::<3>::new(moduli)?,
            &LogDetBarrier::<3>::new(seen)?,
        ),
        apart(&Power::<2>::new(moduli)?, &Power::<2>::new(seen)?),
        apart(&Power::<3>::new(moduli)?, &Power::<3>::new(seen)?),
        apart(
            &Inverse::new(Power::<3>::new(moduli)?),
            &Inverse::new(Power::<3>::new(seen)?),
        ),
    ];
    outcome.at_most(
        "largest |Ŵ(A, cof A, det A) − W(A)|/(W + 1) of five laws",
        found.into_iter().fold(0.0, f64::max),
        1e-10,
        "the same function, up to rounding of its terms",
    );
    Ok(outcome)
}

/// The largest difference between the function of a law and the energy of another.
fn apart<const D: usize>(law: &impl PolyconvexForm<D>, other: &impl PolyconvexForm<D>) -> f64 {
    let mut numbers = Sequence::new(16);
    let mut worst = 0.0f64;
    for _ in 0..100 {
        let a = numbers.stretch::<D>(0.6, 1.6);
        let of = law.polyconvex_value(&a, &tensor::cofactor(&a), tensor::determinant(&a));
        let w: f64 = other.value(&minus_identity(&a));
        worst = worst.max((of - w).abs() / (w + 1.0));
    }
    worst
}

/// Relative height of a function above its chords; positive where it is not convex.
fn not_convex<const D: usize>(law: &impl PolyconvexForm<D>) -> f64 {
    let mut numbers = Sequence::new(5);
    let mut worst = f64::NEG_INFINITY;
    for _ in 0..2000 {
        let [(a, c, d), (b, e, f)] = [0, 1].map(|_| {
            (
                tensor::scale(&numbers.matrix::<D>(), 2.0),
                tensor::scale(&numbers.matrix::<D>(), 2.0),
                numbers.between(0.05, 4.0),
            )
        });
        let half = |x: &Tensor<f64, D>, y: &Tensor<f64, D>| tensor::scale(&tensor::add(x, y), 0.5);
        let ends = [
            law.polyconvex_value(&a, &c, d),
            law.polyconvex_value(&b, &e, f),
        ];
        let middle = law.polyconvex_value(&half(&a, &b), &half(&c, &e), 0.5 * (d + f));
        let size = ends[0].abs() + ends[1].abs() + 1.0;
        worst = worst.max((middle - 0.5 * (ends[0] + ends[1])) / size);
    }
    worst
}

/// `x (1 + |x|^2)`, of a disk about the origin.
const BEND: f64 = 0.6;

fn inverse_model(setting: Setting) -> Result<Outcome, VerifyError> {
    let (direct, named) = (law("logdet", 1.3, 0.8)?, law("inverse:logdet", 1.3, 0.8)?);
    let mut outcome = Outcome::with_law::<2>(named, &[])?;
    let radius = 0.5;
    let gradient = |[x, y]: [f64; 2]| {
        let s = 1.0 + BEND * (x * x + y * y);
        let c = 2.0 * BEND;
        [[s + c * x * x, c * x * y], [c * x * y, s + c * y * y]]
    };
    let mut over_shape = 0.0;
    for (x, w) in disk(16, radius) {
        let h = minus_identity(&gradient(x));
        let value = density(&named, &h)?;
        let volume = setting.ingredient(1.0, 1.0 / tensor::determinant(&gradient(x)));
        over_shape += w * volume * value;
    }
    // On the image, where the inverse deformation is found by Newton's method.
    let mut over_image = 0.0;
    for (y, w) in disk(16, radius * (1.0 + BEND * radius * radius)) {
        let far = y[0].hypot(y[1]);
        let mut r = far;
        for _ in 0..50 {
            r -= (r * (1.0 + BEND * r * r) - far) / (1.0 + 3.0 * BEND * r * r);
        }
        let x = y.map(|y| y * r / far);
        over_image += w * density(&direct, &minus_identity(&inverse(&gradient(x))))?;
    }
    outcome.value(
        "𝒲_inv over the shape/𝒲 of the inverse over the image",
        over_shape / over_image,
        1.0,
        1e-9,
        "two Gauss rules on two disks, exact to 1e-11",
    );
    let mut worst = 0.0f64;
    for base in ["logdet", "power"] {
        let (w, inverted) = (
            law(base, 1.3, 0.8)?,
            law(&format!("inverse:{base}"), 1.3, 0.8)?,
        );
        let mut numbers = Sequence::new(6);
        for _ in 0..50 {
            let b = numbers.matrix::<3>();
            let zero = tensor::zero();
            let difference = tensor::sub(
                &response(&w, &zero, &b)?.action,
                &response(&inverted, &zero, &b)?.action,
            );
            worst = worst.max(norm(&difference));
        }
    }
    outcome.at_most(
        "largest difference of the tangents at the identity",
        worst,
        1e-11,
        "rounding: W_inv,AA(1) = W_,AA(1) where W(1) = 0 and W_,A(1) = 0",
    );
    Ok(outcome)
}
