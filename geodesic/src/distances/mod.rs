//! Statistics of distances: from the lengths of all paths to a matrix, clusters and a map.
//!
//! No paths are computed here. The functions operate on numbers; they are part of this crate
//! because they handle properties particular to lengths of discrete paths:
//!
//! - A length depends on the direction in which a path is computed, and some paths do not reach
//!   their end. [`PathLengths`] stores the known lengths of each direction, reports their asymmetry
//!   and the violations of the triangle inequality, and computes a [`DistanceMatrix`].
//! - A length depends on the number of steps; [`richardson`] extrapolates it to the limit.
//!
//! A [`DistanceMatrix`] is the input of [`Dendrogram::new`] (hierarchical clustering),
//! [`classical_scaling`] and [`smacof`] (maps in few dimensions), and the measures of agreement
//! with known classes: [`nearest_neighbour_accuracy`], [`purity`] and [`adjusted_rand_index`].
//! [`nearest`] and [`vote`] classify new objects by their distances from known ones.
//!
//! Many objects have more pairs than can be computed. [`Search`] finds nearest neighbours with a part of
//! the lengths, by a calibrated [`LowerBound`], and [`landmark_scaling`] makes a map of the distances
//! from a few objects.
//!
//! ```
//! use geodesic::distances::{Dendrogram, DistanceMatrix, Linkage, classical_scaling};
//!
//! // Two and two points on a line.
//! let places = [0.0, 1.0, 10.0, 11.0_f64];
//! let matrix = DistanceMatrix::from_fn(4, |i, j| (places[i] - places[j]).abs())?;
//! let tree = Dendrogram::new(&matrix, Linkage::Average);
//! assert_eq!(tree.labels(2), [0, 0, 1, 1]);
//! let map = classical_scaling::<2>(&matrix);
//! assert!((map.explained - 1.0).abs() < 1e-12);
//! # Ok::<(), geodesic::distances::DistanceError>(())
//! ```

mod cluster;
mod doubts;
mod landmarks;
mod lengths;
mod matrix;
mod neighbours;
mod quality;
mod richardson;
mod scaling;
mod skipping;
mod triangle;

pub use cluster::{Dendrogram, Linkage, Merge};
pub use doubts::doubts;
pub use landmarks::{LandmarkEmbedding, landmark_scaling, random_sample};
pub use lengths::{Asymmetry, Completed, PathLengths};
pub use matrix::{DistanceError, DistanceMatrix};
pub use neighbours::{Neighbour, nearest, vote};
pub use quality::{adjusted_rand_index, nearest_neighbour_accuracy, purity};
pub use richardson::richardson;
pub use scaling::{Embedding, Refined, classical_scaling, smacof, stress, stress_of_pairs};
pub use skipping::{Known, LowerBound, Search, kept};
pub use triangle::{TriangleReport, triangles};
