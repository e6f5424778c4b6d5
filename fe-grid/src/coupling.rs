//! The mixed second derivative of a composition's energy, in the deformation and in the field.
//!
//! For a source `(u, c)` and the energy `c sum_q w f(V(Phi(x_q)))` with `Phi(x) = x + u(x)`, the
//! derivative by the nodal values of `V` changes in a direction `d` of the displacement, in the model of
//! [`SmoothMatching`], by
//!
//! ```text
//! c sum_q w f'' (G . d) N(Phi),
//! ```
//!
//! with the vector `N(y)` of all shape functions. Its transpose, the change of the derivative by
//! the displacements where `V` changes, is part of [`SmoothMatching`].
//!
//! Every slab of cells is processed by one task, as in [`crate::scatter`]: a node receives its
//! points in a fixed order, independent of the number of threads.

use crate::composition::{Location, MatchDensity, SmoothMatching, locate_lanes};
use crate::engine::block::{Block, RowData, component_rows};
use crate::engine::element::MAX_CORNERS;
use crate::engine::rows::rows_of_layer;
use crate::engine::slabs::{Slab, over_slabs};
use crate::engine::{Data, Evaluated, Point, Reads};
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel, MAX_LANES};
use crate::moments::RUN;
use crate::scatter::{Source, layer_ranges};
use crate::simd_level::SimdLevel;

/// Below this number of cells everything stays on one thread.
const PARALLEL_CELLS: usize = 1024;

/// One deformation with its coefficient fields, and a direction of its displacement.
#[derive(Clone, Copy)]
pub struct Variation<'a> {
    /// The deformation, its coefficients and its weight.
    pub source: Source<'a, f64>,
    /// Direction of the displacement, component by component.
    pub direction: &'a [f64],
}

/// Computes the change of the derivative by the nodal values of the field; it overwrites `out`.
///
/// # Panics
/// If a direction or a coefficient does not fit the grid.
pub fn field_derivative_change<F: MatchDensity, const D: usize>(
    grid: &Grid<D>,
    model: &SmoothMatching<'_, F, f64, D>,
    variation: &Variation<'_>,
    out: &mut [f64],
) {
    let n = grid.n_nodes();
    assert_eq!(out.len(), n);
    assert_eq!(variation.source.displacement.len(), D * n);
    assert_eq!(variation.direction.len(), D * n);
    assert!(variation.source.coefficients.len() >= F::COEFFICIENTS);
    let ranges = layer_ranges(grid, &variation.source);
    out.fill(0.0);
    let parallel = grid.n_cells() >= PARALLEL_CELLS;
    over_slabs(grid, 1, out, parallel, &|slab| {
        let task = SlabTask {
            grid,
            model,
            variation,
            ranges: &ranges,
            slab,
        };
        f64::dispatch(SimdLevel::active(), task);
    });
}

/// What is read at a point: position and coefficients.
struct Place<F>(std::marker::PhantomData<F>);

impl<F: MatchDensity> Reads for Place<F> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = F::COEFFICIENTS;
    const CELL_DATA: usize = 0;
}

struct SlabTask<'a, F, const D: usize> {
    grid: &'a Grid<D>,
    model: &'a SmoothMatching<'a, F, f64, D>,
    variation: &'a Variation<'a>,
    /// The ranges of the last deformed coordinate.
    ranges: &'a [[f64; 2]],
    slab: Slab<'a, f64>,
}

impl<F: MatchDensity, const D: usize> LaneKernel<f64> for SlabTask<'_, F, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(mut self) {
        let cells = self.grid.cells_per_axis();
        let runs = cells[0].div_ceil(RUN);
        let (low, high) = self.slab.reach(cells[D - 1]);
        let reached = |range: &[f64; 2]| range[0] <= high && range[1] >= low;
        let mut block = Block::<L, D, D>::zero::<Place<F>>(self.grid);
        let mut direction = Evaluated::<L, D, D>::zero();
        let variation = self.variation;
        let data = Data {
            coefficients: variation.source.coefficients,
            cells: &[],
        };
        let mut rows = self.ranges.chunks_exact(runs);
        for layer in 0..cells[D - 1] {
            for (row, ranges) in rows_of_layer(self.grid, layer).zip(&mut rows) {
                if !ranges.iter().any(reached) {
                    continue;
                }
                let displacement = variation.source.displacement;
                let nodes = RowData::new::<Place<F>>(self.grid, displacement, &data, row);
                let along = component_rows(self.grid, variation.direction, row);
                for (run, _) in ranges.iter().enumerate().filter(|(_, r)| reached(r)) {
                    let end = ((run + 1) * RUN).min(cells[0]);
                    for i in (run * RUN..end).step_by(L::COUNT) {
                        block.read::<Place<F>, f64>(&nodes, i);
                        direction.read::<Place<F>, f64>(&along, i, 1.0);
                        for q in 0..1usize << D {
                            let d = direction.jet(q).value;
                            let weight = variation.source.weight;
                            self.scatter(&block.point(q), &d, weight, end - i);
                        }
                    }
                }
            }
        }
    }
}

impl<F: MatchDensity, const D: usize> SlabTask<'_, F, D> {
    /// Adds the points of some lanes, of which the first `count` are cells of the row.
    #[inline(always)]
    fn scatter<L: Lane<Element = f64>>(
        &mut self,
        point: &Point<L, D, D>,
        direction: &[L; D],
        factor: f64,
        count: usize,
    ) {
        let at = locate_lanes(self.grid, &point.deformed_position());
        let mut cell = [[0.0; MAX_LANES]; D];
        for k in 0..D {
            at.cell[k].store(&mut cell[k]);
        }
        let layers = self.slab.layers.clone();
        let here = |l: usize| layers.contains(&(cell[D - 1][l] as usize));
        if !(0..L::COUNT.min(count)).any(here) {
            return;
        }
        let (slope, curvature) = self.model.model(&at, &point.coefficient);
        let weight = factor * self.grid.cell_volume() / f64::from(1u32 << D);
        let mut along = L::zero();
        for k in 0..D {
            along = slope[k].mul_add(direction[k], along);
        }
        let loads = corner_loads(&at, along * curvature.scale(weight));
        let n = self.grid.nodes_per_axis();
        let plane = if D == 3 { n[0] * n[1] } else { n[0] };
        for l in (0..L::COUNT.min(count)).filter(|&l| here(l)) {
            let layer = cell[D - 1][l] as usize;
            let y = if D == 3 { cell[1][l] as usize } else { 0 };
            for c in 0..1usize << D {
                let line = if D == 3 { y + (c >> 1 & 1) } else { 0 };
                let node = line * n[0] + cell[0][l] as usize + (c & 1);
                self.slab.plane(0, layer, c >> (D - 1), plane)[node] += loads[c][l];
            }
        }
    }
}

/// A multiple of the shape functions of all corners of the cells of points.
#[inline(always)]
fn corner_loads<L: Lane<Element = f64>, const D: usize>(
    at: &Location<L, D>,
    factor: L,
) -> [[f64; MAX_LANES]; MAX_CORNERS] {
    let mut loads = [[0.0; MAX_LANES]; MAX_CORNERS];
    for c in 0..1usize << D {
        let mut value = factor;
        for k in 0..D {
            let local = at.local[k];
            value *= if c >> k & 1 == 1 {
                local
            } else {
                L::one() - local
            };
        }
        value.store(&mut loads[c]);
    }
    loads
}
