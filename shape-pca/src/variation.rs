//! What represents the variation of a shape about the average, as a displacement of the average.
//!
//! With the stress of its deformation as a load ([`Variation::Stress`]) the displacement is the response of
//! linear elasticity: motions are infinitesimal, and a part that turns by a large angle grows. With the
//! deformation itself ([`Variation::Displacement`]) it is finite:
//!
//! ```text
//! u_k(x) = x - M_k phi_k^{-1}(x)   in and next to the object O,
//! ```
//!
//! with the rigid motion `M_k` that minimises `int |u_k|^2` over these nodes, weighted by the indicator of the
//! object (Kabsch, *Acta Cryst. A* 32, 1976). Then `int u_k = 0` and `int x cross u_k = 0` there, as for the
//! other variation over all nodes, and `(1 - u_k)(S) = M_k S_k`.
//! Elsewhere `u_k` is the harmonic extension: of the deformations of a void, which may be squeezed
//! to nothing, no mode should know.

use crate::compound::Source;
use crate::error::PcaError;
use crate::krylov::SolveReport;
use fe_grid::operators::MassStiffness;
use fe_grid::{
    CgParams, CgStatus, Field, Grid, HeldValues, Identity, InverseDeformation, ScalarField,
    UniformOperator, VectorField,
};
use hyperelastic::polar_rotation;
use serde::{Deserialize, Serialize};

/// What represents the variation of a shape about the average.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Variation {
    /// The linear elastic response to the stress of its deformation onto the average (Rumpf & Wirth 2011).
    #[default]
    Stress,
    /// The displacement of the average to the shape by the inverse of its deformation: parts may turn by
    /// any angle, and the stresses need not balance.
    Displacement,
}

/// Residual of the extension, relative to that of no extension. Its values only have to be smooth.
const EXTENSION_TOLERANCE: f64 = 1e-8;

/// Computes `u = x - M phi^{-1}(x)` for a deformation `phi` onto an object.
///
/// # Errors
/// [`PcaError::EmptyObject`] if the deformed box covers no node of the object.
pub(crate) fn finite_displacement<const D: usize>(
    object: &ScalarField<f64, D>,
    source: &Source<'_>,
) -> Result<(VectorField<f64, D>, SolveReport), PcaError> {
    let grid = *object.grid();
    let onto = Field::from_vec(grid, source.displacement.to_vec())?;
    let inverse = InverseDeformation::new(&onto);
    let near = near_object(object);
    let origin = |node: usize| inverse.position(node).filter(|_| near[node]);
    let back = RigidMotion::between(object, &origin).ok_or(PcaError::EmptyObject)?;
    let n = grid.n_nodes();
    let mut u = VectorField::<f64, D>::zeros(grid);
    for node in 0..n {
        if let Some(position) = origin(node) {
            let x = grid.position(grid.node(node));
            let moved = back.moved(position);
            for k in 0..D {
                u.component_mut(k)[node] = x[k] - moved[k];
            }
        }
    }
    let report = extend(&grid, &mut u, |node| origin(node).is_some())?;
    Ok((u, report))
}

/// The nodes of an object and their neighbours: those that move its boundary.
fn near_object<const D: usize>(object: &ScalarField<f64, D>) -> Vec<bool> {
    let grid = object.grid();
    let nodes = grid.nodes_per_axis();
    let strides = grid.strides();
    let mut near: Vec<bool> = object.as_slice().iter().map(|chi| *chi >= 0.5).collect();
    for k in 0..D {
        let before = near.clone();
        for (index, flag) in near.iter_mut().enumerate() {
            let at = grid.node(index)[k];
            *flag |= at > 0 && before[index - strides[k]];
            *flag |= at + 1 < nodes[k] && before[index + strides[k]];
        }
    }
    near
}

/// Replaces the displacements of all nodes that are not held by the harmonic extension of the others.
fn extend<const D: usize>(
    grid: &Grid<D>,
    u: &mut VectorField<f64, D>,
    is_held: impl Fn(usize) -> bool,
) -> Result<SolveReport, PcaError> {
    let n = grid.n_nodes();
    let held = HeldValues::new(n, is_held);
    let laplace = UniformOperator::new(
        *grid,
        MassStiffness {
            mass: 0.0,
            stiffness: 1.0,
        },
    );
    let params = CgParams {
        relative_tolerance: EXTENSION_TOLERANCE,
        // As many as there are unknowns are enough without rounding.
        max_iterations: n,
        ..CgParams::default()
    };
    let (load, plain) = (vec![0.0; n], Identity { dim: n });
    // The operator of a harmonic extension is always definite: it bounds no curvature.
    let mut report = SolveReport {
        iterations: 0,
        residual: EXTENSION_TOLERANCE,
        least_curvature: f64::MAX,
        largest_curvature: 0.0,
    };
    for k in 0..D {
        let found = held.solve(&laplace, &plain, &load, u.component_mut(k), &params)?;
        report.iterations += found.iterations;
        if found.status != CgStatus::Converged {
            return Err(PcaError::NotSolved {
                residual: found.residual,
                iterations: found.iterations,
            });
        }
    }
    Ok(report)
}

/// `x -> R (x - from) + to`.
struct RigidMotion<const D: usize> {
    rotation: [[f64; D]; D],
    from: [f64; D],
    to: [f64; D],
}

impl<const D: usize> RigidMotion<D> {
    /// The motion `M` that minimises `int_O |x - M origin(x)|^2` over the nodes with an origin; `None` where
    /// there are none in the object.
    fn between(
        object: &ScalarField<f64, D>,
        origin: &impl Fn(usize) -> Option<[f64; D]>,
    ) -> Option<Self> {
        let grid = object.grid();
        let pairs = || {
            object.as_slice().iter().enumerate().filter_map(|(i, chi)| {
                Some((chi.max(0.0), origin(i)?, grid.position(grid.node(i))))
            })
        };
        let mass: f64 = pairs().map(|(chi, ..)| chi).sum();
        if mass <= 0.0 {
            return None;
        }
        let (mut from, mut to) = ([0.0; D], [0.0; D]);
        for (chi, p, x) in pairs() {
            for k in 0..D {
                from[k] += chi / mass * p[k];
                to[k] += chi / mass * x[k];
            }
        }
        let mut covariance = [[0.0; D]; D];
        for (chi, p, x) in pairs() {
            for i in 0..D {
                for j in 0..D {
                    covariance[i][j] += chi / mass * (x[i] - to[i]) * (p[j] - from[j]);
                }
            }
        }
        // The polar rotation does not depend on the scale, but calls small matrices singular.
        let size = covariance.as_flattened().iter().map(|c| c * c).sum::<f64>();
        let scale = 1.0 / size.sqrt().max(f64::MIN_POSITIVE);
        let rotation = polar_rotation(&covariance.map(|row| row.map(|c| c * scale)));
        Some(Self { rotation, from, to })
    }

    fn moved(&self, p: [f64; D]) -> [f64; D] {
        std::array::from_fn(|i| {
            let turned: f64 = (0..D)
                .map(|j| self.rotation[i][j] * (p[j] - self.from[j]))
                .sum();
            turned + self.to[i]
        })
    }
}
