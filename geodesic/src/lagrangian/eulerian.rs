//! The Eulerian description of a path of deformations: its shapes and steps.

use super::solve::{Domain, LagrangianPath};
use crate::error::GeodesicError;
use crate::extension::{change_between, through_inverse};
use crate::shape::Shape;
use fe_grid::{Field, Grid, ScalarField, parallel};
use levelset::{BoxEdge, ContourDistance, contour};

/// The shapes and deformations of a path, from its start.
pub(crate) struct Eulerian<const D: usize> {
    /// The level sets of all components along the path: exact on the domain of the path, carried
    /// elsewhere.
    pub shapes: Vec<Vec<ScalarField<f64, D>>>,
    /// The displacements of the deformations `phi_k` of each shape into the next.
    pub displacements: Vec<Field<f64, D, D>>,
    /// The displacements of the deformations `psi_k` of the start shape into every other.
    pub motions: Vec<Field<f64, D, D>>,
}

/// Computes the Eulerian description of a path between two shapes. `psi_k` is known where the path
/// is given on the start domain; with `chi_j` on the end domain, `psi_k = chi_{K-k} o chi_K^{-1}`; and with deformations
/// `theta_k` of a shape between both, `psi_k = theta_k o theta_0^{-1}`.
pub(crate) fn eulerian<const D: usize>(
    start: &[ScalarField<f64, D>],
    end: &[ScalarField<f64, D>],
    path: &LagrangianPath<D>,
) -> Result<Eulerian<D>, GeodesicError> {
    let [from, _] = path.domain.order(start, end);
    let own = path.middle.as_ref().map_or(from, Shape::components);
    // A cancelled path ends on a coarser grid than that of the shapes.
    let first = path.displacements.first();
    let grid = first.map_or(*own[0].grid(), |u| *u.grid());
    let mut shapes = carried(own, &path.displacements, grid)?;
    // All deformations of the domain's shape, with the identity where that is one of them.
    let mut all = match path.domain {
        Domain::Middle => {
            shapes.remove(0);
            Vec::new()
        }
        Domain::Start | Domain::End => vec![Field::zeros(grid)],
    };
    all.extend(path.displacements.iter().cloned());
    if path.domain == Domain::End {
        shapes.reverse();
        all.reverse();
    }
    let steps = all.len() - 1;
    let to_next = |k: usize| step_between(&all[k], &all[k + 1]);
    let from_start = |k: usize| step_between(&all[0], &all[k + 1]);
    let (displacements, motions) = match path.domain {
        Domain::Start => {
            let later = parallel::map(1..steps, &to_next);
            let first = path.displacements[..1].iter().cloned();
            (first.chain(later).collect(), path.displacements.clone())
        }
        Domain::End | Domain::Middle => {
            let displacements = parallel::map(0..steps, &to_next);
            let later = parallel::map(1..steps, &from_start);
            let motions = displacements[..1].iter().cloned().chain(later).collect();
            (displacements, motions)
        }
    };
    Ok(Eulerian {
        shapes,
        displacements,
        motions,
    })
}

/// Computes the level sets of components carried by deformations, after those of the components
/// themselves.
fn carried<const D: usize>(
    components: &[ScalarField<f64, D>],
    deformations: &[Field<f64, D, D>],
    grid: Grid<D>,
) -> Result<Vec<Vec<ScalarField<f64, D>>>, GeodesicError> {
    let first: Vec<_> = components.iter().map(|u| u.on_grid(&grid)).collect();
    let outlines: Result<Vec<_>, _> = first
        .iter()
        .map(|u| contour(u, 0.0, BoxEdge::Open))
        .collect();
    let outlines = outlines?;
    let mut shapes = vec![first];
    for displacement in deformations {
        let moved: Result<Vec<_>, GeodesicError> = outlines
            .iter()
            .map(|outline| {
                Ok(ContourDistance::new(&outline.displaced(displacement, 1.0))?.sample(grid))
            })
            .collect();
        shapes.push(moved?);
    }
    Ok(shapes)
}

/// Computes the displacement of `psi_k o psi_{k-1}^{-1}`.
pub(crate) fn step_between<const D: usize>(
    before: &Field<f64, D, D>,
    after: &Field<f64, D, D>,
) -> Field<f64, D, D> {
    through_inverse(before, change_between(before, after))
}
