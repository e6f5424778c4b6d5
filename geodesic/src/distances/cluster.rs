//! Hierarchical clustering.

use serde::{Deserialize, Serialize};

use super::matrix::DistanceMatrix;

/// Linkage: the distance between two clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Linkage {
    /// Distance between their nearest members.
    Single,
    /// Distance between their farthest members.
    Complete,
    /// Mean over all pairs of members (UPGMA).
    #[default]
    Average,
    /// Square root of twice the increase of the sum of squares, by the formula of Ward (1963). Meaningful
    /// for Euclidean distances only.
    Ward,
}

/// The merge of two clusters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Merge {
    /// Index of one cluster: an object if the index is below the number `n` of objects, else the
    /// result of merge `left - n`.
    pub left: usize,
    /// Index of the other cluster.
    pub right: usize,
    /// Distance between the two.
    pub height: f64,
    /// Number of objects in both.
    pub size: usize,
}

/// The tree of clusters of `n` objects: `n - 1` merges of nondecreasing height.
#[derive(Clone, Debug, PartialEq)]
pub struct Dendrogram {
    n: usize,
    merges: Vec<Merge>,
    order: Vec<usize>,
}

impl Dendrogram {
    /// Merges the nearest clusters repeatedly, by the algorithms of Müllner (*Modern hierarchical,
    /// agglomerative clustering algorithms*, 2011).
    pub fn new(matrix: &DistanceMatrix, linkage: Linkage) -> Self {
        let n = matrix.n_objects();
        let mut condensed: Vec<f64> = matrix.pairs().map(|(_, _, d)| d).collect();
        let method = match linkage {
            Linkage::Single => kodama::Method::Single,
            Linkage::Complete => kodama::Method::Complete,
            Linkage::Average => kodama::Method::Average,
            Linkage::Ward => kodama::Method::Ward,
        };
        let found = kodama::linkage(&mut condensed, n, method);
        let merges: Vec<Merge> = found
            .steps()
            .iter()
            .map(|step| Merge {
                left: step.cluster1,
                right: step.cluster2,
                height: step.dissimilarity,
                size: step.size,
            })
            .collect();
        let order = order(matrix, &merges);
        Self { n, merges, order }
    }

    /// Returns the merges, in order of height.
    pub fn merges(&self) -> &[Merge] {
        &self.merges
    }

    /// Returns the objects in an order in which every cluster is contiguous; the two parts of each
    /// are oriented so that the adjacent objects are close to each other (Gruvaeus and Wainer
    /// 1972).
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// Returns the cluster index of each object for the given number of clusters, numbered in the
    /// order of their first objects. The number is clamped to between one and the number of
    /// objects.
    pub fn labels(&self, clusters: usize) -> Vec<usize> {
        let n = self.n;
        let kept = n.saturating_sub(clusters.max(1)).min(self.merges.len());
        let mut members: Vec<Vec<usize>> = (0..n).map(|i| vec![i]).collect();
        for merge in &self.merges[..kept] {
            let mut both = std::mem::take(&mut members[merge.left]);
            both.append(&mut members[merge.right]);
            members.push(both);
        }
        members.retain(|cluster| !cluster.is_empty());
        members.sort_by_key(|cluster| cluster.iter().min().copied());
        let mut labels = vec![0; n];
        for (label, cluster) in members.iter().enumerate() {
            for &object in cluster {
                labels[object] = label;
            }
        }
        labels
    }

    /// Returns the number of clusters at which the heights of two successive merges differ most: an
    /// estimate of the number of clusters, at least two for three or more objects.
    pub fn widest_gap(&self) -> usize {
        let gaps = self
            .merges
            .windows(2)
            .map(|two| two[1].height - two[0].height);
        let widest = gaps
            .enumerate()
            .reduce(|best, next| if next.1 >= best.1 { next } else { best });
        widest.map_or(self.n, |(merge, _)| self.n - 1 - merge)
    }
}

fn order(matrix: &DistanceMatrix, merges: &[Merge]) -> Vec<usize> {
    let n = matrix.n_objects();
    let mut clusters: Vec<Vec<usize>> = (0..n).map(|i| vec![i]).collect();
    for merge in merges {
        let left = std::mem::take(&mut clusters[merge.left]);
        let right = std::mem::take(&mut clusters[merge.right]);
        clusters.push(joined(matrix, left, right));
    }
    clusters.pop().unwrap_or_default()
}

/// Concatenates both lists, each oriented so that the adjacent ends are nearest.
fn joined(matrix: &DistanceMatrix, mut left: Vec<usize>, mut right: Vec<usize>) -> Vec<usize> {
    let ends = |list: &[usize], turned: bool| {
        let (first, last) = (list[0], list[list.len() - 1]);
        if turned { (last, first) } else { (first, last) }
    };
    let turns = [(false, false), (false, true), (true, false), (true, true)];
    let best = turns
        .into_iter()
        .map(|(a, b)| (matrix.get(ends(&left, a).1, ends(&right, b).0), (a, b)))
        .reduce(|best, next| if next.0 < best.0 { next } else { best });
    let (_, (a, b)) = best.unwrap_or((0.0, (false, false)));
    if a {
        left.reverse();
    }
    if b {
        right.reverse();
    }
    left.append(&mut right);
    left
}
