//! The null space of elasticity, infinitesimal rigid motions, and the constraints that remove it.

use crate::error::PcaError;
use crate::product::object_product;
use fe_grid::vector::{axpy, dot};
use fe_grid::{Field, ScalarField, compiled_once, mutant};
use nalgebra::DMatrix;

/// The rigid motions `R` of the box and the constraints `Z = M_O R`: `Z^T u = 0` means
/// `int_O u = 0` and `int_O x cross u = 0`.
#[derive(Clone, Debug)]
pub struct RigidMotions {
    /// Translations, then rotations about the centroid of the object.
    motions: Vec<Vec<f64>>,
    constraints: Vec<Vec<f64>>,
    /// `(Z^T R)^-1`.
    inverse: DMatrix<f64>,
}

compiled_once! {
    fn motions_of<'a, D>(
        object: &'a ScalarField<f64, D>,
    ) -> Result<RigidMotions, PcaError> = RigidMotions::of;
}

impl RigidMotions {
    /// Creates the motions and constraints for the object of an indicator.
    ///
    /// # Errors
    /// [`PcaError::EmptyObject`] if the object is empty.
    pub fn new<const D: usize>(object: &ScalarField<f64, D>) -> Result<Self, PcaError> {
        motions_of(object)
    }

    fn of<const D: usize>(object: &ScalarField<f64, D>) -> Result<Self, PcaError> {
        let grid = *object.grid();
        let mut mass = 0.0;
        let mut centre = [0.0; D];
        for (index, chi) in object.as_slice().iter().enumerate() {
            let x = grid.position(grid.node(index));
            mass += chi;
            for k in 0..D {
                centre[k] += chi * x[k];
            }
        }
        if mass.is_nan() || mass <= 0.0 {
            return Err(PcaError::EmptyObject);
        }
        let centre = centre.map(|c| c / mass);
        let field = |motion: &dyn Fn([f64; D]) -> [f64; D]| {
            Field::<f64, D, D>::from_fn(grid, motion).into_vec()
        };
        let mut motions = Vec::new();
        for k in 0..D {
            let mut along = [0.0; D];
            along[k] = 1.0;
            motions.push(field(&|_| along));
        }
        for i in 0..D {
            for j in i + 1..D {
                motions.push(field(&|x| {
                    let mut turned = [0.0; D];
                    (turned[i], turned[j]) = (centre[j] - x[j], x[i] - centre[i]);
                    turned
                }));
            }
        }
        let constraints: Vec<Vec<f64>> =
            motions.iter().map(|r| object_product(object, r)).collect();
        let n = motions.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| dot(&constraints[i], &motions[j]));
        let inverse = matrix.try_inverse().ok_or(PcaError::EmptyObject)?;
        Ok(Self {
            motions,
            constraints,
            inverse,
        })
    }

    /// Returns the motions.
    pub fn motions(&self) -> &[Vec<f64>] {
        &self.motions
    }

    /// Removes the rigid part of a displacement, so that it satisfies the constraints:
    /// `P u = u - R (Z^T R)^-1 Z^T u`.
    pub fn constrain(&self, u: &mut [f64]) {
        self.remove(u, &self.constraints, &self.motions, false);
    }

    /// Computes `P^T f`: removes the total force and moment from a load.
    pub fn balance(&self, f: &mut [f64]) {
        self.remove(f, &self.motions, &self.constraints, true);
    }

    /// Returns the largest constraint violation of a displacement, relative to its size on the
    /// object.
    pub fn violation<const D: usize>(&self, object: &ScalarField<f64, D>, u: &[f64]) -> f64 {
        let size = dot(u, &object_product(object, u)).max(0.0).sqrt();
        let of = |z: &Vec<f64>, r: &Vec<f64>| dot(z, u).abs() / dot(z, r).sqrt();
        let pairs = self.constraints.iter().zip(&self.motions);
        let largest = pairs.map(|(z, r)| of(z, r)).fold(0.0, f64::max);
        if size > 0.0 { largest / size } else { 0.0 }
    }

    fn remove(&self, x: &mut [f64], against: &[Vec<f64>], along: &[Vec<f64>], transposed: bool) {
        let products: Vec<f64> = against.iter().map(|z| dot(z, x)).collect();
        for (i, r) in along.iter().enumerate() {
            let entry = |j: usize| {
                if transposed {
                    self.inverse[(j, i)]
                } else {
                    self.inverse[(i, j)]
                }
            };
            let share: f64 = products.iter().enumerate().map(|(j, p)| entry(j) * p).sum();
            let share = mutant!(share, RigidFree => 0.0);
            axpy(-share, r, x);
        }
    }
}
