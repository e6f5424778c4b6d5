//! Parameters of an average.

use crate::error::AverageError;
use fe_grid::{Grid, Storage, mutant};
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// The largest number of nodes of a level in 3D that is minimised in double precision by default.
const LARGEST_IN_DOUBLE: usize = 65 * 65 * 65;

/// Algorithm that minimises the energy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// L-BFGS in the Gauss-Newton metric, with the average eliminated.
    #[default]
    Lbfgs,
    /// Alternate between solving for the average and gradient descent in H^1.
    Descent,
}

/// Which mean to minimise: the weighted sum of the elastic energies (arithmetic) or of their square
/// roots (median, robust to outliers).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Mean {
    /// Weighted sum of the energies: the average.
    #[default]
    Arithmetic,
    /// Weighted sum of their square roots: the median, robust to outliers.
    Median,
}

/// Precision of the vectors of the minimiser and of its metric. All is computed in double precision, except
/// for the metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// Double for the state, its gradients and the normal equations of the average; single for the L-BFGS
    /// pairs and the metric.
    Double,
    /// Single for the state, its gradients and the matrix of the normal equations; a byte a number for the
    /// pairs, and 16 bits for the metric.
    Mixed,
}

/// Boundary condition for the deformations on the faces of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum BoundaryCondition {
    /// Free faces (no constraint).
    #[default]
    Natural,
    /// Fixed faces (identity).
    Identity,
}

/// Parameters of an average, dimensionless: the box has side one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(deny_unknown_fields, default)]
pub struct AverageParams {
    /// Stored energy density with its Lamé parameters.
    #[serde(flatten)]
    #[cfg_attr(feature = "clap", command(flatten))]
    pub law: LawSpec,
    /// Weight gamma of the mismatch between the shapes and the average.
    #[cfg_attr(feature = "clap", arg(long))]
    pub mismatch_weight: f64,
    /// Weight of the boundary length of the average [default: 1e-4 times the mismatch weight].
    #[cfg_attr(feature = "clap", arg(long))]
    pub length_weight: Option<f64>,
    /// Stiffness of the void outside the objects, relative to the objects; above 0, at most 1.
    #[cfg_attr(feature = "clap", arg(long))]
    pub void_stiffness: f64,
    /// Interface width epsilon of the phase fields on every level, in grid spacings.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub interface_cells: f64,
    /// Weights of the shapes, non-negative and of sum 1 [default: equal]. Shapes of weight 0 do not
    /// influence the average and are deformed onto it afterwards.
    #[cfg_attr(
        feature = "clap",
        arg(
            long,
            value_name = "W,W,..",
            allow_hyphen_values = true,
            value_delimiter = ','
        )
    )]
    pub weights: Option<Vec<f64>>,
    /// Which mean to minimise: the weighted sum of elastic energies (arithmetic) or of their square
    /// roots (median, robust to outliers).
    #[cfg_attr(feature = "clap", arg(long, value_enum))]
    pub mean: Mean,
    /// Median only: elastic energy at which a shape has the same influence as in the average
    /// [default: the median of the elastic energies at the average].
    #[cfg_attr(feature = "clap", arg(long, value_name = "E", hide_short_help = true))]
    pub median_reference: Option<f64>,
    /// Algorithm that minimises the energy.
    #[cfg_attr(feature = "clap", arg(long, value_enum))]
    pub solver: Solver,
    /// Boundary condition for the deformations on the faces of the box.
    #[cfg_attr(feature = "clap", arg(long, value_enum))]
    pub boundary: BoundaryCondition,
    /// Number of nodes along the longest side of the coarsest grid.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", hide_short_help = true))]
    pub coarsest_nodes: usize,
    /// Stopping tolerance: the minimisation ends when five iterations lower the energy by less than
    /// this share of the elastic energy, or the next one is expected to lower it by less than a fifth
    /// of that. Coarser levels have 0.3 times the tolerance. With unequal weights it is multiplied by
    /// the smallest weight relative to equal weights, or by 0.1. With --joint, a level ends when a round lowers the
    /// energy by less than a fifth of this share of itself, and the last one when at most twenty times this share of the
    /// elastic energy is expected to remain.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SHARE"))]
    pub tolerance: f64,
    /// Maximum number of iterations per level.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub max_iterations: usize,
    /// Lower bound of the Jacobian determinant of every accepted deformation on all cells; at most
    /// 0.9.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub min_determinant: f64,
    /// Descent only: filter width sigma of the H^1 inner product, in units of the square root of
    /// the grid spacing.
    #[cfg_attr(feature = "clap", arg(long, hide_short_help = true))]
    pub filter_width: f64,
    /// Descent only: gradient steps per shape between two solves for the average.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", hide_short_help = true))]
    pub descent_steps: usize,
    /// Precision of the vectors of the minimiser and of its metric [default: mixed on the levels of a
    /// 3D grid with more than 65^3 nodes, which halves the memory, otherwise double].
    #[cfg_attr(feature = "clap", arg(long, value_enum, hide_short_help = true))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub precision: Option<Precision>,
    /// Storage of the minimiser's vectors. If it is a folder, shapes are processed one after the
    /// other. The results do not depend on it.
    #[serde(skip)]
    #[cfg_attr(feature = "clap", arg(skip))]
    pub storage: Storage,
    /// Whether the metric of each shape is recomputed whenever it is applied, for which the state is kept
    /// that it is computed from: half as much work again. The results do not depend on it.
    #[serde(skip)]
    #[cfg_attr(feature = "clap", arg(skip))]
    pub remakes_metrics: bool,
}

impl Default for AverageParams {
    fn default() -> Self {
        Self {
            law: LawSpec::default(),
            mismatch_weight: 1.0,
            length_weight: None,
            void_stiffness: 1e-4,
            interface_cells: 2.0,
            weights: None,
            mean: Mean::default(),
            median_reference: None,
            solver: Solver::default(),
            boundary: BoundaryCondition::default(),
            coarsest_nodes: 9,
            tolerance: 5e-3,
            max_iterations: 100,
            min_determinant: 1e-3,
            filter_width: 10f64.sqrt(),
            descent_steps: 10,
            precision: None,
            storage: Storage::Memory,
            remakes_metrics: false,
        }
    }
}

impl AverageParams {
    /// Returns the length weight, with the default resolved.
    pub fn resolved_length_weight(&self) -> f64 {
        self.length_weight.unwrap_or(1e-4 * self.mismatch_weight)
    }

    /// Returns the precision on a level, with the default resolved.
    pub fn precision_on<const D: usize>(&self, grid: &Grid<D>) -> Precision {
        let large = D == 3 && grid.n_nodes() > LARGEST_IN_DOUBLE;
        self.precision.unwrap_or(if large {
            Precision::Mixed
        } else {
            Precision::Double
        })
    }

    /// Returns the weights of `n` shapes, with the default resolved.
    pub fn resolved_weights(&self, n: usize) -> Vec<f64> {
        let given = mutant!(self.weights.clone(), WeightsIgnored => None);
        given.unwrap_or_else(|| vec![1.0 / n as f64; n])
    }

    /// Checks all parameters for `n` shapes but the law, whose bounds depend on the dimension: that is checked by
    /// [`LawSpec::compile`](hyperelastic::LawSpec::compile).
    ///
    /// # Errors
    /// [`AverageError::Parameter`] or [`AverageError::Weights`] with the value found.
    pub fn check(&self, n: usize) -> Result<(), AverageError> {
        let positive = |name, value: f64| {
            if (1e-18..=1e12).contains(&value) {
                return Ok(());
            }
            Err(AverageError::Parameter {
                name,
                expected: "a positive number from 1e-18 to 1e12",
                value,
            })
        };
        positive("mismatch_weight", self.mismatch_weight)?;
        positive("length_weight", self.resolved_length_weight())?;
        positive("void_stiffness", self.void_stiffness)?;
        positive("interface_cells", self.interface_cells)?;
        positive("tolerance", self.tolerance)?;
        positive("min_determinant", self.min_determinant)?;
        positive("filter_width", self.filter_width)?;
        if let Some(reference) = self.median_reference {
            positive("median_reference", reference)?;
        }
        let within = |name, expected, value: f64, bound: f64| {
            if value <= bound {
                Ok(())
            } else {
                Err(AverageError::Parameter {
                    name,
                    expected,
                    value,
                })
            }
        };
        // Larger ones stop before the first iteration.
        within("tolerance", "below 1, at most 0.5", self.tolerance, 0.5)?;
        within("interface_cells", "at most 1000", self.interface_cells, 1e3)?;
        within("void_stiffness", "at most 1", self.void_stiffness, 1.0)?;
        within("min_determinant", "below 1", self.min_determinant, 0.9)?;
        if self.solver == Solver::Descent && self.descent_steps == 0 {
            let (name, expected, value) = ("descent_steps", "at least 1", 0.0);
            return Err(AverageError::Parameter {
                name,
                expected,
                value,
            });
        }
        if let Some(weights) = &self.weights {
            let sum: f64 = weights.iter().sum();
            let bad = weights.iter().any(|w| w.is_nan() || *w < 0.0) || (sum - 1.0).abs() > 1e-9;
            if weights.len() != n || bad {
                return Err(AverageError::Weights {
                    expected: n,
                    weights: weights.clone(),
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_large_levels_in_space_are_mixed_by_default() {
        let params = AverageParams::default();
        let of = |params: &AverageParams, n| params.precision_on(&Grid::<3>::cube(n));
        assert_eq!(of(&params, 65), Precision::Double);
        assert_eq!(of(&params, 67), Precision::Mixed);
        let plane = Grid::<2>::cube(1025);
        assert_eq!(params.precision_on(&plane), Precision::Double);
        for precision in [Precision::Double, Precision::Mixed] {
            let params = AverageParams {
                precision: Some(precision),
                ..AverageParams::default()
            };
            assert!(of(&params, 9) == precision && params.precision_on(&plane) == precision);
        }
    }
}
