//! Shared by the integration tests.

pub mod assembled;
pub mod objectives;

use fe_grid::Grid;
use fe_grid::random::noise;

/// A smooth displacement of size `amplitude` times the box.
pub fn smooth_displacement<const D: usize>(grid: &Grid<D>, amplitude: f64, seed: u64) -> Vec<f64> {
    let phases = noise(4 * D * D, seed);
    let extent = grid.extent();
    let mut u = Vec::with_capacity(D * grid.n_nodes());
    for m in 0..D {
        for i in 0..grid.n_nodes() {
            let x = grid.position(grid.node(i));
            let mut s = 1.0;
            for k in 0..D {
                let p = &phases[4 * (m * D + k)..];
                s *= (3.0 * p[0] * x[k] / extent[k] + 3.0 * p[1]).sin();
            }
            u.push(amplitude * extent[m] * s);
        }
    }
    u
}
