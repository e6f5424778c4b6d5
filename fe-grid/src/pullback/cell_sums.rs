//! Sums of the points of a deformed cell: fluxes of its corners, and its element matrix.

use crate::engine::element::MAX_CORNERS;
use crate::grid::Grid;
use crate::lane::{Lane, MAX_LANES};
use crate::tensor::Tensor;

/// Entries `(r, s)`, `r <= s`, of the blocks of an element matrix.
pub(super) const fn block_entries(d: usize) -> usize {
    d * (d + 1) / 2
}

/// What the points of a cell add up to, beside the element matrix: that is kept as one `2^D` x `2^D`
/// matrix for every entry `r <= s` of its blocks.
#[derive(Clone, Copy)]
pub(super) struct Sums<const D: usize> {
    pub gradient: [[f64; MAX_CORNERS]; D],
    pub trace: f64,
}

pub(super) type CornerMatrix = [[f64; MAX_CORNERS]; MAX_CORNERS];

/// Positions of the points of some lanes.
pub(super) struct Places<const D: usize> {
    /// Lanes whose points fall into the slab.
    pub lanes: [usize; MAX_LANES],
    pub count: usize,
    /// Cells, counted from the first of the slab.
    pub cell: [usize; MAX_LANES],
    pub local: [[f64; MAX_LANES]; D],
    /// Zero where a point was moved to a face.
    pub inside: [[f64; MAX_LANES]; D],
}

/// Results of the law at the points of some lanes, times the quadrature weight.
pub(super) struct Found<const D: usize> {
    pub value: [f64; MAX_LANES],
    pub flux: Tensor<[f64; MAX_LANES], D>,
    /// `[r][s]` for `r <= s`: `T_(ra)(sb)` at `[a][b]`.
    pub tangent: Tensor<Tensor<[f64; MAX_LANES], D>, D>,
}

impl<const D: usize> Found<D> {
    pub fn new() -> Self {
        let none = [[[0.0; MAX_LANES]; D]; D];
        Self {
            value: [0.0; MAX_LANES],
            flux: none,
            tangent: [[none; D]; D],
        }
    }
}

/// Place of entry `r <= s` among the stored ones.
#[inline(always)]
pub(super) const fn upper<const D: usize>(r: usize, s: usize) -> usize {
    r * D + s - r * (r + 1) / 2
}

/// Derivatives of all shape functions of the cell of a point, `[b][corner]`.
#[inline(always)]
pub(super) fn slopes<const D: usize>(
    grid: &Grid<D>,
    places: &Places<D>,
    l: usize,
) -> [[f64; MAX_CORNERS]; D] {
    let mut slopes = [[0.0; MAX_CORNERS]; D];
    for b in 0..D {
        let scale = places.inside[b][l] / grid.spacing();
        for c in 0..1usize << D {
            let mut product = if c >> b & 1 == 1 { scale } else { -scale };
            for k in 0..D {
                if k != b {
                    let x = places.local[k][l];
                    product *= if c >> k & 1 == 1 { x } else { 1.0 - x };
                }
            }
            slopes[b][c] = product;
        }
    }
    slopes
}

#[inline(always)]
pub(super) fn scatter_flux<const D: usize>(
    found: &Found<D>,
    slopes: &[[f64; MAX_CORNERS]; D],
    l: usize,
    sums: &mut Sums<D>,
) {
    for r in 0..D {
        for b in 0..D {
            let flux = found.flux[r][b][l];
            for c in 0..MAX_CORNERS {
                sums.gradient[r][c] = slopes[b][c].mul_add(flux, sums.gradient[r][c]);
            }
        }
    }
}

/// Adds the second derivative at a point to the element matrices of its cell, in registers along the rows:
/// left to itself the compiler gathers columns.
#[inline(always)]
pub(super) fn scatter_tangent<L: Lane<Element = f64>, const D: usize>(
    found: &Found<D>,
    slopes: &[[f64; MAX_CORNERS]; D],
    l: usize,
    matrices: &mut [CornerMatrix],
    sums: &mut Sums<D>,
) {
    for r in 0..D {
        for a in 0..D {
            sums.trace += found.tangent[r][r][a][a][l];
        }
        for s in r..D {
            let matrix = &mut matrices[upper::<D>(r, s)];
            let mut along = [[0.0; MAX_CORNERS]; D];
            for b in 0..D {
                for j in (0..MAX_CORNERS).step_by(L::COUNT) {
                    let mut sum = L::zero();
                    for a in 0..D {
                        let entry = L::splat(found.tangent[r][s][a][b][l]);
                        sum = L::load(&slopes[a][j..]).mul_add(entry, sum);
                    }
                    sum.store(&mut along[b][j..]);
                }
            }
            for j in 0..1usize << D {
                for k in (0..MAX_CORNERS).step_by(L::COUNT) {
                    let mut sum = L::load(&matrix[j][k..]);
                    for b in 0..D {
                        sum = L::load(&slopes[b][k..]).mul_add(L::splat(along[b][j]), sum);
                    }
                    sum.store(&mut matrix[j][k..]);
                }
            }
        }
    }
}
