//! Unknowns with given values: Dirichlet data, masks, pinned nodes.

use std::convert::Infallible;

use crate::buffer::Buffer;
use crate::distribution::Distribution;
use crate::error::GridError;
use crate::field::Field;
use crate::grid::Grid;
use crate::lane::{Element, Stored};
use crate::linear::{CgInfo, CgParams, CgScratch, LinearOperator, conjugate_gradient};
use crate::minimise::{Evaluation, Objective, SecondOrder};
use crate::vector::axpy;

/// The unknowns of a problem that have given values, and are held while the others are computed.
///
/// With the projection `P` onto the other, free unknowns, [`HeldValues::operator`] makes of `A`
/// the operator `P A P + (1 - P)`, symmetric and positive definite if `A` is so on the free ones,
/// and [`HeldValues::objective`] makes of an energy one whose gradient is zero at the held ones, so
/// that no minimiser moves them.
///
/// ```
/// use fe_grid::{CgParams, Grid, HeldValues, Identity, UniformOperator};
/// use fe_grid::operators::MassStiffness;
///
/// // Harmonic on the unit square, with the values x y on its boundary: x y.
/// let grid = Grid::<2>::dyadic(4);
/// let laplace = UniformOperator::new(grid, MassStiffness { mass: 0.0, stiffness: 1.0 });
/// let boundary = HeldValues::on_faces(&grid, 1);
/// let product = |i: usize| grid.position(grid.node(i)).iter().product::<f64>();
/// let mut u: Vec<f64> = (0..grid.n_nodes())
///     .map(|i| if boundary.is_held(i) { product(i) } else { 0.0 })
///     .collect();
/// let (b, plain) = (vec![0.0; u.len()], Identity { dim: u.len() });
/// boundary.solve(&laplace, &plain, &b, &mut u, &CgParams::default())?;
/// assert!(u.iter().enumerate().all(|(i, u)| (u - product(i)).abs() < 1e-9));
/// # Ok::<(), fe_grid::GridError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeldValues {
    dim: usize,
    /// In increasing order.
    held: Vec<usize>,
}

impl HeldValues {
    /// Holds the unknowns `i` of `dim` for which `is_held(i)`.
    pub fn new(dim: usize, is_held: impl Fn(usize) -> bool) -> Self {
        let held = (0..dim).filter(|&i| is_held(i)).collect();
        Self { dim, held }
    }

    /// Holds all `components` at the nodes on the faces of the box.
    pub fn on_faces<const D: usize>(grid: &Grid<D>, components: usize) -> Self {
        let nodes = grid.nodes_per_axis();
        Self::at_nodes(grid, components, |node| {
            (0..D).any(|k| node[k] == 0 || node[k] + 1 == nodes[k])
        })
    }

    /// Holds all `components` at the nodes that `is_held` selects by their indices along the axes.
    pub fn at_nodes<const D: usize>(
        grid: &Grid<D>,
        components: usize,
        is_held: impl Fn([usize; D]) -> bool,
    ) -> Self {
        let n = grid.n_nodes();
        Self::new(n * components, |i| is_held(grid.node(i % n)))
    }

    /// Number of unknowns, held and free.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// The held unknowns, in increasing order.
    pub fn indices(&self) -> &[usize] {
        &self.held
    }

    /// Whether unknown `i` is held.
    pub fn is_held(&self, i: usize) -> bool {
        self.held.binary_search(&i).is_ok()
    }

    /// `x = P x`: sets the held unknowns to zero.
    ///
    /// # Panics
    /// If `x` does not have [`HeldValues::dim`] entries.
    pub fn project(&self, x: &mut [f64]) {
        assert_eq!(x.len(), self.dim);
        for &i in &self.held {
            x[i] = 0.0;
        }
    }

    /// Copies the held values of `values` to `x`.
    ///
    /// # Panics
    /// If one does not have [`HeldValues::dim`] entries.
    pub fn impose<T: Element, const D: usize, const M: usize>(
        &self,
        values: &Field<T, D, M>,
        x: &mut [f64],
    ) {
        assert_eq!((values.as_slice().len(), x.len()), (self.dim, self.dim));
        for &i in &self.held {
            x[i] = values.as_slice()[i].to_f64();
        }
    }

    /// Computes `y = P A P x + (1 - P) x` for `apply`, which computes `y = A x`.
    fn projected<E>(
        &self,
        x: &[f64],
        y: &mut [f64],
        apply: impl FnOnce(&[f64], &mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut free = x.to_vec();
        self.project(&mut free);
        apply(&free, y)?;
        for &i in &self.held {
            y[i] = x[i];
        }
        Ok(())
    }

    /// The operator `P A P + (1 - P)` of the operator, or of the preconditioner, `A`.
    pub fn operator<A>(&self, operator: A) -> Held<'_, A> {
        Held {
            values: self,
            inner: operator,
        }
    }

    /// The energy as a function of the free unknowns alone.
    pub fn objective<O>(&self, objective: O) -> Held<'_, O> {
        Held {
            values: self,
            inner: objective,
        }
    }

    /// Solves `A x = b` in the rows of the free unknowns, for the held values that `x` has, by
    /// conjugate gradients. The other entries of `x` are the start; `b` at the held unknowns is
    /// ignored. The relative tolerance refers to the residual of the start.
    ///
    /// # Errors
    /// [`GridError::NotPositiveDefinite`] and [`GridError::NotFinite`], as [`conjugate_gradient`].
    ///
    /// # Panics
    /// If lengths differ.
    pub fn solve(
        &self,
        operator: &dyn LinearOperator,
        preconditioner: &dyn LinearOperator,
        b: &[f64],
        x: &mut [f64],
        params: &CgParams,
    ) -> Result<CgInfo, GridError> {
        assert_eq!((b.len(), x.len()), (self.dim, self.dim));
        let mut residual = vec![0.0; self.dim];
        operator.apply_into(x, &mut residual);
        for (r, b) in residual.iter_mut().zip(b) {
            *r = b - *r;
        }
        self.project(&mut residual);
        let mut correction = vec![0.0; self.dim];
        let mut scratch = CgScratch::new(self.dim);
        let info = conjugate_gradient(
            &self.operator(operator),
            &self.operator(preconditioner),
            &residual,
            &mut correction,
            params,
            &mut scratch,
        );
        axpy(1.0, &correction, x);
        info
    }
}

/// An operator or an objective in which some unknowns are held; see [`HeldValues`].
#[derive(Clone, Debug)]
pub struct Held<'a, T> {
    values: &'a HeldValues,
    inner: T,
}

impl<T> Held<'_, T> {
    /// The operator or objective itself.
    pub fn inner(&self) -> &T {
        &self.inner
    }
}

impl<A: LinearOperator> LinearOperator for Held<'_, A> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        let applied = self.values.projected(x, y, |x, y| {
            self.inner.apply_into(x, y);
            Ok::<(), Infallible>(())
        });
        let Ok(()) = applied;
    }
}

impl<O: Objective> Objective for Held<'_, O> {
    type Error = O::Error;

    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn value_and_gradient(
        &mut self,
        x: &[f64],
        gradient: &mut [f64],
    ) -> Result<Evaluation, Self::Error> {
        let evaluation = self.inner.value_and_gradient(x, gradient)?;
        self.values.project(gradient);
        Ok(evaluation)
    }

    fn value(&mut self, x: &[f64]) -> Result<Evaluation, Self::Error> {
        self.inner.value(x)
    }

    fn distribution(&self) -> Distribution {
        self.inner.distribution()
    }

    fn energy_scale(&self, energy: f64) -> f64 {
        self.inner.energy_scale(energy)
    }

    /// `P M P + (1 - P)` for the inverse metric `M` of the objective.
    fn apply_inverse_metric(
        &mut self,
        gradient: &[f64],
        out: &mut [f64],
    ) -> Result<(), Self::Error> {
        self.values.projected(gradient, out, |g, out| {
            self.inner.apply_inverse_metric(g, out)
        })
    }

    fn restrain(&mut self, x: &[f64], direction: &mut [f64]) -> Result<(), Self::Error> {
        self.inner.restrain(x, direction)?;
        self.values.project(direction);
        Ok(())
    }

    fn room<T: Stored>(&self, len: usize) -> Result<Buffer<T>, Self::Error> {
        self.inner.room(len)
    }

    fn memory(&self) -> Vec<f64> {
        self.inner.memory()
    }

    fn restore(&mut self, memory: &[f64]) {
        self.inner.restore(memory);
    }

    fn update_metric(&mut self, x: &[f64]) -> Result<(), Self::Error> {
        self.inner.update_metric(x)
    }
}

impl<O: SecondOrder> SecondOrder for Held<'_, O> {
    /// `P H P + (1 - P)` for the second derivative `H` of the objective.
    fn hessian_action(
        &mut self,
        x: &[f64],
        direction: &[f64],
        out: &mut [f64],
    ) -> Result<(), Self::Error> {
        self.values.projected(direction, out, |d, out| {
            self.inner.hessian_action(x, d, out)
        })
    }
}
