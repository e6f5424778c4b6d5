//! `shapespace warp`: carries images, surfaces and landmarks through the deformations of a result.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::draw::{PICTURE, sheet};
use super::images::carried_image;
use super::map::StoredMap;
use super::points::{Moved, moved_drawing, moved_landmarks, moved_surface};
use super::record::{Record, record, summary};
use super::way::Way;
use crate::error::{CliError, Exit};
use crate::integrity::seal;
use crate::options::RunOptions;
use crate::output::ResultDir;
use crate::page::{command_line, write_page};
use crate::pool::in_pool;
use crate::report::RESULT;
use crate::session::{concluded, logged};
use crate::shapes::{stem, with_folder};
use crate::summary::Summary;
use shapespace_input::{Kinds, expand, extension_of, is_mesh};

/// Carries images, surfaces and landmarks from one shape of a result to another: from an input of an
/// average to the average or to another input, along a path, or along modes.
///
/// Volumes, surfaces and points of results with a place in the world lie there (RAS, millimetres).
/// Otherwise images have the samples of the input, or the nodes of the grid, and points have the
/// coordinates of the input (samples, from 0, where that is an image), or of the average.
#[derive(Clone, Debug, Args)]
pub struct WarpArgs {
    /// Result directory of `average`, `geodesic`, `length`, `pca` or `synthesize`.
    #[arg(value_name = "RESULT")]
    pub(super) result: PathBuf,
    /// Images of any format, surfaces (.stl, .ply, .obj, .vtk, .vtp), and points such as landmarks or outlines
    /// (.csv, with x, y and, of volumes, z in the first columns or in those of these names). A folder, or a pattern
    /// in quotes, stands for its files.
    #[arg(value_name = "FILE", required = true)]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) way: Way,
    /// The other way round.
    #[arg(long, help_heading = "From where to where")]
    pub(super) inverse: bool,
    /// Values between the samples of images [default: nearest for labels and masks, whole numbers of which
    /// there are few or most neighbours are equal; else linear].
    #[arg(long, value_enum, help_heading = "Samples of images")]
    pub(super) interpolation: Option<Interpolation>,
    /// Samples of images in a spacing of the grid, where the inputs have no place in the world.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=64),
        help_heading = "Samples of images"
    )]
    pub(super) refine: u32,
    /// Options that do not influence the results.
    #[command(flatten)]
    pub(super) run: RunOptions,
}

/// Values between the samples of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Multilinear.
    Linear,
    /// Those of the nearest sample.
    Nearest,
}

/// Runs `shapespace warp`.
///
/// # Errors
/// [`CliError`]; then nothing has been written.
pub fn run_warp(args: &WarpArgs) -> Result<Exit, CliError> {
    let start = Instant::now();
    logged(&args.run, || {
        ResultDir::check(&args.run.output)?;
        let mut files = args.files.clone();
        expand(&mut files, Kinds::Masks)?;
        given_once(&files)?;
        in_pool(args.run.threads, || warp(args, &files, start))
    })
}

/// Refuses a file that is given twice, before anything is computed.
fn given_once(files: &[PathBuf]) -> Result<(), CliError> {
    let again = (1..files.len()).find(|&i| files[..i].contains(&files[i]));
    match again {
        None => Ok(()),
        Some(i) => Err(CliError::Option {
            option: "FILE",
            value: format!("'{}', which is given twice,", files[i].display()),
            remedy: "give every file once".into(),
        }),
    }
}

fn warp(args: &WarpArgs, files: &[PathBuf], start: Instant) -> Result<Exit, CliError> {
    let progress = args.run.progress(start);
    progress.stage("reading the result");
    let refine = args.refine as usize;
    let stored = StoredMap::read(&args.result, &args.way, refine, args.run.trust)?;
    stored.announce(args.inverse, &progress)?;
    let map = stored.direction(args.inverse);
    // An image is pulled back: every point of the result asks where it comes from.
    let back = stored.direction(!args.inverse);
    let directory = ResultDir::create(&args.run.output)?;
    let mut carried: Vec<Moved> = Vec::new();
    for (path, stem) in files.iter().zip(stems(files)) {
        progress.stage(format!("carrying '{}'", path.display()));
        let (file, maps) = ((path.as_path(), &*stem), (&stored, &map));
        let moved = match kind(path) {
            Kind::Points => moved_landmarks(file, &directory, maps)?,
            Kind::Drawing => moved_drawing(file, &directory, maps)?,
            Kind::Surface => moved_surface(file, &directory, maps)?,
            Kind::Image => {
                let sides = stored.sides(args.inverse);
                let small = stored.small();
                let maps = [&map, &back];
                carried_image(file, &directory, (sides, maps, small), args.interpolation)?
            }
        };
        let taken = |other: &Moved| other.name == moved.name;
        if moved.name == Path::new(PICTURE) || carried.iter().any(taken) {
            return Err(other_name(path));
        }
        carried.push(moved);
    }
    directory.picture(PICTURE, || sheet(&carried))?;
    let found = (&*carried, stored.doubts());
    let summary = match stored.dimension() {
        2 => write(
            &record::<2>(args, files, found, start),
            args,
            &carried,
            &directory,
        ),
        _ => write(
            &record::<3>(args, files, found, start),
            args,
            &carried,
            &directory,
        ),
    }?;
    let target = directory.commit()?;
    progress.finish();
    summary.print(&target);
    Ok(concluded(&summary, &args.run, start))
}

/// What a file has that is carried.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Points,
    Drawing,
    Surface,
    Image,
}

fn kind(path: &Path) -> Kind {
    match &*extension_of(path) {
        "csv" => Kind::Points,
        "svg" => Kind::Drawing,
        other if is_mesh(other) => Kind::Surface,
        _ => Kind::Image,
    }
}

/// The names of the results without extensions: those of the files, with their folders in front where files of a kind
/// would have the same.
fn stems(files: &[PathBuf]) -> Vec<String> {
    let name = |path: &PathBuf| {
        let same = |other: &&PathBuf| stem(other) == stem(path) && kind(other) == kind(path);
        match files.iter().filter(same).count() {
            0 | 1 => stem(path),
            _ => with_folder(path).replace('/', "_"),
        }
    };
    files.iter().map(name).collect()
}

/// Writes the record and the report, and summarises them.
fn write<const D: usize>(
    record: &Record<'_, D>,
    args: &WarpArgs,
    carried: &[Moved],
    directory: &ResultDir,
) -> Result<Summary, CliError> {
    directory.record(RESULT, record)?;
    let summary = summary(record, args, carried);
    write_page(directory, &summary, Some(&command_line()))?;
    seal(directory)?;
    Ok(summary)
}

fn other_name(path: &Path) -> CliError {
    CliError::Option {
        option: "FILE",
        value: format!("'{}'", path.display()),
        remedy: "another file has this name, which would be that of both results: carry it by a command of its own".into(),
    }
}

impl Moved {
    /// The file that was written, and for how much of it the map has no exact inverse.
    pub(super) fn line(&self, output: &Path) -> (String, String) {
        let name = output.join(&self.name).display().to_string();
        let remark = |count: usize, what: &str| match count {
            0 => String::new(),
            _ => format!(" ({count} of {} {} {what})", self.count, self.unit),
        };
        let inexact = remark(self.inexact, "have no exact place there");
        let what = if self.lost > 0.0 {
            "lie in objects outside of the box of the grid, and are left out"
        } else {
            "lie outside of the box of the grid, and are displaced as the nearest point of its faces"
        };
        let outside = remark(self.outside, what);
        (name, inexact + &outside)
    }
}
