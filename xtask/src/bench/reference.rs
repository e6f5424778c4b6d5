//! `bench reference`: the cases of the authors' own research code, with their functional.
//!
//! For the bars their phase fields are used and the functional is theirs, so that `J` can be
//! compared. The other shapes have our phase fields; there only times and overlaps can be compared.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use shape_average::AverageParams;

use super::averages::{AUTHORS_VOID, AverageJob, AverageReport, Fields};
use super::job::Job;
use super::score::{Score, ScoreJob};
use super::shapes::Source;
use super::{machine, output};
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Compares averages with the authors' research code, on one thread as theirs.
#[derive(Args)]
pub struct Arguments {
    /// Directory of the shapes and the phase fields of the bars, as arrays.
    #[arg(long, value_name = "DIR")]
    inputs: PathBuf,
    /// Output directory for reference.json.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Run only cases whose name contains this.
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

/// Tolerance for the bars: their long run ends below their usual one by a part in 5000.
const BAR_TOLERANCE: f64 = 1e-6;
/// Required ratio of their time to ours for the bars.
const FASTER: f64 = 20.0;

/// Cost and result of their code.
struct Theirs {
    /// User seconds on one thread.
    seconds: Option<f64>,
    /// Values of `J`: of the usual run, and of ten times the steps.
    functional: Option<(f64, f64)>,
    /// Mean and least overlap of pairs.
    dice: Option<(f64, f64)>,
    /// Least determinant.
    min_det: Option<f64>,
}

struct Case {
    name: &'static str,
    shapes: Vec<String>,
    /// Whether their phase fields are among the inputs.
    phase_fields: bool,
    theirs: Theirs,
}

/// Their results, on one thread; times in user seconds.
fn cases() -> Vec<Case> {
    let named = |kind: &str, which: &[&str], nodes: usize| -> Vec<String> {
        let names = which.iter();
        names.map(|w| format!("{kind}_{w}_{nodes}")).collect()
    };
    let bars = |name, nodes, seconds, functional, dice, min_det| Case {
        name,
        shapes: named("bar", &["straight", "bent"], nodes),
        phase_fields: true,
        theirs: Theirs {
            seconds: Some(seconds),
            functional: Some(functional),
            dice: Some((dice, dice)),
            min_det: Some(min_det),
        },
    };
    let other = |name, shapes, seconds, dice: Option<(f64, f64)>, min_det| Case {
        name,
        shapes,
        phase_fields: false,
        theirs: Theirs {
            seconds,
            functional: None,
            dice,
            min_det,
        },
    };
    let device7 = ["01", "02", "03", "05", "07", "09", "12", "14"];
    let hands = ["p1-01", "p1-04", "p1-07", "p2-02", "p2-06"];
    let hippocampi = ["001", "003", "006", "008"];
    let solid = |nodes| named("hippocampus", &hippocampi, nodes);
    vec![
        bars("bars 65²", 65, 3.0, (0.612852, 0.612738), 0.974, 0.784),
        bars("bars 129²", 129, 12.8, (0.809789, 0.809690), 0.990, 0.680),
        other(
            "4 device7 129²",
            named("device7", &device7[..4], 129),
            Some(24.5),
            Some((0.982, 0.979)),
            Some(0.458),
        ),
        other(
            "8 device7 129²",
            named("device7", &device7, 129),
            Some(50.5),
            Some((0.975, 0.960)),
            Some(0.384),
        ),
        other(
            "5 hands 129²",
            named("hand", &hands, 129),
            Some(30.6),
            Some((0.969, 0.933)),
            Some(8e-5),
        ),
        other(
            "4 hippocampi 33³",
            solid(33),
            Some(283.0),
            Some((0.902, 0.882)),
            Some(0.793),
        ),
        // Their run was limited to 48 steps; there is no full run.
        other(
            "4 hippocampi 65³",
            solid(65),
            None,
            Some((0.928, 0.921)),
            Some(0.605),
        ),
    ]
}

/// One run of a case.
#[derive(Serialize)]
struct Run {
    case: &'static str,
    /// `theirs`, or the variant of ours.
    functional: &'static str,
    report: AverageReport,
    their_seconds: Option<f64>,
    /// Their state after the long run, evaluated by our functional, if it is among the inputs.
    their_state: Option<Score>,
    /// Our processor time when `J` was first as low as theirs: of the usual run, of the long, and
    /// of their last state with the best average by our evaluation.
    seconds_to: [Option<f64>; 3],
}

#[derive(Serialize)]
struct Report {
    machine: machine::Machine,
    runs: Vec<Run>,
}

/// Measures and reports.
pub fn run(arguments: &Arguments) -> Outcome<()> {
    if !arguments.inputs.is_dir() {
        let said = format!(
            "there is no folder '{}' (--inputs)",
            arguments.inputs.display()
        );
        return Err(said.into());
    }
    let all = cases();
    let mut runs = Vec::new();
    for case in all.iter().filter(|c| c.name.contains(&arguments.only)) {
        for own in [false, true] {
            eprintln!("{}, {}", case.name, functional(case, own));
            match measure(case, &arguments.inputs, own) {
                Ok(run) => runs.push(run),
                Err(error) => eprintln!("{}: left out: {error}", case.name),
            }
        }
    }
    let report = Report {
        machine: machine::Machine::this(),
        runs,
    };
    println!("{}, 1 thread\n", report.machine);
    println!(
        "## The authors' functional: time to their values\n\n{}",
        bars(&report, &all)
    );
    println!("## All cases\n\n{}", everything(&report, &all));
    if let Some(folder) = &arguments.output {
        output::write_json(folder, "reference.json", &report)?;
    }
    if report.runs.is_empty() {
        return Err("no case could be run".into());
    }
    Ok(())
}

fn functional(case: &Case, own: bool) -> &'static str {
    match (own, case.phase_fields) {
        (true, _) => "ours",
        (false, true) => "theirs",
        (false, false) => "theirs, our v",
    }
}

fn measure(case: &Case, inputs: &Path, own: bool) -> Outcome<Run> {
    let place = |name: &String| inputs.join(format!("{name}.npy"));
    let phase_fields = case.shapes.iter().map(|s| format!("phasefield_{s}"));
    let fields = if own {
        Fields::Own
    } else {
        Fields::Authors {
            phase_fields: phase_fields
                .filter(|_| case.phase_fields)
                .map(|name| place(&name))
                .collect(),
        }
    };
    let params = match (own, case.phase_fields) {
        (true, _) => AverageParams::default(),
        (false, false) => their_params(),
        (false, true) => AverageParams {
            tolerance: BAR_TOLERANCE,
            ..their_params()
        },
    };
    let job = Job::Average(Box::new(AverageJob {
        source: Source::Arrays(case.shapes.iter().map(place).collect()),
        params,
        fields,
        threads: 1,
    }));
    let report: AverageReport = job.in_child()?;
    let values = case.theirs.functional.filter(|_| !own);
    let their_state = if values.is_some() {
        scored(case, inputs)?
    } else {
        None
    };
    let reached = |value: Option<f64>| value.and_then(|v| report.cpu_at(v));
    Ok(Run {
        case: case.name,
        functional: functional(case, own),
        seconds_to: [
            values.map(|v| v.0),
            values.map(|v| v.1),
            their_state.as_ref().map(|s| s.functional_at_best),
        ]
        .map(reached),
        their_seconds: case.theirs.seconds,
        their_state,
        report,
    })
}

/// The parameters of the authors' functional.
fn their_params() -> AverageParams {
    AverageParams {
        mismatch_weight: 1.0,
        length_weight: Some(1e-4),
        interface_cells: 2.0,
        void_stiffness: AUTHORS_VOID,
        ..AverageParams::default()
    }
}

/// Their last state, if it is among the inputs.
fn scored(case: &Case, inputs: &Path) -> Outcome<Option<Score>> {
    let nodes = case.shapes[0].rsplit('_').next().unwrap_or_default();
    let average = inputs.join(format!("ref_average_bars_{nodes}.npy"));
    if !average.is_file() {
        return Ok(None);
    }
    let files = |prefix: &str| -> Vec<PathBuf> {
        let names = case.shapes.iter();
        names
            .map(|s| inputs.join(format!("{prefix}{s}.npy")))
            .collect()
    };
    let job = Job::Score(ScoreJob {
        source: Source::Arrays(files("")),
        params: their_params(),
        phase_fields: files("phasefield_"),
        displacements: files("ref_displacement_"),
        average,
    });
    Ok(Some(job.in_child()?))
}

fn case_of<'a>(run: &Run, all: &'a [Case]) -> Option<&'a Case> {
    all.iter().find(|c| c.name == run.case)
}

/// Whether `J` can be compared.
fn bars(report: &Report, all: &[Case]) -> Table {
    let mut table = Table::new([
        "case",
        "J of theirs",
        "their s",
        "our s to it",
        "ratio",
        "J of their long run",
        "our s to it",
        "their last state scored here, and with the best v",
        "our s to that",
        "our J in the end",
        "sum W",
        "sum F",
        "s in the end",
    ]);
    let seconds =
        |s: Option<f64>| s.map_or_else(|| "not reached **!**".to_owned(), |s| format!("{s:.3}"));
    for run in report.runs.iter().filter(|r| r.functional == "theirs") {
        let Some(theirs) = case_of(run, all).map(|c| &c.theirs) else {
            continue;
        };
        let Some((functional, long)) = theirs.functional else {
            continue;
        };
        let ratio = theirs.seconds.zip(run.seconds_to[0]).map(|(t, o)| t / o);
        let r = &run.report;
        table.row([
            run.case.into(),
            format!("{functional:.6}"),
            theirs.seconds.map_or_else(String::new, |s| format!("{s}")),
            seconds(run.seconds_to[0]),
            ratio.map_or_else(
                || "–".to_owned(),
                |x| checked(format!("{x:.1}"), x >= FASTER),
            ),
            format!("{long:.6}"),
            seconds(run.seconds_to[1]),
            run.their_state.as_ref().map_or_else(
                || "–".to_owned(),
                |s| format!("{:.6}, {:.6}", s.functional, s.functional_at_best),
            ),
            match &run.their_state {
                Some(_) => seconds(run.seconds_to[2]),
                None => "–".into(),
            },
            checked(format!("{:.6}", r.functional), r.functional <= long),
            format!("{:.7}", r.elastic),
            format!("{:.5}", r.mismatch),
            format!("{:.3}", r.cpu),
        ]);
    }
    table
}

fn everything(report: &Report, all: &[Case]) -> Table {
    let mut table = Table::new([
        "case",
        "functional",
        "CPU s",
        "their s",
        "ratio",
        "iterations on the finest",
        "J",
        "sum W",
        "sum F",
        "pair Dice, worst",
        "theirs",
        "least det",
        "theirs",
        "MiB",
    ]);
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    for run in &report.runs {
        let Some(theirs) = case_of(run, all).map(|c| &c.theirs) else {
            continue;
        };
        let r = &run.report;
        let overlap = format!("{:.4}, {:.4}", r.pair_dice, r.worst_pair_dice);
        let better = theirs.dice.is_none_or(|d| r.worst_pair_dice > d.1);
        table.row([
            run.case.into(),
            run.functional.into(),
            format!("{:.3}", r.cpu),
            or_dash(theirs.seconds.map(|s| format!("{s}"))),
            or_dash(theirs.seconds.map(|s| format!("{:.1}", s / r.cpu))),
            r.finest_iterations().to_string(),
            format!("{:.6}", r.functional),
            format!("{:.7}", r.elastic),
            format!("{:.5}", r.mismatch),
            checked(overlap, better),
            or_dash(theirs.dice.map(|(m, w)| format!("{m}, {w}"))),
            checked(format!("{:.4}", r.min_det), r.certified),
            or_dash(theirs.min_det.map(|d| format!("{d}"))),
            format!("{:.0}", r.peak_mebibytes),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cases_name_the_files_of_the_inputs() {
        let all = cases();
        let of = |name: &str| &all.iter().find(|c| c.name == name).unwrap().shapes;
        assert_eq!(of("bars 65²")[..], ["bar_straight_65", "bar_bent_65"]);
        assert_eq!(of("4 device7 129²")[3], "device7_05_129");
        assert_eq!(of("5 hands 129²")[4], "hand_p2-06_129");
        assert_eq!(of("4 hippocampi 33³")[0], "hippocampus_001_33");
        assert!(
            all.iter()
                .all(|c| c.phase_fields == c.theirs.functional.is_some())
        );
    }

    #[test]
    fn inputs_that_are_not_there_are_named() {
        let arguments = Arguments {
            inputs: "nowhere".into(),
            output: None,
            only: String::new(),
        };
        assert!(run(&arguments).unwrap_err().to_string().contains("nowhere"));
    }
}
