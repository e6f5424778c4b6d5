//! Infinitesimal rigid motions of deformed objects, and the mass of the objects.

use crate::field::Field;
use crate::vector::dot;

/// Some unknowns of a vector, one after the other, with a value each; all others are zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// The first of the unknowns.
    pub first: usize,
    /// The values.
    pub values: Vec<f64>,
}

impl Motion {
    /// The scalar product with a vector of all unknowns.
    pub(crate) fn dot(&self, vector: &[f64]) -> f64 {
        dot(&self.values, &vector[self.first..][..self.values.len()])
    }

    /// As a vector of all unknowns.
    pub fn whole(&self, dim: usize) -> Vec<f64> {
        let mut whole = vec![0.0; dim];
        whole[self.first..][..self.values.len()].copy_from_slice(&self.values);
        whole
    }
}

/// The mass of objects at the unknowns of their displacements, component by component: for every indicator `chi`
/// with its weight `w`, `w max(chi(x), least) / S`, `S = sum w chi(x)` over all nodes of all objects. `v . M v` is
/// then the mean square of a displacement `v` of the points of all objects, and the void has almost no mass.
pub fn object_mass<const D: usize>(indicators: &[&[f64]], weights: &[f64], least: f64) -> Vec<f64> {
    let parts = || indicators.iter().zip(weights);
    let total: f64 = parts()
        .map(|(chi, weight)| weight * chi.iter().sum::<f64>())
        .sum();
    let mut mass = Vec::new();
    for (chi, weight) in parts() {
        for _ in 0..D {
            mass.extend(chi.iter().map(|chi| weight * chi.max(least) / total));
        }
    }
    mass
}

/// The infinitesimal rigid motions of deformed objects together: for every translation and, after these, every
/// rotation `w` of space the displacements `w(phi_i(x))` at the nodes of all objects, with the mass of the
/// objects ([`object_mass`]). Rotations are those about the centre of the deformed objects. The vectors begin at
/// the unknown `first`.
pub fn rigid_motions<const D: usize>(
    displacements: &[Field<f64, D, D>],
    mass: &[f64],
    first: usize,
) -> Vec<Motion> {
    let motion = |of: &dyn Fn([f64; D]) -> [f64; D]| {
        let mut values = Vec::with_capacity(mass.len());
        for displacement in displacements {
            for k in 0..D {
                let nodes = 0..displacement.grid().n_nodes();
                values.extend(nodes.map(|node| of(displacement.deformed(node))[k]));
            }
        }
        Motion { first, values }
    };
    let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(k == i)));
    let mut all: Vec<Motion> = (0..D).map(|i| motion(&|_| unit(i))).collect();
    let positions = motion(&|x| x);
    let centre: [f64; D] = std::array::from_fn(|k| {
        let own = all[k].values.iter();
        let moments = positions.values.iter().zip(mass).zip(own.clone());
        let whole: f64 = mass.iter().zip(own).map(|(mass, own)| mass * own).sum();
        moments.map(|((x, mass), own)| x * mass * own).sum::<f64>() / whole
    });
    for i in 0..D {
        for j in 0..i {
            all.push(motion(&|x| {
                std::array::from_fn(|k| match k {
                    k if k == i => x[j] - centre[j],
                    k if k == j => centre[i] - x[i],
                    _ => 0.0,
                })
            }));
        }
    }
    all
}
