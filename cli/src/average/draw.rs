//! The picture of an average, and its surface in 3D.

use levelset::{BoxEdge, Contour, contour};
use shape_average::AverageError;

use super::Outcome;
use crate::error::CliError;
use crate::output::ResultDir;
use crate::output::stl::write_surface;
use crate::picture::{Canvas, ContactSheet, Curve, ShapeTile, Surface, SurfaceSheet};
use crate::shapes::{SurfaceRecord, curves, in_input_coordinates, surface, triangles};

/// The drawings in `D` dimensions.
pub(super) trait Draw<const D: usize> {
    /// `average.png`.
    fn picture(outcome: &Outcome<D>, average: &Contour<D>) -> Result<Canvas, CliError>;

    /// Writes `average.stl` in 3D, and returns its coordinate system.
    fn surface(
        directory: &ResultDir,
        outcome: &Outcome<D>,
        average: &Contour<D>,
    ) -> Result<Option<SurfaceRecord>, CliError>;
}

/// Drawing in two and three dimensions.
pub(super) struct Pictures;

impl Draw<2> for Pictures {
    fn picture(outcome: &Outcome<2>, average: &Contour<2>) -> Result<Canvas, CliError> {
        let outlines: Vec<Vec<Curve>> = outcome.inputs.iter().map(|i| curves(&i.contour)).collect();
        let inputs: Vec<ShapeTile> = outcome
            .inputs
            .iter()
            .zip(&outlines)
            .map(|(input, outline)| ShapeTile {
                label: &input.name,
                outline,
            })
            .collect();
        let warped: Result<Vec<_>, CliError> = outcome
            .result
            .pushed
            .iter()
            .enumerate()
            .map(|(i, distance)| {
                let warped = contour(distance, 0.0, BoxEdge::Closed).map_err(AverageError::from)?;
                let seen = outcome.result.pushed_visibility.get(i);
                Ok(curves(&seen.map_or(warped.clone(), |seen| {
                    warped.part(|corners| corners.iter().all(|x| seen.sample(*x)[0] > 0.5))
                })))
            })
            .collect();
        let sheet = ContactSheet {
            inputs: &inputs,
            average: ShapeTile {
                label: "average",
                outline: &curves(average),
            },
            warped: &warped?,
        };
        Ok(sheet.draw())
    }

    fn surface(
        _directory: &ResultDir,
        _outcome: &Outcome<2>,
        _average: &Contour<2>,
    ) -> Result<Option<SurfaceRecord>, CliError> {
        Ok(None)
    }
}

impl Draw<3> for Pictures {
    fn picture(outcome: &Outcome<3>, average: &Contour<3>) -> Result<Canvas, CliError> {
        let corners: Vec<_> = outcome
            .inputs
            .iter()
            .map(|i| triangles(&i.contour))
            .collect();
        let inputs: Vec<(&str, Surface)> = outcome
            .inputs
            .iter()
            .zip(&corners)
            .map(|(input, corners)| (input.name.as_str(), surface(&input.contour, corners)))
            .collect();
        let of_average = triangles(average);
        let sheet = SurfaceSheet {
            inputs: &inputs,
            average: surface(average, &of_average),
        };
        Ok(sheet.draw())
    }

    fn surface(
        directory: &ResultDir,
        outcome: &Outcome<3>,
        average: &Contour<3>,
    ) -> Result<Option<SurfaceRecord>, CliError> {
        let (placed, record) = in_input_coordinates(&outcome.inputs, average);
        let path = directory.file("average.stl");
        write_surface(&path, placed.points(), &triangles(&placed))?;
        Ok(Some(record))
    }
}
