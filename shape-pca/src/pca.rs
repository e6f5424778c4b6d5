//! The principal component analysis.

use crate::average::Average;
use crate::displacements::Displacements;
use crate::error::PcaError;
use crate::krylov::SolveReport;
use crate::metric::dual;
use crate::modes::{Modes, Scores};
use crate::operator::Compound;
use crate::params::PcaParams;
use crate::product::object_product;
use crate::sample::SampleSize;
use crate::space::ModeSpace;
use fe_grid::minimise::Observer;
use fe_grid::vector::{axpy, dot};
use fe_grid::{Distribution, VectorField, compiled_once, mutant};
use nalgebra::DMatrix;

/// Principal modes of variation.
#[derive(Clone, Debug)]
pub struct Pca<const D: usize> {
    /// The modes as fields, with which other shapes are scored.
    pub space: ModeSpace<D>,
    /// Centred displacements `u_k` of the shapes: `S_k` is approximately `(1 - u_k)(S)`.
    pub displacements: Vec<VectorField<f64, D>>,
    /// Imbalance of the displacements before centring, `n |sum lambda_k u_k| / sum lambda_k |u_k|`
    /// in `L^2`; for equal weights `|sum u_k|` divided by the mean of `|u_k|`. Zero if the stresses
    /// balance exactly.
    pub balance: f64,
    /// Gram matrix of the displacements.
    pub gram: DMatrix<f64>,
    /// Eigenvalues and combinations.
    pub modes: Modes,
    /// Scores of the training shapes, with the p-values of [`Mahalanobis::of_training`](crate::Mahalanobis::of_training).
    pub training: Vec<Scores>,
    /// Reports on the linear solves.
    pub solves: Vec<SolveReport>,
    /// The smallest curvature of the operator encountered, relative to linear elasticity of the
    /// same mean stiffness.
    pub least_curvature: f64,
}

compiled_once! {
    fn analyse<'a, D>(
        average: &'a Average<D>,
        compound: &'a Compound<D>,
        most: usize,
        observer: &'a mut dyn Observer,
    ) -> Result<Pca<D>, PcaError> = Pca::of_average;
}

impl<const D: usize> Pca<D> {
    /// Analyses an average; at most `most` modes are computed. The observer is given the displacements that
    /// are known, and may have them from an earlier run. Of an average that is
    /// [distributed](Average::distributed) the observer of the first process is asked. Collective.
    ///
    /// # Errors
    /// Those of the law and of the linear solves, [`PcaError::NoVariation`] if all shapes are
    /// equal.
    pub fn new(
        average: &Average<D>,
        compound: &Compound<D>,
        most: usize,
        observer: &mut dyn Observer,
    ) -> Result<Self, PcaError> {
        analyse(average, compound, most, observer)
    }

    fn of_average(
        average: &Average<D>,
        compound: &Compound<D>,
        most: usize,
        observer: &mut dyn Observer,
    ) -> Result<Self, PcaError> {
        let grid = *average.grid();
        let Displacements {
            fields: mut displacements,
            solves,
            least_curvature,
        } = Displacements::of(average, compound, observer)?;
        let weights = average.weights();
        let mut mean = VectorField::<f64, D>::zeros(grid);
        for (u, weight) in displacements.iter().zip(weights) {
            axpy(*weight, u.as_slice(), mean.as_mut_slice());
        }
        let object = average.object();
        let size = |u: &VectorField<f64, D>| {
            let u = u.as_slice();
            dot(u, &object_product(object, u)).max(0.0).sqrt()
        };
        let sizes = displacements.iter().zip(weights);
        let typical: f64 = sizes.map(|(u, weight)| weight * size(u)).sum();
        let balance = weights.len() as f64 * size(&mean) / typical.max(f64::MIN_POSITIVE);
        for u in &mut displacements {
            let share = mutant!(-1.0, CentringMissing => 0.0);
            axpy(share, mean.as_slice(), u.as_mut_slice());
        }
        let params = *compound.params();
        let distribution = average.distribution();
        let gram = gram_matrix(&params, object, compound, &displacements, distribution);
        let modes = Modes::new(&gram, weights, params.zero_eigenvalue, most)?;
        let fields = modes.combinations.iter().map(|combination| {
            let mut mode = VectorField::zeros(grid);
            for (a, u) in combination.iter().zip(&displacements) {
                axpy(*a, u.as_slice(), mode.as_mut_slice());
            }
            mode
        });
        let space = ModeSpace {
            params,
            object: object.clone(),
            mean,
            eigenvalues: modes.eigenvalues[..modes.rank()].to_vec(),
            fields: fields.collect(),
            sample: SampleSize::of_weights(weights),
        };
        let own = distribution.own().map(|i| &displacements[i]);
        let products = own.map(|u| space.products(compound, u)).collect();
        let products = distribution.share_vectors(products, space.fields.len() + 1);
        let training = products.iter().enumerate().map(|(i, own)| {
            let scores = space.scores_of(own);
            let others = SampleSize::without(weights, i);
            Scores {
                mahalanobis: scores.mahalanobis.of_training(weights[i], others),
                ..scores
            }
        });
        let training = training.collect();
        Ok(Self {
            space,
            displacements,
            balance,
            gram,
            modes,
            training,
            solves,
            least_curvature,
        })
    }

    /// Returns whether the operator is positive definite: all curvatures encountered are positive.
    pub fn definite(&self) -> bool {
        self.least_curvature > 0.0
    }

    /// Returns the eigenvalues divided by the first one.
    pub fn ratios(&self) -> Vec<f64> {
        let all = &self.modes.eigenvalues;
        all.iter().map(|l| l / all[0]).collect()
    }
}

/// The products of all displacements, of which every process computes some rows. Collective.
fn gram_matrix<const D: usize>(
    params: &PcaParams,
    object: &fe_grid::ScalarField<f64, D>,
    compound: &Compound<D>,
    displacements: &[VectorField<f64, D>],
    distribution: &Distribution,
) -> DMatrix<f64> {
    let n = displacements.len();
    let row = |i: usize| -> Vec<f64> {
        let dual = dual(params.metric, object, compound, &displacements[i]);
        let products = displacements.iter().map(|v| dot(&dual, v.as_slice()));
        products.collect()
    };
    let rows = distribution.share_vectors(distribution.own().map(row).collect(), n);
    let gram = DMatrix::from_fn(n, n, |i, j| rows[i][j]);
    // Symmetrised: the matrix is symmetric up to rounding.
    (&gram + gram.transpose()) * mutant!(0.5, GramHalved => 0.25)
}
