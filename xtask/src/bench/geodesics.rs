//! `bench geodesics`: the paths of the authors' own research code, with their functional and ours.
//!
//! Their functional has no factors of time: `sum_k W_k + gamma sum_k match_k + mu sum_k area_k`. It
//! is ours over `K` for `eta = K gamma` and an area weight of `K^2 mu`, less the area of the end
//! shape, which theirs does not count and no path can change. Theirs is discretised with linear
//! triangles and one point each, ours with bilinear cells and Gauss points: totals agree only up to
//! the discretisation error.

use std::path::{Path, PathBuf};

use clap::Args;
use geodesic::{Form, GeodesicParams};
use serde::Serialize;

use super::job::Job;
use super::paths::{PathJob, PathReport};
use super::shapes::Source;
use super::{machine, output};
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Compares geodesics with the authors' research code, on one thread as theirs.
#[derive(Args)]
pub struct Arguments {
    /// Directory of the shapes, as arrays.
    #[arg(long, value_name = "DIR")]
    inputs: PathBuf,
    /// Output directory for geodesics.json.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Run only cases whose name contains this.
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

/// Required ratio of their time to ours for the bars. Their letters do not reach the end shape: the
/// time to their value is not meaningful there, and there is no requirement.
const FASTER: f64 = 10.0;
/// Weight of the area in their functional.
const THEIR_AREA_WEIGHT: f64 = 1e-3;
/// Overlap that the end of a path should reach.
const LEAST_DICE: f64 = 0.98;

/// Results of their code, on one thread.
struct Case {
    name: &'static str,
    shapes: [&'static str; 2],
    nodes: usize,
    steps: usize,
    /// User seconds.
    seconds: f64,
    /// Their functional at the end.
    total: f64,
    /// Overlap of the pulled-back end shape with the start shape.
    dice: f64,
    /// Smallest determinant of a triangle.
    min_det: f64,
}

const BARS: [&str; 2] = ["bar_straight", "bar_bent"];
const LETTERS: [&str; 2] = ["glyph_M", "glyph_O"];

const CASES: [Case; 8] = [
    case(
        "bars 65², K = 4",
        BARS,
        (65, 4),
        (8.0, 0.00455),
        0.9945,
        0.57,
    ),
    case(
        "bars 65², K = 8",
        BARS,
        (65, 8),
        (16.3, 0.009365),
        0.9927,
        0.653,
    ),
    case(
        "bars 129², K = 4",
        BARS,
        (129, 4),
        (32.9, 0.004702),
        0.9996,
        0.467,
    ),
    case(
        "bars 129², K = 8",
        BARS,
        (129, 8),
        (64.1, 0.009703),
        0.9991,
        0.480,
    ),
    case(
        "M to O 65², K = 4",
        LETTERS,
        (65, 4),
        (8.7, 0.05355),
        0.894,
        -0.07,
    ),
    case(
        "M to O 65², K = 8",
        LETTERS,
        (65, 8),
        (17.1, 0.04533),
        0.893,
        0.027,
    ),
    case(
        "M to O 129², K = 4",
        LETTERS,
        (129, 4),
        (37.8, 0.05476),
        0.909,
        -0.10,
    ),
    case(
        "M to O 129², K = 8",
        LETTERS,
        (129, 8),
        (70.2, 0.05041),
        0.915,
        0.015,
    ),
];

const fn case(
    name: &'static str,
    shapes: [&'static str; 2],
    (nodes, steps): (usize, usize),
    (seconds, total): (f64, f64),
    dice: f64,
    min_det: f64,
) -> Case {
    Case {
        name,
        shapes,
        nodes,
        steps,
        seconds,
        total,
        dice,
        min_det,
    }
}

impl Case {
    /// The parameters of their functional: `gamma` is 10, `mu` [`THEIR_AREA_WEIGHT`], the void's
    /// weight 1e-2 and jumps from node to node.
    fn their_params(&self) -> GeodesicParams {
        GeodesicParams {
            form: Form::LevelSets,
            steps: self.steps,
            mismatch_weight: 10.0,
            area_weight: (self.steps * self.steps) as f64 * THEIR_AREA_WEIGHT,
            void_stiffness: 1e-2,
            indicator_cells: 0.5,
            tolerance: 1e-4,
            ..GeodesicParams::default()
        }
    }

    fn our_params(&self) -> GeodesicParams {
        GeodesicParams {
            form: Form::LevelSets,
            steps: self.steps,
            tolerance: 1e-4,
            ..GeodesicParams::default()
        }
    }

    fn files(&self, inputs: &Path) -> Vec<PathBuf> {
        let name = |shape| inputs.join(format!("{shape}_{}.npy", self.nodes));
        self.shapes.iter().map(name).collect()
    }
}

/// One run of a case.
#[derive(Serialize)]
struct Run {
    case: &'static str,
    /// `theirs` or `ours`.
    functional: &'static str,
    /// Final value of their functional.
    their_total: Option<f64>,
    /// Our processor time when their functional was first as low as theirs.
    seconds_to_theirs: Option<f64>,
    report: PathReport,
}

#[derive(Serialize)]
struct Report {
    machine: machine::Machine,
    runs: Vec<Run>,
}

/// Measures and reports.
pub fn run(arguments: &Arguments) -> Outcome<()> {
    let mut runs = Vec::new();
    for case in CASES.iter().filter(|c| c.name.contains(&arguments.only)) {
        for functional in ["theirs", "ours"] {
            eprintln!("{}, {functional}", case.name);
            runs.push(measure(case, &arguments.inputs, functional)?);
        }
    }
    if runs.is_empty() {
        return Err(format!("no case has '{}' in its name", arguments.only).into());
    }
    let report = Report {
        machine: machine::Machine::this(),
        runs,
    };
    println!("{}, 1 thread\n\n{}", report.machine, table(&report));
    if let Some(folder) = &arguments.output {
        output::write_json(folder, "geodesics.json", &report)?;
    }
    Ok(())
}

fn measure(case: &Case, inputs: &Path, functional: &'static str) -> Outcome<Run> {
    let theirs = functional == "theirs";
    let job = Job::Path(Box::new(PathJob {
        source: Source::Arrays(case.files(inputs)),
        params: if theirs {
            case.their_params()
        } else {
            case.our_params()
        },
        threads: 1,
    }));
    let report: PathReport = job.in_child()?;
    let scale = case.steps as f64;
    let fixed = THEIR_AREA_WEIGHT * report.end_area.unwrap_or(0.0);
    let aim = scale * (case.total + fixed);
    Ok(Run {
        case: case.name,
        functional,
        their_total: theirs.then_some(report.total / scale - fixed),
        seconds_to_theirs: report.cpu_at(aim).filter(|_| theirs),
        report,
    })
}

fn table(report: &Report) -> Table {
    let mut table = Table::new([
        "case",
        "functional",
        "their total",
        "their s",
        "our s to it",
        "ratio",
        "our total",
        "s in the end",
        "sum W",
        "mismatches",
        "L",
        "Dice carried, pulled",
        "theirs",
        "least det",
        "theirs",
        "MiB",
    ]);
    for run in &report.runs {
        let Some(case) = CASES.iter().find(|c| c.name == run.case) else {
            continue;
        };
        let r = &run.report;
        let theirs = run.functional == "theirs";
        let only = |text: String| if theirs { text } else { "–".into() };
        let ratio = run.seconds_to_theirs.map(|s| case.seconds / s);
        let missed = || "not reached **!**".to_owned();
        table.row([
            run.case.into(),
            run.functional.into(),
            only(format!("{:.6}", case.total)),
            only(format!("{}", case.seconds)),
            only(
                run.seconds_to_theirs
                    .map_or_else(missed, |s| format!("{s:.2}")),
            ),
            only(ratio.map_or_else(missed, |x| {
                let asked = case.shapes == BARS;
                checked(format!("{x:.1}"), !asked || x >= FASTER)
            })),
            run.their_total.map_or_else(
                || "–".into(),
                |total| checked(format!("{total:.6}"), total <= case.total),
            ),
            format!("{:.2}", r.cpu),
            format!("{:.3e}", r.elastic),
            format!("{:.2e}", r.mismatch),
            format!("{:.4}", r.length),
            checked(
                format!("{:.4}, {:.4}", r.dice.0, r.dice.1),
                if theirs {
                    r.dice.1 >= case.dice
                } else {
                    r.dice.0.max(r.dice.1) >= LEAST_DICE
                },
            ),
            format!("{}", case.dice),
            checked(format!("{:.4}", r.min_det), r.certified),
            format!("{}", case.min_det),
            format!("{:.0}", r.peak_mebibytes),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_are_theirs_after_division_by_the_number_of_steps() {
        for case in &CASES {
            let params = case.their_params();
            assert!(params.check().is_ok());
            let steps = case.steps as f64;
            // gamma = eta / K and mu = area_weight / K^2, up to rounding.
            assert!((params.resolved_mismatch_weight() / steps - 10.0).abs() < 1e-12);
            assert!((params.area_weight / steps.powi(2) - 1e-3).abs() < 1e-15);
        }
    }

    #[test]
    fn a_name_that_no_case_has_is_named() {
        let arguments = Arguments {
            inputs: "nowhere".into(),
            output: None,
            only: "whale".into(),
        };
        assert!(run(&arguments).unwrap_err().to_string().contains("whale"));
    }
}
