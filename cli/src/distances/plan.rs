//! From the options to a checked plan.

use serde::Serialize;

use super::args::{DistancesArgs, Linkage, Size};
use super::classes::Classes;
use crate::error::CliError;
use crate::geodesic::{self, Form, PathArgs};
use crate::input::{AnyImages, Image, LEVEL, ReadOptions, read_images};
use crate::options::{Align, CommonArgs};
use crate::output::ResultDir;
use crate::shapes::Placed;

/// What every path depends on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Work {
    /// Parameters of a path.
    #[serde(flatten)]
    pub path: geodesic::Parameters,
    /// Those of its second attempt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retry: Option<geodesic::Parameters>,
    /// Overlap with the end shape from which on a path counts, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached: Option<f64>,
    /// Whether there are paths of half as many steps, too.
    pub richardson: bool,
    /// Whether sizes count.
    pub size: Size,
}

/// All parameters, with nothing left to choose but the number of clusters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// Those of the paths.
    #[serde(flatten)]
    pub work: Work,
    /// Whether paths are computed in one direction only.
    pub one_way: bool,
    /// What the distance of two clusters is.
    pub linkage: Linkage,
}

/// Inputs that are read, placed and checked, and what is to be done with them.
pub(super) struct DistancesPlan<const D: usize> {
    /// The masks in the unit box.
    pub placed: Placed<D>,
    /// Whether each pair is aligned.
    pub align: Align,
    pub classes: Option<Classes>,
    pub parameters: Parameters,
}

/// A plan of either dimension.
pub(super) enum AnyPlan {
    D2(DistancesPlan<2>),
    D3(DistancesPlan<3>),
}

/// Reads, places and checks everything that distances need.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub(super) fn plan_distances(args: &DistancesArgs) -> Result<AnyPlan, CliError> {
    ResultDir::check(&args.common.output)?;
    check(args)?;
    let options = ReadOptions {
        label: args.common.label,
    };
    match read_images(&args.inputs, &options)? {
        AnyImages::D2(images) => plan_images(images, args).map(AnyPlan::D2),
        AnyImages::D3(images) => plan_images(images, args).map(AnyPlan::D3),
    }
}

/// What can be told before anything is read.
fn check(args: &DistancesArgs) -> Result<(), CliError> {
    if args.inputs.len() < 2 {
        return Err(CliError::TooFewInputs {
            command: "distances",
            needed: 2,
            found: args.inputs.len(),
        });
    }
    if args.retry != Some(Form::LevelSets) {
        args.path.check()?;
    }
    if args.retry == Some(args.path.form) {
        return Err(CliError::Option {
            option: "--retry",
            value: "with the same --form".into(),
            remedy: "name the other form, or leave it out".into(),
        });
    }
    if args.richardson && !args.path.steps.is_multiple_of(2) {
        return Err(CliError::Option {
            option: "--richardson",
            value: format!("with {} steps", args.path.steps),
            remedy: "choose an even number of steps (-K): paths of half as many are computed, too"
                .into(),
        });
    }
    let most = args.inputs.len();
    match args.clusters {
        Some(clusters) if clusters as usize > most => Err(CliError::Option {
            option: "--clusters",
            value: clusters.to_string(),
            remedy: format!("there are {most} shapes, which make no more clusters"),
        }),
        _ => Ok(()),
    }
}

fn plan_images<const D: usize>(
    mut images: Vec<Image<D>>,
    args: &DistancesArgs,
) -> Result<DistancesPlan<D>, CliError> {
    if args.size == Size::Equal {
        equalise(&mut images);
    }
    // Pairs are aligned one by one, not all shapes to one.
    let common = CommonArgs {
        align: Align::None,
        ..args.common.clone()
    };
    let classes = args.classes.as_deref();
    Ok(DistancesPlan {
        placed: Placed::new(images, &common)?,
        align: args.common.align,
        classes: classes
            .map(|option| Classes::of(option, &args.inputs))
            .transpose()?,
        parameters: parameters::<D>(args)?,
    })
}

/// Stretches the spacings of images so that the objects of all have the mean of their extents,
/// which are the roots of their areas or volumes.
fn equalise<const D: usize>(images: &mut [Image<D>]) {
    let extent = |image: &Image<D>| {
        let samples = image.values.iter().filter(|v| **v > LEVEL).count() as f64;
        let volume = samples * image.spacing.iter().product::<f64>();
        volume.powf(1.0 / D as f64)
    };
    let extents: Vec<f64> = images.iter().map(extent).collect();
    let mean = extents.iter().sum::<f64>() / extents.len().max(1) as f64;
    for (image, extent) in images.iter_mut().zip(extents) {
        let factor = mean / extent;
        image.spacing = image.spacing.map(|h| factor * h);
        image.origin = image.origin.map(|x| factor * x);
        // Neither nodal values nor the world of the file any more.
        image.plain_array = false;
        image.affine = None;
    }
}

fn parameters<const D: usize>(args: &DistancesArgs) -> Result<Parameters, CliError> {
    let of_form = |form| {
        let path = PathArgs {
            form,
            ..args.path.clone()
        };
        geodesic::Parameters::new::<D>(&args.common, &path)
    };
    Ok(Parameters {
        work: Work {
            path: of_form(args.path.form)?,
            retry: args.retry.map(of_form).transpose()?,
            reached: args.reached,
            richardson: args.richardson,
            size: args.size,
        },
        one_way: args.one_way,
        linkage: args.linkage,
    })
}

impl Work {
    /// Numbers of steps of the paths that make a distance, the one that counts first.
    pub fn steps(&self) -> Vec<usize> {
        let steps = self.path.steps;
        if self.richardson {
            vec![steps, steps / 2]
        } else {
            vec![steps]
        }
    }

    /// The parameters of all attempts, first to last.
    pub fn attempts(&self) -> impl Iterator<Item = &geodesic::Parameters> {
        std::iter::once(&self.path).chain(&self.retry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::place::{fit_frames, tests::block};

    #[test]
    fn equal_sizes_are_equal_in_the_box() {
        let mut images = [
            block([40, 40], [1.0; 2], [5, 5], [14, 14]),
            block([80, 30], [0.5, 2.0], [10, 10], [69, 14]),
        ];
        images[0].plain_array = true;
        equalise(&mut images);
        let frames = fit_frames(&images, 40);
        let areas = images.iter().zip(frames).map(|(image, frame)| {
            let samples = image.values.iter().filter(|v| **v > LEVEL).count() as f64;
            samples * frame.sample_size().iter().product::<f64>()
        });
        let areas: Vec<f64> = areas.collect();
        assert!((areas[0] / areas[1] - 1.0).abs() < 1e-12, "{areas:?}");
        assert!(!images[0].plain_array);
    }
}
