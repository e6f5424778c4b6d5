//! A bar in tension: the energy of an elastic body on a grid, with given displacements.
//!
//! The ends of the bar are pulled apart and may slide along themselves; the sides are free. The bar is then
//! stretched evenly, and its thickness and its stress are known in closed form.
//!
//! ```sh
//! cargo run --release -p hyperelastic --example bar
//! ```

use fe_grid::minimise::{
    Evaluation, Minimiser, NewtonCgParams, Objective, SecondOrder, Silent, Stopping,
};
use fe_grid::{
    Assembly, Boundary, Data, Grid, GridError, HeldValues, LinearOperator, SpectralSolver,
    VectorField,
};
use hyperelastic::{LameModuli, LawSpec, WeightedElasticity};

// ANCHOR: objective
/// The elastic energy of a displacement: the first component at all nodes, then the second.
struct Body<'a> {
    energy: Assembly<'a, WeightedElasticity<'a, 2>, f64, 2, 2>,
    metric: SpectralSolver<2>,
}

impl Objective for Body<'_> {
    type Error = GridError;

    fn dim(&self) -> usize {
        2 * self.energy.grid().n_nodes()
    }

    fn value_and_gradient(&mut self, u: &[f64], out: &mut [f64]) -> Result<Evaluation, GridError> {
        match self.energy.value_and_gradient_into(u, out) {
            Ok(value) => Ok(Evaluation::Value(value)),
            // A cell is turned inside out: the minimiser takes a shorter step.
            Err(GridError::Inadmissible { .. }) => Ok(Evaluation::Inadmissible),
            Err(error) => Err(error),
        }
    }

    fn apply_inverse_metric(&mut self, gradient: &[f64], out: &mut [f64]) -> Result<(), GridError> {
        self.metric.apply_into(gradient, out);
        Ok(())
    }
}
// ANCHOR_END: objective

impl SecondOrder for Body<'_> {
    fn hessian_action(
        &mut self,
        u: &[f64],
        along: &[f64],
        out: &mut [f64],
    ) -> Result<(), GridError> {
        self.energy.hessian_action_into(u, along, out);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (lambda, mu) = (2.0, 1.0);
    let law = LawSpec::new("logdet", LameModuli::new(lambda, mu)?)?.compile::<2>()?;
    // Four times as long as it is thick.
    let grid = Grid::<2>::with_nodes([65, 17], 1.0 / 64.0)?;
    let (n, [_, thickness]) = (grid.n_nodes(), grid.extent());
    println!("stretch  thickness (exact)        stress (exact)           iterations");
    for stretch in [0.8, 1.1, 1.5, 2.0] {
        // ANCHOR: held
        // The object fills the box: there is no void. The weight of a body in a void is 0 outside.
        let inside = vec![1.0; n];
        let data = Data {
            coefficients: &[&inside],
            cells: &[],
        };
        let weighted = WeightedElasticity {
            law: &law,
            void_stiffness: 1e-4,
        };
        // Displacements along x are given at both ends, and one along y, against a rigid motion.
        let held = HeldValues::new(2 * n, |i| {
            let [x, y] = grid.node(i % n);
            if i < n {
                x == 0 || x == 64
            } else {
                x == 0 && y == 8
            }
        });
        let mut u =
            VectorField::<f64, 2>::from_fn(grid, |[x, _]| [(stretch - 1.0) * x, 0.0]).into_vec();
        let body = Body {
            energy: Assembly::new(grid, &weighted, data),
            metric: SpectralSolver::new(grid, 1.0, 1.0, Boundary::Natural)?.with_components(2),
        };
        let mut body = held.objective(body);
        // ANCHOR_END: held
        let stopping = Stopping {
            relative_gradient: 1e-10,
            relative_energy: 0.0,
            ..Stopping::default()
        };
        let method = NewtonCgParams {
            stopping,
            ..NewtonCgParams::default()
        };
        let info = method.minimise(&mut body, &mut u, &mut Silent)?;

        // What holds the right end: the derivative of the energy by its displacement.
        let mut force = vec![0.0; 2 * n];
        body.inner()
            .energy
            .value_and_gradient_into(&u, &mut force)?;
        let at_the_end = (0..n).filter(|&i| grid.node(i)[0] == 64);
        let stress = at_the_end.map(|i| force[i]).sum::<f64>() / thickness;
        let [bottom, top] = [0, 16].map(|y| u[n + grid.node_index([32, y])]);
        let across = 1.0 + (top - bottom) / thickness;
        // The stress across vanishes: mu a + (lambda s a / 2 - (mu + lambda / 2) / (s a)) s = 0.
        let compression = mu + 0.5 * lambda;
        let exact = (compression / (mu + 0.5 * lambda * stretch * stretch)).sqrt();
        let exact_stress =
            mu * stretch + 0.5 * lambda * stretch * exact * exact - compression / stretch;
        println!(
            "{stretch:>7}  {across:.6} ({exact:.6})     {stress:>9.6} ({exact_stress:.6})   {:>4}",
            info.iterations
        );
        assert!((across - exact).abs() < 1e-7 && (stress - exact_stress).abs() < 1e-7);
    }
    Ok(())
}
