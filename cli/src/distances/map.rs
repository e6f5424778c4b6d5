//! Maps of the shapes: of all distances, or of those from landmarks.

use ::geodesic::distances::{
    Completed, DistanceMatrix, Embedding, PathLengths, Refined, classical_scaling,
    landmark_scaling, smacof, stress, stress_of_pairs,
};
use serde::Serialize;

use super::scope::Scope;

/// A point for every shape.
pub(super) enum Map {
    /// By the distances between all shapes.
    Whole {
        classical: Embedding<2>,
        refined: Refined<2>,
        /// The stress before the refinement.
        stress: f64,
    },
    /// By the distances from landmarks.
    Landmarks(LandmarkMap),
}

/// A map by the distances from landmarks.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LandmarkMap {
    points: Vec<[f64; 2]>,
    /// Kruskal's first, over all pairs with a distance.
    stress: f64,
    /// The numbers of the landmarks.
    pub landmarks: Vec<usize>,
    /// Share of the variance of the landmarks in these two dimensions.
    explained: f64,
    /// Share of their negative eigenvalues.
    negative: f64,
    eigenvalues: Vec<f64>,
}

impl Map {
    /// The map of a matrix without gaps.
    pub fn whole(matrix: &DistanceMatrix) -> Self {
        let classical = classical_scaling(matrix);
        Self::Whole {
            refined: smacof(matrix, &classical.points),
            stress: stress(matrix, &classical.points),
            classical,
        }
    }

    /// The map by the distances from the landmarks; `None` without landmarks, or if some shape has no path
    /// to any of them. A distance from a landmark that is missing is replaced by the shortest way through
    /// another one.
    pub fn of_landmarks(scope: &Scope, between: &PathLengths) -> Option<Self> {
        let landmarks = scope.landmarks();
        if landmarks.is_empty() {
            return None;
        }
        let among = PathLengths::from_fn(landmarks.len(), |i, j| {
            between.between(landmarks[i], landmarks[j])
        });
        // Lengths of paths are no distances only if they are not finite, which are none.
        let Completed { matrix, .. } = among.completed().ok()??;
        let others = (0..scope.n_shapes()).filter(|shape| !landmarks.contains(shape));
        let others: Vec<usize> = others.collect();
        let row = |&shape: &usize| -> Option<Vec<f64>> {
            let own = landmarks
                .iter()
                .map(|&landmark| between.between(shape, landmark));
            let own: Vec<Option<f64>> = own.collect();
            let by = |k: usize| {
                let ways = own.iter().enumerate();
                let ways = ways.filter_map(|(l, way)| Some((*way)? + matrix.get(l, k)));
                ways.reduce(f64::min)
            };
            (0..landmarks.len())
                .map(|k| own[k].or_else(|| by(k)))
                .collect()
        };
        let rows: Option<Vec<Vec<f64>>> = others.iter().map(row).collect();
        let found = landmark_scaling::<2>(&matrix, &rows?);
        let mut points = vec![[0.0; 2]; scope.n_shapes()];
        for (&shape, point) in landmarks.iter().chain(&others).zip(&found.points) {
            points[shape] = *point;
        }
        let n = scope.n_shapes();
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j]));
        let known = pairs.filter_map(|[i, j]| Some((i, j, between.between(i, j)?)));
        Some(Self::Landmarks(LandmarkMap {
            stress: stress_of_pairs(known, &points),
            points,
            landmarks: landmarks.to_vec(),
            explained: found.explained,
            negative: found.negative,
            eigenvalues: found.eigenvalues,
        }))
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 2]] {
        match self {
            Self::Whole { refined, .. } => &refined.points,
            Self::Landmarks(map) => &map.points,
        }
    }

    /// How good the map is, in words.
    pub fn quality(&self) -> String {
        match self {
            Self::Whole {
                refined, classical, ..
            } => format!(
                "stress {:.3}, {:.2} of the variance in classical scaling",
                refined.stress, classical.explained
            ),
            Self::Landmarks(map) => format!(
                "stress {:.3}, {:.2} of the variance of {} landmarks",
                map.stress,
                map.explained,
                map.landmarks.len()
            ),
        }
    }
}

impl LandmarkMap {
    /// The stress and the share of the variance.
    pub fn figures(&self) -> (f64, f64) {
        (self.stress, self.explained)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::DistancesConfig;

    const PLACES: [[f64; 2]; 6] = [
        [0.0, 0.0],
        [3.0, 0.0],
        [0.0, 2.0],
        [3.0, 2.5],
        [1.0, 1.0],
        [2.0, -0.7],
    ];

    fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
        (a[0] - b[0]).hypot(a[1] - b[1])
    }

    fn scope() -> Scope {
        Scope::new(&DistancesConfig {
            inputs: (0..6).map(|i| format!("{i}.png").into()).collect(),
            landmarks: Some(4),
            ..DistancesConfig::default()
        })
    }

    /// The map by the distances of the landmarks, that of one pair replaced.
    fn found(other: Option<([usize; 2], Option<f64>)>) -> LandmarkMap {
        let scope = scope();
        let is_landmark = |shape: usize| scope.landmarks().contains(&shape);
        let between = PathLengths::from_fn(6, |i, j| match other {
            Some((pair, distance)) if pair == [i.min(j), i.max(j)] => distance,
            _ => (is_landmark(i) || is_landmark(j)).then(|| apart(PLACES[i], PLACES[j])),
        });
        match Map::of_landmarks(&scope, &between) {
            Some(Map::Landmarks(map)) => map,
            _ => panic!("there is a map"),
        }
    }

    #[test]
    fn points_are_those_of_their_shapes() {
        let map = found(None);
        assert_eq!(map.landmarks, scope().landmarks());
        for i in 0..6 {
            for j in 0..i {
                let distance = apart(map.points[i], map.points[j]);
                assert!((distance - apart(PLACES[i], PLACES[j])).abs() < 1e-9);
            }
        }
        assert!(map.stress < 1e-9);
    }

    #[test]
    fn a_missing_distance_from_a_landmark_is_the_shortest_way() {
        let landmarks = scope().landmarks().to_vec();
        let mut others = (0..6).filter(|shape| !landmarks.contains(shape));
        let (other, landmark) = (others.next().unwrap(), landmarks[0]);
        let pair = [other.min(landmark), other.max(landmark)];
        let ways = landmarks[1..]
            .iter()
            .map(|&by| apart(PLACES[other], PLACES[by]) + apart(PLACES[by], PLACES[landmark]));
        let way = ways.reduce(f64::min);
        let (missing, longer) = (found(Some((pair, None))), found(Some((pair, way))));
        assert_eq!(missing.points, longer.points);
        // Of the pairs that are known none is of two shapes that are no landmarks.
        let (mut misfit, mut all) = (0.0, 0.0);
        for i in 0..6 {
            for j in 0..i {
                let known = landmarks.contains(&i) || landmarks.contains(&j);
                if known && [j, i] != pair {
                    let distance = apart(PLACES[i], PLACES[j]);
                    misfit += (apart(missing.points[i], missing.points[j]) - distance).powi(2);
                    all += distance * distance;
                }
            }
        }
        assert!((missing.stress - f64::sqrt(misfit / all)).abs() < 1e-12);
        assert!(missing.stress > 0.01);
    }
}
