//! Paths of another number of steps, from a path that is known.

use crate::between::check_both;
use crate::error::GeodesicError;
use crate::lagrangian::lagrangian_path_from_steps;
use crate::params::GeodesicParams;
use crate::result::{Geodesic, of_domain, with_deformations};
use crate::shape::Shape;
use fe_grid::compiled_once;
use fe_grid::minimise::Observer;

compiled_once! {
    /// Computes the geodesic of the number of steps of the parameters in whose valley a path of another number lies:
    /// the deformations of its domain, interpolated in time, are the start on the grid of the shapes. Lengths of such paths
    /// differ by the discretisation in time, and not because they are different local minima. The weight of the
    /// mismatch is the last of the given path, or a larger one.
    ///
    /// `None` for paths of level sets, and for a path on another grid than that of the shapes.
    ///
    /// # Errors
    /// As for [`geodesic_between()`](crate::geodesic_between()).
    pub fn geodesic_from_steps<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        path: &'a Geodesic<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<Geodesic<D>>, GeodesicError> = geodesic_from_steps_in;
}

fn geodesic_from_steps_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: &Geodesic<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Option<Geodesic<D>>, GeodesicError> {
    check_both(start, end, params)?;
    let known = path.domain.zip(path.last_level());
    let motions = path.own_motions();
    let is_here = motions.iter().all(|u| u.grid() == start.grid());
    let Some((domain, level)) = known.filter(|_| is_here && !motions.is_empty()) else {
        return Ok(None);
    };
    let middle = path.middle.as_ref().map(|middle| &middle.shape);
    let from = (domain, middle, motions, level.mismatch_weight);
    let found = lagrangian_path_from_steps(start, end, from, params, observer)?;
    let result = of_domain(start, end, &found)?;
    Ok(Some(with_deformations(result, found)))
}
