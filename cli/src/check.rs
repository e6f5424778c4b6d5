//! `shapespace check`: verifies a result directory.

mod paths;
mod verdict;

use std::fs::metadata;
use std::path::{Path, PathBuf};

use clap::Args;
use fe_grid::{Grid, certify};
use phasefield::InterfaceLength;
use serde_json::Value;
use shape_average::{elastic_energy, mismatch_energy};
use shapespace_report::table::Table;

use crate::error::{CliError, Exit};
use crate::integrity::{Sums, sum_of_file, sum_of_input, unlisted};
use crate::memory::in_short;
use crate::numbers::shown;
use crate::pca::{StoredAverage, read_average};
use crate::print::print;
use crate::report::{CANCELLED, RESULT};
use crate::results::{ResultFields, command_in};
use paths::check_steps;
use shapespace_input::dimension::per_dimension;
use shapespace_input::files::read_text;
use shapespace_input::terminal::{note, printable};
use verdict::check_verdict;

/// Relative tolerance of recomputed numbers. Displacements are stored as positions, whose rounding
/// errors are about 1e-16; strains are these over the spacing, and energies are quadratic in them.
const TOLERANCE: f64 = 1e-6;
/// Energies below this are those of strains of 1e-6, which rounding errors reach on fine grids.
const NEGLIGIBLE: f64 = 1e-12;

/// Verifies a result directory: the checksums of its record, its arrays and its inputs, the determinants of
/// its deformations, the elastic energies of an average, the energies of the steps of a geodesic and its
/// length, and that its verdict follows from its doubts.
#[derive(Clone, Debug, Args)]
pub struct CheckArgs {
    /// Result directory of any command that writes arrays.
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

/// What was found, line by line.
#[derive(Default)]
pub(crate) struct Findings {
    lines: Vec<[String; 3]>,
    wrong: usize,
}

impl Findings {
    fn add(&mut self, what: impl Into<String>, found: impl Into<String>, is_right: bool) {
        self.wrong += usize::from(!is_right);
        let word = if is_right { "ok" } else { "WRONG" };
        self.lines.push([what.into(), word.into(), found.into()]);
    }

    /// Adds a number that has been recomputed.
    fn compare(&mut self, what: String, found: f64, stated: f64) {
        self.compare_above(NEGLIGIBLE, what, found, stated);
    }

    /// The same for a quantity of which differences up to this one are negligible.
    fn compare_above(&mut self, negligible: f64, what: String, found: f64, stated: f64) {
        let is_right = (found - stated).abs() <= TOLERANCE * stated.abs() + negligible;
        let numbers = format!("{}, the record states {}", shown(found), shown(stated));
        self.add(what, numbers, is_right);
    }
}

/// Runs `shapespace check`.
///
/// # Errors
/// [`CliError::NoResult`] for a directory without a record, and [`CliError::Damaged`] where anything
/// differs, after the report on standard output.
pub fn run_check(args: &CheckArgs) -> Result<Exit, CliError> {
    let directory = args.directory.as_path();
    if let Some(needed) = memory(directory) {
        note(in_short(needed));
    }
    let (record, findings) = inspect(directory)?;
    report(&record, &findings)?;
    if findings.wrong > 0 {
        return Err(CliError::Damaged {
            path: directory.into(),
            reason: format!(
                "{} of its parts are not as its record states",
                findings.wrong
            ),
        });
    }
    let is_doubtful = record["verdict"] == "doubtful";
    Ok(if is_doubtful {
        Exit::Doubtful
    } else {
        Exit::Success
    })
}

/// Estimates the memory of a check, in bytes: that of all arrays of which numbers are computed, or of the largest where
/// one is read after the other. `None` where there is no record.
fn memory(directory: &Path) -> Option<u64> {
    let sums = Sums::of(directory, true).ok().filter(Sums::exist)?;
    let arrays = sums
        .iter()
        .filter(|(name, _)| Path::new(name).extension() == Some("npy".as_ref()));
    let sizes = arrays.filter_map(|(name, _)| Some(metadata(directory.join(name)).ok()?.len()));
    Some(match command_in(directory).as_deref() {
        Some("average" | "geodesic") => sizes.sum(),
        _ => sizes.max().unwrap_or(0),
    })
}

/// The record of a directory, and what was found in it.
///
/// # Errors
/// [`CliError::NoRecord`] for a directory without a record.
pub(crate) fn inspect(directory: &Path) -> Result<(Value, Findings), CliError> {
    let unfit = |reason: String| CliError::NoRecord {
        path: directory.into(),
        reason,
    };
    let text = read_text(&directory.join(RESULT))
        .map_err(|error| unfit(format!("its {RESULT} cannot be read: {error}")))?;
    let record: Value = serde_json::from_str(&text)
        .map_err(|error| unfit(format!("its {RESULT} has other contents: {error}")))?;
    let mut findings = Findings::default();
    let sums = Sums::of(directory, true)?;
    check_sums(directory, &sums, &mut findings);
    check_inputs(&record, &mut findings);
    let intact = findings.wrong == 0;
    let is_whole = check_verdict(&record, &mut findings) && intact;
    if let Err(error) = check_numbers(directory, &record, is_whole, &mut findings) {
        findings.add("what is computed again", error.to_string(), false);
    }
    match sums.as_written() {
        Some(true) => findings.add(RESULT, "unchanged", true),
        Some(false) => findings.add(RESULT, "its contents have changed", false),
        // Of an earlier version, or taken out.
        None => findings.add(RESULT, "it has no checksum of its own", false),
    }
    Ok((record, findings))
}

/// The numbers that can be computed again; of damaged results the determinants.
fn check_numbers(
    directory: &Path,
    record: &Value,
    is_whole: bool,
    findings: &mut Findings,
) -> Result<(), CliError> {
    if is_whole && record.pointer("/energy/elastic").is_some() {
        let stored = read_average(directory, true)?;
        per_dimension!(stored, stored => check_average(&stored, record, findings)?);
        return Ok(());
    }
    if record["command"] != "geodesic" {
        return check_deformations(directory, findings);
    }
    if is_whole {
        match record["dimension"].as_u64() {
            Some(2) => check_steps::<2>(directory, findings)?,
            Some(3) => check_steps::<3>(directory, findings)?,
            _ => findings.add("dimension", "neither 2 nor 3", false),
        }
    }
    Ok(())
}

fn report(record: &Value, findings: &Findings) -> Result<(), CliError> {
    let mut table = Table::new(["part", "state", "found"]);
    for [what, word, found] in &findings.lines {
        table.texts([what, word, found].map(String::clone));
    }
    let text = |key: &str| record[key].as_str().unwrap_or("not stated").to_owned();
    let lines = format!(
        "{}\nwritten by version {}, checked by version {}, status {}, verdict {}\n",
        table.aligned("").trim_end(),
        text("version"),
        env!("CARGO_PKG_VERSION"),
        text("status"),
        text("verdict")
    );
    Ok(print(&printable(&lines))?)
}

/// The arrays that the record lists, and those that it does not list.
fn check_sums(directory: &Path, sums: &Sums, findings: &mut Findings) {
    if !sums.exist() {
        findings.add("arrays", "the record has no checksums", false);
        return;
    }
    for (name, sum) in sums.iter() {
        match sum_of_file(&directory.join(name)) {
            Ok(found) if found == *sum => findings.add(name, "unchanged", true),
            Ok(_) => findings.add(name, "its contents have changed", false),
            Err(error) => findings.add(name, error.to_string(), false),
        }
    }
    for name in unlisted(directory, sums).unwrap_or_default() {
        findings.add(name, "the record does not list it", false);
    }
}

/// The inputs, where their files still exist.
fn check_inputs(record: &Value, findings: &mut Findings) {
    for input in record["input"].as_array().into_iter().flatten() {
        let (Some(path), Some(sum)) = (input["path"].as_str(), input["sha256"].as_str()) else {
            continue;
        };
        match sum_of_input(Path::new(path)) {
            Ok(found) if found == sum => findings.add(path, "the same input", true),
            Ok(_) => findings.add(path, "the input has changed since", false),
            Err(_) => findings.add(path, "the input is not here", true),
        }
    }
}

/// The determinants of an average and the terms of its functional; without the mismatch and the length of medians, and
/// where there are several components or hidden parts.
fn check_average<const D: usize>(
    stored: &StoredAverage<D>,
    record: &Value,
    findings: &mut Findings,
) -> Result<(), CliError> {
    let grid = *stored.average.grid();
    let (mut least, mut elastic) = (f64::INFINITY, Vec::new());
    for i in 0..stored.average.n_shapes() {
        let source = stored.average.source(i);
        least = least.min(certify(&grid, source.displacement, 0.0).min_det);
        let stated = record.pointer(&format!("/energy/elastic/{i}"));
        if let (Some(stated), None) = (stated.and_then(Value::as_f64), &stored.image) {
            let (params, u) = (&stored.params, source.displacement);
            let found = elastic_energy(params, &grid, source.indicator, u)?;
            findings.compare(format!("elastic energy {i}"), found, stated);
            elastic.push(found);
        }
    }
    if stored.components.is_empty() && !stored.phase_fields.is_empty() {
        check_match(stored, &elastic, record, findings)?;
    }
    match record
        .pointer("/certificate/min_det")
        .and_then(Value::as_f64)
    {
        Some(stated) => findings.compare("determinant".into(), least, stated),
        None => findings.add("determinant", shown(least), least > 0.0),
    }
    Ok(())
}

/// The mismatch of every shape, the interface length, and the functional.
fn check_match<const D: usize>(
    stored: &StoredAverage<D>,
    elastic: &[f64],
    record: &Value,
    findings: &mut Findings,
) -> Result<(), CliError> {
    let (grid, params) = (*stored.average.grid(), &stored.params);
    let stated = |key: &str| record.pointer(key).and_then(Value::as_f64);
    let average = stored.phase_field.as_slice();
    let (n, mut total) = (stored.phase_fields.len(), 0.0);
    let sources = stored.average.sources();
    let interrupted = record["status"] == CANCELLED;
    let shapes = stored.phase_fields.iter().zip(&sources).zip(elastic);
    for (i, ((field, source), elastic)) in shapes.enumerate() {
        let (fields, u) = ([average, field.as_slice()], source.displacement);
        let mismatch = mismatch_energy(params, &grid, fields, u)?;
        // Deformations of shapes of weight zero are computed at last: an interrupted average has none.
        let is_known = source.weight > 0.0 || !interrupted;
        if let Some(stated) = stated(&format!("/energy/mismatch/{i}")).filter(|_| is_known) {
            findings.compare(format!("mismatch {i}"), mismatch, stated);
        }
        // A shape of weight zero does not enter the functional.
        if source.weight > 0.0 {
            total += source.weight * elastic + params.mismatch_weight / n as f64 * mismatch;
        }
    }
    let interface = InterfaceLength {
        interface_width: params.interface_cells * grid.spacing(),
    };
    let length = interface.of(&grid, average);
    total += params.resolved_length_weight() * length;
    for (what, found) in [("length", length), ("total", total)] {
        if let Some(stated) = stated(&format!("/energy/{what}")) {
            findings.compare(format!("{what} of the functional"), found, stated);
        }
    }
    Ok(())
}

/// The determinants of all deformations of any other result.
fn check_deformations(directory: &Path, findings: &mut Findings) -> Result<(), CliError> {
    let unfit = |path: &Path, reason: String| CliError::NoResult {
        path: path.into(),
        command: "geodesic",
        reason,
    };
    let fields = ResultFields::new(directory, unfit, true)?;
    let names = fields.sums().iter().map(|(name, _)| name);
    for name in names.filter(|name| name.starts_with("deformation_")) {
        let path = Path::new(name);
        let nodes = fields.nodes(path)?;
        let least = match nodes.len() {
            2 => determinant::<2>(&fields, path, &nodes)?,
            3 => determinant::<3>(&fields, path, &nodes)?,
            _ => None,
        };
        match least {
            Some(least) => {
                let found = format!("determinant at least {}", shown(least));
                findings.add(name, found, least > 0.0);
            }
            None => findings.add(name, "it is no deformation of a box", false),
        }
    }
    Ok(())
}

fn determinant<const D: usize>(
    fields: &ResultFields<'_>,
    name: &Path,
    nodes: &[usize],
) -> Result<Option<f64>, CliError> {
    let Some(grid): Option<Grid<D>> = fields.grid(nodes) else {
        return Ok(None);
    };
    let displacement = fields.positions(&grid, name)?;
    Ok(Some(certify(&grid, displacement.as_slice(), 0.0).min_det))
}
