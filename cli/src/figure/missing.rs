//! Averages with a partially hidden shape.

use fe_grid::ScalarField;

use super::scene::{Scene, distance, outline};
use super::sheet::{Comparison, Sheet};
use crate::error::CliError;

/// The share of the first shape's extent along the first axis that is hidden.
const HIDDEN: f64 = 0.3;

/// Hides the end of the first shape and averages all: the complete shapes, with a visibility mask,
/// and without.
pub(super) fn missing_parts<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let grid = scene.grid();
    let first = &scene.distances[0];
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (index, _) in first
        .as_slice()
        .iter()
        .enumerate()
        .filter(|(_, d)| **d > 0.0)
    {
        let x = grid.position(grid.node(index))[0];
        (low, high) = (low.min(x), high.max(x));
    }
    let end = high - HIDDEN * (high - low);
    let cut = ScalarField::from_fn(grid, |x| [first.sample(x)[0].min(end - x[0])]);
    let cut = levelset::signed_distance(&cut, 0.0)?;
    let mut partly = scene.distances.clone();
    partly[0] = cut;
    let ramp = 2.0 * grid.spacing();
    let mut visibility = vec![ScalarField::from_fn(grid, |_| [1.0]); partly.len()];
    // The edge where it is cut off is hidden as well.
    visibility[0] = ScalarField::from_fn(grid, |x| [((end - x[0]) / ramp - 1.0).clamp(0.0, 1.0)]);

    let whole = scene.average("whole shapes", |_| ())?;
    let known = scene.average_of("hidden, with a mask", &partly, &visibility, |_| ())?;
    let blind = scene.average_of("hidden, without a mask", &partly, &[], |_| ())?;
    let truth = outline(&whole)?;
    let last = ["distance to that of the whole"];
    let mut compared = Comparison::new(&grid, 4, &["average"], &last);
    compared.tiles.shapes("shapes, the first cut", &partly, 0.0);
    for (label, result) in [
        ("whole shapes", &whole),
        ("hidden, with a mask", &known),
        ("hidden, without a mask", &blind),
    ] {
        compared.add(
            label,
            [label],
            result,
            [distance(&outline(result)?, &truth)?],
        );
    }
    Ok(compared.sheet(
        "Missing parts",
        format!(
            "The last {HIDDEN} of the first shape is hidden. With a visibility mask (`average \
             --valid`) the mismatch is not counted there, and the average is nearly that of the whole \
             shapes."
        ),
    ))
}
