//! From masks to boundaries, and from boundaries to signed distances on the grid.
//!
//! The boundary of a mask is the contour of level 1/2 between its samples at their own
//! resolution, so that nothing is lost where samples are finer than the grid, and grey edges keep
//! their sub-sample position. It is carried into the unit box, moved where shapes are aligned,
//! and the exact Euclidean distance to it is taken at the nodes.

use std::path::PathBuf;

use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Contour, ContourDistance, contour, signed_distance};
use rayon::prelude::*;

use super::AveragePlan;
use super::label::labels;
use super::place::{Alignment, align};
use crate::args::Align;
use crate::error::CliError;
use crate::input::fit::{FrameRule, FrameTransform};
use crate::input::{Image, LEVEL};
use crate::progress::Progress;

/// A mask as the average sees it.
pub(super) struct Input<const D: usize> {
    pub path: PathBuf,
    /// Label in pictures.
    pub name: String,
    /// Samples along each axis, `x` first.
    pub size: [usize; D],
    pub affine: Option<[[f64; 4]; 3]>,
    /// From samples to the unit box.
    pub frame: FrameTransform<D>,
    /// What was done after that.
    pub alignment: Option<Alignment<D>>,
    /// The boundary in the unit box, after alignment.
    pub contour: Contour<D>,
    /// The object's area or volume in the unit box.
    pub volume: f64,
}

/// The inputs of a plan and their signed distances on its grid.
///
/// # Errors
/// [`CliError`] with exit code 2 for a shape that is lost on the grid.
pub(super) fn prepare<const D: usize>(
    plan: AveragePlan<D>,
    progress: &Progress,
) -> Result<(Vec<Input<D>>, Vec<ScalarField<f64, D>>), CliError> {
    let AveragePlan {
        images,
        frames,
        grid,
        parameters,
    } = plan;
    progress.stage("finding boundaries");
    let paths: Vec<_> = images.iter().map(|image| image.path.as_path()).collect();
    let inputs: Result<Vec<_>, CliError> = images
        .par_iter()
        .zip(&frames)
        .zip(labels(&paths))
        .map(|((image, frame), name)| input(image, *frame, name))
        .collect();
    let mut inputs = inputs?;
    if parameters.align == Align::Rigid {
        progress.stage(format!("aligning {} shapes", inputs.len()));
        align(&mut inputs)?;
    }
    progress.stage("measuring distances");
    let distances: Result<Vec<_>, CliError> = images
        .iter()
        .zip(&inputs)
        .map(|(image, input)| distance(image, input, grid))
        .collect();
    Ok((inputs, distances?))
}

fn input<const D: usize>(
    image: &Image<D>,
    frame: FrameTransform<D>,
    name: String,
) -> Result<Input<D>, CliError> {
    let contour = boundary(image, &frame)?;
    let volume = levelset::Moments::of_contour(&contour)
        .map_err(|source| CliError::Shape {
            path: image.path.clone(),
            source,
        })?
        .volume;
    Ok(Input {
        path: image.path.clone(),
        name,
        size: image.size,
        affine: image.affine,
        frame,
        alignment: None,
        contour,
        volume,
    })
}

/// The boundary of a mask in the unit box. Beyond its samples an image is background.
///
/// # Errors
/// [`CliError::Shape`], which masks that were read do not bring about.
pub(super) fn boundary<const D: usize>(
    image: &Image<D>,
    frame: &FrameTransform<D>,
) -> Result<Contour<D>, CliError> {
    let failed = |source| CliError::Shape {
        path: image.path.clone(),
        source,
    };
    let bounds = image
        .object_bounds()
        .ok_or_else(|| failed(levelset::LevelsetError::EmptyObject { level: LEVEL }))?;
    // One sample around the object is all that its boundary depends on.
    let window = Grid::with_nodes(bounds.map(|[low, high]| high - low + 3), 1.0)
        .expect("three nodes or more along every axis, spacing 1");
    let mut field = ScalarField::zeros(window);
    for (index, value) in field.as_mut_slice().iter_mut().enumerate() {
        let node = window.node(index);
        let inside = (0..D).all(|k| {
            let sample = node[k] + bounds[k][0];
            (1..=image.size[k]).contains(&sample)
        });
        if inside {
            let sample = std::array::from_fn(|k| node[k] + bounds[k][0] - 1);
            *value = image.values[image.index(sample)];
        }
    }
    let drawn = contour(&field, LEVEL, BoxEdge::Closed).map_err(failed)?;
    Ok(drawn.map(|p| frame.to_unit(std::array::from_fn(|k| p[k] + bounds[k][0] as f64 - 1.0))))
}

/// The signed distance to a shape at the nodes. Nodal values that have not been moved speak for
/// themselves; at the faces of the box they go on unseen.
fn distance<const D: usize>(
    image: &Image<D>,
    input: &Input<D>,
    grid: Grid<D>,
) -> Result<ScalarField<f64, D>, CliError> {
    let failed = |source| CliError::Shape {
        path: image.path.clone(),
        source,
    };
    let distance = if input.frame.rule() == FrameRule::AsIs && input.alignment.is_none() {
        let nodal = ScalarField::from_vec(grid, image.values.clone())
            .expect("as many samples as nodes, by the rule");
        signed_distance(&nodal, LEVEL).map_err(failed)?
    } else {
        ContourDistance::new(&input.contour)
            .map_err(failed)?
            .sample(grid)
    };
    if distance.as_slice().iter().any(|&u| u > 0.0) {
        return Ok(distance);
    }
    Err(CliError::LostOnGrid {
        path: image.path.clone(),
        nodes: grid.nodes_per_axis()[0],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::fit::fit_frames;
    use approx::assert_relative_eq;

    fn image<const D: usize>(
        size: [usize; D],
        spacing: [f64; D],
        inside: impl Fn([usize; D]) -> f64,
    ) -> Image<D> {
        let mut image = Image {
            values: vec![0.0; size.iter().product()],
            size,
            spacing,
            origin: [0.0; D],
            path: "block.npy".into(),
            affine: None,
            plain_array: false,
        };
        for index in 0..image.values.len() {
            image.values[index] = inside(image.sample(index));
        }
        image
    }

    #[test]
    fn a_block_at_the_border_of_its_image_has_its_own_box() {
        // The object fills the image but for one row, and the image is two samples thick.
        let block = image([20, 10, 2], [1.0, 1.0, 3.0], |s| {
            f64::from(u8::from(s[0] > 0))
        });
        let frame = fit_frames(std::slice::from_ref(&block), 33)[0];
        let drawn = boundary(&block, &frame).unwrap();
        assert!(drawn.is_closed());
        let mut corners = [[f64::INFINITY; 2]; 3];
        for p in drawn.points() {
            for k in 0..3 {
                corners[k] = [corners[k][0].min(p[k]), corners[k][1].min(-p[k])];
            }
        }
        // 19 x 10 x 6 lengths, the longest side becoming .7.
        for (k, side) in [0.7, 0.7 * 10.0 / 19.0, 0.7 * 6.0 / 19.0]
            .into_iter()
            .enumerate()
        {
            assert_relative_eq!(corners[k][0], 0.5 - 0.5 * side, epsilon = 1e-12);
            assert_relative_eq!(-corners[k][1], 0.5 + 0.5 * side, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_grey_disk_keeps_its_area() {
        let disk = image([64, 64], [0.5, 0.5], |s| {
            let r = (s[0] as f64 - 30.2).hypot(s[1] as f64 - 33.1);
            (20.3 - r + 0.5).clamp(0.0, 1.0)
        });
        let frame = fit_frames(std::slice::from_ref(&disk), 129)[0];
        let found = input(&disk, frame, String::new()).unwrap();
        let radius = 20.3 * 0.5 * frame.scale();
        // The polygon's chords of one sample: a share of 1/(8 r^2) = 3e-4 less, at most twice.
        let share = found.volume / (std::f64::consts::PI * radius * radius);
        assert!((share - 1.0).abs() < 6e-4, "{share}");
    }
}
