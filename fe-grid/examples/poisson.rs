//! The Poisson equation `-laplace u = f` with given values on the boundary and on a hole, by
//! conjugate gradients.
//!
//! The exact solution `sin(3 x) exp(y)` tells the error, which has the second order of the spacing.
//!
//! ```sh
//! cargo run --release -p fe-grid --example poisson
//! ```

use fe_grid::operators::MassStiffness;
use fe_grid::{
    CgParams, Diagonal, Grid, GridError, HeldValues, LinearOperator, ScalarField, UniformOperator,
};

fn exact([x, y]: [f64; 2]) -> f64 {
    (3.0 * x).sin() * y.exp()
}

/// `-laplace` of the exact solution.
fn force(point: [f64; 2]) -> f64 {
    8.0 * exact(point)
}

/// Solves on a grid, and returns the root mean square of the error and the number of iterations.
fn solve(grid: Grid<2>) -> Result<(f64, usize), GridError> {
    let [mass, laplace] = [[1.0, 0.0], [0.0, 1.0]]
        .map(|[mass, stiffness]| UniformOperator::new(grid, MassStiffness { mass, stiffness }));
    let mut b = vec![0.0; grid.n_nodes()];
    let f = ScalarField::<f64, 2>::from_fn(grid, |x| [force(x)]);
    mass.apply_into(f.as_slice(), &mut b);

    // Values are given on the faces of the box, and in a disk about its middle.
    let nodes = grid.nodes_per_axis();
    let given = HeldValues::at_nodes(&grid, 1, |node| {
        let [x, y] = grid.position(node);
        let face = (0..2).any(|k| node[k] == 0 || node[k] + 1 == nodes[k]);
        face || (x - 0.5).hypot(y - 0.5) < 0.2
    });
    let solution = ScalarField::<f64, 2>::from_fn(grid, |x| [exact(x)]);
    let mut u = vec![0.0; grid.n_nodes()];
    given.impose(&solution, &mut u);

    // Twice the stiffness of a node with itself is about the largest eigenvalue.
    let jacobi = Diagonal::new(vec![3.0 / 8.0; u.len()]);
    let params = CgParams {
        relative_tolerance: 1e-8,
        ..CgParams::default()
    };
    let info = given.solve(&laplace, &jacobi, &b, &mut u, &params)?;
    let squares = u.iter().zip(solution.as_slice());
    let mean = squares.map(|(u, v)| (u - v).powi(2)).sum::<f64>() / u.len() as f64;
    Ok((mean.sqrt(), info.iterations))
}

fn main() -> Result<(), GridError> {
    println!("nodes    error      order  iterations");
    let mut previous: Option<f64> = None;
    for level in 3..8 {
        let grid = Grid::<2>::dyadic(level);
        let (error, iterations) = solve(grid)?;
        let order = previous.map_or(String::new(), |p| format!("{:.2}", (p / error).log2()));
        println!(
            "{:>4}^2  {error:.3e}  {order:>5}  {iterations:>10}",
            grid.nodes_per_axis()[0]
        );
        previous = Some(error);
    }
    Ok(())
}
