//! Statistics of distances, where the right answer is known.

use approx::assert_relative_eq;
use geodesic::distances::{
    Dendrogram, DistanceError, DistanceMatrix, Linkage, PathLengths, adjusted_rand_index,
    classical_scaling, nearest, nearest_neighbour_accuracy, purity, richardson, smacof, stress,
    triangles, vote,
};
use geodesic::finite::{Dissimilarity, finite_geodesic};
use proptest::prelude::*;

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn of_points(points: &[[f64; 2]]) -> DistanceMatrix {
    DistanceMatrix::from_fn(points.len(), |i, j| apart(points[i], points[j])).unwrap()
}

fn plane(n: std::ops::Range<usize>) -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec([-1.0..1.0, -1.0..1.0], n)
}

/// Distances that are those of no points.
fn any_matrix(n: usize) -> impl Strategy<Value = DistanceMatrix> {
    prop::collection::vec(0.1..1.0, n * n)
        .prop_map(move |values| DistanceMatrix::from_fn(n, |i, j| values[i * n + j]).unwrap())
}

proptest! {
    #[test]
    fn points_of_the_plane_are_found_up_to_a_rigid_motion(points in plane(3..12)) {
        let matrix = of_points(&points);
        let map = classical_scaling::<2>(&matrix);
        for (i, j, distance) in matrix.pairs() {
            // Eigenvalues are exact to rounding of their largest, roots of the small ones to its
            // root.
            prop_assert!((apart(map.points[i], map.points[j]) - distance).abs() < 1e-6);
        }
        prop_assert!((map.explained - 1.0).abs() < 1e-9 && map.negative < 1e-9);
        for axis in 0..2 {
            let sum: f64 = map.points.iter().map(|p| p[axis]).sum();
            prop_assert!(sum.abs() < 1e-6);
            let (low, high) = map.points.iter().fold((0.0, 0.0), |(low, high), p| {
                (f64::min(low, p[axis]), f64::max(high, p[axis]))
            });
            prop_assert!(high >= -low * (1.0 - 1e-5));
        }
        // Nothing is left to refine, and the signs stay.
        let refined = smacof(&matrix, &map.points);
        prop_assert!(refined.stress < 1e-5);
    }

    #[test]
    fn majorisation_lowers_the_stress(matrix in any_matrix(7)) {
        let map = classical_scaling::<2>(&matrix);
        let before = stress(&matrix, &map.points);
        let refined = smacof(&matrix, &map.points);
        prop_assert!(refined.stress <= before);
        // The turn at the end keeps it.
        prop_assert!((stress(&matrix, &refined.points) - refined.stress).abs() < 1e-12);
        prop_assert!((0.0..=1.0).contains(&map.explained) && map.negative <= 1.0);
    }

    #[test]
    fn a_tree_is_one(matrix in any_matrix(9), clusters in 1usize..10) {
        for linkage in [Linkage::Single, Linkage::Complete, Linkage::Average, Linkage::Ward] {
            let tree = Dendrogram::new(&matrix, linkage);
            prop_assert_eq!(tree.merges().len(), 8);
            prop_assert_eq!(tree.merges()[7].size, 9);
            prop_assert!(tree.merges().windows(2).all(|m| m[0].height <= m[1].height));
            let mut order = tree.order().to_vec();
            let labels = tree.labels(clusters);
            // Clusters stand together: as many changes of the label as clusters, less one.
            let changes = order.windows(2).filter(|w| labels[w[0]] != labels[w[1]]).count();
            prop_assert_eq!(changes, clusters - 1);
            prop_assert_eq!(labels.iter().max(), Some(&(clusters - 1)));
            order.sort_unstable();
            prop_assert_eq!(order, (0..9).collect::<Vec<_>>());
            prop_assert_eq!(labels[0], 0);
        }
    }

    #[test]
    fn one_neighbour_votes_as_the_nearest(
        matrix in any_matrix(8),
        classes in prop::collection::vec(0usize..3, 8),
        count in 1usize..9,
    ) {
        let mut right = 0;
        let mut counted = 0;
        for i in 0..8 {
            let others = (0..8).filter(|&j| j != i);
            let found = nearest(others.map(|j| (j, Some(matrix.get(i, j)))), count);
            prop_assert_eq!(found.len(), count.min(7));
            prop_assert!(found.windows(2).all(|n| n[0].distance <= n[1].distance));
            // No other is nearer than those that are found.
            let last = found[found.len() - 1].distance;
            let nearer = (0..8).filter(|&j| j != i && matrix.get(i, j) < last).count();
            prop_assert!(nearer < found.len());
            let winner = vote(&found, |j| classes[j]).unwrap();
            let votes = |class| found.iter().filter(|n| classes[n.object] == class).count();
            prop_assert!((0..3).all(|class| votes(class) <= votes(winner)));
            if (0..8).any(|j| j != i && classes[j] == classes[i]) {
                counted += 1;
                right += usize::from(vote(&found[..1], |j| classes[j]) == Some(classes[i]));
            }
        }
        let share = (counted > 0).then(|| f64::from(right as u32) / f64::from(counted));
        prop_assert_eq!(share, nearest_neighbour_accuracy(&matrix, &classes));
    }

    #[test]
    fn agreement_does_not_depend_on_names(labels in prop::collection::vec(0usize..4, 2..20)) {
        let renamed: Vec<usize> = labels.iter().map(|l| 7 - l).collect();
        prop_assert_eq!(adjusted_rand_index(&labels, &renamed), 1.0);
        prop_assert_eq!(purity(&labels, &renamed), 1.0);
    }

    #[test]
    fn triangles_hold_in_the_plane(points in plane(3..9)) {
        let matrix = of_points(&points);
        let n = points.len();
        let report = triangles(n, |i, j| Some(matrix.get(i, j)));
        prop_assert_eq!(report.count, n * (n - 1) * (n - 2) / 6);
        prop_assert_eq!(report.violations, 0);
        // Squares of distances hold only where no corner is obtuse.
        let obtuse = triangles(n, |i, j| Some(matrix.get(i, j).powi(2)));
        prop_assert!(obtuse.violations <= obtuse.count);
    }

    #[test]
    fn the_limit_is_exact_for_its_order(a in -1.0..1.0_f64, b in -1.0..1.0_f64, order in 1u32..4) {
        let value = |steps: f64| a + b / steps.powi(order as i32);
        prop_assert!((richardson(value(3.0), value(6.0), order) - a).abs() < 1e-12);
    }
}

/// A dissimilarity that is no distance: its third derivative does not vanish.
struct Skewed;

impl Dissimilarity<1> for Skewed {
    fn value(&self, a: &[f64; 1], b: &[f64; 1]) -> f64 {
        let d = b[0] - a[0];
        (1.0 + a[0] * a[0]) * (d * d + 0.4 * d.powi(3) + 0.3 * d.powi(4))
    }

    fn gradients(&self, a: &[f64; 1], b: &[f64; 1]) -> ([f64; 1], [f64; 1]) {
        let d = b[0] - a[0];
        let g = 1.0 + a[0] * a[0];
        let p = d * d + 0.4 * d.powi(3) + 0.3 * d.powi(4);
        let dp = 2.0 * d + 1.2 * d * d + 1.2 * d.powi(3);
        ([2.0 * a[0] * p - g * dp], [g * dp])
    }
}

#[test]
fn one_direction_has_first_order_and_their_mean_second() {
    // int_0^1 sqrt(1 + x^2) dx.
    let exact = 0.5 * (2f64.sqrt() + 1f64.asinh());
    let length = |from: f64, to: f64, steps: usize| {
        finite_geodesic(&Skewed, [from], [to], steps)
            .unwrap()
            .length()
    };
    // The errors of the mean and of half the difference.
    let errors = |steps: usize| {
        let (there, back) = (length(0.0, 1.0, steps), length(1.0, 0.0, steps));
        (0.5 * (there + back) - exact, 0.5 * (there - back))
    };
    let (coarse, fine) = (errors(16), errors(32));
    // Twice as many steps divide them by 4 and 2, but for parts of the square of the step, which
    // are hundredths.
    assert_relative_eq!(coarse.0 / fine.0, 4.0, max_relative = 0.05);
    assert_relative_eq!(coarse.1 / fine.1, 2.0, max_relative = 0.05);
    // Extrapolated as first order the mean becomes worse, as second order much better.
    let wrong = richardson(coarse.0, fine.0, 1);
    let right = richardson(coarse.0, fine.0, 2);
    assert!(wrong.abs() > 0.9 * fine.0.abs());
    assert!(right.abs() < 0.05 * fine.0.abs());
}

#[test]
fn clusters_that_are_far_apart_are_found() {
    let middles = [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]];
    let points: Vec<[f64; 2]> = (0..12)
        .map(|i| {
            let turn = i as f64;
            let [x, y] = middles[i % 3];
            [x + turn.sin(), y + turn.cos()]
        })
        .collect();
    let classes: Vec<usize> = (0..12).map(|i| i % 3).collect();
    let matrix = of_points(&points);
    for linkage in [
        Linkage::Single,
        Linkage::Complete,
        Linkage::Average,
        Linkage::Ward,
    ] {
        let tree = Dendrogram::new(&matrix, linkage);
        assert_eq!(tree.labels(3), classes);
        assert_eq!(tree.widest_gap(), 3, "{linkage:?}");
        assert_eq!(tree.labels(12), (0..12).collect::<Vec<_>>());
        assert_eq!(tree.labels(0), [0; 12]);
    }
    assert_eq!(nearest_neighbour_accuracy(&matrix, &classes), Some(1.0));
    let alone: Vec<usize> = (0..12).collect();
    assert_eq!(nearest_neighbour_accuracy(&matrix, &alone), None);
}

#[test]
fn heights_are_those_of_the_definitions() {
    // Points 0, 1 and 5 on a line.
    let places = [0.0, 1.0, 5.0_f64];
    let matrix = DistanceMatrix::from_fn(3, |i, j| (places[i] - places[j]).abs()).unwrap();
    // Ward: sqrt(2 |A| |B| / (|A| + |B|)) times the distance of the centroids.
    for (linkage, height) in [
        (Linkage::Single, 4.0),
        (Linkage::Complete, 5.0),
        (Linkage::Average, 4.5),
        (Linkage::Ward, (4.0_f64 / 3.0).sqrt() * 4.5),
    ] {
        let tree = Dendrogram::new(&matrix, linkage);
        let [first, last] = tree.merges() else {
            panic!("two merges");
        };
        assert_eq!((first.left, first.right, first.height), (0, 1, 1.0));
        assert_eq!((last.left, last.right, last.size), (2, 3, 3));
        assert_relative_eq!(last.height, height, max_relative = 1e-14);
    }
}

#[test]
fn agreement_is_that_of_worked_examples() {
    // Manning, Raghavan and Schütze, Introduction to Information Retrieval, figure 16.4: 12 of 17
    // in the classes that lead, and the index from its 44 pairs in classes and 20 in both.
    let clusters = [vec![0; 6], vec![1; 6], vec![2; 5]].concat();
    let classes = [
        vec![0, 0, 0, 0, 0, 1],
        vec![0, 1, 1, 1, 1, 2],
        vec![0, 0, 2, 2, 2],
    ]
    .concat();
    assert_relative_eq!(purity(&clusters, &classes), 12.0 / 17.0);
    let (both, a, b, all) = (20.0, 40.0, 44.0, 136.0);
    let expected = a * b / all;
    let index = (both - expected) / (0.5 * (a + b) - expected);
    assert_relative_eq!(
        adjusted_rand_index(&clusters, &classes),
        index,
        max_relative = 1e-14
    );
    // Partitions that are as unlike as can be, and trivial ones.
    assert!(adjusted_rand_index(&[0, 0, 1, 1], &[0, 1, 0, 1]) < 0.0);
    assert_eq!(adjusted_rand_index(&[0, 0], &[1, 1]), 1.0);
    assert_eq!(adjusted_rand_index(&[0, 1], &[1, 1]), 0.0);
}

#[test]
fn missing_lengths_are_filled_in_and_listed() {
    let known = |i: usize, j: usize| match (i, j) {
        (0, 1) => Some(1.0),
        (1, 0) => Some(2.0),
        (2, 1) => Some(3.0),
        (0 | 1, 2) | (2, 0) => None,
        _ => panic!("asked for {i} and {j}"),
    };
    let lengths = PathLengths::from_fn(3, known);
    assert_eq!(lengths.between(0, 1), Some(1.5));
    assert_eq!(lengths.between(1, 2), Some(3.0));
    assert_eq!(lengths.between(0, 2), None);
    assert_eq!(lengths.get(2, 2), Some(0.0));
    let asymmetry = lengths.asymmetry().unwrap();
    assert_eq!((asymmetry.pairs, asymmetry.worst), (1, [0, 1]));
    assert_relative_eq!(asymmetry.largest, 1.0 / 1.5);
    let completed = lengths.completed().unwrap().unwrap();
    assert_eq!(completed.filled, [[0, 2]]);
    assert_eq!(completed.matrix.get(2, 0), 4.5);
    assert_eq!(completed.matrix.get(0, 1), 1.5);
    let apart = PathLengths::from_fn(3, |i, j| (i + j == 1).then_some(1.0));
    assert_eq!(apart.completed(), Ok(None));
    assert_eq!(PathLengths::unknown(3).asymmetry(), None);
    let report = triangles(3, |i, j| lengths.between(i, j));
    assert_eq!((report.count, report.violations), (0, 0));
}

#[test]
fn violated_triangles_are_measured() {
    let side = |i: usize, j: usize| Some([1.0, 4.0, 2.0][i + j - 1]);
    let report = triangles(3, side);
    assert_eq!((report.count, report.violations), (1, 1));
    // From 0 to 2 it is 4, by way of 1 only 3.
    assert_eq!(report.worst_triangle, Some([0, 2, 1]));
    assert_relative_eq!(report.worst, 1.0 / 3.0);
}

#[test]
fn what_is_no_distance_is_refused() {
    let refused = |rows: &[f64]| DistanceMatrix::new(2, rows).unwrap_err();
    assert!(matches!(refused(&[0.0]), DistanceError::Count { .. }));
    assert!(matches!(
        refused(&[0.0, 1.0, 1.0, 0.5]),
        DistanceError::Diagonal { i: 1, .. }
    ));
    assert!(matches!(
        refused(&[0.0, -1.0, -1.0, 0.0]),
        DistanceError::Value { .. }
    ));
    assert!(matches!(
        refused(&[0.0, f64::NAN, 1.0, 0.0]),
        DistanceError::Value { .. }
    ));
    assert!(matches!(
        refused(&[0.0, 1.0, 2.0, 0.0]),
        DistanceError::Asymmetric { .. }
    ));
    assert!(DistanceMatrix::new(2, &[0.0, 1.0, 1.0, 0.0]).is_ok());
    let many = DistanceMatrix::new(1 << 32, &[]);
    assert!(matches!(many, Err(DistanceError::Count { .. })));
    let none = classical_scaling::<2>(&DistanceMatrix::new(0, &[]).unwrap());
    assert!(none.points.is_empty() && none.explained == 0.0);
}
