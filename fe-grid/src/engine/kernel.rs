//! The work on one slab of cells: rows side by side in lanes.

use super::block::{Block, BlockFluxes, Evaluated, RowData, component_rows};
use super::element::{
    MAX_CORNERS, MAX_FACE_CORNERS, differences_transposed, interpolate, shape_derivative,
    shape_value,
};
use super::rows::{NodeRows, Row, block_starts, first_cell, rows_of_layer};
use super::slabs::Slab;
use super::{CellLaw, Data, Jet, Reads};
use crate::grid::Grid;
use crate::half::Half;
use crate::lane::{Element, Lane, LaneKernel, MAX_LANES};

/// Value only.
pub(super) const VALUE: u8 = 0;
/// Value and gradient.
pub(super) const GRADIENT: u8 = 1;
/// Hessian action on a direction.
pub(super) const HESSIAN: u8 = 2;
/// Block diagonal of the Hessian: `M * M` numbers a node.
pub(super) const DIAGONAL: u8 = 3;

/// The work on one slab.
pub(super) struct RowKernel<'a, F, T: Element, const D: usize, const M: usize, const MODE: u8> {
    pub grid: &'a Grid<D>,
    pub law: &'a F,
    pub data: Data<'a, T>,
    /// The data of the cells, where they are halves.
    pub halves: &'a [&'a [Half]],
    /// The unknown, component by component.
    pub state: &'a [T],
    /// The direction of a Hessian action; otherwise empty.
    pub direction: &'a [T],
    /// A factor of the derivatives.
    pub factor: f64,
    pub slab: Slab<'a, T>,
}

/// Work space for a block of cells.
///
/// It is aligned to cache lines. With it on the stack, the compiler aligns the whole frame, and
/// registers that it has to put there for a while do not straddle two lines either.
#[repr(C, align(64))]
struct Scratch<L, const D: usize, const M: usize> {
    block: Block<L, D, M>,
    direction: Evaluated<L, D, M>,
    fluxes: BlockFluxes<L, D, M>,
}

impl<L: Lane, const D: usize, const M: usize> Scratch<L, D, M> {
    #[inline(always)]
    fn new<R: Reads>(grid: &Grid<D>) -> Self {
        Self {
            block: Block::zero::<R>(grid),
            direction: Evaluated::zero(),
            fluxes: BlockFluxes::zero(),
        }
    }
}

/// Result of a slab.
pub(super) struct SlabResult {
    /// Sum of the densities at the quadrature points, not yet times the weight.
    pub sum: f64,
    /// First cell with a density that is not finite.
    pub inadmissible: Option<usize>,
}

impl<F, T, const D: usize, const M: usize, const MODE: u8> LaneKernel<T>
    for RowKernel<'_, F, T, D, M, MODE>
where
    F: CellLaw<D, M>,
    T: Element,
{
    type Output = SlabResult;

    #[inline(always)]
    fn run<L: Lane<Element = T>>(mut self) -> SlabResult {
        let outputs = if MODE == DIAGONAL { M * M } else { M };
        let length = self.grid.cells_per_axis()[0];
        let mut row_values = vec![T::default(); length];
        let mut memory = match MODE {
            VALUE => Vec::new(),
            _ => vec![T::default(); (1 << D) * outputs * part_stride(length) + 2 * MAX_LANES],
        };
        // Registers that lie within one cache line are written faster.
        let first = memory.as_ptr().align_offset(CACHE_LINE);
        let parts = memory.get_mut(first..).unwrap_or_default();
        let mut scratch = Scratch::new::<F>(self.grid);
        let mut result = SlabResult {
            sum: 0.0,
            inadmissible: None,
        };
        for layer in self.slab.layers.clone() {
            for row in rows_of_layer(self.grid, layer) {
                self.row::<L>(row, &mut scratch, &mut row_values, parts);
                if MODE <= GRADIENT {
                    let sum = ordered_sum(&row_values);
                    result.sum += sum;
                    if !sum.is_finite() && result.inadmissible.is_none() {
                        let first = row_values.iter().position(|v| !v.to_f64().is_finite());
                        result.inadmissible = Some(first_cell(self.grid, row) + first.unwrap_or(0));
                    }
                }
                if MODE != VALUE {
                    self.scatter::<L>(layer, row, parts, outputs);
                }
            }
        }
        result
    }
}

impl<F, T, const D: usize, const M: usize, const MODE: u8> RowKernel<'_, F, T, D, M, MODE>
where
    F: CellLaw<D, M>,
    T: Element,
{
    /// One row of cells: densities summed over the quadrature points into `row_values`, and the
    /// derivative with respect to every corner into `parts`, `[corner][output][cell]`, each row
    /// between places that stay zero.
    #[inline(always)]
    fn row<L: Lane<Element = T>>(
        &self,
        row: Row,
        scratch: &mut Scratch<L, D, M>,
        row_values: &mut [T],
        parts: &mut [T],
    ) {
        let length = self.grid.cells_per_axis()[0];
        let stride = part_stride(length);
        let inverse_h = 1.0 / self.grid.spacing();
        let weight = self.factor * self.grid.cell_volume() / f64::from(1u32 << D);
        let Scratch {
            block,
            direction,
            fluxes,
        } = scratch;
        let nodes = RowData::new::<F>(self.grid, self.state, &self.data, row)
            .with_halves(self.grid, self.halves);
        let direction_nodes = match MODE {
            HESSIAN => component_rows(self.grid, self.direction, row),
            _ => [NodeRows::none(); M],
        };
        let mut moments = [[[0.0; MAX_JET]; MAX_JET]; MAX_CORNERS];
        if MODE == DIAGONAL {
            for c in 0..1 << D {
                moments[c] = corner_moments::<D>(c, F::POINT_OFFSET);
            }
        }
        for i in block_starts::<L>(length) {
            block.read::<F, T>(&nodes, i);
            if MODE == DIAGONAL {
                self.diagonal::<L>(block, &moments, parts, i, weight, L::splat(inverse_h));
                continue;
            }
            if MODE == HESSIAN {
                direction.read::<F, T>(&direction_nodes, i, inverse_h);
            }
            if MODE != VALUE && F::USES_GRADIENT {
                fluxes.clear_gradients();
            }
            let sum = match MODE {
                VALUE => self.law.block_value(block),
                GRADIENT => self.law.block_gradient(block, fluxes),
                _ => {
                    self.law.block_hessian_action(block, direction, fluxes);
                    L::zero()
                }
            };
            if MODE <= GRADIENT {
                sum.store(&mut row_values[i..]);
            }
            if MODE != VALUE {
                for m in 0..M {
                    let corners = integrate::<F, L, D>(
                        &fluxes.values[m],
                        &fluxes.gradients[m],
                        weight,
                        inverse_h,
                    );
                    let rows_of_corners = parts.chunks_exact_mut(M * stride);
                    for (corner, targets) in corners.iter().take(1 << D).zip(rows_of_corners) {
                        let row = &mut targets[m * stride + MAX_LANES..][..length];
                        corner.store(&mut row[i..]);
                    }
                }
            }
        }
    }

    /// The `M` x `M` block that every corner of the cells from `i` on has with itself.
    #[inline(always)]
    fn diagonal<L: Lane<Element = T>>(
        &self,
        block: &Block<L, D, M>,
        moments: &[Moments; MAX_CORNERS],
        parts: &mut [T],
        i: usize,
        weight: f64,
        inverse_h: L,
    ) {
        let length = self.grid.cells_per_axis()[0];
        let columns = F::UNIFORM_HESSIAN.then(|| self.columns(block, inverse_h));
        for c in 0..1 << D {
            if let Some(columns) = &columns {
                let own = uniform_block::<L, D, M>(columns, &moments[c]);
                store_block(&own, parts, (c, i, length), weight);
                continue;
            }
            let mut own = [[L::zero(); M]; M];
            for q in 0..1 << D {
                let p = block.point(q);
                let value = L::splat(shape_value::<D>(c, q, F::POINT_OFFSET));
                let mut slope = [L::zero(); D];
                for k in 0..D {
                    slope[k] =
                        L::splat(shape_derivative::<D>(c, q, k, F::POINT_OFFSET)) * inverse_h;
                }
                for m in 0..M {
                    let mut d = Jet::zero();
                    d.value[m] = value;
                    d.gradient[m] = slope;
                    let flux = self.law.hessian_action(&p, &d);
                    for r in 0..M {
                        let mut s = flux.value[r] * value;
                        for k in 0..D {
                            s = flux.gradient[r][k].mul_add(slope[k], s);
                        }
                        own[r][m] += s;
                    }
                }
            }
            store_block(&own, parts, (c, i, length), weight);
        }
    }

    /// What a Hessian that is the same all over a cell makes of unit jets: for every component,
    /// of the unit value and of the unit slopes on the reference cell, which are `1/h`.
    #[inline(always)]
    fn columns<L: Lane<Element = T>>(
        &self,
        block: &Block<L, D, M>,
        inverse_h: L,
    ) -> [[Jet<L, D, M>; MAX_JET]; M] {
        let p = block.point(0);
        let mut columns = [[Jet::zero(); MAX_JET]; M];
        for m in 0..M {
            for entry in 0..=D {
                let mut unit = Jet::zero();
                if entry == 0 {
                    unit.value[m] = L::one();
                } else {
                    unit.gradient[m][entry - 1] = inverse_h;
                }
                let mut flux = self.law.hessian_action(&p, &unit);
                for r in 0..M {
                    for k in 0..D {
                        flux.gradient[r][k] *= inverse_h;
                    }
                }
                columns[m][entry] = flux;
            }
        }
        columns
    }

    /// Adds the corner parts of a row of cells to the node rows around it.
    #[inline(always)]
    fn scatter<L: Lane<Element = T>>(
        &mut self,
        layer: usize,
        row: Row,
        parts: &[T],
        outputs: usize,
    ) {
        let n = self.grid.nodes_per_axis();
        let stride = part_stride(n[0] - 1);
        let plane = if D == 3 { n[0] * n[1] } else { n[0] };
        for side in 0..1usize << (D - 1) {
            // Corner bits beyond x: in three dimensions row, then layer; in two, layer only.
            let (up, start) = if D == 3 {
                (side >> 1, (row[0] + (side & 1)) * n[0])
            } else {
                (side, 0)
            };
            for m in 0..outputs {
                let target = &mut self.slab.plane(m, layer, up, plane)[start..start + n[0]];
                // Node `i` is the lower corner of cell `i` and the upper corner of cell `i - 1`.
                let low = (2 * side * outputs + m) * stride + MAX_LANES;
                let high = ((2 * side + 1) * outputs + m) * stride + MAX_LANES - 1;
                add_both::<L>(target, &parts[low..], &parts[high..]);
            }
        }
    }
}

/// Adds the first entries of two arrays, which are at least as long, to all entries of a row.
#[inline(always)]
fn add_both<L: Lane>(row: &mut [L::Element], low: &[L::Element], high: &[L::Element]) {
    let (low, high) = (&low[..row.len()], &high[..row.len()]);
    let whole = row.len() - row.len() % L::COUNT;
    let chunks = low.chunks_exact(L::COUNT).zip(high.chunks_exact(L::COUNT));
    for (target, (low, high)) in row.chunks_exact_mut(L::COUNT).zip(chunks) {
        let both = L::load(low) + L::load(high);
        (L::load(target) + both).store(target);
    }
    let (rest, low, high) = (&mut row[whole..], &low[whole..], &high[whole..]);
    let both = L::load(low) + L::load(high);
    (L::load(rest) + both).store(rest);
}

/// Entries of a jet of one component: the value and the slopes.
const MAX_JET: usize = 4;

/// Second moments over the quadrature points of a corner's shape function and its slopes on the
/// reference cell.
type Moments = [[f64; MAX_JET]; MAX_JET];

fn corner_moments<const D: usize>(c: usize, offset: f64) -> Moments {
    let shape = |q: usize, entry: usize| {
        if entry == 0 {
            shape_value::<D>(c, q, offset)
        } else {
            shape_derivative::<D>(c, q, entry - 1, offset)
        }
    };
    let mut moments = [[0.0; MAX_JET]; MAX_JET];
    for left in 0..=D {
        for right in 0..=D {
            moments[left][right] = (0..1 << D).map(|q| shape(q, left) * shape(q, right)).sum();
        }
    }
    moments
}

/// The block that a corner has with itself, summed over the quadrature points, where the Hessian
/// is the same at all of them.
#[inline(always)]
fn uniform_block<L: Lane, const D: usize, const M: usize>(
    columns: &[[Jet<L, D, M>; MAX_JET]; M],
    moments: &Moments,
) -> [[L; M]; M] {
    let mut own = [[L::zero(); M]; M];
    for left in 0..=D {
        for right in 0..=D {
            let moment = L::splat(moments[left][right]);
            for r in 0..M {
                for m in 0..M {
                    let flux = &columns[m][right];
                    let entry = if left == 0 {
                        flux.value[r]
                    } else {
                        flux.gradient[r][left - 1]
                    };
                    own[r][m] = entry.mul_add(moment, own[r][m]);
                }
            }
        }
    }
    own
}

/// Stores the blocks of corner `c` of the cells from `i` on, times the weight.
#[inline(always)]
fn store_block<L: Lane, const M: usize>(
    own: &[[L; M]; M],
    parts: &mut [L::Element],
    (c, i, length): (usize, usize, usize),
    weight: f64,
) {
    for r in 0..M {
        for m in 0..M {
            let start = (c * M * M + r * M + m) * part_stride(length) + MAX_LANES;
            let target = &mut parts[start..][i..length];
            own[r][m].scale(weight).store(target);
        }
    }
}

/// Bytes of a cache line.
pub(crate) const CACHE_LINE: usize = 64;

/// Places of a row of parts: whole registers for the cells, with zeros before and after them.
#[inline(always)]
fn part_stride(length: usize) -> usize {
    (length + 1).next_multiple_of(MAX_LANES) + MAX_LANES
}

/// Fluxes at the quadrature points to contributions at the corners.
#[inline(always)]
fn integrate<R: Reads, L: Lane, const D: usize>(
    values: &[L; MAX_CORNERS],
    gradients: &[[L; MAX_FACE_CORNERS]; D],
    weight: f64,
    inverse_h: f64,
) -> [L; MAX_CORNERS] {
    let mut corners = if R::USES_GRADIENT {
        differences_transposed::<L, D>(gradients, weight * inverse_h, R::POINT_OFFSET)
    } else {
        [L::zero(); MAX_CORNERS]
    };
    if R::USES_VALUE {
        let mut values = *values;
        interpolate::<L, D>(&mut values, weight, R::POINT_OFFSET);
        for c in 0..1 << D {
            corners[c] += values[c];
        }
    }
    corners
}

/// A sum in double precision whose order does not depend on the lanes: eight interleaved partial
/// sums, added in turn.
#[inline(always)]
fn ordered_sum<T: Element>(values: &[T]) -> f64 {
    let mut partial = [0.0; 8];
    let mut chunks = values.chunks_exact(8);
    for chunk in &mut chunks {
        for l in 0..8 {
            partial[l] += chunk[l].to_f64();
        }
    }
    for (l, v) in chunks.remainder().iter().enumerate() {
        partial[l] += v.to_f64();
    }
    partial.iter().sum()
}
