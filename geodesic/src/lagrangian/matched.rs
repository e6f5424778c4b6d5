//! What a deformation at an end of a path is matched with: the shape there, or targets of points.

use crate::cells::continued;
use crate::end_mismatch::EndMismatch;
use crate::mismatch::{ComposedMismatch, HeavisideMismatch};
use crate::shape::{KnownEnds, ShapeOnGrid};
use crate::transport::Targets;
use fe_grid::{Assembly, Data, Grid, GridError, ScalarField};
use levelset::Compact;

/// A shape that the shape of the domain is carried to.
pub(super) struct Match<const D: usize> {
    pub components: Vec<ScalarField<f64, D>>,
    pub known: KnownEnds<D>,
    /// The mismatch on its domain; `None` if it has no share.
    mismatch: Option<EndMismatch<D>>,
}

impl<const D: usize> Match<D> {
    /// The mismatch of which a share is measured on the domain of the other shape.
    pub fn new(own: &ShapeOnGrid<D>, other: ShapeOnGrid<D>, step: Compact, share: f64) -> Self {
        Self {
            known: KnownEnds::new(own, &other),
            mismatch: (share > 0.0).then(|| EndMismatch::new(own, &other, step)),
            components: other.components,
        }
    }

    /// Computes the mismatch of the components of the shape of the domain under a deformation, and adds its gradient
    /// times a weight to `out`, unless that is empty.
    pub fn value_or_gradient_add(
        &self,
        grid: &Grid<D>,
        (density, own): (HeavisideMismatch, &[ScalarField<f64, D>]),
        [of_end, weight]: [f64; 2],
        displacement: &[f64],
        out: &mut [f64],
    ) -> Result<f64, GridError> {
        let mut sum = 0.0;
        if let Some(mismatch) = &self.mismatch {
            sum += of_end * mismatch.value_or_gradient_add(displacement, of_end * weight, out);
        }
        if of_end >= 1.0 {
            return Ok(sum);
        }
        for (own, other) in own.iter().zip(&self.components) {
            let law = ComposedMismatch {
                density,
                other: continued(other),
                // Only one deformation is matched, as in a path of one step.
                visibility: self.known.in_step(1, 1),
            };
            let coefficients = [own.as_slice()];
            let data = Data {
                coefficients: &coefficients,
                cells: &[],
            };
            let assembly = Assembly::new(*grid, &law, data);
            let share = 1.0 - of_end;
            sum += share * assembly.value_or_gradient_add(displacement, share * weight, out)?;
        }
        Ok(sum)
    }
}

/// Adds the gradient of the attraction `weight v sum_i |psi(x_i) - t_i|^2` of nodes to their targets, each of
/// volume `v`, to `out` unless that
/// is empty; returns its value.
pub(super) fn attraction_add<const D: usize>(
    grid: &Grid<D>,
    targets: &Targets<D>,
    weight: f64,
    displacement: &[f64],
    out: &mut [f64],
) -> f64 {
    let (n, scale) = (grid.n_nodes(), weight * targets.spacing.powi(D as i32));
    let mut sum = 0.0;
    for (&node, target) in targets.nodes.iter().zip(&targets.points) {
        let position = grid.position(grid.node(node));
        for k in 0..D {
            let entry = k * n + node;
            let left = position[k] + displacement[entry] - target[k];
            sum += scale * left * left;
            if !out.is_empty() {
                out[entry] += 2.0 * scale * left;
            }
        }
    }
    sum
}
