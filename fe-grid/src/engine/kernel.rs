//! The work on one slab of cells: rows side by side in lanes.

use super::block::{Block, Evaluated};
use super::element::{
    MAX_CORNERS, add_differences_transposed, interpolate, shape_derivative, shape_value,
};
use super::rows::{Row, first_cell, rows_of_layer};
use super::slabs::Slab;
use super::{CellLaw, Data, Jet};
use crate::{Element, Grid, Lane, LaneKernel};

/// Value only.
pub(super) const VALUE: u8 = 0;
/// Value and gradient.
pub(super) const GRADIENT: u8 = 1;
/// Hessian action on a direction.
pub(super) const HESSIAN: u8 = 2;
/// Block diagonal of the Hessian: `M * M` numbers a node.
pub(super) const DIAGONAL: u8 = 3;

/// Fluxes of one component: values at all quadrature points, gradients along each axis.
type Fluxes<L, const D: usize> = ([L; MAX_CORNERS], [[L; MAX_CORNERS]; D]);

/// The work on one slab.
pub(super) struct RowKernel<'a, F, T: Element, const D: usize, const M: usize, const MODE: u8> {
    pub grid: &'a Grid<D>,
    pub law: &'a F,
    pub data: Data<'a, T>,
    /// The unknown, component by component.
    pub state: &'a [T],
    /// The direction of a Hessian action; otherwise empty.
    pub direction: &'a [T],
    pub slab: Slab<'a, T>,
}

/// What a slab found.
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
        let mut parts = match MODE {
            VALUE => Vec::new(),
            _ => vec![T::default(); (1 << D) * outputs * length],
        };
        let mut result = SlabResult {
            sum: 0.0,
            inadmissible: None,
        };
        for layer in self.slab.layers.clone() {
            for row in rows_of_layer(self.grid, layer) {
                self.row::<L>(row, &mut row_values, &mut parts);
                if MODE <= GRADIENT {
                    let sum = ordered_sum(&row_values);
                    result.sum += sum;
                    if !sum.is_finite() && result.inadmissible.is_none() {
                        let first = row_values.iter().position(|v| !v.to_f64().is_finite());
                        result.inadmissible = Some(first_cell(self.grid, row) + first.unwrap_or(0));
                    }
                }
                if MODE != VALUE {
                    self.scatter(layer, row, &parts, outputs);
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
    /// derivative with respect to every corner into `parts`, `[corner][output][cell]`.
    #[inline(always)]
    fn row<L: Lane<Element = T>>(&self, row: Row, row_values: &mut [T], parts: &mut [T]) {
        let length = self.grid.cells_per_axis()[0];
        let inverse_h = L::splat(1.0 / self.grid.spacing());
        let weight = self.grid.cell_volume() / f64::from(1u32 << D);
        let zero = [L::zero(); MAX_CORNERS];
        let mut i = 0;
        while i < length {
            let block = Block::<L, D, M>::read::<F, T>(self.grid, self.state, &self.data, row, i);
            if MODE == DIAGONAL {
                self.diagonal::<L>(&block, parts, i, weight, inverse_h);
                i += L::COUNT;
                continue;
            }
            let direction = match MODE {
                HESSIAN => Some(Evaluated::<L, D, M>::read::<F, T>(
                    self.grid,
                    self.direction,
                    row,
                    i,
                )),
                _ => None,
            };
            let mut sum = L::zero();
            let mut fluxes: [Fluxes<L, D>; M] = [(zero, [zero; D]); M];
            for q in 0..1 << D {
                let p = block.point(q);
                let flux = match MODE {
                    VALUE => {
                        sum += self.law.value(&p);
                        continue;
                    }
                    GRADIENT => {
                        let (value, flux) = self.law.gradient(&p);
                        sum += value;
                        flux
                    }
                    _ => {
                        let d = direction.as_ref().map_or(Jet::zero(), |d| d.jet(q));
                        self.law.hessian_action(&p, &d)
                    }
                };
                for m in 0..M {
                    if F::USES_VALUE {
                        fluxes[m].0[q] = flux.value[m];
                    }
                    if F::USES_GRADIENT {
                        for k in 0..D {
                            fluxes[m].1[k][q & !(1 << k)] += flux.gradient[m][k];
                        }
                    }
                }
            }
            if MODE <= GRADIENT {
                sum.store(&mut row_values[i..]);
            }
            if MODE != VALUE {
                for m in 0..M {
                    let corners = integrate::<F, L, D, M>(&fluxes[m], weight, inverse_h);
                    for c in 0..1 << D {
                        corners[c].store(&mut parts[(c * M + m) * length..][i..length]);
                    }
                }
            }
            i += L::COUNT;
        }
    }

    /// The `M` x `M` block that every corner has with itself.
    #[inline(always)]
    fn diagonal<L: Lane<Element = T>>(
        &self,
        block: &Block<L, D, M>,
        parts: &mut [T],
        i: usize,
        weight: f64,
        inverse_h: L,
    ) {
        let length = self.grid.cells_per_axis()[0];
        for c in 0..1 << D {
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
            for r in 0..M {
                for m in 0..M {
                    let target = &mut parts[(c * M * M + r * M + m) * length..][i..length];
                    own[r][m].scale(weight).store(target);
                }
            }
        }
    }

    /// Adds the corner parts of a row of cells to the node rows around it.
    #[inline(always)]
    fn scatter(&mut self, layer: usize, row: Row, parts: &[T], outputs: usize) {
        let n = self.grid.nodes_per_axis();
        let length = n[0] - 1;
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
                let low = &parts[(2 * side * outputs + m) * length..][..length];
                let high = &parts[((2 * side + 1) * outputs + m) * length..][..length];
                target[0] += low[0];
                target[length] += high[length - 1];
                for ((t, &l), &h) in target[1..length].iter_mut().zip(&low[1..]).zip(high) {
                    *t += l + h;
                }
            }
        }
    }
}

/// Fluxes at the quadrature points to contributions at the corners.
#[inline(always)]
fn integrate<F: CellLaw<D, M>, L: Lane, const D: usize, const M: usize>(
    fluxes: &Fluxes<L, D>,
    weight: f64,
    inverse_h: L,
) -> [L; MAX_CORNERS] {
    let mut corners = [L::zero(); MAX_CORNERS];
    if F::USES_GRADIENT {
        for k in 0..D {
            add_differences_transposed::<L, D>(fluxes.1[k], k, &mut corners, F::POINT_OFFSET);
        }
        for c in &mut corners {
            *c *= inverse_h;
        }
    }
    if F::USES_VALUE {
        let mut values = fluxes.0;
        interpolate::<L, D>(&mut values, F::POINT_OFFSET);
        for c in 0..1 << D {
            corners[c] += values[c];
        }
    }
    for c in &mut corners {
        *c = c.scale(weight);
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
