//! Shapes of weight zero, and medians.

use crate::support::shapes::{ball, bar};
use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Moments, contour, dice, hausdorff};
use shape_average::{AverageParams, AverageResult, Mean, average};

fn run(shapes: &[ScalarField<f64, 2>], params: &AverageParams) -> AverageResult<2> {
    let result = average(shapes, params, &mut Silent).unwrap();
    assert!(result.certificate.certified);
    for level in &result.levels {
        assert!(level.energies.windows(2).all(|w| w[1] <= w[0]), "{level:?}");
        let last = level.energies[level.iterations];
        assert!((level.energy.objective() - last).abs() <= 1e-8 * last);
    }
    result
}

/// All the weight on one shape: the average is that shape, and the others are deformed onto it.
#[test]
fn a_shape_of_all_the_weight_is_the_average() {
    let grid = Grid::<2>::dyadic(6);
    let shapes = [
        bar(grid, 180.0, 0.0),
        bar(grid, 118.0, 0.0),
        ball(grid, [0.5; 2], 0.2),
    ];
    for i in 0..2 {
        let mut weights = vec![0.0; 3];
        weights[i] = 1.0;
        let params = AverageParams {
            weights: Some(weights),
            ..AverageParams::default()
        };
        let result = run(&shapes, &params);
        let own = dice(&result.average_indicator, 0.5, &shapes[i], 0.0).unwrap();
        // Nodes on the boundary: one of a bar of seven spacings by forty would be 0.997.
        assert!(own > 0.997, "{own}");
        assert!(result.dice[i] > 0.999, "{:?}", result.dice);
        // A bar that is folded by 62 degrees all at once ends a part of a spacing before the other.
        assert!(result.dice[1 - i] > 0.93, "{:?}", result.dice);
        // Only the shape that leads is in the total; the energies of the others are true ones.
        let others = (0..3).filter(|j| *j != i);
        assert!(others.clone().all(|j| result.energy.elastic[j] > 0.0));
        assert!(others.clone().all(|j| result.energy.mismatch[j] > 0.0));
        // With an elastic weight of 0.01, which leaves the bar as it is, it is 0.005 at most.
        assert!(result.energy.elastic[1 - i] < 0.006);
    }
}

/// Without the weight of a third shape the average is that of the other two.
#[test]
fn a_shape_without_weight_has_no_say() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [
        bar(grid, 180.0, 0.0),
        bar(grid, 118.0, 0.0),
        ball(grid, [0.5; 2], 0.25),
    ];
    let params = AverageParams {
        weights: Some(vec![0.5, 0.5, 0.0]),
        ..AverageParams::default()
    };
    let three = run(&shapes, &params);
    // A mismatch of one shape costs a third in both.
    let two = AverageParams {
        mismatch_weight: 2.0 / 3.0,
        length_weight: Some(1e-4),
        ..AverageParams::default()
    };
    let two = run(&shapes[..2], &two);
    let same = dice(&three.average_indicator, 0.5, &two.average_indicator, 0.5).unwrap();
    assert_eq!(same, 1.0);
    assert_eq!(three.displacements[..2], two.displacements[..]);
}

fn radius(result: &AverageResult<2>) -> f64 {
    let area = Moments::of_density(&result.average_indicator)
        .unwrap()
        .volume;
    (area / std::f64::consts::PI).sqrt()
}

/// Two large disks among eight small ones move the average, and the median much less.
#[test]
fn a_median_is_moved_little_by_a_few_others() {
    let grid = Grid::<2>::dyadic(5);
    let mut shapes: Vec<_> = [0.18, 0.19, 0.195, 0.2, 0.2, 0.205, 0.21, 0.22]
        .iter()
        .map(|r| ball(grid, [0.5; 2], *r))
        .collect();
    shapes.extend([0.36, 0.38].map(|r| ball(grid, [0.5; 2], r)));
    let mean = |mean| {
        let params = AverageParams {
            mean,
            ..AverageParams::default()
        };
        radius(&run(&shapes, &params))
    };
    let (arithmetic, median) = (mean(Mean::Arithmetic) - 0.2, mean(Mean::Median) - 0.2);
    assert!(arithmetic > 0.02, "{arithmetic}");
    assert!(median.abs() < arithmetic / 3.0, "{median} {arithmetic}");
}

/// Two shapes of another kind, which cannot be deformed onto the others, among eight bars spread evenly
/// about the middle one.
#[test]
fn a_median_gives_little_to_shapes_of_another_kind() {
    let grid = Grid::<2>::dyadic(5);
    let bends = [-12.0, -8.0, -4.0, 0.0, 0.0, 4.0, 8.0, 12.0];
    let clean: Vec<_> = bends.iter().map(|b| bar(grid, 150.0 + b, 0.0)).collect();
    let others = [ball(grid, [0.5; 2], 0.2), ball(grid, [0.5; 2], 0.22)];
    let all = [&clean[..], &others].concat();
    let alone = AverageParams {
        // A mismatch of one shape costs a tenth in all.
        mismatch_weight: 0.8,
        length_weight: Some(1e-4),
        ..AverageParams::default()
    };
    let truth = run(&clean, &alone);
    let mean = run(&all, &AverageParams::default());
    let params = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    let median = run(&all, &params);
    let rounds = &median.rounds;
    assert!(rounds.len() > 2 && mean.rounds.is_empty());
    assert!(rounds.windows(2).all(|w| w[1] <= w[0]), "{rounds:?}");
    assert_eq!(median.energy.total, rounds[rounds.len() - 1]);
    let boundary =
        |r: &AverageResult<2>| contour(&r.average_indicator, 0.5, BoxEdge::Closed).unwrap();
    let away = |r| hausdorff(&boundary(r), &boundary(&truth)).unwrap().mean;
    let (of_mean, of_median) = (away(&mean), away(&median));
    assert!(of_mean > 0.25 * grid.spacing(), "{of_mean}");
    assert!(of_median < of_mean / 3.0, "{of_median} {of_mean}");
}

/// Equal shapes are their own median.
#[test]
fn equal_shapes_are_their_median() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = vec![bar(grid, 118.0, 0.0); 3];
    let params = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    let result = run(&shapes, &params);
    assert_eq!(result.mean_dice(), 1.0);
}
