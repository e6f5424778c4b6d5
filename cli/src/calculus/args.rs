//! Options of `shapespace extend` and `shapespace transport`.

use std::path::PathBuf;

use clap::Args;

use crate::numbers::positive;

/// Options of `shapespace extend`.
#[derive(Clone, Debug, Args)]
pub struct ExtendArgs {
    /// Directory of a geodesic of `--form lagrangian`.
    #[arg(value_name = "GEODESIC")]
    pub geodesic: PathBuf,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Steps beyond the end [default: as many as the geodesic has].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub steps: Option<u32>,
    /// How each equation is solved.
    #[command(flatten)]
    pub solver: SolverArgs,
}

/// Options of `shapespace transport`.
#[derive(Clone, Debug, Args)]
pub struct TransportArgs {
    /// Directory of a geodesic of `--form lagrangian`.
    #[arg(value_name = "GEODESIC")]
    pub geodesic: PathBuf,
    /// A shape near the geodesic's first, a mask of the same size.
    #[arg(value_name = "VARIATION")]
    pub variation: PathBuf,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Steps from the first shape to the variation, and from the last to its counterpart.
    #[arg(long, value_name = "N", default_value_t = 4,
          value_parser = clap::value_parser!(u32).range(1..=256))]
    pub steps: u32,
    /// In a label image, the label of the object [default: every label but 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub label: Option<i64>,
    /// How each equation is solved.
    #[command(flatten)]
    pub solver: SolverArgs,
}

/// How the equation of every step is solved.
#[derive(Clone, Debug, Args)]
pub struct SolverArgs {
    /// A step is found when the correction that is left is this share of it.
    #[arg(long, value_name = "SHARE", default_value_t = 1e-6, value_parser = positive)]
    pub tolerance: f64,
    /// Most iterations of one step.
    #[arg(long, value_name = "N", default_value_t = 200,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub max_iterations: u32,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}
