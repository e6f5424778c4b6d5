//! The least eigenvalue of a Hessian.

use super::objective::{Evaluation, SecondOrder};
use crate::buffer::Buffer;
use crate::random::noise;
use crate::rigid::Motion;
use crate::vector::{axpy, aypx, copy_into, dot, fill, max_abs, multiply_into, scale};
use nalgebra::{DMatrix, DVector};

/// Seed of the first direction.
const SEED: u64 = 1;
/// Applications of the inverse metric to the first directions.
const SMOOTHINGS: usize = 4;
/// Random directions that are iterated together. With one, the iteration often ended at another eigenvalue
/// than the least, where a small part of another direction hardly changes the residual.
const RANDOM: usize = 2;
/// Directions that are iterated together at most: the softest in the span of all first ones.
const MOST: usize = 3;
/// A vector of the basis is left out where its part that is orthogonal to the others is smaller, relative
/// to the whole: rounding errors make most of it then.
const INDEPENDENT: f64 = 1e-8;

/// Finds the least eigenvalue of `H v = lambda M v` with a diagonal mass `M`,
///
/// `lambda = min  v · H v / v · M v`  over all `v` with `r_k · M v = 0` for given motions `r_k`,
///
/// such as rigid ones, which the energy does not resist: eigenvectors of the eigenvalue 0 that say nothing
/// about the state. Below zero, the state is no minimum, but a saddle point; the sign does not depend on
/// the mass (Sylvester's law of inertia), which must be positive.
///
/// # Method
/// The locally optimal block preconditioned conjugate gradient method: a Rayleigh-Ritz step in the span of
/// several directions `v`, their preconditioned residuals `P r`, `r = H v - theta M v`, and their last changes,
/// with one application of `H` and one of the inverse metric `P`
/// ([`Objective::apply_inverse_metric`](super::Objective::apply_inverse_metric)) for each direction. Without
/// a preconditioner it is about as fast as Lanczos' method, without its basis in memory; the better `P`
/// approximates `H^-1`, the fewer steps there are. The first directions are the three softest in the
/// span of two random ones and of guesses, which `P` may be far too stiff for.
///
/// # Accuracy
/// `theta = v · H v / v · M v` is never below the least eigenvalue (Courant and Fischer): a negative one is
/// certain. There is an eigenvalue within `sqrt(r · M^-1 r / v · M v)` of `theta` (Krylov and Weinstein);
/// that it is the least one is not certain. What the next step is expected to lower `theta` by,
/// `r · P r / v · M v`, estimates the error where `P` approximates `H^-1`. All this holds up to the error by
/// which `H` is not symmetric.
///
/// Source: Knyazev, *Toward the optimal preconditioned eigensolver: locally optimal block preconditioned
/// conjugate gradient method* (2001); Parlett, *The Symmetric Eigenvalue Problem* (1998), sections 4.5
/// and 11.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastEigenvalueParams {
    /// Most applications of the Hessian.
    pub max_actions: usize,
    /// The iteration ends where the estimated error is at most this share of `|theta|`.
    pub relative_error: f64,
    /// It also ends where the estimated error is at most this.
    pub absolute_error: f64,
}

impl Default for LeastEigenvalueParams {
    fn default() -> Self {
        Self {
            max_actions: 100,
            relative_error: 1e-3,
            absolute_error: 0.0,
        }
    }
}

/// The least eigenvalue found.
#[derive(Debug)]
pub struct LeastEigenvalue {
    /// The Rayleigh quotient `theta`.
    pub value: f64,
    /// There is an eigenvalue within this of the value; large where small masses are far out of balance.
    pub residual: f64,
    /// The estimated error.
    pub error: f64,
    /// Applications of the Hessian.
    pub actions: usize,
    /// Whether the estimated error is as small as required.
    pub converged: bool,
    /// The direction `v`, with `v · M v = 1`.
    pub direction: Buffer<f64>,
}

/// A direction `v` with `H v`.
struct Direction {
    own: Buffer<f64>,
    image: Buffer<f64>,
}

impl Direction {
    fn new<O: SecondOrder>(objective: &O) -> Result<Self, O::Error> {
        let dim = objective.dim();
        Ok(Self {
            own: objective.room(dim)?,
            image: objective.room(dim)?,
        })
    }

    fn add(&mut self, factor: f64, other: &Self) {
        axpy(factor, &other.own, &mut self.own);
        axpy(factor, &other.image, &mut self.image);
    }

    fn clear(&mut self) {
        fill(0.0, &mut self.own);
        fill(0.0, &mut self.image);
    }
}

/// The motions `r_k`, `M r_k`, and the inverse of the matrix of `r_j · M r_k`.
struct Motions<'a> {
    vectors: &'a [Motion],
    images: Vec<Motion>,
    inverse: DMatrix<f64>,
}

impl<'a> Motions<'a> {
    /// `None` where the motions depend on each other.
    fn new(vectors: &'a [Motion], mass: &[f64]) -> Option<Self> {
        let image = |motion: &Motion| {
            let mut values = vec![0.0; motion.values.len()];
            multiply_into(
                &mass[motion.first..][..values.len()],
                &motion.values,
                &mut values,
            );
            Motion {
                first: motion.first,
                values,
            }
        };
        let images: Vec<Motion> = vectors.iter().map(image).collect();
        // Motions of other unknowns are orthogonal.
        let entry = |j: usize, k: usize| {
            let (one, other) = (&vectors[j], &images[k]);
            let same = (one.first, one.values.len()) == (other.first, other.values.len());
            if same {
                dot(&one.values, &other.values)
            } else {
                0.0
            }
        };
        let matrix = DMatrix::from_fn(vectors.len(), vectors.len(), entry);
        matrix.try_inverse().map(|inverse| Self {
            vectors,
            images,
            inverse,
        })
    }

    /// Takes the motions out of a direction.
    fn remove(&self, direction: &mut [f64]) {
        self.project(direction, &self.images, self.vectors);
    }

    /// Takes the forces out of a residual that the motions do work against.
    fn balance(&self, residual: &mut [f64]) {
        self.project(residual, self.vectors, &self.images);
    }

    fn project(&self, vector: &mut [f64], tests: &[Motion], parts: &[Motion]) {
        if tests.is_empty() {
            return;
        }
        let products = tests.iter().map(|test| test.dot(vector));
        let factors = &self.inverse * DVector::from_iterator(tests.len(), products);
        for (part, factor) in parts.iter().zip(factors.iter()) {
            let own = &mut vector[part.first..][..part.values.len()];
            axpy(-factor, &part.values, own);
        }
    }
}

impl LeastEigenvalueParams {
    /// Vectors of all unknowns that are kept at one time, at most, but for guesses and motions.
    pub const VECTORS: usize = 2 * (3 * MOST + 2 * MOST);

    /// Computes the least eigenvalue at a state, for a mass per unknown, on directions without the given
    /// motions, each two of which are of the same unknowns or have none in common; `guesses` are directions
    /// to begin with, if any are known. `None` where the state is inadmissible, no direction is left, the
    /// motions depend on each other, or a curvature is not finite.
    ///
    /// # Errors
    /// Those of the objective.
    ///
    /// # Panics
    /// If the mass, a motion or a guess does not have the dimension of the objective.
    pub fn find<O: SecondOrder>(
        &self,
        objective: &mut O,
        x: &[f64],
        mass: &[f64],
        motions: &[Motion],
        guesses: &[Vec<f64>],
    ) -> Result<Option<LeastEigenvalue>, O::Error> {
        let mut residual = objective.room(objective.dim())?;
        let found = objective.value_and_gradient(x, &mut residual)?;
        if !matches!(found, Evaluation::Value(energy) if energy.is_finite()) {
            return Ok(None);
        }
        objective.update_metric(x)?;
        let Some(motions) = Motions::new(motions, mass) else {
            return Ok(None);
        };
        let mut run = Run {
            params: self,
            objective,
            x,
            mass,
            motions,
            residual,
            actions: 0,
        };
        let block = run.first_block(guesses)?;
        if block.is_empty() {
            return Ok(None);
        }
        run.iterate(block)
    }
}

/// A run of the method.
struct Run<'a, O> {
    params: &'a LeastEigenvalueParams,
    objective: &'a mut O,
    x: &'a [f64],
    mass: &'a [f64],
    motions: Motions<'a>,
    /// Work space.
    residual: Buffer<f64>,
    actions: usize,
}

impl<O: SecondOrder> Run<'_, O> {
    /// Guesses, and random directions after inverse iterations with the metric in place of the Hessian: with large parts of
    /// soft modes, and at rest where the metric holds unknowns.
    fn first_block(&mut self, guesses: &[Vec<f64>]) -> Result<Vec<Direction>, O::Error> {
        let mut block: Vec<Direction> = Vec::new();
        for guess in guesses {
            let mut direction = Direction::new(self.objective)?;
            copy_into(guess, &mut direction.own);
            self.add_to(&mut block, direction)?;
        }
        for seed in 0..RANDOM as u64 {
            let mut direction = Direction::new(self.objective)?;
            let own = &mut direction.own;
            copy_into(&noise(self.x.len(), SEED + seed), own);
            for _ in 0..SMOOTHINGS {
                multiply_into(self.mass, own, &mut self.residual);
                self.objective.apply_inverse_metric(&self.residual, own)?;
                self.motions.remove(own);
                scale(1.0 / max_abs(own).max(f64::MIN_POSITIVE), own);
            }
            self.add_to(&mut block, direction)?;
        }
        Ok(block)
    }

    /// `a · M b`.
    fn product(&mut self, a: &[f64], b: &[f64]) -> f64 {
        multiply_into(self.mass, b, &mut self.residual);
        dot(a, &self.residual)
    }

    /// Makes a direction one of unit mass, without motions, that is orthogonal to a basis; `false` where it
    /// depends on these.
    fn orthonormalise(&mut self, new: &mut Direction, basis: &[Direction]) -> bool {
        let whole = self.product(&new.own, &new.own);
        // Twice, as once leaves the rounding errors of a large part.
        for _ in 0..2 {
            self.motions.remove(&mut new.own);
            for other in basis {
                let part = self.product(&new.own, &other.own);
                new.add(-part, other);
            }
        }
        let square = self.product(&new.own, &new.own);
        // False for sizes that are not a number, too.
        let independent = square > INDEPENDENT * INDEPENDENT * whole && square.is_finite();
        if independent {
            scale(1.0 / square.sqrt(), &mut new.own);
            scale(1.0 / square.sqrt(), &mut new.image);
        }
        independent
    }

    /// Adds a direction to a basis and applies the Hessian to it, unless it depends on the basis.
    fn add_to(&mut self, basis: &mut Vec<Direction>, mut new: Direction) -> Result<(), O::Error> {
        if self.orthonormalise(&mut new, basis) {
            self.objective
                .hessian_action(self.x, &new.own, &mut new.image)?;
            self.actions += 1;
            basis.push(new);
        }
        Ok(())
    }

    fn iterate(&mut self, block: Vec<Direction>) -> Result<Option<LeastEigenvalue>, O::Error> {
        let size = block.len().min(MOST);
        let mut basis = block;
        rotate(&mut basis, size, &mut []);
        let mut changes: Vec<Direction> = Vec::new();
        loop {
            let mut least = None;
            let mut searches = Vec::with_capacity(size);
            for direction in &basis {
                let value = dot(&direction.own, &direction.image);
                multiply_into(self.mass, &direction.own, &mut self.residual);
                aypx(-value, &direction.image, &mut self.residual);
                self.motions.balance(&mut self.residual);
                let mut search = Direction::new(self.objective)?;
                self.objective
                    .apply_inverse_metric(&self.residual, &mut search.own)?;
                let error = dot(&search.own, &self.residual).max(0.0);
                if !value.is_finite() || !error.is_finite() {
                    return Ok(None);
                }
                let bound = self.bound();
                least.get_or_insert((value, error, bound));
                searches.push(search);
            }
            let Some((value, error, residual)) = least else {
                return Ok(None);
            };
            let params = self.params;
            let enough = params
                .absolute_error
                .max(params.relative_error * value.abs());
            let converged = error <= enough;
            if !converged && self.actions + size <= params.max_actions {
                let known = basis.len();
                for search in searches {
                    self.add_to(&mut basis, search)?;
                }
                if basis.len() > known {
                    for mut change in std::mem::take(&mut changes) {
                        if self.orthonormalise(&mut change, &basis) {
                            basis.push(change);
                        }
                    }
                    for _ in 0..size {
                        changes.push(Direction::new(self.objective)?);
                    }
                    rotate(&mut basis, size, &mut changes);
                    continue;
                }
            }
            let direction = basis.swap_remove(0).own;
            return Ok(Some(LeastEigenvalue {
                value,
                residual,
                error,
                actions: self.actions,
                converged,
                direction,
            }));
        }
    }

    /// `sqrt(r · M^-1 r)` of the residual.
    fn bound(&self) -> f64 {
        let parts = self.residual.iter().zip(self.mass);
        parts.map(|(r, m)| r * r / m).sum::<f64>().sqrt()
    }
}

/// Replaces an orthonormal basis by the `size` directions of least curvature in its span, the least first.
/// `changes` are overwritten by their parts outside of the first `size` directions of the basis.
fn rotate(basis: &mut Vec<Direction>, size: usize, changes: &mut [Direction]) {
    let entry = |i: usize, j: usize| {
        let one = dot(&basis[i].own, &basis[j].image);
        0.5 * (one + dot(&basis[j].own, &basis[i].image))
    };
    let eigen = DMatrix::from_fn(basis.len(), basis.len(), entry).symmetric_eigen();
    let mut order: Vec<usize> = (0..basis.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let factor = |of: usize, part: usize| eigen.eigenvectors[(part, order[of])];
    for (k, change) in changes.iter_mut().enumerate() {
        change.clear();
        for (j, part) in basis.iter().enumerate().skip(size) {
            change.add(factor(k, j), part);
        }
    }
    let (first, rest) = basis.split_at(size);
    let mut rotated = Vec::with_capacity(size);
    for k in 0..size {
        let mut direction = Direction {
            own: Buffer::zeros(first[0].own.len()),
            image: Buffer::zeros(first[0].own.len()),
        };
        for (j, part) in first.iter().enumerate() {
            direction.add(factor(k, j), part);
        }
        match changes.get(k) {
            Some(change) => direction.add(1.0, change),
            None => {
                for (j, part) in rest.iter().enumerate() {
                    direction.add(factor(k, size + j), part);
                }
            }
        }
        rotated.push(direction);
    }
    *basis = rotated;
}
