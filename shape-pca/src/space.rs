//! The modes as fields, and the representation of other shapes by them.

use crate::compound::Source;
use crate::error::PcaError;
use crate::metric::dual;
use crate::modes::Scores;
use crate::operator::{Compound, representation};
use crate::params::PcaParams;
use crate::sample::SampleSize;
use crate::variation::Variation;
use fe_grid::vector::{axpy, dot};
use fe_grid::{ScalarField, VectorField};

/// The affine space spanned by the modes about the average.
#[derive(Clone, Debug)]
pub struct ModeSpace<const D: usize> {
    /// The parameters of the analysis.
    pub params: PcaParams,
    /// Indicator of the average object.
    pub object: ScalarField<f64, D>,
    /// The mean subtracted from displacements to centre them, `sum_k lambda_k u_k`.
    pub mean: VectorField<f64, D>,
    /// Eigenvalues of the modes.
    pub eigenvalues: Vec<f64>,
    /// The modes `y_j`, orthonormal.
    pub fields: Vec<VectorField<f64, D>>,
    /// Number of training shapes.
    pub sample: SampleSize,
}

impl<const D: usize> ModeSpace<D> {
    /// Computes the scores of a centred displacement.
    ///
    /// # Panics
    /// If the displacement lies on another grid than the average.
    pub fn scores(&self, compound: &Compound<D>, u: &VectorField<f64, D>) -> Scores {
        self.scores_of(&self.products(compound, u))
    }

    /// Computes the inner products of a centred displacement with all modes, and then with itself.
    ///
    /// # Panics
    /// If the displacement lies on another grid than the average.
    pub fn products(&self, compound: &Compound<D>, u: &VectorField<f64, D>) -> Vec<f64> {
        assert_eq!(u.grid(), self.object.grid());
        let dual = dual(self.params.metric, &self.object, compound, u);
        let fields = self.fields.iter().chain([u]);
        fields.map(|y| dot(&dual, y.as_slice())).collect()
    }

    /// Computes the scores from these [products](Self::products).
    pub fn scores_of(&self, products: &[f64]) -> Scores {
        let (square, products) = products.split_last().unwrap_or((&0.0, &[]));
        Scores::new(products, *square, &self.eigenvalues, self.sample)
    }

    /// Computes the centred displacement of a new shape that has been deformed onto the average.
    ///
    /// # Errors
    /// Those of the law and of the linear solve.
    pub fn represent(
        &self,
        compound: &Compound<D>,
        source: Source<'_>,
    ) -> Result<VectorField<f64, D>, PcaError> {
        let (mut u, _) = representation(compound, source)?;
        axpy(-1.0, self.mean.as_slice(), u.as_mut_slice());
        Ok(u)
    }

    /// Computes the displacement of the average to a shape with these scores in the first modes, `u = sum_j
    /// score_j sqrt(Lambda_j) y_j`, plus the mean where that has a shape ([`ModeSpace::from_average`]). The
    /// shape itself is `(1 - u)(S)`.
    ///
    /// # Errors
    /// [`PcaError::TooManyScores`].
    pub fn synthesise(&self, scores: &[f64]) -> Result<VectorField<f64, D>, PcaError> {
        if scores.len() > self.fields.len() {
            return Err(PcaError::TooManyScores {
                found: scores.len(),
                modes: self.fields.len(),
            });
        }
        let mut u = VectorField::zeros(*self.object.grid());
        for ((score, lambda), mode) in scores.iter().zip(&self.eigenvalues).zip(&self.fields) {
            axpy(score * lambda.sqrt(), mode.as_slice(), u.as_mut_slice());
        }
        Ok(self.from_average(u))
    }

    /// Makes of a centred displacement that of the average.
    ///
    /// The loads of stresses sum to zero, and their mean response is an error. The mean of finite displacements
    /// is that of the shapes, `(1 - mean)(S)`, and is added.
    pub fn from_average(&self, mut centred: VectorField<f64, D>) -> VectorField<f64, D> {
        if self.params.variation == Variation::Displacement {
            axpy(1.0, self.mean.as_slice(), centred.as_mut_slice());
        }
        centred
    }
}
