//! Runs of minimisers resume from their memory to the same bits.

use fe_grid::GridError;
use fe_grid::minimise::{
    Control, Evaluation, Info, Iteration, LbfgsParams, Memory, Minimiser, NewtonCgParams,
    Objective, Observer, SecondOrder, Stopping,
};

const DIM: usize = 12;

/// A chain of Rosenbrock's functions whose value depends a little on the evaluations before, as
/// that of an iterative solver with an initial guess does, and whose metric is remade.
#[derive(Default)]
struct Chain {
    guess: f64,
    metric: Vec<f64>,
}

impl Objective for Chain {
    type Error = GridError;

    fn dim(&self) -> usize {
        DIM
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, GridError> {
        gradient.fill(0.0);
        let mut value = 0.0;
        for i in 0..DIM - 1 {
            let (a, b) = (1.0 - x[i], x[i + 1] - x[i] * x[i]);
            value += a * a + 100.0 * b * b;
            gradient[i] += -2.0 * a - 400.0 * x[i] * b;
            gradient[i + 1] += 200.0 * b;
        }
        // Relative to the value, so that the energies still decrease.
        value *= 1.0 + 1e-9 * (1e6 * self.guess).sin();
        self.guess = 0.5 * self.guess + 0.1 * x[0];
        Ok(Evaluation::Value(value))
    }

    fn apply_inverse_metric(&mut self, gradient: &[f64], out: &mut [f64]) -> Result<(), GridError> {
        for ((out, g), m) in out.iter_mut().zip(gradient).zip(&self.metric) {
            *out = g / m;
        }
        Ok(())
    }

    fn update_metric(&mut self, x: &[f64]) -> Result<(), GridError> {
        self.metric = x
            .iter()
            .map(|x| 202.0 + 800.0 * x * x + self.guess)
            .collect();
        Ok(())
    }

    fn memory(&self) -> Vec<f64> {
        vec![self.guess]
    }

    fn restore(&mut self, memory: &[f64]) {
        self.guess = memory[0];
    }
}

impl SecondOrder for Chain {
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), GridError> {
        out.fill(0.0);
        for i in 0..DIM - 1 {
            let [d, e] = [direction[i], direction[i + 1]];
            out[i] += (2.0 + 1200.0 * x[i] * x[i] - 400.0 * x[i + 1]) * d - 400.0 * x[i] * e;
            out[i + 1] += 200.0 * e - 400.0 * x[i] * d;
        }
        Ok(())
    }
}

/// Keeps every memory and every energy, and offers a memory to resume from.
#[derive(Default)]
struct Keeper {
    offered: Option<Memory<'static>>,
    kept: Vec<Memory<'static>>,
    energies: Vec<f64>,
}

impl Observer for Keeper {
    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.energies.push(iteration.energy);
        Control::Continue
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        self.offered.take()
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.kept.push(memory.clone().into_owned());
    }

    fn remembers(&mut self, _ended: bool) -> bool {
        true
    }
}

fn stopping() -> Stopping {
    Stopping {
        relative_gradient: 1e-4,
        max_iterations: 60,
        ..Stopping::default()
    }
}

fn lbfgs(compact: bool) -> LbfgsParams {
    LbfgsParams {
        compact,
        history: 4,
        metric_interval: 5,
        stopping: stopping(),
        ..LbfgsParams::default()
    }
}

fn newton_cg(metric_interval: usize) -> NewtonCgParams {
    NewtonCgParams {
        metric_interval,
        stopping: stopping(),
        ..NewtonCgParams::default()
    }
}

fn run(method: &impl Minimiser<Chain>, keeper: &mut Keeper, start: f64) -> (Info, Vec<f64>) {
    let mut x = vec![start; DIM];
    let info = method.minimise(&mut Chain::default(), &mut x, keeper);
    (info.unwrap(), x)
}

#[test]
fn a_resumed_run_has_the_bits_of_the_whole() {
    check_resumed(&lbfgs(false), 5, 30);
}

/// Its memory has the pairs in single precision, which they are rounded from again.
#[test]
fn a_resumed_compact_run_has_the_bits_of_the_whole() {
    check_resumed(&lbfgs(true), 5, 30);
}

#[test]
fn a_resumed_run_of_newtons_method_has_the_bits_of_the_whole() {
    check_resumed(&newton_cg(1), 1, 8);
    check_resumed(&newton_cg(3), 3, 8);
}

/// Of a method whose metric is remade after so many iterations, and which takes more than `least` of them.
fn check_resumed(method: &impl Minimiser<Chain>, interval: usize, least: usize) {
    let run = |keeper: &mut Keeper, start| run(method, keeper, start);
    let mut keeper = Keeper::default();
    let (whole, x) = run(&mut keeper, -0.7);
    assert!(whole.iterations > least, "{whole:?}");
    let (end, within) = keeper.kept.split_last().unwrap();
    assert_eq!(within.len(), whole.iterations.div_ceil(interval));
    for (k, memory) in within.iter().enumerate() {
        assert_eq!(memory.energies.len(), interval * k + 1);
        let mut later = Keeper {
            offered: Some(memory.clone()),
            ..Keeper::default()
        };
        // The state that it is started with does not matter.
        let (resumed, reached) = run(&mut later, 3.0);
        assert_eq!(resumed, whole, "memory {k}");
        assert_eq!(reached, x, "memory {k}");
        assert_eq!(later.energies, keeper.energies[interval * k + 1..]);
        assert!(later.kept == keeper.kept[k + 1..]);
    }
    // From the end nothing is computed.
    let mut later = Keeper {
        offered: Some(end.clone()),
        ..Keeper::default()
    };
    assert_eq!(run(&mut later, 3.0), (whole, x));
    assert!(later.energies.is_empty() && later.kept.is_empty());
}

#[test]
fn a_memory_that_does_not_fit_is_ignored() {
    let run = |keeper: &mut Keeper, start| run(&lbfgs(false), keeper, start);
    let mut keeper = Keeper::default();
    let (whole, x) = run(&mut keeper, -0.7);
    let memory = keeper.kept[3].clone();
    let short = Memory {
        gradient: vec![0.0; DIM - 1].into(),
        ..memory.clone()
    };
    let mut many = memory;
    many.pairs = [many.pairs.clone(), many.pairs].concat();
    for memory in [short, many] {
        let mut later = Keeper {
            offered: Some(memory),
            ..Keeper::default()
        };
        assert_eq!(run(&mut later, -0.7), (whole.clone(), x.clone()));
    }
    // One of L-BFGS has no forcing term.
    let newton_cg = newton_cg(1);
    let start = || vec![-0.7; DIM];
    let [mut alone, mut offered] = [start(), start()];
    let mut later = Keeper {
        offered: Some(keeper.kept[0].clone()),
        ..Keeper::default()
    };
    let whole = newton_cg.minimise(&mut Chain::default(), &mut alone, &mut Keeper::default());
    let other = newton_cg.minimise(&mut Chain::default(), &mut offered, &mut later);
    assert_eq!((whole.unwrap(), alone), (other.unwrap(), offered));
}
