//! Change of the start domain of a path.
//!
//! The energy of a step does not depend on the start shape: `W(a o h, b o h) = W(a, b)` for a
//! deformation `h` of one start shape into another. A shape on a path may therefore become the
//! start shape of the rest. This is done when the void of the old start shape is too compressed:
//! moving matter compresses the void in front of it, and the state of the void is not in
//! equilibrium and need not be retained.
//!
//! Inside the new start shape, and where its indicator is positive, deformations are read through the
//! inverse of the old one; outside they are extended with least elastic energy of the void. The error is
//! that of cubic interpolation.

use super::geometry::Geometry;
use super::params::CalculusParams;
use crate::error::GeodesicError;
use crate::extension::change_between;
use fe_grid::vector::scale;
use fe_grid::{
    CgParams, CgScratch, Field, InverseDeformation, LinearOperator, ScalarField, conjugate_gradient,
};
use hyperelastic::CorotationalOperator;
use levelset::{BoxEdge, Contour, ContourDistance, contour};

/// Accuracy of the extension into the void.
const CONTINUED: CgParams = CgParams {
    relative_tolerance: 1e-6,
    absolute_tolerance: 0.0,
    max_iterations: 500,
};

/// Returns the image of a start shape under `at` as a start shape, and the deformations of the old
/// one as deformations of the new: `b` becomes `b o at^{-1}`. All are given by displacements.
///
/// # Errors
/// [`GeodesicError::Shape`] for shapes without a boundary, [`GeodesicError::Degenerate`] for a
/// shape that has left the box.
pub(super) fn regridded<const D: usize>(
    start: &ScalarField<f64, D>,
    at: &Field<f64, D, D>,
    deformations: &[&Field<f64, D, D>],
    params: &CalculusParams,
) -> Result<(ScalarField<f64, D>, Vec<Field<f64, D, D>>), GeodesicError> {
    let grid = *start.grid();
    let level_set = carried(&outline(start)?, at)?;
    let geometry = Geometry::new(&level_set, params)?;
    let inverse = InverseDeformation::new(at);
    let least = -params.indicator_cells * grid.spacing();
    let origin: Vec<Option<[f64; D]>> = (0..grid.n_nodes())
        .map(|node| {
            let near = level_set.as_slice()[node] > least;
            inverse.position(node).filter(|_| near)
        })
        .collect();
    let known: Vec<bool> = origin.iter().map(Option::is_some).collect();
    let mut moved = Vec::with_capacity(deformations.len());
    for &deformation in deformations {
        // With y = at(x) the displacement of y is that of x from there on.
        let change = change_between(at, deformation);
        let mut field = Field::zeros(grid);
        for (node, origin) in origin.iter().enumerate() {
            if let Some(x) = origin {
                for (k, value) in change(*x).into_iter().enumerate() {
                    field.component_mut(k)[node] = value;
                }
            }
        }
        continue_elastically(&geometry, &known, field.as_mut_slice())?;
        moved.push(field);
    }
    Ok((level_set, moved))
}

/// Returns the boundary of a start shape.
pub(super) fn outline<const D: usize>(
    start: &ScalarField<f64, D>,
) -> Result<Contour<D>, GeodesicError> {
    Ok(contour(start, 0.0, BoxEdge::Open)?)
}

/// Returns the signed distance to a boundary moved by a deformation.
pub(super) fn carried<const D: usize>(
    outline: &Contour<D>,
    displacement: &Field<f64, D, D>,
) -> Result<ScalarField<f64, D>, GeodesicError> {
    let moved = outline.displaced(displacement, 1.0);
    Ok(ContourDistance::new(&moved)?.sample(*displacement.grid()))
}

/// Sets a nodal field to zero at the known nodes.
fn mask(known: &[bool], field: &mut [f64]) {
    for component in field.chunks_exact_mut(known.len()) {
        for (value, &known) in component.iter_mut().zip(known) {
            if known {
                *value = 0.0;
            }
        }
    }
}

/// An operator for the nodes that are not known.
struct Unknown<'a, A> {
    operator: A,
    known: &'a [bool],
}

impl<A: LinearOperator> LinearOperator for Unknown<'_, A> {
    fn dim(&self) -> usize {
        self.operator.dim()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        self.operator.apply_into(x, y);
        mask(self.known, y);
    }
}

/// Assigns to the unknown nodes the displacements of least elastic energy.
fn continue_elastically<const D: usize>(
    geometry: &Geometry<D>,
    known: &[bool],
    field: &mut [f64],
) -> Result<(), GeodesicError> {
    let zero = vec![0.0; field.len()];
    let (law, cells) = geometry.form(&zero);
    let operator = Unknown {
        operator: CorotationalOperator::new(geometry.grid, law, cells),
        known,
    };
    let preconditioner = Unknown {
        operator: geometry.cycle(&zero)?,
        known,
    };
    let mut right = vec![0.0; field.len()];
    operator.apply_into(field, &mut right);
    scale(-1.0, &mut right);
    let mut found = zero;
    let mut scratch = CgScratch::new(operator.dim());
    conjugate_gradient(
        &operator,
        &preconditioner,
        &right,
        &mut found,
        &CONTINUED,
        &mut scratch,
    )?;
    for (value, found) in field.iter_mut().zip(found) {
        *value += found;
    }
    Ok(())
}
