//! `shapespace extend`: continues a geodesic beyond its end.

use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Instant;

use ::geodesic::calculus::{SolveStatus, exponential};

use super::args::{ExtendArgs, ExtendConfig};
use super::read::{AnyGeodesic, StoredGeodesic, read};
use super::record::{Extended, ExtensionRecord};
use crate::error::{CliError, Exit};
use crate::geodesic::path::{Parts, Path};
use crate::geodesic::write::write_path;
use crate::output::ResultDir;
use crate::pool::in_pool;
use crate::progress::Progress;
use crate::report::{certified, word};
use crate::watch::{Interrupt, ProgressObserver};

/// Runs `shapespace extend`.
///
/// # Errors
/// [`CliError`]; then no result has been written.
pub fn run_extend(args: &ExtendArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    let interrupt = Interrupt::listen();
    let progress = Progress::stderr();
    let compute = |config: ExtendConfig| {
        ResultDir::create(&args.run.output).map(drop)?;
        progress.stage("reading the geodesic");
        match read(&config.geodesic)? {
            AnyGeodesic::D2(stored) => run(stored, config, args, &progress, interrupt, start),
            AnyGeodesic::D3(stored) => run(stored, config, args, &progress, interrupt, start),
        }
    };
    args.config
        .run(|config| in_pool(args.run.threads, || compute(config)))
}

fn run<const D: usize>(
    given: StoredGeodesic<D>,
    mut config: ExtendConfig,
    args: &ExtendArgs,
    progress: &Progress,
    interrupt: Interrupt,
    start: Instant,
) -> Result<Exit, CliError> {
    let given_steps = given.motions.len();
    let steps = *config.steps.get_or_insert(given_steps);
    let params = given.calculus_params(config.solver);
    let mut watch = ProgressObserver::of_equations(progress, interrupt, given.nodes());
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
    let directory = ResultDir::create(&args.run.output)?;
    write_path(&directory, &[], &path)?;
    let nodes = path.level_sets[0].grid().nodes_per_axis();
    let extended = Extended {
        given_steps,
        steps,
        steps_found,
        start_shapes: found.pieces.len(),
        length: path.energies.iter().map(|w| w.max(0.0).sqrt()).sum(),
        step_energies: path.energies,
        volumes: path.sizes,
        certificate: found.certificate,
        equations: &found.reports,
    };
    let record = ExtensionRecord::<D>::new(word(&status), &nodes, &config, extended, start);
    record.write(directory.path())?;
    let target = directory.commit()?;
    progress.finish();
    print(&record, &target);
    Ok(if status == SolveStatus::Cancelled {
        Exit::Interrupted
    } else {
        Exit::Success
    })
}

/// Prints the summary on standard output; the last line names the picture.
fn print<const D: usize>(record: &ExtensionRecord<'_, D>, target: &std::path::Path) {
    let mut text = String::new();
    // Writing into a string cannot fail, and a closed standard output is not an error.
    let _ = write_lines(&mut text, record, target);
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn write_lines<const D: usize>(
    text: &mut String,
    record: &ExtensionRecord<'_, D>,
    target: &std::path::Path,
) -> std::fmt::Result {
    let found = &record.body;
    writeln!(
        text,
        "Geodesic of {} steps, continued by {} of {}: {} in {:.1} s",
        found.given_steps, found.steps_found, found.steps, record.status, record.seconds
    )?;
    writeln!(
        text,
        "  deformation  {}, determinant at least {:.3e}",
        certified(&found.certificate),
        found.certificate.min_det
    )?;
    let file = |name: &str| target.join(name).display().to_string();
    writeln!(text, "  results      {}", file("result.json"))?;
    writeln!(text, "  picture      {}", file("geodesic.png"))
}
