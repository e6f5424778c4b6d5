//! Targets for configurations, and for folders: pairs of files, checkpoints and results.

use std::fs;
use std::path::{Path, PathBuf};

use fe_grid::minimise::{Evaluation, LbfgsParams, Minimiser, Objective};
use serde_json::Value;
use tempfile::TempDir;

use super::archive::unpack;
use super::images::place_any;
use crate::average::AverageConfig;
use crate::calculus::{ExtendConfig, TransportConfig, read_path};
use crate::check::inspect;
use crate::checkpoint::{Checkpointer, Place};
use crate::compare::CompareConfig;
use crate::config::{Config, parse};
use crate::distances::DistancesConfig;
use crate::fingerprint::Fingerprint;
use crate::geodesic::GeodesicConfig;
use crate::integrity::Sums;
use crate::interrupt::Interrupt;
use crate::length::LengthConfig;
use crate::metric::MetricConfig;
use crate::pca::{PcaConfig, ScoreConfig, SynthesizeConfig, read_average, read_pca};
use crate::progress::Progress;
use crate::report::RESULT;
use crate::segment::SegmentConfig;
use crate::watch::{GridSize, ProgressObserver};
use shapespace_input::{ReadOptions, read_image};

/// Runs of a computation whose memories are read.
const RUNS: usize = 4;
/// Unknowns of the run that resumes.
const UNKNOWNS: usize = 3;

/// Reads a configuration of the command that its first line names, as in the files that are printed.
pub(super) fn config(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    let first = text.lines().next().unwrap_or_default();
    let command = first.strip_prefix("# shapespace ").unwrap_or_default();
    match command.split_whitespace().next().unwrap_or_default() {
        "geodesic" => of::<GeodesicConfig>(text),
        "length" => of::<LengthConfig>(text),
        "metric" => of::<MetricConfig>(text),
        "distances" => of::<DistancesConfig>(text),
        "pca" => of::<PcaConfig>(text),
        "synthesize" => of::<SynthesizeConfig>(text),
        "score" => of::<ScoreConfig>(text),
        "compare" => of::<CompareConfig>(text),
        "extend" => of::<ExtendConfig>(text),
        "transport" => of::<TransportConfig>(text),
        "segment" => of::<SegmentConfig>(text),
        _ => of::<AverageConfig>(text),
    }
}

fn of<C: Config>(text: &str) -> bool {
    parse::<C>(text, Path::new("a.toml")).is_ok()
}

/// A new folder with the files of an archive.
fn unpacked(bytes: &[u8]) -> Option<TempDir> {
    let folder = tempfile::tempdir().ok()?;
    unpack(bytes, folder.path()).ok()?;
    Some(folder)
}

/// Reads the header of a pair of files, `a.hdr` and `a.img`.
pub(super) fn analyze(bytes: &[u8]) -> bool {
    let Some(folder) = unpacked(bytes) else {
        return false;
    };
    let image = read_image(&folder.path().join("a.hdr"), &ReadOptions::default());
    image.map(place_any).is_ok()
}

/// Opens the checkpoints in `out.partial`, once their checksums are right, and resumes runs from them.
pub(super) fn checkpoint(bytes: &[u8]) -> bool {
    let Some(folder) = unpacked(bytes) else {
        return false;
    };
    correct_sums(&folder.path().join("out.partial"));
    let target = folder.path().join("out");
    let progress = Progress::told(None);
    let place = Place {
        target: &target,
        fingerprint: Fingerprint::new(&toml::Table::new(), Vec::new()),
        minutes: 0.0,
    };
    let Ok(mut checkpointer) = Checkpointer::new(place, &progress, Interrupt::of_call()) else {
        return false;
    };
    let is_there = checkpointer.has_runs();
    let lbfgs = LbfgsParams {
        history: 2,
        ..LbfgsParams::default()
    };
    for _ in 0..RUNS {
        let grid = GridSize {
            side: UNKNOWNS,
            nodes: UNKNOWNS,
        };
        let watch = ProgressObserver::new(&progress, Interrupt::of_call(), vec![grid]);
        let mut observer = checkpointer.observe(watch);
        let _ = lbfgs.minimise(&mut Parabola, &mut [1.0; UNKNOWNS], &mut observer);
    }
    is_there
}

/// States the checksums that the files of the checkpoints have.
fn correct_sums(folder: &Path) -> Option<()> {
    let path = folder.join("state.json");
    let mut state: Value = serde_json::from_slice(&fs::read(&path).ok()?).ok()?;
    for one in state.get_mut("kept")?.as_array_mut()? {
        let number = one.get("checkpoint")?.as_u64()?;
        let sums = Sums::compute(&folder.join(format!("checkpoint_{number:03}"))).ok()?;
        *one.get_mut("sums")? = serde_json::to_value(sums).ok()?;
    }
    fs::write(path, state.to_string()).ok()
}

/// The energy `|x|² / 2`.
struct Parabola;

impl Objective for Parabola {
    type Error = std::convert::Infallible;

    fn dim(&self) -> usize {
        UNKNOWNS
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, Self::Error> {
        gradient.copy_from_slice(x);
        Ok(Evaluation::Value(
            0.5 * x.iter().map(|x| x * x).sum::<f64>(),
        ))
    }
}

/// Reads a folder as the result of each command whose results others read, once its checksums are right.
pub(super) fn result(bytes: &[u8]) -> bool {
    let Some(folder) = unpacked(bytes) else {
        return false;
    };
    let directory: PathBuf = folder.path().into();
    let average = directory.join("average");
    for directory in [&average, &directory] {
        seal_again(directory);
    }
    let _ = inspect(&directory);
    let _ = read_average(&average, true);
    let read = [
        read_average(&directory, true).is_ok(),
        read_pca(&directory, Some(&average), true).is_ok(),
        read_path(&directory, true).is_ok(),
    ];
    read.contains(&true)
}

/// States the checksums that the arrays of a result have.
fn seal_again(directory: &Path) -> Option<()> {
    let path = directory.join(RESULT);
    let mut record: Value = serde_json::from_slice(&fs::read(&path).ok()?).ok()?;
    let sums = serde_json::to_value(Sums::compute(directory).ok()?).ok()?;
    record
        .as_object_mut()?
        .insert("arrays".into(), sums["arrays"].clone());
    fs::write(path, record.to_string()).ok()
}
