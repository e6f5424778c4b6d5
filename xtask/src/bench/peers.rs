//! `bench peers`: comparison of averages with other programs, in turn, on the same shapes.
//!
//! The other programs are run by the scripts of a folder (`bench_reg.py PEER CASE`), which print a
//! line of JSON. For them only the call is timed; for our program the whole process.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use serde::{Deserialize, Serialize};
use shape_average::AverageParams;
use shapespace_report::chart::{Bars, bars};

use super::averages::{AverageJob, AverageReport, Fields};
use super::fit::median;
use super::job::Job;
use super::shapes::Source;
use super::{machine, output};
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Compares averages and registrations of pairs with SyN templates (ANTs) and log-demons
/// (SimpleITK).
#[derive(Args)]
pub struct Arguments {
    /// Directory of the shapes that gen_shapes.py wrote.
    #[arg(long, value_name = "DIR")]
    shapes: PathBuf,
    /// Directory of the scripts: bench_reg.py and the modules that it imports.
    #[arg(long, value_name = "DIR")]
    peers: PathBuf,
    /// Python interpreter with numpy, scipy, antspyx and SimpleITK.
    #[arg(long, default_value = "python3")]
    python: PathBuf,
    /// Output directory for peers.json and peers.svg.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Number of runs per program, in turn; the median counts.
    #[arg(long, default_value_t = 1)]
    runs: usize,
    /// Number of threads per program.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Run only cases whose name contains this.
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

/// Requirements of a case.
struct Case {
    name: &'static str,
    /// Names of the files without extension.
    shapes: Vec<String>,
    /// The programs, and the required ratio of their time to ours.
    peers: &'static [(&'static str, f64)],
    /// Required mean Dice overlap.
    dice: f64,
    /// Largest allowed deviation of the volume of the average from the mean volume of the shapes.
    volume: f64,
}

const TEMPLATES: &[(&str, f64)] = &[("ants", 20.0), ("demons", 10.0)];
const PAIRS: &[(&str, f64)] = &[("ants", 1.0)];

/// The cases; the names are those of the scripts.
fn cases() -> Vec<Case> {
    let blobs =
        |d: usize, count: usize, n: usize| (0..count).map(|i| format!("blob{d}_{i}_{n}")).collect();
    let template = |name, shapes, dice| Case {
        name,
        shapes,
        peers: TEMPLATES,
        dice,
        volume: 0.02,
    };
    // Pairs have a requirement on time only.
    let pair = |name, shapes: [&str; 2]| Case {
        name,
        shapes: shapes.map(String::from).into(),
        peers: PAIRS,
        dice: 0.0,
        volume: f64::INFINITY,
    };
    vec![
        pair("pair2-blob-129", ["blob2_5_129", "blob2_6_129"]),
        pair("pair2-bar-129", ["bar2_straight_129", "bar2_folded_129"]),
        pair("pair2-blob-257", ["blob2_5_257", "blob2_6_257"]),
        pair("pair2-bar-257", ["bar2_straight_257", "bar2_folded_257"]),
        template("avg2-blob-129", blobs(2, 8, 129), 0.995),
        template("avg2-blob-257", blobs(2, 8, 257), 0.995),
        template("avg3-blob-65", blobs(3, 5, 65), 0.99),
    ]
}

/// Output of a script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct PeerRun {
    /// Processor seconds of the call.
    cpu: f64,
    wall: f64,
    dice: f64,
    minjac: f64,
    /// Fraction of the box that the template fills, and the mean fraction of the shapes.
    volume: Option<f64>,
    mean_volume: Option<f64>,
    /// Peak memory of the process, in MiB.
    rss: f64,
}

/// All runs of a case.
#[derive(Serialize)]
struct Measured {
    case: &'static str,
    ours: Vec<AverageReport>,
    peers: BTreeMap<&'static str, Vec<PeerRun>>,
    /// Programs that failed, with their messages.
    missing: BTreeMap<&'static str, String>,
}

#[derive(Serialize)]
struct Report {
    machine: machine::Machine,
    threads: usize,
    cases: Vec<Measured>,
}

/// Measures and reports.
pub fn run(arguments: &Arguments) -> Outcome<()> {
    let script = arguments.peers.join("bench_reg.py");
    if !script.is_file() {
        return Err(format!("there is no '{}' (--peers)", script.display()).into());
    }
    let mut report = Report {
        machine: machine::Machine::this(),
        threads: arguments.threads,
        cases: Vec::new(),
    };
    let chosen = cases();
    for case in chosen.iter().filter(|c| c.name.contains(&arguments.only)) {
        match measure(case, arguments, &script) {
            Ok(case) => report.cases.push(case),
            Err(error) => eprintln!("{}: left out: {error}", case.name),
        }
        // A case takes minutes: results are written after each, in case the next fails.
        if let Some(folder) = &arguments.output {
            output::write_json(folder, "peers.json", &report)?;
        }
    }
    println!(
        "{}, {} threads a program\n\n{}",
        report.machine,
        report.threads,
        table(&report)
    );
    if let Some(folder) = &arguments.output {
        output::write(folder, "peers.svg", &chart(&report)?)?;
    }
    if report.cases.is_empty() {
        return Err("no case could be run".into());
    }
    Ok(())
}

fn measure(case: &Case, arguments: &Arguments, script: &Path) -> Outcome<Measured> {
    let files = case.shapes.iter();
    let files = files.map(|name| arguments.shapes.join(format!("{name}.npy")));
    let job = Job::Average(Box::new(AverageJob {
        source: Source::Arrays(files.collect()),
        params: AverageParams::default(),
        fields: Fields::Own,
        threads: arguments.threads,
    }));
    let mut measured = Measured {
        case: case.name,
        ours: Vec::new(),
        peers: BTreeMap::new(),
        missing: BTreeMap::new(),
    };
    for run in 1..=arguments.runs.max(1) {
        eprintln!("{}, run {run}", case.name);
        measured.ours.push(job.in_child()?);
        for &(peer, _) in case.peers {
            if measured.missing.contains_key(peer) {
                continue;
            }
            match peer_run(arguments, script, peer, case.name) {
                Ok(run) => measured.peers.entry(peer).or_default().push(run),
                Err(error) => {
                    eprintln!("{}: {peer} is left out: {error}", case.name);
                    measured.missing.insert(peer, error.to_string());
                }
            }
        }
    }
    Ok(measured)
}

fn peer_run(arguments: &Arguments, script: &Path, peer: &str, case: &str) -> Outcome<PeerRun> {
    let shapes = std::path::absolute(&arguments.shapes)?;
    let output = Command::new(&arguments.python)
        .arg(script)
        .args([peer, case])
        .env("PEERS_DATA", shapes)
        .env("PEERS_THREADS", arguments.threads.to_string())
        .output()
        .map_err(|e| format!("'{}' cannot be started: {e}", arguments.python.display()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().rfind(|l| !l.trim().is_empty());
        return Err(last.unwrap_or("it ended without a word").to_owned().into());
    }
    last_line(&String::from_utf8_lossy(&output.stdout))
}

fn last_line(said: &str) -> Outcome<PeerRun> {
    let line = said.lines().rfind(|l| l.starts_with('{'));
    Ok(serde_json::from_str(line.ok_or("no line of figures")?)?)
}

fn table(report: &Report) -> Table {
    let mut table = Table::new([
        "case",
        "program",
        "CPU s",
        "wall s",
        "CPU over ours",
        "asked",
        "mean Dice",
        "least det",
        "volume over the mean",
        "MiB",
    ]);
    let all = cases();
    for measured in &report.cases {
        let Some(case) = all.iter().find(|c| c.name == measured.case) else {
            continue;
        };
        let Some(first) = measured.ours.first() else {
            continue;
        };
        let ours = our_cpu(measured);
        let walls: Vec<f64> = measured.ours.iter().map(|r| r.wall).collect();
        table.row([
            measured.case.into(),
            "Shapespace".into(),
            format!("{ours:.2}"),
            format!("{:.2}", median(&walls)),
            "1".into(),
            String::new(),
            checked(
                format!("{:.4}", first.mean_dice),
                first.mean_dice >= case.dice,
            ),
            checked(format!("{:.3}", first.min_det), first.certified),
            checked(
                format!("{:.4}", first.volume_ratio),
                (first.volume_ratio - 1.0).abs() <= case.volume,
            ),
            format!("{:.0}", first.peak_mebibytes),
        ]);
        for &(peer, asked) in case.peers {
            let runs = measured.peers.get(peer);
            let Some(last) = runs.and_then(|runs| runs.last()) else {
                continue;
            };
            let of = |f: fn(&PeerRun) -> f64| {
                median(&runs.into_iter().flatten().map(f).collect::<Vec<_>>())
            };
            let ratio = of(|r| r.cpu) / ours;
            let volume = last.volume.zip(last.mean_volume);
            table.row([
                measured.case.into(),
                peer.into(),
                format!("{:.2}", of(|r| r.cpu)),
                format!("{:.2}", of(|r| r.wall)),
                checked(format!("{ratio:.2}"), ratio >= asked),
                format!("{asked}"),
                format!("{:.4}", last.dice),
                format!("{:.3}", last.minjac),
                volume.map_or_else(|| "–".to_owned(), |(v, m)| format!("{:.4}", v / m)),
                format!("{:.0}", last.rss),
            ]);
        }
    }
    table
}

fn our_cpu(measured: &Measured) -> f64 {
    median(&measured.ours.iter().map(|r| r.cpu).collect::<Vec<_>>())
}

fn chart(report: &Report) -> Outcome<String> {
    let rows = report.cases.iter().map(|measured| {
        let peer = |name: &str| {
            let runs = measured.peers.get(name)?;
            Some(median(&runs.iter().map(|r| r.cpu).collect::<Vec<_>>()))
        };
        let values = vec![Some(our_cpu(measured)), peer("ants"), peer("demons")];
        let note = |x: &Option<f64>| x.map_or_else(String::new, |x| format!("{x:.2} s"));
        Bars {
            label: measured.case.into(),
            notes: values.iter().map(note).collect(),
            values,
        }
    });
    let series = ["Shapespace", "SyN (ANTs)", "log-demons (ITK)"];
    let rows: Vec<Bars> = rows.collect();
    Ok(bars("Processor seconds", &series, &rows)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_templates_and_of_pairs_are_read() {
        let pair = "chatter\n{\"peer\":\"ants\",\"cpu\":1.5,\"wall\":2.0,\"rss\":300,\
                    \"dice\":0.99,\"minjac\":0.3,\"hd\":1.0}\n";
        let run = last_line(pair).unwrap();
        assert_eq!((run.cpu, run.volume), (1.5, None));
        let template = "{\"cpu\":59,\"wall\":60,\"rss\":290,\"dice\":0.997,\"minjac\":0.28,\
                        \"volume\":0.18,\"mean_volume\":0.2}";
        let run = last_line(template).unwrap();
        assert_eq!((run.volume, run.mean_volume), (Some(0.18), Some(0.2)));
        assert!(last_line("Traceback\n").is_err());
    }

    #[test]
    fn every_case_has_its_shapes() {
        for case in cases() {
            assert!(case.shapes.len() >= 2 && !case.peers.is_empty());
            let nodes = case.name.rsplit('-').next().unwrap();
            assert!(
                case.shapes.iter().all(|s| s.ends_with(nodes)),
                "{}",
                case.name
            );
        }
    }
}
