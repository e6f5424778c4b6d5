//! Shared by the integration tests.

#![allow(dead_code, reason = "every program uses a part")]

use fe_grid::{Field, Grid, ScalarField, VectorField};
use shape_pca::Average;

/// A smooth displacement of moderate strain, zero on the faces of the box; another for every phase.
pub fn smooth<const D: usize>(grid: Grid<D>, size: f64, phase: f64) -> VectorField<f64, D> {
    Field::from_fn(grid, |x| {
        let inside: f64 = x.iter().map(|x| 4.0 * x * (1.0 - x)).product();
        std::array::from_fn(|k| {
            let along = x[(k + 1) % D] + 0.5 * x[k];
            inside * size * (4.0 * along + phase * (k + 1) as f64).sin()
        })
    })
}

/// An object in the middle of the box with a soft edge.
pub fn blob<const D: usize>(grid: Grid<D>, radius: f64) -> ScalarField<f64, D> {
    Field::from_fn(grid, |x| {
        let distance = x.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt();
        [(0.5 + 8.0 * (radius - distance)).clamp(0.0, 1.0)]
    })
}

/// Three deformed blobs. The stresses of these deformations do not balance: what is tested with
/// them does not rest on it.
pub fn three<const D: usize>(grid: Grid<D>) -> Average<D> {
    let displacements = [0.0, 1.3, 2.9].map(|phase| smooth(grid, 0.03, phase));
    let indicators = [0.25, 0.28, 0.3].map(|radius| blob(grid, radius));
    Average::new(displacements.into(), indicators.into(), vec![1.0 / 3.0; 3]).unwrap()
}
