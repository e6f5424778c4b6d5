//! Fields seen through a deformation, and its inverse, on grids.

use fe_grid::composition::{Interpolant, Matching};
use fe_grid::{Assembly, Data, Grid, InverseDeformation, ScalarField, VectorField};
use phasefield::Mismatch;

use crate::error::VerifyError;
use crate::outcome::Outcome;
use crate::statement::{Setting, Statement};
use crate::tools::derivatives::against_differences;
use crate::tools::quadrature::Rule;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "discretisation-composition",
        reference: "section 4, pull back",
        claim: "∫f(V∘Φ; c) of fields on a grid, with V evaluated at deformed quadrature points, tends \
                to that of smooth fields with the second order of h",
        broken: "V is evaluated without the deformation",
        run: composition,
    },
    Statement {
        name: "discretisation-composition-gradient",
        reference: "section 4, variations by the deformation",
        claim: "The derivative of ∫f(V∘Φ; c) by Φ is ∫f′(V∘Φ; c)(∇V)∘Φ·ψ",
        broken: "∇V is that of another field",
        run: composition_gradient,
    },
    Statement {
        name: "discretisation-inverse",
        reference: "section 4, push forward",
        claim: "Φ⁻¹ and V∘Φ⁻¹ at the nodes tend to those of a smooth deformation with the second \
                order of h",
        broken: "the inverse of x + u is taken as x − u",
        run: |setting| Ok(inverse(setting)),
    },
    Statement {
        name: "discretisation-push-forward",
        reference: "section 4, I_h(V∘Φ⁻¹) is not sufficient",
        claim: "I_h(V∘Φ⁻¹)∘Φ differs from V by the second order of h, so that energies through it are \
                not those of the discrete fields: their difference is no rounding",
        broken: "the deformation is a translation by one cell, which is exact",
        run: |setting| Ok(push_forward(setting)),
    },
];

/// A deformation of the box into itself that moves its faces along themselves.
fn moved([x, y]: [f64; 2]) -> [f64; 2] {
    let bump = |x: f64| (std::f64::consts::PI * x).sin();
    [
        x + 0.07 * bump(x) * (2.0 * y).cos(),
        y + 0.06 * bump(y) * (1.0 + x),
    ]
}

fn field([x, y]: [f64; 2]) -> f64 {
    0.5 + 0.3 * (4.0 * x + 1.0).sin() * (3.0 * y).cos()
}

fn coefficient([x, y]: [f64; 2]) -> f64 {
    0.4 + 0.2 * (2.0 * x * y).cos() + 0.1 * x
}

fn displaced(grid: Grid<2>) -> VectorField<f64, 2> {
    VectorField::from_fn(grid, |x| {
        let y = moved(x);
        [y[0] - x[0], y[1] - x[1]]
    })
}

/// A density that depends on both fields.
const DENSITY: Mismatch = Mismatch {
    interface_width: 1.0,
    scale: 1.0,
};

fn integral(
    v: &ScalarField<f64, 2>,
    c: &ScalarField<f64, 2>,
    displacement: &[f64],
) -> Result<f64, VerifyError> {
    let grid = *v.grid();
    let coefficients = [c.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let law = Matching::new(DENSITY, Interpolant::new(grid, v.as_slice()));
    Ok(Assembly::<_, f64, 2, 2>::new(grid, &law, data).value(displacement)?)
}

fn composition(setting: Setting) -> Result<Outcome, VerifyError> {
    let rule = Rule::composite(4, 16, 0.0, 1.0);
    let mut exact = 0.0;
    for &(x, a) in rule.points() {
        for &(y, b) in rule.points() {
            let (v, c) = (field(moved([x, y])), coefficient([x, y]));
            exact += a * b * ((v * (1.0 - c)).powi(2) + (c * (1.0 - v)).powi(2));
        }
    }
    let mut points = Vec::new();
    for level in 3..=setting.effort(6, 8) {
        let grid = Grid::<2>::dyadic(level);
        let v = ScalarField::<f64, 2>::from_fn(grid, |x| [field(x)]);
        let c = ScalarField::<f64, 2>::from_fn(grid, |x| [coefficient(x)]);
        let mut u = displaced(grid).into_vec();
        for u in &mut u {
            *u *= setting.ingredient(1.0, 0.0);
        }
        points.push((grid.spacing(), integral(&v, &c, &u)? / exact - 1.0));
    }
    let mut outcome = Outcome::default();
    outcome.order(
        "|∫f(V∘Φ; c) − limit|/limit",
        "h",
        points,
        2.0,
        0.15,
        "interpolation of all three fields",
    );
    Ok(outcome)
}

fn composition_gradient(setting: Setting) -> Result<Outcome, VerifyError> {
    let grid = Grid::<2>::dyadic(4);
    let v = ScalarField::<f64, 2>::from_fn(grid, |x| [field(x)]);
    let seen = ScalarField::<f64, 2>::from_fn(grid, |x| [setting.ingredient(1.0, 1.05) * field(x)]);
    let c = ScalarField::<f64, 2>::from_fn(grid, |x| [coefficient(x)]);
    // Points stay in their cells, where the composition is smooth.
    let state: Vec<f64> = displaced(grid)
        .as_slice()
        .iter()
        .map(|u| 0.01 * u)
        .collect();
    let direction = VectorField::<f64, 2>::from_fn(grid, |[x, y]| [1.0 - y * y, (3.0 * x).sin()]);
    let coefficients = [c.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let law = Matching::new(DENSITY, Interpolant::new(grid, seen.as_slice()));
    let mut gradient = vec![0.0; state.len()];
    Assembly::<_, f64, 2, 2>::new(grid, &law, data)
        .value_and_gradient_into(&state, &mut gradient)?;
    let steps = [8e-3, 4e-3, 2e-3];
    let points = against_differences(&state, direction.as_slice(), &gradient, &steps, |u| {
        integral(&v, &c, u)
    })?;
    let mut outcome = Outcome::default();
    outcome.at_most(
        "|difference of the integral/its gradient − 1| over 2e-3",
        points[2].1,
        1e-4,
        "central differences of a function with third derivatives of the size of the first",
    );
    Ok(outcome)
}

/// The point that the deformation maps to another, by Newton's method with differences.
fn preimage(target: [f64; 2]) -> [f64; 2] {
    let mut x = target;
    for _ in 0..30 {
        let y = moved(x);
        let r = [target[0] - y[0], target[1] - y[1]];
        let t = 1e-6;
        let column = |k: usize| {
            let mut p = x;
            p[k] += t;
            let q = moved(p);
            [(q[0] - y[0]) / t, (q[1] - y[1]) / t]
        };
        let (a, b) = (column(0), column(1));
        let det = a[0] * b[1] - a[1] * b[0];
        x[0] += (b[1] * r[0] - b[0] * r[1]) / det;
        x[1] += (a[0] * r[1] - a[1] * r[0]) / det;
    }
    x
}

fn inverse(setting: Setting) -> Outcome {
    let (mut places, mut values) = (Vec::new(), Vec::new());
    for level in 3..=setting.effort(6, 8) {
        let grid = Grid::<2>::dyadic(level);
        let u = displaced(grid);
        let inverse = InverseDeformation::new(&u);
        let v = ScalarField::<f64, 2>::from_fn(grid, |x| [field(x)]);
        let pushed = inverse.push_forward(&v, 0.0);
        let (mut off, mut off_value) = (0.0f64, 0.0f64);
        for node in 0..grid.n_nodes() {
            let target = grid.position(grid.node(node));
            // On the faces rounding decides whether a node is in the image.
            if target.iter().any(|x| *x == 0.0 || *x == 1.0) {
                continue;
            }
            let exact = preimage(target);
            let found = if setting.is_broken() {
                let u = u.at(node);
                [target[0] - u[0], target[1] - u[1]]
            } else {
                inverse.position(node).unwrap_or([f64::NAN; 2])
            };
            off = off.max((found[0] - exact[0]).hypot(found[1] - exact[1]));
            off_value = off_value.max((pushed.as_slice()[node] - field(exact)).abs());
        }
        places.push((grid.spacing(), off));
        values.push((grid.spacing(), off_value));
    }
    let mut outcome = Outcome::default();
    let reason = "interpolation of the deformation and of the field";
    outcome.order(
        "largest |Φ_h⁻¹ − Φ⁻¹| at inner nodes",
        "h",
        places,
        2.0,
        0.2,
        reason,
    );
    outcome.order("largest |V_h∘Φ_h⁻¹ − V∘Φ⁻¹|", "h", values, 2.0, 0.2, reason);
    outcome
}

fn push_forward(setting: Setting) -> Outcome {
    let mut points = Vec::new();
    for level in 4..=setting.effort(7, 8) {
        let grid = Grid::<2>::dyadic(level);
        let h = grid.spacing();
        let u = if setting.is_broken() {
            VectorField::<f64, 2>::from_fn(grid, |_| [h, 0.0])
        } else {
            displaced(grid)
        };
        let v = ScalarField::<f64, 2>::from_fn(grid, |x| [field(x)]);
        let pushed = InverseDeformation::new(&u).push_forward(&v, 0.0);
        let mut off = 0.0f64;
        for node in 0..grid.n_nodes() {
            let x = grid.position(grid.node(node));
            if x.iter().any(|x| !(0.1..=0.9).contains(x)) {
                continue;
            }
            let d = u.at(node);
            let back = pushed.sample([x[0] + d[0], x[1] + d[1]])[0];
            off = off.max((back - v.as_slice()[node]).abs());
        }
        points.push((h, off));
    }
    let mut outcome = Outcome::default();
    outcome.order(
        "largest |I_h(V∘Φ⁻¹)∘Φ − V| at nodes of the middle",
        "h",
        points,
        2.0,
        0.2,
        "the interpolation on the nodes of the image, which are others",
    );
    outcome
}
