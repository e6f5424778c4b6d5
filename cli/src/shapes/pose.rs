//! The pose of one shape on another one.

use ::geodesic::transport_cost;
use fe_grid::ScalarField;
use shape_average::align::{Alignment, good_alignments};

use super::align::failed;
use crate::error::CliError;

/// Shapes with at most this mismatch fit each other, and are not turned: equal poses of symmetric shapes differ by
/// noise only.
const FITTING: f64 = 0.05;
/// A pose whose cost is at most this share of that of the best fit takes its place: those of shapes that are nearly
/// symmetric differ by a tenth.
const CLEARLY_LESS: f64 = 0.8;

/// Computes the rigid motion that maps one shape onto another one: that of the best overlap, unless the parts of both
/// clearly correspond better in another good one.
///
/// # Errors
/// [`CliError::Computation`] where a shape is too small to be aligned.
pub(super) fn pose<const D: usize>(
    reference: &ScalarField<f64, D>,
    moving: &ScalarField<f64, D>,
) -> Result<Alignment<D>, CliError> {
    let fits = good_alignments(reference, moving).map_err(failed)?;
    let first = fits[0];
    if fits.len() == 1 || first.mismatch <= FITTING {
        return Ok(first);
    }
    let cost = |fit: &Alignment<D>| transport_cost(&fit.motion.apply(moving), reference);
    let Some(of_first) = cost(&first) else {
        return Ok(first);
    };
    let others = fits[1..].iter().filter_map(|fit| Some((cost(fit)?, *fit)));
    let best = others.min_by(|a, b| a.0.total_cmp(&b.0));
    let better = best.filter(|(cost, _)| *cost <= CLEARLY_LESS * of_first);
    Ok(better.map_or(first, |(_, fit)| fit))
}
