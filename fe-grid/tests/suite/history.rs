//! The vectors that L-BFGS keeps: in single precision, in memory or in files.

use crate::support::objectives::Quadratic;
use fe_grid::minimise::{Evaluation, LbfgsParams, Minimiser, Objective, Silent, Status, Stopping};
use fe_grid::random::noise;
use fe_grid::{Buffer, GridError, Storage, Stored};

/// With vectors in less memory.
fn compact(relative_gradient: f64, max_iterations: usize) -> LbfgsParams {
    LbfgsParams {
        compact: true,
        ..lbfgs(relative_gradient, max_iterations)
    }
}

fn lbfgs(relative_gradient: f64, max_iterations: usize) -> LbfgsParams {
    LbfgsParams {
        history: 3,
        stopping: Stopping {
            relative_gradient,
            relative_energy: 0.0,
            max_iterations,
            ..Stopping::default()
        },
        ..LbfgsParams::default()
    }
}

/// Curvatures from 1 to 100.
fn quadratic(dim: usize) -> Quadratic {
    let curvature = |j: usize| 100f64.powf(j as f64 / (dim - 1) as f64);
    Quadratic {
        curvatures: (0..dim).map(curvature).collect(),
        minimum: noise(dim, 11),
        exact_metric: false,
    }
}

/// A problem whose minimiser keeps its vectors in files of a folder.
struct InFiles {
    problem: Quadratic,
    storage: Storage,
}

impl Objective for InFiles {
    type Error = GridError;

    fn dim(&self) -> usize {
        self.problem.dim()
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, GridError> {
        let Ok(evaluation) = self.problem.value_and_gradient(x, g);
        Ok(evaluation)
    }

    fn room<T: Stored>(&self, len: usize) -> Result<Buffer<T>, GridError> {
        self.storage.zeros(len)
    }
}

#[test]
fn same_bits_in_memory_and_in_files() {
    check_files(&lbfgs(1e-8, 12));
    check_files(&compact(1e-8, 12));
}

fn check_files(params: &LbfgsParams) {
    let dim = 50_000;
    let folder = tempfile::tempdir().unwrap();
    let minimised = |storage: Storage| {
        let mut problem = InFiles {
            problem: quadratic(dim),
            storage,
        };
        let mut x = vec![0.0; dim];
        let info = params.minimise(&mut problem, &mut x, &mut Silent);
        info.map(|info| (x, info.energies))
    };
    let in_memory = minimised(Storage::Memory).unwrap();
    assert!(in_memory == minimised(Storage::Folder(folder.path().into())).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let nowhere = folder.path().join("nowhere");
    assert!(matches!(
        minimised(Storage::Folder(nowhere.clone())),
        Err(GridError::Spill { folder, .. }) if folder == nowhere
    ));
}

/// Pairs are kept in single precision, of a range of 1e38 up and down; a change of units by a
/// power of two, which is exact, must not be seen at all.
#[test]
fn the_memory_knows_no_units() {
    // In single precision the minimum itself is rounded, by which the gradient changes.
    check_units(&lbfgs(1e-8, 200), 200);
    check_units(&compact(1e-5, 200), 60);
}

fn check_units(params: &LbfgsParams, most: i32) {
    let minimised = |exponent: i32| {
        let unit = 2f64.powi(exponent);
        let mut problem = quadratic(40);
        for c in &mut problem.minimum {
            *c *= unit;
        }
        let mut x = vec![0.0; 40];
        let Ok(info) = params.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(info.status, Status::GradientTolerance);
        for x in &mut x {
            *x /= unit;
        }
        (x, info.iterations)
    };
    let usual = minimised(0);
    assert!(usual.1 > 10);
    assert!(usual == minimised(most) && usual == minimised(-most));
}

/// Bytes suffice for pairs: what counts is that products are those of the rounded pair.
#[test]
fn compact_vectors_cost_no_iterations() {
    let minimised = |params: &LbfgsParams| {
        let mut problem = quadratic(400);
        let mut x = vec![0.0; 400];
        let Ok(info) = params.minimise(&mut problem, &mut x, &mut Silent);
        assert_eq!(info.status, Status::GradientTolerance);
        let distance = fe_grid::vector::max_abs_difference(&x, &problem.minimum);
        (info.iterations, distance, x)
    };
    let exact = minimised(&lbfgs(1e-4, 200));
    let rounded = minimised(&compact(1e-4, 200));
    assert!(
        rounded.0 <= exact.0 + exact.0 / 5,
        "{} {}",
        exact.0,
        rounded.0
    );
    assert!(rounded.1 < 2.0 * exact.1, "{} {}", exact.1, rounded.1);
    // The state is one in single precision, from the start.
    let single = |x: &f64| f64::from(*x as f32) == *x;
    assert!(rounded.2.iter().all(single));
    let mut start = vec![0.1; 400];
    let Ok(_) = compact(1e-4, 0).minimise(&mut quadratic(400), &mut start, &mut Silent);
    assert!(start.iter().all(single));
}

/// An energy that falls along a line of next to no curvature, and rises behind its end at 3.
struct Slope;

impl Objective for Slope {
    type Error = GridError;

    fn dim(&self) -> usize {
        1
    }

    fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> Result<Evaluation, GridError> {
        let (bend, behind) = (1e-6, (x[0] - 3.0).max(0.0));
        g[0] = bend * x[0] - 1.0 + behind;
        Ok(Evaluation::Value(
            0.5 * bend * x[0] * x[0] - x[0] + 0.5 * behind * behind,
        ))
    }
}

/// By the first pair alone the second step is a million times as long as the way.
#[test]
fn pairs_of_little_curvature_are_left_out_on_request() {
    let [all, some] = [0.0, 0.1].map(|least_share| {
        let params = LbfgsParams {
            least_share,
            ..lbfgs(1e-6, 50)
        };
        let mut x = [0.0];
        let info = params.minimise(&mut Slope, &mut x, &mut Silent).unwrap();
        assert_eq!(info.status, Status::GradientTolerance);
        assert!((x[0] - 4.0).abs() < 1e-4, "{x:?}");
        info.evaluations.values + info.evaluations.gradients
    });
    println!("{all} {some}");
    assert!(some < 10 && all > 15, "{all} {some}");
}
