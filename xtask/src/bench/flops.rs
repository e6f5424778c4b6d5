//! Floating-point operations, counted by evaluating a law with a number type that counts them.
//!
//! Additions, multiplications, divisions and roots count one each, a fused multiply-add two;
//! signs, comparisons and selections none. The operations of the engine outside the law are counted
//! by formulas: sum factorisation with two points per axis.

use std::cell::Cell;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use fe_grid::engine::{MAX_CELL_DATA, MAX_COEFFICIENTS};
use fe_grid::{CellLaw, Jet, Lane, Point, Reads, tensor};
use hyperelastic::StoredEnergy;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn count(operations: u64) {
    COUNT.with(|c| c.set(c.get() + operations));
}

/// A number type that counts operations.
#[derive(Clone, Copy)]
struct Counted(f64);

macro_rules! counted {
    ($op:ident, $f:ident) => {
        impl $op for Counted {
            type Output = Self;
            fn $f(self, other: Self) -> Self {
                count(1);
                Self(self.0.$f(other.0))
            }
        }
    };
    ($op:ident, $f:ident, $by:ident) => {
        impl $op for Counted {
            fn $f(&mut self, other: Self) {
                *self = self.$by(other);
            }
        }
    };
}

counted!(Add, add);
counted!(Sub, sub);
counted!(Mul, mul);
counted!(Div, div);
counted!(AddAssign, add_assign, add);
counted!(SubAssign, sub_assign, sub);
counted!(MulAssign, mul_assign, mul);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Lane for Counted {
    type Element = f64;
    type Mask = bool;
    const COUNT: usize = 1;

    fn splat(x: f64) -> Self {
        Self(x)
    }
    fn mul_add(self, a: Self, b: Self) -> Self {
        count(2);
        Self(self.0.mul_add(a.0, b.0))
    }
    fn sqrt(self) -> Self {
        count(1);
        Self(self.0.sqrt())
    }
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }
    fn less(self, other: Self) -> bool {
        self.0 < other.0
    }
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    fn any(mask: bool) -> bool {
        mask
    }
    fn split_exponent(self) -> (Self, Self) {
        let (m, e) = self.0.split_exponent();
        (Self(m), Self(e))
    }
    fn load(source: &[f64]) -> Self {
        Self(<f64 as Lane>::load(source))
    }
    fn store(self, target: &mut [f64]) {
        self.0.store(target);
    }
}

/// Derivatives that are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verb {
    /// The value.
    Value,
    /// Value and gradient.
    Gradient,
    /// The Hessian applied to a direction.
    Hessian,
}

/// Operations for one quadrature point, of the law and of its share in those of the cell.
pub fn per_point<F, const D: usize, const M: usize>(law: &F, verb: Verb) -> f64
where
    F: CellLaw<D, M>,
{
    law_operations(law, verb) + cell_operations::<F, D, M>(verb) / f64::from(1u32 << D)
}

/// The elastic energy of an object in a void, with the law inlined: a compiled law cannot be run on
/// a number that counts.
pub struct Inlined<W>(pub W);

impl<W: Sync> Reads for Inlined<W> {
    const USES_VALUE: bool = false;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<W: StoredEnergy<D>, const D: usize> CellLaw<D, D> for Inlined<W> {
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.0.value(&point.gradient) * weight(point)
    }

    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let (value, gradient) = self.0.weighted_gradient(&point.gradient, weight(point));
        let value_part = [L::zero(); D];
        (
            value,
            Jet {
                value: value_part,
                gradient,
            },
        )
    }

    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let change = self.0.hessian_action(&point.gradient, &direction.gradient);
        Jet {
            value: [L::zero(); D],
            gradient: tensor::scale(&change, weight(point)),
        }
    }
}

fn weight<L: Lane, const D: usize>(point: &Point<L, D, D>) -> L {
    point.coefficient[0].mul_add(L::splat(0.5), L::splat(0.5))
}

fn law_operations<F, const D: usize, const M: usize>(law: &F, verb: Verb) -> f64
where
    F: CellLaw<D, M>,
{
    let number = |i: usize| Counted(0.01 * (i as f64).sin());
    let direction = Jet {
        value: std::array::from_fn(|m| number(m + 5)),
        gradient: std::array::from_fn(|m| std::array::from_fn(|k| number(7 * m + k))),
    };
    let point = Point {
        position: [Counted(0.4); D],
        value: direction.value,
        gradient: direction.gradient,
        coefficient: [Counted(0.5); MAX_COEFFICIENTS],
        cell: [Counted(0.5); MAX_CELL_DATA],
    };
    COUNT.with(|c| c.set(0));
    match verb {
        Verb::Value => drop(law.value(&point).0),
        Verb::Gradient => drop(law.gradient(&point).0.0),
        Verb::Hessian => drop(law.hessian_action(&point, &direction).value[0].0),
    }
    COUNT.with(Cell::get) as f64
}

/// Operations for one cell outside the law.
fn cell_operations<F, const D: usize, const M: usize>(verb: Verb) -> f64
where
    F: CellLaw<D, M>,
{
    let corners = 1 << D;
    let face = corners / 2;
    // One multiply-add per number and axis, and one common factor.
    let value = 2 * D * corners + corners;
    // Along every axis a difference and a factor for each edge, interpolated across.
    let slope = D * face * (2 + 2 * (D - 1));
    // The transpose; the contributions of the axes are added at the corners.
    let slope_transposed = D * face * 2 * (D - 1) + (D - 1) * corners + corners;
    let (uses_value, uses_gradient) = (
        usize::from(F::USES_VALUE) * M,
        usize::from(F::USES_GRADIENT) * M,
    );
    let evaluated = uses_value * value + uses_gradient * slope;
    let mut total = evaluated + F::COEFFICIENTS * value;
    if verb == Verb::Hessian {
        total += evaluated;
    }
    if verb != Verb::Hessian {
        total += corners;
    }
    if verb != Verb::Value {
        let collected = uses_gradient * D * corners;
        let scattered = M * corners;
        let both = usize::from(F::USES_VALUE && F::USES_GRADIENT) * M * corners;
        total += uses_value * value + uses_gradient * slope_transposed;
        total += collected + scattered + both;
    }
    total as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::operators::MassStiffness;

    #[test]
    fn the_operations_of_a_law_are_those_of_its_formula() {
        let law = MassStiffness {
            mass: 1.0,
            stiffness: 0.5,
        };
        // Flux: 3 products; energy: 3 multiply-adds, 1 sum, 1 factor.
        assert_eq!(law_operations::<_, 2, 1>(&law, Verb::Gradient), 11.0);
    }

    #[test]
    fn the_operations_around_a_law_are_those_of_sum_factorisation() {
        // Value 20, slope 16, transposed 16, collected 8, scattered 4, both 4, sum of values 4.
        let law = MassStiffness {
            mass: 1.0,
            stiffness: 0.5,
        };
        let cell = cell_operations::<MassStiffness, 2, 1>(Verb::Gradient);
        assert_eq!(cell, f64::from(20 + 16 + 20 + 16 + 8 + 4 + 4 + 4));
        let all = per_point::<_, 2, 1>(&law, Verb::Gradient);
        assert_eq!(all, 11.0 + cell / 4.0);
    }
}
