//! The Eulerian description of a path of deformations: its shapes and steps.

use super::solve::LagrangianPath;
use crate::error::GeodesicError;
use crate::extension::through_inverse;
use crate::shape::on_grid;
use fe_grid::{Field, ScalarField, parallel};
use levelset::{BoxEdge, ContourDistance, contour};

/// Computes the level sets of all components along a path of one start domain, and the
/// displacements of the deformations of each shape into the next.
pub(crate) fn eulerian<const D: usize>(
    start: &[ScalarField<f64, D>],
    path: &LagrangianPath<D>,
) -> Result<(Vec<Vec<ScalarField<f64, D>>>, Vec<Field<f64, D, D>>), GeodesicError> {
    // A cancelled path ends on a coarser grid than that of the shapes.
    let grid = path
        .displacements
        .first()
        .map_or(*start[0].grid(), |u| *u.grid());
    let first: Vec<_> = start.iter().map(|u| on_grid(&grid, u)).collect();
    let outlines: Result<Vec<_>, _> = first
        .iter()
        .map(|u| contour(u, 0.0, BoxEdge::Open))
        .collect();
    let outlines = outlines?;
    let mut shapes = vec![first];
    for displacement in &path.displacements {
        let moved: Result<Vec<_>, GeodesicError> = outlines
            .iter()
            .map(|outline| {
                let moved = outline.map(|p| {
                    let u = displacement.sample(p);
                    std::array::from_fn(|k| p[k] + u[k])
                });
                Ok(ContourDistance::new(&moved)?.sample(grid))
            })
            .collect();
        shapes.push(moved?);
    }
    let displacements = parallel::map(0..path.displacements.len(), &|k| match k {
        0 => path.displacements[0].clone(),
        _ => step_between(&path.displacements[k - 1], &path.displacements[k]),
    });
    Ok((shapes, displacements))
}

/// Computes the displacement of `psi_k o psi_{k-1}^{-1}`.
pub(crate) fn step_between<const D: usize>(
    before: &Field<f64, D, D>,
    after: &Field<f64, D, D>,
) -> Field<f64, D, D> {
    through_inverse(before, |x| {
        let (u, v) = (before.sample(x), after.sample(x));
        std::array::from_fn(|k| v[k] - u[k])
    })
}
