//! The pairs of steps and gradient changes that L-BFGS remembers.
//!
//! They are stored in single precision, which halves the largest part of the method's memory. Each
//! vector is divided by its largest entry first, to avoid overflow and underflow; the two-loop
//! recursion needs only the quotient of the two scales. The curvature is that of the rounded pair:
//! the inverse Hessian of the recursion is then positive definite, whatever the rounding.

use super::memory::MemoryPair;
use crate::buffer::Buffer;
use crate::distribution::Distribution;
use crate::vector::{axpy, scaled_difference_into};

/// A step `s = x' - x` and a change of the gradient `y = g' - g`, both of largest entry one.
pub(super) struct Pair {
    step: Buffer<f32>,
    change: Buffer<f32>,
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
    pub(super) fn new(step: Buffer<f32>, change: Buffer<f32>) -> Self {
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
    fn set(
        &mut self,
        new: (&[f64], &[f64]),
        old: (&[f64], &[f64]),
        threshold: f64,
        distribution: &Distribution,
    ) -> bool {
        let (step, change) = (&mut self.step, &mut self.change);
        let step_size = distribution.max_abs_difference(new.0, old.0);
        let change_size = distribution.max_abs_difference(new.1, old.1);
        scaled_difference_into(1.0 / step_size, new.0, old.0, step);
        scaled_difference_into(1.0 / change_size, new.1, old.1, change);
        let curvature = distribution.dot::<f32, f32>(step, change);
        self.inverse_curvature = 1.0 / curvature;
        self.ratio = step_size / change_size;
        // A size of zero makes all of them NaN.
        self.ratio.is_finite()
            && curvature
                > threshold * distribution.norm::<f32>(step) * distribution.norm::<f32>(change)
    }

    /// Takes over a pair of an earlier run, whose vectors have the same lengths.
    fn restore(&mut self, pair: &MemoryPair<'_>) {
        self.step.copy_from_slice(&pair.step);
        self.change.copy_from_slice(&pair.change);
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
                step: pair.step[..].into(),
                change: pair.change[..].into(),
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
    pub(super) fn push(&mut self, new: (&[f64], &[f64]), old: (&[f64], &[f64]), threshold: f64) {
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
    pub(super) fn first_loop(&mut self, q: &mut [f64]) {
        for age in 0..self.len {
            let place = self.place(age);
            let pair = &mut self.ring[place];
            let a = pair.inverse_curvature * self.distribution.dot::<f32, f64>(&pair.step, q);
            axpy(-a, &pair.change, q);
            pair.coefficient = a;
            pair.rest();
        }
    }

    /// Second loop, oldest pair to newest: `r` becomes the inverse Hessian's image.
    pub(super) fn second_loop(&self, r: &mut [f64]) {
        for age in (0..self.len).rev() {
            let pair = &self.ring[self.place(age)];
            let b = pair.inverse_curvature * self.distribution.dot::<f32, f64>(&pair.change, r);
            axpy(pair.ratio * pair.coefficient - b, &pair.step, r);
            pair.rest();
        }
    }

    /// Place in the ring of the pair that `age` newer ones followed.
    fn place(&self, age: usize) -> usize {
        (self.next + self.ring.len() - 1 - age) % self.ring.len()
    }
}
