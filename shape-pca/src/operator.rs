//! The compound operator: assembly, preconditioner and constraints.

use crate::average::Average;
use crate::compound::{Source, evaluate};
use crate::error::PcaError;
use crate::krylov::{self, Negative, SolveReport};
use crate::params::PcaParams;
use crate::rigid::RigidMotions;
use crate::variation::{Variation, finite_displacement};
use fe_grid::multigrid::MultigridParams;
use fe_grid::pullback::Derivatives;
use fe_grid::stencil::BlockStencil;
use fe_grid::{Field, Grid, LinearOperator, ScalarField, VectorField, compiled_once, mutant};
use hyperelastic::{CompiledLaw, Corotational, CorotationalMultigrid, LameModuli};

/// The operator `K`, `w . K u = int C Du : Dw`, on displacements without rigid part.
pub struct Compound<const D: usize> {
    params: PcaParams,
    law: CompiledLaw<D>,
    grid: Grid<D>,
    stiffness: BlockStencil<D, D>,
    cycle: CorotationalMultigrid<D>,
    rigid: RigidMotions,
    object: ScalarField<f64, D>,
    imbalance: Vec<f64>,
    energy: f64,
}

compiled_once! {
    fn compound_of<'a, D>(
        average: &'a Average<D>,
        params: &'a PcaParams,
    ) -> Result<Compound<D>, PcaError> = Compound::assembled;
}

impl<const D: usize> Compound<D> {
    /// Assembles the operator of an average.
    ///
    /// # Errors
    /// Those of the law and of the grid layer.
    pub fn new(average: &Average<D>, params: &PcaParams) -> Result<Self, PcaError> {
        compound_of(average, params)
    }

    fn assembled(average: &Average<D>, params: &PcaParams) -> Result<Self, PcaError> {
        params.check()?;
        let grid = *average.grid();
        let (sources, void_stiffness) = average.compound_sources(params);
        let all = Derivatives::Hessian;
        let law = params.law.compile()?;
        let found = evaluate(&grid, &law, void_stiffness, &sources, &[], all)?;
        // The Hessian was asked for.
        let (stiffness, traces) = found.hessian.expect("it was asked for");
        Ok(Self {
            params: *params,
            law,
            grid,
            stiffness,
            cycle: cycle(&grid, params, &traces)?,
            rigid: RigidMotions::new(average.object())?,
            object: average.object().clone(),
            imbalance: found.gradient,
            energy: found.value,
        })
    }

    /// Returns the grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Returns the parameters.
    pub fn params(&self) -> &PcaParams {
        &self.params
    }

    /// Returns the law.
    pub fn law(&self) -> &CompiledLaw<D> {
        &self.law
    }

    /// Returns the unconstrained matrix.
    pub fn stiffness(&self) -> &BlockStencil<D, D> {
        &self.stiffness
    }

    /// Returns the constraints.
    pub fn rigid(&self) -> &RigidMotions {
        &self.rigid
    }

    /// Returns `sum_i lambda_i int sigma_i : Dw`, the load of the average's own stresses: zero
    /// except for the forces balanced by the mismatch and the length (and if it is not
    /// prestressed).
    pub fn imbalance(&self) -> &[f64] {
        &self.imbalance
    }

    /// Returns the elastic energy `sum_i lambda_i int W(Dphi_i)` of what the operator was assembled from.
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// Computes the same energy of other deformations.
    ///
    /// # Errors
    /// Those of the law and of the grid layer.
    pub(crate) fn energy_of(&self, average: &Average<D>) -> Result<f64, PcaError> {
        let (sources, void_stiffness) = average.compound_sources(&self.params);
        let (grid, value) = (&self.grid, Derivatives::Value);
        Ok(evaluate(grid, &self.law, void_stiffness, &sources, &[], value)?.value)
    }

    /// Computes the load of a Cauchy stress: `int sigma : Dw` for the stress of one deformation.
    ///
    /// # Errors
    /// Those of the law and of the grid layer.
    pub fn load(&self, source: Source<'_>) -> Result<Vec<f64>, PcaError> {
        // A void without prestress has no stress.
        let void_stiffness = if self.params.void_at_rest {
            0.0
        } else {
            self.params.void_stiffness
        };
        let gradient = Derivatives::Gradient;
        let law = &self.law;
        let source = Source {
            weight: mutant!(source.weight, LoadDoubled => 2.0 * source.weight),
            ..source
        };
        let found = evaluate(&self.grid, law, void_stiffness, &[source], &[], gradient)?;
        Ok(found.gradient)
    }

    /// Computes `K u`.
    pub fn apply(&self, u: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; u.len()];
        multiply(&self.stiffness, u, &mut product);
        product
    }

    /// Computes the response `u` to a load: `w . K u = w . f` for all `w`, under the rigid
    /// constraints; the total force and moment of the load are removed.
    ///
    /// # Errors
    /// [`PcaError::NotSolved`].
    ///
    /// # Panics
    /// If the load does not have `D` components of the grid.
    pub fn respond(&self, load: &[f64]) -> Result<(Vec<f64>, SolveReport), PcaError> {
        assert_eq!(load.len(), D * self.grid.n_nodes());
        let (share, iterations) = (self.params.tolerance, self.params.max_iterations);
        let (u, report) = self.solve(load, share, iterations, Negative::PassOver);
        // Also where it is not a number.
        if report.residual.is_nan() || report.residual > self.params.tolerance {
            return Err(PcaError::NotSolved {
                residual: report.residual,
                iterations: report.iterations,
            });
        }
        Ok((u, report))
    }

    /// Computes an approximate response to a load, down to a share of the residual or as far as this number
    /// of iterations reaches, and not beyond a negative curvature: a direction of descent of `u . K u/2 - f
    /// . u`.
    pub(crate) fn descend(&self, load: &[f64], share: f64, iterations: usize) -> Vec<f64> {
        self.solve(load, share, iterations, Negative::Stop).0
    }

    /// Estimates the extreme curvatures of the operator with a rough load, which has components in
    /// all eigenvectors. Together with the curvatures found for the loads themselves, this is the
    /// basis of the check of definiteness.
    pub fn look_for_curvature(&self) -> SolveReport {
        let wave = |i: usize| ((i * 7919) % 1013) as f64 / 506.0 - 1.0;
        let rough: Vec<f64> = (0..self.stiffness.dim()).map(wave).collect();
        let iterations = self.params.max_iterations;
        self.solve(&rough, 1e-6, iterations, Negative::PassOver).1
    }

    fn solve(
        &self,
        load: &[f64],
        tolerance: f64,
        iterations: usize,
        negative: Negative,
    ) -> (Vec<f64>, SolveReport) {
        let mut balanced = load.to_vec();
        self.rigid.balance(&mut balanced);
        let (mut u, report) = krylov::solve(
            |x, y| {
                multiply(&self.stiffness, x, y);
                self.rigid.balance(y);
            },
            |x, y| self.precondition_into(x, y),
            &balanced,
            tolerance,
            iterations,
            negative,
        );
        self.rigid.constrain(&mut u);
        (u, report)
    }

    /// Computes an approximate response: `P G P^T` with one multigrid cycle `G`.
    pub(crate) fn precondition_into(&self, load: &[f64], out: &mut [f64]) {
        let mut balanced = load.to_vec();
        self.rigid.balance(&mut balanced);
        self.cycle.apply_into(&balanced, out);
        self.rigid.constrain(out);
    }
}

compiled_once! {
    /// A matrix times a vector.
    pub(crate) fn multiply<'a, D>(
        matrix: &'a BlockStencil<D, D>,
        x: &'a [f64],
        y: &'a mut [f64],
    ) = LinearOperator::apply_into;
}

/// The cycle for linear elasticity of the mean stiffness of every cell.
fn cycle<const D: usize>(
    grid: &Grid<D>,
    params: &PcaParams,
    traces: &[f64],
) -> Result<CorotationalMultigrid<D>, PcaError> {
    let LameModuli { lambda, mu } = params.law.moduli;
    let d = D as f64;
    // The trace of the tensor without prestress, lambda 1 (x) 1 + mu (1 + transposition).
    let at_rest = lambda * d + mu * (d * d + d);
    // A cell without mapped points has the stiffness of the void.
    let stiffness = |trace: f64| (trace / at_rest).max(0.1 * params.void_stiffness);
    let mut cells = vec![vec![0.0f32; grid.n_cells()]; Corotational::<D>::CELL_DATA];
    for (cell, trace) in traces.iter().enumerate() {
        let data = Corotational::<D>::undeformed(stiffness(*trace) as f32);
        for (values, value) in cells.iter_mut().zip(data) {
            values[cell] = value;
        }
    }
    let law = Corotational {
        moduli: params.law.moduli,
        regularisation: Corotational::<D>::REGULARISATION * params.void_stiffness * mu,
        rotations: true,
        factored: false,
    };
    Ok(CorotationalMultigrid::new(
        *grid,
        law,
        cells,
        MultigridParams::default(),
    )?)
}

compiled_once! {
    /// Computes the displacement that represents the variation of a shape, before centring: the response to the
    /// Cauchy stress of its deformation onto the average, or the displacement by the inverse of the deformation.
    ///
    /// # Errors
    /// Those of the law and of the linear solve; [`PcaError::EmptyObject`] for a deformation that covers no part
    /// of the average.
    pub fn representation<'a, D>(
        compound: &'a Compound<D>,
        source: Source<'a>,
    ) -> Result<(VectorField<f64, D>, SolveReport), PcaError> = represented;
}

fn represented<const D: usize>(
    compound: &Compound<D>,
    source: Source<'_>,
) -> Result<(VectorField<f64, D>, SolveReport), PcaError> {
    match compound.params.variation {
        Variation::Stress => {
            let load = compound.load(source)?;
            let (u, report) = compound.respond(&load)?;
            Ok((Field::from_vec(*compound.grid(), u)?, report))
        }
        Variation::Displacement => finite_displacement(&compound.object, &source),
    }
}
