//! The least eigenvalue of Hessians with known spectra.

use std::convert::Infallible;

use crate::support::objectives::Quadratic;
use fe_grid::Motion;
use fe_grid::minimise::{
    Curvature, Evaluation, LeastEigenvalue, LeastEigenvalueParams, Objective, SecondOrder,
};
use fe_grid::vector::dot;
use std::f64::consts::PI;
use test_support::on_threads;

/// Half `x · A x` with the second difference matrix, eigenvalues `4 sin^2(k pi / (2 (n + 1)))`, minus a
/// shift, without a preconditioner.
struct Chain {
    shift: f64,
    n: usize,
}

impl Chain {
    fn new(n: usize, shift: f64) -> Self {
        Self { shift, n }
    }

    fn eigenvalue(&self, k: usize) -> f64 {
        let n = self.n as f64;
        4.0 * (k as f64 * PI / (2.0 * (n + 1.0))).sin().powi(2) - self.shift
    }

    fn eigenvector(&self, k: usize) -> Vec<f64> {
        let n = self.n;
        let value = |j: usize| (k as f64 * PI * (j + 1) as f64 / (n + 1) as f64).sin();
        (0..n).map(value).collect()
    }
}

impl Objective for Chain {
    type Error = Infallible;

    fn dim(&self) -> usize {
        self.n
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, Infallible> {
        self.hessian_action(x, x, g)?;
        Ok(Evaluation::Value(0.5 * dot(x, g)))
    }
}

impl SecondOrder for Chain {
    fn hessian_action(&mut self, _: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        for j in 0..d.len() {
            let neighbour = |k: Option<usize>| k.and_then(|k| d.get(k)).copied().unwrap_or(0.0);
            let sides = neighbour(j.checked_sub(1)) + neighbour(Some(j + 1));
            out[j] = (2.0 - self.shift) * d[j] - sides;
        }
        Ok(())
    }
}

fn whole(values: Vec<f64>) -> Motion {
    Motion { first: 0, values }
}

fn accurate() -> LeastEigenvalueParams {
    LeastEigenvalueParams {
        max_actions: 400,
        relative_error: 0.0,
        absolute_error: 1e-13,
    }
}

fn least<O: SecondOrder<Error = Infallible>>(
    params: LeastEigenvalueParams,
    objective: &mut O,
    mass: &[f64],
    motions: &[Motion],
) -> LeastEigenvalue {
    let x = vec![0.0; objective.dim()];
    let Ok(found) = params.find(objective, &x, mass, motions, &[]);
    found.expect("an admissible state")
}

#[test]
fn the_least_eigenvalue_of_a_chain_is_found_with_its_sign() {
    for shift in [0.0, 0.05, 3.0] {
        let mut chain = Chain::new(40, shift);
        let found = least(accurate(), &mut chain, &[1.0; 40], &[]);
        assert!(found.converged, "{found:?}");
        let exact = chain.eigenvalue(1);
        assert!(
            (found.value - exact).abs() < 1e-9,
            "{} {exact}",
            found.value
        );
        let mode = chain.eigenvector(1);
        let cosine = dot(&mode, &found.direction) / dot(&mode, &mode).sqrt();
        assert!((cosine.abs() - 1.0).abs() < 1e-6, "{cosine}");
        // Without the last changes, it is steepest descent: 400 do not suffice.
        assert!(found.actions < 150, "{}", found.actions);
    }
}

/// `theta` is an upper bound, and an eigenvalue lies within the residual of it, whenever the iteration ends.
#[test]
fn bounds_hold_before_convergence() {
    for max_actions in [2, 4, 8, 16, 32] {
        let params = LeastEigenvalueParams {
            max_actions,
            ..accurate()
        };
        let mut chain = Chain::new(40, 0.05);
        let found = least(params, &mut chain, &[1.0; 40], &[]);
        assert!(!found.converged);
        assert_eq!(found.actions, max_actions);
        assert!(found.value >= chain.eigenvalue(1) - 1e-12);
        let distances = (1..=40).map(|k| (chain.eigenvalue(k) - found.value).abs());
        let nearest = distances.fold(f64::INFINITY, f64::min);
        assert!(nearest <= found.residual, "{nearest} {}", found.residual);
    }
}

/// Without its lowest modes a chain has the next one; a motion that is a mixture of two takes out one
/// dimension, not a mode: the least value on `(a v1 + b v2) · v = 0` is between the two.
#[test]
fn motions_are_taken_out() {
    let mut chain = Chain::new(30, 0.5);
    let unit = [1.0; 30];
    let motions = [1, 2].map(|k| whole(chain.eigenvector(k)));
    let found = least(accurate(), &mut chain, &unit, &motions);
    assert!((found.value - chain.eigenvalue(3)).abs() < 1e-9);
    for motion in &motions {
        assert!(dot(&motion.values, &found.direction).abs() < 1e-9);
    }
    let parts = motions[0].values.iter().zip(&motions[1].values);
    let mixed = whole(parts.map(|(a, b)| a + b).collect());
    let found = least(accurate(), &mut chain, &unit, &[mixed]);
    let mean = 0.5 * (chain.eigenvalue(1) + chain.eigenvalue(2));
    assert!((found.value - mean).abs() < 1e-9, "{} {mean}", found.value);
}

/// Eigenvalues of a diagonal Hessian are ratios of curvatures and masses: here with the least ratio where the
/// curvature is not the least. The preconditioner changes the work, not the value, and so does a guess.
#[test]
fn eigenvalues_are_relative_to_the_mass() {
    let mut diagonal = Quadratic {
        curvatures: vec![5.0, 1.0, 3.0, 8.0, -2.0, 7.0],
        minimum: vec![0.0; 6],
        exact_metric: false,
    };
    // Without the fifth.
    let fifth = Motion {
        first: 4,
        values: vec![1.0],
    };
    let mass = [1.0, 1.0, 30.0, 1.0, 1.0, 2.0];
    let found = least(accurate(), &mut diagonal, &mass, &[fifth]);
    assert!((found.value - 0.1).abs() < 1e-9, "{}", found.value);
    let size: f64 = found
        .direction
        .iter()
        .zip(&mass)
        .map(|(v, m)| m * v * v)
        .sum();
    assert!((size - 1.0).abs() < 1e-9, "{size}");
    let found = least(accurate(), &mut diagonal, &mass, &[]);
    assert!((found.value + 2.0).abs() < 1e-9, "{}", found.value);
    let mut guess = vec![0.0; 6];
    guess[4] = 3.0;
    let Ok(guessed) = accurate().find(&mut diagonal, &[0.0; 6], &mass, &[], &[guess]);
    let guessed = guessed.unwrap();
    assert!(
        (guessed.value + 2.0).abs() < 1e-12 && guessed.actions == 3,
        "{guessed:?}"
    );
    // Unknowns of almost no mass follow the others: a chain of which only the middle has one is a spring of
    // stiffness 1 / (A^-1)_mm, (A^-1)_55 = 5 * 5 / 10.
    let mut mass = [1e-5; 9];
    mass[4] = 1.0;
    let found = least(accurate(), &mut Chain::new(9, 0.0), &mass, &[]);
    assert!((found.value - 0.4).abs() < 1e-4, "{}", found.value);
}

#[test]
fn inadmissible_states_and_dependent_motions_have_none() {
    struct Folded;
    impl Objective for Folded {
        type Error = Infallible;
        fn dim(&self) -> usize {
            1
        }
        fn value_and_gradient(
            &mut self,
            _: &[f64],
            _: &mut [f64],
        ) -> Result<Evaluation, Infallible> {
            Ok(Evaluation::Inadmissible)
        }
    }
    impl SecondOrder for Folded {
        fn hessian_action(
            &mut self,
            _: &[f64],
            _: &[f64],
            _: &mut [f64],
        ) -> Result<(), Infallible> {
            Ok(())
        }
    }
    let Ok(found) = accurate().find(&mut Folded, &[0.0], &[1.0], &[], &[]);
    assert!(found.is_none());
    let mut chain = Chain::new(3, 0.0);
    let same = vec![whole(vec![1.0, 0.0, 0.0]); 2];
    let Ok(found) = accurate().find(&mut chain, &[0.0; 3], &[1.0; 3], &same, &[]);
    assert!(found.is_none());
}

#[test]
fn the_least_eigenvalue_has_the_same_bits_on_any_number_of_threads() {
    let n = 70_000;
    let value = |threads| {
        let found = on_threads(threads, || {
            let params = LeastEigenvalueParams {
                max_actions: 6,
                ..accurate()
            };
            let motion = whole(vec![1.0; n]);
            let found = least(params, &mut Chain::new(n, 0.0), &vec![1.0; n], &[motion]);
            (found.value, found.residual)
        });
        (found.0.to_bits(), found.1.to_bits())
    };
    assert_eq!(value(1), value(3));
}

/// The sum of `a_j x_j^2 / 2 + x_j^4 / 8`.
struct DoubleWell([f64; 3]);

impl Objective for DoubleWell {
    type Error = Infallible;

    fn dim(&self) -> usize {
        3
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, Infallible> {
        let mut energy = 0.0;
        for ((x, g), a) in x.iter().zip(g).zip(&self.0) {
            energy += 0.5 * a * x * x + 0.125 * x.powi(4);
            *g = a * x + 0.5 * x.powi(3);
        }
        Ok(Evaluation::Value(energy))
    }
}

impl SecondOrder for DoubleWell {
    fn hessian_action(&mut self, x: &[f64], d: &[f64], out: &mut [f64]) -> Result<(), Infallible> {
        for j in 0..3 {
            out[j] = (self.0[j] + 1.5 * x[j] * x[j]) * d[j];
        }
        Ok(())
    }
}

/// At the middle of a double well the least eigenvalue is that of the only unknown with two wells, and the
/// energy falls by up to `a^2 / (4 b)`.
#[test]
fn the_energy_falls_from_a_saddle() {
    let mut well = DoubleWell([2.0, -0.04, 3.0]);
    let Ok(found) =
        LeastEigenvalueParams::default().find(&mut well, &[0.0; 3], &[1.0; 3], &[], &[]);
    let found = found.unwrap();
    assert!((found.value + 0.04).abs() < 1e-4, "{}", found.value);
    // A step of .28 ends at the bottom of a well, at sqrt(a / b).
    let bottom = (0.04f64 / 0.5).sqrt();
    let Ok(curvature) = Curvature::along(&found, &mut well, &[0.0; 3], bottom, 2.0);
    let curvature = curvature.unwrap();
    let depth = 0.04f64.powi(2) / (4.0 * 0.5);
    assert!((curvature.fall - depth / 2.0).abs() < 1e-6, "{curvature:?}");
    // Twice the energy at the bottom, over the square of the step.
    let second = -2.0 * depth / (bottom * bottom);
    assert!(
        (curvature.measured.unwrap() - second).abs() < 1e-4,
        "{curvature:?}"
    );
}
