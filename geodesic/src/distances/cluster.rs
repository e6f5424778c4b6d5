//! Hierarchical clustering.

use serde::{Deserialize, Serialize};

use super::matrix::DistanceMatrix;

/// How the distance between two clusters is defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Linkage {
    /// Distance of the nearest members.
    Single,
    /// Distance of the farthest members.
    Complete,
    /// Mean distance over all pairs of members (UPGMA).
    #[default]
    Average,
    /// Square root of the increase of the sum of squares, by the formula of Ward (1963); meaningful
    /// for Euclidean distances only.
    Ward,
}

/// Two clusters that become one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Merge {
    /// A cluster: an object where the number is below that of the objects, else the result of the
    /// merge of number `left - n`.
    pub left: usize,
    /// The other cluster.
    pub right: usize,
    /// Their distance.
    pub height: f64,
    /// Objects in both.
    pub size: usize,
}

/// The tree of clusters of `n` objects: `n - 1` merges, of which the heights do not fall.
#[derive(Clone, Debug, PartialEq)]
pub struct Dendrogram {
    n: usize,
    merges: Vec<Merge>,
    order: Vec<usize>,
}

impl Dendrogram {
    /// Merges the nearest clusters again and again, by the algorithms of Müllner (*Modern
    /// hierarchical, agglomerative clustering algorithms*, 2011).
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

    /// The merges, from the nearest clusters to the last two.
    pub fn merges(&self) -> &[Merge] {
        &self.merges
    }

    /// The objects in an order in which every cluster stands together; the two parts of each are
    /// turned so that the objects that meet are near each other (Gruvaeus and Wainer 1972).
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// The number of the cluster of each object where so many are left, counted in the order of
    /// their first objects. There are no fewer than one and no more than objects.
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

    /// The number of clusters at which the heights of two successive merges differ most: a guess
    /// at how many there are, and at least two of three or more objects.
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

/// Both lists in one, each turned so that the ends that meet are nearest.
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
