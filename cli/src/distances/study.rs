//! Evaluation of the lengths of all paths: two matrices, clusters, an embedding, and their
//! agreement with known classes.

use ::geodesic::distances::{
    Asymmetry, Dendrogram, DistanceError, DistanceMatrix, PathLengths, TriangleReport,
    adjusted_rand_index, nearest_neighbour_accuracy, purity, richardson, triangles,
};

use std::collections::HashMap;

use serde::{Serialize, Serializer};

use super::args::DistancesConfig;
use super::classes::{Classes, Labels};
use super::map::Map;
use super::neighbours::Neighbours;
use super::pair::{Measured, PairRecord};
use super::scope::Scope;
use crate::error::CliError;

/// Extrapolations that would change a length by more than this are not applied: the paths of the
/// two numbers of steps are then of different kinds.
const MOST_CORRECTION: f64 = 0.25;

/// The evaluation of all pairs.
pub(super) struct Study {
    /// By the lengths of the paths.
    pub distances: Distances,
    /// By the roots of the elastic energies.
    pub elastic: Distances,
    /// Pairs whose distance is not extrapolated although this was requested.
    pub not_extrapolated: Vec<[usize; 2]>,
    /// The embedding of the distances; `None` if some shapes have none.
    pub map: Option<Map>,
    /// The nearest neighbours by the distances, where they are asked for.
    pub neighbours: Option<Neighbours>,
    /// Whether every pair that is asked for has a distance by a path of its own.
    pub complete: bool,
}

/// A kind of distance between shapes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Distances {
    /// One number for both directions.
    #[serde(skip)]
    pub between: PathLengths,
    /// Asymmetry of the two directions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asymmetry: Option<Asymmetry>,
    /// Violations of the triangle inequality.
    pub triangles: TriangleReport,
    /// Every pair; `None` if some shapes cannot be reached from others.
    #[serde(flatten)]
    pub completed: Option<Completed>,
}

/// A matrix without gaps, and its agreement with the classes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Completed {
    #[serde(serialize_with = "rows")]
    pub matrix: DistanceMatrix,
    /// Pairs whose distance is the shortest way through other shapes.
    pub filled: Vec<[usize; 2]>,
    #[serde(skip)]
    pub tree: Dendrogram,
    /// Number of clusters shown.
    #[serde(skip)]
    pub clusters: usize,
    /// The cluster of each shape.
    #[serde(skip)]
    pub labels: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub agreement: Option<Agreement>,
}

/// Agreement of nearest neighbours and clusters with known classes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Agreement {
    /// Share of shapes whose nearest neighbour is of their class, among those that are not alone in
    /// it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest_neighbour_accuracy: Option<f64>,
    /// With as many clusters as classes.
    pub purity: f64,
    /// With as many clusters as classes.
    pub adjusted_rand_index: f64,
}

impl Study {
    /// The evaluation of the records of the whole scope, or of a part of it. Without distances between
    /// all shapes there are no clusters, and no map.
    ///
    /// # Errors
    /// [`CliError::Computation`] for lengths that are no distances.
    pub fn new(
        scope: &Scope,
        records: &[PairRecord],
        config: &DistancesConfig,
        labels: Option<&Labels>,
        whole: bool,
    ) -> Result<Self, CliError> {
        let Evaluated {
            lengths,
            elastic,
            between,
            not_extrapolated,
        } = Evaluated::new(scope.n_shapes(), records, config);
        let classes = labels.and_then(Labels::all);
        let all = whole && scope.is_all();
        let analyse = |lengths: &PathLengths, between: PathLengths| {
            Distances::new(lengths, between, config, classes, all)
        };
        let distances = analyse(&lengths, between)?;
        let map = match &distances.completed {
            Some(completed) => Some(Map::whole(&completed.matrix)),
            None if whole => Map::of_landmarks(scope, &distances.between),
            None => None,
        };
        let known = |r: &PairRecord| distances.between.between(r.start, r.end).is_some();
        let count = config.listed_neighbours().filter(|_| whole);
        Ok(Self {
            complete: whole && records.iter().all(known),
            neighbours: count
                .map(|count| Neighbours::new(scope, count, &distances.between, labels)),
            distances,
            elastic: analyse(&elastic, elastic.clone())?,
            not_extrapolated,
            map,
        })
    }
}

/// The lengths of paths, and the distances by them.
pub(super) struct Evaluated {
    /// Of the paths with the requested number of steps.
    pub lengths: PathLengths,
    /// Of those of a single step.
    elastic: PathLengths,
    /// The distances by the first, extrapolated on request.
    pub between: PathLengths,
    /// Pairs for which that was not possible.
    not_extrapolated: Vec<[usize; 2]>,
}

impl Evaluated {
    /// The lengths between `n` shapes by the records of some paths.
    pub fn new(n: usize, records: &[PairRecord], config: &DistancesConfig) -> Self {
        let by_ends: HashMap<[usize; 2], &PairRecord> =
            records.iter().map(|r| ([r.start, r.end], r)).collect();
        let of = |start: usize, end: usize, steps: &[usize]| -> Option<Measured> {
            by_ends.get(&[start, end])?.measured(config, steps)
        };
        let measured: Vec<Option<Measured>> = (0..n * n)
            .map(|at| of(at / n, at % n, &config.steps()))
            .collect();
        let one_step: Vec<Option<f64>> = (0..n * n)
            .map(|at| of(at / n, at % n, &[1]).map(|m| m.length))
            .collect();
        let lengths = PathLengths::from_fn(n, |i, j| measured[i * n + j].map(|m| m.length));
        let elastic = PathLengths::from_fn(n, |i, j| one_step[i * n + j]);
        let mut not_extrapolated = Vec::new();
        let mut between = lengths.clone();
        if config.richardson {
            let limit = |i: usize, j: usize| limit(measured[i * n + j], measured[j * n + i]);
            for i in 0..n {
                for j in i + 1..n {
                    if lengths.between(i, j).is_some() && limit(i, j).is_none() {
                        not_extrapolated.push([i, j]);
                    }
                }
            }
            between = PathLengths::from_fn(n, |i, j| limit(i, j).or_else(|| lengths.between(i, j)));
        }
        Self {
            lengths,
            elastic,
            between,
            not_extrapolated,
        }
    }
}

/// The distance extrapolated to infinitely many steps: from the mean of both directions, of order
/// two, or from one direction, of order one. `None` if there is nothing to extrapolate from.
fn limit(there: Option<Measured>, back: Option<Measured>) -> Option<f64> {
    let whole = |m: Option<Measured>| m.and_then(|m| Some((m.half?, m.length)));
    let (half, length, order) = match (there, back) {
        (Some(_), Some(_)) => {
            let (a, b) = (whole(there)?, whole(back)?);
            (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1), 2)
        }
        (one, other) => {
            let (half, length) = whole(one.or(other))?;
            (half, length, 1)
        }
    };
    let found = richardson(half, length, order);
    ((found - length).abs() <= MOST_CORRECTION * length).then_some(found)
}

fn rows<S: Serializer>(matrix: &DistanceMatrix, out: S) -> Result<S::Ok, S::Error> {
    out.collect_seq((0..matrix.n_objects()).map(|i| matrix.row(i)))
}

impl Distances {
    /// Smallest and largest distance of different shapes.
    pub fn range(&self) -> Option<[f64; 2]> {
        let pairs = self.completed.as_ref()?.matrix.pairs();
        Some(
            pairs.fold([f64::INFINITY, 0.0], |[low, high], (.., distance)| {
                [low.min(distance), high.max(distance)]
            }),
        )
    }

    /// Evaluates lengths in both directions and the symmetric distances computed from them.
    fn new(
        lengths: &PathLengths,
        between: PathLengths,
        config: &DistancesConfig,
        classes: Option<&Classes>,
        all: bool,
    ) -> Result<Self, CliError> {
        // What is missing in a part is no path that could not be found.
        let completed = if all {
            between.completed().map_err(|error| failed(&error))?
        } else {
            None
        };
        Ok(Self {
            asymmetry: lengths.asymmetry(),
            triangles: triangles(lengths.n_objects(), |i, j| between.between(i, j)),
            completed: completed.map(|found| {
                let tree = Dendrogram::new(&found.matrix, config.linkage);
                let clusters = match (config.clusters, classes) {
                    (Some(clusters), _) => clusters,
                    (None, Some(classes)) => classes.names.len(),
                    (None, None) => tree.widest_gap(),
                };
                // With one class there is nothing to agree with.
                let several = classes.filter(|classes| classes.names.len() > 1);
                let agreement =
                    several.map(|classes| Agreement::new(&found.matrix, &tree, classes));
                Completed {
                    labels: tree.labels(clusters),
                    matrix: found.matrix,
                    filled: found.filled,
                    tree,
                    clusters,
                    agreement,
                }
            }),
            between,
        })
    }
}

impl Agreement {
    fn new(matrix: &DistanceMatrix, tree: &Dendrogram, classes: &Classes) -> Self {
        let labels = tree.labels(classes.names.len());
        Self {
            nearest_neighbour_accuracy: nearest_neighbour_accuracy(matrix, &classes.of_input),
            purity: purity(&labels, &classes.of_input),
            adjusted_rand_index: adjusted_rand_index(&labels, &classes.of_input),
        }
    }
}

fn failed(error: &DistanceError) -> CliError {
    CliError::Computation {
        message: format!("the lengths are not distances: {error}"),
        remedy: "please report it with the inputs".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::geodesic::Form;

    fn measured(length: f64, half: Option<f64>) -> Measured {
        Measured {
            form: Form::Lagrangian,
            length,
            half,
        }
    }

    #[test]
    fn the_mean_of_both_directions_is_extrapolated_to_second_order() {
        // L = 1 + c / K + d / K^2 with K = 4, c of the other sign in the other direction.
        let path = |c: f64| {
            let length = |k: f64| 1.0 + c / k + 0.5 / (k * k);
            Some(measured(length(4.0), Some(length(2.0))))
        };
        let both = limit(path(0.3), path(-0.3)).unwrap();
        assert!((both - 1.0).abs() < 1e-15, "{both}");
        let one = limit(path(0.3), None).unwrap();
        // First order leaves -2 d / K^2.
        assert!((one - 1.0 + 2.0 * 0.5 / 16.0).abs() < 1e-15, "{one}");
        assert_eq!(limit(Some(measured(1.0, None)), path(0.0)), None);
        assert_eq!(limit(Some(measured(1.0, Some(2.0))), None), None);
        assert_eq!(limit(None, None), None);
    }
}
