//! Phase fields and elastic weights from signed distances.
//!
//! With `d` the signed distance (positive inside) and `epsilon` the interface width:
//!
//! - phase field `v = 1 - exp(-|d|/(2 epsilon))`, the exact minimiser of the interface length
//!   `L = int epsilon |grad v|^2 + (v - 1)^2/(4 epsilon)` with `v = 0` on the boundary;
//! - elastic weight `kappa = (1 - delta) chi(d) + delta`, with a compact transition `chi` of
//!   half-width `2 epsilon` centred on the boundary, and the void stiffness `delta`.
//!
//! # Closed forms
//! Per unit length (area) of a flat boundary, with `v` the profile above; on a grid `L` is smaller, see
//! [`InterfaceLength`](crate::InterfaceLength):
//!
//! - `L[v] = 1`;
//! - mismatch `F[w, v] = (1/epsilon) int w^2 (1 - v)^2 + v^2 (1 - w)^2` of the boundary against
//!   nothing, `w = 1`: `2`;
//! - against itself, `w = v`: `(2/epsilon) int v^2 (1 - v)^2 = 2/3`, not zero;
//! - against the best `w = v^2/(v^2 + (1 - v)^2)`: the floor
//!   `(1/epsilon) int v^2 (1 - v)^2/(v^2 + (1 - v)^2) = pi/2 - 1`. Subtract it before any
//!   relative comparison of mismatches.

use fe_grid::{Field, mutant};
use levelset::Compact;

use crate::error::PhaseFieldError;

/// Mismatch of a flat edge against its absence, per unit length.
pub const MISMATCH_UNMATCHED: f64 = 2.0;
/// Mismatch of a flat edge against the same profile, per unit length.
pub const MISMATCH_MATCHED: f64 = 2.0 / 3.0;
/// Least mismatch of a flat edge against any field, per unit length.
pub const MISMATCH_FLOOR: f64 = std::f64::consts::FRAC_PI_2 - 1.0;

/// The optimal profile of a phase field across a boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    interface_width: f64,
}

impl Profile {
    /// Creates the profile of interface width `epsilon > 0`, in the unit of the coordinates.
    ///
    /// # Errors
    /// [`PhaseFieldError::Parameter`] if the width is not positive and finite.
    pub fn new(interface_width: f64) -> Result<Self, PhaseFieldError> {
        Ok(Self {
            interface_width: positive("interface_width", interface_width)?,
        })
    }

    /// Returns `v = 1 - exp(-|d|/(2 epsilon))` at signed distance `d`.
    pub fn value(self, signed_distance: f64) -> f64 {
        let decay = mutant!(2.0, ProfileWidth => 1.0) * self.interface_width;
        -(-signed_distance.abs() / decay).exp_m1()
    }

    /// Computes the phase field of a signed distance.
    pub fn phase_field<const D: usize>(
        self,
        signed_distance: &Field<f64, D, 1>,
    ) -> Field<f64, D, 1> {
        map(signed_distance, |d| self.value(d))
    }
}

/// Stiffness of the object and of the void around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticWeight {
    indicator: Compact,
    void_stiffness: f64,
}

impl ElasticWeight {
    /// Creates the weight for interface width `epsilon > 0` and void stiffness `0 <= delta <= 1`.
    ///
    /// # Errors
    /// [`PhaseFieldError::Parameter`].
    pub fn new(interface_width: f64, void_stiffness: f64) -> Result<Self, PhaseFieldError> {
        let cells = mutant!(2.0, ElasticWidth => 6.0);
        let half_width = cells * positive("interface_width", interface_width)?;
        if !(0.0..=1.0).contains(&void_stiffness) {
            return Err(PhaseFieldError::Parameter {
                name: "void_stiffness",
                expected: "between 0 and 1",
                value: void_stiffness,
            });
        }
        Ok(Self {
            indicator: Compact::new(half_width)?,
            void_stiffness,
        })
    }

    /// Returns the smooth indicator `chi` at signed distance `d`: 1 for `d > 2 epsilon`, 1/2 on the
    /// boundary, 0 for `d < -2 epsilon`.
    pub fn indicator(self, signed_distance: f64) -> f64 {
        self.indicator.value(signed_distance)
    }

    /// Returns the weight `kappa = (1 - delta) chi + delta` at signed distance `d`.
    pub fn value(self, signed_distance: f64) -> f64 {
        (1.0 - self.void_stiffness) * self.indicator(signed_distance) + self.void_stiffness
    }

    /// Computes the indicator `chi` of a signed distance at every node.
    pub fn indicator_field<const D: usize>(
        self,
        signed_distance: &Field<f64, D, 1>,
    ) -> Field<f64, D, 1> {
        map(signed_distance, |d| self.indicator(d))
    }

    /// Computes the weight `kappa` of a signed distance at every node.
    pub fn weight_field<const D: usize>(
        self,
        signed_distance: &Field<f64, D, 1>,
    ) -> Field<f64, D, 1> {
        map(signed_distance, |d| self.value(d))
    }
}

fn map<const D: usize>(field: &Field<f64, D, 1>, f: impl Fn(f64) -> f64) -> Field<f64, D, 1> {
    let mut mapped = field.clone();
    for v in mapped.as_mut_slice() {
        *v = f(*v);
    }
    mapped
}

pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64, PhaseFieldError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(PhaseFieldError::Parameter {
        name,
        expected: "positive and finite",
        value,
    })
}
