//! `shapespace pca`: the modes of variation of an average.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use shape_pca::{Compound, Pca, Quality};

use super::args::PcaArgs;
use super::outcome::Outcome;
use super::read::{AnyAverage, GivenAverage, read_average};
use super::record::PcaRecord;
use super::write::write_all;
use crate::error::{CliError, Exit};
use crate::geodesic::draw::{Draw, Pictures};
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;

/// Runs `shapespace pca`.
///
/// # Errors
/// [`CliError`]; then nothing has been written.
pub fn run_pca(args: &PcaArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let progress = Progress::stderr();
    in_pool(args.threads, || {
        ResultDir::create(&args.output).map(drop)?;
        progress.stage("reading the average");
        match read_average(&args.average)? {
            AnyAverage::D2(given) => run(&given, args, &progress, start),
            AnyAverage::D3(given) => run(&given, args, &progress, start),
        }
    })
}

fn run<const D: usize>(
    given: &GivenAverage<D>,
    args: &PcaArgs,
    progress: &Progress,
    start: Instant,
) -> Result<Exit, CliError>
where
    Pictures: Draw<D>,
{
    let params = given.pca_params(args.metric, args.at_rest, args.tolerance);
    let most = args.modes.map_or(usize::MAX, |modes| modes as usize);
    progress.stage("assembling the compound operator");
    let compound = Compound::new(&given.average, &params)?;
    progress.stage(format!(
        "solving for {} displacements",
        given.average.n_shapes()
    ));
    let pca = Pca::new(&given.average, &compound, most)?;
    let quality = Quality::new(&pca.gram, params.zero_eigenvalue, most)?;
    progress.stage("writing");
    let outcome = Outcome {
        args,
        given,
        pca: &pca,
        quality,
        start,
    };
    let directory = ResultDir::create(&args.output)?;
    let record = write_all(&directory, &outcome)?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(Exit::Success)
}

/// The closing words on standard output; the last line names the picture.
fn print(record: &PcaRecord, target: &Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and nobody is left to be told where standard output is
    // closed.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines(text: &mut String, record: &PcaRecord, target: &Path) -> std::fmt::Result {
    writeln!(
        text,
        "{} modes of variation of {} shapes in {:.1} s",
        record.n_modes, record.n_shapes, record.seconds
    )?;
    let ratios: Vec<String> = record
        .ratios
        .iter()
        .take(6)
        .map(|r| format!("{r:.3}"))
        .collect();
    writeln!(
        text,
        "  eigenvalues  {:.4e}, ratios {}",
        record.eigenvalues[0],
        ratios.join(" ")
    )?;
    writeln!(
        text,
        "  stresses     balanced up to {:.1} %, object {}",
        100.0 * record.balance,
        if record.definite {
            "positive definite"
        } else {
            "NOT positive definite"
        }
    )?;
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("modes.png"))
}
