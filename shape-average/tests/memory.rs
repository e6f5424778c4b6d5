//! The estimate of the memory against what is asked of the allocator, and results that do not
//! depend on where vectors are kept.

use fe_grid::minimise::Silent;
use fe_grid::{Distribution, Grid, ScalarField, Storage};
use peak_alloc::PeakAlloc;
use shape_average::joint::{self, JointParams, joint_average};
use shape_average::{
    AverageParams, AverageResult, Precision, Solver, average_of_visible, memory_estimate,
};
use test_support::{in_own_process, on_threads};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Balls and ellipsoids about the centre, by distances that are exact enough here.
fn ellipsoids<const D: usize>(grid: Grid<D>, n: usize) -> Vec<ScalarField<f64, D>> {
    let ellipsoid = |i: usize| {
        let stretch = 0.8 + 0.4 * i as f64 / n as f64;
        let inside = ScalarField::from_fn(grid, |x| {
            let part = |k: usize| (x[k] - 0.5) * if k == 0 { stretch } else { 1.0 };
            [0.3 - (0..D).map(|k| part(k).powi(2)).sum::<f64>().sqrt()]
        });
        levelset::signed_distance(&inside, 0.0).unwrap()
    };
    (0..n).map(ellipsoid).collect()
}

/// Averages on one thread, of shapes of which half of the box was seen or all of it; the result, and
/// the most memory in use meanwhile over the estimate.
fn measured<const D: usize>(
    shapes: usize,
    nodes: usize,
    partly_visible: bool,
    params: &AverageParams,
) -> (AverageResult<D>, f64) {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let grid = Grid::<D>::cube(nodes);
        let inputs = ellipsoids(grid, shapes);
        ALLOCATOR.reset_peak_usage();
        let half = |_| ScalarField::from_fn(grid, |x| [f64::from(u8::from(x[0] < 0.5))]);
        let views = if partly_visible { shapes } else { 0 };
        let seen: Vec<_> = (0..views).map(half).collect();
        let result = average_of_visible(&inputs, &seen, params, &mut Silent).unwrap();
        let most = ALLOCATOR.peak_usage() - before;
        let estimate = memory_estimate(
            params,
            &Distribution::alone(shapes),
            1,
            partly_visible,
            &grid,
        );
        (result, estimate.memory as f64 / most as f64)
    })
}

/// The arrays of an estimate are few and known; what is missing is small beside them.
fn check<const D: usize>(shapes: usize, nodes: usize, params: &AverageParams) -> AverageResult<D> {
    check_visibility(shapes, nodes, false, params)
}

fn check_visibility<const D: usize>(
    shapes: usize,
    nodes: usize,
    partly_visible: bool,
    params: &AverageParams,
) -> AverageResult<D> {
    let (result, ratio) = measured(shapes, nodes, partly_visible, params);
    println!("{D}D, {shapes} shapes at {nodes}: estimate / measured = {ratio:.3}");
    assert!(
        (0.85..1.15).contains(&ratio),
        "{D}D {shapes} {nodes}: {ratio}"
    );
    result
}

fn in_files(params: &AverageParams, folder: &std::path::Path) -> AverageParams {
    AverageParams {
        storage: Storage::Folder(folder.into()),
        remakes_metrics: true,
        ..params.clone()
    }
}

fn mixed(params: &AverageParams) -> AverageParams {
    AverageParams {
        precision: Some(Precision::Mixed),
        ..params.clone()
    }
}

/// Some iterations a level, after which no more memory is used.
fn short() -> AverageParams {
    AverageParams {
        max_iterations: 12,
        ..AverageParams::default()
    }
}

#[test]
fn estimates_are_what_is_used() {
    in_own_process("estimates_are_what_is_used", || {
        let params = short();
        check::<3>(3, 33, &params);
        check::<2>(4, 129, &params);
    });
}

#[test]
fn estimates_of_mixed_precision_are_what_is_used() {
    in_own_process("estimates_of_mixed_precision_are_what_is_used", || {
        check::<3>(3, 33, &mixed(&short()));
    });
}

#[test]
fn estimates_of_partly_visible_shapes_are_what_is_used() {
    in_own_process(
        "estimates_of_partly_visible_shapes_are_what_is_used",
        || {
            check_visibility::<3>(2, 33, true, &short());
        },
    );
}

#[test]
fn estimates_of_the_descent_are_what_is_used() {
    in_own_process("estimates_of_the_descent_are_what_is_used", || {
        let descent = AverageParams {
            solver: Solver::Descent,
            max_iterations: 2,
            ..short()
        };
        check::<2>(4, 129, &descent);
    });
}

/// The estimate of averages of images over what they use, on one thread.
fn of_images<const D: usize>(images: usize, nodes: usize) -> f64 {
    on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let grid = Grid::<D>::cube(nodes);
        let inputs = ellipsoids(grid, images).into_iter().map(|u| {
            let inside = u.as_slice().iter().map(|u| f64::from(u8::from(*u > 0.0)));
            ScalarField::from_vec(grid, inside.collect()).unwrap()
        });
        let inputs: Vec<_> = inputs.collect();
        ALLOCATOR.reset_peak_usage();
        let params = JointParams {
            average: short(),
            max_rounds: 2,
            ..JointParams::default()
        };
        joint_average(&inputs, &params, &mut Silent).unwrap();
        let most = ALLOCATOR.peak_usage() - before;
        let images = Distribution::alone(images);
        joint::memory_estimate(&params, &images, &grid) as f64 / most as f64
    })
}

#[test]
fn estimates_of_images_are_what_is_used() {
    in_own_process("estimates_of_images_are_what_is_used", || {
        let measured = [
            of_images::<2>(2, 65),
            of_images::<2>(5, 65),
            of_images::<3>(2, 21),
        ];
        println!("{measured:.3?}");
        let right = measured.iter().all(|ratio| (0.9..1.1).contains(ratio));
        assert!(right, "{measured:?}");
    });
}

/// The sizes at which estimates matter take minutes.
#[test]
fn estimates_are_what_is_used_at_full_size() {
    in_own_process("estimates_are_what_is_used_at_full_size", || {
        if std::env::var_os("SHAPESPACE_SLOW_TESTS").is_none() {
            eprintln!("skipped: SHAPESPACE_SLOW_TESTS is not set");
            return;
        }
        let params = AverageParams::default();
        check::<3>(8, 65, &params);
        check::<3>(8, 65, &mixed(&params));
        check::<3>(2, 129, &params);
        let folder = tempfile::tempdir().unwrap();
        check::<3>(8, 65, &in_files(&params, folder.path()));
    });
}

#[test]
fn files_save_memory_and_change_nothing() {
    in_own_process("files_save_memory_and_change_nothing", || {
        let folder = tempfile::tempdir().unwrap();
        let params = short();
        let spilled = in_files(&params, folder.path());
        let (plain, _) = measured::<3>(3, 33, false, &params);
        let same = check::<3>(3, 33, &spilled);
        assert!(plain.average == same.average && plain.displacements == same.displacements);
        assert_eq!(plain.energy, same.energy);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let grid = Grid::<3>::cube(33);
        let sizes = [&params, &spilled, &mixed(&params)]
            .map(|p| memory_estimate(p, &Distribution::alone(8), 1, false, &grid).memory);
        assert!(
            2 * sizes[1] < sizes[0] && 5 * sizes[2] < 3 * sizes[0],
            "{sizes:?}"
        );
    });
}

#[test]
fn a_folder_that_is_missing_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let params = in_files(&AverageParams::default(), &folder.path().join("nowhere"));
    let inputs = ellipsoids(Grid::<2>::cube(17), 2);
    let error = average_of_visible(&inputs, &[], &params, &mut Silent).unwrap_err();
    assert!(error.to_string().contains("nowhere"), "{error}");
}
