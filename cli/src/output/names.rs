//! Names of files, and of what they hold, that reports look for.

/// How the names of files of single modes begin.
pub(crate) const MODE: &str = "mode_";

/// How the names of the surfaces of inputs begin, and the array of the ways of their points.
pub(crate) const INPUT: &str = "input";
pub(crate) const DISPLACEMENT: &str = "displacement";

/// How the names of the visibility masks of inputs begin.
pub(crate) const VISIBILITY: &str = "visibility";

/// The boundary with the tests at its points, as a table and as a surface.
pub(crate) const BOUNDARY: &str = "boundary";
/// Its column of false discovery rates.
pub(crate) const RATE: &str = "false_discovery_rate";
/// Its column of the differences of means, without their unit.
pub(crate) const DIFFERENCE: &str = "difference";
