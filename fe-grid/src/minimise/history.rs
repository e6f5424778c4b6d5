//! The pairs of steps and gradient changes that L-BFGS remembers.
//!
//! They are rounded ([`PairVector`]), which saves half of the largest part of the method's memory, or more.
//! Each vector is divided by its largest entry first, to avoid overflow and underflow; the two-loop
//! recursion needs only the quotient of the two scales. The curvature is that of the rounded pair:
//! the inverse Hessian of the recursion is then positive definite, whatever the rounding.

use super::memory::{MemoryPair, MemoryVector};
use super::pair_vector::PairVector;
use crate::distribution::Distribution;
use crate::lane::Element;

/// A step `s = x' - x` and a change of the gradient `y = g' - g`, both of largest entry one.
pub(super) struct Pair {
    step: PairVector,
    change: PairVector,
    /// `1 / s · y` of the scaled pair.
    inverse_curvature: f64,
    /// Size of the step over the size of the change, which the scaling took away.
    ratio: f64,
    /// Coefficient of the first loop.
    coefficient: f64,
}

/// The last pairs, in a ring.
pub(super) struct PairHistory {
    /// That of the unknowns.
    distribution: Distribution,
    ring: Vec<Pair>,
    /// Number of stored pairs; the newest is stored before `next`.
    len: usize,
    next: usize,
}

impl Pair {
    /// A pair with room for vectors of the length of these two.
    pub(super) fn new(step: PairVector, change: PairVector) -> Self {
        Self {
            step,
            change,
            inverse_curvature: 0.0,
            ratio: 0.0,
            coefficient: 0.0,
        }
    }

    /// Becomes the pair of two states and their gradients and says whether its curvature is above
    /// `threshold |s| |y|`.
    fn set<T: Element>(
        &mut self,
        new: (&[f64], &[T]),
        old: (&[T], &[T]),
        threshold: f64,
        distribution: &Distribution,
    ) -> bool {
        let (step, change) = (&mut self.step, &mut self.change);
        let step_size = distribution.max_abs_difference(new.0, old.0);
        let change_size = distribution.max_abs_difference(new.1, old.1);
        step.set_difference(1.0 / step_size, new.0, old.0);
        change.set_difference(1.0 / change_size, new.1, old.1);
        let curvature = step.dot_with(change, distribution);
        self.inverse_curvature = 1.0 / curvature;
        self.ratio = step_size / change_size;
        // A size of zero makes all of them NaN.
        let squared = |vector: &PairVector| vector.dot_with(vector, distribution);
        self.ratio.is_finite()
            && curvature > threshold * squared(step).sqrt() * squared(change).sqrt()
    }

    /// Takes over a pair of an earlier run, whose vectors have the same lengths.
    fn restore(&mut self, pair: &MemoryPair<'_>) {
        self.step.set(&pair.step.numbers());
        self.change.set(&pair.change.numbers());
        self.inverse_curvature = pair.inverse_curvature;
        self.ratio = pair.ratio;
        self.rest();
    }

    fn rest(&self) {
        self.step.rest();
        self.change.rest();
    }
}

impl PairHistory {
    /// A memory of as many pairs as there is room given for.
    pub(super) fn new(ring: Vec<Pair>, distribution: Distribution) -> Self {
        Self {
            distribution,
            ring,
            len: 0,
            next: 0,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// The stored pairs, oldest first.
    pub(super) fn memory(&self) -> Vec<MemoryPair<'_>> {
        let pair = |age| {
            let pair: &Pair = &self.ring[self.place(age)];
            MemoryPair {
                step: MemoryVector::of_run(&pair.step),
                change: MemoryVector::of_run(&pair.change),
                inverse_curvature: pair.inverse_curvature,
                ratio: pair.ratio,
            }
        };
        (0..self.len).rev().map(pair).collect()
    }

    /// Takes over at most as many pairs as there is room for, oldest first.
    pub(super) fn restore(&mut self, pairs: &[MemoryPair<'_>]) {
        for (own, pair) in self.ring.iter_mut().zip(pairs) {
            own.restore(pair);
        }
        self.len = pairs.len().min(self.ring.len());
        self.next = self.len % self.ring.len().max(1);
    }

    /// Remembers the pair of two states and their gradients, unless `s · y` is no more than
    /// `threshold |s| |y|`: the energy does not curve upwards there.
    pub(super) fn push<T: Element>(
        &mut self,
        new: (&[f64], &[T]),
        old: (&[T], &[T]),
        threshold: f64,
    ) {
        let capacity = self.ring.len();
        let Some(pair) = self.ring.get_mut(self.next) else {
            return;
        };
        let curved = pair.set(new, old, threshold, &self.distribution);
        pair.rest();
        if curved {
            self.next = (self.next + 1) % capacity;
            self.len = (self.len + 1).min(capacity);
        } else {
            // The oldest pair was overwritten where the ring was full.
            self.len = self.len.min(capacity - 1);
        }
    }

    /// First loop, newest pair to oldest: takes out of `q` what the pairs explain.
    pub(super) fn first_loop<T: Element>(&mut self, q: &mut [T]) {
        for age in 0..self.len {
            let place = self.place(age);
            let pair = &mut self.ring[place];
            let a = pair.inverse_curvature * pair.step.dot(q, &self.distribution);
            pair.change.add_to(-a, q);
            pair.coefficient = a;
            pair.rest();
        }
    }

    /// Second loop, oldest pair to newest: `r` becomes the inverse Hessian's image.
    pub(super) fn second_loop<T: Element>(&self, r: &mut [T]) {
        for age in (0..self.len).rev() {
            let pair = &self.ring[self.place(age)];
            let b = pair.inverse_curvature * pair.change.dot(r, &self.distribution);
            pair.step.add_to(pair.ratio * pair.coefficient - b, r);
            pair.rest();
        }
    }

    /// Place in the ring of the pair that `age` newer ones followed.
    fn place(&self, age: usize) -> usize {
        (self.next + self.ring.len() - 1 - age) % self.ring.len()
    }
}
