//! Sizes of a shape that show what a mean does to thin parts.

use fe_grid::ScalarField;
use levelset::{
    BoxEdge, LevelsetError, connected_components, contour, enclosed_volume, signed_distance,
};

/// The share of the area that disks of a thickness have to cover.
const COVERED: f64 = 0.8;
/// Halvings of the interval of the thickness.
const HALVINGS: usize = 12;
/// Protrusions are where disks of this share of the largest radius do not fit.
const LARGE: f64 = 0.9;

/// Sizes of a shape, in the unit box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measures {
    pub area: f64,
    /// The largest diameter for which disks in the shape cover 0.8 of its area: the width of a bar, and of
    /// fingers.
    pub thickness: f64,
    /// The largest distance of a point of the shape from the union of all disks in it of 0.9 of the
    /// largest radius: the height of pins on a block, the length of fingers on a hand.
    pub protrusion: f64,
    /// Number of parts.
    pub pieces: usize,
}

/// The sizes of the shape inside a signed distance, exact to about a spacing.
///
/// # Errors
/// Those of contours, and of signed distances of shapes that fill the box.
pub(super) fn measure<const D: usize>(
    distance: &ScalarField<f64, D>,
) -> Result<Measures, LevelsetError> {
    let area = volume(distance, 0.0)?;
    let deepest = distance.as_slice().iter().copied().fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, deepest);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let covered = match opened(distance, middle)? {
            Some(union) => volume(&union, -middle)?,
            None => 0.0,
        };
        if covered >= COVERED * area {
            low = middle;
        } else {
            high = middle;
        }
    }
    let radius = LARGE * deepest;
    let mut protrusion = 0.0;
    if let Some(union) = opened(distance, radius)? {
        for point in contour(distance, 0.0, BoxEdge::Closed)?.points() {
            protrusion = f64::max(protrusion, -radius - union.sample(*point)[0]);
        }
    }
    Ok(Measures {
        area,
        thickness: 2.0 * low,
        protrusion,
        pieces: connected_components(distance, 0.0).sizes.len(),
    })
}

/// The signed distance of the centres of all disks of a radius in the shape: the disks cover where it is above
/// minus the radius. `None` where no node is so deep.
fn opened<const D: usize>(
    distance: &ScalarField<f64, D>,
    radius: f64,
) -> Result<Option<ScalarField<f64, D>>, LevelsetError> {
    match signed_distance(distance, radius) {
        Ok(union) => Ok(Some(union)),
        Err(LevelsetError::EmptyObject { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn volume<const D: usize>(field: &ScalarField<f64, D>, level: f64) -> Result<f64, LevelsetError> {
    enclosed_volume(&contour(field, level, BoxEdge::Closed)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::related::curve::Curve;
    use approx::assert_relative_eq;
    use fe_grid::Grid;

    /// A block of height .24 with a pin of width .08 and height .1, on a grid of spacing 1/128.
    #[test]
    fn a_block_with_a_pin_has_its_height_and_its_pin() {
        let block = [[0.2, 0.3], [0.8, 0.3], [0.8, 0.54], [0.2, 0.54]];
        let mut pinned = block.to_vec();
        pinned.splice(3..3, [[0.5, 0.54], [0.5, 0.64], [0.42, 0.64], [0.42, 0.54]]);
        let spacing = 1.0 / 128.0;
        let of = |points: Vec<[f64; 2]>| {
            measure(&Curve { points }.signed_distance(Grid::<2>::cube(129))).unwrap()
        };
        let (plain, pinned) = (of(block.to_vec()), of(pinned));
        assert_relative_eq!(plain.area, 0.6 * 0.24, max_relative = 1e-3);
        assert!((plain.thickness - 0.24).abs() < 2.0 * spacing, "{plain:?}");
        // Of the corners: (sqrt 2 - 1) times the radius, .9 of a half of .24.
        assert!(
            (plain.protrusion - 0.414 * 0.108).abs() < spacing,
            "{plain:?}"
        );
        assert!(
            (pinned.thickness - 0.24).abs() < 3.0 * spacing,
            "{pinned:?}"
        );
        assert!(
            (pinned.protrusion - 0.1).abs() < 2.0 * spacing,
            "{pinned:?}"
        );
        assert_eq!((plain.pieces, pinned.pieces), (1, 1));
    }
}
