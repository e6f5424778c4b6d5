//! Moments of the points in the cells of a slab, the sums of [`crate::scatter`].
//!
//! In a cell with local coordinates `s` the second moments are sums of `a` times the tensor
//! products of `(1-s)^2`, `s(1-s)`, `s^2`, the first moments sums of `b` times those of `1-s`, `s`.
//! The products are computed in lanes for a run of points at a time; then each point adds rows of
//! four numbers to the moments of its cell.

use crate::engine::kernel::CACHE_LINE;
use crate::lane::{Element, Lane, MAX_LANES};

/// Maximal number of products of all axes but the first.
const MAX_PRODUCTS: usize = 9;
/// Maximal number of quantities of a point: cell, local coordinates and weights.
const MAX_QUANTITIES: usize = 6;

/// Number of cells whose points are processed together: that of the widest lane on any machine, so
/// that the order of summation is the same on all.
pub(crate) const RUN: usize = MAX_LANES;

/// Points of a run of cells, `[quadrature point][quantity][cell]`: the index of the cell that
/// contains a point, relative to the first cell of the slab, the local coordinates there, and the
/// weights.
pub(crate) struct RunPoints<T, const D: usize> {
    pub(crate) data: Vec<T>,
    /// Number of cells of the run.
    pub(crate) length: usize,
}

impl<T: Element, const D: usize> RunPoints<T, D> {
    /// Number of quantities: cell, local coordinates, weights.
    const QUANTITIES: usize = D + 3;

    pub(crate) fn new() -> Self {
        Self {
            data: vec![T::default(); (Self::QUANTITIES * RUN) << D],
            length: 0,
        }
    }

    /// Returns the position of the quantities of a quadrature point.
    #[inline(always)]
    pub(crate) fn start(q: usize) -> usize {
        q * Self::QUANTITIES * RUN
    }
}

/// Products of local coordinates and weights for a run of points, `[product][point]`.
struct Products<T> {
    /// `(1-s)^2`, `s(1-s)`, `s^2` along `x`.
    along_x: [[T; RUN]; 3],
    /// The same for the other axes, times the first weight.
    across: [[T; RUN]; MAX_PRODUCTS],
    /// Shape functions of the plane of the first two axes.
    plane: [[T; RUN]; 4],
    /// `1-s`, `s` along the third axis, times the second weight; in 2D the weight alone.
    loads: [[T; RUN]; 2],
}

impl<T: Element> Products<T> {
    fn zero() -> Self {
        let zero = [T::default(); RUN];
        Self {
            along_x: [zero; 3],
            across: [zero; MAX_PRODUCTS],
            plane: [zero; 4],
            loads: [zero; 2],
        }
    }

    /// Computes the products for the points `i, i+1, ...` of a run.
    #[inline(always)]
    fn form<L: Lane<Element = T>, const D: usize>(&mut self, i: usize, quantities: &[T]) {
        let mut quantity = [L::zero(); MAX_QUANTITIES];
        let mut squares = [[L::zero(); 3]; D];
        for (k, x) in quantity.iter_mut().enumerate().take(D + 3) {
            *x = L::load(&quantities[k * RUN + i..(k + 1) * RUN]);
        }
        let [_, s, t, u, ..] = quantity;
        let (a, b) = (quantity[D + 1], quantity[D + 2]);
        for k in 0..D {
            let s = quantity[k + 1];
            let r = L::one() - s;
            squares[k] = [r * r, r * s, s * s];
        }
        for j in 0..3 {
            squares[0][j].store(&mut self.along_x[j][i..]);
            let product = a * squares[1][j];
            if D == 2 {
                product.store(&mut self.across[j][i..]);
                continue;
            }
            for k in 0..3 {
                (product * squares[D - 1][k]).store(&mut self.across[3 * k + j][i..]);
            }
        }
        let (r, q) = (L::one() - s, L::one() - t);
        let plane = [r * q, s * q, r * t, s * t];
        for j in 0..4 {
            plane[j].store(&mut self.plane[j][i..]);
        }
        if D == 2 {
            b.store(&mut self.loads[0][i..]);
        } else {
            (b * (L::one() - u)).store(&mut self.loads[0][i..]);
            (b * u).store(&mut self.loads[1][i..]);
        }
    }
}

/// Adds the points of a run to the moments of the cells of a slab; points in other cells are
/// ignored.
#[inline(always)]
pub(crate) fn accumulate<L: Lane<Element = T>, T: Element, const D: usize>(
    points: &RunPoints<T, D>,
    moments: &mut [f64],
) {
    let stride = const { moment_stride(D as u32) };
    let n_cells = (moments.len() / stride) as f64;
    // With constants known to it, the compiler would merge rows of four into longer ones;
    // assembling their factors takes more instructions than that saves.
    let (n_squares, n_loads) = std::hint::black_box((3usize.pow(D as u32 - 1), 1 << (D - 2)));
    let mut products = Products::zero();
    let size = RunPoints::<T, D>::QUANTITIES * RUN;
    let length = points.length;
    for quantities in points.data.chunks_exact(size) {
        let cells = &quantities[..length];
        let inside = |cell: &T| (0.0..n_cells).contains(&cell.to_f64());
        if !cells.iter().any(inside) {
            continue;
        }
        for i in (0..length).step_by(L::COUNT) {
            products.form::<L, D>(i, quantities);
        }
        for (i, cell) in cells.iter().enumerate() {
            if !inside(cell) {
                continue;
            }
            let block = &mut moments[cell.to_f64() as usize * stride..][..stride];
            let (squares, loads) = block.split_at_mut(const { first_moments(D as u32) });
            let mut row = [0.0; 4];
            for k in 0..3 {
                row[k] = products.along_x[k][i].to_f64();
            }
            add_rows(squares, row, &products.across[..n_squares], i);
            for k in 0..4 {
                row[k] = products.plane[k][i].to_f64();
            }
            add_rows(loads, row, &products.loads[..n_loads], i);
        }
    }
}

/// Adds a multiple of `row` to each row of four moments; the factors are those of point `i`.
#[inline(always)]
fn add_rows<T: Element>(moments: &mut [f64], row: [f64; 4], factors: &[[T; RUN]], i: usize) {
    for (moments, factor) in moments.chunks_exact_mut(4).zip(factors) {
        let factor = factor[i].to_f64();
        for (moment, x) in moments.iter_mut().zip(row) {
            *moment = x.mul_add(factor, *moment);
        }
    }
}

/// Returns the number of values per cell: rows of three second moments along `x`, padded to four,
/// and the first moments of the corners, padded to whole cache lines.
pub(crate) const fn moment_stride(d: u32) -> usize {
    (first_moments(d) + (1 << d)).next_multiple_of(CACHE_LINE / size_of::<f64>())
}

/// Returns the position of the first moments among the values of a cell.
pub(crate) const fn first_moments(d: u32) -> usize {
    4 * 3usize.pow(d - 1)
}
