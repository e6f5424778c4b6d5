//! The minimisers on problems with known solutions.

use std::convert::Infallible;

use crate::support::objectives::{Barrier, DoubleWells, Quadratic, Rosenbrock};
use fe_grid::minimise::{
    Control, DescentParams, Evaluation, Evaluations, Info, Iteration, LbfgsParams, LineSearch,
    Minimiser, NewtonCgParams, Objective, Observer, Silent, Status, Stopping,
};
use fe_grid::random::noise;
use fe_grid::vector::max_abs_difference;
use test_support::on_threads;

/// Runs a method and checks what holds for every run: energies fall throughout, and the record
/// is complete and agrees with the state.
fn run<O: Objective<Error = Infallible>>(
    method: &impl Minimiser<O>,
    objective: &mut O,
    x: &mut [f64],
) -> Info {
    let Ok(info) = method.minimise(objective, x, &mut Silent);
    assert!(
        info.energies.windows(2).all(|pair| pair[1] < pair[0]),
        "{:?}",
        info.energies
    );
    assert_eq!(info.energies.len(), info.iterations + 1);
    let mut gradient = vec![0.0; x.len()];
    let Ok(last) = objective.value_and_gradient(x, &mut gradient);
    assert_eq!(Some(last), info.energy().map(Evaluation::Value));
    info
}

/// By the gradient alone, so that counts do not depend on the last digits of the energy.
fn by_gradient(relative_gradient: f64, max_iterations: usize) -> Stopping {
    Stopping {
        relative_gradient,
        relative_energy: 0.0,
        max_iterations,
        ..Stopping::default()
    }
}

fn lbfgs() -> LbfgsParams {
    LbfgsParams {
        stopping: by_gradient(1e-8, 200),
        ..LbfgsParams::default()
    }
}

fn newton_cg() -> NewtonCgParams {
    NewtonCgParams {
        stopping: by_gradient(1e-8, 200),
        ..NewtonCgParams::default()
    }
}

fn descent() -> DescentParams {
    DescentParams {
        stopping: by_gradient(1e-6, 50_000),
        ..DescentParams::default()
    }
}

/// Curvatures from 1 to `condition`, evenly spread on the logarithmic scale.
fn quadratic(dim: usize, condition: f64, exact_metric: bool) -> Quadratic {
    let curvature = |j: usize| condition.powf(j as f64 / (dim - 1) as f64);
    Quadratic {
        curvatures: (0..dim).map(curvature).collect(),
        minimum: noise(dim, 11),
        exact_metric,
    }
}

#[test]
fn all_methods_find_the_minimum_of_a_quadratic() {
    let mut problem = quadratic(20, 30.0, false);
    let minimum = problem.minimum.clone();
    let mut check = |method: &dyn Minimiser<Quadratic>, tolerance: f64| {
        let mut x = vec![2.0; 20];
        let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(info.status, Status::GradientTolerance);
        assert!(
            max_abs_difference(&x, &minimum) < tolerance,
            "{}",
            max_abs_difference(&x, &minimum)
        );
    };
    // The gradient is as large as 30 times the offset: the tolerance times the condition.
    check(&lbfgs(), 1e-6);
    check(&newton_cg(), 1e-6);
    check(&descent(), 1e-4);
}

/// With the inverse Hessian as metric the first step lands on the minimum, however stretched.
#[test]
fn an_exact_metric_makes_one_step_of_it() {
    for condition in [1e2, 1e8] {
        let mut problem = quadratic(50, condition, true);
        let mut x = vec![0.0; 50];
        assert_eq!(run(&lbfgs(), &mut problem, &mut x).iterations, 1);
        // Offsets of size 1 lose the last digit or two.
        assert!(max_abs_difference(&x, &problem.minimum) < 1e-14);
        let mut x = vec![0.0; 50];
        assert_eq!(run(&newton_cg(), &mut problem, &mut x).iterations, 1);
        let mut x = vec![0.0; 50];
        assert_eq!(run(&descent(), &mut problem, &mut x).iterations, 1);
    }
}

/// Memory and second derivatives take the square root of the condition number off.
#[test]
fn ill_conditioned_quadratic_without_a_metric() {
    let iterations = |method: &dyn Minimiser<Quadratic>| {
        let mut x = vec![0.0; 40];
        let Ok(info) = method.minimise(&mut quadratic(40, 1e4, false), &mut x, &mut Silent);
        assert_eq!(info.status, Status::GradientTolerance);
        info.iterations
    };
    let stopping = by_gradient(1e-5, 100_000);
    let fast = iterations(&LbfgsParams {
        stopping,
        ..lbfgs()
    });
    let slow = iterations(&DescentParams {
        stopping,
        ..descent()
    });
    assert!(10 * fast < slow, "{fast} {slow}");
}

#[test]
fn rosenbrock_valley() {
    let start = [-1.2, 1.0, -0.5, 2.0, 3.0, -1.0];
    let ones = [1.0; 6];
    let mut x = start;
    let info = run(&lbfgs(), &mut Rosenbrock { dim: 6 }, &mut x);
    assert_eq!(info.status, Status::GradientTolerance);
    // The valley's curvature is about .4: the offset is the gradient (1e-8 of some 1e3) over it.
    assert!(max_abs_difference(&x, &ones) < 1e-4);

    let mut x = start;
    let info = run(&newton_cg(), &mut Rosenbrock { dim: 6 }, &mut x);
    assert_eq!(info.status, Status::GradientTolerance);
    assert!(max_abs_difference(&x, &ones) < 1e-4);
}

/// The Hessian is indefinite at both starts. From the second the first direction of the inner
/// solve has negative curvature already, so that the first step is steepest descent.
#[test]
fn negative_curvature_is_survived() {
    let mut x = [0.1, 3.0];
    let info = run(&newton_cg(), &mut Rosenbrock { dim: 2 }, &mut x);
    assert_eq!(info.status, Status::GradientTolerance);
    assert!(max_abs_difference(&x, &[1.0, 1.0]) < 1e-4);

    let mut x = [0.1, -0.3, 0.05];
    let info = run(&newton_cg(), &mut DoubleWells { dim: 3 }, &mut x);
    assert_eq!(info.status, Status::GradientTolerance);
    assert!(max_abs_difference(&x, &[1.0, -1.0, 1.0]) < 1e-6);

    let one_step = NewtonCgParams {
        stopping: by_gradient(1e-8, 1),
        ..newton_cg()
    };
    let mut x = [0.1, -0.3, 0.05];
    let info = run(&one_step, &mut DoubleWells { dim: 3 }, &mut x);
    assert_eq!(info.evaluations.hessian_actions, 1);
    assert_eq!(x[0], 0.1 - 0.1 * (0.1 * 0.1 - 1.0));
}

/// The minimum lies close to the wall: full steps run into it and are halved.
#[test]
fn inadmissible_states_only_shorten_the_step() {
    let slopes: Vec<f64> = (1..=30).map(|j| f64::from(j) * 4.0).collect();
    let minimum: Vec<f64> = slopes.iter().map(|c| 0.5 / c).collect();
    let check = |method: &dyn Minimiser<Barrier>| {
        let mut problem = Barrier::new(slopes.clone(), 0.5);
        let mut x = vec![3.0; 30];
        let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(info.status, Status::GradientTolerance);
        assert!(problem.inadmissible_trials > 0, "the wall was met");
        assert!(info.energies.windows(2).all(|pair| pair[1] < pair[0]));
        // Relative offset x'/x = P g in units of the Hessian: the gradient's share, 1e-6 of some
        // 1e3, where only the first metric was used.
        assert!(max_abs_difference(&x, &minimum) < 1e-3);
    };
    check(&LbfgsParams {
        metric_interval: 5,
        ..lbfgs()
    });
    check(&newton_cg());
    check(&DescentParams {
        metric_interval: 1,
        ..descent()
    });
}

#[test]
fn an_inadmissible_start_is_a_status() {
    let mut x = [1.0, -1.0];
    let mut problem = Barrier::new(vec![1.0; 2], 1.0);
    for method in [
        &lbfgs() as &dyn Minimiser<Barrier>,
        &newton_cg(),
        &descent(),
    ] {
        let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(info.status, Status::InadmissibleStart);
        assert_eq!((info.iterations, info.energy()), (0, None));
        assert_eq!(x, [1.0, -1.0]);
    }
}

#[test]
fn a_start_at_the_minimum_stays_there() {
    let mut problem = quadratic(5, 10.0, false);
    let mut x = problem.minimum.clone();
    for method in [
        &lbfgs() as &dyn Minimiser<Quadratic>,
        &newton_cg(),
        &descent(),
    ] {
        let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(
            (info.status, info.iterations),
            (Status::GradientTolerance, 0)
        );
        assert_eq!(x, problem.minimum);
    }
}

/// Energies that are not finite, whatever the objective claims, are not accepted.
#[test]
fn infinite_energies_are_inadmissible() {
    struct Cliff;
    impl Objective for Cliff {
        type Error = Infallible;
        fn dim(&self) -> usize {
            1
        }
        fn value_and_gradient(
            &mut self,
            x: &[f64],
            g: &mut [f64],
        ) -> Result<Evaluation, Infallible> {
            g[0] = x[0];
            // -∞ below .4, where a full step from 1 lands: as a number it would look splendid.
            let energy = if x[0] < 0.4 {
                f64::NEG_INFINITY
            } else {
                0.5 * x[0] * x[0]
            };
            Ok(Evaluation::Value(energy))
        }
    }
    let mut x = [1.0];
    let params = LbfgsParams {
        stopping: Stopping {
            max_iterations: 1,
            ..Stopping::default()
        },
        ..LbfgsParams::default()
    };
    let info = run(&params, &mut Cliff, &mut x);
    assert_eq!((x[0], info.iterations), (0.5, 1));
}

/// A metric that points uphill ends the run with a word of its own, not as converged.
#[test]
fn a_metric_of_the_wrong_sign_is_named() {
    let mut problem = Quadratic {
        curvatures: vec![-1.0, -1.0],
        minimum: vec![0.0, 0.0],
        exact_metric: true,
    };
    let mut x = [1.0, 2.0];
    for method in [
        &lbfgs() as &dyn Minimiser<Quadratic>,
        &newton_cg(),
        &descent(),
    ] {
        let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(info.status, Status::IndefiniteMetric);
    }
}

/// Straight down without end: every iteration is used, or the energy overflows and the search
/// gives up; nothing hangs.
#[test]
fn energies_without_a_minimum_end() {
    let mut problem = Quadratic {
        curvatures: vec![-1.0],
        minimum: vec![0.0],
        exact_metric: false,
    };
    for method in [
        &lbfgs() as &dyn Minimiser<Quadratic>,
        &newton_cg(),
        &descent(),
    ] {
        let mut x = [1.0];
        let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
        assert!(matches!(
            info.status,
            Status::MaxIterations | Status::LineSearchFailed
        ));
        assert!(info.energies.windows(2).all(|pair| pair[1] < pair[0]));
    }
}

#[test]
fn a_wrong_gradient_ends_in_a_failed_line_search() {
    struct Liar;
    impl Objective for Liar {
        type Error = Infallible;
        fn dim(&self) -> usize {
            1
        }
        fn value_and_gradient(
            &mut self,
            x: &[f64],
            g: &mut [f64],
        ) -> Result<Evaluation, Infallible> {
            g[0] = -1.0;
            Ok(Evaluation::Value(x[0]))
        }
    }
    let mut x = [0.0];
    let search = LineSearch {
        max_trials: 7,
        ..LineSearch::default()
    };
    let info = run(
        &LbfgsParams {
            line_search: search,
            ..lbfgs()
        },
        &mut Liar,
        &mut x,
    );
    assert_eq!(
        (info.status, info.iterations, x[0]),
        (Status::LineSearchFailed, 0, 0.0)
    );
    assert_eq!(
        (info.evaluations.gradients, info.evaluations.values),
        (2, 6)
    );
}

/// A part that the energy cannot lose does not count; else the stall is seen too early.
#[test]
fn a_stall_is_measured_by_the_scale_of_the_energy() {
    struct Lifted(Rosenbrock, f64);
    impl Objective for Lifted {
        type Error = Infallible;
        fn dim(&self) -> usize {
            self.0.dim()
        }
        fn value_and_gradient(
            &mut self,
            x: &[f64],
            g: &mut [f64],
        ) -> Result<Evaluation, Infallible> {
            let Ok(Evaluation::Value(energy)) = self.0.value_and_gradient(x, g) else {
                return Ok(Evaluation::Inadmissible);
            };
            Ok(Evaluation::Value(energy + 1e4))
        }
        fn energy_scale(&self, energy: f64) -> f64 {
            energy - self.1
        }
    }
    let last = |fixed_part| {
        let stopping = Stopping {
            relative_gradient: 0.0,
            relative_energy: 1e-3,
            ..Stopping::default()
        };
        let params = LbfgsParams {
            stopping,
            ..LbfgsParams::default()
        };
        let info = run(
            &params,
            &mut Lifted(Rosenbrock { dim: 2 }, fixed_part),
            &mut [-1.2, 1.0],
        );
        assert!(matches!(
            info.status,
            Status::EnergyTolerance | Status::LineSearchFailed
        ));
        info.energy().unwrap() - 1e4
    };
    assert!(last(0.0) > 1e-2);
    assert!(last(1e4) < 1e-6);
}

struct Watcher {
    cancel_at: usize,
    seen: Vec<(usize, f64, Vec<f64>)>,
}

impl Observer for Watcher {
    fn iteration(&mut self, now: &Iteration<'_>) -> Control {
        self.seen.push((now.iteration, now.energy, now.x.to_vec()));
        assert_eq!(now.step_length == 0.0, now.iteration == 0);
        if now.iteration == self.cancel_at {
            Control::Cancel
        } else {
            Control::Continue
        }
    }
}

#[test]
fn an_observer_sees_every_state_and_can_cancel() {
    for method in [
        &lbfgs() as &dyn Minimiser<Rosenbrock>,
        &newton_cg(),
        &descent(),
    ] {
        let mut watcher = Watcher {
            cancel_at: 4,
            seen: Vec::new(),
        };
        let mut x = vec![-1.2, 1.0];
        let Ok(info) = method.minimise(&mut Rosenbrock { dim: 2 }, &mut x, &mut watcher);
        assert_eq!((info.status, info.iterations), (Status::Cancelled, 4));
        let energies: Vec<f64> = watcher.seen.iter().map(|s| s.1).collect();
        assert_eq!(energies, info.energies);
        let numbers: Vec<usize> = watcher.seen.iter().map(|s| s.0).collect();
        assert_eq!(numbers, [0, 1, 2, 3, 4]);
        assert_eq!(watcher.seen[4].2, x);
    }
}

/// A longer run than the memory holds, so that the ring turns over, with a metric that is remade.
#[test]
fn the_memory_is_a_ring() {
    let mut problem = quadratic(60, 1e3, false);
    let iterations = [3, 8, 60].map(|history| {
        let params = LbfgsParams {
            history,
            stopping: by_gradient(1e-8, 2000),
            ..lbfgs()
        };
        let mut x = vec![0.0; 60];
        let info = run(&params, &mut problem, &mut x);
        assert_eq!(info.status, Status::GradientTolerance);
        assert!(max_abs_difference(&x, &problem.minimum) < 1e-5);
        info.iterations
    });
    assert!(
        iterations[0] > 20 && iterations[2] < iterations[0],
        "{iterations:?}"
    );
    // Without memory the method is descent with the full step tried first.
    let params = LbfgsParams {
        history: 0,
        stopping: by_gradient(1e-2, 2000),
        ..lbfgs()
    };
    let info = run(&params, &mut problem, &mut vec![0.0; 60]);
    assert_eq!(info.status, Status::GradientTolerance);
}

#[test]
fn same_bits_on_any_number_of_threads() {
    let dim = 100_000;
    let bits = |threads: usize, method: &(dyn Minimiser<Quadratic> + Sync)| {
        let mut problem = quadratic(dim, 100.0, false);
        let mut x = vec![0.0; dim];
        on_threads(threads, || {
            let Ok(info) = method.minimise(&mut problem, &mut x, &mut Silent);
            assert!(info.iterations > 3);
        });
        x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    let stopping = by_gradient(1e-8, 8);
    let lbfgs = LbfgsParams {
        history: 3,
        stopping,
        ..lbfgs()
    };
    let newton_cg = NewtonCgParams {
        stopping,
        ..newton_cg()
    };
    let descent = DescentParams {
        stopping,
        ..descent()
    };
    assert!(bits(1, &lbfgs) == bits(2, &lbfgs));
    assert!(bits(1, &newton_cg) == bits(2, &newton_cg));
    assert!(bits(1, &descent) == bits(2, &descent));
}

/// The work done on a fixed problem: a method that gets slower fails here. A count may change
/// with the method; then the new one belongs here, with a reason in the commit.
#[test]
fn work_snapshot() {
    let start = [-1.2, 1.0, -0.5, 2.0, 3.0, -1.0];
    let work = |method: &dyn Minimiser<Rosenbrock>| {
        let Ok(info) = method.minimise(&mut Rosenbrock { dim: 6 }, &mut start.clone(), &mut Silent);
        (info.iterations, info.evaluations)
    };
    let lbfgs_work = Evaluations {
        values: 73,
        gradients: 144,
        metric_applications: 89,
        metric_builds: 6,
        hessian_actions: 0,
    };
    assert_eq!(work(&lbfgs()), (88, lbfgs_work));
    let newton_work = Evaluations {
        values: 25,
        gradients: 69,
        metric_applications: 167,
        metric_builds: 48,
        hessian_actions: 128,
    };
    assert_eq!(work(&newton_cg()), (47, newton_work));
    // Thousands of steps, so an order of magnitude must do.
    let (iterations, descent_work) = work(&descent());
    assert!((2_000..10_000).contains(&iterations));
    assert_eq!(descent_work.metric_applications, iterations + 1);
    assert_eq!(descent_work.metric_builds, 1);
    assert!(descent_work.energies() < 4 * iterations);
}
