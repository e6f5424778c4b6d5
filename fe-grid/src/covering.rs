//! Transfer to coarse grids that cover a little more than the box.
//!
//! A grid with an odd number of cells along an axis has no coarser grid on the same box. The grid of
//! twice the spacing that covers it ends one fine cell beyond the box there. Its functions are
//! restricted to the nodes of the box, and functionals are continued by zero, which is the transpose.
//! Cells beyond the box have the data of their neighbours inside, so that coarse operators are
//! rather too stiff than too soft: a correction that overshoots by more than a factor of two would
//! make a cycle indefinite.

use std::borrow::Cow;

use crate::grid::Grid;
use crate::lane::Element;
use crate::transfer::{prolong_into, restrict_into};

/// The smallest grid of twice the spacing that covers the box; `None` if that has as many nodes.
pub(crate) fn covering<const D: usize>(grid: &Grid<D>) -> Option<Grid<D>> {
    let nodes = grid.cells_per_axis().map(|c| c.div_ceil(2) + 1);
    let coarse = Grid::with_nodes(nodes, 2.0 * grid.spacing()).ok()?;
    (coarse.n_nodes() < grid.n_nodes()).then_some(coarse)
}

/// Cell data on the cells of the finer grid of `coarse`, continued beyond the box of `fine`.
pub(crate) fn continued_cells<'a, T: Element, const D: usize>(
    fine: &Grid<D>,
    coarse: &Grid<D>,
    data: &'a [T],
) -> Cow<'a, [T]> {
    let (wide, own) = (coarse.finer(), fine.cells_per_axis());
    if wide.cells_per_axis() == own {
        return Cow::Borrowed(data);
    }
    let nearest = |cell: [usize; D]| std::array::from_fn(|k| cell[k].min(own[k] - 1));
    let value = |i| data[fine.cell_index(nearest(wide.cell(i)))];
    Cow::Owned((0..wide.n_cells()).map(value).collect())
}

/// Prolongs a coarse nodal field to the nodes of `fine`; see [`prolong_into`].
pub(crate) fn prolong_from<T: Element, const D: usize>(
    fine: &Grid<D>,
    coarse: &Grid<D>,
    x: &[T],
    out: &mut [T],
) {
    let wide = coarse.finer();
    if wide.nodes_per_axis() == fine.nodes_per_axis() {
        return prolong_into(coarse, x, out);
    }
    let components = out.len() / fine.n_nodes();
    let mut all = vec![T::default(); components * wide.n_nodes()];
    prolong_into(coarse, x, &mut all);
    for (own, continued) in shared_entries(fine, &wide, components) {
        out[own] = all[continued];
    }
}

/// Applies the transpose of [`prolong_from`].
pub(crate) fn restrict_to<T: Element, const D: usize>(
    fine: &Grid<D>,
    coarse: &Grid<D>,
    x: &[T],
    out: &mut [T],
) {
    let wide = coarse.finer();
    if wide.nodes_per_axis() == fine.nodes_per_axis() {
        return restrict_into(coarse, x, out);
    }
    let components = x.len() / fine.n_nodes();
    let mut all = vec![T::default(); components * wide.n_nodes()];
    for (own, continued) in shared_entries(fine, &wide, components) {
        all[continued] = x[own];
    }
    restrict_into(coarse, &all, out);
}

/// The entries of all components at the nodes of `fine`, each with the entry at the same node of the grid
/// `wide` that begins where `fine` does and covers it.
fn shared_entries<const D: usize>(
    fine: &Grid<D>,
    wide: &Grid<D>,
    components: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let (own, continued, fine, wide) = (fine.n_nodes(), wide.n_nodes(), *fine, *wide);
    (0..components).flat_map(move |component| {
        (0..own).map(move |node| {
            let there = wide.node_index(fine.node(node));
            (component * own + node, component * continued + there)
        })
    })
}
