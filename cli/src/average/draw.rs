//! The picture of an average.

use fe_grid::ScalarField;
use levelset::{BoxEdge, Contour, contour};

use super::Outcome;
use super::components::shapes_of;
use crate::error::CliError;
use shapespace_picture::{
    Canvas, Colour, ContactSheet, PaintedSurface, Shape, ShapeTile, SurfaceSheet, colour, joined,
};

/// `average.png`, with the boundaries of the average and of its components, if there are several; these
/// have one colour each in all shapes.
///
/// # Errors
/// [`CliError::Average`] for deformed shapes without a boundary.
pub(super) fn picture<const D: usize>(
    outcome: &Outcome<D>,
    average: &Contour<D>,
    components: &[Contour<D>],
) -> Result<Canvas, CliError> {
    let names = outcome.inputs.iter().map(|input| input.name.as_str());
    let shapes = outcome.inputs.iter().map(|input| Shape::of(&input.contour));
    let shapes: Vec<(&str, Shape)> = names.zip(shapes).collect();
    let average = Shape::of(average);
    let components = shapes_of(components);
    // Of every input; as many empty lists where there is one component.
    let parts = (0..shapes.len()).map(|i| match &outcome.parts {
        Some(parts) => Ok(shapes_of(&parts.outlines(i)?)),
        None => Ok(Vec::new()),
    });
    let parts = parts.collect::<Result<Vec<Vec<Shape>>, CliError>>()?;
    if let Shape::Solid { .. } = average {
        let painted = |parts: &[Shape], whole: &Shape| -> (Shape, Vec<Colour>) {
            if parts.is_empty() {
                return (whole.clone(), Vec::new());
            }
            let parts = parts.iter().enumerate();
            let parts = parts.map(|(c, part)| (part.clone(), colour(c)));
            joined(&parts.collect::<Vec<_>>())
        };
        let whole = painted(&components, &average);
        let inputs = shapes.iter().zip(&parts);
        let inputs: Vec<_> = inputs
            .map(|((_, shape), parts)| painted(parts, shape))
            .collect();
        let surfaces = shapes
            .iter()
            .zip(&inputs)
            .map(|((name, _), found)| (*name, surface(found)));
        let sheet = SurfaceSheet {
            inputs: &surfaces.collect::<Vec<_>>(),
            average: surface(&whole),
        };
        return Ok(sheet.draw());
    }
    let inputs = shapes.iter().zip(&parts);
    let inputs = inputs.map(|((name, shape), parts)| ShapeTile {
        label: name,
        outline: shape.curves(),
        parts,
    });
    let sheet = ContactSheet {
        inputs: &inputs.collect::<Vec<_>>(),
        average: ShapeTile {
            label: "average",
            outline: average.curves(),
            parts: &components,
        },
        warped: &warped(outcome)?,
        sides: std::array::from_fn(|k| outcome.result.average.grid().extent()[k]),
    };
    Ok(sheet.draw())
}

fn surface((shape, colours): &(Shape, Vec<Colour>)) -> PaintedSurface<'_> {
    PaintedSurface {
        surface: shape.surface(),
        colours,
    }
}

/// The visible boundaries of the shapes, or of their components, deformed onto the average, each with the
/// number of its colour.
fn warped<const D: usize>(outcome: &Outcome<D>) -> Result<Vec<(Shape, usize)>, CliError> {
    let result = &outcome.result;
    let visible = |i: usize, distance: &ScalarField<f64, D>| -> Result<Shape, CliError> {
        let warped = contour(distance, 0.0, BoxEdge::Closed)?;
        let Some(visibility) = result.pushed_visibility.get(i) else {
            return Ok(Shape::of(&warped));
        };
        let visible = |x: &[f64; D]| visibility.sample(*x)[0] > 0.5;
        Ok(Shape::of(
            &warped.part(|corners| corners.iter().all(visible)),
        ))
    };
    let mut all = Vec::new();
    for (c, component) in result.components.iter().enumerate() {
        for (i, distance) in component.pushed.iter().enumerate() {
            all.push((visible(i, distance)?, c));
        }
    }
    if !all.is_empty() {
        return Ok(all);
    }
    let whole = result.pushed.iter().enumerate();
    whole
        .map(|(i, distance)| Ok((visible(i, distance)?, i)))
        .collect()
}
