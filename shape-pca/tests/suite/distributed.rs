//! Analyses on several processes, of which threads with a communicator take the place: results have the
//! same bits on any number of them.

use crate::support::three;
use fe_grid::communicator::{Communicator, on_threads};
use fe_grid::minimise::{Memory, Observer, Silent};
use fe_grid::{Field, Grid};
use shape_pca::{Average, BalanceReport, Balancing, Compound, Metric, Pca, PcaParams, Variation};
use std::sync::Arc;

/// The bits of all numbers of an analysis.
fn bits<const D: usize>(average: &Average<D>, report: &BalanceReport, pca: &Pca<D>) -> Vec<u64> {
    let fields = average.displacements().iter().chain(&pca.displacements);
    let fields = fields.chain(&pca.space.fields).chain([&pca.space.mean]);
    let mut numbers: Vec<f64> = fields.flat_map(Field::as_slice).copied().collect();
    numbers.extend(average.object().as_slice());
    numbers.extend(report.imbalance.iter().chain(&report.elastic));
    numbers.extend(pca.gram.iter().chain(&pca.modes.eigenvalues));
    numbers.extend([pca.balance, pca.least_curvature]);
    for scores in &pca.training {
        numbers.extend(scores.scores.iter().chain(&scores.errors));
    }
    for solve in &pca.solves {
        numbers.extend([solve.iterations as f64, solve.residual]);
        numbers.extend([solve.least_curvature, solve.largest_curvature]);
    }
    numbers.iter().map(|x| x.to_bits()).collect()
}

/// Balances an average, and analyses it.
fn analysed<const D: usize>(
    average: &Average<D>,
    params: &PcaParams,
    communicator: Arc<dyn Communicator>,
    observer: &mut dyn Observer,
) -> Vec<u64> {
    let average = average.clone().distributed(communicator);
    let balancing = Balancing::default();
    let (average, report) = balancing.balance(&average, params, observer).unwrap();
    assert!(report.changed());
    let compound = Compound::new(&average, params).unwrap();
    let pca = Pca::new(&average, &compound, usize::MAX, observer).unwrap();
    bits(&average, &report, &pca)
}

/// With five processes for three shapes the last two have none; with two the first has two.
fn check<const D: usize>(grid: Grid<D>, params: &PcaParams, numbers: &[usize]) {
    let average = three(grid);
    let on = |processes| {
        on_threads(processes, &|communicator| {
            analysed(&average, params, communicator, &mut Silent)
        })
    };
    let alone = on(1).remove(0);
    for &processes in numbers {
        // All have the result.
        assert!(on(processes).iter().all(|found| *found == alone));
    }
}

#[test]
fn modes_have_the_same_bits_on_any_number_of_processes() {
    let usual = PcaParams::default();
    check(Grid::<2>::dyadic(5), &usual, &[2, 3, 5]);
    check(Grid::<3>::dyadic(4), &usual, &[2, 3]);
    let others = PcaParams {
        metric: Metric::Hessian,
        variation: Variation::Displacement,
        ..usual
    };
    check(Grid::<2>::dyadic(5), &others, &[2]);
}

/// Keeps all memories, and resumes from the last of every run.
#[derive(Clone, Default)]
struct Kept {
    runs: Vec<Vec<Memory<'static>>>,
    resumed: Vec<Memory<'static>>,
    run: usize,
}

impl Observer for Kept {
    fn resume(&mut self) -> Option<Memory<'static>> {
        self.run += 1;
        self.runs.push(Vec::new());
        self.resumed.get(self.run - 1).cloned()
    }

    fn remembers(&mut self, _ended: bool) -> bool {
        true
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        let run = self.runs.last_mut().unwrap();
        run.push(memory.clone().into_owned());
    }
}

/// What the first of three processes remembers after every step is resumed by other numbers of them.
#[test]
fn analyses_resume_on_other_numbers_of_processes() {
    let average = three(Grid::<2>::dyadic(4));
    let params = PcaParams::default();
    let on = |processes, resumed: &[Memory<'static>]| {
        let found = on_threads(processes, &|communicator: Arc<dyn Communicator>| {
            let mut observer = Kept::default();
            // The others are not asked.
            if communicator.rank() == 0 {
                observer.resumed = resumed.to_vec();
            }
            let bits = analysed(&average, &params, communicator, &mut observer);
            (bits, observer)
        });
        found.into_iter().next().unwrap()
    };
    let (whole, kept) = on(2, &[]);
    let [balancing, solving] = &kept.runs[..] else {
        panic!("{} runs", kept.runs.len());
    };
    // Two shapes at the same time, then one.
    assert!(balancing.len() > 1 && solving.len() == 2);
    assert!(solving[0].ended.is_none() && solving[1].ended.is_some());
    let last = balancing.last().unwrap();
    let states = balancing.iter().map(|memory| vec![memory.clone()]);
    let later = solving
        .iter()
        .map(|memory| vec![last.clone(), memory.clone()]);
    for state in states.chain(later) {
        for processes in [1, 3] {
            let (resumed, again) = on(processes, &state);
            assert!(resumed == whole);
            // Nothing is repeated that has ended.
            let ended = state.iter().filter(|memory| memory.ended.is_some()).count();
            assert!(ended < 2 || again.runs[1].is_empty());
        }
    }
}
