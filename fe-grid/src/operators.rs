//! Mass and stiffness operators as quadratic laws: `1/2 (m u^2 + s |grad u|^2)`, component by
//! component, so that the Hessian action is `M[m] + L[s]`.

use std::borrow::Cow;

use crate::engine::{CellLaw, Jet, MAX_CELL_DATA, Point, Reads};
use crate::lane::{Element, Lane};
use crate::multigrid::CoefficientLaw;

/// Constant coefficients. [`UniformOperator`](crate::UniformOperator) applies `m M + s L` many
/// times faster than the cell engine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassStiffness {
    /// Coefficient `m` of the mass matrix.
    pub mass: f64,
    /// Coefficient `s` of the stiffness matrix.
    pub stiffness: f64,
}

/// Coefficients per cell: datum 0 is `m`, datum 1 is `s`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WeightedMassStiffness;

#[inline(always)]
fn density<L: Lane, const D: usize, const M: usize>(
    jet: &Jet<L, D, M>,
    mass: L,
    stiffness: L,
) -> (L, Jet<L, D, M>) {
    let mut flux = *jet;
    let (mut values, mut gradients) = (L::zero(), L::zero());
    for m in 0..M {
        flux.value[m] *= mass;
        values = jet.value[m].mul_add(flux.value[m], values);
        for k in 0..D {
            flux.gradient[m][k] *= stiffness;
            gradients = jet.gradient[m][k].mul_add(flux.gradient[m][k], gradients);
        }
    }
    ((values + gradients).scale(0.5), flux)
}

#[inline(always)]
fn state<L: Lane, const D: usize, const M: usize>(point: &Point<L, D, M>) -> Jet<L, D, M> {
    Jet {
        value: point.value,
        gradient: point.gradient,
    }
}

macro_rules! quadratic_law {
    ($law:ty, $data:expr, |$self:ident, $point:ident| $coefficients:expr) => {
        impl Reads for $law {
            const USES_VALUE: bool = true;
            const USES_GRADIENT: bool = true;
            const COEFFICIENTS: usize = 0;
            const CELL_DATA: usize = $data;
        }

        impl<const D: usize, const M: usize> CellLaw<D, M> for $law {
            const UNIFORM_HESSIAN: bool = true;

            #[inline(always)]
            fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L {
                self.gradient(point).0
            }
            #[inline(always)]
            fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>) {
                let ($self, $point) = (self, point);
                let (mass, stiffness): (L, L) = $coefficients;
                density(&state(point), mass, stiffness)
            }
            #[inline(always)]
            fn hessian_action<L: Lane>(
                &self,
                point: &Point<L, D, M>,
                direction: &Jet<L, D, M>,
            ) -> Jet<L, D, M> {
                let ($self, $point) = (self, point);
                let (mass, stiffness): (L, L) = $coefficients;
                density(direction, mass, stiffness).1
            }
        }
    };
}

quadratic_law!(MassStiffness, 0, |law, _point| (
    L::splat(law.mass),
    L::splat(law.stiffness)
));
quadratic_law!(WeightedMassStiffness, 2, |_law, point| (
    point.cell[0],
    point.cell[1]
));

impl<const D: usize, const M: usize> CoefficientLaw<D, M> for WeightedMassStiffness {
    fn coarsen(&self, _means: &mut [f64; MAX_CELL_DATA]) {}

    /// The largest bound of a single cell, as `x . A x` and `x . diag(A) x` are sums over cells.
    /// The mass and stiffness matrices of a cell have the same eigenvectors: products of the
    /// constant and the alternating vector along each axis.
    fn spectral_bound<T: Element>(&self, spacing: f64, cells: &[Cow<'_, [T]>]) -> Option<f64> {
        let area = spacing * spacing;
        let third = 1.0f64 / 3.0;
        let diagonal = [third.powi(D as i32), D as f64 * third.powi(D as i32 - 1)];
        let eigenvalues = |alternating: usize| {
            let constant = 0.5f64.powi((D - alternating) as i32);
            let mass = constant / 6.0f64.powi(alternating as i32);
            [mass, 12.0 * alternating as f64 * mass]
        };
        let mut bound: f64 = 0.0;
        for (mass, stiffness) in cells.first()?.iter().zip(cells.get(1)?.iter()) {
            let of = |unit: [f64; 2]| area * mass.to_f64() * unit[0] + stiffness.to_f64() * unit[1];
            for alternating in 0..=D {
                // A cell with zero coefficients contributes to neither sum.
                let ratio = of(eigenvalues(alternating)) / of(diagonal);
                if ratio.is_finite() {
                    bound = bound.max(ratio);
                }
            }
        }
        (bound > 0.0).then_some(bound)
    }
}
