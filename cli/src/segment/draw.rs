//! `segment.png`: a row for each image, with the image, the smoothed image, the phase field, and
//! the object with its boundary. Volumes are shown by the plane through the middle.

use super::compute::Found;
use shapespace_picture::{Canvas, Slice, TileRows, colour, pale};

const COLUMNS: usize = 4;

/// The picture of all images.
pub(super) fn picture<const D: usize>(found: &[Found<D>]) -> Canvas {
    let mut rows = TileRows::new(COLUMNS);
    for image in found {
        let (placed, result) = (&image.placed, &image.result);
        // An interrupted run ends on a coarser grid of the same box.
        let slice = Slice::middle(placed.nodal.grid(), TileRows::width(COLUMNS));
        rows.push(placed.input.name.as_str(), slice.grey(&placed.nodal));
        rows.push("smoothed", slice.grey(&result.image));
        rows.push("phase field", slice.grey(&result.phase_field));
        let mut last = slice.painted(|x| pale(placed.nodal.sample(x)[0]));
        let label = match &image.object {
            None => {
                slice.mark(&mut last, &result.phase_field, colour(1));
                "edges".into()
            }
            Some(object) => {
                let mut label = String::from("object");
                if let Some(truth) = &object.truth {
                    slice.outline(&mut last, &truth.outline, 2.4, colour(1));
                    label = format!("Dice {:.3}, truth in red", truth.dice);
                }
                slice.level(&mut last, &object.level_set, 0.0, 1.4, colour(0));
                label
            }
        };
        rows.push(label, last);
    }
    rows.draw()
}
