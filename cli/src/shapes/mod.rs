//! From masks to boundaries, and from boundaries to signed distances on the grid: the first stage
//! of every command.
//!
//! `parts` splits label images, `align` aligns shapes with one of them, `domain` chooses the box of the
//! grid for them, `pairs` aligns them pairwise, `size` scales them to equal sizes, `units` refuses those that have
//! another unit of length, `label` assigns names for pictures, `record` states placements, and `surface` transforms
//! results back. Boundaries are extracted at the resolution of the masks and moved by the
//! alignment; the exact Euclidean distance to them is computed at the nodes.

mod align;
mod coordinates;
mod domain;
mod file_index;
mod inspect;
mod label;
mod pairs;
mod parts;
mod pose;
mod record;
mod size;
mod surface;
mod units;
mod world;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fe_grid::communicator::Communicator;
use fe_grid::{Distribution, Grid, ScalarField, parallel};
use levelset::{Cause, Contour, ContourDistance, Doubt, Moments, RigidMotion, signed_distance};

use crate::doubts::{in_words, named};
use crate::error::CliError;
use crate::grid::longest;
use crate::options::{Align, Frame, MaskOptions, Nodes, Size};
use crate::progress::Progress;
use align::{Alignment, align, inspect_unaligned};
use shapespace_input::frame::{FrameRule, FrameTransform};
use shapespace_input::place::{are_near, centred_frames, fit_frames, kept_frames, physical_frames};
use shapespace_input::{Image, LEVEL, boundary};
use size::equalise;
use units::check_units;

pub(crate) use coordinates::{Coordinates, in_space};
pub(crate) use domain::{Domain, moved};
pub(crate) use file_index::FileIndex;
pub(crate) use inspect::{
    Likeness, add_topologies, doubts_of, inspect_mask, inspect_resolution, inspect_thinness,
};
use inspect::{doubts_of_resolution, sample_distance, unresolved};
pub(crate) use label::{file_names, labels, stem, with_folder};
pub(crate) use pairs::{Pairs, refined};
pub(crate) use parts::{Components, VisibilityMask, belongs, read_view, view_of};
pub(crate) use record::{
    BoundaryRecord, InputRecord, SizeRecord, SurfaceRecord, common_scale, describe_placement,
    records_of,
};
pub(crate) use surface::ResultPlace;
pub(crate) use world::{WorldFrame, WorldRecord};

/// Masks that are read and placed in the unit box, before the grid is known.
#[derive(Clone, Debug)]
pub(crate) struct Placed<const D: usize> {
    /// The masks.
    pub images: Vec<Image<D>>,
    /// Placement of each mask in the unit box.
    pub frames: Vec<FrameTransform<D>>,
    /// The box of the grid.
    pub domain: Domain<D>,
    /// The factors by which the masks were scaled to equal sizes; one each unless requested.
    pub size_factors: Vec<f64>,
    /// Their alignment.
    pub align: Align,
    /// Number of the one in whose world the results lie.
    pub like: usize,
}

impl<const D: usize> Placed<D> {
    /// Places masks, and resolves the options.
    ///
    /// # Errors
    /// [`CliError::Option`] for a grid that does not exist, and for a mask in another unit of length than the others.
    pub fn new(images: Vec<Image<D>>, options: &mut MaskOptions) -> Result<Self, CliError> {
        Self::by_default(images, options, None)
    }

    /// The same with the alignment of a command where the options state none; without, it depends on the masks.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn by_default(
        images: Vec<Image<D>>,
        options: &mut MaskOptions,
        default: Option<Align>,
    ) -> Result<Self, CliError> {
        let domain = Domain::new(options)?;
        if let Domain::Cube(nodes) | Domain::Fit(nodes) = domain {
            options.grid = Some(Nodes::Cube(nodes));
        }
        let nodal = domain.nodal();
        let (mut images, frame) = oriented(images, options)?;
        if frame != Frame::None && options.size == Size::Kept {
            check_units(&images)?;
        }
        let is_stated = options.align.is_some() || options.frame == Some(Frame::None);
        let size_factors = match options.size {
            Size::Kept => vec![1.0; images.len()],
            Size::Equal => equalise(&mut images),
        };
        let near = frame != Frame::Physical || are_near(&images);
        let align = *options.align.get_or_insert_with(|| {
            let common = || have_common_coordinates(&images, nodal);
            default.unwrap_or_else(|| {
                if options.size == Size::Kept && near && common() {
                    Align::None
                } else {
                    Align::Rigid
                }
            })
        });
        // Shapes of equal size have no positions.
        let keeps = is_stated && align == Align::None && options.size == Size::Kept;
        let frames = match frame {
            // Shapes that are aligned anyway need no room for their distances.
            Frame::Physical if near || align == Align::None => physical_frames(&images),
            Frame::Physical | Frame::Centred => centred_frames(&images),
            Frame::None if keeps => kept_frames(&images, nodal.as_ref()),
            Frame::None => fit_frames(&images, nodal.as_ref()),
        };
        let is_centred = |frame: &FrameTransform<D>| frame.rule() == FrameRule::Centred;
        // The options are those of this result: without positions, which these masks have not kept.
        let loses = !is_stated && align == Align::None && frames.iter().all(is_centred);
        options.frame = Some(if loses { Frame::Centred } else { frame });
        Ok(Self {
            frames,
            images,
            domain,
            size_factors,
            align,
            like: 0,
        })
    }
}

impl<const D: usize> Placed<D> {
    /// Takes the results to the world of the input that `--like` names.
    ///
    /// # Errors
    /// [`CliError::Option`] for any other name, and for an input without a place in the world.
    pub fn lead(&mut self, paths: &[PathBuf], like: Option<&Path>) -> Result<(), CliError> {
        self.like = input_like(paths, like)?;
        let in_world = |frame: &FrameTransform<D>| frame.in_world();
        match like {
            Some(like) if !self.frames.get(self.like).is_some_and(in_world) => {
                Err(placeless_like(like))
            }
            _ => Ok(()),
        }
    }
}

/// The error for `--like` where there is no world for the results.
pub(crate) fn placeless_like(like: &Path) -> CliError {
    CliError::Option {
        option: "--like",
        value: format!("'{}'", like.display()),
        remedy: "leave it out: no place of the inputs in the world is known, or used".into(),
    }
}

/// The number of the input that `--like` names, by its path or its file name; the first without.
///
/// # Errors
/// [`CliError::Option`] for any other name.
pub(crate) fn input_like(paths: &[PathBuf], like: Option<&Path>) -> Result<usize, CliError> {
    let Some(like) = like else {
        return Ok(0);
    };
    let same = |path: &PathBuf| path.ends_with(like);
    paths.iter().position(same).ok_or_else(|| CliError::Option {
        option: "--like",
        value: format!("'{}'", like.display()),
        remedy: "name one of the inputs, in whose coordinates the results are to lie".into(),
    })
}

/// The images in the world, as far as their files state their place there and the options ask for
/// it, with the resolved option.
///
/// # Errors
/// [`CliError::Option`] if an image has no place in the world, or is to be scaled, and positions
/// there are asked for.
pub(crate) fn oriented<const D: usize>(
    images: Vec<Image<D>>,
    options: &MaskOptions,
) -> Result<(Vec<Image<D>>, Frame), CliError> {
    if options.frame == Some(Frame::None) {
        return Ok((images, Frame::None));
    }
    let placed: Vec<Option<Image<D>>> = images.iter().map(Image::in_world).collect();
    let refused = |remedy: String| CliError::Option {
        option: "--frame",
        value: "physical".into(),
        remedy,
    };
    let lost = placed.iter().position(Option::is_none);
    let frame = match (options.frame, lost) {
        (Some(Frame::Physical), Some(lost)) => {
            return Err(refused(format!(
                "'{}' does not state its place in the world; use --frame centred, or none",
                images[lost].path.display()
            )));
        }
        (Some(Frame::Physical), None) if options.size == Size::Equal => {
            return Err(refused(
                "shapes of equal size have no positions in the world; use --frame centred".into(),
            ));
        }
        (Some(frame), _) => frame,
        (None, None) if options.size == Size::Kept => Frame::Physical,
        (None, _) if placed.iter().any(Option::is_some) => Frame::Centred,
        (None, _) => Frame::None,
    };
    if frame == Frame::None {
        return Ok((images, frame));
    }
    let images = images.into_iter().zip(placed);
    let images = images.map(|(image, placed)| placed.unwrap_or(image));
    Ok((images.collect(), frame))
}

/// Whether the positions of objects in masks can be compared: all masks are arrays of the same
/// number of nodes, 2^L + 1 along every axis or those of the grid, or all have the same axes and a common corner
/// in the world, in whatever order their samples are stored.
fn have_common_coordinates<const D: usize>(images: &[Image<D>], grid: Option<Grid<D>>) -> bool {
    let Some(first) = images.first() else {
        return true;
    };
    let dyadic = |n: usize| n == first.size[0] && (n - 1).is_power_of_two();
    let of_grid = |size: [usize; D]| grid.is_some_and(|grid| grid.nodes_per_axis() == size);
    let nodal = |image: &Image<D>| {
        image.plain_array && (image.size.iter().all(|&n| dyadic(n)) || of_grid(image.size))
    };
    images.iter().all(nodal)
        || first.affine.is_some() && images.iter().all(|image| image.has_axes_of(first))
}

/// A mask in the form used by computations.
pub(crate) struct Input<const D: usize> {
    pub path: PathBuf,
    /// Label in pictures.
    pub name: String,
    /// Samples along each axis, `x` first.
    pub size: [usize; D],
    pub affine: Option<[[f64; 4]; 3]>,
    /// From samples to the box.
    pub frame: FrameTransform<D>,
    /// Factor by which the mask was scaled before, to equal sizes.
    pub size_factor: f64,
    /// Alignment after that.
    pub alignment: Option<Alignment<D>>,
    /// The boundary in the box, after alignment.
    pub contour: Contour<D>,
    /// The object's area or volume in the unit box.
    pub volume: f64,
    /// Whether results lie in its world.
    pub leads: bool,
    /// Doubts about it.
    pub doubts: Vec<Doubt>,
}

impl<const D: usize> Input<D> {
    /// Length in the box of one length unit of the file.
    pub fn scale(&self) -> f64 {
        self.size_factor * self.frame.scale()
    }

    /// Whether its samples are values at the nodes of a grid.
    fn is_nodal(&self) -> bool {
        self.frame.rule() == FrameRule::AsIs && self.alignment.is_none()
    }
}

/// Shapes in their places on the grid.
pub(crate) struct Settled<const D: usize> {
    images: Vec<Image<D>>,
    pub inputs: Vec<Input<D>>,
    pub grid: Grid<D>,
}

/// The inputs and their signed distances on the grid. Visibility masks, none or one per shape, only
/// influence the alignment.
///
/// # Errors
/// [`CliError`] with exit code 2 for a shape that contains no node of the grid.
pub(crate) fn prepare<const D: usize>(
    placed: Placed<D>,
    views: &[Option<VisibilityMask<D>>],
    progress: &Progress,
    processes: &Arc<dyn Communicator>,
) -> Result<(Vec<Input<D>>, Vec<ScalarField<f64, D>>), CliError> {
    settle(placed, views, None, progress, processes)?.measure(progress, processes)
}

/// Aligns shapes, label images by all their components, and chooses the grid.
///
/// # Errors
/// [`CliError`] with exit code 2 for shapes without a boundary, and for a grid that does not exist.
pub(crate) fn settle<const D: usize>(
    placed: Placed<D>,
    views: &[Option<VisibilityMask<D>>],
    components: Option<&Components<D>>,
    progress: &Progress,
    processes: &Arc<dyn Communicator>,
) -> Result<Settled<D>, CliError> {
    let distribution = Distribution::over(Arc::clone(processes), placed.images.len());
    let Placed {
        images,
        frames,
        domain,
        size_factors,
        align: alignment,
        like,
    } = placed;
    progress.stage("finding boundaries");
    let paths: Vec<_> = images.iter().map(|image| image.path.as_path()).collect();
    let named = images.iter().zip(&frames).zip(labels(&paths));
    let mut inputs =
        parallel::try_map(named, &|((image, frame), name)| input(image, *frame, name))?;
    for (i, (input, factor)) in inputs.iter_mut().zip(size_factors).enumerate() {
        input.size_factor = factor;
        input.leads = i == like;
        let partly = views.get(i).is_some_and(Option::is_some);
        input.doubts = inspect_mask(&images[i], partly);
        if let Some(remark) = &images[i].remark {
            progress.note(format!("'{}': {remark}", images[i].path.display()));
        }
    }
    if alignment == Align::Rigid {
        progress.stage(format!("aligning {} shapes", inputs.len()));
        align(&mut inputs, views, components, &distribution)?;
    } else if views.iter().all(Option::is_none) {
        progress.stage("looking for reflected shapes");
        inspect_unaligned(&mut inputs, &distribution)?;
    }
    let grid = domain.settle(&mut inputs)?;
    if let Some(advice) = domain.advice(&inputs) {
        progress.note(advice);
    }
    Ok(Settled {
        images,
        inputs,
        grid,
    })
}

impl<const D: usize> Settled<D> {
    /// The inputs and their signed distances at the nodes.
    ///
    /// # Errors
    /// As [`prepare`].
    pub fn measure(
        self,
        progress: &Progress,
        processes: &Arc<dyn Communicator>,
    ) -> Result<(Vec<Input<D>>, Vec<ScalarField<f64, D>>), CliError> {
        let (images, mut inputs, grid) = (self.images, self.inputs, self.grid);
        progress.stage("measuring distances");
        let distribution = Distribution::over(Arc::clone(processes), inputs.len());
        let own = parallel::try_map(distribution.own(), &|i| {
            let distance = distance(&images[i], &inputs[i], &inputs[i].contour, grid)?;
            Ok::<_, CliError>(distance.into_vec())
        })?;
        let all = distribution.share_vectors(own, grid.n_nodes()).into_iter();
        let distances: Result<Vec<_>, _> = all.map(|d| ScalarField::from_vec(grid, d)).collect();
        let distances = distances?;
        let found = parallel::map(distribution.own(), &|i| {
            let [parts, gaps] = unresolved(&distances[i], &inputs[i].contour);
            let samples = sample_distance(&images[i], inputs[i].scale()) / grid.spacing();
            [parts, gaps, samples]
        });
        let found = distribution.share(&found).into_iter();
        for (input, [parts, gaps, samples]) in inputs.iter_mut().zip(found) {
            input.doubts.extend(doubts_of_resolution([parts, gaps]));
            let coarse = Doubt::check(Cause::CoarseSamples, samples);
            input.doubts.extend(coarse);
        }
        // Before anything is computed: who reads them need not wait for a doubtful result.
        let names = inputs.iter().map(|input| input.name.as_str());
        for line in in_words(&named(&doubts_of(&inputs), names)) {
            progress.note(line);
        }
        Ok((inputs, distances))
    }
}

fn input<const D: usize>(
    image: &Image<D>,
    frame: FrameTransform<D>,
    name: String,
) -> Result<Input<D>, CliError> {
    let failed = |source| CliError::Shape {
        path: image.path.clone(),
        source,
    };
    let contour = boundary(image, &frame).map_err(failed)?;
    let volume = Moments::of_contour(&contour).map_err(failed)?.volume;
    Ok(Input {
        path: image.path.clone(),
        name,
        size: image.size,
        affine: image.affine,
        frame,
        size_factor: 1.0,
        alignment: None,
        contour,
        volume,
        leads: false,
        doubts: Vec::new(),
    })
}

/// The boundary of another mask of an input, of the same samples, in the placement of the input.
fn placed<const D: usize>(mask: &Image<D>, input: &Input<D>) -> Result<Contour<D>, CliError> {
    placed_by(mask, &input.frame, input)
}

/// The boundary of another mask of an input by a frame of its own, aligned as the input.
fn placed_by<const D: usize>(
    mask: &Image<D>,
    frame: &FrameTransform<D>,
    input: &Input<D>,
) -> Result<Contour<D>, CliError> {
    let drawn = boundary(mask, frame).map_err(|source| CliError::Shape {
        path: mask.path.clone(),
        source,
    })?;
    Ok(match &input.alignment {
        Some(alignment) => alignment.motion.apply_to_contour(&drawn),
        None => drawn,
    })
}

/// The area or volume of a mask that is placed by a frame.
///
/// # Errors
/// [`CliError::Shape`] for one without a boundary.
pub(crate) fn volume_of<const D: usize>(
    image: &Image<D>,
    frame: &FrameTransform<D>,
) -> Result<f64, CliError> {
    Ok(input(image, *frame, String::new())?.volume)
}

/// The boundary of a mask in the placement of another one, with its signed distance on the grid.
///
/// # Errors
/// As [`prepare`].
pub(crate) fn place_like<const D: usize>(
    image: &Image<D>,
    frame: FrameTransform<D>,
    motion: Option<RigidMotion<D>>,
    grid: Grid<D>,
) -> Result<(Contour<D>, ScalarField<f64, D>), CliError> {
    let mut placed = input(image, frame, String::new())?;
    if let Some(motion) = motion {
        placed.contour = motion.apply_to_contour(&placed.contour);
    }
    let distance = if placed.is_nodal() && motion.is_none() {
        distance(image, &placed, &placed.contour, grid)?
    } else {
        sampled(image, &placed.contour, grid)?
    };
    Ok((placed.contour, distance))
}

/// The signed distance to a shape at the nodes. Nodal values that have not been moved are
/// used as they are, and are extended beyond the faces of their box.
fn distance<const D: usize>(
    image: &Image<D>,
    input: &Input<D>,
    contour: &Contour<D>,
    grid: Grid<D>,
) -> Result<ScalarField<f64, D>, CliError> {
    if !input.is_nodal() {
        return sampled(image, contour, grid);
    }
    let failed = |source| CliError::Shape {
        path: image.path.clone(),
        source,
    };
    let of_samples = Grid::with_nodes(image.size, input.frame.scale());
    let nodal = of_samples.and_then(|own| ScalarField::from_vec(own, image.values.to_vec()));
    let nodal = nodal.map_err(|error| failed(error.into()))?;
    let whole = signed_distance(&nodal, LEVEL).map_err(failed)?;
    if *whole.grid() == grid {
        return on_the_grid(&image.path, whole);
    }
    match domain::middle_part(&whole, grid) {
        Some(part) => on_the_grid(&image.path, part),
        None => sampled(image, contour, grid),
    }
}

/// The signed distance to a boundary at the nodes.
fn sampled<const D: usize>(
    image: &Image<D>,
    contour: &Contour<D>,
    grid: Grid<D>,
) -> Result<ScalarField<f64, D>, CliError> {
    let distance = ContourDistance::new(contour).map_err(|source| CliError::Shape {
        path: image.path.clone(),
        source,
    })?;
    on_the_grid(&image.path, distance.sample(grid))
}

/// A distance with at least one node inside its shape.
fn on_the_grid<const D: usize>(
    path: &Path,
    distance: ScalarField<f64, D>,
) -> Result<ScalarField<f64, D>, CliError> {
    if distance.as_slice().iter().any(|&u| u > 0.0) {
        return Ok(distance);
    }
    Err(CliError::LostOnGrid {
        path: path.into(),
        nodes: longest(distance.grid()),
    })
}
