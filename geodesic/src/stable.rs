//! Paths that are minima of the energy.

use crate::error::GeodesicError;
use crate::lagrangian::{OwnPath, lagrangian_path_on, stability};
use crate::params::GeodesicParams;
use crate::result::{Geodesic, of_domain, with_deformations};
use crate::shape::Shape;
use fe_grid::compiled_once;
use fe_grid::minimise::{Curvature, Observer, Status};

/// Saddle points that are left one after the other, at most: the way from each can be long.
const MOST: usize = 1;
/// A fall of the energy counts that is larger than this share of the dissipation: what the minimiser may leave.
const RESOLVED: f64 = 0.01;

/// A path with the curvature of its energy.
#[derive(Clone, Debug)]
pub struct StablePath<const D: usize> {
    /// The path.
    pub path: Geodesic<D>,
    /// The least eigenvalue of the Hessian; `None` for paths of level sets, for interrupted ones, and where it is
    /// not finite. The largest fall of the energy is that of a minimisation from beside the path, relative to
    /// the dissipation, where the eigenvalue is negative.
    pub curvature: Option<Curvature>,
    /// Saddle points that were left on the way to the path.
    pub saddles: usize,
}

compiled_once! {
    /// Goes on from a path that is a saddle point of the energy to one that is a minimum.
    ///
    /// Minimisers keep the symmetries of a start, and may end where the energy falls to either side: a path that
    /// stretches a lying ellipse into a standing one is longer than those that turn it to the left or to the right.
    /// Where the least eigenvalue of the Hessian is negative, the path is moved a little along its
    /// direction and minimised on the finest grid; the path that is found is the result if its energy is lower by a
    /// hundredth of the dissipation. Valleys that lead away from a saddle point can be long: the minimiser may end at its limit
    /// of iterations.
    ///
    /// # Errors
    /// As for [`geodesic_between`](crate::geodesic_between()).
    pub fn stable_path<'a, D>(
        start: &'a Shape<D>,
        end: &'a Shape<D>,
        path: Geodesic<D>,
        params: &'a GeodesicParams,
        observer: &'a mut dyn Observer,
    ) -> Result<StablePath<D>, GeodesicError> = stable_path_in;
}

fn stable_path_in<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    path: Geodesic<D>,
    params: &GeodesicParams,
    observer: &mut dyn Observer,
) -> Result<StablePath<D>, GeodesicError> {
    let mut found = StablePath {
        path,
        curvature: None,
        saddles: 0,
    };
    loop {
        let path = &found.path;
        let displacements = path.own_motions();
        let grid = *start.grid();
        let fits = displacements.len() == params.steps
            && displacements.iter().all(|u| *u.grid() == grid)
            && path.status != Status::Cancelled;
        let (Some(domain), Some(last), true) = (path.domain, path.last_level(), fits) else {
            return Ok(found);
        };
        let own = OwnPath {
            domain,
            displacements,
            factor: last.mismatch_weight / params.resolved_mismatch_weight(),
            dissipation: path.dissipation(),
        };
        let Some(stability) = stability(start, end, &own, params)? else {
            found.curvature = None;
            return Ok(found);
        };
        let mut curvature = stability.curvature;
        if let Some(x) = stability.beyond {
            let factor = own.factor;
            let lower = lagrangian_path_on(start, end, domain, x, factor, params, observer)?;
            let mut lower = with_deformations(of_domain(start, end, &lower)?, lower);
            let fall = (path.energy.total - lower.energy.total) / own.dissipation;
            if lower.status != Status::Cancelled {
                curvature.fall = curvature.fall.max(fall);
                if fall > RESOLVED && found.saddles < MOST {
                    lower.levels = path.levels.iter().cloned().chain(lower.levels).collect();
                    found.path = lower;
                    found.saddles += 1;
                    continue;
                }
            }
        }
        found.curvature = Some(curvature);
        return Ok(found);
    }
}
