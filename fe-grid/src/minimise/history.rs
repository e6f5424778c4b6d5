//! The pairs of steps and gradient changes that L-BFGS remembers.

use crate::vector::{axpy, dot, norm, subtract_into};

/// The last `capacity` pairs `s = x' - x`, `y = g' - g`, in a ring.
pub(super) struct PairHistory {
    dim: usize,
    capacity: usize,
    steps: Vec<f64>,
    changes: Vec<f64>,
    /// `1 / s · y` of every pair.
    inverse_curvatures: Vec<f64>,
    /// Coefficients of the first loop, by place in the ring.
    coefficients: Vec<f64>,
    /// Pairs that are kept; the newest lies before `next`.
    len: usize,
    next: usize,
}

impl PairHistory {
    pub(super) fn new(dim: usize, capacity: usize) -> Self {
        Self {
            dim,
            capacity,
            steps: vec![0.0; dim * capacity],
            changes: vec![0.0; dim * capacity],
            inverse_curvatures: vec![0.0; capacity],
            coefficients: vec![0.0; capacity],
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

    /// Remembers the pair of two states and their gradients, unless `s · y` is no more than
    /// `threshold |s| |y|`: the energy does not curve upwards there.
    pub(super) fn push(&mut self, new: (&[f64], &[f64]), old: (&[f64], &[f64]), threshold: f64) {
        if self.capacity == 0 {
            return;
        }
        let place = self.next * self.dim..(self.next + 1) * self.dim;
        let step = &mut self.steps[place.clone()];
        let change = &mut self.changes[place];
        subtract_into(new.0, old.0, step);
        subtract_into(new.1, old.1, change);
        let curvature = dot(step, change);
        if curvature.is_nan() || curvature <= threshold * norm(step) * norm(change) {
            // The oldest pair was overwritten where the ring was full.
            self.len = self.len.min(self.capacity - 1);
            return;
        }
        self.inverse_curvatures[self.next] = 1.0 / curvature;
        self.next = (self.next + 1) % self.capacity;
        self.len = (self.len + 1).min(self.capacity);
    }

    /// First loop, newest pair to oldest: takes out of `q` what the pairs explain.
    pub(super) fn first_loop(&mut self, q: &mut [f64]) {
        for age in 0..self.len {
            let i = self.place(age);
            let place = i * self.dim..(i + 1) * self.dim;
            let a = self.inverse_curvatures[i] * dot(&self.steps[place.clone()], q);
            axpy(-a, &self.changes[place], q);
            self.coefficients[i] = a;
        }
    }

    /// Second loop, oldest pair to newest: `r` becomes the inverse Hessian's image.
    pub(super) fn second_loop(&self, r: &mut [f64]) {
        for age in (0..self.len).rev() {
            let i = self.place(age);
            let place = i * self.dim..(i + 1) * self.dim;
            let b = self.inverse_curvatures[i] * dot(&self.changes[place.clone()], r);
            axpy(self.coefficients[i] - b, &self.steps[place], r);
        }
    }

    /// Place in the ring of the pair that `age` newer ones followed.
    fn place(&self, age: usize) -> usize {
        (self.next + self.capacity - 1 - age) % self.capacity
    }
}
