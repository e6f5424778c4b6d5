//! Statistics of groups: exact cases, power, and p-values that are uniform where nothing differs.

use approx::assert_relative_eq;
use fe_grid::random::{SplitMix64, normal};
use shape_pca::groups::{
    GroupError, Groups, Relabelling, classify, compare_points, compare_scores,
    false_discovery_rates, mean_ellipse, permanova, regress,
};

/// A table of standard normal numbers.
fn table(rows: usize, columns: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = SplitMix64::new(seed);
    let mut next = || normal(random.open_uniform(), random.open_uniform());
    (0..rows)
        .map(|_| (0..columns).map(|_| next()).collect())
        .collect()
}

/// Two groups of equal sizes.
fn halves(n: usize) -> Groups {
    Groups::new((0..n).map(|i| i % 2).collect()).unwrap()
}

/// Adds a number to one column of the second half.
fn shifted(mut rows: Vec<Vec<f64>>, column: usize, by: f64) -> Vec<Vec<f64>> {
    for row in rows.iter_mut().skip(1).step_by(2) {
        row[column] += by;
    }
    rows
}

fn few(permutations: usize, seed: u64) -> Relabelling {
    Relabelling { permutations, seed }
}

/// The largest distance between the distribution of numbers and the uniform one on `{1, ..., m} / m`.
fn distance_from_uniform(values: &[f64], m: usize) -> f64 {
    let share =
        |x: f64| values.iter().filter(|v| **v <= x + 1e-12).count() as f64 / values.len() as f64;
    (1..=m)
        .map(|k| (share(k as f64 / m as f64) - k as f64 / m as f64).abs())
        .fold(0.0, f64::max)
}

#[test]
fn p_values_are_uniform_if_the_groups_do_not_differ() {
    let runs = 200;
    let (n, m) = (16, 40);
    let mut p: [Vec<f64>; 6] = Default::default();
    for run in 0..runs {
        let rows = table(n, 3, 1000 + run);
        let relabelling = few(m - 1, run);
        let groups = halves(n);
        let found = compare_scores(&rows, &groups, relabelling).unwrap();
        p[0].push(found.p_value_overall);
        // The least of the family-wise p-values is that of the largest statistic.
        let least = found
            .p_value_family_wise
            .iter()
            .copied()
            .fold(1.0, f64::min);
        p[1].push(least);
        let age: Vec<f64> = table(n, 1, 9000 + run).concat();
        p[2].push(regress(&rows, &age, relabelling).unwrap().p_value_overall);
        let distances = distances_of(&rows);
        p[3].push(permanova(&distances, &groups, relabelling).unwrap().p_value);
        p[4].push(compare_points(&rows, &groups, relabelling).unwrap().p_value[1]);
        // Accuracies are multiples of 1/16: of equal ones all count.
        p[5].push(classify(&rows, &groups, 3, relabelling).unwrap().p_value);
    }
    for (test, values) in p.iter().enumerate() {
        // The distance that 200 uniform numbers exceed with a probability of 1 %, after Kolmogorov.
        let limit = 1.63 / (runs as f64).sqrt();
        let found = distance_from_uniform(values, m);
        assert!(found < limit, "test {test}: {found} > {limit}");
    }
}

fn distances_of(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let distance = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y));
        squares.sum::<f64>().sqrt()
    };
    rows.iter()
        .map(|a| rows.iter().map(|b| distance(a, b)).collect())
        .collect()
}

#[test]
fn a_difference_of_one_mode_is_found_in_that_mode() {
    let rows = shifted(table(24, 5, 7), 2, 3.0);
    let groups = halves(24);
    let found = compare_scores(&rows, &groups, few(499, 1)).unwrap();
    assert_eq!(found.p_value_family_wise[2], 1.0 / 500.0);
    for j in [0, 1, 3, 4] {
        assert!(found.p_value_family_wise[j] > 0.05, "{found:?}");
        assert!(found.p_value_family_wise[j] >= found.p_value[j]);
    }
    assert!(found.p_value_overall < 0.05);
    let distances = distances_of(&rows);
    let tested = permanova(&distances, &groups, few(499, 1)).unwrap();
    assert!(tested.p_value < 0.05);
    // Distances of scores and the scores themselves are the same analysis of variance.
    assert_relative_eq!(tested.f, found.f_overall, max_relative = 1e-10);
    assert_relative_eq!(tested.explained, found.explained, max_relative = 1e-10);
    let classified = classify(&rows, &groups, 5, few(99, 1)).unwrap();
    assert!(classified.balanced_accuracy > 0.85, "{classified:?}");
    assert_eq!(classified.p_value, 1.0 / 100.0);
}

#[test]
fn the_analysis_of_variance_is_that_of_a_textbook() {
    // Groups 1, 2, 3 and 5, 6, 7: means 2 and 6, B = 6 * 4 = 24, W = 2 + 2, F = 24 / (4/4).
    let rows: Vec<Vec<f64>> = [1.0, 2.0, 3.0, 5.0, 6.0, 7.0].map(|x| vec![x]).to_vec();
    let groups = Groups::new(vec![0, 0, 0, 1, 1, 1]).unwrap();
    let found = compare_scores(&rows, &groups, few(1999, 3)).unwrap();
    assert_relative_eq!(found.f[0], 24.0, max_relative = 1e-12);
    assert_relative_eq!(found.explained, 24.0 / 28.0, max_relative = 1e-12);
    // Two of the twenty divisions separate the groups. Three standard errors of 2000 relabellings.
    assert_relative_eq!(found.least_p_value, 0.1);
    assert!((found.p_value[0] - 0.1).abs() < 3.0 * (0.09f64 / 2000.0).sqrt());
    let tested = permanova(&distances_of(&rows), &groups, few(9, 3)).unwrap();
    assert_relative_eq!(tested.f, 24.0, max_relative = 1e-12);
    let points = compare_points(&rows, &groups, few(9, 3)).unwrap();
    assert_relative_eq!(points.f[0], 24.0, max_relative = 1e-12);
}

#[test]
fn discoveries_are_those_of_benjamini_and_hochberg() {
    let found = false_discovery_rates(&[0.04, 0.01, 0.03, 0.005]);
    // n p / rank is .04, .02, .04, .02.
    for (found, expected) in found.iter().zip([0.04, 0.02, 0.04, 0.02]) {
        assert_relative_eq!(*found, expected, max_relative = 1e-12);
    }
    assert_eq!(false_discovery_rates(&[0.9, 1.0]), [1.0, 1.0]);
    assert_eq!(false_discovery_rates(&[]), Vec::<f64>::new());
}

#[test]
fn points_that_differ_are_discovered_and_few_others() {
    let mut rows = table(20, 200, 11);
    for column in 0..40 {
        rows = shifted(rows, column, 3.0);
    }
    let found = compare_points(&rows, &halves(20), few(999, 5)).unwrap();
    let discovered = |range: std::ops::Range<usize>| {
        let rates = &found.false_discovery_rate[range];
        rates.iter().filter(|rate| **rate <= 0.1).count()
    };
    assert!(discovered(0..40) >= 38);
    // A tenth of the discoveries on average: four, and three standard deviations more.
    assert!(discovered(40..200) <= 10, "{}", discovered(40..200));
}

#[test]
fn a_line_is_found_exactly() {
    let age = [3.0, 7.0, 4.0, 9.0, 12.0];
    let rows: Vec<Vec<f64>> = age.iter().map(|x| vec![1.0 - 2.0 * x, 0.5]).collect();
    let found = regress(&rows, &age, few(99, 0)).unwrap();
    assert_relative_eq!(found.predict(5.0)[0], -9.0, max_relative = 1e-12);
    assert_relative_eq!(found.predict(5.0)[1], 0.5, max_relative = 1e-12);
    assert_relative_eq!(found.r_squared[0], 1.0, max_relative = 1e-12);
    assert_eq!(found.r_squared[1], 0.0);
    let constant = regress(&rows, &[0.1 + 0.2; 5], few(9, 0));
    assert_eq!(constant, Err(GroupError::ConstantCovariate));
}

#[test]
fn a_shape_is_not_classified_by_itself() {
    // Every shape lies where its group has no other: only itself would tell its group.
    let rows: Vec<Vec<f64>> = [0.0, 1.0, 0.1, 1.1].map(|x| vec![x]).to_vec();
    let groups = Groups::new(vec![0, 0, 1, 1]).unwrap();
    let found = classify(&rows, &groups, 1, few(9, 0)).unwrap();
    assert_eq!(found.balanced_accuracy, 0.0);
    assert_eq!(found.confusion, [[0, 2], [2, 0]]);
}

#[test]
fn groups_of_unequal_sizes_count_alike() {
    // One of the five shapes of the first group lies in the second.
    let rows: Vec<Vec<f64>> = [0.0, 0.2, 0.1, 1.0, 5.0, 5.1, 5.2, 5.0]
        .map(|x| vec![x])
        .to_vec();
    let groups = Groups::new(vec![0, 0, 0, 0, 0, 1, 1, 1]).unwrap();
    let found = classify(&rows, &groups, 1, few(9, 0)).unwrap();
    assert_eq!(found.confusion, [[4, 1], [0, 3]]);
    assert_relative_eq!(found.balanced_accuracy, 0.9, max_relative = 1e-12);
    let means = groups.means(&rows).unwrap();
    assert_relative_eq!(means[0][0], 6.3 / 5.0, max_relative = 1e-12);
    assert_relative_eq!(means[1][0], 5.1, max_relative = 1e-12);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let rows = table(12, 4, 2);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| compare_scores(&rows, &halves(12), few(500, 4)).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn unsuitable_groups_and_tables_are_errors() {
    assert!(matches!(
        Groups::new(vec![]),
        Err(GroupError::TooFewGroups { found: 0 })
    ));
    assert!(matches!(
        Groups::new(vec![0, 0]),
        Err(GroupError::TooFewGroups { found: 1 })
    ));
    assert!(matches!(
        Groups::new(vec![0, 2, 2]),
        Err(GroupError::TooFewGroups { found: 2 })
    ));
    assert!(matches!(
        Groups::new(vec![0, usize::MAX]),
        Err(GroupError::TooFewGroups { .. })
    ));
    assert!(matches!(
        Groups::new(vec![0, 1]),
        Err(GroupError::NoVariationWithin { .. })
    ));
    let groups = halves(4);
    let tested = |rows: &[Vec<f64>]| compare_scores(rows, &groups, few(9, 0));
    assert!(matches!(
        tested(&table(3, 2, 0)),
        Err(GroupError::Count { .. })
    ));
    let mut rows = table(4, 2, 0);
    rows[2][1] = f64::NAN;
    assert!(matches!(
        tested(&rows),
        Err(GroupError::NotFinite { index: 2, .. })
    ));
    rows[2].pop();
    assert!(matches!(tested(&rows), Err(GroupError::Count { .. })));
    // Copies of one shape in each group.
    let group = |i: usize| groups.labels()[i];
    let copies: Vec<Vec<f64>> = (0..4).map(|i| vec![0.3 * group(i) as f64, 0.1]).collect();
    assert_eq!(tested(&copies), Err(GroupError::EqualWithin));
    let distance = |i: usize, j: usize| f64::from(u8::from(group(i) != group(j)));
    let apart: Vec<Vec<f64>> = (0..4)
        .map(|i| (0..4).map(|j| distance(i, j)).collect())
        .collect();
    assert_eq!(
        permanova(&apart, &groups, few(9, 0)),
        Err(GroupError::EqualWithin)
    );
    // Shapes that do not differ have no difference.
    let equal = vec![vec![1.0, 2.0]; 4];
    let found = tested(&equal).unwrap();
    assert_eq!((found.f_overall, found.p_value_overall), (0.0, 1.0));
    assert_eq!(
        classify(&equal, &groups, 2, few(9, 0)).unwrap().assigned,
        [0; 4]
    );
}

/// The ellipses of samples contain the mean of the distribution as often as stated, whatever its
/// covariance; they are centred at the sample's mean, and turn and scale with the points.
#[test]
fn ellipses_contain_the_mean_as_often_as_stated() {
    let mut random = SplitMix64::new(7);
    let mut point = || {
        let mut one = || normal(random.open_uniform(), random.uniform());
        let [x, y] = [one(), one()];
        [3.0 + 2.0 * x, -1.0 + 0.7 * x + 0.3 * y]
    };
    for (n, level) in [(4, 0.95), (7, 0.95), (30, 0.95), (6, 0.5)] {
        let samples = 4000;
        let within = (0..samples).filter(|_| {
            let points: Vec<[f64; 2]> = (0..n).map(|_| point()).collect();
            mean_ellipse(&points, level).unwrap().contains([3.0, -1.0])
        });
        let share = within.count() as f64 / f64::from(samples);
        // Four standard errors.
        let bound = 4.0 * (level * (1.0 - level) / f64::from(samples)).sqrt();
        assert!((share - level).abs() < bound, "{n}: {share} {level}");
    }
    let points: Vec<[f64; 2]> = (0..9).map(|_| point()).collect();
    let ellipse = mean_ellipse(&points, 0.9).unwrap();
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / 9.0);
    let turned: Vec<[f64; 2]> = points.iter().map(|[x, y]| [-2.0 * y, 2.0 * x]).collect();
    let other = mean_ellipse(&turned, 0.9).unwrap();
    let length = |[x, y]: [f64; 2]| x.hypot(y);
    for k in 0..2 {
        assert!((ellipse.centre[k] - mean[k]).abs() < 1e-12);
        let ratio = length(other.half_axes[k]) / length(ellipse.half_axes[k]);
        assert!((ratio - 2.0).abs() < 1e-12);
        let [[x, y], [u, v]] = [ellipse.half_axes[k], other.half_axes[k]];
        assert!((x * u + y * v).abs() < 1e-12);
    }
    assert!(length(ellipse.half_axes[0]) > length(ellipse.half_axes[1]));
    for on_it in ellipse.points(12) {
        let out = [0, 1].map(|k| mean[k] + 1.001 * (on_it[k] - mean[k]));
        let inside = [0, 1].map(|k| mean[k] + 0.999 * (on_it[k] - mean[k]));
        assert!(ellipse.contains(inside) && !ellipse.contains(out));
    }
    assert_eq!(mean_ellipse(&points[..3], 0.9), None);
    let line: Vec<[f64; 2]> = (0..6).map(|i| [f64::from(i), 0.1 * f64::from(i)]).collect();
    assert_eq!(mean_ellipse(&line, 0.9), None);
}
