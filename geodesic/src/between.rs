//! Geodesics between two shapes, in either form and on the best domain.

use crate::error::GeodesicError;
use crate::lagrangian::{
    Domain, LagrangianPath, lagrangian_path, lagrangian_path_back, lagrangian_path_below,
    lagrangian_path_from,
};
use crate::level_sets::{first_paths, level_set_path};
use crate::levels::Numbered;
use crate::params::{DomainChoice, Form, GeodesicParams};
use crate::result::{Geodesic, of_domain, of_level_sets, with_deformations};
use crate::shape::{Shape, check_known};
use fe_grid::compiled_once;
use fe_grid::minimise::{Observer, Status};
use fe_grid::{Field, ScalarField};

/// Computes the geodesic between two shapes given by their signed distances (positive inside) on
/// one grid.
///
/// The observer is notified of every level and iteration and may cancel; the result is then the
/// state reached so far.
///
/// # Errors
/// [`GeodesicError`] for parameters out of range, shapes on different grids or without inside or
/// outside. Failure to converge is not an error; it is reported in the status.
pub fn geodesic<const D: usize>(
    start: &ScalarField<f64, D>,
    end: &ScalarField<f64, D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    geodesic_between(
        &Shape::new(start.clone()),
        &Shape::new(end.clone()),
        params,
        observer,
    )
}

compiled_once! {
    /// Computes the geodesic between two shapes of one or several components, which may be
    /// partially hidden.
    ///
    /// Components are matched in their order. With the notes' model of a hidden part, a path of
    /// level sets restores it: the first step is matched with the visible part of the shape, and
    /// the shape after it is complete. A path of deformations of the other shape restores it, too; one
    /// of the shape that is hidden in part lacks that part at all times ([`Geodesic::whole_end`]).
    ///
    /// # Errors
    /// As for [`geodesic`], for shapes with different numbers of components, and
    /// [`GeodesicError::BothHidden`] where no difference of the shapes counts.
    pub fn geodesic_between<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Geodesic<D>, GeodesicError> = geodesic_between_in;
}

compiled_once! {
    /// Computes a geodesic of one domain, the start shape's, from given deformations of it, such as a rotation
    /// in `K` steps: displacements of `psi_1, ..., psi_K` on one of the grids of the hierarchy. It is the
    /// minimal path in whose valley these lie, which may be another one than that of
    /// [`geodesic_between()`].
    ///
    /// # Errors
    /// As for [`geodesic_between()`]; [`GeodesicError::Given`] for deformations that do not fit.
    pub fn geodesic_from<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        first: &'a [Field<f64, D, D>],
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Geodesic<D>, GeodesicError> = geodesic_from_in;
}

fn geodesic_from_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    first: &[Field<f64, D, D>],
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    check_both(start, end, params)?;
    let path = lagrangian_path_from(start, end, first, params, observer)?;
    Ok(with_deformations(of_domain(start, end, &path)?, path))
}

compiled_once! {
    /// Computes the geodesics between two shapes in both directions: from the start to the end, and
    /// from there to the start.
    ///
    /// Both are the same in the limit of small steps. The second one is minimised from the first if
    /// that reaches its end, and otherwise by itself; if only the second one does, the first is
    /// minimised from that. The lengths then differ by the discretisation in time, and not because
    /// of different local minima. Paths of level sets, and those of a prescribed domain, are
    /// computed independently.
    ///
    /// # Errors
    /// As for [`geodesic_between`].
    pub fn geodesics_both_ways<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<[Geodesic<D>; 2], GeodesicError> = geodesics_both_ways_in;
}

fn geodesics_both_ways_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<[Geodesic<D>; 2], GeodesicError> {
    check_both(start, end, params)?;
    // In an order of their own, so that the lengths do not depend on which shape is the start.
    if precedes(end, start) {
        let [back, forth] = geodesics_in_order(end, start, params, observer)?;
        return Ok([forth, back]);
    }
    geodesics_in_order(start, end, params, observer)
}

/// Whether a shape comes before another one: the first value of their signed distances that differs is smaller.
fn precedes<const D: usize>(a: &Shape<D>, b: &Shape<D>) -> bool {
    let values = |shape: &Shape<D>| {
        let components = shape.components().iter();
        components
            .flat_map(|u| u.as_slice().to_vec())
            .collect::<Vec<_>>()
    };
    values(a) < values(b)
}

fn geodesics_in_order<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<[Geodesic<D>; 2], GeodesicError> {
    let is_free = params.domain.is_free();
    if params.form != Form::Lagrangian || !is_free {
        return Ok([
            geodesic_between(start, end, params, observer)?,
            geodesic_between(end, start, params, observer)?,
        ]);
    }
    let (path, mut forth) = shortest_path(start, end, params, observer)?;
    if forth.end_near()
        && let Some(path) = lagrangian_path_back(start, end, &path, params, observer)?
    {
        let back = of_domain(end, start, &path)?;
        if back.end_near() {
            return Ok([forth, back]);
        }
    }
    let (path, back) = shortest_path(end, start, params, observer)?;
    if back.end_near()
        && !forth.end_near()
        && let Some(path) = lagrangian_path_back(end, start, &path, params, observer)?
    {
        let again = of_domain(start, end, &path)?;
        if again.end_near() {
            forth = again;
        }
    }
    Ok([forth, back])
}

fn geodesic_between_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Geodesic<D>, GeodesicError> {
    check_both(start, end, params)?;
    match params.form {
        Form::Lagrangian => {
            let (path, found) = shortest_path(start, end, params, observer)?;
            Ok(with_deformations(found, path))
        }
        Form::LevelSets => {
            let paths = first_paths(start, end, params, observer)?;
            let path = level_set_path(&paths, start, end, params, observer)?;
            of_level_sets(start, end, path)
        }
    }
}

/// Computes a path of deformations on the best domain.
///
/// Which end is better is seen on coarse grids, where thin parts that lie side by side are one. A path that does not
/// arrive is therefore computed on the other domain, too, on all grids. One that still does not, or tears and joins parts
/// that the shapes have in common, is computed on the domain of a shape between both, unless only ends are asked for.
///
/// # Errors
/// As for [`lagrangian_path`].
fn shortest_path<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<(LagrangianPath<D>, Geodesic<D>), GeodesicError> {
    let mut path = lagrangian_path(start, end, params, observer)?;
    let mut found = of_domain(start, end, &path)?;
    let is_free = params.domain.is_free();
    if !is_free || start.hidden() || end.hidden() {
        return Ok((path, found));
    }
    if !found.end_reached()
        && found.status != Status::Cancelled
        && params.law.law.inverted().is_some()
    {
        let params = GeodesicParams {
            domain: match path.domain {
                Domain::Start => DomainChoice::End,
                Domain::End | Domain::Middle => DomainChoice::Start,
            },
            ..params.clone()
        };
        let mut observer = after(&found, observer);
        let other = lagrangian_path(start, end, &params, &mut observer)?;
        (path, found) = better(start, end, (path, found), other)?;
    }
    let is_good =
        found.end_reached() && found.needless_contacts == 0 || params.domain == DomainChoice::Ends;
    if !is_good && found.status != Status::Cancelled {
        let most = if found.end_reached() {
            found.dissipation()
        } else {
            f64::INFINITY
        };
        let mut observer = after(&found, observer);
        match lagrangian_path_below(start, end, most, params, &mut observer)? {
            Ok(other) => (path, found) = better(start, end, (path, found), other)?,
            Err(levels) => {
                found.discarded_levels += levels.len();
                found.levels.extend(levels);
            }
        }
    }
    Ok((path, found))
}

/// An observer of the levels after those of a path.
fn after<'a, const D: usize>(found: &Geodesic<D>, observer: &'a mut dyn Observer) -> Numbered<'a> {
    Numbered {
        first: found.levels.len(),
        n_levels: None,
        observer,
    }
}

/// The better one of two paths, with the levels of both.
fn better<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    (path, mut found): (LagrangianPath<D>, Geodesic<D>),
    second: LagrangianPath<D>,
) -> Result<(LagrangianPath<D>, Geodesic<D>), GeodesicError> {
    let mut other = of_domain(start, end, &second)?;
    // In the order in which they were computed.
    let levels = [&*found.levels, &other.levels].concat();
    let is_cleaner = other.end_reached()
        && other.needless_contacts < found.needless_contacts
        && other.length() <= SAME_LENGTH * found.length();
    let is_better = is_cleaner || rank(&other) > rank(&found);
    Ok(if other.status != Status::Cancelled && is_better {
        other.levels = levels;
        (second, other)
    } else {
        found.discarded_levels += other.levels.len();
        found.levels = levels;
        (path, found)
    })
}

/// Of two paths whose lengths differ by less than this factor, the one that tears and joins fewer parts is better.
const SAME_LENGTH: f64 = 1.02;

/// What paths are chosen by: whether they arrive, and then their length.
fn rank<const D: usize>(found: &Geodesic<D>) -> (bool, bool, f64) {
    (found.end_reached(), found.end_near(), -found.length())
}

/// Checks the parameters and the shapes of a path.
pub(crate) fn check_both<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
) -> Result<(), GeodesicError> {
    params.check()?;
    start.check("start")?;
    end.check("end")?;
    if start.grid() != end.grid() {
        return Err(GeodesicError::GridsDiffer);
    }
    let counts = [start.components().len(), end.components().len()];
    if counts[0] != counts[1] {
        return Err(GeodesicError::Components {
            start: counts[0],
            end: counts[1],
        });
    }
    let mismatches = match params.form {
        Form::Lagrangian => 1,
        Form::LevelSets => params.steps,
    };
    check_known(start, end, mismatches)
}
