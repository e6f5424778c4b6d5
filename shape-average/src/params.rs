//! Parameters of an average.

use crate::error::AverageError;
use fe_grid::Storage;
use hyperelastic::LawSpec;
use serde::{Deserialize, Serialize};

/// How the functional is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Solver {
    /// The average eliminated, L-BFGS in the Gauss–Newton metric.
    #[default]
    Lbfgs,
    /// The lecture notes' alternation: solve for the average, then descend in `H^1`.
    Descent,
}

/// What of the energies of the shapes is least.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mean {
    /// Their weighted sum: the average.
    #[default]
    Arithmetic,
    /// The sum of roots, which are like distances: the median, which a few shapes of another kind
    /// move little. Of every shape the root is taken of all that is its own,
    /// `e_i = lambda_i W_i + gamma/n (F_i - min F_i)`: a shape that cannot be deformed onto the
    /// others would otherwise pull by its mismatch. Each term is
    /// `2 sqrt(e0) (sqrt(e_i + s^2) - s)` with `s^2 = e0/100`, smooth at zero, and of slope about one
    /// where `e_i` is the reference `e0`.
    ///
    /// It is found by rounds of averages whose terms are multiplied by the slopes at the last one,
    /// which lower the sum of roots (the root is concave).
    Median {
        /// `e0`; where it is not given, the median of the `e_i` of the arithmetic mean, which is
        /// computed first.
        reference: Option<f64>,
    },
}

impl Mean {
    /// The reference energy of a median, where it is given.
    pub(crate) fn reference(self) -> Option<f64> {
        match self {
            Self::Arithmetic => None,
            Self::Median { reference } => reference,
        }
    }
}

/// What holds the deformations at the faces of the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoundaryCondition {
    /// Nothing: the soft void around the object gives way.
    #[default]
    Natural,
    /// The identity.
    Identity,
}

/// Parameters of an average. All are dimensionless: the box has side one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AverageParams {
    /// Stored energy density with its moduli.
    pub law: LawSpec,
    /// Weight `gamma` of the mismatch.
    pub mismatch_weight: f64,
    /// Weight `mu_L` of the length of the average's interface; `1e-4` times the mismatch weight
    /// where it is not given.
    pub length_weight: Option<f64>,
    /// Stiffness `delta` of the void, relative to the object; above 0, at most 1.
    pub void_stiffness: f64,
    /// Interface width `epsilon` of the phase fields on every level, in grid spacings.
    pub interface_cells: f64,
    /// Weights `lambda_i` of the shapes, not negative and of sum one; equal where not given. Shapes
    /// of weight zero have no say in the average and are deformed onto it afterwards.
    pub weights: Option<Vec<f64>>,
    /// What of the energies of the shapes is least.
    pub mean: Mean,
    /// How the functional is minimised.
    pub solver: Solver,
    /// What holds the deformations at the faces of the box.
    pub boundary: BoundaryCondition,
    /// Nodes along the longest side of the coarsest level.
    pub coarsest_nodes: usize,
    /// A level ends when five iterations lower the energy by less than this share of what it
    /// lies above the least possible mismatch, or when the next promises less than a tenth of it.
    /// Where weights differ it is multiplied by the least weight over that of equal ones, or 0.1.
    pub tolerance: f64,
    /// Most iterations on a level.
    pub max_iterations: usize,
    /// Every accepted deformation has a determinant above this on all cells; at most 0.9.
    pub min_determinant: f64,
    /// Descent only: width `sigma` of the filter in the `H^1` inner product
    /// `(.,.) + sigma^2/2 (D., D.)`, in units of the square root of the grid spacing.
    pub filter_width: f64,
    /// Descent only: gradient steps for each shape between two solves for the average.
    pub descent_steps: usize,
    /// Where the vectors of the minimiser are kept. In a folder, shapes are worked on one after
    /// the other, and the metric of each is made anew whenever it is applied. No result depends
    /// on it.
    #[serde(skip)]
    pub storage: Storage,
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
            solver: Solver::default(),
            boundary: BoundaryCondition::default(),
            coarsest_nodes: 9,
            tolerance: 2e-4,
            max_iterations: 100,
            min_determinant: 1e-3,
            filter_width: 10f64.sqrt(),
            descent_steps: 10,
            storage: Storage::Memory,
        }
    }
}

impl AverageParams {
    /// The length weight that is in force.
    pub fn resolved_length_weight(&self) -> f64 {
        self.length_weight.unwrap_or(1e-4 * self.mismatch_weight)
    }

    /// The weights that are in force for `n` shapes.
    pub fn resolved_weights(&self, n: usize) -> Vec<f64> {
        self.weights
            .clone()
            .unwrap_or_else(|| vec![1.0 / n as f64; n])
    }

    /// Checks all values for `n` shapes.
    ///
    /// # Errors
    /// [`AverageError::Parameter`] or [`AverageError::Weights`] with what was found, and
    /// [`AverageError::Law`] where the law cannot be made.
    pub fn check(&self, n: usize) -> Result<(), AverageError> {
        let positive = |name, value: f64| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            Err(AverageError::Parameter {
                name,
                expected: "a positive number",
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
        if let Mean::Median {
            reference: Some(reference),
        } = self.mean
        {
            positive("reference", reference)?;
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
        within("void_stiffness", "at most 1", self.void_stiffness, 1.0)?;
        within("min_determinant", "below 1", self.min_determinant, 0.9)?;
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
