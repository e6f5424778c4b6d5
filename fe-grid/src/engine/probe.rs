//! Means over cells of a pointwise formula.

use super::block::{Block, RowData};
use super::rows::{block_starts, first_cell, rows_of_layer};
use super::{CellProbe, Data, MAX_CELL_DATA};
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel, MAX_LANES};
use crate::parallel;

struct ProbeKernel<'a, F, T: Element, O, const D: usize, const M: usize> {
    grid: &'a Grid<D>,
    probe: &'a F,
    data: Data<'a, T>,
    state: &'a [T],
    layer: usize,
    /// Cells of the layer, one slice an output.
    out: Vec<&'a mut [O]>,
}

impl<F, T, O, const D: usize, const M: usize> LaneKernel<T> for ProbeKernel<'_, F, T, O, D, M>
where
    F: CellProbe<D, M>,
    T: Element,
    O: Element,
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(mut self) {
        let length = self.grid.cells_per_axis()[0];
        let layer_start = first_cell(
            self.grid,
            if D == 3 {
                [0, self.layer]
            } else {
                [self.layer, 0]
            },
        );
        let mut block = Block::<L, D, M>::zero::<F>(self.grid);
        let mut entries = [T::default(); MAX_LANES];
        for row in rows_of_layer(self.grid, self.layer) {
            let start = first_cell(self.grid, row) - layer_start;
            let nodes = RowData::new::<F>(self.grid, self.state, &self.data, row);
            for i in block_starts::<L>(length) {
                block.read::<F, T>(&nodes, i);
                let mut means = [L::zero(); MAX_CELL_DATA];
                for q in 0..1 << D {
                    let values = self.probe.probe(&block.point(q));
                    for f in 0..F::OUTPUTS {
                        means[f] += values[f];
                    }
                }
                for mean in &mut means {
                    *mean = mean.scale(1.0 / f64::from(1u32 << D));
                }
                let values = self.probe.finish(means);
                for f in 0..F::OUTPUTS {
                    values[f].store(&mut entries);
                    let target = &mut self.out[f][start + i..start + length];
                    for (out, value) in target.iter_mut().zip(&entries[..L::COUNT]) {
                        *out = O::from_f64(value.to_f64());
                    }
                }
            }
        }
    }
}

/// The mean over every cell of a formula of the state: [`CellProbe::OUTPUTS`] arrays of one
/// number a cell, rounded to the precision asked for.
///
/// # Panics
/// If the state does not have `M` numbers a node, or if data that the formula reads are missing.
pub fn probe_cells<F, T, O, const D: usize, const M: usize>(
    grid: &Grid<D>,
    probe: &F,
    data: Data<'_, T>,
    state: &[T],
) -> Vec<Vec<O>>
where
    F: CellProbe<D, M>,
    T: Element,
    O: Element,
{
    assert_eq!(state.len(), M * grid.n_nodes());
    assert!(data.coefficients.len() >= F::COEFFICIENTS && data.cells.len() >= F::CELL_DATA);
    let per_layer: usize = grid.cells_per_axis()[..D - 1].iter().product();
    let mut out = vec![vec![O::default(); grid.n_cells()]; F::OUTPUTS];
    let mut by_layer: Vec<Vec<&mut [O]>> = (0..grid.cells_per_axis()[D - 1])
        .map(|_| Vec::new())
        .collect();
    for output in &mut out {
        for (layer, cells) in output.chunks_exact_mut(per_layer).enumerate() {
            by_layer[layer].push(cells);
        }
    }
    let min_len = 4096usize.div_ceil(per_layer);
    parallel::for_each_mut(&mut by_layer, min_len, &|layer, out| {
        T::run_kernel(ProbeKernel::<F, T, O, D, M> {
            grid,
            probe,
            data,
            state,
            layer,
            out: std::mem::take(out),
        });
    });
    out
}
