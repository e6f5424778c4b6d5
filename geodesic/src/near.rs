//! Paths of another number of steps or on another grid, from a path that is known.

use crate::between::check_both;
use crate::error::GeodesicError;
use crate::lagrangian::{KnownPath, lagrangian_path_near};
use crate::params::GeodesicParams;
use crate::result::{Geodesic, of_domain, with_deformations};
use crate::shape::Shape;
use fe_grid::minimise::Observer;
use fe_grid::{Field, compiled_once};

compiled_once! {
    /// Computes the geodesic of the number of steps of the parameters, on the grid of the shapes, in whose valley a path
    /// of another number or on another grid of the same box lies: its deformations, interpolated in time and space, are
    /// the start. Lengths of such paths differ by the discretisation, and not because they are different local minima. The
    /// weight of the mismatch is the last of the given path, or a larger one.
    ///
    /// `None` for paths of level sets.
    ///
    /// # Errors
    /// As for [`geodesic_between()`](crate::geodesic_between()).
    pub fn geodesic_near<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        path: &'a Geodesic<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<Geodesic<D>>, GeodesicError> = geodesic_near_in;
}

fn geodesic_near_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: &Geodesic<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Option<Geodesic<D>>, GeodesicError> {
    check_both(start, end, params)?;
    let grid = start.grid();
    let motions = path.own_motions().iter();
    let motions: Vec<Field<f64, D, D>> = motions.map(|u| u.on_grid(grid)).collect();
    let known = path.domain.zip(path.last_level());
    let Some((domain, level)) = known.filter(|_| !motions.is_empty()) else {
        return Ok(None);
    };
    let middle = path.middle.as_ref().map(|middle| {
        let components = middle.shape.components().iter();
        Shape::of_components(components.map(|u| u.on_grid(grid)).collect())
    });
    let middle = middle.transpose()?;
    // It may lie between the nodes, where both ends do not.
    if let Some(middle) = &middle {
        middle.check("middle")?;
    }
    let known = KnownPath {
        domain,
        middle: middle.as_ref(),
        motions: &motions,
        times: None,
        mismatch_weight: level.mismatch_weight,
    };
    let found = lagrangian_path_near(start, end, known, params, observer)?;
    let result = of_domain(start, end, &found)?;
    Ok(Some(with_deformations(result, found)))
}
