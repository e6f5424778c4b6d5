//! A run of L-BFGS resumes from its memory to the same bits.

use fe_grid::GridError;
use fe_grid::minimise::{
    Control, Evaluation, Info, Iteration, LbfgsParams, Memory, Minimiser, Objective, Observer,
    Stopping,
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

fn run(keeper: &mut Keeper, start: f64) -> (Info, Vec<f64>) {
    run_in(false, keeper, start)
}

fn run_in(compact: bool, keeper: &mut Keeper, start: f64) -> (Info, Vec<f64>) {
    let params = LbfgsParams {
        compact,
        history: 4,
        metric_interval: 5,
        stopping: Stopping {
            relative_gradient: 1e-4,
            max_iterations: 60,
            ..Stopping::default()
        },
        ..LbfgsParams::default()
    };
    let mut x = vec![start; DIM];
    let info = params.minimise(&mut Chain::default(), &mut x, keeper);
    (info.unwrap(), x)
}

#[test]
fn a_resumed_run_has_the_bits_of_the_whole() {
    check_resumed(false);
}

/// Its memory has the pairs in single precision, which they are rounded from again.
#[test]
fn a_resumed_compact_run_has_the_bits_of_the_whole() {
    check_resumed(true);
}

fn check_resumed(compact: bool) {
    let run = |keeper: &mut Keeper, start| run_in(compact, keeper, start);
    let mut keeper = Keeper::default();
    let (whole, x) = run(&mut keeper, -0.7);
    assert!(whole.iterations > 30, "{whole:?}");
    let (end, within) = keeper.kept.split_last().unwrap();
    assert_eq!(within.len(), whole.iterations.div_ceil(5));
    for (k, memory) in within.iter().enumerate() {
        assert_eq!(memory.energies.len(), 5 * k + 1);
        let mut later = Keeper {
            offered: Some(memory.clone()),
            ..Keeper::default()
        };
        // The state that it is started with does not matter.
        let (resumed, reached) = run(&mut later, 3.0);
        assert_eq!(resumed, whole, "memory {k}");
        assert_eq!(reached, x, "memory {k}");
        assert_eq!(later.energies, keeper.energies[5 * k + 1..]);
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
}
