//! Placing grey images in the world, each as a whole.
//!
//! The grid is the field of view of one image, which leads: from its first to its last sample along each
//! axis. Its axes are those of that image, in the order and with the directions that are nearest to those
//! of the world, so that the box does not depend on how the image is stored. Sheared axes are replaced by
//! the nearest orthogonal ones, and the box contains the field of view.

use fe_grid::tensor::{determinant, inverse_transpose};
use fe_grid::{Grid, GridError};

use crate::Image;
use crate::frame::{FrameRule, FrameTransform, nearest_axes};
use crate::place::whole_grid;

/// Steps in which the orthogonal matrix nearest to a matrix is found: the error of each is the square of
/// that of the last.
const STEPS: usize = 16;

/// The transforms that place images by their positions in the world, which all of them have, and the
/// grid of this number of nodes along the longest side of the field of view of the one that leads.
///
/// # Errors
/// [`GridError`] for fewer than two nodes.
pub fn physical_views<const D: usize>(
    images: &[Image<D>],
    leading: usize,
    nodes: usize,
) -> Result<(Vec<FrameTransform<D>>, Grid<D>), GridError> {
    let lead = &images[leading];
    let turn = turn_of(lead);
    let view = reach(lead, &upright(lead, turn));
    let (longest, grid) = whole_grid(sides(view), nodes)?;
    let offset = in_the_middle(view, longest, &grid);
    let frame = |image| {
        FrameTransform::of_image(image, longest.recip(), offset, FrameRule::Physical).turned(turn)
    };
    Ok((images.iter().map(frame).collect(), grid))
}

/// The transforms that put the field of view of every image into the middle of a grid that contains each
/// of them, with one scale, oriented as in the world where an image has a place there.
///
/// # Errors
/// As [`physical_views`].
pub fn centred_views<const D: usize>(
    images: &[Image<D>],
    leading: usize,
    nodes: usize,
) -> Result<(Vec<FrameTransform<D>>, Grid<D>), GridError> {
    let turn = turn_of(&images[leading]);
    // The axes of an image without a place are those of the box.
    let turn = |image: &Image<D>| turn.filter(|_| image.direction.is_some());
    let view = |image: &Image<D>| reach(image, &upright(image, turn(image)));
    let views: Vec<_> = images.iter().map(view).collect();
    let room = views.iter().fold([0.0; D], |room: [f64; D], view| {
        let own = sides(*view);
        std::array::from_fn(|k| f64::max(room[k], own[k]))
    });
    let (longest, grid) = whole_grid(room, nodes)?;
    let frame = |(image, view): (&Image<D>, &[[f64; 2]; D])| {
        let offset = in_the_middle(*view, longest, &grid);
        FrameTransform::of_image(image, longest.recip(), offset, FrameRule::Whole)
            .turned(turn(image))
    };
    Ok((images.iter().zip(&views).map(frame).collect(), grid))
}

/// From where to where the field of view of an image reaches in the box, from its first to its last sample
/// along each axis.
pub fn reach<const D: usize>(image: &Image<D>, frame: &FrameTransform<D>) -> [[f64; 2]; D] {
    let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; D];
    for number in 0..1usize << D {
        let corner = std::array::from_fn(|k| ((number >> k & 1) * (image.size[k] - 1)) as f64);
        for (side, x) in reach.iter_mut().zip(frame.to_unit(corner)) {
            *side = [side[0].min(x), side[1].max(x)];
        }
    }
    reach
}

/// The transform to the turned world, in its units.
fn upright<const D: usize>(image: &Image<D>, turn: Option<[[f64; D]; D]>) -> FrameTransform<D> {
    FrameTransform::of_image(image, 1.0, [0.0; D], FrameRule::Whole).turned(turn)
}

fn sides<const D: usize>(view: [[f64; 2]; D]) -> [f64; D] {
    view.map(|[low, high]| high - low)
}

/// The offset that puts a part of the turned world into the middle of a grid.
fn in_the_middle<const D: usize>(view: [[f64; 2]; D], longest: f64, grid: &Grid<D>) -> [f64; D] {
    let extent = grid.extent();
    std::array::from_fn(|k| 0.5 * (extent[k] - (view[k][0] + view[k][1]) / longest))
}

/// The rotation from the world to the axes of an image, in the order and with the directions nearest to
/// those of the world; none for an image whose axes are those of the world, or that has no place there.
fn turn_of<const D: usize>(image: &Image<D>) -> Option<[[f64; D]; D]> {
    let columns = image.direction?;
    let axes = nearest_axes(&columns);
    // Row i of the turn is the axis nearest to axis i of the world.
    let mut turn: [[f64; D]; D] = axes
        .map(|(axis, reversed)| columns.map(|row| if reversed { -row[axis] } else { row[axis] }));
    // Of axes halfway between those of the world, the nearest may be reflected.
    if determinant(&turn) < 0.0 {
        turn[D - 1] = turn[D - 1].map(|x| -x);
    }
    for _ in 0..STEPS {
        let inverse = inverse_transpose(&turn);
        turn = std::array::from_fn(|i| std::array::from_fn(|k| 0.5 * (turn[i][k] + inverse[i][k])));
    }
    let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(i == k)));
    let identity: [[f64; D]; D] = std::array::from_fn(unit);
    (turn != identity).then_some(turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;
    use crate::frame::applied;
    use crate::place::nodal_values;

    const SIZE: [usize; 3] = [9, 7, 5];
    /// Axes that are turned about z by the angle whose sine is .6.
    const OBLIQUE: [[f64; 3]; 3] = [[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]];

    /// A value without symmetries.
    fn value(i: usize, j: usize, k: usize) -> f64 {
        ((i * i + 3 * j + 7 * k * j) % 11) as f64 / 10.0
    }

    /// The same samples along these axes: the sample (i, j, k) lies at `columns (2 i, j, 1.5 k) + (5, -6, 7)`,
    /// and is stored along `order` of the axes, reversed where `flips` says so.
    fn stored(columns: [[f64; 3]; 3], order: [usize; 3], flips: [bool; 3]) -> Image<3> {
        let h = [2.0, 1.0, 1.5];
        let size = order.map(|axis| SIZE[axis]);
        let mut image = block(size, [1.0; 3], [1; 3], [2; 3]);
        let place = |sample: [usize; 3]| {
            let mut own = [0; 3];
            for k in 0..3 {
                let n = size[k] - 1;
                own[order[k]] = if flips[k] { n - sample[k] } else { sample[k] };
            }
            own
        };
        let count: usize = size.iter().product();
        let values = (0..count).map(|index| {
            let [i, j, k] = place(image.sample(index));
            value(i, j, k)
        });
        image.values = values.collect::<Vec<f64>>().into();
        let world = |sample| {
            let along = place(sample);
            let scaled = std::array::from_fn(|k| h[k] * along[k] as f64);
            let turned = applied(&columns, scaled);
            [turned[0] + 5.0, turned[1] - 6.0, turned[2] + 7.0]
        };
        let origin = world([0; 3]);
        let ends: [[f64; 3]; 3] =
            std::array::from_fn(|k| world(std::array::from_fn(|i| usize::from(i == k))));
        image.affine = Some(std::array::from_fn(|i| {
            let step = |k: usize| ends[k][i] - origin[i];
            [step(0), step(1), step(2), origin[i]]
        }));
        image.in_world().unwrap()
    }

    #[test]
    fn the_box_and_the_values_do_not_depend_on_the_order_of_samples() {
        let straight = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for columns in [straight, OBLIQUE] {
            let images = [
                stored(columns, [0, 1, 2], [false; 3]),
                stored(columns, [0, 1, 2], [true, false, false]),
                stored(columns, [2, 0, 1], [false, true, true]),
            ];
            for leading in 0..3 {
                let (frames, grid) = physical_views(&images, leading, 17).unwrap();
                // 16, 6 and 6 mm; the cells are one, and come in pairs.
                assert_eq!(grid.nodes_per_axis(), [17, 7, 7]);
                assert_eq!(
                    frames[0].turned_back([1.0, 0.0, 0.0])[0] == 1.0,
                    columns == straight
                );
                let first = nodal_values(&images[0], &frames[0], grid).unwrap();
                // The nodes of the grid are samples of the first image.
                assert!((first.as_slice()[4] - value(2, 0, 0)).abs() < 1e-12);
                for (image, frame) in images.iter().zip(&frames).skip(1) {
                    let own = nodal_values(image, frame, grid).unwrap();
                    for (a, b) in own.as_slice().iter().zip(first.as_slice()) {
                        assert!((a - b).abs() < 1e-12, "{a} {b}");
                    }
                }
                let text = serde_json::to_string(&frames[1]).unwrap();
                assert_eq!(
                    serde_json::from_str::<FrameTransform<3>>(&text).unwrap(),
                    frames[1]
                );
                let (centred, same) = centred_views(&images, leading, 17).unwrap();
                assert_eq!(same, grid);
                assert!(centred.iter().zip(&frames).all(|(a, b)| a.like(b)));
            }
        }
    }

    #[test]
    fn an_image_that_lies_elsewhere_keeps_its_place_unless_it_is_centred() {
        let mut images = [(); 2].map(|()| stored(OBLIQUE, [0, 1, 2], [false; 3]));
        // 4 mm along the first axis.
        images[1].origin[0] += 0.8 * 4.0;
        images[1].origin[1] += 0.6 * 4.0;
        let (frames, _) = physical_views(&images, 0, 17).unwrap();
        let [own, other] = [0, 1].map(|i| reach(&images[i], &frames[i]));
        assert!((other[0][0] - own[0][0] - 4.0 / 16.0).abs() < 1e-12);
        assert!((other[1][1] - own[1][1]).abs() < 1e-12);
        let (frames, grid) = centred_views(&images, 0, 17).unwrap();
        let middle = frames[1].to_unit(SIZE.map(|n| 0.5 * (n - 1) as f64));
        for (x, side) in middle.into_iter().zip(grid.extent()) {
            assert!((x - 0.5 * side).abs() < 1e-12);
        }
    }
}
