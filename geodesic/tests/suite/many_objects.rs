//! Neighbours and maps of many objects by a part of their distances.

use std::collections::HashMap;

use geodesic::distances::{
    DistanceMatrix, Known, LowerBound, Search, classical_scaling, kept, landmark_scaling, nearest,
    random_sample, stress, stress_of_pairs,
};
use proptest::prelude::*;

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn of_points(points: &[[f64; 2]]) -> DistanceMatrix {
    DistanceMatrix::from_fn(points.len(), |i, j| apart(points[i], points[j])).unwrap()
}

/// Corners of a square, which span the plane, and other points.
fn with_corners() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec([-3.0..3.0, -3.0..3.0], 1..12).prop_map(|others| {
        let corners = [[-1.0, -1.0], [1.0, -1.2], [1.1, 1.0], [-0.9, 1.3]];
        corners.into_iter().chain(others).collect()
    })
}

proptest! {
    #[test]
    fn landmarks_place_points_of_the_plane_exactly(points in with_corners()) {
        let rows: Vec<Vec<f64>> = points[4..]
            .iter()
            .map(|p| points[..4].iter().map(|q| apart(*p, *q)).collect())
            .collect();
        let map = landmark_scaling::<2>(&of_points(&points[..4]), &rows);
        prop_assert!(stress(&of_points(&points), &map.points) < 1e-9);
        prop_assert!((map.explained - 1.0).abs() < 1e-9 && map.negative < 1e-9);
        // As the classical map, which has its centroid in the origin and principal axes.
        let whole = classical_scaling::<2>(&of_points(&points));
        for axis in 0..2 {
            let sum: f64 = map.points.iter().map(|p| p[axis]).sum();
            prop_assert!(sum.abs() < 1e-6);
            let spread = |points: &[[f64; 2]]| points.iter().map(|p| p[axis] * p[axis]).sum::<f64>();
            let (found, sought) = (spread(&map.points), spread(&whole.points));
            prop_assert!((found - sought).abs() < 1e-6 * sought.max(1.0));
        }
    }

    #[test]
    fn landmarks_alone_have_their_classical_map(points in with_corners()) {
        let matrix = of_points(&points);
        let map = landmark_scaling::<2>(&matrix, &[]);
        let classical = classical_scaling::<2>(&matrix);
        prop_assert_eq!(&map.eigenvalues, &classical.eigenvalues);
        let known = matrix.pairs().filter(|(i, j, _)| i + j != 3);
        let known: Vec<(usize, usize, f64)> = known.collect();
        prop_assert!(stress_of_pairs(known, &map.points) < 1e-6);
    }

    /// With a bound that holds, the neighbours are those of all distances, and no pair is computed whose
    /// bound exceeds the last of them.
    #[test]
    fn a_true_bound_loses_no_neighbour(
        points in with_corners(),
        quotients in prop::collection::vec(0.7..1.3f64, 256),
        count in 1usize..4,
        most in 1usize..4,
    ) {
        let n = points.len();
        let matrix = of_points(&points);
        let surrogate = |i: usize, j: usize| {
            matrix.get(i, j) / quotients[i.min(j) * 16 + i.max(j)]
        };
        let bound = LowerBound { factor: 0.7, sample: 1 };
        let others = |i: usize| (0..n).filter(move |&j| j != i);
        let rows = (0..n).map(|i| (i, others(i).map(|j| (j, Some(surrogate(i, j)))).collect()));
        let search = Search::new(count, bound, rows);
        let mut known: HashMap<[usize; 2], f64> = HashMap::new();
        loop {
            let next = search.next(most, |i, j| {
                let length = known.get(&[i.min(j), i.max(j)]);
                length.map_or(Known::Nothing, |length| Known::Length(*length))
            });
            if next.is_empty() {
                break;
            }
            prop_assert!(next.windows(2).all(|w| w[0] < w[1]));
            for [i, j] in next {
                prop_assert!(i < j && known.insert([i, j], matrix.get(i, j)).is_none());
            }
        }
        for i in 0..n {
            let all = nearest(others(i).map(|j| (j, Some(matrix.get(i, j)))), count);
            let found = nearest(
                others(i).map(|j| (j, known.get(&[i.min(j), i.max(j)]).copied())),
                count,
            );
            prop_assert_eq!(&found, &all);
            let row: Vec<(f64, f64)> =
                others(i).map(|j| (surrogate(i, j), matrix.get(i, j))).collect();
            let [kept, of] = kept(&row, count, bound);
            prop_assert_eq!(kept, of);
        }
    }

    #[test]
    fn a_calibrated_bound_holds_for_its_share(
        quotients in prop::collection::vec(0.5..2.0f64, 1..60),
        share in 0.01..0.5f64,
    ) {
        // Surrogates of any size: only the quotients count.
        let pairs = quotients.iter().enumerate().map(|(k, q)| ((k + 1) as f64, q * (k + 1) as f64));
        let bound = LowerBound::calibrate(pairs, share);
        let m = quotients.len();
        prop_assert_eq!(bound.sample, m);
        let below = quotients.iter().filter(|q| **q < bound.factor * (1.0 - 1e-12)).count();
        prop_assert!((below + 1) as f64 <= (share * (m + 1) as f64).max(1.0));
        // The next larger factor would be wrong for more.
        let up_to = quotients.iter().filter(|q| **q <= bound.factor * (1.0 + 1e-12)).count();
        prop_assert!((up_to + 1) as f64 > share * (m + 1) as f64);
    }
}

#[test]
fn neighbours_beyond_a_wrong_bound_are_missed_and_counted() {
    // The surrogate of the nearest is far too large.
    let row = [(9.0, 1.0), (2.0, 2.0), (3.0, 3.0), (4.0, 4.0)];
    let bound = |factor| LowerBound { factor, sample: 9 };
    assert_eq!(kept(&row, 2, bound(1.0)), [1, 2]);
    assert_eq!(kept(&row, 1, bound(1.0)), [0, 1]);
    assert_eq!(kept(&row, 2, bound(0.1)), [2, 2]);
    // Without a factor nothing is skipped.
    assert_eq!(kept(&row, 1, bound(0.0)), [1, 1]);
    assert_eq!(LowerBound::calibrate([(1.0, 1.0); 8], 0.1).factor, 0.0);
    assert_eq!(LowerBound::calibrate([(2.0, 1.0); 9], 0.1).factor, 0.5);
    assert_eq!(LowerBound::calibrate([(0.0, 1.0)], 0.9).sample, 0);
}

#[test]
fn pairs_without_a_path_are_not_asked_for_again() {
    let bound = LowerBound {
        factor: 1.0,
        sample: 9,
    };
    let rows = [(0, vec![(1, None), (2, Some(5.0)), (3, Some(1.0))])];
    let search = Search::new(1, bound, rows);
    // What has no surrogate comes first.
    assert_eq!(search.next(1, |_, _| Known::Nothing), [[0, 1]]);
    let known = |_: usize, j: usize| match j {
        1 => Known::NoPath,
        3 => Known::Length(4.0),
        _ => Known::Nothing,
    };
    assert!(search.next(1, known).is_empty());
    let farther = |i: usize, j: usize| match known(i, j) {
        Known::Length(_) => Known::Length(6.0),
        other => other,
    };
    assert_eq!(search.next(9, farther), [[0, 2]]);
}

#[test]
fn samples_are_reproducible_and_without_repetition() {
    for n in [0, 1, 5, 40] {
        for count in [0, 1, 3, 50] {
            let sample = random_sample(n, count, 7);
            assert_eq!(sample.len(), count.min(n));
            assert!(sample.windows(2).all(|w| w[0] < w[1]) && sample.iter().all(|&k| k < n));
            assert_eq!(sample, random_sample(n, count, 7));
        }
    }
    assert_ne!(random_sample(40, 5, 0), random_sample(40, 5, 1));
    // Every number is drawn about as often as the others.
    let mut drawn = [0; 10];
    for seed in 0..1000 {
        for k in random_sample(10, 3, seed) {
            drawn[k] += 1;
        }
    }
    assert!(
        drawn.iter().all(|&times| (240..360).contains(&times)),
        "{drawn:?}"
    );
}
