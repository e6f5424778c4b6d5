//! Phase fields as the program computes them, in the limit of thin interfaces.

use std::f64::consts::{FRAC_PI_2, PI};

use fe_grid::composition::{Interpolant, MatchDensity, Matching};
use fe_grid::minimise::Silent;
use fe_grid::scatter::{NormalEquations, Source};
use fe_grid::stencil::Background;
use fe_grid::vector::dot;
use fe_grid::{
    Assembly, CgParams, CgScratch, Data, Diagonal, Grid, GridError, LinearOperator, ScalarField,
    VectorField, conjugate_gradient,
};
use phasefield::segmentation::{SegmentationParams, Weights, segment};
use phasefield::{ElasticWeight, InterfaceLength, LeastMismatch, Mismatch, Profile};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::curves::rectangle;
use crate::tools::derivatives::against_differences;
use crate::tools::fields::{displacement, elastic_energy};
use crate::tools::matrices::stretches;
use crate::tools::pointwise::{density, law};
use crate::tools::shapes::ball;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "phase-length-limit",
        reference: "section 4, L^ε",
        claim: "L^ε of the profile 1 − exp(−|d|/(2ε)) of a closed curve tends to its length, with the \
                first order of ε at corners, and is less than that of profiles with another decay",
        broken: "the profile is that of 1.5 ε",
        run: length_limit,
    },
    Statement {
        name: "phase-mismatch-limit",
        reference: "section 4, F^ε; Definition 4.6",
        claim: "F^ε of two curves tends to 2 H(S △ S′) + (2/3) H(S ∩ S′), with the first order of ε",
        broken: "the second curve is drawn with 1.5 ε",
        run: mismatch_limit,
    },
    Statement {
        name: "phase-mismatch-flat",
        reference: "section 4, F^ε",
        claim: "Per unit length of a straight edge the mismatch is 2 against nothing, 2/3 against \
                itself, and π/2 − 1 against the best field, not 0",
        broken: "the edge is drawn with 1.1 ε",
        run: mismatch_flat,
    },
    Statement {
        name: "phase-mismatch-gradient",
        reference: "section 4, variations of F^ε",
        claim: "The derivative of F^ε[v∘φ, v_i] by the deformation is that of its values",
        broken: "the derivative is that of 1.1 ε",
        run: mismatch_gradient,
    },
    Statement {
        name: "phase-best-field",
        reference: "section 4, the average for fixed deformations",
        claim: "The field of least Σλ_iF^ε[v, v_i] is Σλ_iv_i²/Σλ_i(v_i² + (1 − v_i)²), with the second \
                order of h, and Σλ_iF^ε is a quadratic form in v with these normal equations",
        broken: "the weights of the shapes are exchanged",
        run: best_field,
    },
    Statement {
        name: "phase-elastic-domain",
        reference: "section 4, χ and δ",
        claim: "The energy of a homogeneous strain W of a disk in a void of stiffness δ is \
                W(δ|Ω| + (1 − δ)π(R² + (4/5)ε²)): the elastic domain has the width 2ε",
        broken: "the domain is drawn with 1.1 ε",
        run: elastic_domain,
    },
    Statement {
        name: "phase-edge-cost",
        reference: "section 4, E_AT",
        claim: "The least energy of Ambrosio and Tortorelli of an image with a step tends to ν a \
                unit of length, whatever the height of the step",
        broken: "edges have the weight 0.8 ν",
        run: edge_cost,
    },
];

/// The terms of the normal equations are known to this share.
const SOLVED: f64 = 1e-12;

fn length_limit(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    let wrong = setting.ingredient(1.0, 1.5);
    // A square whose sides are lines of nodes, so that kinks of the profile stand between cells.
    let grid = Grid::<2>::dyadic(9);
    let square = rectangle(grid, [0.25; 2], [0.75; 2]);
    let mut points = Vec::new();
    for width in [0.04, 0.02, 0.01] {
        let v = Profile::new(wrong * width)?.phase_field(&square);
        let length = InterfaceLength {
            interface_width: width,
        };
        points.push((width, length.of(&grid, v.as_slice()) / 2.0 - 1.0));
    }
    outcome.order(
        "|L^ε/H − 1| of a square",
        "ε",
        points,
        1.0,
        0.15,
        "(4 − π)ε at four corners",
    );
    // The family of other decays: (s + 1/s)/2 of the length.
    let width = 8.0 * grid.spacing();
    let energy = |scale: f64| -> Result<f64, VerifyError> {
        let v = Profile::new(wrong * width / scale)?.phase_field(&square);
        let length = InterfaceLength {
            interface_width: width,
        };
        Ok(length.of(&grid, v.as_slice()))
    };
    let length = 2.0 - (4.0 - PI) * width;
    outcome.value(
        "L^ε/(H − (4 − π)ε) of a square, ε = 8h",
        energy(1.0)? / length,
        1.0,
        5e-3,
        "the length of parallel curves, integrated over the profile; (h/ε)²/6 of the elements",
    );
    for scale in [0.5, 2.0] {
        outcome.value(
            format!("L^ε with {scale} times the decay, over L^ε"),
            energy(scale)? / energy(1.0)?,
            0.5 * (scale + 1.0 / scale),
            0.02,
            "(s + 1/s)/2 on a straight line, least for s = 1; corners and elements change a hundredth",
        );
    }
    Ok(outcome)
}

/// `∫ f(v; c)` of fields on a grid, as the program assembles it.
fn integral<F: MatchDensity>(
    density: F,
    v: &ScalarField<f64, 2>,
    coefficient: &[f64],
    displacement: &[f64],
) -> Result<f64, GridError> {
    let grid = *v.grid();
    let coefficients = [coefficient];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let law = Matching::new(density, Interpolant::new(grid, v.as_slice()));
    Assembly::<_, f64, 2, 2>::new(grid, &law, data).value(displacement)
}

fn mismatch_limit(setting: Setting) -> Result<Outcome, VerifyError> {
    // Half a square, and the square: one side and two halves in common.
    let limit = 2.0 * (0.75 + 0.75 + 0.75) + 2.0 / 3.0 * (0.75 + 0.375 + 0.375);
    let grid = Grid::<2>::dyadic(9);
    let half = rectangle(grid, [0.125, 0.125], [0.5, 0.875]);
    let whole = rectangle(grid, [0.125; 2], [0.875; 2]);
    let rest = vec![0.0; 2 * grid.n_nodes()];
    let mut points = Vec::new();
    for width in [0.02, 0.01, 0.005] {
        let v = Profile::new(width)?.phase_field(&half);
        let w = Profile::new(setting.ingredient(1.0, 1.5) * width)?.phase_field(&whole);
        let mismatch = Mismatch {
            interface_width: width,
            scale: 1.0,
        };
        points.push((width, integral(mismatch, &v, w.as_slice(), &rest)? - limit));
    }
    let extrapolated = 2.0 * points[1].1 - points[0].1 + limit;
    let mut outcome = Outcome::default();
    outcome.order(
        "|F^ε − limit| of a square and its half",
        "ε",
        points,
        1.0,
        0.2,
        "corners and ends of what both have in common",
    );
    outcome.value(
        "F^ε, extrapolated to ε = 0",
        extrapolated,
        limit,
        0.03,
        "from ε = .02 and .01, where elements are a tenth and a fifth of it",
    );
    Ok(outcome)
}

fn mismatch_flat(setting: Setting) -> Result<Outcome, VerifyError> {
    let width = 0.02;
    let mut errors = [const { Vec::new() }; 4];
    for level in 7..=setting.effort(9, 10) {
        let h = 1.0 / f64::from(1u32 << level);
        let grid = Grid::<2>::with_nodes([(1usize << level) + 1, 2], h)?;
        let edge = ScalarField::<f64, 2>::from_fn(grid, |[x, _]| [x - 0.5]);
        let v = Profile::new(setting.ingredient(1.0, 1.1) * width)?.phase_field(&edge);
        let mut best = v.clone();
        for x in best.as_mut_slice() {
            *x = *x * *x / (*x * *x + (1.0 - *x) * (1.0 - *x));
        }
        let nothing = ScalarField::<f64, 2>::from_fn(grid, |_| [1.0]);
        let mismatch = Mismatch {
            interface_width: width,
            scale: 1.0,
        };
        let least = LeastMismatch {
            interface_width: width,
        };
        let rest = vec![0.0; 2 * grid.n_nodes()];
        // The strip has the height of one cell.
        let found = [
            integral(mismatch, &v, nothing.as_slice(), &rest)? - 2.0 * h,
            integral(mismatch, &v, v.as_slice(), &rest)? - 2.0 / 3.0 * h,
            integral(mismatch, &best, v.as_slice(), &rest)? - (FRAC_PI_2 - 1.0) * h,
            integral(least, &v, v.as_slice(), &rest)? - (FRAC_PI_2 - 1.0) * h,
        ];
        for (errors, off) in errors.iter_mut().zip(found) {
            errors.push((h, off / h));
        }
    }
    let mut outcome = Outcome::default();
    let named = [
        "|F − 2| against nothing",
        "|F − 2/3| against itself",
        "|F − (π/2 − 1)| against the best field, v²/(v² + (1−v)²)",
        "|least F − (π/2 − 1)|",
    ];
    for (name, points) in named.into_iter().zip(errors) {
        let (order, reason) = if name.contains("nothing") {
            (
                2.0,
                "the profile in closed form; fields are interpolated, the kink stands on a face",
            )
        } else {
            (
                4.0,
                "∫f′(v)v″ = −∫f′(v)v′/(2ε) is zero where f(1) = f(0): the second order cancels",
            )
        };
        outcome.order(name, "h", points, order, 0.2, reason);
    }
    Ok(outcome)
}

fn mismatch_gradient(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(4);
    let width = 0.1;
    let v = Profile::new(width)?.phase_field(&ball(grid, 0.3));
    let w = Profile::new(width)?.phase_field(&ball(grid, 0.25));
    let of = |width: f64| Mismatch {
        interface_width: width,
        scale: 1.0,
    };
    // Points stay in their cells, where the composed field is smooth.
    let state = VectorField::<f64, 2>::from_fn(grid, |[x, y]| {
        [1e-3 * (3.0 * x + y).sin(), 1e-3 * (x - 2.0 * y).cos()]
    });
    let direction = VectorField::<f64, 2>::from_fn(grid, |[x, y]| [1.0 + y, x * y - 0.3]);
    let coefficients = [w.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let mut gradient = vec![0.0; state.as_slice().len()];
    let law = Matching::new(
        of(setting.ingredient(1.0, 1.1) * width),
        Interpolant::new(grid, v.as_slice()),
    );
    Assembly::<_, f64, 2, 2>::new(grid, &law, data)
        .value_and_gradient_into(state.as_slice(), &mut gradient)?;
    let steps = [4e-3, 2e-3, 1e-3];
    let points = against_differences(
        state.as_slice(),
        direction.as_slice(),
        &gradient,
        &steps,
        |u| Ok(integral(of(width), &v, w.as_slice(), u)?),
    )?;
    let mut outcome = Outcome::default();
    outcome.order(
        "difference of F^ε to its gradient",
        "t",
        points,
        2.0,
        0.1,
        "central differences; quadrature points move by a part of their distance to a face",
    );
    Ok(outcome)
}

fn best_field(setting: Setting) -> Result<Outcome, VerifyError> {
    let width = 0.1;
    let mut outcome = Outcome::default();
    let (mut points, mut off_form) = (Vec::new(), 0.0f64);
    let weights = setting.ingredient([0.8, 0.2], [0.2, 0.8]);
    for level in 5..=setting.effort(7, 8) {
        let grid = Grid::<2>::dyadic(level);
        let profile = Profile::new(width)?;
        // Distances without kinks: lines beside the box.
        let fields = [[0.3, 0.2], [0.1, -0.4]].map(|[a, b]| {
            let line = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
                [0.02 + 0.3 * (x + a * y + b * x * y)]
            });
            profile.phase_field(&line)
        });
        let rest = vec![0.0; 2 * grid.n_nodes()];
        let coefficients = fields.each_ref().map(|v| [v.as_slice()]);
        let sources: Vec<Source<'_, f64>> = coefficients
            .iter()
            .zip(weights)
            .map(|(coefficients, weight)| Source {
                displacement: &rest,
                coefficients,
                weight,
            })
            .collect();
        let rule = Mismatch {
            interface_width: width,
            scale: 1.0,
        };
        let mut equations = NormalEquations::new(grid);
        equations.assemble(&rule, &sources, Background::default(), None);
        let mut v = vec![0.5; grid.n_nodes()];
        let jacobi = Diagonal::jacobi(&equations.matrix().diagonal())?;
        let params = CgParams {
            relative_tolerance: SOLVED,
            max_iterations: 2000,
            ..CgParams::default()
        };
        let mut scratch = CgScratch::default();
        let (matrix, load) = (equations.matrix(), equations.rhs());
        conjugate_gradient(matrix, &jacobi, load, &mut v, &params, &mut scratch)?;
        let mut worst = 0.0f64;
        for (node, v) in v.iter().enumerate() {
            let mut sums = [0.0; 2];
            for (field, weight) in fields.iter().zip([0.8, 0.2]) {
                let w = field.as_slice()[node];
                sums[0] += weight * w * w;
                sums[1] += weight * (w * w + (1.0 - w) * (1.0 - w));
            }
            worst = worst.max((v - sums[0] / sums[1]).abs());
        }
        points.push((grid.spacing(), worst));
        // The quadratic form, at another field.
        let other =
            ScalarField::<f64, 2>::from_fn(grid, |[x, y]| [0.3 + 0.4 * (3.0 * x).sin() * y]);
        let zero = ScalarField::<f64, 2>::zeros(grid);
        let mut direct = 0.0;
        for (field, weight) in fields.iter().zip([0.8, 0.2]) {
            let of = |v| integral(rule, v, field.as_slice(), &rest);
            direct += weight * (of(&other)? - of(&zero)?);
        }
        let mut product = vec![0.0; v.len()];
        matrix.apply_into(other.as_slice(), &mut product);
        let form = dot(&product, other.as_slice()) - 2.0 * dot(load, other.as_slice());
        off_form = off_form.max((form / direct - 1.0).abs());
    }
    outcome.order(
        "largest |v_h − v| at all nodes",
        "h",
        points,
        2.0,
        0.3,
        "a projection of a smooth field on bilinear elements",
    );
    outcome.at_most(
        "largest |v·Av − 2r·v over ΣλF^ε[v] − ΣλF^ε[0] − 1|",
        off_form,
        1e-11,
        "the same quadrature twice, up to rounding",
    );
    Ok(outcome)
}

fn elastic_domain(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 1.0, 1.0)?;
    let (radius, delta) = (0.27, 0.3);
    let factors = [1.2, 0.9];
    let w = density(&spec, &stretches(factors))?;
    let grid = Grid::<2>::dyadic(setting.effort(7, 8));
    let u = displacement(grid, |x| [factors[0] * x[0], factors[1] * x[1]]);
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let width = 0.05;
    let drawn = ElasticWeight::new(setting.ingredient(1.0, 1.1) * width, delta)?;
    let chi = drawn.indicator_field(&ball(grid, radius));
    let found = elastic_energy(&spec, delta, &u, chi.as_slice())?;
    outcome.value(
        "(E/W − δ)/((1 − δ)π) − R² over ε²",
        ((found / w - delta) / ((1.0 - delta) * PI) - radius * radius) / (width * width),
        0.8,
        0.02,
        "the second moment of the derivative of 3s² − 2s³ is w²/5 for the half-width w = 2ε",
    );
    // The weight itself.
    let mut off = 0.0f64;
    for (distance, expected) in [(2.0, 1.0), (0.0, 0.5 * (1.0 + delta)), (-2.0, delta)] {
        off = off.max((drawn.value(distance * width) - expected).abs());
    }
    outcome.at_most(
        "largest error of κ at distances of 2ε, 0 and −2ε",
        off,
        1e-12,
        "1, (1 + δ)/2 and δ",
    );
    Ok(outcome)
}

fn edge_cost(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    for height in [1.0, 2.0] {
        let mut points = Vec::new();
        for level in 6..=setting.effort(8, 9) {
            let h = 1.0 / f64::from(1u32 << level);
            let rows = (1usize << (level - 4)) + 1;
            let grid = Grid::<2>::with_nodes([(1usize << level) + 1, rows], h)?;
            // Half a spacing off a node, so that the step lies in the middle of a cell.
            let image = ScalarField::<f64, 2>::from_fn(grid, |[x, _]| {
                [height * f64::from(u8::from(x > 0.5 - 0.5 * h))]
            });
            let params = SegmentationParams {
                weights: Weights {
                    fidelity: 200.0,
                    smoothness: 0.2,
                    edges: setting.ingredient(1.0, 0.8),
                },
                interface_cells: 4.0,
                edge_conductance: 1e-4,
                tolerance: 1e-7,
                max_iterations: 2000,
                ..SegmentationParams::default()
            };
            let found = segment(&image, &params, &mut Silent)?;
            let length = grid.extent()[1];
            points.push((4.0 * h, found.energy().total / length - 1.0));
        }
        let limit = 1.0 + 2.0 * points[points.len() - 1].1 - points[points.len() - 2].1;
        outcome.value(
            format!("E/ν a unit of length, a step of {height}, extrapolated to ε = 0"),
            limit,
            1.0,
            0.1,
            "the first order is taken out; the root of ε of what the edge conducts, √(β k ν/ε) h, \
             and elements of ε/4 are left",
        );
    }
    Ok(outcome)
}
