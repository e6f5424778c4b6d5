//! Discretisation errors: orders of bilinear elements and of the certificate.

use fe_grid::minimise::Silent;
use fe_grid::operators::MassStiffness;
use fe_grid::vector::dot;
use fe_grid::{Boundary, Field, Grid, SpectralSolver, UniformOperator, certify, tensor};
use geodesic::finite::{Balls, finite_geodesic};
use geodesic::{GeodesicParams, geodesic};

use crate::error::VerifyError;
use crate::order::richardson;
use crate::outcome::{Expectation, Outcome};
use crate::statement::{Setting, Statement};
use crate::tools::fields::{displacement, elastic_energy};
use crate::tools::matrices::minus_identity;
use crate::tools::pointwise::{density, law};
use crate::tools::quadrature::Rule;
use crate::tools::shapes::ball;

/// The statements of this theme.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        name: "discretisation-elastic-energy",
        reference: "section 4, multilinear elements",
        claim: "The elastic energy of an interpolated deformation converges with the second order \
                of h",
        broken: "nodal values are taken half a cell off",
        run: elastic,
    },
    Statement {
        name: "discretisation-linear-problem",
        reference: "section 4, multilinear elements",
        claim: "Solutions of −Δu + u = f converge with the second order of h, their gradients with \
                the first",
        broken: "the mass is counted twice",
        run: linear_problem,
    },
    Statement {
        name: "discretisation-certificate",
        reference: "Theorem 4.7, det Dφ > 0",
        claim: "The certificate bounds det Dφ from below on whole cells, and tends to its least \
                value with the first order of h",
        broken: "det Dφ is looked at in the middle of cells alone",
        run: |setting| Ok(certificate(setting)),
    },
    Statement {
        name: "discretisation-geodesic",
        reference: "Definition 6.2, Theorem 6.5",
        claim: "The length of a geodesic of disks on grids tends to that in closed form with the first \
                order of h",
        broken: "the law has 1.1 times the λ",
        run: geodesic_of_disks,
    },
];

/// A smooth deformation, with its gradient.
fn place([x, y]: [f64; 2]) -> [f64; 2] {
    [
        x + 0.08 * (3.0 * y).sin() + 0.05 * x * x,
        y + 0.06 * (2.0 * x + y).cos(),
    ]
}

fn gradient([x, y]: [f64; 2]) -> [[f64; 2]; 2] {
    let s = -0.06 * (2.0 * x + y).sin();
    [[1.0 + 0.1 * x, 0.24 * (3.0 * y).cos()], [2.0 * s, 1.0 + s]]
}

fn elastic(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    for name in ["logdet", "power"] {
        let spec = law(name, 1.0, 1.0)?;
        let rule = Rule::gauss(16, 0.0, 1.0);
        let mut exact = 0.0;
        for &(x, a) in rule.points() {
            for &(y, b) in rule.points() {
                exact += a * b * density(&spec, &minus_identity(&gradient([x, y])))?;
            }
        }
        let mut points = Vec::new();
        for level in 3..=setting.effort(6, 7) {
            let grid = Grid::<2>::dyadic(level);
            let off = setting.ingredient(0.0, 0.5 * grid.spacing());
            let u = displacement(grid, |[x, y]| {
                let p = place([x + off, y]);
                [p[0] - off, p[1]]
            });
            let found = elastic_energy(&spec, 0.0, &u, &vec![1.0; grid.n_nodes()])?;
            points.push((grid.spacing(), found / exact - 1.0));
        }
        outcome.order(
            format!("|𝒲_h/𝒲 − 1|, {name}"),
            "h",
            points,
            2.0,
            0.1,
            "interpolation and the 2-point Gauss rule, for smooth fields",
        );
    }
    Ok(outcome)
}

fn linear_problem(setting: Setting) -> Result<Outcome, VerifyError> {
    let mut outcome = Outcome::default();
    // Natural boundary values.
    let exact = |[x, y]: [f64; 2]| {
        (std::f64::consts::PI * x).cos() * (2.0 * std::f64::consts::PI * y).cos()
    };
    let factor = 1.0 + 5.0 * std::f64::consts::PI.powi(2);
    let (mut values, mut gradients) = (Vec::new(), Vec::new());
    for level in 3..=setting.effort(6, 8) {
        let grid = Grid::<2>::dyadic(level);
        let solver =
            SpectralSolver::new(grid, setting.ingredient(1.0, 2.0), 1.0, Boundary::Natural)?;
        let mass = UniformOperator::new(
            grid,
            MassStiffness {
                mass: 1.0,
                stiffness: 0.0,
            },
        );
        let nodal = Field::<f64, 2, 1>::from_fn(grid, |x| [factor * exact(x)]);
        let mut load = vec![0.0; grid.n_nodes()];
        mass.product_into(nodal.as_slice(), &mut load);
        let mut u = vec![0.0; load.len()];
        solver.solve_into(&load, &mut u);
        // Against the function itself, on a grid so fine that it does not matter.
        let fine = Grid::<2>::dyadic(level + 3);
        let coarse = Field::<f64, 2, 1>::from_vec(grid, u)?;
        let difference =
            Field::<f64, 2, 1>::from_fn(fine, |x| [coarse.sample(x)[0] - exact(x)]).into_vec();
        let of = |mass, stiffness| {
            let mut product = vec![0.0; difference.len()];
            UniformOperator::new(fine, MassStiffness { mass, stiffness })
                .product_into(&difference, &mut product);
            dot(&difference, &product).sqrt()
        };
        values.push((grid.spacing(), of(1.0, 0.0)));
        gradients.push((grid.spacing(), of(0.0, 1.0)));
    }
    outcome.order(
        "|u_h − u| in L²",
        "h",
        values,
        2.0,
        0.1,
        "Aubin and Nitsche, on smooth solutions",
    );
    outcome.order(
        "|∇u_h − ∇u| in L²",
        "h",
        gradients,
        1.0,
        0.1,
        "Céa, on smooth solutions",
    );
    Ok(outcome)
}

fn certificate(setting: Setting) -> Outcome {
    let mut outcome = Outcome::default();
    let [(plane, below_plane), (space, below_space)] = [bounds::<2>(setting), bounds::<3>(setting)];
    for (d, points, below) in [(2, plane, below_plane), (3, space, below_space)] {
        outcome.at_most(
            format!("largest (bound − least det at 5^{d} points a cell), {d}D"),
            below,
            1e-12,
            "a bound from below, up to rounding",
        );
        outcome.order(
            format!("|bound − least det of the deformation|, {d}D"),
            "h",
            points,
            1.0,
            0.4,
            "gradients of elements are off by h at corners; coarse grids in space see some h²",
        );
    }
    outcome
}

fn geodesic_of_disks(setting: Setting) -> Result<Outcome, VerifyError> {
    let spec = law("logdet", setting.ingredient(1.0, 1.1), 1.0)?;
    let mut outcome = Outcome::with_law::<2>(spec, &[])?;
    let balls = Balls::<2>::new(law("logdet", 1.0, 1.0)?)?;
    let exact = finite_geodesic(&balls, [0.2], [0.3], 2)?.length();
    let (mut lengths, mut points) = (Vec::new(), Vec::new());
    for level in setting.effort(5..=7, 6..=8) {
        let grid = Grid::<2>::dyadic(level);
        let params = GeodesicParams {
            steps: 2,
            law: spec,
            tolerance: 1e-6,
            max_iterations: Some(400),
            ..GeodesicParams::default()
        };
        let path = geodesic(&ball(grid, 0.2), &ball(grid, 0.3), &params, &mut Silent)?;
        lengths.push(path.length() / exact);
        points.push((grid.spacing(), path.length() / exact - 1.0));
    }
    outcome.order(
        "|L_h/L − 1|, two steps",
        "h",
        points,
        1.0,
        0.3,
        "the widths of indicator and match are numbers of cells",
    );
    let limit = richardson(&lengths, 1.0);
    outcome.check(
        "L_h/L, extrapolated to h = 0",
        limit.value,
        limit.uncertainty,
        Expectation::Value {
            value: 1.0,
            tolerance: setting.effort(4e-3, 2e-3),
        },
        "what is left are terms of h², and the 1e-6 of the energy that the minimiser leaves",
    );
    Ok(outcome)
}

/// Bounds against the least determinant of the smooth deformation, and the most that a bound lies
/// above determinants at points of its own grid.
fn bounds<const D: usize>(setting: Setting) -> (Vec<(f64, f64)>, f64) {
    // The determinant of x_k + 0.1 sin(4 x_{k+1}) sin(3 x_k) is least somewhere inside.
    let map = |x: [f64; D]| -> [f64; D] {
        std::array::from_fn(|k| x[k] + 0.1 * (4.0 * x[(k + 1) % D]).sin() * (3.0 * x[k]).sin())
    };
    let det = |x: [f64; D]| {
        let mut a = tensor::diagonal::<f64, D>(1.0);
        for k in 0..D {
            let next = (k + 1) % D;
            a[k][k] += 0.3 * (4.0 * x[next]).sin() * (3.0 * x[k]).cos();
            a[k][next] += 0.4 * (4.0 * x[next]).cos() * (3.0 * x[k]).sin();
        }
        tensor::determinant(&a)
    };
    let exact = least_inside(det);
    let (mut points, mut above) = (Vec::new(), f64::NEG_INFINITY);
    for level in if D == 2 {
        4..=setting.effort(7, 9)
    } else {
        3..=setting.effort(5, 6)
    } {
        let grid = Grid::<D>::dyadic(level);
        let u = displacement(grid, map);
        let sampled = sampled(&grid, u.as_slice(), &[0.0, 0.3, 0.5, 0.7, 1.0]);
        let bound = if setting.is_broken() {
            self::sampled(&grid, u.as_slice(), &[0.5])
        } else {
            certify(&grid, u.as_slice(), 0.0).min_det
        };
        above = above.max(bound - sampled);
        points.push((grid.spacing(), bound - exact));
    }
    (points, above)
}

/// The minimum of a smooth function in the box: the best of a grid, and of finer grids around it.
fn least_inside<const D: usize>(f: impl Fn([f64; D]) -> f64) -> f64 {
    let (mut centre, mut reach) = ([0.5; D], 0.5);
    let mut least = f64::INFINITY;
    for _ in 0..14 {
        let steps = 24usize;
        let middle = centre;
        for index in 0..(steps + 1).pow(D as u32) {
            let mut rest = index;
            let x = middle.map(|c| {
                let i = rest % (steps + 1);
                rest /= steps + 1;
                (c + reach * (2.0 * i as f64 / steps as f64 - 1.0)).clamp(0.0, 1.0)
            });
            let value = f(x);
            if value < least {
                (least, centre) = (value, x);
            }
        }
        reach *= 0.25;
    }
    least
}

/// The minimum determinant at some points of every cell.
fn sampled<const D: usize>(grid: &Grid<D>, displacement: &[f64], local: &[f64]) -> f64 {
    let n = grid.n_nodes();
    let strides = grid.strides();
    let mut least = f64::INFINITY;
    for cell in 0..grid.n_cells() {
        let base = grid.node_index(grid.cell(cell));
        for index in 0..local.len().pow(D as u32) {
            let mut rest = index;
            let x: [f64; D] = std::array::from_fn(|_| {
                let i = rest % local.len();
                rest /= local.len();
                local[i]
            });
            let mut a = tensor::diagonal::<f64, D>(1.0);
            for corner in 0..1usize << D {
                let at = |k: usize| corner >> k & 1;
                let node = base + (0..D).map(|k| at(k) * strides[k]).sum::<usize>();
                for k in 0..D {
                    let mut slope = if at(k) == 1 { 1.0 } else { -1.0 } / grid.spacing();
                    for m in (0..D).filter(|m| *m != k) {
                        slope *= if at(m) == 1 { x[m] } else { 1.0 - x[m] };
                    }
                    for i in 0..D {
                        a[i][k] += slope * displacement[i * n + node];
                    }
                }
            }
            least = least.min(tensor::determinant(&a));
        }
    }
    least
}
