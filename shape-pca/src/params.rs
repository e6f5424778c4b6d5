//! Parameters of an analysis.

use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// The inner product `g` of displacements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// `int_O u . v`.
    #[default]
    L2,
    /// `sum_i lambda_i int W_,AA[Dphi_i] D(u o phi_i) : D(v o phi_i)`: what is hard to deform
    /// counts more. Not `int C e[u] : e[v]`: under prestress the two differ.
    Hessian,
}

/// Parameters of an analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PcaParams {
    /// Stored energy density of the average.
    pub law: LawSpec,
    /// Stiffness of the void of the average, relative to the object.
    pub void_stiffness: f64,
    /// Inner product of displacements.
    pub metric: Metric,
    /// Whether the compound object is under the stresses of all deformations, as the theory has
    /// it; otherwise it is the same law at rest, under the same loads.
    pub prestressed: bool,
    /// Whether the void around the object is at rest. Left as the deformations leave it, it is in
    /// places compressed to next to nothing, with a tangent that is indefinite and large and a
    /// stress that pushes the object, although it is only a device. The theory knows the object
    /// alone; a void at rest holds what the deformations of the object leave free.
    pub void_at_rest: bool,
    /// Linear problems are solved until the residual is this share of the load.
    pub tolerance: f64,
    /// Most iterations of a linear solve.
    pub max_iterations: usize,
    /// Eigenvalues below this share of the first are zero.
    pub zero_eigenvalue: f64,
}

impl Default for PcaParams {
    fn default() -> Self {
        Self {
            law: LawSpec::default(),
            void_stiffness: 1e-4,
            metric: Metric::default(),
            prestressed: true,
            void_at_rest: true,
            tolerance: 1e-9,
            max_iterations: 2000,
            zero_eigenvalue: 1e-10,
        }
    }
}
