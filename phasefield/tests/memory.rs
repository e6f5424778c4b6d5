//! The estimate of the memory of a segmentation against what is asked of the allocator.

use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use peak_alloc::PeakAlloc;
use phasefield::segmentation::{SegmentationParams, memory_estimate, segment};
use test_support::on_threads;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

fn check<const D: usize>(nodes: usize) {
    let ratio = on_threads(1, || {
        let before = ALLOCATOR.current_usage();
        let image = ScalarField::from_fn(Grid::<D>::cube(nodes), |x| {
            let square: f64 = x.iter().map(|x| (x - 0.5).powi(2)).sum();
            [f64::from(u8::from(square < 0.06)) + 0.1 * (90.0 * x[0]).sin()]
        });
        ALLOCATOR.reset_peak_usage();
        segment(&image, &SegmentationParams::default(), &mut Silent).unwrap();
        let most = ALLOCATOR.peak_usage() - before;
        memory_estimate(image.grid()) as f64 / most as f64
    });
    println!("{D}D at {nodes}: {ratio:.3}");
    // What is not counted is small.
    assert!((0.9..1.1).contains(&ratio), "{D}D at {nodes}: {ratio}");
}

/// One test: they would share the allocator.
#[test]
fn estimates_are_what_is_used() {
    check::<2>(129);
    check::<3>(33);
}
