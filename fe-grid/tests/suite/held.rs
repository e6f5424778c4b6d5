//! Held unknowns: they stay, and the others solve their equations.

use approx::assert_relative_eq;
use fe_grid::minimise::{
    Evaluation, LbfgsParams, Minimiser, NewtonCgParams, Objective, SecondOrder, Silent, Stopping,
    gradient_errors, hessian_errors,
};
use fe_grid::operators::MassStiffness;
use fe_grid::random::noise;
use fe_grid::{
    CgParams, CgStatus, Grid, GridError, HeldValues, Identity, LinearOperator, UniformOperator,
    vector,
};
use proptest::prelude::*;

fn operator<const D: usize>(grid: Grid<D>) -> UniformOperator<D> {
    let coefficients = MassStiffness {
        mass: 0.5,
        stiffness: 1.0,
    };
    UniformOperator::new(grid, coefficients)
}

fn applied(a: &impl LinearOperator, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    a.apply_into(x, &mut y);
    y
}

/// `1/2 u . A u + 1/4 sum u^4 - b . u`.
struct Quartic<const D: usize> {
    operator: UniformOperator<D>,
    b: Vec<f64>,
}

impl<const D: usize> Objective for Quartic<D> {
    type Error = GridError;

    fn dim(&self) -> usize {
        self.b.len()
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GridError> {
        self.operator.apply_into(x, gradient);
        let quadratic = 0.5 * vector::dot(gradient, x) - vector::dot(&self.b, x);
        let quartic: f64 = x.iter().map(|x| 0.25 * x.powi(4)).sum();
        for ((g, x), b) in gradient.iter_mut().zip(x).zip(&self.b) {
            *g += x.powi(3) - b;
        }
        Ok(Evaluation::Value(quadratic + quartic))
    }
}

impl<const D: usize> SecondOrder for Quartic<D> {
    fn hessian_action(&mut self, x: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), GridError> {
        self.operator.apply_into(d, out);
        for ((out, x), d) in out.iter_mut().zip(x).zip(d) {
            *out += 3.0 * x * x * d;
        }
        Ok(())
    }
}

fn quartic<const D: usize>(grid: Grid<D>, seed: u64) -> Quartic<D> {
    Quartic {
        operator: operator(grid),
        b: noise(grid.n_nodes(), seed),
    }
}

/// Holds every unknown with the probability 3/10.
fn some(dim: usize, seed: u64) -> HeldValues {
    let chance = noise(dim, seed);
    HeldValues::new(dim, |i| chance[i] > 0.4)
}

fn solves<const D: usize>(grid: Grid<D>, seed: u64) -> Result<(), TestCaseError> {
    let n = grid.n_nodes();
    let (a, held, b) = (operator(grid), some(n, seed), noise(n, seed + 1));
    let start = noise(n, seed + 2);
    let mut x = start.clone();
    let params = CgParams {
        relative_tolerance: 1e-12,
        ..CgParams::default()
    };
    let info = held
        .solve(&a, &Identity { dim: n }, &b, &mut x, &params)
        .unwrap();
    prop_assert_eq!(info.status, CgStatus::Converged);
    let image = applied(&a, &x);
    for i in 0..n {
        if held.is_held(i) {
            prop_assert_eq!(x[i], start[i]);
        } else {
            // Rows of b of the size of 1, solved to 1e-12 of the norm of all.
            prop_assert!(
                (image[i] - b[i]).abs() < 1e-9,
                "row {}: {}",
                i,
                image[i] - b[i]
            );
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn free_rows_are_solved_and_held_values_stay(seed in 0u64..1_000_000) {
        solves(Grid::<2>::cube(7), seed)?;
        solves(Grid::<3>::cube(4), seed)?;
    }

    #[test]
    fn held_operators_are_symmetric_and_positive(seed in 0u64..1_000_000) {
        let grid = Grid::<2>::cube(6);
        let n = grid.n_nodes();
        let held = some(n, seed);
        let a = held.operator(operator(grid));
        let [x, y] = [1, 2].map(|s| noise(n, seed + s));
        let [ax, ay] = [&x, &y].map(|x| applied(&a, x));
        // Sums of some hundred products of the size of 1.
        prop_assert!((vector::dot(&ax, &y) - vector::dot(&x, &ay)).abs() < 1e-12);
        prop_assert!(vector::dot(&ax, &x) > 0.0);
    }

    #[test]
    fn minimisers_keep_held_values_and_find_one_minimum(seed in 0u64..1_000_000) {
        let grid = Grid::<2>::cube(6);
        let held = some(grid.n_nodes(), seed);
        let start = noise(grid.n_nodes(), seed + 1);
        let mut objective = held.objective(quartic(grid, seed + 2));
        let stopping = Stopping {
            relative_gradient: 1e-9,
            relative_decrement: 0.0,
            relative_energy: 0.0,
            ..Stopping::default()
        };
        let lbfgs = LbfgsParams { stopping, ..LbfgsParams::default() };
        let newton = NewtonCgParams { stopping, ..NewtonCgParams::default() };
        let mut found = Vec::new();
        for method in [&lbfgs as &dyn Minimiser<_>, &newton] {
            let mut x = start.clone();
            method.minimise(&mut objective, &mut x, &mut Silent).unwrap();
            for &i in held.indices() {
                prop_assert_eq!(x[i], start[i]);
            }
            found.push(x);
        }
        // A convex energy with curvatures between .02 and some 10; gradients of the size of 10, times the
        // tolerance.
        prop_assert!(vector::max_abs_difference(&found[0], &found[1]) < 1e-6);
    }
}

#[test]
fn faces_and_masks_are_the_nodes_they_say() {
    let grid = Grid::<3>::with_nodes([4, 5, 6], 0.1).unwrap();
    let faces = HeldValues::on_faces(&grid, 2);
    let inner = 2 * 3 * 4;
    assert_eq!(faces.dim(), 2 * grid.n_nodes());
    assert_eq!(faces.indices().len(), 2 * (grid.n_nodes() - inner));
    let plane = HeldValues::at_nodes(&grid, 2, |node| node[2] == 3);
    assert_eq!(plane.indices().len(), 2 * 4 * 5);
    assert!(
        plane
            .indices()
            .iter()
            .all(|i| grid.node(i % grid.n_nodes())[2] == 3)
    );
    let mut x = vec![1.0; plane.dim()];
    plane.project(&mut x);
    assert_relative_eq!(
        vector::sum(&x),
        (plane.dim() - plane.indices().len()) as f64
    );
}

/// An objective whose gradient is 1 % too large.
struct Wrong(Quartic<2>);
impl Objective for Wrong {
    type Error = GridError;
    fn dim(&self) -> usize {
        self.0.dim()
    }
    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, GridError> {
        let value = self.0.value_and_gradient(x, g);
        vector::scale(1.01, g);
        value
    }
}

/// An error in a derivative shows, and a right one has the second order.
#[test]
fn differences_tell_right_derivatives_from_wrong_ones() {
    let grid = Grid::<2>::cube(6);
    let n = grid.n_nodes();
    let [x, direction, test] = [1, 2, 3].map(|seed| noise(n, seed));
    let steps = [1e-1, 1e-2];
    let mut right = quartic(grid, 4);
    let second_order = |errors: &[(f64, f64)]| {
        let order = (errors[0].1 / errors[1].1).log10();
        // The fourth order of a quartic is small at these steps.
        assert!((order - 2.0).abs() < 0.05, "{errors:?}");
    };
    second_order(&gradient_errors(&mut right, &x, &direction, &steps).unwrap());
    second_order(&hessian_errors(&mut right, &x, &direction, &test, &steps).unwrap());
    let wrong = gradient_errors(&mut Wrong(quartic(grid, 4)), &x, &direction, &[1e-4]).unwrap();
    assert_relative_eq!(wrong[0].1, 0.01 / 1.01, epsilon = 1e-6);
}
