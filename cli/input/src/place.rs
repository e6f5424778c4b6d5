//! Placing images in the unit box.
//!
//! Images whose files state their place in the world are placed by it: all by one transform from the
//! world to the box ([`physical_frames`], [`FrameRule::Physical`]), or, where their positions do not
//! matter, each object in the middle ([`centred_frames`], [`FrameRule::Centred`]).
//!
//! Three rules for other images, in this order:
//!
//! 1. Arrays (`.npy`) of exactly as many samples along each axis as the grid has nodes hold nodal
//!    values and are used without resampling ([`FrameRule::AsIs`]), if all images are such arrays.
//! 2. Images of one size and one spacing whose objects together take up little more room than
//!    the largest object alone (at most [`SHARED_ROOM`] times its longest side) keep their
//!    positions: one transform puts the common bounding box into the middle
//!    ([`FrameRule::Shared`]).
//! 3. Otherwise each object's bounding box is put into the middle ([`FrameRule::Centred`]).
//!
//! Images that are to keep their positions ([`kept_frames`]) are placed by rule 2 in place of rule 3, whatever their
//! sizes and their distances: sample 0 of all pictures is at one place, and samples are as far apart as their
//! spacings say; outlines lie where their coordinates say, in which sample 0 of a picture is the origin.
//!
//! Grey images, whose object is unknown, are placed as a whole ([`whole_frame`], [`whole_frames`],
//! [`FrameRule::Whole`]; in the world by [`crate::whole`]).
//!
//! Rules 2 and 3 use one scale for all images, so that relative sizes are kept: the longest side
//! of the largest bounding box becomes `1 - 2 MARGIN`. Aspect and voxel spacing are kept always.
//! The box of a sample reaches half a spacing to both sides.
//!
//! The unit box is where shapes are placed, and its side is the unit of length of all computations; the
//! grid covers it, or the part of it in its middle that the shapes need.

use fe_grid::{Grid, ScalarField};
use levelset::Contour;

use super::frame::{FrameRule, FrameTransform};
use super::{Image, LEVEL};

/// Objects are put into `[MARGIN, 1 - MARGIN]^D`.
pub const MARGIN: f64 = 0.15;
/// How much longer than the largest object the common bounding box may be for rule 2.
pub const SHARED_ROOM: f64 = 1.25;

/// Cells along the longest side to which grids of whole images can be coarsened, in 2D and 3D.
const COARSEST_CELLS: [usize; 2] = [16, 8];

/// The number of cells by which the numbers of cells along all sides of a grid are to be divisible: the
/// power of two that leaves from `coarsest` to less than twice as many along a longest side of `cells`,
/// or one where it has fewer.
pub fn divisor(cells: usize, coarsest: usize) -> usize {
    1 << (cells / coarsest.max(1)).max(1).ilog2()
}

/// Lower and upper corner of a box in the file's length units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds<const D: usize> {
    low: [f64; D],
    high: [f64; D],
}

impl<const D: usize> Bounds<D> {
    /// The box of an image's object; that of the whole image where there is no object.
    fn of_object(image: &Image<D>) -> Self {
        if let Some(outline) = &image.outline {
            return Self::of_points(image, outline);
        }
        if let Some(directions) = &image.direction {
            return Self::of_turned(image, directions);
        }
        let samples = image
            .object_bounds()
            .unwrap_or_else(|| image.size.map(|n| [0, n - 1]));
        let edge = |k: usize, i: f64| image.origin[k] + i * image.spacing[k];
        Self {
            low: std::array::from_fn(|k| edge(k, samples[k][0] as f64 - 0.5)),
            high: std::array::from_fn(|k| edge(k, samples[k][1] as f64 + 0.5)),
        }
    }

    /// The box of an exact boundary.
    fn of_points(image: &Image<D>, outline: &Contour<D>) -> Self {
        let frame = FrameTransform::of_image(image, 1.0, [0.0; D], FrameRule::Whole);
        let corners = outline.simplices().iter().flatten();
        let points = corners.map(|&corner| frame.to_unit(outline.points()[corner as usize]));
        let boxes = points.map(|p| Self { low: p, high: p });
        // Outlines that were read have points.
        boxes.reduce(Self::union).unwrap_or(Self {
            low: image.origin,
            high: image.origin,
        })
    }

    /// The box around the boxes of an object's samples whose axes have these directions.
    fn of_turned(image: &Image<D>, directions: &[[f64; D]; D]) -> Self {
        let step = |i: usize, k: usize| directions[i][k] * image.spacing[k];
        let reach: [f64; D] =
            std::array::from_fn(|i| 0.5 * (0..D).map(|k| step(i, k).abs()).sum::<f64>());
        let within = |level: f64| {
            let samples = image.values.iter().enumerate();
            samples
                .filter(move |(_, value)| *value > level)
                .map(|(index, _)| {
                    let sample = image.sample(index);
                    let centre: [f64; D] = std::array::from_fn(|i| {
                        image.origin[i] + (0..D).map(|k| step(i, k) * sample[k] as f64).sum::<f64>()
                    });
                    Self {
                        low: std::array::from_fn(|i| centre[i] - reach[i]),
                        high: std::array::from_fn(|i| centre[i] + reach[i]),
                    }
                })
                .reduce(Self::union)
        };
        let whole = within(LEVEL).or_else(|| within(f64::NEG_INFINITY));
        // Images that were read have samples.
        whole.unwrap_or(Self {
            low: image.origin,
            high: image.origin,
        })
    }

    fn union(self, other: Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    fn longest(&self) -> f64 {
        (0..D).fold(0.0, |side, k| f64::max(side, self.high[k] - self.low[k]))
    }

    fn centre(&self) -> [f64; D] {
        std::array::from_fn(|k| 0.5 * (self.low[k] + self.high[k]))
    }
}

/// The transforms that place images by their positions in the world, which all of them have: one
/// transform from the world to the unit box, which puts the common bounding box of all objects into
/// the middle.
pub fn physical_frames<const D: usize>(images: &[Image<D>]) -> Vec<FrameTransform<D>> {
    common_frames(images, FrameRule::Physical)
}

/// One transform from the coordinates of all images to the unit box, which puts the common bounding box of all
/// objects into the middle.
fn common_frames<const D: usize>(images: &[Image<D>], rule: FrameRule) -> Vec<FrameTransform<D>> {
    let boxes: Vec<Bounds<D>> = images.iter().map(Bounds::of_object).collect();
    let Some(common) = boxes.into_iter().reduce(Bounds::union) else {
        return Vec::new();
    };
    let scale = (1.0 - 2.0 * MARGIN) / common.longest();
    let frame = |image| FrameTransform::around(image, scale, common.centre(), rule);
    images.iter().map(frame).collect()
}

/// The transforms that put the bounding box of each object into the middle, with one scale.
pub fn centred_frames<const D: usize>(images: &[Image<D>]) -> Vec<FrameTransform<D>> {
    let boxes: Vec<Bounds<D>> = images.iter().map(Bounds::of_object).collect();
    let scale = (1.0 - 2.0 * MARGIN) / longest(&boxes);
    let images = images.iter().zip(&boxes);
    images
        .map(|(image, own)| FrameTransform::around(image, scale, own.centre(), FrameRule::Centred))
        .collect()
}

/// Whether objects take up little more room together than the largest alone; see [`SHARED_ROOM`].
pub fn are_near<const D: usize>(images: &[Image<D>]) -> bool {
    let boxes: Vec<Bounds<D>> = images.iter().map(Bounds::of_object).collect();
    let common = boxes.iter().copied().reduce(Bounds::union);
    common.is_none_or(|common| common.longest() <= SHARED_ROOM * longest(&boxes))
}

/// The longest sides of the boxes of the objects of images, in the length units of the images.
pub fn extents<const D: usize>(images: &[Image<D>]) -> Vec<f64> {
    let sides = images
        .iter()
        .map(|image| Bounds::of_object(image).longest());
    sides.collect()
}

fn longest<const D: usize>(boxes: &[Bounds<D>]) -> f64 {
    let sides = boxes.iter().map(Bounds::longest);
    sides.fold(0.0, f64::max)
}

/// The transforms that place images in the unit box, wherever they lie in the world. If all are arrays of as many
/// samples as `grid` has nodes, where that is known, they hold nodal values. The sizes of such arrays and of other
/// images could not be compared.
pub fn fit_frames<const D: usize>(
    images: &[Image<D>],
    grid: Option<&Grid<D>>,
) -> Vec<FrameTransform<D>> {
    if let Some(frames) = nodal_frames(images, grid) {
        return frames;
    }
    let boxes: Vec<Bounds<D>> = images.iter().map(Bounds::of_object).collect();
    place(images, &boxes)
}

/// The transforms that keep the positions of images, wherever they lie in the world: one transform from the
/// coordinates of the samples to the unit box, which puts the common bounding box of all objects into the middle.
/// Arrays of as many samples as `grid` has nodes hold nodal values, as in [`fit_frames`].
pub fn kept_frames<const D: usize>(
    images: &[Image<D>],
    grid: Option<&Grid<D>>,
) -> Vec<FrameTransform<D>> {
    if let Some(frames) = nodal_frames(images, grid) {
        return frames;
    }
    common_frames(images, FrameRule::Shared)
}

/// The transforms of arrays, if all are of as many samples as a grid has nodes.
fn nodal_frames<const D: usize>(
    images: &[Image<D>],
    grid: Option<&Grid<D>>,
) -> Option<Vec<FrameTransform<D>>> {
    let nodal = |image: &Image<D>| grid.and_then(|grid| nodal_frame(image, grid));
    images.iter().map(nodal).collect()
}

/// The transform of an array of as many samples as a grid has nodes.
fn nodal_frame<const D: usize>(image: &Image<D>, grid: &Grid<D>) -> Option<FrameTransform<D>> {
    let fits = image.plain_array && image.size == grid.nodes_per_axis();
    fits.then(|| FrameTransform::nodal(grid))
}

/// A grid of this number of nodes along the longest side of an image, with the transform that places the
/// image in its middle: the first and the last sample along that side are nodes. The other sides of
/// the grid are as long as the image, and a little longer where that makes them divisible into
/// coarser grids.
///
/// # Errors
/// [`fe_grid::GridError`] for fewer than two nodes.
pub fn whole_frame<const D: usize>(
    image: &Image<D>,
    nodes: usize,
) -> Result<(FrameTransform<D>, Grid<D>), fe_grid::GridError> {
    let (longest, grid) = whole_grid(lengths(image), nodes)?;
    Ok((in_the_middle(image, longest, grid), grid))
}

/// The same for several images: a grid that contains each of them, with one scale and each image
/// centred.
///
/// # Errors
/// As [`whole_frame`].
pub fn whole_frames<const D: usize>(
    images: &[Image<D>],
    nodes: usize,
) -> Result<(Vec<FrameTransform<D>>, Grid<D>), fe_grid::GridError> {
    let mut room = [0.0; D];
    for image in images {
        let own = lengths(image);
        room = std::array::from_fn(|k| f64::max(room[k], own[k]));
    }
    let (longest, grid) = whole_grid(room, nodes)?;
    let frame = |image| in_the_middle(image, longest, grid);
    Ok((images.iter().map(frame).collect(), grid))
}

/// From the first to the last sample along each axis, in the units of the file.
fn lengths<const D: usize>(image: &Image<D>) -> [f64; D] {
    std::array::from_fn(|k| (image.size[k] - 1) as f64 * image.spacing[k])
}

/// The longest of the lengths, and a grid with this number of nodes along it that can be coarsened.
pub(crate) fn whole_grid<const D: usize>(
    lengths: [f64; D],
    nodes: usize,
) -> Result<(f64, Grid<D>), fe_grid::GridError> {
    let longest = lengths.iter().fold(0.0, |a: f64, b| a.max(*b));
    let cells = nodes - 1;
    let part = divisor(cells, COARSEST_CELLS[usize::from(D == 3)]);
    let sides = lengths.map(|length| {
        // A side that fits exactly is not extended by rounding.
        let needed = (length / longest * cells as f64 - 1e-6).max(1.0);
        (needed / part as f64).ceil() as usize * part + 1
    });
    Ok((longest, Grid::with_nodes(sides, 1.0 / cells as f64)?))
}

fn in_the_middle<const D: usize>(
    image: &Image<D>,
    longest: f64,
    grid: Grid<D>,
) -> FrameTransform<D> {
    let (own, extent) = (lengths(image), grid.extent());
    let offset =
        std::array::from_fn(|k| 0.5 * (extent[k] - own[k] / longest) - image.origin[k] / longest);
    FrameTransform::of_image(image, 1.0 / longest, offset, FrameRule::Whole)
}

/// The values of an image at the nodes of a grid: means over the boxes of one grid spacing around
/// them, along the axes of the grid, if the samples are finer than the grid, interpolated otherwise. Outside of the image the
/// values at its border are used.
///
/// # Errors
/// None in practice: images have two samples along every axis.
pub fn nodal_values<const D: usize>(
    image: &Image<D>,
    frame: &FrameTransform<D>,
    grid: Grid<D>,
) -> Result<ScalarField<f64, D>, fe_grid::GridError> {
    let lattice = Grid::with_nodes(image.size, 1.0)?;
    let samples = ScalarField::from_vec(lattice, image.values.to_vec())?;
    let h = grid.spacing();
    let first = frame.to_sample([0.0; D]);
    // Along no axis of samples are neighbouring pieces farther apart than two samples.
    let pieces: [usize; D] = std::array::from_fn(|i| {
        let end = frame.to_sample(std::array::from_fn(|k| f64::from(u8::from(k == i))));
        let samples = (0..D).fold(0.0, |most, k| f64::max(most, (end[k] - first[k]).abs()));
        (h * samples - 1e-6).ceil().max(1.0) as usize
    });
    let n_pieces: usize = pieces.iter().product();
    Ok(ScalarField::from_fn(grid, |node| {
        let sum: f64 = (0..n_pieces)
            .map(|mut piece| {
                let point = std::array::from_fn(|k| {
                    let i = piece % pieces[k];
                    piece /= pieces[k];
                    node[k] + h * ((i as f64 + 0.5) / pieces[k] as f64 - 0.5)
                });
                samples.sample(frame.to_sample(point))[0]
            })
            .sum();
        [sum / n_pieces as f64]
    }))
}

/// Placement in the unit box of an image that belongs to others on a grid in its middle: `frame` is
/// that of one of them, `size` its samples. In a shared frame an image of the same lattice keeps its position, and
/// one of another lattice unless it is `moved` later; so does in a physical frame any image that has a place in the
/// world. Any other has its object centred, with the scale of the others times `factor`.
pub fn frame_like<const D: usize>(
    image: &Image<D>,
    (size, frame): (&[usize], &FrameTransform<D>),
    grid: &Grid<D>,
    factor: f64,
    moved: bool,
) -> FrameTransform<D> {
    if let Some(nodal) = nodal_frame(image, grid) {
        return nodal;
    }
    if frame.rule() == FrameRule::AsIs && image.plain_array && image.size == size {
        // The grid is a part of that of the arrays.
        return *frame;
    }
    let physical = frame.rule() == FrameRule::Physical;
    if physical && image.direction.is_some() && factor == 1.0 && !moved {
        return frame.for_image(image);
    }
    let same_lattice = image.size == size && frame.has_lattice_of(image);
    if frame.rule() == FrameRule::Shared && factor == 1.0 {
        if same_lattice {
            return *frame;
        }
        // Coordinates of the world are others than those of samples.
        if !moved && image.direction.is_none() && !frame.in_world() {
            return frame.for_image(image);
        }
    }
    let own = Bounds::of_object(image);
    // Nodal values of the others have the scale of the box.
    let scale = factor
        * if frame.rule() == FrameRule::AsIs {
            (1.0 - 2.0 * MARGIN) / own.longest()
        } else {
            frame.scale()
        };
    FrameTransform::around(image, scale, own.centre(), FrameRule::Centred)
}

fn place<const D: usize>(images: &[Image<D>], boxes: &[Bounds<D>]) -> Vec<FrameTransform<D>> {
    let Some(common) = boxes.iter().copied().reduce(Bounds::union) else {
        return Vec::new();
    };
    let largest = longest(boxes);
    let same_lattice = images
        .iter()
        .all(|image| image.size == images[0].size && image.spacing == images[0].spacing);
    let shared = same_lattice && common.longest() <= SHARED_ROOM * largest;
    let (rule, room) = if shared {
        (FrameRule::Shared, common.longest())
    } else {
        (FrameRule::Centred, largest)
    };
    let scale = (1.0 - 2.0 * MARGIN) / room;
    images
        .iter()
        .zip(boxes)
        .map(|(image, own)| {
            let centre = if shared { common } else { *own }.centre();
            FrameTransform::around(image, scale, centre, rule)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    #[test]
    fn an_array_of_the_grid_size_stays_as_it_is() {
        let mut image = block([9, 9], [1.0; 2], [1, 1], [2, 8]);
        image.plain_array = true;
        let frame = fit_frames(std::slice::from_ref(&image), Some(&Grid::cube(9)))[0];
        assert_eq!(frame.rule(), FrameRule::AsIs);
        assert_eq!(frame.to_unit([8.0, 4.0]), [1.0, 0.5]);
        assert_eq!(
            fit_frames(&[image], Some(&Grid::cube(17)))[0].rule(),
            FrameRule::Shared
        );
    }

    /// A ball in an array of the grid's size and a tenth of it in a larger array: sizes are those in samples.
    #[test]
    fn arrays_of_different_sizes_have_one_scale() {
        let mut images = [
            block([17, 17], [1.0; 2], [2, 2], [13, 13]),
            block([33, 33], [1.0; 2], [15, 15], [17, 17]),
        ];
        for image in &mut images {
            image.plain_array = true;
        }
        let frames = fit_frames(&images, Some(&Grid::cube(17)));
        assert_eq!(frames[0].rule(), FrameRule::Centred);
        assert_eq!(frames[0].scale(), frames[1].scale());
    }

    #[test]
    fn a_whole_image_fills_a_grid_that_can_be_made_coarser() {
        let image = block([101, 61], [0.5; 2], [10, 10], [40, 30]);
        let (frame, grid) = whole_frame(&image, 65).unwrap();
        // 60 of 100 samples are 38.4 cells of 64; ten times four are enough.
        assert_eq!(grid.nodes_per_axis(), [65, 41]);
        assert_relative_eq!(frame.to_unit([0.0, 30.0])[0], 0.0, epsilon = 1e-14);
        assert_relative_eq!(frame.to_unit([100.0, 30.0])[0], 1.0, epsilon = 1e-14);
        assert_relative_eq!(
            frame.to_unit([3.0, 30.0])[1],
            0.5 * 40.0 / 64.0,
            epsilon = 1e-14
        );
        let nodal = nodal_values(&image, &frame, grid).unwrap();
        let mean = |values: &[f64]| values.iter().sum::<f64>();
        let share = 0.01 * 0.01 * mean(&image.values.to_vec());
        // The samples of an object inside the image stand for squares, nodal means keep their sum.
        assert_relative_eq!(
            mean(nodal.as_slice()) / 64.0f64.powi(2),
            share,
            epsilon = 5e-3
        );
        // An array of the grid's size is not resampled.
        let image = block([17, 9], [1.0; 2], [2, 3], [9, 5]);
        let (frame, grid) = whole_frame(&image, 17).unwrap();
        let nodal = nodal_values(&image, &frame, grid).unwrap();
        assert_eq!(image.values, nodal.as_slice());
    }

    #[test]
    fn whole_images_have_one_scale_and_one_middle() {
        let images = [
            block([41, 31], [1.0; 2], [5, 5], [24, 9]),
            block([17, 16], [2.0, 2.5], [2, 2], [9, 9]),
        ];
        let (frames, grid) = whole_frames(&images, 65).unwrap();
        // The longer of 40 and 32 along x, of 30 and 37.5 along y.
        assert_eq!(frames[0].scale(), 1.0 / 40.0);
        assert_eq!(frames[1].scale(), 1.0 / 40.0);
        let middle = grid.extent().map(|side| 0.5 * side);
        assert!(middle[1] >= 0.5 * 37.5 / 40.0);
        for (frame, image) in frames.iter().zip(&images) {
            let own = frame.to_unit(image.size.map(|n| 0.5 * (n - 1) as f64));
            for k in 0..2 {
                assert_relative_eq!(own[k], middle[k], epsilon = 1e-14);
            }
        }
        let (frame, alone) = whole_frame(&images[0], 65).unwrap();
        let (same, grid) = whole_frames(&images[..1], 65).unwrap();
        assert_eq!((frame, alone), (same[0], grid));
    }

    #[test]
    fn images_of_one_frame_keep_their_positions() {
        let images = [
            block([40, 30], [1.0; 2], [5, 5], [24, 9]),
            block([40, 30], [1.0; 2], [7, 6], [26, 10]),
        ];
        let frames = fit_frames(&images, None);
        assert_eq!(frames[0].rule(), FrameRule::Shared);
        assert_eq!(frames[0], frames[1]);
        // The common box is 22 samples wide, from edge 4.5 to edge 26.5.
        assert_relative_eq!(frames[0].to_unit([4.5, 7.5])[0], 0.15, epsilon = 1e-14);
        assert_relative_eq!(frames[0].to_unit([26.5, 7.5])[0], 0.85, epsilon = 1e-14);
    }

    /// Two disks are where their samples are, far from each other, in pictures of two sizes, and in an outline.
    #[test]
    fn images_that_keep_their_positions_have_one_origin() {
        let mut images = [
            block([40, 30], [1.0; 2], [2, 5], [5, 8]),
            block([60, 70], [1.0; 2], [52, 60], [55, 63]),
            block([20, 20], [0.5; 2], [10, 10], [13, 13]),
        ];
        images[2].origin = [30.0, 1.0];
        let frames = kept_frames(&images, None);
        // From edge 1.5 to edge 55.5, and from edge 4.5 to edge 63.5.
        let scale = 0.7 / 59.0;
        for (frame, image) in frames.iter().zip(&images) {
            assert_eq!(frame.rule(), FrameRule::Shared);
            for sample in [[0.0, 0.0], [3.0, 19.0]] {
                let unit = frame.to_unit(sample);
                for (k, middle) in [28.5, 34.0].into_iter().enumerate() {
                    let place = sample[k] * image.spacing[k] + image.origin[k];
                    let expected = 0.5 + scale * (place - middle);
                    assert_relative_eq!(unit[k], expected, epsilon = 1e-14);
                }
            }
        }
        // One more picture lies among them as if it had been there, unless an alignment moves it.
        let size = images[0].size;
        let like = |moved| {
            let others = (&size[..], &frames[0]);
            frame_like(&images[1], others, &Grid::cube(33), 1.0, moved)
        };
        assert_eq!(like(false), frames[1]);
        assert_eq!(like(true).rule(), FrameRule::Centred);
        // Where nothing is far from anything the frames are those of every other alignment.
        let near = [
            block([40, 30], [1.0; 2], [5, 5], [24, 9]),
            block([40, 30], [1.0; 2], [7, 6], [26, 10]),
        ];
        assert_eq!(kept_frames(&near, None), fit_frames(&near, None));
    }

    #[test]
    fn images_of_several_frames_share_one_scale() {
        let images = [
            block([40, 30, 20], [1.0, 1.0, 2.0], [5, 5, 5], [14, 9, 14]),
            block([50, 30, 20], [0.5; 3], [5, 5, 5], [24, 9, 9]),
        ];
        let frames = fit_frames(&images, None);
        assert_eq!(frames[0].rule(), FrameRule::Centred);
        assert_relative_eq!(frames[0].scale(), 0.7 / 20.0, epsilon = 1e-15);
        assert_eq!(frames[0].scale(), frames[1].scale());
        for (centre, frame) in [([9.5, 7.0, 9.5], frames[0]), ([14.5, 7.0, 7.0], frames[1])] {
            for x in frame.to_unit(centre) {
                assert_relative_eq!(x, 0.5, epsilon = 1e-14);
            }
        }
    }

    proptest! {
        #[test]
        fn every_object_lands_inside_the_margin_and_frames_invert(
            corners in prop::collection::vec((0usize..20, 0usize..20, 0usize..20, 0usize..20), 1..5),
            spacing in prop::array::uniform2(0.1..10.0f64),
            point in prop::array::uniform2(-1.0..2.0f64),
        ) {
            let images: Vec<_> = corners
                .iter()
                .map(|&(a, b, c, d)| {
                    block([20, 20], spacing, [a.min(c), b.min(d)], [a.max(c), b.max(d)])
                })
                .collect();
            for (image, frame) in images.iter().zip(fit_frames(&images, Some(&Grid::cube(33)))) {
                let bounds = image.object_bounds().unwrap();
                for corner in [
                    bounds.map(|b| b[0] as f64 - 0.5),
                    bounds.map(|b| b[1] as f64 + 0.5),
                ] {
                    for x in frame.to_unit(corner) {
                        // Rounding of one division and three sums.
                        prop_assert!((0.15 - 1e-12..=0.85 + 1e-12).contains(&x));
                    }
                }
                let back = frame.to_unit(frame.to_sample(point));
                for k in 0..2 {
                    prop_assert!((back[k] - point[k]).abs() < 1e-12);
                }
                let text = serde_json::to_string(&frame).unwrap();
                let read: FrameTransform<2> = serde_json::from_str(&text).unwrap();
                prop_assert_eq!(read, frame);
                prop_assert!(serde_json::from_str::<FrameTransform<3>>(&text).is_err());
            }
        }
    }
}
