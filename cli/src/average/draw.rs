//! The picture of an average.

use fe_grid::ScalarField;
use levelset::{BoxEdge, Contour, contour};
use shape_average::AverageError;

use super::Outcome;
use crate::error::CliError;
use shapespace_picture::{Canvas, ContactSheet, Shape, ShapeTile, SurfaceSheet};

/// `average.png`.
///
/// # Errors
/// [`CliError::Average`] for deformed shapes without a boundary.
pub(super) fn picture<const D: usize>(
    outcome: &Outcome<D>,
    average: &Contour<D>,
) -> Result<Canvas, CliError> {
    let names = outcome.inputs.iter().map(|input| input.name.as_str());
    let shapes = outcome.inputs.iter().map(|input| Shape::of(&input.contour));
    let shapes: Vec<(&str, Shape)> = names.zip(shapes).collect();
    let average = Shape::of(average);
    if let Shape::Solid { .. } = average {
        let surfaces = shapes.iter().map(|(name, shape)| (*name, shape.surface()));
        let sheet = SurfaceSheet {
            inputs: &surfaces.collect::<Vec<_>>(),
            average: average.surface(),
        };
        return Ok(sheet.draw());
    }
    let tile = |label, shape| ShapeTile {
        label,
        outline: Shape::curves(shape),
    };
    let inputs = shapes.iter().map(|(name, shape)| tile(name, shape));
    let sheet = ContactSheet {
        inputs: &inputs.collect::<Vec<_>>(),
        average: tile("average", &average),
        warped: &warped(outcome)?,
        sides: std::array::from_fn(|k| outcome.result.average.grid().extent()[k]),
    };
    Ok(sheet.draw())
}

/// The visible boundaries of the shapes, deformed onto the average.
fn warped<const D: usize>(outcome: &Outcome<D>) -> Result<Vec<Shape>, CliError> {
    let result = &outcome.result;
    let visible = |(i, distance): (usize, &ScalarField<f64, D>)| {
        let warped = contour(distance, 0.0, BoxEdge::Closed).map_err(AverageError::from)?;
        let Some(visibility) = result.pushed_visibility.get(i) else {
            return Ok(Shape::of(&warped));
        };
        let visible = |x: &[f64; D]| visibility.sample(*x)[0] > 0.5;
        Ok(Shape::of(
            &warped.part(|corners| corners.iter().all(visible)),
        ))
    };
    result.pushed.iter().enumerate().map(visible).collect()
}
