//! The driver from coarse to fine, on a semilinear problem with the exact metric of its linear
//! part.

use crate::support::assembled::{Matrix, stiffness_matrix};
use fe_grid::minimise::{
    Control, DescentParams, Evaluation, Info, Iteration, LbfgsParams, LevelProblem, Minimiser,
    Multilevel, NewtonCgParams, Objective, Observer, SecondOrder, Silent, Status, Stopping,
    minimise_levels,
};
use fe_grid::vector::max_abs_difference;
use fe_grid::{
    Boundary, Buffer, Field, Grid, GridError, LinearOperator, ScalarField, SpectralSolver, vector,
};

/// `1/2 ∫ |∇u|^2 + Σ_j w_j ((u_j^2 - 1)^2 / 4 - f_j u_j)`, the second part by nodal quadrature.
struct DoubleWell {
    stiffness: Matrix,
    metric: SpectralSolver<2>,
    weights: Vec<f64>,
    forces: Vec<f64>,
}

impl DoubleWell {
    fn new(grid: Grid<2>) -> Result<Self, GridError> {
        let last = grid.cells_per_axis();
        let weight = |index: usize| {
            let node = grid.node(index);
            let at_end = |k: usize| node[k] == 0 || node[k] == last[k];
            let halves = (0..2).filter(|&k| at_end(k)).count();
            grid.cell_volume() * 0.5f64.powi(halves as i32)
        };
        let force = |index: usize| {
            let [x, y] = grid.position(grid.node(index));
            8.0 * (6.0 * x + y).sin() * (5.0 * y).cos()
        };
        Ok(Self {
            stiffness: stiffness_matrix(&grid),
            metric: SpectralSolver::new(grid, 2.0, 1.0, Boundary::Natural)?,
            weights: (0..grid.n_nodes()).map(weight).collect(),
            forces: (0..grid.n_nodes()).map(force).collect(),
        })
    }
}

impl Objective for DoubleWell {
    type Error = GridError;

    fn dim(&self) -> usize {
        self.weights.len()
    }

    fn value_and_gradient(&mut self, u: &[f64], g: &mut [f64]) -> Result<Evaluation, GridError> {
        self.stiffness.apply_into(u, g);
        let mut value = 0.5 * vector::dot(u, g);
        for j in 0..u.len() {
            let well = u[j] * u[j] - 1.0;
            value += self.weights[j] * (0.25 * well * well - self.forces[j] * u[j]);
            g[j] += self.weights[j] * (u[j] * well - self.forces[j]);
        }
        Ok(Evaluation::Value(value))
    }

    fn apply_inverse_metric(&mut self, g: &[f64], out: &mut [f64]) -> Result<(), GridError> {
        self.metric.solve_into(g, out);
        Ok(())
    }
}

impl SecondOrder for DoubleWell {
    fn hessian_action(&mut self, u: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), GridError> {
        self.stiffness.apply_into(d, out);
        for j in 0..u.len() {
            out[j] += self.weights[j] * (3.0 * u[j] * u[j] - 1.0) * d[j];
        }
        Ok(())
    }
}

/// 5, 9, 17, 33 nodes a side.
struct Levels {
    grids: Vec<Grid<2>>,
    repaired: Vec<usize>,
    finished: Vec<(usize, usize)>,
}

impl Levels {
    fn new(finest: usize) -> Self {
        Self {
            grids: Grid::cube(finest).hierarchy(5),
            repaired: Vec::new(),
            finished: Vec::new(),
        }
    }
}

impl LevelProblem for Levels {
    type Error = GridError;
    type Objective = DoubleWell;

    fn n_levels(&self) -> usize {
        self.grids.len()
    }

    fn objective(&mut self, level: usize) -> Result<DoubleWell, GridError> {
        DoubleWell::new(self.grids[level])
    }

    fn prolong(&mut self, level: usize, u: &[f64]) -> Result<Buffer<f64>, GridError> {
        let coarse: ScalarField<f64, 2> = Field::from_vec(self.grids[level], u.to_vec())?;
        let fine = Field::<f64, 2, 1>::from_fn(self.grids[level + 1], |x| coarse.sample(x));
        Ok(fine.into_vec().into())
    }

    fn repair(&mut self, level: usize, u: &mut [f64]) -> Result<(), GridError> {
        assert_eq!(u.len(), self.grids[level].n_nodes());
        self.repaired.push(level);
        Ok(())
    }

    fn finish_level(
        &mut self,
        level: usize,
        objective: DoubleWell,
        u: &[f64],
        info: &Info,
    ) -> Result<(), GridError> {
        assert_eq!(objective.dim(), u.len());
        self.finished.push((level, info.iterations));
        Ok(())
    }
}

fn climb<M: Minimiser<DoubleWell>>(method: impl Fn(usize) -> M) -> (Levels, Multilevel) {
    let mut problem = Levels::new(33);
    let start = vec![0.5; problem.grids[0].n_nodes()];
    let result = minimise_levels(&mut problem, method, start, &mut Silent).unwrap();
    (problem, result)
}

fn stopping() -> Stopping {
    Stopping {
        relative_gradient: 1e-5,
        relative_energy: 0.0,
        ..Stopping::default()
    }
}

#[test]
fn every_method_climbs_to_the_same_state() {
    let lbfgs = LbfgsParams {
        stopping: stopping(),
        ..LbfgsParams::default()
    };
    let newton_cg = NewtonCgParams {
        stopping: stopping(),
        ..NewtonCgParams::default()
    };
    let descent = DescentParams {
        stopping: Stopping {
            max_iterations: 1000,
            ..stopping()
        },
        ..DescentParams::default()
    };
    let (problem, by_lbfgs) = climb(|_| lbfgs);
    let (_, by_newton) = climb(|_| newton_cg);
    let (_, by_descent) = climb(|_| descent);

    assert_eq!(problem.repaired, [0, 1, 2, 3]);
    let dims: Vec<usize> = by_lbfgs.levels.iter().map(|l| l.dim).collect();
    assert_eq!(dims, [25, 81, 289, 1089]);
    for result in [&by_lbfgs, &by_newton, &by_descent] {
        for level in &result.levels {
            assert_eq!(level.info.status, Status::GradientTolerance);
            assert!(level.info.energies.windows(2).all(|pair| pair[1] < pair[0]));
            assert!(level.seconds >= 0.0);
        }
    }
    for (level, &(number, iterations)) in by_lbfgs.levels.iter().zip(&problem.finished) {
        assert_eq!((level.level, level.info.iterations), (number, iterations));
    }
    let gradients: usize = (by_newton.levels.iter())
        .map(|level| level.info.evaluations.gradients)
        .sum();
    assert_eq!(by_newton.evaluations().gradients, gradients);
    // The gradient's share 1e-5 of some 1, over a Hessian of at least some .1 in the metric.
    assert!(max_abs_difference(&by_lbfgs.x, &by_newton.x) < 1e-3);
    assert!(max_abs_difference(&by_lbfgs.x, &by_descent.x) < 1e-3);
}

/// The finest level starts close to its minimum: a good part of its descent is done before.
#[test]
fn coarse_levels_save_work_on_the_finest() {
    let params = LbfgsParams {
        stopping: stopping(),
        ..LbfgsParams::default()
    };
    let (problem, climbed) = climb(|_| params);
    let finest = climbed.levels.last().unwrap();
    let mut cold = DoubleWell::new(problem.grids[3]).unwrap();
    let mut u = vec![0.5; cold.dim()];
    let direct = params.minimise(&mut cold, &mut u, &mut Silent).unwrap();
    let excess = |info: &Info| info.energies[0] - direct.energy().unwrap();
    assert!(excess(&finest.info) < 0.05 * excess(&direct));
    assert!(max_abs_difference(&u, &climbed.x) < 1e-3);
}

#[test]
fn cancelling_ends_the_climb() {
    #[derive(Default)]
    struct Impatient {
        levels: Vec<(usize, usize, usize)>,
    }
    impl Observer for Impatient {
        fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
            self.levels.push((level, n_levels, dim));
        }
        fn iteration(&mut self, now: &Iteration<'_>) -> Control {
            if self.levels.len() == 2 && now.iteration == 1 {
                Control::Cancel
            } else {
                Control::Continue
            }
        }
    }
    let mut observer = Impatient::default();
    let mut problem = Levels::new(33);
    let method = |_| LbfgsParams::default();
    let result = minimise_levels(&mut problem, method, vec![0.5; 25], &mut observer).unwrap();
    assert_eq!(observer.levels, [(0, 4, 25), (1, 4, 81)]);
    assert_eq!(result.levels.len(), 2);
    assert_eq!(result.status(), Some(Status::Cancelled));
    assert_eq!(result.x.len(), 81);
}

/// The method may differ from level to level.
#[test]
fn parameters_are_chosen_by_level() {
    let method = |level| LbfgsParams {
        stopping: Stopping {
            max_iterations: level + 1,
            ..stopping()
        },
        ..LbfgsParams::default()
    };
    let (_, result) = climb(method);
    let iterations: Vec<usize> = result.levels.iter().map(|l| l.info.iterations).collect();
    assert_eq!(iterations, [1, 2, 3, 4]);
}

#[test]
fn thinned_grids_of_few_cells_cover_the_box() {
    const MOST_CELLS: usize = 24;
    for nodes in [[4, 9], [128, 40], [65, 257]] {
        let grid = Grid::<2>::with_nodes(nodes, 0.01).unwrap();
        let found = grid.thinned(MOST_CELLS).unwrap();
        assert!(found.cells_per_axis().iter().all(|n| *n <= MOST_CELLS));
        for (own, whole) in found.extent().into_iter().zip(grid.extent()) {
            assert!(own > whole - 1e-12 && own < whole + found.spacing());
        }
    }
}
