//! `shapespace generate`: its options and output files.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use fe_grid::{Grid, ScalarField};
use levelset::inspect::border_share;
use png::{BitDepth, ColorType};
use shapespace_generate::{
    Bar, Blob, Cross, Ellipsoid, Family, Implicit, Letter, Member, Placed, Star, area_share,
    family, letter, letters, make_grey,
};

use crate::error::CliError;
use crate::memory::{check_free, in_short};
use crate::numbers::{finite, positive, shown};
use crate::output::npy::{Precision, field_to};
use crate::output::{OutputError, ResultDir, write_new_file};
use shapespace_input::terminal::note;
use shapespace_picture::png::encode;

/// Small pictures are drawn without a note on the memory.
const WORTH_SAYING: u64 = 64 << 20;

/// Draws a test shape or a family of test shapes.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    #[command(subcommand)]
    shape: ShapeCommand,
}

/// Position, sampling and output of a shape.
#[derive(Clone, Debug, Args)]
struct Common {
    /// Output file: .npy, or .png in 2D. For a family: a new directory.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Number of nodes per side [default: 129, in 3D 65].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=16385))]
    grid: Option<u32>,
    /// Dimension.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(2..=3))]
    dimension: u32,
    /// Rotation angle in degrees, from x towards y.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    rotate: f64,
    /// Translation X,Y or X,Y,Z, in units of the box side.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    shift: Vec<f64>,
    /// Difference between the grey values inside and outside of the shape, symmetric about
    /// mid-grey, from 0 to 1; below 1 the result is a grey image instead of a mask.
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true, value_parser = finite)]
    contrast: f64,
    /// Standard deviation of the added noise, from 0 to 1; 1 is the range from black to white.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    noise: f64,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    noise_seed: u64,
}

/// Shape to draw. Lengths are relative to the side of the unit box.
#[derive(Clone, Debug, Subcommand)]
enum ShapeCommand {
    /// A bar with two arms that meet at an angle; 180 is straight.
    Bar {
        /// Inner angle in degrees.
        #[arg(long, default_value_t = 180.0, allow_negative_numbers = true, value_parser = finite)]
        angle: f64,
        /// Total length of both arms.
        #[arg(long, default_value_t = 0.6, allow_negative_numbers = true, value_parser = positive)]
        length: f64,
        /// Width of the arms.
        #[arg(long, default_value_t = 0.12, allow_negative_numbers = true, value_parser = positive)]
        width: f64,
        #[command(flatten)]
        common: Common,
    },
    /// A disk, or a ball.
    Disk {
        /// Radius.
        #[arg(long, default_value_t = 0.25, allow_negative_numbers = true, value_parser = positive)]
        radius: f64,
        #[command(flatten)]
        common: Common,
    },
    /// An ellipse, or an ellipsoid.
    Ellipse {
        /// Semi-axes, one per dimension.
        #[arg(long, value_delimiter = ',', value_parser = positive, default_values_t = [0.35, 0.2])]
        radii: Vec<f64>,
        #[command(flatten)]
        common: Common,
    },
    /// A cross with four arms, the left and the right one bent.
    Cross {
        /// Bending angles of the left and the right arm in degrees.
        #[arg(long, value_delimiter = ',', allow_hyphen_values = true,
              value_parser = finite, default_values_t = [0.0, 0.0])]
        angle: Vec<f64>,
        #[command(flatten)]
        common: Common,
    },
    /// A disk with pins.
    Star {
        /// Number of pins.
        #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=64))]
        pins: u32,
        /// Angle in degrees by which the first pin is moved towards the second.
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
        pin: f64,
        #[command(flatten)]
        common: Common,
    },
    /// A letter.
    Letter {
        /// Letter to draw; b2 and b3 are other drawings of b.
        #[arg(ignore_case = true)]
        letter: Letter,
        #[command(flatten)]
        common: Common,
    },
    /// A smooth random shape.
    Blob {
        /// Seed: the same seed gives the same shape.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Relative variation of the radius, from 0 to .9.
        #[arg(long, default_value_t = 0.3, allow_negative_numbers = true, value_parser = finite)]
        roughness: f64,
        #[command(flatten)]
        common: Common,
    },
    /// Several shapes of one kind, one file each.
    Family {
        /// The family.
        family: Family,
        /// Seed of the random families.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        #[command(flatten)]
        common: Common,
    },
}

/// Draws the shapes and returns the files written.
///
/// # Errors
/// [`CliError`] for options out of range and outputs that cannot be written.
pub fn run_generate(args: &GenerateArgs) -> Result<Vec<PathBuf>, CliError> {
    let common = args.shape.common();
    if common.dimension == 2 {
        run::<2>(
            &args.shape,
            common,
            &|which| Some(Box::new(letter(which))),
            letters,
        )
    } else {
        run::<3>(&args.shape, common, &|_| None, Vec::new)
    }
}

impl ShapeCommand {
    fn common(&self) -> &Common {
        match self {
            Self::Bar { common, .. }
            | Self::Disk { common, .. }
            | Self::Ellipse { common, .. }
            | Self::Cross { common, .. }
            | Self::Star { common, .. }
            | Self::Letter { common, .. }
            | Self::Blob { common, .. }
            | Self::Family { common, .. } => common,
        }
    }
}

type AnyShape<const D: usize> = Box<dyn Implicit<D>>;

/// Letters exist in 2D only, so that each dimension passes its own function to draw them.
fn run<const D: usize>(
    command: &ShapeCommand,
    common: &Common,
    draw_letter: &dyn Fn(Letter) -> Option<AnyShape<D>>,
    letters: fn() -> Vec<Member<D>>,
) -> Result<Vec<PathBuf>, CliError> {
    let grid = grid::<D>(common)?;
    // The shape, and the bytes of its file.
    let needed = (2 * size_of::<f64>() * grid.n_nodes()) as u64;
    if needed > WORTH_SAYING {
        note(in_short(needed));
    }
    check_free(needed, &grid)?;
    let centre = centre::<D>(common)?;
    check_greys(common)?;
    let share = |shape: &AnyShape<D>| {
        let placed = Placed {
            shape: shape.as_ref(),
            rotation: common.rotate,
            centre,
        };
        area_share(&placed, grid)
    };
    // Every member of a family has its own noise.
    let sampled = |shape: &AnyShape<D>, number: u64| {
        let mut field = share(shape);
        let inside = field
            .as_slice()
            .iter()
            .filter(|share| **share > 0.5)
            .count();
        if inside == 0 || inside == field.as_slice().len() {
            return Err(CliError::NoObject {
                full: inside > 0,
                nodes: grid.nodes_per_axis()[0],
            });
        }
        if border_share(&field, 0.5) > 0.0 {
            note(
                "the shape is cut off at the border of the image: make it smaller, or move it with --shift",
            );
        }
        if common.contrast < 1.0 || common.noise > 0.0 {
            let seed = common.noise_seed.wrapping_add(number);
            make_grey(field.as_mut_slice(), common.contrast, common.noise, seed);
        }
        Ok(field)
    };
    if let ShapeCommand::Family {
        family: which,
        seed,
        ..
    } = command
    {
        let members = family::<D>(*which, *seed).unwrap_or_else(letters);
        if members.is_empty() {
            return Err(flat_only("letters"));
        }
        if members.iter().any(|member| !member.parts.is_empty()) {
            check_labels(common)?;
        }
        let directory = ResultDir::create(&common.output)?;
        for (number, member) in members.iter().enumerate() {
            let mut field = sampled(&member.shape, number as u64)?;
            if !member.parts.is_empty() {
                let shares = member.parts.iter().map(share);
                label(&mut field, &shares.collect::<Vec<_>>());
            }
            directory.array(format!("{}.npy", member.name), &field)?;
        }
        let target = directory.commit()?;
        return Ok(members
            .iter()
            .map(|member| target.join(format!("{}.npy", member.name)))
            .collect());
    }
    let shape = shape::<D>(command, draw_letter)?;
    write_shape(&common.output, || sampled(&shape, 0))?;
    Ok(vec![common.output.clone()])
}

/// Replaces the share of a whole shape by the labels of its parts: each node inside has that of the part of the largest
/// share.
fn label<const D: usize>(whole: &mut ScalarField<f64, D>, parts: &[ScalarField<f64, D>]) {
    for (node, value) in whole.as_mut_slice().iter_mut().enumerate() {
        let share = |part: &ScalarField<f64, D>| part.as_slice()[node];
        let (mut largest, mut label) = (0.0, 0.0);
        for (number, part) in parts.iter().enumerate() {
            if *value > 0.5 && share(part) > largest {
                (largest, label) = (share(part), (number + 1) as f64);
            }
        }
        *value = label;
    }
}

/// Label images have no greys.
fn check_labels(common: &Common) -> Result<(), CliError> {
    let remedy = "label images have no greys: leave the option out";
    checked(
        common.contrast >= 1.0,
        "--contrast",
        common.contrast,
        remedy,
    )?;
    checked(common.noise <= 0.0, "--noise", common.noise, remedy)
}

fn check_greys(common: &Common) -> Result<(), CliError> {
    let range = 0.0..=1.0;
    for (option, value) in [("--contrast", common.contrast), ("--noise", common.noise)] {
        checked(range.contains(&value), option, value, "from 0 to 1")?;
    }
    Ok(())
}

fn grid<const D: usize>(common: &Common) -> Result<Grid<D>, CliError> {
    let nodes = common
        .grid
        .map_or(if D == 2 { 129 } else { 65 }, |n| n as usize);
    let most = if D == 2 { 16385 } else { 513 };
    if nodes > most {
        return Err(CliError::Option {
            option: "--grid",
            value: nodes.to_string(),
            remedy: format!("at most {most} nodes a side are drawn in {D}D"),
        });
    }
    Ok(Grid::cube(nodes))
}

fn centre<const D: usize>(common: &Common) -> Result<[f64; D], CliError> {
    if common.shift.is_empty() {
        return Ok([0.5; D]);
    }
    let shift = <[f64; D]>::try_from(common.shift.clone()).map_err(|shift| CliError::Option {
        option: "--shift",
        value: format!("{shift:?}"),
        remedy: format!("give {D} numbers, separated by commas"),
    })?;
    Ok(shift.map(|x| 0.5 + x))
}

fn flat_only(what: &str) -> CliError {
    CliError::Option {
        option: "--dimension",
        value: "3".into(),
        remedy: format!("{what} are flat shapes: leave the option out"),
    }
}

fn shape<const D: usize>(
    command: &ShapeCommand,
    draw_letter: &dyn Fn(Letter) -> Option<AnyShape<D>>,
) -> Result<AnyShape<D>, CliError> {
    Ok(match command {
        ShapeCommand::Bar {
            angle,
            length,
            width,
            ..
        } => {
            let allowed = (20.0..=340.0).contains(angle);
            checked(
                allowed,
                "--angle",
                *angle,
                "bars bend to inner angles from 20 to 340 degrees",
            )?;
            Box::new(Bar::new(*length, *width, *angle))
        }
        ShapeCommand::Disk { radius, .. } => Box::new(Ellipsoid {
            radii: [*radius; D],
        }),
        ShapeCommand::Ellipse { radii, .. } => {
            let mut axes = [radii[radii.len() - 1]; D];
            checked(
                radii.len() <= D,
                "--radii",
                radii.len() as f64,
                "give one semi-axis for each dimension",
            )?;
            axes[..radii.len()].copy_from_slice(radii);
            Box::new(Ellipsoid { radii: axes })
        }
        ShapeCommand::Cross { angle, .. } => {
            let allowed = angle.len() <= 2 && angle.iter().all(|a| a.abs() <= 90.0);
            checked(
                allowed,
                "--angle",
                angle[0],
                "give two bends from -90 to 90 degrees",
            )?;
            Box::new(Cross {
                arm: 0.33,
                width: 0.11,
                bend: [angle[0], angle[angle.len() - 1]],
            })
        }
        ShapeCommand::Star { pins, pin, .. } => Box::new(Star {
            pins: *pins as usize,
            radius: 0.17,
            reach: 0.34,
            width: 0.07,
            first_pin: *pin,
        }),
        ShapeCommand::Blob {
            seed, roughness, ..
        } => {
            let allowed = (0.0..=0.9).contains(roughness);
            checked(allowed, "--roughness", *roughness, "from 0 to .9")?;
            Box::new(Blob::<D>::new(0.24, *roughness, *seed))
        }
        ShapeCommand::Letter { letter, .. } => {
            draw_letter(*letter).ok_or_else(|| flat_only("letters"))?
        }
        // The caller has handled families.
        ShapeCommand::Family { .. } => return Err(flat_only("families")),
    })
}

fn checked(allowed: bool, option: &'static str, value: f64, remedy: &str) -> Result<(), CliError> {
    if allowed {
        return Ok(());
    }
    Err(CliError::Option {
        option,
        value: shown(value),
        remedy: remedy.into(),
    })
}

fn write_shape<const D: usize>(
    path: &Path,
    draw: impl FnOnce() -> Result<ScalarField<f64, D>, CliError>,
) -> Result<(), CliError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let mut bytes = Vec::new();
    match extension.as_deref() {
        Some("npy") => {
            field_to(&mut bytes, &draw()?, Precision::Double).map_err(OutputError::at(path))?;
        }
        Some("png") if D == 2 => bytes = png(path, &draw()?)?,
        _ => return Err(OutputError::Format { path: path.into() }.into()),
    }
    Ok(write_new_file(path, &bytes)?)
}

/// An 8-bit grey picture, row 0 at the top being `y = 0`.
fn png<const D: usize>(path: &Path, field: &ScalarField<f64, D>) -> Result<Vec<u8>, OutputError> {
    let nodes = field.grid().nodes_per_axis();
    let grey = field.as_slice().iter().map(|v| (255.0 * v).round() as u8);
    let grey: Vec<u8> = grey.collect();
    let colour = (ColorType::Grayscale, BitDepth::Eight);
    encode([nodes[0], nodes[1]], colour, &grey).map_err(OutputError::at(path))
}
