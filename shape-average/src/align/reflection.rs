//! The mismatch of a reflected shape.

use super::{AlignError, align_to_in};
use fe_grid::{Field, compiled_once, parallel};

compiled_once! {
    /// Computes the mismatch of the shape `moving` after its alignment with `reference`, and that of
    /// its reflection: both given as signed distances on one grid. Where the second is much
    /// smaller, the shape is a mirror image.
    ///
    /// # Errors
    /// As [`align_to`](super::align_to).
    pub fn mismatches<'a, D>(
        reference: &'a Field<f64, D, 1>,
        moving: &'a Field<f64, D, 1>,
    ) -> Result<[f64; 2], AlignError> = mismatches_in;
}

compiled_once! {
    /// Computes the mismatch of the reflection of the shape `moving` after its alignment with `reference`.
    ///
    /// # Errors
    /// As [`align_to`](super::align_to).
    pub fn reflected_mismatch<'a, D>(
        reference: &'a Field<f64, D, 1>,
        moving: &'a Field<f64, D, 1>,
    ) -> Result<f64, AlignError> = reflected_in;
}

fn mismatches_in<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<[f64; 2], AlignError> {
    let both = parallel::try_map([false, true], &|reflect| {
        if reflect {
            reflected_in(reference, moving)
        } else {
            Ok(align_to_in(reference, moving)?.mismatch)
        }
    })?;
    Ok([both[0], both[1]])
}

fn reflected_in<const D: usize>(
    reference: &Field<f64, D, 1>,
    moving: &Field<f64, D, 1>,
) -> Result<f64, AlignError> {
    Ok(align_to_in(reference, &reflected(moving))?.mismatch)
}

/// Reflects a shape at the middle of the box along the first axis.
fn reflected<const D: usize>(shape: &Field<f64, D, 1>) -> Field<f64, D, 1> {
    let row = shape.grid().nodes_per_axis()[0];
    let mut reflected = shape.clone();
    for nodes in reflected.as_mut_slice().chunks_exact_mut(row) {
        nodes.reverse();
    }
    reflected
}
