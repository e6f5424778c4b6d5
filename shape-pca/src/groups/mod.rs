//! Statistics of groups: whether the shapes of several groups differ, where, and whether they can be
//! told apart.
//!
//! All p-values are those of permutation tests: the share of relabellings of the shapes whose statistic is
//! at least that of the given labels, which itself counts as one of them. Such a p-value is valid for any
//! distribution of the shapes, if they can be exchanged under the null hypothesis. Every relabelling is
//! drawn from its own seed, so that results do not depend on the number of threads.
//!
//! | Question | Function |
//! |---|---|
//! | Does any mode, or a given one, differ between the groups? | [`compare_scores`] |
//! | Do the distances show groups? | [`permanova`] |
//! | Where on the boundary do they differ? | [`compare_points`] |
//! | Do the modes depend on a covariate? | [`regress`] |
//! | Where may the mean of a group lie? | [`mean_ellipse`] |
//! | Can a shape's group be told from its scores? | [`classify`] |

mod analysis_of_variance;
mod classification;
mod distances;
mod ellipse;
mod labels;
mod points;
mod regression;
mod relabelling;
mod scores;

pub use classification::{Classification, classify};
pub use distances::{Permanova, permanova};
pub use ellipse::{Ellipse, mean_ellipse};
pub use labels::{GroupError, Groups};
pub use points::{PointTests, compare_points, false_discovery_rates};
pub use regression::{Regression, is_constant, regress};
pub use relabelling::Relabelling;
pub use scores::{ScoreTests, compare_scores};
