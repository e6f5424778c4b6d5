//! Segmentation and averaging at the same time.

use fe_grid::minimise::{Control, Iteration, Observer, Silent, Status};
use fe_grid::{Field, Grid, ScalarField};
use levelset::Cause;
use phasefield::segmentation::{SegmentationParams, Weights, segment};
use shape_average::joint::{Edges, JointParams, JointResult, joint_average};
use shape_average::{AverageError, StrainMaps};

/// Disks, bright on dark, with even noise that is the same in every run.
fn disk(grid: Grid<2>, centre: [f64; 2], radius: f64, noise: f64) -> ScalarField<f64, 2> {
    let h = grid.spacing();
    let mut image = ScalarField::from_fn(grid, |x| {
        let inside = radius - (x[0] - centre[0]).hypot(x[1] - centre[1]);
        [0.5 + (inside / h).clamp(-0.5, 0.5)]
    });
    let mut state = (1e6 * (centre[0] + 10.0 * radius)) as u64;
    for v in image.as_mut_slice() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        *v += noise * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5);
    }
    image
}

fn params() -> JointParams {
    JointParams {
        segmentation: SegmentationParams {
            weights: Weights::for_scales(1.0, 0.06, 0.4).unwrap(),
            ..SegmentationParams::default()
        },
        ..JointParams::default()
    }
}

fn run(images: &[ScalarField<f64, 2>]) -> JointResult<2> {
    run_with(images, &params())
}

fn run_with(images: &[ScalarField<f64, 2>], params: &JointParams) -> JointResult<2> {
    let result = joint_average(images, params, &mut Silent).unwrap();
    assert!(result.certificate.certified);
    for level in &result.levels {
        // The average is solved for to 1e-7, which enters the energy squared.
        let falls = |w: &[f64]| w[1] <= w[0] * (1.0 + 1e-12);
        assert!(level.energies.windows(2).all(falls), "{:?}", level.energies);
        assert_eq!(level.energies.len(), 2 * level.rounds + 1);
        let last = level.energies[2 * level.rounds];
        assert!((level.energy.objective() / last - 1.0).abs() < 1e-12);
        // The terms add up.
        let (n, energy) = (images.len() as f64, &level.energy);
        let images: f64 = energy.images.iter().map(|i| i.total).sum();
        let elastic: f64 = energy.shapes.elastic.iter().sum();
        let mismatch: f64 = energy.shapes.mismatch.iter().sum();
        let sum = (images + elastic + mismatch) / n + 1e-4 * energy.shapes.length;
        assert!((sum / energy.total - 1.0).abs() < 1e-12);
    }
    result
}

/// Three disks at different places: each is brought to one place by about its own shift, and the
/// average image is as sharp as they are.
#[test]
fn shifted_disks_are_brought_together() {
    let grid = Grid::<2>::dyadic(6);
    let centres = [[0.46, 0.5], [0.5, 0.54], [0.54, 0.46]];
    let images = centres.map(|centre| disk(grid, centre, 0.25, 0.2));
    let result = run(&images);
    for (centre, displacement) in centres.iter().zip(&result.displacements) {
        let found = displacement.sample(*centre);
        for k in 0..2 {
            // A shift costs nothing; where the interfaces meet is known to a part of a spacing.
            assert!((found[k] - (0.5 - centre[k])).abs() < 0.02, "{found:?}");
        }
    }
    let at = |x: f64| result.average_image.sample([x, 0.5])[0];
    assert!(
        at(0.5) > 0.9 && at(0.5 + 0.25 + 0.06) < 0.1,
        "{} {}",
        at(0.5),
        at(0.81)
    );
    // Without deformation the mean is grey there.
    let plain = |x: f64| images.iter().map(|i| i.sample([x, 0.5])[0]).sum::<f64>() / 3.0;
    assert!((plain(0.74) - 0.5).abs() < 0.3, "{}", plain(0.74));
    // The edge of the average is where its phase field is small.
    assert!(result.average.sample([0.75, 0.5])[0] < 0.3);
    assert!(result.average.sample([0.5, 0.5])[0] > 0.8);
}

/// What a much longer run wins is what the result said that it would.
#[test]
fn the_remaining_energy_is_what_more_rounds_win() {
    let grid = Grid::<2>::dyadic(5);
    let images = [[0.2, 0.3, 0.2], [0.26, 0.2, 0.2], [0.22, 0.25, 0.0]];
    let images =
        images.map(|[radius, noise, shift]| disk(grid, [0.45 + shift, 0.5], radius, noise));
    let usual = params();
    let longer = JointParams {
        tolerance: 1e-9,
        max_rounds: 200,
        ..params()
    };
    let [found, limit] = [&usual, &longer].map(|params| run_with(&images, params).energy());
    assert!(limit.remaining.unwrap() < 1e-3 * found.remaining.unwrap());
    let won = found.total - limit.total;
    let ratio = found.remaining.unwrap() / won;
    // Decreases of rounds are a geometric series in the end only.
    assert!((1.0 / 3.0..3.0).contains(&ratio), "{ratio}");
    let share = found.remaining_share().unwrap();
    assert!(share <= 100.0 * usual.tolerance, "{share}");
    assert!((share * found.shapes.parts[0] / found.remaining.unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn equal_images_stay_where_they_are() {
    let grid = Grid::<2>::dyadic(5);
    let image = disk(grid, [0.5; 2], 0.25, 0.0);
    let result = run(&[image.clone(), image]);
    let moved = result.displacements.iter().flat_map(Field::as_slice);
    // A discrete interface costs a little less where it is stretched: a part of a spacing.
    let moved = moved.fold(0.0f64, |m, u| m.max(u.abs()));
    assert!(moved < 0.3 * grid.spacing(), "{moved}");
    let maps = StrainMaps::new(&result.displacements[0]);
    let off = |values: &[f64], one: f64| values.iter().fold(0.0f64, |m, v| m.max((v - one).abs()));
    assert!(off(&maps.norm, 2f64.sqrt()) < 0.1 && off(&maps.determinant, 1.0) < 0.15);
}

struct Impatient;

impl Observer for Impatient {
    fn iteration(&mut self, _: &Iteration<'_>) -> Control {
        Control::Cancel
    }
    fn between(&mut self) -> Control {
        Control::Cancel
    }
}

#[test]
fn bad_images_are_named_and_a_wish_to_stop_is_heard() {
    let grid = Grid::<2>::dyadic(5);
    let image = disk(grid, [0.5; 2], 0.25, 0.0);
    let other = disk(Grid::dyadic(4), [0.5; 2], 0.25, 0.0);
    let error =
        |images: &[ScalarField<f64, 2>]| joint_average(images, &params(), &mut Silent).unwrap_err();
    assert_eq!(error(&[]), AverageError::NoShapes);
    assert_eq!(
        error(&[image.clone(), other]),
        AverageError::GridsDiffer { index: 1 }
    );
    let mut hole = image.clone();
    hole.as_mut_slice()[3] = f64::NAN;
    assert_eq!(
        error(&[image.clone(), hole]),
        AverageError::NotFinite { index: 1, node: 3 }
    );
    let stopped = joint_average(&[image.clone(), image], &params(), &mut Impatient).unwrap();
    assert_eq!(stopped.status, Status::Cancelled);
    assert_eq!(stopped.average.grid().nodes_per_axis(), [17, 17]);
}

/// A drawn circle, two spacings wide.
fn circle(grid: Grid<2>, radius: f64) -> ScalarField<f64, 2> {
    let h = grid.spacing();
    ScalarField::from_fn(grid, |[x, y]| {
        let off = ((x - 0.5).hypot(y - 0.5) - radius).abs();
        [(1.5 - off / h).clamp(0.0, 1.0)]
    })
}

/// The average of two drawn circles is a circle between them, and their edges are held.
#[test]
fn drawn_edges_are_averaged_as_they_are() {
    let grid = Grid::<2>::dyadic(6);
    let drawings = [0.18, 0.28].map(|radius| circle(grid, radius));
    let given = JointParams {
        edges: Edges::Given,
        ..params()
    };
    let result = joint_average(&drawings, &given, &mut Silent).unwrap();
    assert!(result.certificate.certified);
    let width = given.average.interface_cells * grid.spacing();
    for (radius, held) in [0.18, 0.28].into_iter().zip(&result.phase_fields) {
        // The profile at the distance from the stroke, whose half width is one spacing.
        for x in [0.55f64, 0.62, 0.9] {
            let off = ((x - 0.5 - radius).abs() - grid.spacing()).max(0.0);
            let expected = 1.0 - (-off / (2.0 * width)).exp();
            let found = held.sample([x, 0.5])[0];
            assert!((found - expected).abs() < 0.03, "{x} {found} {expected}");
        }
    }
    // Where the average has its circle: the middle of its edge along a ray.
    let value = |r: f64| result.average.sample([0.5 + r, 0.5])[0];
    let (mut sum, mut weight) = (0.0, 0.0);
    for r in (0..240).map(|k| 0.11 + 0.001 * f64::from(k)) {
        let edge = (1.0 - value(r)).powi(4);
        sum += edge * r;
        weight += edge;
    }
    let edge = sum / weight;
    // Between the mean radius, .23, and what costs both the same: compression costs more.
    assert!((0.225..0.25).contains(&edge), "{edge}");
    assert!(value(edge) < 0.3 && value(0.14) > 0.7, "{}", value(edge));
    let energy = result.energy();
    assert!(energy.images.iter().all(|image| image.total == 0.0));
    let sum =
        energy.shapes.elastic.iter().sum::<f64>() + energy.shapes.mismatch.iter().sum::<f64>();
    let total = 0.5 * sum + 1e-4 * energy.shapes.length;
    assert!((total / energy.total - 1.0).abs() < 1e-12);
    assert!(result.doubts(&given.average).is_empty());
    // A circle and a cross have no edges in common.
    let cross = ScalarField::from_fn(grid, |[x, y]: [f64; 2]| {
        let off = (x - 0.5).abs().min((y - 0.5).abs());
        [(1.5 - off / grid.spacing()).clamp(0.0, 1.0)]
    });
    let unlike = [drawings[0].clone(), cross];
    let unlike = joint_average(&unlike, &given, &mut Silent).unwrap();
    let doubts = unlike.doubts(&given.average);
    assert!(
        doubts.iter().any(|d| d.cause == Cause::EdgeOverlap),
        "{:?}",
        unlike.edge_overlaps
    );
    let nothing = [drawings[0].clone(), ScalarField::zeros(grid)];
    let found = joint_average(&nothing, &given, &mut Silent);
    assert!(matches!(found, Err(AverageError::NoEdges { index: 1 })));
}

/// Edges that are found separately are those of separate segmentations, bit for bit.
#[test]
fn separate_edges_are_held() {
    let grid = Grid::<2>::dyadic(5);
    let images = [0.2, 0.26].map(|radius| disk(grid, [0.5; 2], radius, 0.1));
    let separate = JointParams {
        edges: Edges::Separate,
        ..params()
    };
    let result = joint_average(&images, &separate, &mut Silent).unwrap();
    let alone = SegmentationParams {
        interface_cells: separate.average.interface_cells,
        ..separate.segmentation
    };
    for (image, held) in images.iter().zip(&result.phase_fields) {
        let found = segment(image, &alone, &mut Silent).unwrap();
        assert_eq!(found.phase_field.as_slice(), held.as_slice());
    }
}

/// Neither images without edges nor those whose edges fill them say what corresponds.
#[test]
fn no_edges_and_solid_ones_are_doubtful() {
    let grid = Grid::<2>::dyadic(6);
    let doubts = |images: &[ScalarField<f64, 2>]| -> Vec<Cause> {
        let params = params();
        let result = joint_average(images, &params, &mut Silent).unwrap();
        let doubts = result.doubts(&params.average);
        doubts.iter().map(|doubt| doubt.cause).collect()
    };
    let disks = [0.25, 0.27].map(|radius| disk(grid, [0.5; 2], radius, 0.0));
    assert_eq!(doubts(&disks), []);
    // Noise far below the contrast that counts as an edge.
    let flat = [0.3, 0.4].map(|seed| disk(grid, [seed, 0.5], -1.0, 0.2));
    assert_eq!(doubts(&flat), [Cause::EdgeOverlap; 2]);
    // Edges that one image has alone are squeezed to a hair in the other one.
    let [left, right] = [0.3, 0.7].map(|x| disk(grid, [x, 0.5], 0.14, 0.0));
    let both = left.as_slice().iter().zip(right.as_slice());
    let both = both.map(|(a, b)| a.max(*b)).collect();
    let two = ScalarField::from_vec(grid, both).unwrap();
    let found = doubts(&[two, disk(grid, [0.5; 2], 0.3, 0.0)]);
    assert!(found.contains(&Cause::UnmatchedEdges), "{found:?}");
    // Stripes of two spacings.
    let texture = [0.24, 0.26].map(|radius| {
        let stripes = Field::from_fn(grid, |x: [f64; 2]| {
            let bright = (x[0] * 16.0).fract() < 0.5;
            let inside = (x[0] - 0.5).hypot(x[1] - 0.5) < radius;
            [f64::from(u8::from(inside && bright))]
        });
        ScalarField::from_vec(grid, stripes.as_slice().to_vec()).unwrap()
    });
    let found = doubts(&texture);
    assert!(found.contains(&Cause::SolidEdges), "{found:?}");
}
