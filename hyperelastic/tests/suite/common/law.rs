//! Laws behind tables of functions: each law is compiled once, and each property once for a dimension. With the law
//! as a type parameter the formulas of twelve laws would stand in the code of every property.

use super::Matrix;
use fe_grid::{Lane, Tensor};
use hyperelastic::{Hypotheses, LameModuli, PolyconvexForm, StoredEnergy};
use std::fmt::Debug;

/// The value of a law and its derivatives, in one precision.
pub trait Evaluate<L: Lane, const D: usize> {
    fn value(&self, h: &Tensor<L, D>) -> L;
    fn gradient(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>);
    fn hessian_action(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D>;
}

impl<L: Lane, W: StoredEnergy<D>, const D: usize> Evaluate<L, D> for W {
    fn value(&self, h: &Tensor<L, D>) -> L {
        StoredEnergy::value(self, h)
    }

    fn gradient(&self, h: &Tensor<L, D>) -> (L, Tensor<L, D>) {
        StoredEnergy::gradient(self, h)
    }

    fn hessian_action(&self, h: &Tensor<L, D>, b: &Tensor<L, D>) -> Tensor<L, D> {
        StoredEnergy::hessian_action(self, h, b)
    }
}

/// A [`StoredEnergy`] in both precisions.
pub trait Law<const D: usize>: Evaluate<f64, D> + Evaluate<f32, D> + Debug {
    fn moduli(&self) -> LameModuli;
    fn hypotheses(&self) -> Hypotheses;
    fn name(&self) -> &'static str;
}

impl<W: StoredEnergy<D>, const D: usize> Law<D> for W {
    fn moduli(&self) -> LameModuli {
        StoredEnergy::moduli(self)
    }

    fn hypotheses(&self) -> Hypotheses {
        StoredEnergy::hypotheses(self)
    }

    fn name(&self) -> &'static str {
        StoredEnergy::name(self)
    }
}

/// A [`PolyconvexForm`].
pub trait PolyconvexLaw<const D: usize>: Law<D> {
    fn polyconvex_value(&self, a: &Matrix<D>, cofactor: &Matrix<D>, determinant: f64) -> f64;
}

impl<W: PolyconvexForm<D>, const D: usize> PolyconvexLaw<D> for W {
    fn polyconvex_value(&self, a: &Matrix<D>, cofactor: &Matrix<D>, determinant: f64) -> f64 {
        PolyconvexForm::polyconvex_value(self, a, cofactor, determinant)
    }
}
