//! A minimal surface over a square: an energy of one's own, with given boundary values.
//!
//! The area `int sqrt(1 + |grad u|^2)` is a pointwise law; the engine makes its integral, gradient and
//! second derivative on a grid. Scherk's surface `log(cos y / cos x)` is minimal, and tells the error.
//!
//! ```sh
//! cargo run --release -p fe-grid --example minimal_surface
//! ```

use fe_grid::minimise::{
    Evaluation, LbfgsParams, Minimiser, NewtonCgParams, Objective, SecondOrder, Silent, Stopping,
    gradient_errors, hessian_errors,
};
use fe_grid::{
    Assembly, Boundary, CellLaw, Data, Grid, GridError, HeldValues, Jet, Lane, LinearOperator,
    Point, Reads, ScalarField, SpectralSolver,
};

// ANCHOR: law
/// The area of a graph.
struct Area;

impl Reads for Area {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 0;
    const CELL_DATA: usize = 0;
}

#[inline(always)]
fn dot<L: Lane>(a: &[L; 2], b: &[L; 2]) -> L {
    a[0].mul_add(b[0], a[1] * b[1])
}

impl CellLaw<2, 1> for Area {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, 2, 1>) -> L {
        let [g] = point.gradient;
        (L::one() + dot(&g, &g)).sqrt()
    }

    /// `grad u / a` for the area `a` by area.
    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, 2, 1>) -> (L, Jet<L, 2, 1>) {
        let area = self.value(point);
        let [[x, y]] = point.gradient;
        let derivative = Jet {
            gradient: [[x / area, y / area]],
            ..Jet::zero()
        };
        (area, derivative)
    }

    /// `(d - (g . d) g / a^2) / a` for the gradient `g` and a direction `d`.
    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, 2, 1>,
        direction: &Jet<L, 2, 1>,
    ) -> Jet<L, 2, 1> {
        let area = self.value(point);
        let ([g], [d]) = (point.gradient, direction.gradient);
        let along = dot(&g, &d) / (area * area);
        let [x, y] = [0, 1].map(|k| (d[k] - along * g[k]) / area);
        Jet {
            gradient: [[x, y]],
            ..Jet::zero()
        }
    }
}
// ANCHOR_END: law

// ANCHOR: objective
/// The area of the graph of nodal values, in the metric of the Dirichlet energy with zero boundary.
struct Surface<'a> {
    area: Assembly<'a, Area, f64, 2, 1>,
    metric: SpectralSolver<2>,
}

impl Objective for Surface<'_> {
    type Error = GridError;

    fn dim(&self) -> usize {
        self.area.grid().n_nodes()
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GridError> {
        Ok(Evaluation::Value(
            self.area.value_and_gradient_into(x, gradient)?,
        ))
    }

    fn apply_inverse_metric(&mut self, gradient: &[f64], out: &mut [f64]) -> Result<(), GridError> {
        self.metric.apply_into(gradient, out);
        Ok(())
    }
}
// ANCHOR_END: objective

impl SecondOrder for Surface<'_> {
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), GridError> {
        self.area.hessian_action_into(x, direction, out);
        Ok(())
    }
}

fn main() -> Result<(), GridError> {
    println!("nodes    method     iterations  area        error");
    for level in 3..8 {
        let grid = Grid::<2>::dyadic(level);
        let scherk = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| [(y.cos() / x.cos()).ln()]);
        let surface = || -> Result<Surface<'_>, GridError> {
            Ok(Surface {
                area: Assembly::new(grid, &Area, Data::default()),
                metric: SpectralSolver::new(grid, 0.0, 1.0, Boundary::Dirichlet)?,
            })
        };
        let boundary = HeldValues::on_faces(&grid, 1);
        let mut objective = boundary.objective(surface()?);
        let stopping = Stopping {
            relative_decrement: 1e-14,
            ..Stopping::default()
        };
        let methods: [(&str, &dyn Minimiser<_>); 2] = [
            (
                "L-BFGS",
                &LbfgsParams {
                    stopping,
                    ..LbfgsParams::default()
                },
            ),
            (
                "Newton-CG",
                &NewtonCgParams {
                    stopping,
                    ..NewtonCgParams::default()
                },
            ),
        ];
        for (name, method) in methods {
            let mut u = vec![0.0; grid.n_nodes()];
            boundary.impose(&scherk, &mut u);
            let info = method.minimise(&mut objective, &mut u, &mut Silent)?;
            let differences = u.iter().zip(scherk.as_slice()).map(|(u, v)| (u - v).abs());
            println!(
                "{:>4}^2  {name:<10} {:>9}  {:.8}  {:.2e}",
                grid.nodes_per_axis()[0],
                info.iterations,
                info.energy().unwrap_or(f64::NAN),
                differences.fold(0.0, f64::max),
            );
        }
        if level == 3 {
            check(&mut objective, scherk.as_slice())?;
        }
    }
    Ok(())
}

/// Prints the errors of the derivatives against differences: of the second order of the step.
fn check(objective: &mut impl SecondOrder<Error = GridError>, x: &[f64]) -> Result<(), GridError> {
    let wave = |f: f64| {
        (0..x.len())
            .map(|i| (f * i as f64).sin())
            .collect::<Vec<_>>()
    };
    // Along directions that keep the boundary: the differences see the held unknowns, too.
    let grid = Grid::<2>::dyadic(3);
    let boundary = HeldValues::on_faces(&grid, 1);
    let [mut direction, mut test] = [wave(1.3), wave(0.7)];
    // At a state away from the minimum, where the derivative is not zero.
    let x: Vec<f64> = x.iter().map(|u| 1.2 * u).collect();
    boundary.project(&mut direction);
    boundary.project(&mut test);
    let steps = [1e-2, 1e-3];
    for (what, errors) in [
        (
            "gradient",
            gradient_errors(objective, &x, &direction, &steps)?,
        ),
        (
            "second derivative",
            hessian_errors(objective, &x, &direction, &test, &steps)?,
        ),
    ] {
        for (step, error) in errors {
            println!("         {what} against differences of step {step:.0e}: {error:.1e}");
        }
    }
    Ok(())
}
