//! Reproducible random matrices.

use fe_grid::random::SplitMix64;
use fe_grid::{Tensor, tensor};

/// A sequence of random numbers and matrices.
#[derive(Clone, Copy, Debug)]
pub struct Sequence(SplitMix64);

impl Sequence {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// The next number, evenly between two bounds.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.between(low, high)
    }

    /// A matrix of numbers from -1 to 1.
    pub fn matrix<const D: usize>(&mut self) -> Tensor<f64, D> {
        std::array::from_fn(|_| std::array::from_fn(|_| self.between(-1.0, 1.0)))
    }

    /// A rotation.
    pub fn rotation<const D: usize>(&mut self) -> Tensor<f64, D> {
        let q = plane_rotation::<D>(0, 1, self.between(-3.0, 3.0));
        if D == 2 {
            return q;
        }
        let q = tensor::product(&q, &plane_rotation::<D>(1, 2, self.between(-3.0, 3.0)));
        tensor::product(&q, &plane_rotation::<D>(0, 2, self.between(-3.0, 3.0)))
    }

    /// A matrix with stretches between two bounds, and a positive determinant.
    pub fn stretch<const D: usize>(&mut self, low: f64, high: f64) -> Tensor<f64, D> {
        let mut middle = tensor::zero::<f64, D>();
        for (i, row) in middle.iter_mut().enumerate() {
            row[i] = self.between(low, high);
        }
        let left = tensor::product(&self.rotation(), &middle);
        tensor::product(&left, &self.rotation())
    }
}

/// A rotation in the plane of two axes.
pub fn plane_rotation<const D: usize>(i: usize, k: usize, angle: f64) -> Tensor<f64, D> {
    let mut q = tensor::diagonal::<f64, D>(1.0);
    let (sin, cos) = angle.sin_cos();
    (q[i][i], q[k][k], q[i][k], q[k][i]) = (cos, cos, -sin, sin);
    q
}

/// `A - 1`.
pub fn minus_identity<const D: usize>(a: &Tensor<f64, D>) -> Tensor<f64, D> {
    tensor::sub(a, &tensor::diagonal(1.0))
}

/// A diagonal matrix less the identity: the displacement gradient of stretches.
pub fn stretches<const D: usize>(factors: [f64; D]) -> Tensor<f64, D> {
    let mut h = tensor::zero::<f64, D>();
    for (i, factor) in factors.iter().enumerate() {
        h[i][i] = factor - 1.0;
    }
    h
}

/// `|A|`.
pub fn norm<const D: usize>(a: &Tensor<f64, D>) -> f64 {
    tensor::contract(a, a).sqrt()
}

/// `A^-1`.
pub fn inverse<const D: usize>(a: &Tensor<f64, D>) -> Tensor<f64, D> {
    tensor::transpose(&tensor::inverse_transpose(a))
}
