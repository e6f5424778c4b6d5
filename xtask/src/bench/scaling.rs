//! `bench scaling`: time, work and memory of averages as functions of the size of the grid and the
//! number of shapes, compared with the gradient descent of the notes.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use shape_average::AverageParams;
use shapespace_report::chart::{Axis, Chart, Scale, Series, stacked};

use super::averages::{AverageJob, AverageReport, Fields};
use super::descents::{DescentJob, DescentReport};
use super::fit::{beyond_linear, exponent, spread};
use super::job::Job;
use super::shapes::Source;
use super::{machine, output};
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Averages of star-shaped blobs against nodes and shapes, to the default tolerance.
#[derive(Args)]
pub struct Arguments {
    /// Output directory for scaling.json and scaling.svg.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Leave out the largest grid of 2D and of 3D.
    #[arg(long)]
    quick: bool,
    /// Number of threads per average.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Number of runs per average; the one with the least processor time counts.
    #[arg(long, default_value_t = 1)]
    runs: usize,
}

/// Shapes of the averages that grow in nodes.
const SHAPES: usize = 8;
const FLAT_NODES: [usize; 4] = [65, 129, 257, 513];
const SOLID_NODES: [usize; 3] = [33, 65, 129];
const NUMBERS: [usize; 4] = [2, 5, 10, 20];
/// Dimension and number of nodes along every axis for growing numbers of shapes.
const NUMBERS_ON: [(usize, usize); 2] = [(2, 129), (3, 33)];
/// Cases in which the gradient descent is also run.
const DESCENTS: [(usize, usize); 3] = [(2, 65), (2, 129), (3, 33)];

/// Largest allowed growth of the time per node or shape.
const LINEAR: f64 = 1.5;

/// An average and its input.
#[derive(Serialize)]
struct Run {
    dimension: usize,
    nodes_a_side: usize,
    report: AverageReport,
    descent: Option<DescentReport>,
}

#[derive(Serialize)]
struct Growth {
    what: String,
    /// Exponent of the processor time.
    exponent: Option<f64>,
    /// Ratio of the largest to the smallest time per node or shape.
    spread: Option<f64>,
    /// Largest growth of the time per node or shape.
    beyond_linear: Option<f64>,
    /// Exponent of the memory.
    memory_exponent: Option<f64>,
}

#[derive(Serialize)]
struct Report {
    machine: machine::Machine,
    threads: usize,
    nodes: Vec<Run>,
    shapes: Vec<Run>,
    growth: Vec<Growth>,
}

/// Measures and reports.
pub fn run(arguments: &Arguments) -> Outcome<()> {
    let mut nodes = Vec::new();
    let flat = FLAT_NODES.map(|n| (2, n));
    let solid = SOLID_NODES.map(|n| (3, n));
    for (dimension, n) in flat.into_iter().chain(solid) {
        let largest = n == FLAT_NODES[3] || dimension == 3 && n == SOLID_NODES[2];
        if !(arguments.quick && largest) {
            nodes.push(measured(dimension, n, SHAPES, arguments)?);
        }
    }
    for run in &mut nodes {
        if DESCENTS.contains(&(run.dimension, run.nodes_a_side)) {
            run.descent = Some(descended(run)?);
        }
    }
    let mut shapes = Vec::new();
    for (dimension, n) in NUMBERS_ON {
        for count in NUMBERS {
            shapes.push(measured(dimension, n, count, arguments)?);
        }
    }
    let report = Report {
        machine: machine::Machine::this(),
        threads: arguments.threads,
        growth: growth(&nodes, &shapes),
        nodes,
        shapes,
    };
    print(&report);
    if let Some(folder) = &arguments.output {
        output::write_json(folder, "scaling.json", &report)?;
        output::write(folder, "scaling.svg", &chart(&report)?)?;
    }
    Ok(())
}

fn source(dimension: usize, nodes: usize, count: usize) -> Source {
    Source::Blobs {
        dimension,
        nodes,
        count,
    }
}

fn measured(dimension: usize, nodes: usize, count: usize, how: &Arguments) -> Outcome<Run> {
    eprintln!("{count} shapes, {nodes} nodes a side, {dimension}D");
    let job = Job::Average(Box::new(AverageJob {
        source: source(dimension, nodes, count),
        params: AverageParams::default(),
        fields: Fields::Own,
        threads: how.threads,
    }));
    let mut report: AverageReport = job.in_child()?;
    for _ in 1..how.runs {
        let again: AverageReport = job.in_child()?;
        if again.average_cpu < report.average_cpu {
            report = again;
        }
    }
    Ok(Run {
        dimension,
        nodes_a_side: nodes,
        report,
        descent: None,
    })
}

fn descended(run: &Run) -> Outcome<DescentReport> {
    eprintln!(
        "descent, {} nodes a side, {}D",
        run.nodes_a_side, run.dimension
    );
    let levels = run.report.levels.iter();
    let job = Job::Descent(DescentJob {
        source: source(run.dimension, run.nodes_a_side, run.report.shapes),
        params: AverageParams::default(),
        levels: levels.map(|l| (l.energy, l.evaluations)).collect(),
    });
    job.in_child()
}

/// Processor time of the average alone.
fn time(run: &Run) -> f64 {
    run.report.average_cpu
}

fn growth(nodes: &[Run], shapes: &[Run]) -> Vec<Growth> {
    let mut all = Vec::new();
    let mut add = |what: String, runs: Vec<&Run>, size: fn(&Run) -> f64| {
        let of = |y: fn(&Run) -> f64| -> Vec<(f64, f64)> {
            runs.iter().map(|r| (size(r), y(r))).collect()
        };
        all.push(Growth {
            what,
            exponent: exponent(&of(time)),
            spread: spread(&of(time)),
            beyond_linear: beyond_linear(&of(time)),
            memory_exponent: exponent(&of(|r| r.report.peak_mebibytes)),
        });
    };
    for dimension in [2, 3] {
        let of = |runs: &'_ [Run]| -> Vec<usize> {
            (0..runs.len())
                .filter(|&i| runs[i].dimension == dimension)
                .collect()
        };
        let picked = of(nodes).into_iter().map(|i| &nodes[i]).collect();
        add(format!("nodes, {dimension}D"), picked, |r| {
            r.report.nodes as f64
        });
        let picked = of(shapes).into_iter().map(|i| &shapes[i]).collect();
        add(format!("shapes, {dimension}D"), picked, |r| {
            r.report.shapes as f64
        });
    }
    all
}

fn print(report: &Report) {
    let mut table = Table::new([
        "grid",
        "shapes",
        "CPU s",
        "wall s",
        "µs a node and shape",
        "evaluations",
        "iterations by level",
        "MiB",
        "mean Dice",
        "least det",
        "volume ratio",
    ]);
    for run in report.nodes.iter().chain(&report.shapes) {
        let r = &run.report;
        let each = 1e6 * time(run) / (r.nodes * r.shapes) as f64;
        let iterations = r.levels.iter().map(|l| l.iterations.to_string());
        table.row([
            grid(run),
            r.shapes.to_string(),
            format!("{:.2}", time(run)),
            format!("{:.2}", r.average_wall),
            format!("{each:.1}"),
            r.evaluations().to_string(),
            iterations.collect::<Vec<_>>().join(", "),
            format!("{:.0}", r.peak_mebibytes),
            format!("{:.4}", r.mean_dice),
            format!(
                "{:.3}{}",
                r.min_det,
                if r.certified { "" } else { " **!**" }
            ),
            format!("{:.3}", r.volume_ratio),
        ]);
    }
    let mut growth = Table::new([
        "time against",
        "exponent",
        "most over least for one",
        "beyond linear (1.5 asked)",
        "exponent of the memory",
    ]);
    let number = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2}"));
    for g in &report.growth {
        let cells = [g.exponent, g.spread, g.memory_exponent].map(number);
        let [exponent, spread, memory] = cells;
        let fine = g.beyond_linear.is_none_or(|x| x <= LINEAR);
        let beyond = checked(number(g.beyond_linear), fine);
        growth.row([g.what.clone(), exponent, spread, beyond, memory]);
    }
    let mut descents = Table::new([
        "grid",
        "CPU s",
        "of the descent",
        "ratio",
        "evaluations",
        "of the descent",
        "levels reached",
        "above on the finest after 1, 10, 30, 60 times",
    ]);
    for run in &report.nodes {
        let Some(d) = &run.descent else { continue };
        let r = &run.report;
        let reached = d.levels.iter().filter(|l| l.reached).count();
        let all = reached == d.levels.len();
        let above = d.levels.last().map_or_else(Vec::new, |l| {
            l.above
                .iter()
                .map(|x| format!("{:.2}", 100.0 * x))
                .collect()
        });
        let evaluations: usize = d.levels.iter().map(|l| l.evaluations).sum();
        descents.row([
            grid(run),
            format!("{:.2}", r.cpu),
            format!("{:.2}", d.cpu),
            format!("{}{:.1}", if all { "" } else { "> " }, d.cpu / r.cpu),
            r.evaluations().to_string(),
            evaluations.to_string(),
            format!("{reached} of {}", d.levels.len()),
            format!("{} %", above.join(", ")),
        ]);
    }
    println!(
        "{}, {} threads an average\n",
        report.machine, report.threads
    );
    println!("## Averages to the default tolerance\n\n{table}");
    println!("## Growth\n\n{growth}");
    println!("## The notes' descent to the same energies\n\n{descents}");
}

fn grid(run: &Run) -> String {
    let power = if run.dimension == 2 { "²" } else { "³" };
    format!("{}{power}", run.nodes_a_side)
}

/// A name and points of a line.
type Line = (String, Vec<(f64, f64)>);

fn series(lines: impl IntoIterator<Item = Line>) -> Vec<Series> {
    let lines = lines.into_iter().enumerate();
    lines
        .map(|(k, (label, points))| Series::new(label, k, points))
        .collect()
}

fn number(x: f64) -> String {
    if (1e-2..1e4).contains(&x) {
        let digits = if x < 1.0 { 2 } else { 0 };
        format!("{x:.digits$}")
    } else {
        format!("{x:.0e}")
    }
}

fn chart(report: &Report) -> Outcome<String> {
    let line = |label: String, runs: &[Run], dimension: usize, x: fn(&Run) -> f64| -> Line {
        let runs = runs.iter().filter(|r| r.dimension == dimension);
        (label, runs.map(|r| (x(r), time(r))).collect())
    };
    let nodes = |d| {
        line(format!("{SHAPES} shapes, {d}D"), &report.nodes, d, |r| {
            r.report.nodes as f64
        })
    };
    let shapes = |(d, n): (usize, usize)| {
        line(format!("{n} nodes a side, {d}D"), &report.shapes, d, |r| {
            r.report.shapes as f64
        })
    };
    let axis = |title| Axis {
        title,
        scale: Scale::Logarithmic,
        number,
    };
    let chart = |title, across, up, series| Chart {
        title,
        across: axis(across),
        up: axis(up),
        series,
    };
    let nodes = series([2, 3].map(nodes));
    let shapes = series(NUMBERS_ON.map(shapes));
    let curves = series(report.nodes.iter().flat_map(curves));
    let charts = [
        chart(
            "Time to the default tolerance against nodes",
            "nodes",
            "CPU s",
            &nodes,
        ),
        chart(
            "Time to the default tolerance against shapes",
            "shapes",
            "CPU s",
            &shapes,
        ),
        chart(
            "Energy on the finest level above the lowest found, over time",
            "CPU s",
            "share of the lowest",
            &curves,
        ),
    ];
    Ok(stacked((900, 430 * charts.len() as u32), &charts)?)
}

/// Convergence of both solvers on the finest level, if the gradient descent was run.
fn curves(run: &Run) -> Vec<Line> {
    let Some(descent) = &run.descent else {
        return Vec::new();
    };
    let finest = run.report.levels.len().saturating_sub(1);
    let on_finest = |curve: &[super::averages::CurvePoint]| -> Vec<(f64, f64)> {
        let points = curve.iter().filter(|p| p.level == finest);
        points.map(|p| (p.cpu, p.energy)).collect()
    };
    let (fast, slow) = (on_finest(&run.report.curve), on_finest(&descent.curve));
    let all = fast.iter().chain(&slow).map(|p| p.1);
    let lowest = all.fold(f64::INFINITY, f64::min);
    let above = |points: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        let share = points.into_iter().map(|(t, e)| (t, e / lowest - 1.0));
        share.filter(|p| p.1 > 1e-12).collect()
    };
    vec![
        (format!("L-BFGS, {}", grid(run)), above(fast)),
        (format!("descent, {}", grid(run)), above(slow)),
    ]
}
