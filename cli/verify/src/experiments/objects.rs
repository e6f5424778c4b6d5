//! Analyses of objects whose displacements and modes have a closed form: disks that are dilated onto
//! one.

use std::f64::consts::PI;

use fe_grid::minimise::Silent;
use fe_grid::vector::dot;
use fe_grid::{Field, Grid, tensor};
use hyperelastic::LawSpec;
use shape_pca::{
    Average, Compound, Finite, Metric, Pca, PcaParams, object_product, representation,
};

use super::linear::weighted_objects;
use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::matrices::stretches;
use crate::tools::pointwise::{law, response};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "linear-dilation",
        reference: "Lemma 5.3",
        claim: "The displacement that the stress of a dilated disk makes of the compound disk is the \
                dilation of the ratio of both derivatives of the energies",
        broken: "the loads are those of the next disk",
        run: dilation,
    },
    Statement {
        name: "linear-rigid-motions",
        reference: "section 5, rigid body motions",
        claim: "Displacements have no mean and no mean rotation on the object, and forces and moments \
                of the loads do not matter",
        broken: "a translation is added afterwards",
        run: rigid_motions,
    },
    Statement {
        name: "modes-dilation",
        reference: "section 5, principal modes",
        claim: "The only mode of disks that are dilated onto one is the dilation, with the variance \
                Σλ_i(a_i − a)²∫|x|²",
        broken: "the disks have other weights",
        run: dilation_mode,
    },
    Statement {
        name: "modes-orthonormal",
        reference: "section 5, covariance",
        claim: "Modes are orthonormal in the product of the analysis, for L² and for the Hessian",
        broken: "they are tried with the product of the other",
        run: orthonormal,
    },
    Statement {
        name: "modes-centred",
        reference: "section 5, Σu_k = 0",
        claim: "The weighted sum of the displacements is zero: exactly for linear responses to stresses that \
                balance, and to the first order of the stresses for the nonlinear ones",
        broken: "it is the sum with equal weights",
        run: centred,
    },
];

/// Dilations `x → (1 + s)x` of disks onto the disk of this radius.
const DILATIONS: [f64; 3] = [-0.12, 0.03, 0.2];
const WEIGHTS: [f64; 3] = [0.5, 0.3, 0.2];
const RADIUS: f64 = 0.25;

fn disks(grid: Grid<2>, weights: [f64; 3]) -> Result<Average<2>, VerifyError> {
    let displacements =
        DILATIONS.map(|s| Field::<f64, 2, 2>::from_fn(grid, |x| x.map(|x| s * (x - 0.5))));
    let indicators = DILATIONS.map(|s| {
        let radius = RADIUS / (1.0 + s);
        Field::<f64, 2, 1>::from_fn(grid, |[x, y]| {
            let distance = radius - (x - 0.5).hypot(y - 0.5);
            [(0.5 + (1.0 + s) * distance / (4.0 * grid.spacing())).clamp(0.0, 1.0)]
        })
    });
    Ok(Average::new(
        displacements.into(),
        indicators.into(),
        weights.into(),
    )?)
}

/// First and second derivative of `|B| W((1 + s)(1 + a))` by `a`, of the undeformed disk `B`.
fn stiffness(spec: &LawSpec, s: f64) -> Result<[f64; 2], VerifyError> {
    let h = stretches([1.0 + s; 2]);
    let direction = tensor::diagonal(1.0 + s);
    let found = response(spec, &h, &direction)?;
    let area = PI * (RADIUS / (1.0 + s)).powi(2);
    Ok([
        area * tensor::contract(&found.stress, &direction),
        area * tensor::contract(&found.action, &direction),
    ])
}

/// The dilations that the loads of the disks make.
fn exact(spec: &LawSpec, weights: [f64; 3]) -> Result<[f64; 3], VerifyError> {
    let (mut total, mut loads) = (0.0, [0.0; 3]);
    for i in 0..3 {
        let [first, second] = stiffness(spec, DILATIONS[i])?;
        loads[i] = first;
        total += weights[i] * second;
    }
    Ok(loads.map(|load| load / total))
}

/// The dilation of a displacement: the mean of `u·x/|x|²`, weighted by the object.
fn dilation_of(object: &Field<f64, 2, 1>, u: &[f64]) -> f64 {
    let position = position(*object.grid());
    let moment = object_product(object, &position);
    dot(&moment, u) / dot(&moment, &position)
}

fn position(grid: Grid<2>) -> Vec<f64> {
    Field::<f64, 2, 2>::from_fn(grid, |x| x.map(|x| x - 0.5)).into_vec()
}

fn dilation(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let spec = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    let objects = disks(grid, WEIGHTS)?;
    let compound = Compound::new(&objects, &PcaParams::default())?;
    let expected = exact(&spec, WEIGHTS)?;
    for (i, expected) in expected.into_iter().enumerate() {
        let source = objects.source(setting.ingredient(i, (i + 1) % 3));
        let u = representation(&compound, source)?.0;
        let found = dilation_of(objects.object(), u.as_slice());
        outcome.value(
            format!(
                "dilation by the load of the disk that was stretched by {}",
                1.0 + DILATIONS[i]
            ),
            found / expected,
            1.0,
            0.01,
            "homogeneous inside but for the smooth boundary and the void of 1e-4",
        );
    }
    Ok(outcome)
}

fn dilation_mode(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let spec = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    let seen = setting.ingredient(WEIGHTS, [1.0 / 3.0; 3]);
    let objects = disks(grid, seen)?;
    let compound = Compound::new(&objects, &PcaParams::default())?;
    let pca = Pca::new(&objects, &compound, usize::MAX, &mut Silent)?;
    let dilations = exact(&spec, WEIGHTS)?;
    let mean: f64 = dilations.iter().zip(WEIGHTS).map(|(a, w)| w * a).sum();
    let variance: f64 = dilations
        .iter()
        .zip(WEIGHTS)
        .map(|(a, w)| w * (a - mean).powi(2))
        .sum();
    // The smooth boundary has the variance w²/12 of its width of four spacings.
    let variance_of_boundary = 16.0 / 12.0 * grid.spacing().powi(2);
    let moment = 0.5 * PI * RADIUS.powi(4) * (1.0 + 6.0 * variance_of_boundary / RADIUS.powi(2));
    outcome.value(
        "Λ₁/(Σλ_i(a_i − a)² πR⁴/2)",
        pca.modes.eigenvalues[0] / (variance * moment),
        1.0,
        0.02,
        "the fourth moment of a disk with a smooth boundary; dilations are exact to a hundredth",
    );
    outcome.at_most(
        "Λ₂/Λ₁",
        pca.modes.eigenvalues[1] / pca.modes.eigenvalues[0],
        1e-4,
        "all displacements are the same but for their size and the layer at the boundary",
    );
    Ok(outcome)
}

fn rigid_motions(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let objects = weighted_objects(grid, WEIGHTS)?;
    let compound = Compound::new(&objects, &PcaParams::default())?;
    let mut outcome = Outcome::default();
    let object = objects.object();
    let load = compound.load(objects.source(0))?;
    let n = grid.n_nodes();
    let motion = |f: fn([f64; 2]) -> [f64; 2]| Field::<f64, 2, 2>::from_fn(grid, f).into_vec();
    let motions = [
        motion(|_| [1.0, 0.0]),
        motion(|_| [0.0, 1.0]),
        motion(|[x, y]| [0.5 - y, x - 0.5]),
    ];
    // The same load with forces and a moment on the object.
    let mut pulled = load.clone();
    let share = dot(&load, &load).sqrt();
    for r in &motions {
        fe_grid::vector::axpy(share, &object_product(object, r), &mut pulled);
    }
    let mut u = compound.respond(&load)?.0;
    let other = compound.respond(&pulled)?.0;
    let size = dot(&u, &object_product(object, &u)).sqrt();
    for x in &mut u[..n] {
        *x += setting.ingredient(0.0, 1e-3 * size);
    }
    let mut worst = 0.0f64;
    for r in &motions {
        let z = object_product(object, r);
        worst = worst.max(dot(&z, &u).abs() / (size * dot(&z, r).sqrt()));
    }
    outcome.at_most(
        "largest product of u with a translation or rotation on the object, relative",
        worst,
        1e-10,
        "the constraints, up to rounding",
    );
    let difference: Vec<f64> = u.iter().zip(&other).map(|(u, v)| u - v).collect();
    outcome.at_most(
        "change of u by a force and a moment added to the load, relative",
        dot(&difference, &object_product(object, &difference)).sqrt() / size,
        1e-5,
        "the constraints take both up; the linear systems are solved to 1e-9",
    );
    Ok(outcome)
}

fn orthonormal(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let objects = weighted_objects(grid, WEIGHTS)?;
    let mut outcome = Outcome::default();
    for (metric, name) in [(Metric::L2, "L²"), (Metric::Hessian, "Hessian")] {
        let params = PcaParams {
            metric,
            ..PcaParams::default()
        };
        let compound = Compound::new(&objects, &params)?;
        let pca = Pca::new(&objects, &compound, usize::MAX, &mut Silent)?;
        let by_hessian = setting.ingredient(metric == Metric::Hessian, metric == Metric::L2);
        let mut worst = 0.0f64;
        for (i, y) in pca.space.fields.iter().enumerate() {
            let dual = if by_hessian {
                compound.apply(y.as_slice())
            } else {
                object_product(objects.object(), y.as_slice())
            };
            for (j, z) in pca.space.fields.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                worst = worst.max((dot(&dual, z.as_slice()) - expected).abs());
            }
        }
        outcome.at_most(
            format!(
                "largest |g(y_i, y_j) − δ_ij| of {} modes, {name}",
                pca.modes.rank()
            ),
            worst,
            1e-7,
            "rounding, divided by the ratio of the variances",
        );
    }
    Ok(outcome)
}

fn centred(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(4, 5));
    let objects = weighted_objects(grid, WEIGHTS)?;
    let compound = Compound::new(&objects, &PcaParams::default())?;
    let pca = Pca::new(&objects, &compound, usize::MAX, &mut Silent)?;
    let product = |u: &[f64]| dot(u, &object_product(objects.object(), u)).sqrt();
    let weights = setting.ingredient(WEIGHTS, [1.0 / 3.0; 3]);
    let off_centre = |displacements: &[&[f64]]| {
        let mut sum = vec![0.0; 2 * grid.n_nodes()];
        let mut sizes = 0.0;
        for (u, weight) in displacements.iter().zip(weights) {
            fe_grid::vector::axpy(weight, u, &mut sum);
            sizes += weight * product(u);
        }
        product(&sum) / sizes
    };
    let displacements: Vec<&[f64]> = pca.displacements.iter().map(Field::as_slice).collect();
    let mut outcome = Outcome::default();
    outcome.at_most(
        "|Σλ_ku_k|/Σλ_k|u_k| of displacements whose stresses do not balance",
        off_centre(&displacements),
        1e-12,
        "the mean is taken out, up to rounding",
    );
    let mut loads = (0..WEIGHTS.len())
        .map(|k| compound.load(objects.source(k)))
        .collect::<Result<Vec<_>, _>>()?;
    let mut mean = vec![0.0; loads[0].len()];
    for (load, weight) in loads.iter().zip(WEIGHTS) {
        fe_grid::vector::axpy(weight, load, &mut mean);
    }
    for load in &mut loads {
        fe_grid::vector::axpy(-1.0, &mean, load);
    }
    let mut linear = Vec::new();
    for load in &loads {
        linear.push(compound.respond(load)?.0);
    }
    outcome.at_most(
        "the same of linear responses to stresses that balance",
        off_centre(&linear.iter().map(Vec::as_slice).collect::<Vec<_>>()),
        1e-6,
        "linear in the loads; the systems are solved to 1e-9 of the load, times their condition",
    );
    let finite = Finite::new(&objects, &compound);
    let mut points = Vec::new();
    for share in [0.2, 0.1, 0.05, 0.025] {
        let mut responses = Vec::new();
        for load in &loads {
            let small: Vec<f64> = load.iter().map(|f| share * f).collect();
            responses.push(finite.respond(&small, &mut Silent)?.0);
        }
        let responses: Vec<&[f64]> = responses.iter().map(Field::as_slice).collect();
        points.push((share, off_centre(&responses)));
    }
    outcome.order(
        "the same of nonlinear responses to a share s of these stresses",
        "s",
        points,
        1.0,
        0.15,
        "the third derivative of W; the next term is of order s²",
    );
    Ok(outcome)
}
