//! Averages on several processes, of which threads with a communicator take the place: results have
//! the same bits on any number of them.

use crate::support::shapes::{bar, ellipsoid};
use fe_grid::communicator::{Communicator, on_threads};
use fe_grid::minimise::{Control, Iteration, Memory, Observer, Silent};
use fe_grid::random::SplitMix64;
use fe_grid::{Distribution, Field, Grid, ScalarField};
use shape_average::align::align_group_of_visible;
use shape_average::joint::{Edges, JointParams, JointResult, joint_average_distributed};
use shape_average::{
    AverageError, AverageParams, AverageResult, Mean, Precision, Shapes, Solver,
    average_distributed,
};
use std::sync::Arc;

/// The inputs of an average.
#[derive(Clone, Default)]
struct Case<const D: usize> {
    shapes: Vec<ScalarField<f64, D>>,
    seen: Vec<ScalarField<f64, D>>,
    start: Vec<Field<f64, D, D>>,
    params: AverageParams,
}

impl<const D: usize> Case<D> {
    fn of(shapes: Vec<ScalarField<f64, D>>) -> Self {
        Self {
            shapes,
            ..Self::default()
        }
    }

    fn run(
        &self,
        communicator: Arc<dyn Communicator>,
        observer: &mut dyn Observer,
    ) -> Option<AverageResult<D>> {
        let Self {
            shapes,
            seen,
            start,
            params,
        } = self;
        let shapes = Shapes::new(shapes);
        average_distributed(communicator, shapes, seen, start, params, observer).unwrap()
    }

    /// The result of the first of some processes; the others have none.
    fn on(&self, processes: usize) -> AverageResult<D> {
        let run = |communicator| self.run(communicator, &mut Silent);
        let mut results = on_threads(processes, &run).into_iter();
        let first = results.next().flatten().unwrap();
        assert!(results.all(|other| other.is_none()));
        first
    }

    /// Compares the results on several numbers of processes with that on one.
    fn check(&self, numbers: &[usize]) -> AverageResult<D> {
        let alone = self.on(1);
        for &processes in numbers {
            assert_same(&self.on(processes), &alone, processes);
        }
        alone
    }
}

/// Compares all bits but those of times.
fn assert_same<const D: usize>(a: &AverageResult<D>, b: &AverageResult<D>, processes: usize) {
    let record = |result: &AverageResult<D>| {
        let mut record = serde_json::to_value(result).unwrap();
        record["solver_seconds"] = 0.into();
        for level in record["levels"].as_array_mut().unwrap() {
            level["seconds"] = 0.into();
        }
        record
    };
    assert_eq!(record(a), record(b), "{processes} processes");
    let arrays = |result: &AverageResult<D>| {
        let mut arrays = vec![
            result.average.clone(),
            result.average_indicator.clone(),
            result.average_mask.clone(),
        ];
        arrays.extend(result.pushed.clone());
        arrays.extend(result.pushed_visibility.clone());
        arrays.extend(result.shapes.phase_fields.clone());
        arrays.extend(result.shapes.indicators.clone());
        arrays
    };
    assert!(arrays(a) == arrays(b), "{processes} processes");
    assert!(a.displacements == b.displacements, "{processes} processes");
}

fn bars(angles: &[f64]) -> Vec<ScalarField<f64, 2>> {
    let grid = Grid::<2>::dyadic(5);
    let turned = |(i, angle): (usize, &f64)| bar(grid, *angle, 0.1 * i as f64);
    angles.iter().enumerate().map(turned).collect()
}

/// With five processes for four shapes the last has none; with three the first has two.
#[test]
fn bars_have_the_same_bits_on_any_number_of_processes() {
    let result = Case::of(bars(&[180.0, 150.0, 120.0, 90.0])).check(&[2, 3, 5]);
    assert!(result.certificate.certified && result.energy.remaining.is_some());
}

/// Shapes of other processes that lie turned are named, too.
#[test]
fn turned_shapes_are_those_of_one_process() {
    let turns = [0.0, 10.0, 90.0].map(f64::to_radians);
    let shapes = turns.map(|turn| ellipsoid(Grid::<2>::dyadic(4), [0.3, 0.15], turn));
    let result = Case::of(shapes.to_vec()).check(&[2, 3, 4]);
    let turned: Vec<_> = result.turned.iter().map(|turned| turned.shape).collect();
    assert_eq!(turned, [2]);
}

/// In either precision, and with almost the same energy.
#[test]
fn ellipsoids_have_the_same_bits() {
    let grid = Grid::<3>::dyadic(4);
    // So alike that none lies turned: the search for turned ones would take half of the time.
    let radii = [[0.28, 0.22, 0.22], [0.22, 0.28, 0.25], [0.25, 0.22, 0.28]];
    let shapes = radii.map(|radii| ellipsoid(grid, radii, 0.2));
    let runs: [(_, &[usize]); 2] = [(Precision::Double, &[2, 3]), (Precision::Mixed, &[3])];
    let [double, mixed] = runs.map(|(precision, processes)| {
        let params = AverageParams {
            precision: Some(precision),
            ..AverageParams::default()
        };
        let case = Case {
            params,
            ..Case::of(shapes.to_vec())
        };
        case.check(processes)
    });
    assert!(double.displacements != mixed.displacements);
    let single = |x: &f64| f64::from(*x as f32) == *x;
    assert!(
        mixed
            .displacements
            .iter()
            .all(|u| u.as_slice().iter().all(single))
    );
    let (double, mixed) = (double.energy.total, mixed.energy.total);
    assert!((double - mixed).abs() < 1e-5 * double, "{double} {mixed}");
}

#[test]
fn medians_have_the_same_bits() {
    let case = Case {
        params: AverageParams {
            mean: Mean::Median,
            ..AverageParams::default()
        },
        ..Case::of(bars(&[180.0, 170.0, 90.0]))
    };
    assert!(!case.check(&[2]).rounds.is_empty());
}

/// The shape of weight zero is deformed by the first process onto the average of the others.
#[test]
fn weights_masks_and_starts_are_those_of_the_shapes() {
    let shapes = bars(&[180.0, 150.0, 120.0]);
    let grid = *shapes[0].grid();
    let weighted = Case {
        params: AverageParams {
            weights: Some(vec![0.2, 0.0, 0.8]),
            ..AverageParams::default()
        },
        ..Case::of(shapes.clone())
    };
    let first = weighted.check(&[2]);
    let left = ScalarField::from_fn(grid, |[x, _]| [f64::from(u8::from(x < 0.6))]);
    let everywhere = ScalarField::from_fn(grid, |_| [1.0]);
    let masked = Case {
        seen: vec![everywhere.clone(), left, everywhere],
        start: first.displacements,
        ..Case::of(shapes)
    };
    masked.check(&[3]);
}

/// Stops after some iterations, and keeps the last memory.
struct Stop {
    after: usize,
    kept: Option<(usize, Memory<'static>)>,
    pending: Option<(usize, Memory<'static>)>,
    run: usize,
    dims: Vec<usize>,
}

impl Stop {
    fn after(after: usize) -> Self {
        Self {
            after,
            kept: None,
            pending: None,
            run: 0,
            dims: Vec::new(),
        }
    }
}

impl Observer for Stop {
    fn level(&mut self, _level: usize, _n_levels: usize, dim: usize) {
        self.dims.push(dim);
    }

    fn iteration(&mut self, _iteration: &Iteration<'_>) -> Control {
        self.after = self.after.saturating_sub(1);
        if self.after == 0 {
            return Control::Cancel;
        }
        Control::Continue
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        self.run += 1;
        let (_, memory) = self.pending.take_if(|(run, _)| *run == self.run)?;
        Some(memory)
    }

    fn remembers(&mut self, ended: bool) -> bool {
        !ended
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.kept = Some((self.run, memory.clone().into_owned()));
    }
}

/// Only the first process is asked to stop; what it remembers then is resumed by other numbers of
/// processes.
#[test]
fn runs_stop_together_and_resume_on_other_numbers_of_processes() {
    let case = Case::of(bars(&[180.0, 60.0, 140.0]));
    let whole = case.on(1);
    let n_first: usize = whole.levels[..whole.levels.len() - 1]
        .iter()
        .map(|level| level.iterations + 1)
        .sum();
    let stopped = on_threads(3, &|communicator: Arc<dyn Communicator>| {
        // On the finest level, after its metric has been made anew.
        let stop_after = [n_first + 12, usize::MAX][usize::from(communicator.rank() > 0)];
        let mut stop = Stop::after(stop_after);
        let result = case.run(communicator, &mut stop);
        (result.map(|result| result.status), stop.kept, stop.dims)
    });
    let (status, kept, dims) = stopped.into_iter().next().unwrap();
    assert_eq!(status, Some(fe_grid::minimise::Status::Cancelled));
    // All shapes are counted.
    assert_eq!(dims.last(), Some(&(3 * 2 * 33 * 33)));
    let kept = kept.unwrap();
    assert!(kept.1.energies.len() > 1 && kept.1.x.len() == 3 * 2 * 33 * 33);
    assert!(!kept.1.pairs.is_empty());
    for processes in [1, 2] {
        let resumed = on_threads(processes, &|communicator: Arc<dyn Communicator>| {
            let mut stop = Stop::after(usize::MAX);
            if communicator.rank() == 0 {
                stop.pending = Some(kept.clone());
            }
            case.run(communicator, &mut stop)
        });
        let resumed = resumed.into_iter().next().flatten().unwrap();
        assert_same(&resumed, &whole, processes);
    }
}

/// Rough grey balls on dark, each at a place of its own.
fn grey<const D: usize>(grid: Grid<D>, n: usize) -> Vec<ScalarField<f64, D>> {
    let image = |i: usize| {
        let shift = [-0.04, 0.03, 0.0, 0.05][i];
        let mut random = SplitMix64::new(i as u64);
        let mut image = ScalarField::from_fn(grid, |x| {
            let away: f64 = x.iter().map(|x| (x - 0.5 - shift).powi(2)).sum();
            let inside = (0.25 - away.sqrt()) / grid.spacing();
            [0.5 + inside.clamp(-0.5, 0.5)]
        });
        for value in image.as_mut_slice() {
            *value += random.between(-0.05, 0.05);
        }
        image
    };
    (0..n).map(image).collect()
}

/// The joint average on the first of some processes; the others have none.
fn joint_on<const D: usize>(
    images: &[ScalarField<f64, D>],
    params: &JointParams,
    processes: usize,
    pending: Option<&(usize, Memory<'static>)>,
) -> JointResult<D> {
    let results = on_threads(processes, &|communicator: Arc<dyn Communicator>| {
        let mut stop = Stop::after(usize::MAX);
        if communicator.rank() == 0 {
            stop.pending = pending.cloned();
        }
        joint_average_distributed(communicator, images, &[], params, &mut stop).unwrap()
    });
    let mut results = results.into_iter();
    let first = results.next().flatten().unwrap();
    assert!(results.all(|other| other.is_none()));
    first
}

/// Compares all bits but those of times.
fn assert_same_joint<const D: usize>(a: &JointResult<D>, b: &JointResult<D>, processes: usize) {
    let timeless = |result: &JointResult<D>| {
        let mut result = result.clone();
        result.seconds = 0.0;
        result
            .levels
            .iter_mut()
            .for_each(|level| level.seconds = 0.0);
        (result.levels, result.certificate, result.edge_overlaps)
    };
    assert_eq!(timeless(a), timeless(b), "{processes} processes");
    let fields = |result: &JointResult<D>| {
        let averages = [result.average.clone(), result.average_image.clone()];
        let images = [&result.images, &result.phase_fields, &result.pushed];
        [&averages[..], images[0], images[1], images[2]].concat()
    };
    assert!(fields(a) == fields(b), "{processes} processes");
    assert!(a.displacements == b.displacements, "{processes} processes");
}

/// Compares the results on several numbers of processes with that on one.
fn check_joint<const D: usize>(
    images: &[ScalarField<f64, D>],
    params: &JointParams,
    numbers: &[usize],
) {
    let alone = joint_on(images, params, 1, None);
    assert!(alone.energy().shapes.elastic.iter().all(|e| *e > 0.0));
    for &processes in numbers {
        let found = joint_on(images, params, processes, None);
        assert_same_joint(&found, &alone, processes);
    }
}

/// Of images in which edges are found together or before, and of drawings.
#[test]
fn averages_of_images_have_the_same_bits() {
    let params = |edges| JointParams {
        edges,
        ..JointParams::default()
    };
    let grid = Grid::<2>::dyadic(5);
    check_joint(&grey(grid, 4), &params(Edges::Together), &[2, 3, 5]);
    check_joint(&grey(grid, 3), &params(Edges::Separate), &[2]);
    check_joint(&grey(grid, 3), &params(Edges::Given), &[2]);
    let volumes = grey(Grid::<3>::dyadic(4), 2);
    check_joint(&volumes, &params(Edges::Together), &[2]);
}

/// What the first of three processes remembers after a round is resumed by other numbers of them.
#[test]
fn averages_of_images_resume_on_other_numbers_of_processes() {
    let images = grey(Grid::<2>::dyadic(5), 4);
    let params = JointParams::default();
    let whole = joint_on(&images, &params, 1, None);
    // In the last level.
    let rounds = whole.levels.iter().map(|level| level.rounds + 1);
    let after = rounds.sum::<usize>() - 1;
    let stopped = on_threads(3, &|communicator: Arc<dyn Communicator>| {
        let first = communicator.rank() == 0;
        let mut stop = Stop::after(if first { after } else { usize::MAX });
        let found = joint_average_distributed(communicator, &images, &[], &params, &mut stop);
        (found.unwrap().map(|result| result.status), stop.kept)
    });
    let (status, kept) = stopped.into_iter().next().unwrap();
    assert_eq!(status, Some(fe_grid::minimise::Status::Cancelled));
    let kept = kept.unwrap();
    assert_eq!(kept.0, whole.levels.len());
    for processes in [1, 2] {
        let resumed = joint_on(&images, &params, processes, Some(&kept));
        assert_same_joint(&resumed, &whole, processes);
    }
}

#[test]
fn motions_have_the_same_bits() {
    let grid = Grid::<3>::dyadic(4);
    let turns = [0.0, 0.3, -0.5, 1.0];
    let shapes = turns.map(|turn| ellipsoid(grid, [0.35, 0.25, 0.18], turn));
    let shapes: Vec<&ScalarField<f64, 3>> = shapes.iter().collect();
    let on = |processes: usize| {
        on_threads(processes, &|communicator| {
            let distribution = Distribution::over(communicator, shapes.len());
            align_group_of_visible(&shapes, &[], &distribution).unwrap()
        })
    };
    let alone = on(1).remove(0);
    assert!(alone[3].motion.angle() > 0.5);
    for processes in [2, 3, 5] {
        assert!(on(processes).iter().all(|found| *found == alone));
    }
}

#[test]
fn descent_runs_on_one_process() {
    let case = Case::of(bars(&[180.0, 150.0]));
    let params = AverageParams {
        solver: Solver::Descent,
        ..AverageParams::default()
    };
    let found = on_threads(2, &|communicator| {
        let shapes = Shapes::new(&case.shapes);
        average_distributed(communicator, shapes, &[], &[], &params, &mut Silent)
    });
    for result in found {
        let what = "gradient descent";
        let processes = 2;
        assert_eq!(
            result.err(),
            Some(AverageError::Distributed { what, processes })
        );
    }
}
