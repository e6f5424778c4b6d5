//! The action of the Hessian of the energy of a path.

use super::objective::PathObjective;
use crate::error::GeodesicError;
use fe_grid::minimise::SecondOrder;
use fe_grid::mutant;
use fe_grid::vector::{add_scaled_into, axpy, fill, max_abs};

/// Gradients of the smooth terms are compared over steps that move the farthest node by this many spacings.
const SMOOTH_STEP: f64 = 1e-4;
/// Gradients of the mismatch are compared over steps that move the farthest node at the boundary by this many
/// spacings: less than the width of its smooth step, and enough for the kinks at the faces of cells to average out.
const MATCHED_STEP: f64 = 0.25;

/// By central differences of gradients. Those of the elastic energies and of the barrier have small steps;
/// that of the mismatch, which has kinks wherever a boundary meets the face of a cell, has a larger one, and
/// nodes far from the boundary are held. The action is not a number where a state folds.
impl<const D: usize> SecondOrder for PathObjective<D> {
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), GeodesicError> {
        fill(0.0, out);
        let h = self.grid().spacing();
        let largest = max_abs(direction);
        if largest == 0.0 {
            return Ok(());
        }
        let (mut moved, mut gradient) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        let step = SMOOTH_STEP * h / largest;
        for sign in [1.0, -1.0] {
            add_scaled_into(x, sign * step, direction, &mut moved);
            if !self.smooth_gradient(&moved, &mut gradient)? {
                fill(f64::NAN, out);
                return Ok(());
            }
            let half = mutant!(0.5, PathHessianSign => -0.5);
            axpy(sign * half / step, &gradient, out);
        }
        drop(gradient);
        let last = x.len() - x.len() / self.steps();
        let near = self.matched_nodes();
        let mut own = direction[last..].to_vec();
        for component in own.chunks_exact_mut(near.len()) {
            for (value, near) in component.iter_mut().zip(&near) {
                if !near {
                    *value = 0.0;
                }
            }
        }
        let largest = max_abs(&own);
        if largest == 0.0 {
            return Ok(());
        }
        let step = MATCHED_STEP * h / largest;
        let moved = &mut moved[last..];
        for sign in [1.0, -1.0] {
            add_scaled_into(&x[last..], sign * step, &own, moved);
            self.mismatch_gradient_add(moved, sign * 0.5 / step, &mut out[last..])?;
        }
        Ok(())
    }
}
