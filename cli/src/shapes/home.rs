//! Boundaries in the form of pictures, and in the coordinates of the inputs.

use levelset::Contour;
use nalgebra::{SMatrix, SVector};

use super::align::Alignment;
use super::{Input, SurfaceRecord, common_scale};
use crate::picture::{Curve, Surface};

/// The curves of a flat boundary.
pub(crate) fn curves(contour: &Contour<2>) -> Vec<Curve> {
    let lines = contour.polylines().into_iter();
    lines
        .map(|line| Curve {
            points: line.points,
            closed: line.closed,
        })
        .collect()
}

/// The triangles of a surface.
pub(crate) fn triangles(contour: &Contour<3>) -> Vec<[usize; 3]> {
    let corners = contour.simplices().iter();
    corners.map(|c| c.map(|corner| corner as usize)).collect()
}

/// A boundary in space, for pictures.
pub(crate) fn surface<'a>(contour: &'a Contour<3>, triangles: &'a [[usize; 3]]) -> Surface<'a> {
    Surface {
        vertices: contour.points(),
        triangles,
    }
}

/// A shape in the position of the reference of the alignment, or of the first input without one, in
/// world coordinates if its file states them. Inputs of different scales have no common length
/// unit: then the shape stays in the unit box.
pub(crate) fn in_input_coordinates(
    inputs: &[Input<3>],
    shape: &Contour<3>,
) -> (Contour<3>, SurfaceRecord) {
    if common_scale(inputs).is_none() {
        let record = SurfaceRecord {
            coordinates: "unit_box",
            of_input: None,
        };
        return (shape.clone(), record);
    }
    let is_reference = |a: Option<Alignment<3>>| a.is_some_and(|a| a.reference);
    let home = inputs.iter().position(|i| is_reference(i.alignment));
    let home = home.unwrap_or(0);
    let input = &inputs[home];
    let unit = |p: [f64; 3]| input.alignment.map_or(p, |a| a.motion.map_back(p));
    let (placed, coordinates) = if let Some(affine) = input.affine {
        let samples = shape.map(|p| input.frame.to_sample(unit(p)));
        let matrix = SMatrix::<f64, 3, 3>::from_fn(|i, j| affine[i][j]);
        let shift = SVector::<f64, 3>::from_fn(|i, _| affine[i][3]);
        (samples.transformed(&matrix, &shift), "world")
    } else {
        (shape.map(|p| input.frame.to_physical(unit(p))), "input")
    };
    let record = SurfaceRecord {
        coordinates,
        of_input: Some(home),
    };
    (placed, record)
}
