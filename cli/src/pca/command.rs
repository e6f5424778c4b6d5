//! `shapespace pca`: the modes of variation of an average.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use shape_pca::{Compound, Pca, Quality};

use super::args::{PcaArgs, PcaConfig};
use super::outcome::Outcome;
use super::read::{AnyAverage, StoredAverage, read_average};
use super::record::PcaRecord;
use super::write::write_all;
use crate::error::{CliError, Exit};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;

/// Runs `shapespace pca`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_pca(args: &PcaArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let progress = Progress::stderr();
    let compute = |mut config: PcaConfig| {
        ResultDir::create(&args.run.output).map(drop)?;
        progress.stage("reading the average");
        let stored = read_average(&config.average)?;
        // The modes refer to the directory of the average, which is read again with them.
        config.average = fs::canonicalize(&config.average).unwrap_or(config.average);
        match stored {
            AnyAverage::D2(stored) => run(&stored, &config, args, &progress, start),
            AnyAverage::D3(stored) => run(&stored, &config, args, &progress, start),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn run<const D: usize>(
    stored: &StoredAverage<D>,
    config: &PcaConfig,
    args: &PcaArgs,
    progress: &Progress,
    start: Instant,
) -> Result<Exit, CliError> {
    let params = stored.pca_params(config.params);
    let most = config.modes.unwrap_or(usize::MAX);
    progress.stage("assembling the compound operator");
    let compound = Compound::new(&stored.average, &params)?;
    progress.stage(format!(
        "solving for {} displacements",
        stored.average.n_shapes()
    ));
    let pca = Pca::new(&stored.average, &compound, most)?;
    let quality = Quality::new(&pca.gram, params.zero_eigenvalue, most)?;
    progress.stage("writing");
    let outcome = Outcome {
        config,
        stored,
        pca: &pca,
        quality,
        start,
    };
    let directory = ResultDir::create(&args.run.output)?;
    let record = write_all(&directory, &outcome)?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(Exit::Success)
}

/// Prints the summary on standard output; the last line names the picture.
fn print<const D: usize>(record: &PcaRecord<'_, D>, target: &Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &PcaRecord<'_, D>,
    target: &Path,
) -> std::fmt::Result {
    let found = &record.body;
    writeln!(
        text,
        "{} modes of variation of {} shapes in {:.1} s",
        found.n_modes, found.n_shapes, record.seconds
    )?;
    let ratios: Vec<String> = found
        .ratios
        .iter()
        .take(6)
        .map(|r| format!("{r:.3}"))
        .collect();
    writeln!(
        text,
        "  eigenvalues  {:.4e}, ratios {}",
        found.eigenvalues[0],
        ratios.join(" ")
    )?;
    writeln!(
        text,
        "  stresses     balanced up to {:.1} %, object {}",
        100.0 * found.balance,
        if found.definite {
            "positive definite"
        } else {
            "NOT positive definite"
        }
    )?;
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("modes.png"))
}
