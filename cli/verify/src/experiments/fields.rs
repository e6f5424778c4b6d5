//! Averages and medians as the program computes them: their weights, the equation of their field, and
//! the faces of the box.

use std::f64::consts::PI;

use fe_grid::composition::{Interpolant, Matching};
use fe_grid::minimise::Silent;
use fe_grid::{Assembly, Data, Grid, ScalarField, VectorField, vector};
use hyperelastic::cauchy_stress;
use levelset::{BoxEdge, Moments, contour};
use phasefield::{InterfaceLength, LeastMismatch, Mismatch};
use shape_average::{
    AverageParams, AverageResult, BoundaryCondition, Mean, average, cauchy_stress_at_nodes,
    elastic_energy,
};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::averages::close;
use crate::tools::curves::disk_at;
use crate::tools::matrices::stretches;
use crate::tools::pointwise::{density, law, response};
use crate::tools::search::least;
use crate::tools::shapes::{ball, ellipse};

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "average-weights",
        reference: "section 4, weighted averages",
        claim: "The average of two disks with weights λ, 1 − λ has the radius of least \
                Σλ_i|B_i|W(R/r_i), and tends to a disk as its weight tends to one",
        broken: "the weights are exchanged",
        run: weights,
    },
    Statement {
        name: "average-weight-zero",
        reference: "section 4, weighted averages",
        claim: "A shape of weight zero is deformed onto the average of the others, and does not change \
                it",
        broken: "its weight is a third",
        run: weight_zero,
    },
    Statement {
        name: "average-repeated",
        reference: "section 4, (γ/n)ΣF",
        claim: "The average of shapes that are each given twice is their average, with the same \
                energy",
        broken: "γ is twice as large for twice as many shapes",
        run: repeated,
    },
    Statement {
        name: "average-field-equation",
        reference: "section 4, the average for fixed deformations",
        claim: "The field of the average is stationary for (γ/n)ΣF^ε[v∘φ_i, v_i] + μL^ε[v]",
        broken: "the length has twice its weight",
        run: field_equation,
    },
    Statement {
        name: "average-fixed-faces",
        reference: "Theorem 4.7, φ = id on ∂Ω",
        claim: "With the identity on the faces of the box no node of a face moves",
        broken: "the faces are free",
        run: fixed_faces,
    },
    Statement {
        name: "average-stress",
        reference: "Lemma 4.4, σ_i",
        claim: "Cauchy stresses at the nodes tend to those of a smooth deformation with the second \
                order of h",
        broken: "the first Piola–Kirchhoff stresses stand in their place",
        run: stress,
    },
    Statement {
        name: "median-shares",
        reference: "section 4, generalisations; Fletcher, Venkatasubramanian and Joshi",
        claim: "The median of shapes is the average in which the terms of a shape have the share 1/√e \
                of its energy e, in the equations of the field and of every deformation",
        broken: "the shares are 1/e",
        run: median,
    },
    Statement {
        name: "median-outlier",
        reference: "section 4, generalisations; Fletcher, Venkatasubramanian and Joshi",
        claim: "The median of disks, one of them far larger than the others, stays nearer to the others \
                than the average",
        broken: "the mean is arithmetic",
        run: outlier,
    },
];

/// The radius of the average of disks.
fn radius_of(result: &AverageResult<2>) -> Result<f64, VerifyError> {
    let boundary = contour(&result.average_indicator, 0.5, BoxEdge::Open)?;
    Ok((Moments::of_contour(&boundary)?.volume / PI).sqrt())
}

fn weights(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.0, 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let radii = [0.2, 0.28];
    let shapes = radii.map(|r| ball(grid, r));
    let expected = |first: f64| {
        let energy = |radius: f64| {
            let mut sum = 0.0;
            for (r, weight) in radii.into_iter().zip([first, 1.0 - first]) {
                sum += weight * PI * r * r * density(&spec, &stretches([radius / r; 2]))?;
            }
            Ok(sum)
        };
        least(energy, radii[0], radii[1])
    };
    let radius = |first: f64| -> Result<f64, VerifyError> {
        let seen = setting.ingredient([first, 1.0 - first], [1.0 - first, first]);
        let params = AverageParams {
            weights: Some(seen.to_vec()),
            ..close()
        };
        radius_of(&average(&shapes, &params, &mut Silent)?)
    };
    let weights = [0.5, 0.8, 0.9, 0.95, 0.975];
    let found = weights.map(radius).into_iter();
    let found = found.collect::<Result<Vec<_>, _>>()?;
    for k in [0, 1, 3] {
        let first = weights[k];
        outcome.value(
            format!(
                "radius of the average with the weight {first} of the smaller disk, over that of \
                     least energy"
            ),
            found[k] / expected(first)?,
            1.0,
            setting.effort(0.008, 0.004),
            "a twentieth of a spacing; the mismatch yields by as much",
        );
    }
    // Against the average of the weight one, so that the width of the interface cancels.
    let alone = radius(1.0)?;
    let others = weights.iter().zip(&found).skip(1);
    let points: Vec<_> = others.map(|(first, r)| (1.0 - first, r - alone)).collect();
    outcome.order(
        "|R(λ) − R(1)|",
        "1 − λ",
        points,
        1.0,
        0.2,
        "the force of the other disk is of the size of its weight; the next term is a tenth of it at 1 − λ = 0.2",
    );
    Ok(outcome)
}

fn weight_zero(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [
        ellipse(grid, [0.3, 0.2])?,
        ellipse(grid, [0.2, 0.28])?,
        ball(grid, 0.33),
    ];
    let third = setting.ingredient(0.0, 1.0 / 3.0);
    let rest = 0.5 * (1.0 - third);
    let params = AverageParams {
        weights: Some(vec![rest, rest, third]),
        ..close()
    };
    let all = average(&shapes, &params, &mut Silent)?;
    let alone = AverageParams {
        // The mismatch of each shape has the weight that it has among all.
        mismatch_weight: params.mismatch_weight * 2.0 / 3.0,
        length_weight: Some(params.resolved_length_weight()),
        weights: None,
        ..params.clone()
    };
    let two = average(&shapes[..2], &alone, &mut Silent)?;
    let mut outcome = Outcome::default();
    let mut off = 0.0f64;
    for (a, b) in all.average.as_slice().iter().zip(two.average.as_slice()) {
        off = off.max((a - b).abs());
    }
    outcome.at_most(
        "largest difference of the field with and without the shape of weight zero",
        off,
        1e-12,
        "the same computation",
    );
    outcome.value(
        "elastic energies of the others, with and without",
        (all.energy.elastic[0] + all.energy.elastic[1])
            / (two.energy.elastic[0] + two.energy.elastic[1]),
        1.0,
        1e-12,
        "the same computation",
    );
    outcome.at_least(
        "overlap of the shape of weight zero with the average",
        all.dice[2],
        setting.ingredient(0.99, 1.1),
        "it is deformed onto it to a part of a spacing",
    );
    Ok(outcome)
}

fn repeated(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [ellipse(grid, [0.3, 0.2])?, ellipse(grid, [0.2, 0.28])?];
    let twice = [0, 1, 0, 1].map(|i| shapes[i].clone());
    let params = AverageParams {
        length_weight: Some(1e-3),
        ..close()
    };
    let once = average(&shapes, &params, &mut Silent)?;
    let params = AverageParams {
        mismatch_weight: setting.ingredient(1.0, 2.0) * params.mismatch_weight,
        ..params
    };
    let twice = average(&twice, &params, &mut Silent)?;
    let mut outcome = Outcome::default();
    outcome.value(
        "energy of the average of four, over that of two",
        twice.energy.total / once.energy.total,
        1.0,
        1e-4,
        "minimised to 1e-6 of the excess, from the same start",
    );
    let elastic = |result: &AverageResult<2>| result.energy.elastic[..2].iter().sum::<f64>();
    outcome.value(
        "elastic energy of two of the four, over that of two",
        elastic(&twice) / elastic(&once),
        1.0,
        1e-2,
        "the same minimum; energies of its neighbourhood are flat",
    );
    Ok(outcome)
}

/// Mismatch of a shape of a result with a field.
fn mismatch(
    result: &AverageResult<2>,
    shape: usize,
    v: &ScalarField<f64, 2>,
    displacement: &[f64],
) -> Result<f64, VerifyError> {
    let grid = *v.grid();
    let density = Mismatch {
        interface_width: result.shapes.interface_width(),
        scale: 1.0,
    };
    let coefficients = [result.shapes.phase_fields[shape].as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let law = Matching::new(density, Interpolant::new(grid, v.as_slice()));
    Ok(Assembly::<_, f64, 2, 2>::new(grid, &law, data).value(displacement)?)
}

/// The largest slope of `Σ s_i F[v∘φ_i, v_i] + μ L[v]` at the field of a result, relative to that of
/// its parts: zero where the field solves its equation. The function is quadratic, and central
/// differences are exact.
fn field_residual(
    result: &AverageResult<2>,
    shares: &[f64],
    length_weight: f64,
) -> Result<f64, VerifyError> {
    let grid = *result.average.grid();
    let length = InterfaceLength {
        interface_width: result.shapes.interface_width(),
    };
    let mut worst = 0.0f64;
    for (a, b) in [(3.0, 2.0), (7.0, -4.0), (1.0, 11.0)] {
        let psi = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| [(a * x + b * y).sin()]);
        let slope = |f: &dyn Fn(&ScalarField<f64, 2>) -> Result<f64, VerifyError>| {
            let mut ends = [0.0; 2];
            for (end, t) in ends.iter_mut().zip([0.5, -0.5]) {
                let mut v = result.average.clone();
                vector::axpy(t, psi.as_slice(), v.as_mut_slice());
                *end = f(&v)?;
            }
            Ok::<f64, VerifyError>(ends[0] - ends[1])
        };
        let (mut sum, mut sizes) = (0.0, 0.0);
        for (i, share) in shares.iter().enumerate() {
            let u = result.displacements[i].as_slice();
            let part = share * slope(&|v| mismatch(result, i, v, u))?;
            sum += part;
            sizes += part.abs();
        }
        let part = length_weight * slope(&|v| Ok(length.of(&grid, v.as_slice())))?;
        worst = worst.max((sum + part).abs() / (sizes + part.abs()));
    }
    Ok(worst)
}

fn field_equation(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let shapes = [ellipse(grid, [0.3, 0.2])?, ball(grid, 0.27)];
    let params = AverageParams {
        length_weight: Some(0.3),
        // Far from its minimum, at which so large a weight leaves no object.
        max_iterations: 3,
        ..AverageParams::default()
    };
    let result = average(&shapes, &params, &mut Silent)?;
    let gamma = params.mismatch_weight / 2.0;
    let weight = setting.ingredient(1.0, 2.0) * 0.3;
    let mut outcome = Outcome::default();
    outcome.at_most(
        "largest slope of the energy by the field in three directions, over its parts",
        field_residual(&result, &[gamma; 2], weight)?,
        1e-4,
        "the field is solved for to 1e-7; its parts cancel",
    );
    Ok(outcome)
}

fn fixed_faces(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [
        disk_at(grid, [0.4, 0.45], 0.2),
        disk_at(grid, [0.6, 0.55], 0.25),
    ];
    let params = AverageParams {
        boundary: setting.ingredient(BoundaryCondition::Identity, BoundaryCondition::Natural),
        ..AverageParams::default()
    };
    let result = average(&shapes, &params, &mut Silent)?;
    let (mut on_faces, mut inside) = (0.0f64, 0.0f64);
    for u in &result.displacements {
        for node in 0..grid.n_nodes() {
            let x = grid.position(grid.node(node));
            let size = u.at(node)[0].hypot(u.at(node)[1]);
            if x.iter().any(|x| *x == 0.0 || *x == 1.0) {
                on_faces = on_faces.max(size);
            } else {
                inside = inside.max(size);
            }
        }
    }
    let mut outcome = Outcome::default();
    outcome.at_most(
        "largest displacement of a node of a face, over the largest of all",
        on_faces / inside,
        0.0,
        "the faces are held",
    );
    Ok(outcome)
}

fn stress(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.3, 0.8)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let mut points = Vec::new();
    for level in 4..=setting.effort(7, 8) {
        let grid = Grid::<2>::dyadic(level);
        let u = VectorField::<f64, 2>::from_fn(grid, |[x, y]| {
            [
                0.08 * (3.0 * y).sin() + 0.05 * x * x,
                0.06 * (2.0 * x + y).cos(),
            ]
        });
        let found = cauchy_stress_at_nodes(&spec, &u)?;
        let mut worst = 0.0f64;
        for node in 0..grid.n_nodes() {
            let [x, y] = grid.position(grid.node(node));
            if [x, y].iter().any(|x| *x == 0.0 || *x == 1.0) {
                continue;
            }
            let s = -0.06 * (2.0 * x + y).sin();
            let h = [[0.1 * x, 0.24 * (3.0 * y).cos()], [2.0 * s, s]];
            let piola = response(&spec, &h, &h)?.stress;
            let exact = setting.ingredient(cauchy_stress(&h, &piola), piola);
            for i in 0..4 {
                let difference = found[i].as_slice()[node] - exact.as_flattened()[i];
                worst = worst.max(difference.abs());
            }
        }
        points.push((grid.spacing(), worst));
    }
    outcome.order(
        "largest |σ_h − σ| at inner nodes",
        "h",
        points,
        2.0,
        0.15,
        "central differences of the displacement",
    );
    Ok(outcome)
}

/// The smoothing of roots at zero, as a fraction of the reference.
const SMOOTHING: f64 = 0.01;

fn median(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(5, 6));
    let shapes = [ball(grid, 0.2), ball(grid, 0.22), ball(grid, 0.3)];
    let reference = 1e-3;
    let params = AverageParams {
        mean: Mean::Median,
        median_reference: Some(reference),
        // A mismatch that yields, so that it is a part of every energy.
        mismatch_weight: 0.05,
        length_weight: Some(5e-3),
        // With ten times as much a shape may be left a tenth of its slope from equilibrium.
        tolerance: 1e-6,
        ..close()
    };
    let result = average(&shapes, &params, &mut Silent)?;
    let gamma = params.mismatch_weight / 3.0;
    let rest = vec![0.0; 2 * grid.n_nodes()];
    let mut shares = Vec::new();
    for i in 0..3 {
        let least = LeastMismatch {
            interface_width: result.shapes.interface_width(),
        };
        let coefficients = [result.shapes.phase_fields[i].as_slice()];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let field = Interpolant::new(grid, result.average.as_slice());
        let law = Matching::new(least, field);
        let floor = Assembly::<_, f64, 2, 2>::new(grid, &law, data).value(&rest)?;
        let e = result.energy.elastic[i] / 3.0 + gamma * (result.energy.mismatch[i] - floor);
        let ratio = reference / (e + SMOOTHING * reference);
        shares.push(setting.ingredient(ratio.sqrt(), ratio));
    }
    let mut outcome = Outcome::default();
    let of_field: Vec<f64> = shares.iter().map(|s| gamma * s).collect();
    outcome.at_most(
        "largest slope of the energy by the field, over its parts",
        field_residual(&result, &of_field, 5e-3)?,
        0.03,
        "the iteration ends where the sum of roots changes by a thousandth",
    );
    // A further dilation of every deformed shape: both of its terms have the same share.
    let mut worst = 0.0f64;
    for i in 0..3 {
        let dilated = |t: f64| -> Result<[f64; 2], VerifyError> {
            let mut u = result.displacements[i].clone();
            for node in 0..grid.n_nodes() {
                let x = grid.position(grid.node(node));
                let fade = (-((x[0] - 0.5).powi(2) + (x[1] - 0.5).powi(2)) / 0.08).exp();
                for k in 0..2 {
                    u.component_mut(k)[node] += t * fade * (x[k] - 0.5);
                }
            }
            let chi = result.shapes.indicators[i].as_slice();
            let elastic = elastic_energy(&params, &grid, chi, u.as_slice())?;
            Ok([
                elastic,
                mismatch(&result, i, &result.average, u.as_slice())?,
            ])
        };
        let t = 0.01;
        let ([a, b], [c, d]) = (dilated(t)?, dilated(-t)?);
        let slopes = [(a - c) / 3.0, gamma * (b - d)];
        let own = setting.ingredient(1.0, shares[i]);
        let sum = slopes[0] * own + slopes[1];
        worst = worst.max(sum.abs() / (slopes[0].abs() + slopes[1].abs()));
    }
    outcome.at_most(
        "largest slope of λ_iW_i + (γ/n)F_i by a dilation of a deformed shape, over its parts",
        worst,
        0.05,
        "equilibrium of every shape by itself, whatever its share; differences over .01",
    );
    Ok(outcome)
}

fn outlier(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [0.2, 0.2, 0.21, 0.35].map(|r| ball(grid, r));
    let radius = |mean: Mean| -> Result<f64, VerifyError> {
        let params = AverageParams {
            mean,
            ..AverageParams::default()
        };
        radius_of(&average(&shapes, &params, &mut Silent)?)
    };
    let arithmetic = radius(Mean::Arithmetic)?;
    let median = radius(setting.ingredient(Mean::Median, Mean::Arithmetic))?;
    let mut outcome = Outcome::default();
    outcome.at_most(
        "distance of the median from the radius of most disks, over that of the average",
        (median - 0.2).abs() / (arithmetic - 0.2),
        0.5,
        "the share of the outlier is the root of a ratio of energies of some hundreds",
    );
    Ok(outcome)
}
