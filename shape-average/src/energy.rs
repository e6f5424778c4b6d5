//! The terms of the functional
//!
//! ```text
//! E = sum_i lambda_i W_i[phi_i] + (gamma / n) sum_i F[v o phi_i, v_i] + mu_L L[v].
//! ```
//!
//! With several components `c` there are an average `v^c` and phase fields `v_i^c` of each. `F` and `L`
//! are then sums over the components, while `W_i` is one energy, of the union of the components.

use fe_grid::{Distribution, mutant};
use serde::Serialize;

/// Elastic energies below this share of the whole functional are not resolved: where quadrature
/// points pass from cell to cell, the functional has kinks of 1e-6 to 3e-6 (measured on bars at 129
/// nodes a side), a few per cent of this.
const RESOLVED_SHARE: f64 = 5e-5;

/// The terms of the functional, without their weights, and their weighted sum.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Energy {
    /// Value of the functional: the weighted sum of the terms, without the barrier. In the
    /// iterations of a median the terms of each shape are multiplied by its share.
    pub total: f64,
    /// Contributions of the elastic, the mismatch and the length terms to the total.
    pub parts: [f64; 3],
    /// Elastic energy `W_i` of each shape. Those of shapes of weight zero, and their mismatch, do not
    /// enter the total.
    pub elastic: Vec<f64>,
    /// Mismatch `F_i` of each shape, the sum of those of its components.
    pub mismatch: Vec<f64>,
    /// Interface length `L` of the average, the sum of those of its components.
    pub length: f64,
    /// The terms of every component; empty if there is one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<ComponentEnergy>,
    /// Barrier against folding, which the minimiser adds to the functional: zero if all
    /// determinants exceed its onset.
    pub barrier: f64,
    /// Estimate of the energy above the minimum, `J - min J` of the reduced functional, from half the
    /// Newton decrement of a model of its Hessian. On six averages of bars, balls and ellipsoids it was
    /// 0.5 to 1.2 times what a longer run won at three times the default tolerance, and 0.2 to 1.1 times
    /// at the default, where it misses the jumps of the discrete mismatch. Only on the finest level of
    /// an arithmetic mean computed by L-BFGS; `None` elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining: Option<f64>,
}

/// The terms of one component, without their weights.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ComponentEnergy {
    /// Mismatch of the component of each shape.
    pub mismatch: Vec<f64>,
    /// Interface length of the component of the average.
    pub length: f64,
}

/// The weights of the terms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    /// `lambda_i`.
    pub shapes: Vec<f64>,
    /// Additional factor of both terms of a shape: one except in the iterations of a median.
    pub shares: Vec<f64>,
    /// `gamma / n`.
    pub mismatch: f64,
    /// `mu_L`.
    pub length: f64,
}

impl Weights {
    /// Returns the weight of the elastic energy of a shape.
    pub fn of_elastic(&self, shape: usize) -> f64 {
        self.shares[shape] * self.shapes[shape]
    }

    /// Returns the weight of the mismatch of a shape.
    pub fn of_mismatch(&self, shape: usize) -> f64 {
        mutant!(self.shares[shape], MedianMismatch => 1.0) * self.mismatch
    }
}

/// The terms of one shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShapeTerms {
    /// Elastic energy.
    pub elastic: f64,
    /// Mismatch of every component.
    pub mismatch: Vec<f64>,
    /// Barrier against folding, including its weight.
    pub barrier: f64,
}

impl ShapeTerms {
    /// The terms of all processes, given those of the shapes of this one. Collective.
    pub fn share(own: &[Self], n_components: usize, distribution: &Distribution) -> Vec<Self> {
        let numbers: Vec<_> = own.iter().map(|t| [t.elastic, t.barrier]).collect();
        let all = distribution.share(&numbers).into_iter();
        let mut all: Vec<Self> = all
            .map(|[elastic, barrier]| Self {
                elastic,
                mismatch: Vec::with_capacity(n_components),
                barrier,
            })
            .collect();
        for c in 0..n_components {
            let numbers: Vec<_> = own.iter().map(|t| [t.mismatch[c]]).collect();
            for (terms, [mismatch]) in all.iter_mut().zip(distribution.share(&numbers)) {
                terms.mismatch.push(mismatch);
            }
        }
        all
    }
}

impl Energy {
    /// The weighted elastic energy, or what is resolved of the functional if that is more.
    pub(crate) fn elastic_scale(&self) -> f64 {
        let [elastic, ..] = self.parts;
        elastic.max(RESOLVED_SHARE * self.total)
    }

    /// Returns the quantity that is minimised.
    pub fn objective(&self) -> f64 {
        self.total + self.barrier
    }

    /// The energy of the terms of all shapes and the lengths of the components of the average.
    pub(crate) fn new(weights: &Weights, terms: &[ShapeTerms], lengths: &[f64]) -> Self {
        let elastic: Vec<f64> = terms.iter().map(|t| t.elastic).collect();
        let mismatch: Vec<f64> = terms.iter().map(|t| t.mismatch.iter().sum()).collect();
        let length = lengths.iter().sum();
        let of_component = |(c, length): (usize, &f64)| ComponentEnergy {
            mismatch: terms.iter().map(|t| t.mismatch[c]).collect(),
            length: *length,
        };
        let several = lengths.len() > 1;
        let components = lengths.iter().enumerate().filter(|_| several);
        let components = components.map(of_component).collect();
        let barrier = terms.iter().map(|t| t.barrier).sum();
        let sum = |terms: &[f64], weight: &dyn Fn(usize) -> f64| -> f64 {
            let weighted = terms.iter().enumerate().map(|(i, term)| weight(i) * term);
            weighted.sum()
        };
        let parts = [
            sum(&elastic, &|i| weights.of_elastic(i)),
            sum(&mismatch, &|i| weights.of_mismatch(i)),
            weights.length * length,
        ];
        let total = parts.iter().sum();
        Self {
            total,
            parts,
            elastic,
            mismatch,
            length,
            components,
            barrier,
            remaining: None,
        }
    }
}
