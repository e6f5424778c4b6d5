//! Inputs for tests that need no randomness of their own.
#![allow(dead_code)]

use fe_grid::Grid;

/// Numbers in `[-1, 1)` from a seed (a 64-bit linear congruential generator).
pub fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1;
    (0..n)
        .map(|_| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

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
