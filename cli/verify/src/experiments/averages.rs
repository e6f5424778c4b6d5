//! The average: balance of its forces, the inverse model, and the limit of the hard constraint.

use std::f64::consts::PI;

use fe_grid::minimise::Silent;
use fe_grid::pullback::Derivatives;
use fe_grid::{Grid, ScalarField, vector};
use hyperelastic::LawSpec;
use levelset::{BoxEdge, Moments, contour};
use shape_average::{AverageParams, AverageResult, average, cauchy_stress_at_nodes};
use shape_pca::{Average, Compound, PcaParams, Source, evaluate, object_product, representation};

use crate::error::VerifyError;
use crate::outcome::{Outcome, Requirement};
use crate::statement::{Setting, Statement};
use crate::tools::matrices::stretches;
use crate::tools::pointwise::{density, law};
use crate::tools::search::least;
use crate::tools::shapes::{ball, ellipse};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "average-force-balance",
        reference: "Lemma 4.4",
        claim: "The Cauchy stresses of all deformations onto a computed average add up to zero, up to \
                the width of the interface",
        broken: "the first Piola–Kirchhoff stresses stand in the place of Cauchy's",
        run: force_balance,
    },
    Statement {
        name: "average-equilibrium",
        reference: "Lemma 4.4",
        claim: "Inside of the shapes −div W_,A(Dφ_i) = 0, and on the boundary the loads of all \
                shapes add up to what the mismatch and the length hold",
        broken: "the deformations are not those of the minimiser, but bent by a hundredth",
        run: equilibrium,
    },
    Statement {
        name: "average-inverse",
        reference: "Definition 4.5",
        claim: "The averages of a law and of its inverse model differ by the second power of the \
                strain",
        broken: "the inverse model lacks the factor det Dφ",
        run: inverse_average,
    },
    Statement {
        name: "average-hard-constraint",
        reference: "Definition 4.6, γ → ∞",
        claim: "As γ → ∞ the deformed shapes come together with the first order of 1/γ",
        broken: "γ does not grow",
        run: hard_constraint,
    },
];

/// Radii of concentric balls that are averaged.
const RADII: [f64; 3] = [0.16, 0.2, 0.29];

fn volume<const D: usize>(radius: f64) -> f64 {
    let unit = if D == 2 { PI } else { 4.0 / 3.0 * PI };
    unit * radius.powi(D as i32)
}

fn force_balance(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.3, 0.8)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    let params = AverageParams {
        law: spec,
        interface_cells: 1.0,
        length_weight: Some(1e-6),
        tolerance: 2e-5,
        max_iterations: 400,
        ..AverageParams::default()
    };
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let shapes = RADII.map(|radius| ball(grid, radius));
    let result = average(&shapes, &params, &mut Silent)?;
    outcome.at_most(
        "|Σσ_i|/Σ|σ_i| inside of the average of three balls",
        imbalance(&spec, &shapes, &result, setting)?,
        setting.effort(0.015, 0.008),
        "a share of 2e-5 of the energy that the minimiser leaves is .0045 of forces, its root, on any \
         grid; the width of the interface adds as much where it is a sixth of a radius",
    );
    Ok(outcome)
}

/// The sum of the mean normal stresses of disks, relative to their sizes. They are homogeneous inside,
/// and so the same as on the boundary.
fn imbalance(
    spec: &LawSpec,
    shapes: &[ScalarField<f64, 2>],
    result: &AverageResult<2>,
    setting: Setting,
) -> Result<f64, VerifyError> {
    let (mut sum, mut sizes) = (0.0, 0.0);
    for (shape, displacement) in shapes.iter().zip(&result.displacements) {
        let stress = cauchy_stress_at_nodes(spec, displacement)?;
        let grid = shape.grid();
        let (mut mean, mut count) = (0.0, 0.0);
        for node in 0..grid.n_nodes() {
            if shape.as_slice()[node] > 4.0 * grid.spacing() {
                mean += 0.5 * (stress[0].as_slice()[node] + stress[3].as_slice()[node]);
                count += 1.0;
            }
        }
        // The first Piola–Kirchhoff stress of a dilation is that of Cauchy times the dilation.
        let boundary = contour(&result.average_indicator, 0.5, BoxEdge::Open)?;
        let size = Moments::of_contour(&boundary)?.volume;
        let own = contour(shape, 0.0, BoxEdge::Open)?;
        let dilation = (size / Moments::of_contour(&own)?.volume).sqrt();
        let normal = mean / count * setting.ingredient(1.0, dilation);
        sum += normal;
        sizes += normal.abs();
    }
    Ok(sum.abs() / sizes)
}

fn equilibrium(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = LawSpec::default();
    let mut outcome = Outcome::with_law::<2>(spec, &[Requirement::FrameIndifference])?;
    let grid = Grid::<2>::dyadic(setting.effort(6, 7));
    let [inside, sum] = unbalanced(setting, &spec, grid)?;
    outcome.at_most(
        "root of the forces squared farther than 6ε inside, over that of all",
        inside,
        0.003,
        "forces act where shapes are matched, on their boundary; a share of 2e-6 of the energy that the \
         minimiser leaves is .0014 of forces, its root",
    );
    outcome.at_most(
        "|Σu_i|/Σ|u_i| of the displacements that the stresses make of the average",
        sum,
        0.06,
        "zero where Σσ_iν = 0; the phase fields hold .039 to .046, on 33² nodes as on 129², as their width is \
         one spacing on each",
    );
    Ok(outcome)
}

/// What is left of the forces inside of the shapes of an average, over all of them, and of the
/// displacements that the loads of all shapes make of the average, over their sizes.
fn unbalanced(setting: Setting, spec: &LawSpec, grid: Grid<2>) -> Result<[f64; 2], VerifyError> {
    let shapes = [ellipse(grid, [0.3, 0.2])?, ellipse(grid, [0.2, 0.28])?];
    let params = AverageParams {
        interface_cells: 1.0,
        length_weight: Some(1e-5),
        tolerance: 2e-6,
        max_iterations: 400,
        ..AverageParams::default()
    };
    let mut result = average(&shapes, &params, &mut Silent)?;
    let n = grid.n_nodes();
    if setting.is_broken() {
        for displacement in &mut result.displacements {
            for (node, u) in displacement.component_mut(0).iter_mut().enumerate() {
                *u += 0.01 * (12.0 * grid.position(grid.node(node))[1]).sin();
            }
        }
    }
    let law = spec.compile()?;
    let zero = vec![0.0; 2 * n];
    // The pull of the mismatch has decayed to exp(-3) there.
    let reach = 6.0 * params.interface_cells * grid.spacing();
    let (mut inside, mut all) = (0.0, 0.0);
    for (i, displacement) in result.displacements.iter().enumerate() {
        let source = Source {
            weight: 1.0,
            displacement: &zero,
            indicator: result.shapes.indicators[i].as_slice(),
        };
        let state = displacement.as_slice();
        let gradient = Derivatives::Gradient;
        let delta = params.void_stiffness;
        let found = evaluate(&grid, &law, delta, &[source], state, gradient)?;
        for (node, d) in shapes[i].as_slice().iter().enumerate() {
            let force = found.gradient[node].powi(2) + found.gradient[n + node].powi(2);
            all += force;
            if *d > reach {
                inside += force;
            }
        }
    }
    let weights = params.resolved_weights(result.displacements.len());
    let objects = Average::new(
        result.displacements.clone(),
        result.shapes.indicators.clone(),
        weights,
    )?;
    let compound = Compound::new(&objects, &PcaParams::default())?;
    let product = |u: &[f64]| vector::dot(u, &object_product(objects.object(), u)).sqrt();
    let (mut sum, mut sizes) = (zero.clone(), 0.0);
    for i in 0..objects.n_shapes() {
        let u = representation(&compound, objects.source(i))?.0;
        vector::axpy(1.0, u.as_slice(), &mut sum);
        sizes += product(u.as_slice());
    }
    Ok([(inside / all).sqrt(), product(&sum) / sizes])
}

fn inverse_average(setting: Setting) -> Result<Outcome, VerifyError> {
    let direct = law("logdet", 2.0, 1.0)?;
    let inverse = law("inverse:logdet", 2.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(inverse, &[Requirement::StressFree])?;
    let mut points = Vec::new();
    for strain in [0.2, 0.1, 0.05, 0.025] {
        let radii = [0.25 * (1.0 - strain), 0.25 * (1.0 + strain)];
        let average = |spec: &LawSpec, without: bool| {
            let energy = |radius: f64| {
                let mut sum = 0.0;
                for r in radii {
                    let q = radius / r;
                    let w = density(spec, &stretches([q; 2]))?;
                    sum += volume::<2>(r) * if without { w / (q * q) } else { w };
                }
                Ok(sum)
            };
            least(energy, radii[0], radii[1])
        };
        let difference = average(&inverse, setting.is_broken())? - average(&direct, false)?;
        points.push((strain, difference / 0.25));
    }
    let coefficient = points[3].1 / (points[3].0 * points[3].0);
    let remainders = points
        .iter()
        .map(|(s, off)| (*s, off / (s * s) - 1.0 / 3.0));
    outcome.order(
        "|(R_inverse − R)/(0.25 s²) − 1/3|, two disks of radii 0.25(1 ± s)",
        "s",
        remainders.collect(),
        2.0,
        0.15,
        "the moduli are the same, third derivatives are not; the next term is of the fourth power",
    );
    outcome.value(
        "(R_inverse − R)/(0.25 s²) at s = 0.025",
        coefficient,
        1.0 / 3.0,
        0.01,
        "(λ−μ)/(λ+μ) by expansion of both energies to the third order; λ/μ = 2. It is zero for \
         λ = μ",
    );
    Ok(outcome)
}

fn hard_constraint(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = LawSpec::default();
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let radii = [0.2, 0.28];
    let shapes = radii.map(|radius| ball(grid, radius));
    let mut points = Vec::new();
    let mut last = f64::NAN;
    for gamma in [0.125, 0.25, 0.5, 1.0, 2.0] {
        let params = AverageParams {
            mismatch_weight: setting.ingredient(gamma, 0.5),
            length_weight: Some(1e-5),
            tolerance: 2e-5,
            max_iterations: 400,
            ..AverageParams::default()
        };
        let result = average(&shapes, &params, &mut Silent)?;
        let found = deformed_radii(&result)?;
        points.push((1.0 / gamma, found[1] - found[0]));
        last = 0.5 * (found[0] + found[1]);
    }
    let hard = least(
        |radius| {
            let mut sum = 0.0;
            for r in radii {
                sum += volume::<2>(r) * density(&spec, &stretches([radius / r; 2]))?;
            }
            Ok(sum)
        },
        radii[0],
        radii[1],
    )?;
    outcome.order(
        "difference of the radii of the deformed disks",
        "1/γ",
        points,
        1.0,
        0.35,
        "a force of fixed size against a penalty; the phase field that both share is of the width \
         of their distance at small γ",
    );
    outcome.value(
        "radius of the average at the largest γ, in spacings from that of the hard constraint",
        (last - hard) / grid.spacing(),
        0.0,
        0.2,
        "the constrained problem in closed form; what is left is the width of the interface",
    );
    Ok(outcome)
}

/// The radii of the disks as deformed.
fn deformed_radii(result: &AverageResult<2>) -> Result<Vec<f64>, VerifyError> {
    let radius = |d: &ScalarField<f64, 2>| -> Result<f64, VerifyError> {
        let outline = contour(d, 0.0, BoxEdge::Closed)?;
        Ok((Moments::of_contour(&outline)?.volume / PI).sqrt())
    };
    result.pushed.iter().map(radius).collect()
}
