//! The principal component analysis.

use crate::average::Average;
use crate::error::PcaError;
use crate::krylov::SolveReport;
use crate::metric::dual;
use crate::modes::{Modes, Scores};
use crate::operator::{Compound, representation};
use crate::params::PcaParams;
use crate::product::object_product;
use crate::space::ModeSpace;
use fe_grid::minimise::{Memory, Observer};
use fe_grid::vector::{axpy, dot};
use fe_grid::{VectorField, compiled_once, mutant};
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
    /// Scores of the training shapes.
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
    /// Analyses an average; at most `most` modes are computed. The observer is given the displacement of
    /// every shape, and may have it from an earlier run.
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
        let (mut displacements, mut solves) = (Vec::new(), Vec::new());
        for i in 0..average.n_shapes() {
            let (u, report) = remembered(compound, average, i, observer)?;
            displacements.push(u);
            solves.push(report);
        }
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
        let gram = gram_matrix(&params, object, compound, &displacements);
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
            n_shapes: weights.len(),
        };
        let training = displacements
            .iter()
            .map(|u| space.scores(compound, u))
            .collect();
        let rough = compound.look_for_curvature().least_curvature;
        let least_curvature = solves
            .iter()
            .map(|solve: &SolveReport| solve.least_curvature)
            .fold(rough, f64::min);
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

/// The displacement of a shape, from an earlier run if the observer has it.
fn remembered<const D: usize>(
    compound: &Compound<D>,
    average: &Average<D>,
    shape: usize,
    observer: &mut dyn Observer,
) -> Result<(VectorField<f64, D>, SolveReport), PcaError> {
    let grid = *average.grid();
    let memory = observer.resume();
    let dim = D * grid.n_nodes();
    if let Some((u, numbers)) = memory.as_ref().and_then(|memory| memory.result(dim)) {
        let u = VectorField::from_vec(grid, u.to_vec())?;
        return Ok((u, SolveReport::of_numbers(numbers)));
    }
    let (u, report) = representation(compound, average.source(shape))?;
    observer.memory(&Memory::of_result(u.as_slice(), report.to_numbers().into()));
    Ok((u, report))
}

fn gram_matrix<const D: usize>(
    params: &PcaParams,
    object: &fe_grid::ScalarField<f64, D>,
    compound: &Compound<D>,
    displacements: &[VectorField<f64, D>],
) -> DMatrix<f64> {
    let n = displacements.len();
    let mut gram = DMatrix::zeros(n, n);
    for (i, u) in displacements.iter().enumerate() {
        let dual = dual(params.metric, object, compound, u);
        for (j, v) in displacements.iter().enumerate() {
            gram[(i, j)] = dot(&dual, v.as_slice());
        }
    }
    // Symmetrised: the matrix is symmetric up to rounding.
    (&gram + gram.transpose()) * mutant!(0.5, GramHalved => 0.25)
}
