//! Statistics of distances: from the lengths of all paths to a matrix, clusters and a map.
//!
//! Nothing here computes a path. The functions take numbers and give numbers, and are found beside
//! the geodesics because what lengths of discrete paths need is particular to them:
//!
//! - A length depends on the direction in which a path is computed, and some paths do not reach
//!   their end. [`PathLengths`] holds what is known in each direction, tells how unequal the two
//!   are and how often the triangle inequality fails, and makes a [`DistanceMatrix`] of it.
//! - A length depends on the number of steps; [`richardson`] takes it to the limit.
//!
//! On a [`DistanceMatrix`] work [`Dendrogram::new`] (hierarchical clustering),
//! [`classical_scaling`] and [`smacof`] (maps in few dimensions), and the measures of agreement
//! with known classes in [`nearest_neighbour_accuracy`], [`purity`] and [`adjusted_rand_index`].
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
mod lengths;
mod matrix;
mod quality;
mod richardson;
mod scaling;
mod triangle;

pub use cluster::{Dendrogram, Linkage, Merge};
pub use lengths::{Asymmetry, Completed, PathLengths};
pub use matrix::{DistanceError, DistanceMatrix};
pub use quality::{adjusted_rand_index, nearest_neighbour_accuracy, purity};
pub use richardson::richardson;
pub use scaling::{Embedding, Refined, classical_scaling, smacof, stress};
pub use triangle::{TriangleReport, triangles};
