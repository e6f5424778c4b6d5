//! `shapespace warp`: carries images, surfaces and landmarks through the deformation of an input of
//! an average, or its inverse.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use fe_grid::{Grid, ScalarField};

use super::map::{Between, StoredMap, WorldMap, pulled_back};
use super::points::{moved_landmarks, moved_surface};
use crate::error::{CliError, Exit};
use crate::options::RunOptions;
use crate::output::ResultDir;
use crate::output::nifti::{Values, write_volume};
use crate::pool::in_pool;
use crate::print::print;
use crate::shapes::stem;
use shapespace_input::lattice::Lattice;
use shapespace_input::terminal::printable;
use shapespace_input::{Kinds, Numbers, Sources, expand, extension_of, is_mesh};

/// Carries images, surfaces and landmarks from an input of an average to the average, or back. All
/// lie in the world (RAS, millimetres).
#[derive(Clone, Debug, Args)]
pub struct WarpArgs {
    /// Result directory of an average of volumes with a place in the world.
    #[arg(value_name = "AVERAGE")]
    average: PathBuf,
    /// Images (volumes of any format), surfaces (.stl, .ply, .obj, .vtk, .vtp), and landmarks (.csv, with x, y and z in the
    /// first three columns). A folder, or a pattern in quotes, stands for its files.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Number of the input, from 0.
    #[arg(long, value_name = "K")]
    shape: usize,
    /// From the average to the input, not from the input to the average.
    #[arg(long)]
    inverse: bool,
    /// Values between the samples of images [default: nearest for whole numbers, such as labels and
    /// masks, else linear].
    #[arg(long, value_enum)]
    interpolation: Option<Interpolation>,
    /// Options that do not influence the results.
    #[command(flatten)]
    run: RunOptions,
}

/// Values between the samples of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
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
    ResultDir::check(&args.run.output)?;
    let mut files = args.files.clone();
    expand(&mut files, Kinds::Masks)?;
    in_pool(args.run.threads, || warp(args, &files))
}

fn warp(args: &WarpArgs, files: &[PathBuf]) -> Result<Exit, CliError> {
    let stored = StoredMap::read(&args.average, args.shape, args.run.trust)?;
    let target = stored.target(args.inverse);
    let map = stored.direction(args.inverse);
    // An image is pulled back: every point of the result asks where it comes from.
    let back = stored.direction(!args.inverse);
    let directory = ResultDir::create(&args.run.output)?;
    let mut lines = Vec::new();
    let mut taken: Vec<PathBuf> = Vec::new();
    for path in files {
        let name = name_of(path);
        if taken.contains(&name) {
            return Err(CliError::Option {
                option: "FILE",
                value: format!("'{}'", path.display()),
                remedy: "give files of different names, which those of the results are".into(),
            });
        }
        let file = directory.file(&name);
        let extension = extension_of(path);
        let what = match &*extension {
            "csv" => moved_landmarks(path, &file, &map)?,
            other if is_mesh(other) => moved_surface(path, &file, &map)?,
            _ => warped_image(path, &file, (&target, &back), args.interpolation)?,
        };
        lines.push(format!(
            "  {what:<12} {}\n",
            args.run.output.join(&name).display()
        ));
        taken.push(name);
    }
    directory.commit()?;
    print(&printable(&lines.concat()))?;
    Ok(Exit::Success)
}

/// The name of a result: images become `.nii.gz`, and surfaces have a format that is written.
fn name_of(path: &Path) -> PathBuf {
    let extension = extension_of(path);
    let written = match &*extension {
        "csv" | "stl" | "ply" | "vtp" => &extension,
        "obj" => "ply",
        "vtk" => "vtp",
        _ => "nii.gz",
    };
    format!("{}.{written}", stem(path)).into()
}

fn warped_image(
    path: &Path,
    file: &Path,
    (target, back): (&Lattice, &WorldMap),
    interpolation: Option<Interpolation>,
) -> Result<&'static str, CliError> {
    let image = Sources::files().read_numbers(path)?;
    let (values, between) = carried(image, (target, back), interpolation)?;
    let byte = |value: &f32| value.fract() == 0.0 && (0.0..=255.0).contains(value);
    if values.iter().all(byte) {
        let bytes: Vec<u8> = values.iter().map(|&value| value as u8).collect();
        write_volume(file, target, &Values::Mask(&bytes))?;
    } else {
        write_volume(file, target, &Values::Numbers(&values))?;
    }
    Ok(match between {
        Between::Nearest => "labels",
        Between::Linear => "image",
    })
}

/// The values of an image at the samples of a lattice, whose points a map sends back into it.
///
/// # Errors
/// None in practice: the image has as many values as its lattice samples.
pub(crate) fn carried(
    image: Numbers,
    (target, back): (&Lattice, &WorldMap),
    interpolation: Option<Interpolation>,
) -> Result<(Vec<f32>, Between), CliError> {
    let lattice = image.lattice;
    let whole = image.values.iter().all(|value| value.fract() == 0.0);
    let between = match interpolation {
        Some(Interpolation::Nearest) => Between::Nearest,
        None if whole => Between::Nearest,
        Some(Interpolation::Linear) | None => Between::Linear,
    };
    let field = ScalarField::from_vec(Grid::with_nodes(lattice.size, 1.0)?, image.values)?;
    let values = pulled_back((&field, &lattice), between, target, back);
    Ok((values, between))
}
