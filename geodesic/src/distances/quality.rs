//! Agreement of distances and clusters with known classes.
//!
//! Classes and clusters are integer labels, one per object; their values do not matter.

use std::collections::BTreeMap;

use super::matrix::DistanceMatrix;

/// Computes the fraction of objects whose nearest neighbour among all others belongs to the same
/// class (leave-one-out). The first of equally near ones counts. Objects that are the only ones of
/// their class are left out; `None` if all are.
///
/// # Panics
/// If there is not one class per object.
pub fn nearest_neighbour_accuracy(matrix: &DistanceMatrix, classes: &[usize]) -> Option<f64> {
    let n = matrix.n_objects();
    assert_eq!(classes.len(), n, "one class for each object");
    let others = |i: usize| (0..n).filter(move |&j| j != i);
    let (mut right, mut counted) = (0, 0);
    for i in 0..n {
        if others(i).all(|j| classes[j] != classes[i]) {
            continue;
        }
        counted += 1;
        let nearest = others(i).min_by(|&a, &b| matrix.get(i, a).total_cmp(&matrix.get(i, b)));
        if nearest.is_some_and(|j| classes[j] == classes[i]) {
            right += 1;
        }
    }
    (counted > 0).then(|| f64::from(right) / f64::from(counted))
}

/// Computes the fraction of objects that belong to the most frequent class of their cluster: 1 if
/// no cluster mixes classes. It grows with the number of clusters.
///
/// # Panics
/// If there is not one cluster and one class per object.
pub fn purity(clusters: &[usize], classes: &[usize]) -> f64 {
    let table = Contingency::new(clusters, classes);
    let mut most: BTreeMap<usize, usize> = BTreeMap::new();
    for (&(cluster, _), &count) in &table.both {
        let entry = most.entry(cluster).or_default();
        *entry = (*entry).max(count);
    }
    most.values().sum::<usize>() as f64 / clusters.len().max(1) as f64
}

/// Computes the adjusted Rand index of two partitions: the fraction of pairs on which they agree,
/// shifted and scaled such that its expected value for random partitions is 0 and that for equal
/// partitions is 1. If the expected agreement is already complete, it is 1.
///
/// Source: L. Hubert and P. Arabie, *Comparing partitions*, Journal of Classification 2 (1985).
///
/// # Panics
/// If there is not one cluster and one class per object.
pub fn adjusted_rand_index(clusters: &[usize], classes: &[usize]) -> f64 {
    let table = Contingency::new(clusters, classes);
    let pairs = |counts: &mut dyn Iterator<Item = usize>| -> f64 {
        counts.map(|c| (c * c.saturating_sub(1) / 2) as f64).sum()
    };
    let both = pairs(&mut table.both.values().copied());
    let (a, b) = (
        pairs(&mut table.clusters.values().copied()),
        pairs(&mut table.classes.values().copied()),
    );
    let all = pairs(&mut std::iter::once(clusters.len()));
    let expected = if all > 0.0 { a * b / all } else { 0.0 };
    let most = 0.5 * (a + b);
    if most == expected {
        1.0
    } else {
        (both - expected) / (most - expected)
    }
}

/// Contingency table: numbers of objects of each cluster, each class, and each class in each
/// cluster.
struct Contingency {
    clusters: BTreeMap<usize, usize>,
    classes: BTreeMap<usize, usize>,
    both: BTreeMap<(usize, usize), usize>,
}

impl Contingency {
    fn new(clusters: &[usize], classes: &[usize]) -> Self {
        assert_eq!(clusters.len(), classes.len(), "as many classes as clusters");
        let mut table = Self {
            clusters: BTreeMap::new(),
            classes: BTreeMap::new(),
            both: BTreeMap::new(),
        };
        for (&cluster, &class) in clusters.iter().zip(classes) {
            *table.clusters.entry(cluster).or_default() += 1;
            *table.classes.entry(class).or_default() += 1;
            *table.both.entry((cluster, class)).or_default() += 1;
        }
        table
    }
}
