//! Section 5: displacements that represent stresses, and the metric on them.

use fe_grid::minimise::Silent;
use fe_grid::pullback::Derivatives;
use fe_grid::vector::{axpy, dot, norm};
use fe_grid::{Field, Grid, Tensor, tensor};
use hyperelastic::{LawSpec, cauchy_stress};
use nalgebra::{DMatrix, SymmetricEigen};
use shape_pca::{Average, Compound, Finite, PcaParams, evaluate, object_product};

use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::matrices::{Sequence, minus_identity, norm as size, stretches};
use crate::tools::pointwise::{law, response};
use crate::tools::quadrature::{Rule, around, disk};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "linear-perturbed",
        reference: "Lemma 5.1",
        claim: "The minimiser u of E_k[δ, ·] balances the load: \
                ∫σ[δu]:Dψ = δ∫σ_k:Dψ for all ψ, with the first Piola–Kirchhoff stress of the \
                compound object",
        broken: "the problem is solved with 1.1 times the load, and the work is that of the stress of another object",
        run: perturbed,
    },
    Statement {
        name: "linear-boundary-load",
        reference: "Remark 5.2",
        claim: "∫_S σν·ψ = ∫_O σ:Dψ for a stress without divergence",
        broken: "the stress has a divergence",
        run: |setting| Ok(boundary_load(setting)),
    },
    Statement {
        name: "linear-response",
        reference: "Lemma 5.3",
        claim: "As δ → 0 the nonlinear displacement tends to the solution of \
                ∫C Du:Dψ = ∫σ_k:Dψ, with the first order of δ",
        broken: "the linear problem is that of the object without prestress",
        run: linear_response,
    },
    Statement {
        name: "linear-metric",
        reference: "Remark 5.4",
        claim: "g(u, v) is linear in the loads and positive definite, for the L² product and for the \
                Hessian of the energy",
        broken: "the compound object is compressed by 30 %",
        run: metric,
    },
    Statement {
        name: "linear-minor-symmetry",
        reference: "Lemma 5.3, C",
        claim: "Under prestress C has no minor symmetry: C B:B = −σ:B² for a skew B, not zero",
        broken: "C acts on the symmetric part alone, as Cε:ε has it",
        run: minor_symmetry,
    },
    Statement {
        name: "linear-definiteness",
        reference: "Lemma 5.3, Remark 5.4",
        claim: "Under compression by 20 % C is indefinite: rotations have the curvature of the \
                pressure, σ = −p1",
        broken: "the object is stretched by 20 %",
        run: definiteness,
    },
    Statement {
        name: "misprint-symmetric-strain",
        reference: "Lemma 5.3, Cε[u]:ε[u]",
        claim: "With ε[u] in place of Du the energy of a prestressed object is wrong by more than a \
                tenth; without prestress by nothing",
        broken: "Du is left in place",
        run: symmetric_strain,
    },
];

/// A soft void that still determines what the deformations of the object leave free.
const VOID: f64 = 1e-2;

fn params(prestressed: bool) -> PcaParams {
    PcaParams {
        void_at_rest: false,
        void_stiffness: VOID,
        at_rest: !prestressed,
        ..PcaParams::default()
    }
}

/// Three objects of different size with different deformations. Their stresses do not balance; the
/// balancing forces are kept as a load.
fn objects(grid: Grid<2>) -> Result<Average<2>, VerifyError> {
    weighted_objects(grid, [1.0 / 3.0; 3])
}

/// The same with other weights.
pub(super) fn weighted_objects(
    grid: Grid<2>,
    weights: [f64; 3],
) -> Result<Average<2>, VerifyError> {
    let displacements =
        PHASES.map(|phase| Field::<f64, 2, 2>::from_fn(grid, |x| displacement(phase, x)));
    let indicators = RADII.map(|radius| indicator(grid, radius));
    Ok(Average::new(
        displacements.into(),
        indicators.into(),
        weights.into(),
    )?)
}

/// Radii of the objects.
const RADII: [f64; 3] = [0.25, 0.28, 0.3];
/// Phases of the displacements of the objects.
const PHASES: [f64; 3] = [0.0, 1.3, 2.9];

fn displacement(phase: f64, x: [f64; 2]) -> [f64; 2] {
    let inside: f64 = x.iter().map(|x| 4.0 * x * (1.0 - x)).product();
    std::array::from_fn(|k| {
        let along = x[1 - k] + 0.5 * x[k];
        inside * 0.03 * (4.0 * along + phase * (k + 1) as f64).sin()
    })
}

/// The derivatives of a smooth field by central differences, whose error is 1e-10.
fn gradient_of(field: impl Fn([f64; 2]) -> [f64; 2], x: [f64; 2]) -> Tensor<f64, 2> {
    let t = 1e-5;
    let mut gradient = tensor::zero::<f64, 2>();
    for j in 0..2 {
        let [mut ahead, mut behind] = [x; 2];
        ahead[j] += t;
        behind[j] -= t;
        let (ahead, behind) = (field(ahead), field(behind));
        for i in 0..2 {
            gradient[i][j] = (ahead[i] - behind[i]) / (2.0 * t);
        }
    }
    gradient
}

fn indicator(grid: Grid<2>, radius: f64) -> Field<f64, 2, 1> {
    Field::from_fn(grid, |x| [inside(radius, x)])
}

fn inside(radius: f64, [x, y]: [f64; 2]) -> f64 {
    (0.5 + 8.0 * (radius - (x - 0.5).hypot(y - 0.5))).clamp(0.0, 1.0)
}

/// A virtual displacement of the compound object.
fn virtual_displacement([x, y]: [f64; 2]) -> [f64; 2] {
    [(2.0 * x + y).sin(), x * (3.0 * y).cos()]
}

/// The work of the stress of the first object in a virtual displacement `ψ` of the compound one,
/// `∫((1 − δ)χ + δ)W_,A(Dφ):D(ψ∘φ)`, by Gauss rules and in closed form, without a grid.
fn work_of_stress(spec: &LawSpec) -> Result<f64, VerifyError> {
    let rule = Rule::composite(64, 3, 0.0, 1.0);
    let mut work = 0.0;
    for &(x, weight) in rule.points() {
        for &(y, height) in rule.points() {
            let at = [x, y];
            let u = displacement(PHASES[0], at);
            let h = gradient_of(|x| displacement(PHASES[0], x), at);
            let psi = gradient_of(virtual_displacement, [x + u[0], y + u[1]]);
            let along = tensor::product(&psi, &tensor::add_identity(&h));
            let stiffness = (1.0 - VOID) * inside(RADII[0], at) + VOID;
            let stress = response(spec, &h, &along)?.stress;
            work += weight * height * stiffness * tensor::contract(&stress, &along);
        }
    }
    Ok(work)
}

const HELD: &str =
    "Σσ_kν = 0 on S; where stresses do not balance, their reaction is kept as a load";

fn perturbed(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let objects = objects(grid)?;
    let compound = Compound::new(&objects, &params(true))?;
    let mut outcome =
        Outcome::with_law::<2>(LawSpec::default(), &[Requirement::FrameIndifference])?;
    outcome.note(HELD);
    let load = compound.load(objects.source(0))?;
    let law = LawSpec::default().compile()?;
    let delta = 0.2;
    let small: Vec<f64> = load.iter().map(|f| delta * f).collect();
    let mut solved = small.clone();
    fe_grid::vector::scale(setting.ingredient(1.0, 1.1), &mut solved);
    let (w, _) = Finite::new(&objects, &compound).respond(&solved, &mut Silent)?;
    let at = |w: &[f64], derivatives| {
        let sources = objects.sources();
        evaluate(&grid, &law, VOID, &sources, w, derivatives)
    };
    let mut forces = compound.imbalance().to_vec();
    axpy(1.0, &small, &mut forces);
    let found = at(w.as_slice(), Derivatives::Gradient)?;
    let mut residual = found.gradient;
    axpy(-1.0, &forces, &mut residual);
    compound.rigid().balance(&mut residual);
    let mut balanced = small.clone();
    compound.rigid().balance(&mut balanced);
    let exact = work_of_stress(&LawSpec::default())?;
    let mut points = Vec::new();
    for level in setting.effort(5..=7, 5..=8) {
        let grid = Grid::<2>::dyadic(level);
        let objects = self::objects(grid)?;
        let compound = Compound::new(&objects, &params(true))?;
        let virtual_displacement = Field::<f64, 2, 2>::from_fn(grid, virtual_displacement);
        let work = dot(
            &compound.load(objects.source(setting.ingredient(0, 1)))?,
            virtual_displacement.as_slice(),
        );
        points.push((grid.spacing(), (work / exact - 1.0).abs()));
    }
    outcome.order(
        "|work of the load/∫W_,A(Dφ):D(ψ∘φ) − 1|",
        "h",
        points,
        2.0,
        0.3,
        "bilinear elements; the smooth boundary of the object has kinks of width 1/8",
    );
    outcome.at_most(
        "what is left of the forces over the load",
        norm(&residual) / norm(&balanced),
        1e-3,
        "the minimiser ends where another step promises 1e-10 of the work, its root in forces",
    );
    let energy = |w: &[f64]| -> Result<f64, VerifyError> {
        Ok(at(w, Derivatives::Value)?.value - dot(&forces, w))
    };
    let least = energy(w.as_slice())?;
    let mut gain = f64::INFINITY;
    let mut numbers = Sequence::new(11);
    for _ in 0..20 {
        let [a, b, c] = [0; 3].map(|_| numbers.between(-4.0, 4.0));
        let mut other = Field::<f64, 2, 2>::from_fn(grid, |[x, y]| {
            [1e-3 * (a * x + b * y).sin(), 1e-3 * (c * x - a * y).cos()]
        })
        .into_vec();
        compound.rigid().constrain(&mut other);
        axpy(1.0, w.as_slice(), &mut other);
        gain = gain.min(energy(&other)? - least);
    }
    outcome.at_least(
        "least E_k[w + ψ] − E_k[w] for 20 displacements ψ of 1e-3",
        gain,
        1e-9,
        "positive curvature: 1e-6 times the gradients squared over the object, and more",
    );
    Ok(outcome)
}

/// A stress from Airy's function `sin 2x cos 3y + x^3 y`, which has no divergence, or with one.
fn airy([x, y]: [f64; 2], setting: Setting) -> Tensor<f64, 2> {
    let (s, c) = ((2.0 * x).sin(), (2.0 * x).cos());
    let (t, d) = ((3.0 * y).sin(), (3.0 * y).cos());
    let more = setting.ingredient(0.0, x * x);
    let across = 6.0 * c * t - 3.0 * x * x;
    [
        [-9.0 * s * d + more, across],
        [across, -4.0 * s * d + 6.0 * x * y],
    ]
}

/// The largest divergence of the stress at points of the disk, by central differences.
fn divergence(setting: Setting) -> f64 {
    let t = 1e-4;
    let points = disk(6, 0.7).into_iter().flat_map(|([x, y], _)| {
        let along = [airy([x + t, y], setting), airy([x - t, y], setting)];
        let across = [airy([x, y + t], setting), airy([x, y - t], setting)];
        [0, 1].map(|i| {
            let sum = along[0][i][0] - along[1][i][0] + across[0][i][1] - across[1][i][1];
            (sum / (2.0 * t)).abs()
        })
    });
    points.fold(0.0, f64::max)
}

fn boundary_load(setting: Setting) -> Outcome {
    let radius = 0.7;
    let test = |[x, y]: [f64; 2]| [(x + 2.0 * y).sin() + x, x * y * y + y.cos()];
    let gradient = |[x, y]: [f64; 2]| {
        let c = (x + 2.0 * y).cos();
        [[c + 1.0, 2.0 * c], [y * y, 2.0 * x * y - y.sin()]]
    };
    let inside: f64 = disk(20, radius)
        .into_iter()
        .map(|(x, w)| w * tensor::contract(&airy(x, setting), &gradient(x)))
        .sum();
    let boundary = around(64, |angle| {
        let (sin, cos) = angle.sin_cos();
        let (normal, x) = ([cos, sin], [radius * cos, radius * sin]);
        let (sigma, psi) = (airy(x, setting), test(x));
        let mut work = 0.0;
        for i in 0..2 {
            for k in 0..2 {
                work += sigma[i][k] * normal[k] * psi[i];
            }
        }
        radius * work
    });
    let mut outcome = Outcome::default();
    outcome.condition("−div σ = 0 in O", divergence(setting) < 1e-6);
    outcome.value(
        "∫_S σν·ψ/∫_O σ:Dψ",
        boundary / inside,
        1.0,
        1e-10,
        "two Gauss rules for smooth functions",
    );
    outcome
}

fn linear_response(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let objects = objects(grid)?;
    let compound = Compound::new(&objects, &params(true))?;
    let mut outcome =
        Outcome::with_law::<2>(LawSpec::default(), &[Requirement::FrameIndifference])?;
    outcome.note(HELD);
    let load = compound.load(objects.source(0))?;
    let linear = if setting.is_broken() {
        Compound::new(&objects, &params(false))?.respond(&load)?.0
    } else {
        compound.respond(&load)?.0
    };
    let on_object = |x: &[f64]| dot(x, &object_product(objects.object(), x)).sqrt();
    let finite = Finite::new(&objects, &compound);
    let mut points = Vec::new();
    for delta in [0.2, 0.1, 0.05, 0.025] {
        let small: Vec<f64> = load.iter().map(|f| delta * f).collect();
        let (w, _) = finite.respond(&small, &mut Silent)?;
        let difference: Vec<f64> = w
            .as_slice()
            .iter()
            .zip(&linear)
            .map(|(w, u)| w / delta - u)
            .collect();
        points.push((delta, on_object(&difference) / on_object(&linear)));
    }
    outcome.order(
        "|u_δ − u|/|u| on the object",
        "δ",
        points,
        1.0,
        0.15,
        "the third derivative of W; the next term is of order δ²",
    );
    let curvature = compound.look_for_curvature().least_curvature;
    outcome.at_least(
        "least curvature of the operator, relative",
        curvature,
        1e-2,
        "unique where C is definite, which moderate strains leave it",
    );
    Ok(outcome)
}

fn metric(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let plain = objects(grid)?;
    let objects = if setting.is_broken() {
        let squeezed =
            Field::<f64, 2, 2>::from_fn(grid, |x| x.map(|x| -0.3 * (x - 0.5))).into_vec();
        let displacements = (0..3)
            .map(|_| Field::from_vec(grid, squeezed.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        Average::new(
            displacements,
            plain.indicators().to_vec(),
            vec![1.0 / 3.0; 3],
        )?
    } else {
        plain
    };
    let mut outcome = Outcome::with_law::<2>(LawSpec::default(), &[])?;
    let compound = Compound::new(&objects, &params(true))?;
    // The least eigenvalue that conjugate gradients meet for a rough load, which are Lanczos' method.
    let report = compound.look_for_curvature();
    outcome.at_least(
        "least eigenvalue of the operator, relative to linear elasticity of the same stiffness",
        report.least_curvature,
        1e-2,
        "C is positive definite under moderate stress, and indefinite under strong pressure",
    );
    // Linear in the loads, and no load without a displacement.
    let loads = (0..3)
        .map(|i| compound.load(objects.source(i)))
        .collect::<Result<Vec<_>, _>>()?;
    let mut responses = Vec::new();
    for load in &loads {
        responses.push(compound.respond(load)?.0);
    }
    let mut sum = loads[0].clone();
    axpy(-2.0, &loads[1], &mut sum);
    let mut expected = responses[0].clone();
    axpy(-2.0, &responses[1], &mut expected);
    let mut difference = compound.respond(&sum)?.0;
    axpy(-1.0, &expected, &mut difference);
    outcome.at_most(
        "|u[σ₁ − 2σ₂] − u[σ₁] + 2u[σ₂]|/|u|",
        norm(&difference) / norm(&expected),
        1e-5,
        "the linear systems are solved to 1e-9 of the load, times their condition",
    );
    let product = |u: &[f64], v: &[f64]| dot(u, &object_product(objects.object(), v));
    let gram = DMatrix::from_fn(3, 3, |i, j| product(&responses[i], &responses[j]));
    let values = SymmetricEigen::new(gram).eigenvalues;
    outcome.at_least(
        "least eigenvalue of the L² products of three loads over the largest",
        values.min() / values.max(),
        1e-4,
        "three different loads have three different displacements",
    );
    Ok(outcome)
}

/// `C[B] = D^-1 W_,AA(F)[B F] F^T` and the Cauchy stress, of a homogeneous prestress.
fn prestressed<const D: usize>(
    spec: &LawSpec,
    f: &Tensor<f64, D>,
    b: &Tensor<f64, D>,
) -> Result<(Tensor<f64, D>, Tensor<f64, D>), VerifyError> {
    let h = minus_identity(f);
    let found = response(spec, &h, &tensor::product(b, f))?;
    let action = tensor::product_transposed(&found.action, f);
    let c = tensor::scale(&action, 1.0 / tensor::determinant(f));
    Ok((c, cauchy_stress(&h, &found.stress)))
}

fn minor_symmetry(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = LawSpec::default();
    let mut outcome = Outcome::with_law::<3>(spec, &[Requirement::FrameIndifference])?;
    let mut numbers = Sequence::new(13);
    let mut off = 0.0f64;
    for _ in 0..100 {
        // Stretched in all directions, so that no stress cancels.
        let f = numbers.stretch::<3>(1.1, 1.4);
        let b = numbers.matrix::<3>();
        let skew = tensor::scale(&tensor::sub(&b, &tensor::transpose(&b)), 0.5);
        let seen = if setting.is_broken() {
            tensor::symmetric_part(&skew)
        } else {
            skew
        };
        let (c, sigma) = prestressed(&spec, &f, &seen)?;
        let expected = -tensor::contract(&sigma, &tensor::product(&skew, &skew));
        let scale = size(&sigma) * tensor::contract(&skew, &skew);
        off = off.max((tensor::contract(&c, &seen) - expected).abs() / scale);
    }
    outcome.at_most(
        "largest |C B:B + σ:B²|/(|σ||B|²)",
        off,
        1e-11,
        "an identity for frame-indifferent laws, up to rounding",
    );
    Ok(outcome)
}

fn definiteness(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = LawSpec::default();
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    // 20 % of the area.
    let factor = f64::sqrt(setting.ingredient(0.8, 1.2));
    let f = tensor::diagonal::<f64, 2>(factor);
    let mut matrix = DMatrix::zeros(4, 4);
    let mut stress = 0.0;
    for i in 0..4 {
        let mut unit = tensor::zero::<f64, 2>();
        unit[i / 2][i % 2] = 1.0;
        let (c, sigma) = prestressed(&spec, &f, &unit)?;
        stress = sigma[0][0];
        for j in 0..4 {
            matrix[(i, j)] = c[j / 2][j % 2];
        }
    }
    let least = SymmetricEigen::new(matrix).eigenvalues.min();
    outcome.at_most(
        "least eigenvalue of C, λ = μ = 1",
        least,
        -0.4,
        "indefinite, by nearly half of the shear modulus",
    );
    outcome.value(
        "the same less the Cauchy stress",
        least - stress,
        0.0,
        1e-12,
        "that of a rotation, C B:B = −σ:B² with |B| = 1",
    );
    Ok(outcome)
}

fn symmetric_strain(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    // A displacement of the unit disk that turns as much as it strains.
    let gradient = |[x, y]: [f64; 2]| {
        [
            [0.3 * (x + y).cos(), -1.0 + 0.5 * x],
            [0.6 + 0.4 * y, 0.2 * x],
        ]
    };
    let difference = |f: [f64; 2]| -> Result<f64, VerifyError> {
        let f = tensor::add_identity(&stretches(f));
        let (mut full, mut printed) = (0.0, 0.0);
        for (x, w) in disk(10, 1.0) {
            let b = gradient(x);
            let e = tensor::symmetric_part(&b);
            full += w * tensor::contract(&prestressed(&spec, &f, &b)?.0, &b);
            let seen = setting.ingredient(e, b);
            printed += w * tensor::contract(&prestressed(&spec, &f, &seen)?.0, &seen);
        }
        Ok((printed / full - 1.0).abs())
    };
    outcome.at_least(
        "|∫Cε:ε/∫C Du:Du − 1| under stretches of 1.1 and 0.85",
        difference([1.1, 0.85])?,
        0.1,
        "the curvature of rotations that the printed form leaves out",
    );
    outcome.at_most(
        "the same without prestress",
        difference([1.0, 1.0])?,
        1e-13,
        "minor symmetry of W_,AA(1)",
    );
    Ok(outcome)
}
