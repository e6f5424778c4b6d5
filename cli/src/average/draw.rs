//! The picture of an average, and its surface in 3D.

use levelset::{BoxEdge, Contour, contour};
use nalgebra::{SMatrix, SVector};
use shape_average::AverageError;

use super::Outcome;
use super::record::{SurfaceRecord, common_scale};
use crate::error::CliError;
use crate::output::ResultDir;
use crate::output::stl::write_surface;
use crate::picture::{Canvas, ContactSheet, Curve, ShapeTile, Surface, SurfaceSheet};

/// What is drawn in `D` dimensions.
pub(super) trait Draw<const D: usize> {
    /// `average.png`.
    fn picture(outcome: &Outcome<D>, average: &Contour<D>) -> Result<Canvas, CliError>;

    /// Writes `average.stl` where there are surfaces, and tells its coordinates.
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
            .map(|distance| {
                let warped = contour(distance, 0.0, BoxEdge::Closed);
                Ok(curves(&warped.map_err(AverageError::from)?))
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

fn curves(contour: &Contour<2>) -> Vec<Curve> {
    let lines = contour.polylines().into_iter();
    lines
        .map(|line| Curve {
            points: line.points,
            closed: line.closed,
        })
        .collect()
}

impl Draw<3> for Pictures {
    fn picture(outcome: &Outcome<3>, average: &Contour<3>) -> Result<Canvas, CliError> {
        let triangles: Vec<_> = outcome
            .inputs
            .iter()
            .map(|i| triangles(&i.contour))
            .collect();
        let inputs: Vec<(&str, Surface)> = outcome
            .inputs
            .iter()
            .zip(&triangles)
            .map(|(input, triangles)| (input.name.as_str(), surface(&input.contour, triangles)))
            .collect();
        let of_average = self::triangles(average);
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
        let (placed, record) = in_input_coordinates(outcome, average);
        let path = directory.file("average.stl");
        write_surface(&path, placed.points(), &triangles(&placed))?;
        Ok(Some(record))
    }
}

fn triangles(contour: &Contour<3>) -> Vec<[usize; 3]> {
    let corners = contour.simplices().iter();
    corners.map(|c| c.map(|corner| corner as usize)).collect()
}

fn surface<'a>(contour: &'a Contour<3>, triangles: &'a [[usize; 3]]) -> Surface<'a> {
    Surface {
        vertices: contour.points(),
        triangles,
    }
}

/// The average where the reference of the alignment lies, or the first input without one, in
/// world coordinates if its file states them. Inputs of different scales have no common length
/// unit: then the average stays in the unit box.
fn in_input_coordinates(outcome: &Outcome<3>, average: &Contour<3>) -> (Contour<3>, SurfaceRecord) {
    let inputs = &outcome.inputs;
    if common_scale(inputs).is_none() {
        let record = SurfaceRecord {
            coordinates: "unit_box",
            of_input: None,
        };
        return (average.clone(), record);
    }
    let is_reference = |a: Option<super::place::Alignment<3>>| a.is_some_and(|a| a.reference);
    let home = inputs.iter().position(|i| is_reference(i.alignment));
    let home = home.unwrap_or(0);
    let input = &inputs[home];
    let unit = |p: [f64; 3]| input.alignment.map_or(p, |a| a.motion.map_back(p));
    let (placed, coordinates) = if let Some(affine) = input.affine {
        let samples = average.map(|p| input.frame.to_sample(unit(p)));
        let matrix = SMatrix::<f64, 3, 3>::from_fn(|i, j| affine[i][j]);
        let shift = SVector::<f64, 3>::from_fn(|i, _| affine[i][3]);
        (samples.transformed(&matrix, &shift), "world")
    } else {
        (average.map(|p| input.frame.to_physical(unit(p))), "input")
    };
    let record = SurfaceRecord {
        coordinates,
        of_input: Some(home),
    };
    (placed, record)
}
