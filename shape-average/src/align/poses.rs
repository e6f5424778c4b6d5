//! The good poses of a shape on another one, not the best alone.

use fe_grid::{Field, compiled_once, parallel};

use super::matching::Matching;
use super::{
    AlignError, Alignment, N_COARSE, RigidMotion, Target, at, checked, distinct, scored, starts,
};

/// How many of the starts with the least mismatch are refined, relative to the poses that are returned.
const REFINED: usize = 3;

compiled_once! {
    /// Computes the motions that map the shape `moving` onto the shape `reference` with a locally least
    /// mismatch, the least one first, as signed distances on one grid: at most a dozen. Those that are
    /// closer to a better one than .08 (2D) or .3 (3D) radians are left out. They are found to the
    /// resolution of a coarse set of nodes; [`align_to`](super::align_to) refines the best.
    ///
    /// # Errors
    /// As [`align_to`](super::align_to).
    pub fn poses<'a, D>(
        reference: &'a Field<f64, D, 1>,
        moving: &'a Field<f64, D, 1>,
    ) -> Result<Vec<Alignment<D>>, AlignError> = poses_in;
}

fn poses_in<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<Vec<Alignment<D>>, AlignError> {
    let shapes = checked(&[reference, moving], &[])?;
    let target = Target::new(&shapes[..1], &[RigidMotion::identity()])?;
    let coarse = Matching::new(&target.coarse, &shapes[1]).map_err(|source| at(1, source))?;
    let scored = scored(&coarse);
    let separation = starts::SEPARATION[usize::from(D == 3)];
    let all = distinct(None, &scored, separation, REFINED * N_COARSE);
    let mut refined = parallel::map(all.iter(), &|pose| coarse.refine(pose));
    refined.sort_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = distinct(None, &refined, separation, N_COARSE);
    let found = chosen.iter().map(|pose| Alignment {
        motion: coarse.motion(pose),
        mismatch: coarse.relative(coarse.difference(pose)),
    });
    Ok(found.collect())
}
