//! `shapespace extend`: a geodesic goes on beyond its end.

use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Instant;

use ::geodesic::calculus::{SolveStatus, exponential};

use super::args::ExtendArgs;
use super::read::{AnyGiven, Given, read};
use super::record::{EquationRecord, ExtensionRecord, name};
use crate::error::{CliError, Exit};
use crate::geodesic::draw::{Draw, Pictures};
use crate::geodesic::path::{Parts, Path};
use crate::geodesic::write::write_path;
use crate::output::{ResultDir, write_json};
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::report::CertificateRecord;
use crate::watch::{Interrupt, Watch};

/// Runs `shapespace extend`.
///
/// # Errors
/// [`CliError`]; then nothing has been written.
pub fn run_extend(args: &ExtendArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    in_pool(args.solver.threads, || {
        ResultDir::create(&args.output).map(drop)?;
        progress.stage("reading the geodesic");
        match read(&args.geodesic)? {
            AnyGiven::D2(given) => run(given, args, &progress, interrupt, start),
            AnyGiven::D3(given) => run(given, args, &progress, interrupt, start),
        }
    })
}

fn run<const D: usize>(
    given: Given<D>,
    args: &ExtendArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError>
where
    Pictures: Draw<D>,
{
    let given_steps = given.motions.len();
    let steps = args.steps.map_or(given_steps, |steps| steps as usize);
    let params = given.calculus_params(&args.solver);
    let mut watch = Watch::of_equations(progress, interrupt, given.nodes());
    let first = &given.level_sets[0];
    let found = exponential(first, &given.motions, steps, &params, &mut watch)?;
    watch.finish();
    let steps_found = found.step_energies.len();
    let status = found.status();
    if steps_found == 0 && status != SolveStatus::Cancelled {
        return Err(CliError::Computation {
            message: "the geodesic cannot be continued: no step from its end was found".into(),
            remedy: "compute the geodesic with more steps (-K) or on a finer --grid, and see that \
                     its end shape does not touch the border of the box"
                .into(),
        });
    }
    progress.stage("writing");
    interrupt.writing();
    let (shapes, displacements) = found.shapes()?;
    let mut parts = Parts {
        level_sets: given.level_sets,
        displacements: given.displacements,
        energies: given.energies,
        steps: given_steps,
        names: (0..=given_steps + steps_found)
            .map(|k| match k {
                0 => given.names[0].clone(),
                _ if k < given_steps => format!("{k} of {given_steps}"),
                _ if k == given_steps => given.names[1].clone(),
                _ => format!("+{}", k - given_steps),
            })
            .collect(),
        target: None,
    };
    parts.level_sets.extend(shapes);
    parts.displacements.extend(displacements);
    parts.energies.extend(&found.step_energies);
    let path = Path::of(parts, &params.law)?;
    let directory = ResultDir::create(&args.output)?;
    write_path(&directory, &[], &path)?;
    let record = ExtensionRecord {
        version: env!("CARGO_PKG_VERSION"),
        status: name(status),
        dimension: D,
        nodes: path.level_sets[0].grid().nodes_per_axis().to_vec(),
        geodesic: args.geodesic.display().to_string(),
        given_steps,
        steps,
        steps_found,
        tolerance: params.tolerance,
        start_shapes: found.pieces.len(),
        length: path.energies.iter().map(|w| w.max(0.0).sqrt()).sum(),
        step_energies: path.energies,
        volumes: path.sizes,
        certificate: CertificateRecord::new(&found.certificate),
        equations: found.reports.iter().map(EquationRecord::new).collect(),
        seconds: start.elapsed().as_secs_f64(),
    };
    write_json(&directory.file("result.json"), &record)?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(if status == SolveStatus::Cancelled {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}

/// The closing words on standard output; the last line names the picture.
fn print(record: &ExtensionRecord, target: &std::path::Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and nobody is left to be told where standard output is
    // closed.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines(
    text: &mut String,
    record: &ExtensionRecord,
    target: &std::path::Path,
) -> std::fmt::Result {
    writeln!(
        text,
        "Geodesic of {} steps, continued by {} of {}: {} in {:.1} s",
        record.given_steps, record.steps_found, record.steps, record.status, record.seconds
    )?;
    writeln!(
        text,
        "  deformation  {}, determinant at least {:.3e}",
        record.certificate.words(),
        record.certificate.min_det
    )?;
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("geodesic.png"))
}
