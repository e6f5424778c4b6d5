//! Distribution of slabs of cells to threads, and summation of the node planes between them.

use crate::grid::Grid;
use crate::lane::Element;
use crate::parallel;
use std::ops::Range;

/// Layers of cells along the last axis with the node planes that they add to.
pub(crate) struct Slab<'a, T> {
    /// Layers of cells.
    pub layers: Range<usize>,
    /// The planes of nodes below each layer, one slice for each output; the last slab also owns
    /// the uppermost plane.
    pub planes: Vec<&'a mut [T]>,
    /// The plane above the last layer, one slice for each output: it is shared with the next
    /// slab and added afterwards. Empty for the last slab.
    pub top: Vec<&'a mut [T]>,
}

impl<T> Slab<'_, T> {
    /// The nodes of plane `layer + up` of one output, for a layer of this slab and `up` 0 or 1.
    #[inline(always)]
    pub fn plane(&mut self, output: usize, layer: usize, up: usize, plane: usize) -> &mut [T] {
        if layer + up == self.layers.end && !self.top.is_empty() {
            return self.top[output];
        }
        let start = (layer + up - self.layers.start) * plane;
        &mut self.planes[output][start..start + plane]
    }

    /// The coordinates along the last axis, in units of the spacing, of points that may belong to
    /// a layer of this slab, where there are `n_layers` in all. Points beyond the box belong to
    /// its outermost layers. The margin covers the rounding of coordinates in single precision.
    pub fn reach(&self, n_layers: usize) -> (f64, f64) {
        let margin = 1e-4 * n_layers as f64;
        let low = if self.layers.start == 0 {
            f64::NEG_INFINITY
        } else {
            self.layers.start as f64 - margin
        };
        let high = if self.layers.end == n_layers {
            f64::INFINITY
        } else {
            self.layers.end as f64 + margin
        };
        (low, high)
    }
}

/// Runs `work` on every slab of the grid. `out` holds `outputs` nodal arrays one after the other,
/// to which the slabs add; results come in the order of the slabs.
pub(crate) fn over_slabs<T: Element, R: Send, const D: usize>(
    grid: &Grid<D>,
    outputs: usize,
    out: &mut [T],
    parallel: bool,
    work: &(dyn Fn(Slab<'_, T>) -> R + Sync),
) -> Vec<R> {
    let n = grid.n_nodes();
    assert_eq!(out.len(), outputs * n);
    let layers = layers(grid);
    let plane = n / grid.nodes_per_axis()[D - 1];
    let mut tops = vec![T::default(); (layers.len() - 1) * outputs * plane];
    let mut slabs = split(out, &layers, n, plane);
    for (i, top) in tops.chunks_exact_mut(plane).enumerate() {
        slabs[i / outputs].top.push(top);
    }
    let results = if parallel {
        parallel::map(slabs, work)
    } else {
        slabs.into_iter().map(work).collect()
    };
    for (i, top) in tops.chunks_exact(plane).enumerate() {
        let start = i % outputs * n + layers[i / outputs].end * plane;
        for (o, t) in out[start..start + plane].iter_mut().zip(top) {
            *o += *t;
        }
    }
    results
}

/// Returns the layers of cells along the last axis, in pieces whose thickness depends on the grid
/// alone, as it determines the order of all sums.
fn layers<const D: usize>(grid: &Grid<D>) -> Vec<Range<usize>> {
    let n = grid.cells_per_axis()[D - 1];
    let thickness = n.div_ceil(32).max(if D == 3 { 4 } else { 8 });
    (0..n.div_ceil(thickness))
        .map(|s| s * thickness..((s + 1) * thickness).min(n))
        .collect()
}

fn split<'a, T>(
    out: &'a mut [T],
    layers: &[Range<usize>],
    n_nodes: usize,
    plane: usize,
) -> Vec<Slab<'a, T>> {
    let mut slabs: Vec<Slab<'a, T>> = layers
        .iter()
        .map(|l| Slab {
            layers: l.clone(),
            planes: Vec::new(),
            top: Vec::new(),
        })
        .collect();
    let last = slabs.len() - 1;
    for component in out.chunks_exact_mut(n_nodes) {
        let mut rest = component;
        for (s, slab) in slabs.iter_mut().enumerate() {
            let planes = slab.layers.len() + usize::from(s == last);
            let (mine, others) = rest.split_at_mut(planes * plane);
            slab.planes.push(mine);
            rest = others;
        }
    }
    slabs
}
