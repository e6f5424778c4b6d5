//! The terms of the energy of a path, as the program assembles them: their limits, their closed forms
//! on affine paths of disks, and their derivatives.

use std::f64::consts::PI;

use fe_grid::composition::Interpolant;
use fe_grid::minimise::Evaluation;
use fe_grid::{Assembly, Data, Grid, ScalarField, VectorField, tensor};
use geodesic::lagrangian::PathObjective;
use geodesic::level_sets::LevelSetObjective;
use geodesic::{
    BoundaryArea, ComposedMismatch, GeodesicParams, HeavisideMismatch, StepMismatch, Visibility,
};
use hyperelastic::LawSpec;
use levelset::{Arctan, Compact, Step};

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::curves::{disk_at, lens};
use crate::tools::derivatives::against_differences;
use crate::tools::matrices::{inverse, minus_identity, stretches};
use crate::tools::pointwise::{density, law};
use crate::tools::quadrature::Rule;
use crate::tools::shapes::ball;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "level-area-limit",
        reference: "section 6, E_area",
        claim: "∫|DH_ε(u)| tends to the length of the boundary, with the first order of ε",
        broken: "the length is taken of (∇u, 1) in place of ∇u",
        run: area_limit,
    },
    Statement {
        name: "level-match-limit",
        reference: "section 6, E_match",
        claim: "∫(H_ε(u′∘φ) − H_ε(u))² tends to vol(O △ φ⁻¹(O′)), with the order of ε ln(1/ε), for \
                the terms of both forms of a path",
        broken: "only the side counts on which the second shape is missing",
        run: match_limit,
    },
    Statement {
        name: "occlusion-volume",
        reference: "section 6, partial occlusion",
        claim: "The mismatch with a shape that is hidden in part tends to vol(O \\ φ⁻¹(O′)): what \
                covers more costs nothing",
        broken: "the whole shape is seen",
        run: hidden,
    },
    Statement {
        name: "level-gradients",
        reference: "section 6, variations of the energies",
        claim: "The derivatives of E_match and E_area by the level sets are those of their values",
        broken: "the derivatives are those of a step twice as wide",
        run: gradients,
    },
    Statement {
        name: "level-path-energy",
        reference: "section 6, the relaxed energy",
        claim: "The energy of a path of level sets is Σ_k K𝒲[O_{k−1}, φ_k] + η E_match + μ/K E_area",
        broken: "the deformations are those of the path run backwards",
        run: level_path,
    },
    Statement {
        name: "path-step-energy",
        reference: "Definition 6.1, on the start domain",
        claim: "For affine steps of the whole box 𝒲_k = det A W(BA⁻¹) |Ω|, from A to B",
        broken: "the law has 1.1 times the λ",
        run: step_energy,
    },
    Statement {
        name: "path-step-forces",
        reference: "Definition 6.1, first variation",
        claim: "The derivative of Σ𝒲_k by the deformations is (W 1 − FᵀP)G at the start of a step, and \
                P Gᵀ at its end",
        broken: "the law of the derivative has 1.1 times the λ",
        run: step_forces,
    },
];

const RADIUS: f64 = 0.27;

fn area_limit(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(8, 9));
    let disk = ball(grid, RADIUS);
    let mut outcome = Outcome::default();
    let (mut to_length, mut off_integral) = (Vec::new(), 0.0f64);
    for width in [0.04, 0.02, 0.01] {
        let law = BoundaryArea {
            step: Arctan::new(width)?,
            regularisation: setting.ingredient(1e-6, 1.0),
        };
        let found =
            Assembly::<_, f64, 2, 1>::new(grid, &law, Data::default()).value(disk.as_slice())?;
        // The same integral over circles, as far as they lie in the box.
        let exact = Rule::composite(400, 8, 0.0, 0.5).integral(|r| {
            let d = RADIUS - r;
            2.0 * r * width / (width * width + d * d)
        });
        let corners = exact_corners(width);
        off_integral = off_integral.max((found / (exact + corners) - 1.0).abs());
        to_length.push((width, found / (2.0 * PI * RADIUS) - 1.0));
    }
    outcome.at_most(
        "largest |E_area/∫H_ε′(R − r)|∂B_r ∩ Ω| dr − 1|",
        off_integral,
        setting.effort(2e-3, 1e-3),
        "the quadrature of elements of ε/2.5, and the kink of the distance in the middle",
    );
    outcome.order(
        "|E_area/2πR − 1| of a circle",
        "ε",
        to_length,
        1.0,
        0.15,
        "the tails of the arctangent beyond the box and the middle, with the first power of ε",
    );
    Ok(outcome)
}

/// The part of the integral over circles outside the largest one in the box.
fn exact_corners(width: f64) -> f64 {
    let half_diagonal = 0.5f64.sqrt();
    Rule::composite(400, 8, 0.5, half_diagonal).integral(|r| {
        let d = RADIUS - r;
        let seen = 2.0 * PI - 8.0 * (0.5 / r).min(1.0).acos();
        seen * r * width / (PI * (width * width + d * d))
    })
}

/// Both terms of the mismatch of two level sets under no deformation.
fn mismatches(
    own: &ScalarField<f64, 2>,
    other: &ScalarField<f64, 2>,
    width: f64,
    sides: [f64; 2],
) -> Result<[f64; 2], VerifyError> {
    let grid = *own.grid();
    let step = Arctan::new(width)?;
    let visibility = Visibility {
        sides,
        ..Visibility::default()
    };
    let interpolant = Interpolant::new(grid, other.as_slice());
    let rest = vec![0.0; 2 * grid.n_nodes()];
    let of_step = StepMismatch {
        step,
        other: interpolant,
        visibility,
    };
    let state = [own.as_slice(), &rest].concat();
    let of_end = ComposedMismatch {
        density: HeavisideMismatch { step },
        other: interpolant,
        visibility,
    };
    let coefficients = [own.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    Ok([
        Assembly::<_, f64, 2, 3>::new(grid, &of_step, Data::default()).value(&state)?,
        Assembly::<_, f64, 2, 2>::new(grid, &of_end, data).value(&rest)?,
    ])
}

/// Two disks that overlap.
fn overlapping(grid: Grid<2>) -> ([ScalarField<f64, 2>; 2], [f64; 2]) {
    let (radii, centres): ([f64; 2], [[f64; 2]; 2]) = ([0.2, 0.16], [[0.42, 0.47], [0.58, 0.54]]);
    let common = lens(
        radii,
        (centres[1][0] - centres[0][0]).hypot(centres[1][1] - centres[0][1]),
    );
    let missing = radii.map(|r| PI * r * r - common);
    let disks = [0, 1].map(|i| disk_at(grid, centres[i], radii[i]));
    (disks, missing)
}

/// The size of the error of a mismatch: between two boundaries `(1 - ε/(π d))²` falls short of one,
/// which adds up to a logarithm of their distance over `ε`.
fn of_tails(width: f64) -> f64 {
    width * (0.2 / width).ln()
}

const TAILS: &str = "the tails of the arctangent miss ε/d of every boundary at the distance d: \
                     ε ln(R/ε), R = .2";

fn match_limit(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(8, 9));
    let ([own, other], [first, second]) = overlapping(grid);
    let volume = first + second;
    let mut outcome = Outcome::default();
    let (mut points, mut apart) = (Vec::new(), 0.0f64);
    for width in [0.02, 0.01, 0.005] {
        let sides = setting.ingredient([1.0, 1.0], [1.0, 0.0]);
        let [of_step, of_end] = mismatches(&own, &other, width, sides)?;
        points.push((of_tails(width), of_step / volume - 1.0));
        apart = apart.max((of_end / of_step - 1.0).abs());
    }
    outcome.order(
        "|E_match/vol(O △ O′) − 1|",
        "ε ln(R/ε)",
        points,
        1.0,
        0.15,
        TAILS,
    );
    outcome.at_most(
        "largest difference of the terms of both forms, relative",
        apart,
        1e-12,
        "the same integral, up to rounding",
    );
    Ok(outcome)
}

fn hidden(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(setting.effort(8, 9));
    let ([own, other], [missing, surplus]) = overlapping(grid);
    let mut outcome = Outcome::default();
    for (what, sides, volume) in [
        (
            "that is covered too little, over vol(O \\ O′)",
            [1.0, 0.0],
            missing,
        ),
        (
            "that covers too little, over vol(O′ \\ O)",
            [0.0, 1.0],
            surplus,
        ),
    ] {
        let mut points = Vec::new();
        for width in [0.02, 0.01, 0.005] {
            let sides = setting.ingredient(sides, [1.0, 1.0]);
            let [found, _] = mismatches(&own, &other, width, sides)?;
            points.push((of_tails(width), found / volume - 1.0));
        }
        outcome.order(
            format!("|mismatch of a shape {what} − 1|"),
            "ε ln(R/ε)",
            points,
            1.0,
            0.15,
            TAILS,
        );
    }
    Ok(outcome)
}

fn gradients(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(5);
    let n = grid.n_nodes();
    let width = 0.05;
    let of = |width: f64| -> Result<_, VerifyError> { Ok(Arctan::new(width)?) };
    let (step, seen) = (of(width)?, of(setting.ingredient(1.0, 2.0) * width)?);
    let own = disk_at(grid, [0.45, 0.5], 0.25);
    let other = disk_at(grid, [0.5, 0.52], 0.2);
    let change = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| [(5.0 * x).sin() + y * y]);
    let mut outcome = Outcome::default();
    let steps = [0.02, 0.01, 0.005];
    let reason = "central differences of smooth functions of the nodal values";

    let area = |step| BoundaryArea {
        step,
        regularisation: 0.1,
    };
    let mut gradient = vec![0.0; n];
    Assembly::<_, f64, 2, 1>::new(grid, &area(seen), Data::default())
        .value_and_gradient_into(own.as_slice(), &mut gradient)?;
    let points = against_differences(own.as_slice(), change.as_slice(), &gradient, &steps, |u| {
        Ok(Assembly::<_, f64, 2, 1>::new(grid, &area(step), Data::default()).value(u)?)
    })?;
    outcome.order("E_area by u", "t", points, 2.0, 0.1, reason);

    let law = |step| StepMismatch {
        step,
        other: Interpolant::new(grid, other.as_slice()),
        visibility: Visibility::default(),
    };
    let bend = VectorField::<f64, 2>::from_fn(grid, |[x, y]| [0.013 + 0.02 * y, 0.01 * x]);
    let state = [own.as_slice(), bend.as_slice()].concat();
    let direction = [change.as_slice(), &vec![0.0; 2 * n]].concat();
    let mut gradient = vec![0.0; 3 * n];
    Assembly::<_, f64, 2, 3>::new(grid, &law(seen), Data::default())
        .value_and_gradient_into(&state, &mut gradient)?;
    let points = against_differences(&state, &direction, &gradient, &steps, |x| {
        Ok(Assembly::<_, f64, 2, 3>::new(grid, &law(step), Data::default()).value(x)?)
    })?;
    outcome.order("E_match by the own u", "t", points, 2.0, 0.1, reason);
    Ok(outcome)
}

/// Radii of the disks of a path, with three steps that differ.
const RADII: [f64; 4] = [0.2, 0.23, 0.25, 0.3];
/// Stiffness of the void: none that matters.
const VOID: f64 = 1e-9;

fn level_path(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", 2.0, 1.0)?;
    let grid = Grid::<2>::dyadic(setting.effort(6, 8));
    let steps = RADII.len() - 1;
    let params = GeodesicParams {
        steps,
        law: spec,
        void_stiffness: VOID,
        area_weight: 0.3,
        ..GeodesicParams::default()
    };
    let mut x = ball(grid, RADII[0]).into_vec();
    for k in 1..=steps {
        let pair = setting.ingredient([k - 1, k], [k, k - 1]);
        let factor = RADII[pair[1]] / RADII[pair[0]];
        let step = VectorField::<f64, 2>::from_fn(grid, |x| x.map(|x| (factor - 1.0) * (x - 0.5)));
        x.extend(step.as_slice());
        x.extend(ball(grid, RADII[k]).as_slice());
    }
    let half_width = 2.0 * grid.spacing();
    let indicator = Step::Compact(Compact::new(half_width)?);
    let step = Arctan::new(0.02)?;
    let mut objective = LevelSetObjective::with_steps(grid, steps, &params, indicator, step)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let value = objective.evaluate(&x, &mut [])?;
    let total = match value {
        Evaluation::Value(total) => total,
        Evaluation::Inadmissible => f64::NAN,
    };
    let mut off = 0.0f64;
    let mut dissipation = 0.0;
    for k in 1..=steps {
        let w = density(&spec, &stretches([RADII[k] / RADII[k - 1]; 2]))?;
        // The area of a smooth indicator: its second moment across the boundary adds w²/5.
        let area = PI * (RADII[k - 1].powi(2) + half_width * half_width / 5.0);
        off = off.max((objective.energy().step_energies[k - 1] / (area * w) - 1.0).abs());
        dissipation += steps as f64 * area * w;
    }
    outcome.at_most(
        "largest |𝒲_k/(|O_{k−1}| W(Dφ_k)) − 1| of disks that grow",
        off,
        setting.effort(2e-3, 2e-4),
        "the indicator on elements of half its half-width",
    );
    let terms = objective.energy();
    let mismatch: f64 = terms.mismatches.iter().sum();
    let area: f64 = terms.areas.iter().sum();
    let weight = params.mismatch_weight;
    let expected = dissipation + weight * mismatch + params.area_weight / steps as f64 * area;
    outcome.value(
        "energy of the path over K Σ|O_{k−1}|W + η E_match + μ/K E_area",
        total / expected,
        1.0,
        setting.effort(2e-3, 2e-4),
        "the sum of the terms; only the first is known in closed form",
    );
    Ok(outcome)
}

/// A path of affine deformations of the whole box about its middle.
fn affine_path(grid: Grid<2>) -> (Vec<[[f64; 2]; 2]>, Vec<f64>) {
    let path = vec![
        [[1.1, 0.05], [-0.02, 0.95]],
        [[1.15, 0.2], [0.05, 1.05]],
        [[1.3, 0.1], [0.2, 0.9]],
    ];
    let x = path
        .iter()
        .flat_map(|a| {
            VectorField::<f64, 2>::from_fn(grid, |x| {
                let r = x.map(|x| x - 0.5);
                [0, 1].map(|i| a[i][0] * r[0] + a[i][1] * r[1] - r[i])
            })
            .into_vec()
        })
        .collect();
    (path, x)
}

/// The energy of a path of three steps on which the whole box is the object.
fn objective(grid: Grid<2>, spec: LawSpec) -> Result<PathObjective<2>, VerifyError> {
    let everywhere = ScalarField::<f64, 2>::from_fn(grid, |_| [1.0]);
    let params = GeodesicParams {
        steps: 3,
        law: spec,
        void_stiffness: VOID,
        // There is nothing to match.
        mismatch_weight: 1e-12,
        ..GeodesicParams::default()
    };
    Ok(PathObjective::new(
        everywhere.clone(),
        everywhere,
        3,
        &params,
    )?)
}

fn step_energy(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    for name in ["logdet", "power"] {
        let spec = law(name, 1.3, 0.8)?;
        let grid = Grid::<2>::dyadic(3);
        let (path, x) = affine_path(grid);
        let mut objective = objective(grid, law(name, setting.ingredient(1.3, 1.43), 0.8)?)?;
        objective.evaluate(&x, &mut [])?;
        let mut before = [[1.0, 0.0], [0.0, 1.0]];
        let mut off = 0.0f64;
        for (a, found) in path.iter().zip(&objective.energy().step_energies) {
            let f = tensor::product(a, &inverse(&before));
            let w = density(&spec, &minus_identity(&f))?;
            let exact = tensor::determinant(&before) * w;
            off = off.max((found / exact - 1.0).abs());
            before = *a;
        }
        outcome.at_most(
            format!("largest |𝒲_k/(det A W(BA⁻¹)) − 1| of three affine steps, {name}"),
            off,
            1e-10,
            "affine deformations are exact on a grid; W of .01 is the rest of terms of order one",
        );
    }
    Ok(outcome)
}

fn step_forces(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(3);
    let (_, x) = affine_path(grid);
    let spec = law("logdet", 1.3, 0.8)?;
    let mut gradient = vec![0.0; x.len()];
    objective(grid, law("logdet", setting.ingredient(1.3, 1.43), 0.8)?)?
        .evaluate(&x, &mut gradient)?;
    let direction: Vec<f64> = (0..x.len()).map(|i| (0.37 * i as f64).sin()).collect();
    // Small enough that no cell folds.
    let direction: Vec<f64> = direction.iter().map(|d| 0.1 * grid.spacing() * d).collect();
    let points = against_differences(&x, &direction, &gradient, &[1.0, 0.5, 0.25], |x| {
        let mut objective = objective(grid, spec)?;
        Ok(match objective.evaluate(x, &mut [])? {
            Evaluation::Value(total) => total,
            Evaluation::Inadmissible => f64::NAN,
        })
    })?;
    let mut outcome = Outcome::default();
    outcome.order(
        "difference of the energy of a path to its gradient",
        "t",
        points,
        2.0,
        0.1,
        "central differences; displacements of a tenth of a spacing in a random direction",
    );
    Ok(outcome)
}
