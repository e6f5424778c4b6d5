//! Parameters of a principal component analysis.

use crate::PcaError;
use crate::variation::Variation;
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// Inner product of displacements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Integral of `u . v` over the average object.
    #[default]
    L2,
    /// Second variation of the elastic energy, which gives stiff parts more weight.
    //
    // `sum_i lambda_i int W_,AA[Dphi_i] D(u o phi_i) : D(v o phi_i)`, not `int C e[u] : e[v]`: under
    // prestress the two differ.
    Hessian,
}

/// Parameters of a principal component analysis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields, default)]
pub struct PcaParams {
    /// Stored energy density of the average; written only where it differs from the default.
    #[serde(flatten, skip_serializing_if = "is_default")]
    #[cfg_attr(feature = "clap", arg(skip))]
    pub law: LawSpec,
    /// Stiffness of the void of the average, relative to the object; written only where it differs
    /// from the default.
    #[serde(skip_serializing_if = "is_usual_stiffness")]
    #[cfg_attr(feature = "clap", arg(skip = USUAL_STIFFNESS))]
    pub void_stiffness: f64,
    /// Inner product of displacements.
    #[cfg_attr(feature = "clap", arg(long, value_enum))]
    pub metric: Metric,
    /// What represents the variation of a shape.
    #[cfg_attr(feature = "clap", arg(long, value_enum))]
    pub variation: Variation,
    /// Linearise about the unstressed average, without the stresses of the deformations but under
    /// the same loads.
    #[cfg_attr(feature = "clap", arg(long))]
    pub at_rest: bool,
    /// Linearise the void around the object about its unstressed state.
    ///
    /// In the deformed state, parts of the void are compressed to almost nothing: their tangent is
    /// large and indefinite and their stress acts on the object, although the void is only a
    /// numerical device. The theory involves the object alone; an unstressed void only holds what
    /// the deformations of the object leave undetermined.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub void_at_rest: bool,
    /// Tolerance of the linear solver: residual relative to the load.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE"))]
    pub tolerance: f64,
    /// Maximum number of iterations of the linear solver.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", hide_short_help = true))]
    pub max_iterations: usize,
    /// Eigenvalues smaller than this, relative to the first, are treated as zero.
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "SHARE", hide_short_help = true)
    )]
    pub zero_eigenvalue: f64,
}

/// Default stiffness of the void of an average.
const USUAL_STIFFNESS: f64 = 1e-4;

fn is_default(law: &LawSpec) -> bool {
    *law == LawSpec::default()
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_usual_stiffness(stiffness: &f64) -> bool {
    *stiffness == USUAL_STIFFNESS
}

impl Default for PcaParams {
    fn default() -> Self {
        Self {
            law: LawSpec::default(),
            void_stiffness: USUAL_STIFFNESS,
            metric: Metric::default(),
            variation: Variation::default(),
            at_rest: false,
            void_at_rest: true,
            tolerance: 1e-9,
            max_iterations: 2000,
            zero_eigenvalue: 1e-10,
        }
    }
}

impl PcaParams {
    /// Checks all parameters.
    ///
    /// # Errors
    /// [`PcaError::Parameter`] with the value found.
    pub fn check(&self) -> Result<(), PcaError> {
        let bad = |name, expected, value| {
            Err(PcaError::Parameter {
                name,
                expected,
                value,
            })
        };
        for (name, value) in [
            ("void_stiffness", self.void_stiffness),
            ("tolerance", self.tolerance),
            ("zero_eigenvalue", self.zero_eigenvalue),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return bad(name, "a positive number", value);
            }
        }
        // With larger ones the modes are those of the first iteration, and none are left.
        for (name, value) in [
            ("tolerance", self.tolerance),
            ("zero_eigenvalue", self.zero_eigenvalue),
        ] {
            if value > 0.1 {
                return bad(name, "at most 0.1", value);
            }
        }
        if self.void_stiffness > 1.0 {
            return bad("void_stiffness", "at most 1", self.void_stiffness);
        }
        if self.max_iterations == 0 {
            return bad("max_iterations", "at least 1", 0.0);
        }
        Ok(())
    }
}
