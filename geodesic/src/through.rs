//! Paths from the way through a third shape.

use crate::between::check_both;
use crate::error::GeodesicError;
use crate::lagrangian::{
    Between, Domain, KnownPath, lagrangian_path, lagrangian_path_back, lagrangian_path_near,
    weight_on,
};
use crate::overlap::carried_overlaps;
use crate::params::{DomainChoice, Form, GeodesicParams};
use crate::result::{Geodesic, of_domain, with_deformations};
use crate::shape::Shape;
use fe_grid::minimise::Observer;
use fe_grid::{Field, compiled_once};

compiled_once! {
    /// Computes the geodesics between two shapes in both directions, in whose valley the way through a third shape lies.
    ///
    /// The shortest way between two shapes is at most as long as that through any other one. Where the path of
    /// [`geodesics_both_ways()`](crate::geodesics_both_ways()) is longer, it is a local minimum; and where it does not arrive, the way
    /// through a shape between both may, since each of its parts is shorter. Both parts are computed as deformations of the
    /// third shape, `chi_1, ..., chi_K` into the shapes on the way to the start and `omega_1, ..., omega_K` to the end;
    /// `chi_K, ..., chi_1, id, omega_1, ..., omega_K` are deformations of one shape into all shapes of the whole way
    /// ([`Domain::Middle`]). Those at steps of equal length are the start of the minimisation, in which the third shape is
    /// left: only its topology remains.
    ///
    /// `None` for paths of level sets, for shapes of which a part is hidden, and where a part of the way does not arrive or
    /// is cancelled.
    ///
    /// # Errors
    /// As for [`geodesic_between()`](crate::geodesic_between()).
    pub fn geodesics_through<'a, D>(
        start: &'a Shape<D>,
        through: &'a Shape<D>,
        end: &'a Shape<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<Option<[Geodesic<D>; 2]>, GeodesicError> = geodesics_through_in;
}

fn geodesics_through_in<const D: usize>(
    start: &Shape<D>,
    through: &Shape<D>,
    end: &Shape<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<Option<[Geodesic<D>; 2]>, GeodesicError> {
    let ends = [start, end];
    for to in ends {
        check_both(through, to, params)?;
    }
    let hidden = ends.iter().any(|shape| shape.hidden()) || through.hidden();
    if params.form != Form::Lagrangian || hidden {
        return Ok(None);
    }
    // As deformations of the third shape: those on another domain would have to be inverted, and fold where they press the
    // void together.
    let outwards = GeodesicParams {
        domain: DomainChoice::Start,
        ..params.clone()
    };
    let mut weight = 0.0_f64;
    let (mut parts, mut levels) = (Vec::with_capacity(2), Vec::new());
    let mut lengths = [0.0; 2];
    for (to, length) in ends.into_iter().zip(&mut lengths) {
        let part = lagrangian_path(through, to, &outwards, observer)?;
        let last = part.levels.last();
        // A cancelled one is on a coarser grid.
        let is_whole = part.displacements.len() == params.steps
            && part
                .displacements
                .iter()
                .all(|u| u.grid() == through.grid());
        let Some(last_motion) = part.displacements.last().filter(|_| is_whole) else {
            return Ok(None);
        };
        if !carried_overlaps(through, to, last_motion)?.end().near() {
            return Ok(None);
        }
        weight = last.map_or(weight, |level| weight.max(level.mismatch_weight));
        *length = last.map_or(0.0, |level| level.energy.length());
        levels.extend(part.levels);
        parts.push(part.displacements);
    }
    let mut motions: Vec<Field<f64, D, D>> = Vec::with_capacity(2 * params.steps + 1);
    motions.extend(parts[0].drain(..).rev());
    motions.push(Field::zeros(*through.grid()));
    motions.append(&mut parts[1]);
    let known = KnownPath {
        domain: Domain::Middle,
        middle: Some(through),
        motions: &motions,
        times: Some(at_constant_speed(lengths, params.steps)),
        mismatch_weight: weight * weight_on(Domain::Middle),
    };
    let there = lagrangian_path_near(start, end, known, params, observer)?;
    let Some(back) = lagrangian_path_back(start, end, &there, params, observer)? else {
        return Ok(None);
    };
    let mut found = of_domain(start, end, &there)?;
    levels.append(&mut found.levels);
    found.levels = levels;
    let found_back = of_domain(end, start, &back)?;
    Ok(Some([
        with_deformations(found, there),
        with_deformations(found_back, back),
    ]))
}

/// The times of steps of equal lengths on a way of two parts, among the deformations of as many steps of each.
fn at_constant_speed(lengths: [f64; 2], steps: usize) -> Vec<Between> {
    let whole: f64 = lengths.iter().sum();
    let at = |k: usize| {
        let way = whole * k as f64 / steps as f64;
        let time = if way < lengths[0] {
            way / lengths[0]
        } else {
            let second = (way - lengths[0]) / lengths[1];
            // A part may have no length.
            1.0 + if second.is_finite() { second } else { 1.0 }
        };
        let time = (time * steps as f64).min(2.0 * steps as f64);
        (time.floor() as usize, time.fract())
    };
    // The ends are those of the parts.
    let mut times: Vec<Between> = (0..=steps).map(at).collect();
    times[steps] = (2 * steps, 0.0);
    times
}
