//! The boundary of a mask.

use fe_grid::{Grid, ScalarField};
use levelset::{BoxEdge, Contour, LevelsetError, contour};

use super::frame::FrameTransform;
use super::{Image, LEVEL};

/// The boundary of a mask's object in the unit box: the exact one of an outline or a surface, else the
/// contour of level 1/2 between the samples
/// at their own resolution, so that nothing is lost where they are finer than a grid, and grey
/// edges keep their sub-sample position. Beyond its samples an image is background, so that the
/// boundary is always closed. The order and the directions in which samples are stored make no
/// difference: cells are cut along the axes of the box.
///
/// # Errors
/// [`LevelsetError::EmptyObject`] where no value exceeds 1/2, [`LevelsetError::NonFinite`] where
/// a value is not finite; masks that were read have neither fault.
pub fn boundary<const D: usize>(
    image: &Image<D>,
    frame: &FrameTransform<D>,
) -> Result<Contour<D>, LevelsetError> {
    if let Some(outline) = &image.outline {
        let placed = outline.map(|p| frame.to_unit(p));
        return Ok(if frame.reflects() {
            placed.flipped()
        } else {
            placed
        });
    }
    let bounds = image
        .object_bounds()
        .ok_or(LevelsetError::EmptyObject { level: LEVEL })?;
    let axes = frame.box_axes();
    let bounds = axes.map(|(axis, _)| bounds[axis]);
    let size = axes.map(|(axis, _)| image.size[axis]);
    // One sample around the object is all that its boundary depends on.
    let window = Grid::with_nodes(bounds.map(|[low, high]| high - low + 3), 1.0)
        // Bounds of an object hold at least one sample: the window has three or more.
        .expect("three nodes or more along every axis, spacing 1");
    let mut field = ScalarField::zeros(window);
    for (index, value) in field.as_mut_slice().iter_mut().enumerate() {
        let node = window.node(index);
        let mut sample = [0; D];
        let mut inside = true;
        for (k, (axis, reversed)) in axes.into_iter().enumerate() {
            // Nodes are counted along the axes of the box, from one before the first sample of the
            // object, which may be one before the first of the image.
            let next = if reversed {
                (bounds[k][1] + 2).checked_sub(node[k])
            } else {
                Some(node[k] + bounds[k][0])
            };
            match next.filter(|next| (1..=size[k]).contains(next)) {
                Some(next) => sample[axis] = next - 1,
                None => inside = false,
            }
        }
        if inside {
            *value = image.values.get(image.index(sample));
        }
    }
    let drawn = contour(&field, LEVEL, BoxEdge::Closed)?;
    let placed = drawn.map(|p| {
        let mut sample = [0.0; D];
        for (k, (axis, reversed)) in axes.into_iter().enumerate() {
            sample[axis] = if reversed {
                bounds[k][1] as f64 + 1.0 - p[k]
            } else {
                p[k] + (bounds[k][0] as f64 - 1.0)
            };
        }
        frame.to_unit(sample)
    });
    Ok(if frame.reverses() {
        placed.flipped()
    } else {
        placed
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;
    use crate::place::fit_frames;
    use approx::assert_relative_eq;
    use levelset::Moments;

    #[test]
    fn a_block_at_the_border_of_its_image_has_its_own_box() {
        // The object fills the image but for one layer, and the image is two samples thick.
        let image = block([20, 10, 2], [1.0, 1.0, 3.0], [1, 0, 0], [19, 9, 1]);
        let frame = fit_frames(std::slice::from_ref(&image), None)[0];
        let drawn = boundary(&image, &frame).unwrap();
        assert!(drawn.is_closed());
        // 19 x 10 x 6 lengths, the longest side becoming .7.
        for (k, side) in [19.0, 10.0, 6.0]
            .map(|n| 0.7 * n / 19.0)
            .into_iter()
            .enumerate()
        {
            let axis = || drawn.points().iter().map(|p| p[k]);
            let (low, high) = (axis().fold(1.0, f64::min), axis().fold(0.0, f64::max));
            assert_relative_eq!(low, 0.5 - 0.5 * side, epsilon = 1e-12);
            assert_relative_eq!(high, 0.5 + 0.5 * side, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_grey_disk_keeps_its_area() {
        let mut image = block([64, 64], [0.5, 0.5], [0, 0], [0, 0]);
        let value = |index| {
            let [x, y] = image.sample(index).map(|i| i as f64);
            (20.8 - (x - 30.2).hypot(y - 33.1)).clamp(0.0, 1.0)
        };
        let values: Vec<f64> = (0..image.values.len()).map(value).collect();
        image.values = values.into();
        let frame = fit_frames(std::slice::from_ref(&image), None)[0];
        let area = Moments::of_contour(&boundary(&image, &frame).unwrap())
            .unwrap()
            .volume;
        let radius = 20.3 * 0.5 * frame.scale();
        // Chords of about one sample take a share of up to 1/(6 r^2) = 4e-4 away.
        let share = area / (std::f64::consts::PI * radius * radius);
        assert!((1.0 - 6e-4..1.0 + 1e-4).contains(&share), "{share}");
    }

    #[test]
    fn a_single_sample_has_a_boundary_and_no_sample_has_none() {
        let image = block([5, 5], [1.0; 2], [2, 2], [2, 2]);
        let frame = fit_frames(std::slice::from_ref(&image), None)[0];
        assert_eq!(boundary(&image, &frame).unwrap().simplices().len(), 4);
        let empty = Image {
            values: vec![0.5; 25].into(),
            ..image
        };
        assert!(matches!(
            boundary(&empty, &frame),
            Err(LevelsetError::EmptyObject { .. })
        ));
    }
}
