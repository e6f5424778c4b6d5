//! Options of `shapespace verify`.

use std::path::PathBuf;

use clap::Args;

/// Options of `shapespace verify`.
#[derive(Clone, Debug, Args)]
pub struct VerifyArgs {
    /// Statements to check, by name or by theme (the part of a name before the first hyphen)
    /// [default: all].
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// New directory for the results.
    #[arg(short, long, value_name = "DIR", required_unless_present = "list")]
    pub output: Option<PathBuf>,
    /// Run smaller experiments, all of them in less than two minutes.
    #[arg(long)]
    pub quick: bool,
    /// Break one ingredient of every experiment; each statement must then be refuted.
    #[arg(long)]
    pub broken: bool,
    /// List the statements and their sources, and exit.
    #[arg(long)]
    pub list: bool,
    /// Number of threads [default: all cores]. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}
