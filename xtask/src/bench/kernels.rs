//! `bench kernels`: rates of the kernels relative to the limits of the machine and to the anchor.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use rayon::ThreadPool;
use serde::Serialize;
use shapespace_report::chart::{Bars, bars};

use super::anchor::{Anchor, Figure};
use super::case::{Case, Kernel, Real, Work};
use super::flops::Verb;
use super::limits::Limits;
use super::measure::{Repetitions, Seconds, least_seconds, pool};
use super::{machine, output};
use crate::outcome::Outcome;
use crate::table::Table;

/// Measures rates of the kernels relative to the limits of the machine.
#[derive(Args)]
pub struct Arguments {
    /// Source of a hand-written kernel in C, compiled and run in turn with the kernels for
    /// comparison.
    #[arg(long, value_name = "FILE.c")]
    anchor: Option<PathBuf>,
    /// Output directory for kernels.json and kernels.svg.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Number of rounds; the best of all rounds counts.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Run only kernels whose name contains this.
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Leave out the largest grids.
    #[arg(long)]
    quick: bool,
}

const REPETITIONS: Repetitions = Repetitions {
    least: 3,
    most: 200,
    seconds: 0.3,
};

/// The kernels that are measured.
fn cases() -> Vec<Case> {
    let case = |work, dimension, real, nodes| Case {
        work,
        dimension,
        real,
        nodes,
    };
    let mut cases = Vec::new();
    let verbs = [Verb::Value, Verb::Gradient, Verb::Hessian];
    for (dimension, nodes) in [(3, 65), (3, 129), (2, 257)] {
        for real in [Real::F64, Real::F32] {
            for verb in verbs {
                cases.push(case(Work::Elastic(verb), dimension, real, nodes));
            }
            cases.push(case(Work::Anchor(Verb::Gradient), dimension, real, nodes));
            cases.push(case(Work::MassStiffness, dimension, real, nodes));
        }
        for work in Work::IN_DOUBLE {
            cases.push(case(work, dimension, Real::F64, nodes));
        }
    }
    cases
}

/// A kernel on a number of threads, measured.
#[derive(Clone, Debug, Serialize)]
struct Row {
    kernel: String,
    real: &'static str,
    threads: usize,
    seconds: Seconds,
    unit: &'static str,
    /// Units per second.
    rate: f64,
    /// Floating-point operations per unit.
    flops_per_unit: Option<f64>,
    /// Fraction of the peak rate of fused multiply-adds.
    of_fma_peak: Option<f64>,
    /// Fraction of the bandwidth of the triad of this size, with each field moved once.
    of_bandwidth: f64,
    /// Ratio of the rate to that on one thread.
    speed_up: Option<f64>,
    /// Ratio of the rate to that of the anchor, with the anchor's kernel.
    of_anchor: Option<f64>,
}

/// Everything that was measured.
#[derive(Serialize)]
struct Report {
    machine: machine::Machine,
    anchor: Option<String>,
    limits: Vec<Limits>,
    anchor_figures: Vec<(String, usize, String, usize, f64)>,
    rows: Vec<Row>,
}

/// Minimal times of every case on every pool over all rounds.
struct Times {
    case: Case,
    /// Of the kernel, its data left behind.
    shape: Option<Kernel>,
    seconds: Vec<Seconds>,
}

/// Measures and reports.
pub fn run(arguments: &Arguments) -> Outcome<()> {
    let anchor = arguments.anchor.as_deref().map(Anchor::compile);
    let anchor = anchor.transpose()?;
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let pools: Outcome<Vec<ThreadPool>> = (1..=most.min(2)).map(pool).collect();
    let pools = pools?;
    let mut limits: Vec<Limits> = Vec::new();
    let mut figures: Vec<Figure> = Vec::new();
    let mut times: Vec<Times> = cases()
        .into_iter()
        .filter(|case| !(arguments.quick && case.dimension == 3 && case.nodes > 65))
        .filter(|case| case.to_string().contains(&arguments.only))
        .map(|case| Times {
            case,
            shape: None,
            seconds: vec![Seconds::NEVER; pools.len()],
        })
        .collect();
    for round in 1..=arguments.rounds.max(1) {
        eprintln!("round {round} of {}", arguments.rounds.max(1));
        limits = best_limits(limits, measured_limits(&pools));
        for t in &mut times {
            // One kernel is in memory at a time; the anchor runs directly before or after the
            // kernels that are compared with it.
            let kernel = t.measure(&pools)?;
            t.shape = Some(kernel);
        }
        if let Some(anchor) = &anchor {
            for real in [Real::F64, Real::F32] {
                for threads in 1..=pools.len() {
                    figures.extend(anchor.run(real.name(), threads)?);
                }
            }
        }
    }
    let rows = rows(&times, &limits, &figures);
    print(&rows, &limits, anchor.as_ref(), &figures)?;
    if let Some(folder) = &arguments.output {
        let report = Report {
            machine: machine::Machine::this(),
            anchor: anchor.map(|a| a.command),
            limits,
            anchor_figures: anchor_summary(&figures),
            rows,
        };
        output::write_json(folder, "kernels.json", &report)?;
        output::write(folder, "kernels.svg", &chart(&report.rows)?)?;
    }
    Ok(())
}

fn measured_limits(pools: &[ThreadPool]) -> Vec<Limits> {
    let of = |pool: &ThreadPool| {
        [
            Limits::measured::<f64>(pool, "f64"),
            Limits::measured::<f32>(pool, "f32"),
        ]
    };
    pools.iter().flat_map(of).collect()
}

fn best_limits(before: Vec<Limits>, now: Vec<Limits>) -> Vec<Limits> {
    if before.is_empty() {
        return now;
    }
    let pairs = before.into_iter().zip(&now);
    pairs.map(|(before, now)| before.highest(now)).collect()
}

impl Times {
    /// Runs one round; the kernel is returned without its data.
    fn measure(&mut self, pools: &[ThreadPool]) -> Outcome<Kernel> {
        let mut kernel = self.case.prepare()?;
        for (pool, best) in pools.iter().zip(&mut self.seconds) {
            *best = best.least(least_seconds(pool, REPETITIONS, &mut *kernel.run));
        }
        kernel.run = Box::new(|| ());
        Ok(kernel)
    }
}

/// The anchor's best rate for a case, in units a second.
fn anchor_rate(case: Case, threads: usize, figures: &[Figure]) -> Option<f64> {
    let (kernel, points) = match case.work {
        Work::Elastic(Verb::Gradient) | Work::Anchor(Verb::Gradient) => ("hyper_EG", true),
        Work::MassStiffness => ("laplace27", false),
        _ => return None,
    };
    let real = match case.real {
        Real::F64 => "double",
        Real::F32 => "float",
    };
    let same = figures.iter().filter(|f| {
        f.kernel == kernel
            && case.dimension == 3
            && f.real == real
            && f.n == case.nodes
            && f.threads == threads
    });
    let rates = same.filter_map(|f| if points { f.points } else { f.dofs });
    rates.map(|r| 1e6 * r).max_by(f64::total_cmp)
}

fn rows(times: &[Times], limits: &[Limits], figures: &[Figure]) -> Vec<Row> {
    let mut rows = Vec::new();
    for t in times {
        let Some(kernel) = &t.shape else { continue };
        let single = t.seconds[0].cpu;
        for (i, seconds) in t.seconds.iter().enumerate() {
            let threads = i + 1;
            let limit = limits
                .iter()
                .find(|l| l.real == t.case.real.name() && l.threads == threads);
            let rate = kernel.units / seconds.cpu;
            let peak = |l: &Limits| Some(kernel.flops? / seconds.cpu / l.flops_per_second);
            let moved = |l: &Limits| kernel.bytes / seconds.cpu / l.bandwidth(kernel.bytes);
            rows.push(Row {
                kernel: t.case.to_string(),
                real: t.case.real.name(),
                threads,
                seconds: *seconds,
                unit: kernel.unit,
                rate,
                flops_per_unit: kernel.flops.map(|f| f / kernel.units),
                of_fma_peak: limit.and_then(peak),
                of_bandwidth: limit.map_or(f64::NAN, moved),
                speed_up: (i > 0).then_some(single / seconds.cpu),
                of_anchor: anchor_rate(t.case, threads, figures).map(|a| rate / a),
            });
        }
    }
    rows
}

fn anchor_summary(figures: &[Figure]) -> Vec<(String, usize, String, usize, f64)> {
    let mut best: Vec<(String, usize, String, usize, f64)> = Vec::new();
    for f in figures {
        let milliards = || Some(1e3 * f.flops.or(f.bytes)?);
        let Some(rate) = f.points.or(f.dofs).or_else(milliards) else {
            continue;
        };
        let n = f.mebibytes.map_or(f.n, |size| size.round() as usize);
        let same = best
            .iter_mut()
            .find(|b| b.0 == f.kernel && b.1 == n && b.2 == f.real && b.3 == f.threads);
        match same {
            Some(b) => b.4 = b.4.max(rate),
            None => best.push((f.kernel.clone(), n, f.real.clone(), f.threads, rate)),
        }
    }
    best
}

fn print(
    rows: &[Row],
    limits: &[Limits],
    anchor: Option<&Anchor>,
    figures: &[Figure],
) -> Outcome<()> {
    let mut text = format!("## Limits\n\n{}\n\n", machine::Machine::this());
    let mut table = Table::new([
        "real",
        "threads",
        "FMA, GFLOP/s",
        "triad .5 MiB, GB/s",
        "triad 5 MiB",
        "triad 50 MiB",
        "triad 768 MiB",
    ]);
    for l in limits {
        let triad = |i: usize| format!("{:.1}", l.triads[i].bytes_per_second / 1e9);
        table.row([
            l.real.clone(),
            l.threads.to_string(),
            format!("{:.1}", l.flops_per_second / 1e9),
            triad(0),
            triad(1),
            triad(2),
            triad(3),
        ]);
    }
    writeln!(text, "{table}")?;
    if let Some(anchor) = anchor {
        writeln!(text, "## Anchor\n\n`{}`\n", anchor.command)?;
        let mut table = Table::new([
            "kernel",
            "n, MiB",
            "real",
            "threads",
            "M points, DoF, FLOP or bytes/s",
        ]);
        for (kernel, n, real, threads, rate) in anchor_summary(figures) {
            let cells = [n.to_string(), real, threads.to_string()];
            let [n, real, threads] = cells;
            table.row([kernel, n, real, threads, format!("{rate:.0}")]);
        }
        writeln!(text, "{table}")?;
    }
    let mut table = Table::new([
        "kernel",
        "threads",
        "ms",
        "wall ms",
        "rate, M/s",
        "FLOP",
        "of FMA peak",
        "of bandwidth",
        "over 1 thread",
        "of anchor",
    ]);
    let share = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2}"));
    for row in rows {
        table.row([
            row.kernel.clone(),
            row.threads.to_string(),
            format!("{:.3}", 1e3 * row.seconds.cpu),
            format!("{:.3}", 1e3 * row.seconds.wall),
            format!("{:.1} {}", row.rate / 1e6, row.unit),
            row.flops_per_unit
                .map_or_else(|| "–".to_owned(), |f| format!("{f:.0}")),
            share(row.of_fma_peak),
            share(Some(row.of_bandwidth)),
            share(row.speed_up),
            share(row.of_anchor),
        ]);
    }
    println!("{text}## Kernels\n\n{table}");
    Ok(())
}

/// Rates of all kernels on one thread and on two.
fn chart(rows: &[Row]) -> Outcome<String> {
    let kernels = rows.chunk_by(|a, b| a.kernel == b.kernel);
    let bar = |rows: &[Row]| Bars {
        label: rows[0].kernel.clone(),
        values: rows.iter().map(|r| Some(r.rate / 1e6)).collect(),
        notes: rows.iter().map(note).collect(),
    };
    let rows: Vec<Bars> = kernels.map(bar).collect();
    let title = "Millions of points or DoF a second; shares of the FMA peak and of the bandwidth";
    Ok(bars(title, &["1 thread", "2 threads"], &rows)?)
}

fn note(row: &Row) -> String {
    let peak = row
        .of_fma_peak
        .map_or_else(String::new, |p| format!("{:.0} % FMA, ", 100.0 * p));
    let moved = 100.0 * row.of_bandwidth;
    let rate = row.rate / 1e6;
    format!("{rate:.1} ({peak}{moved:.0} % bandwidth)")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(kernel: &str, n: usize, threads: usize, points: f64) -> Figure {
        Figure {
            kernel: kernel.into(),
            real: "double".into(),
            threads,
            n,
            points: Some(points),
            dofs: Some(1.0),
            flops: None,
            bytes: None,
            mebibytes: None,
        }
    }

    #[test]
    fn the_best_figure_of_the_same_kernel_is_what_a_kernel_is_held_against() {
        let figures = [
            figure("hyper_EG", 65, 1, 180.0),
            figure("hyper_EG", 65, 1, 200.0),
            figure("hyper_EG", 65, 2, 390.0),
            figure("hyper_EG", 129, 1, 999.0),
            figure("laplace27", 65, 1, 999.0),
        ];
        let case: Case = "anchor_gradient/3d/f64/65".parse().unwrap();
        assert_eq!(anchor_rate(case, 1, &figures), Some(200e6));
        assert_eq!(anchor_rate(case, 2, &figures), Some(390e6));
        let other: Case = "anchor_gradient/2d/f64/65".parse().unwrap();
        assert_eq!(anchor_rate(other, 1, &figures), None);
        let scalar: Case = "mass_stiffness/3d/f64/65".parse().unwrap();
        assert_eq!(anchor_rate(scalar, 1, &figures), Some(1e6));
        assert_eq!(anchor_summary(&figures).len(), 4);
    }

    #[test]
    fn all_cases_have_names_of_their_own() {
        let mut names: Vec<String> = cases().iter().map(Case::to_string).collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
