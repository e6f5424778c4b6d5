//! Estimate of the memory of the metric, available before it is computed.

use super::boundary::BoundaryPoint;
use super::cut::CutPoint;
use fe_grid::ScalarField;
use hyperelastic::{Corotational, CycleMemory};

/// Size of a number in double precision, in bytes.
const DOUBLE: u64 = 8;
/// Velocities: the solution, the load, and what conjugate gradients need.
const VELOCITIES: u64 = 6;
/// The signed distance, the variation, and the fractions of the cells.
const SCALARS: u64 = 3;
/// Points of the boundary in a cell, and of the quadrature of its occupied part, with room to grow.
const BOUNDARY_POINTS: [u64; 2] = [4, 8];
const CUT_POINTS: [u64; 2] = [12, 64];

/// Estimates the most memory that the [metric](super::estimate()) at a shape needs at one time, in bytes.
///
/// Counted are all arrays whose size grows with the grid, and those of the cells that the boundary cuts: each has
/// a matrix.
pub fn memory_estimate<const D: usize>(distance: &ScalarField<f64, D>) -> u64 {
    let grid = distance.grid();
    let d = D as u64;
    let fields = VELOCITIES * d + SCALARS + Corotational::<D>::CELL_DATA as u64;
    let cycle = CycleMemory::on(grid);
    let unknowns = d << D;
    let of_cell = unknowns * unknowns * DOUBLE
        + BOUNDARY_POINTS[D - 2] * size_of::<BoundaryPoint<D>>() as u64
        + CUT_POINTS[D - 2] * size_of::<CutPoint<D>>() as u64;
    // The velocity of the shape itself is kept while that of coarser samples is computed, with its distance.
    let kept = d + 2;
    (fields + kept) * DOUBLE * grid.n_nodes() as u64
        + cycle.matrices
        + cycle.work_space
        + n_cut(distance) * of_cell
}

/// The number of cells with nodes on both sides of the boundary.
fn n_cut<const D: usize>(distance: &ScalarField<f64, D>) -> u64 {
    let (grid, values) = (distance.grid(), distance.as_slice());
    let strides = grid.strides();
    let is_cut = |cell: usize| {
        let first = grid.node_index(grid.cell(cell));
        let corner = |c: usize| {
            let offset: usize = (0..D).map(|k| (c >> k & 1) * strides[k]).sum();
            values[first + offset] > 0.0
        };
        (1..1 << D).any(|c| corner(c) != corner(0))
    };
    (0..grid.n_cells()).filter(|&cell| is_cut(cell)).count() as u64
}
