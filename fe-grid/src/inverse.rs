//! The inverse of a deformation at the nodes, and the push-forward of fields.
//!
//! Every cell finds the nodes in the bounding box of its deformed corners, which holds its
//! image, and solves for each by Newton's method on the multilinear map of the cell. For a
//! deformation with positive determinant every node is found by at most one cell, up to shared
//! faces.

use crate::compiled_once;
use crate::engine::element::{MAX_CORNERS, multilinear};
use crate::field::{Field, ScalarField};
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel};
use crate::lattice::Lattice;
use crate::parallel;
use crate::tensor;

/// Newton's method is stopped at this residual, in units of the spacing.
const TOLERANCE: f64 = 1e-13;
/// A solution may stand this far outside its cell, in units of the cell: nodes on shared faces
/// must not be lost to rounding.
const OVERLAP: f64 = 1e-9;

/// The inverse of a deformation at the nodes of its grid.
#[derive(Clone, Debug)]
pub struct InverseDeformation<const D: usize> {
    grid: Grid<D>,
    /// For every node the point that is mapped to it, where there is one.
    position: Vec<Option<[f64; D]>>,
}

impl<const D: usize> InverseDeformation<D> {
    /// Inverts `Phi(x) = x + u(x)` at all nodes.
    pub fn new(displacement: &Field<f64, D, D>) -> Self {
        invert(displacement)
    }

    fn new_in(displacement: &Field<f64, D, D>) -> Self {
        let grid = *displacement.grid();
        let layers = grid.cells_per_axis()[D - 1];
        let found: Vec<Vec<(usize, [f64; D])>> = parallel::map(0..layers, &|layer| {
            let search = LayerSearch {
                grid: &grid,
                displacement,
                layer,
            };
            f64::run_kernel(search)
        });
        // The first cell in memory order is chosen, independent of the number of threads.
        let mut position = vec![None; grid.n_nodes()];
        for (node, x) in found.into_iter().flatten() {
            position[node].get_or_insert(x);
        }
        Self { grid, position }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// The point that is mapped to a node; none where the node lies outside the image of the box.
    pub fn position(&self, node: usize) -> Option<[f64; D]> {
        self.position[node]
    }

    /// The field `f o Phi^{-1}` at the nodes, with `outside` where there is no inverse.
    pub fn push_forward(&self, field: &ScalarField<f64, D>, outside: f64) -> ScalarField<f64, D> {
        let mut pushed = ScalarField::zeros(self.grid);
        let values = pushed.as_mut_slice();
        for (value, position) in values.iter_mut().zip(&self.position) {
            *value = position.map_or(outside, |x| field.sample(x)[0]);
        }
        pushed
    }
}

compiled_once! {
    fn invert<'a, D>(
        displacement: &'a Field<f64, D, D>,
    ) -> InverseDeformation<D> = InverseDeformation::new_in;
}

/// The search in one layer of cells.
struct LayerSearch<'a, const D: usize> {
    grid: &'a Grid<D>,
    displacement: &'a Field<f64, D, D>,
    layer: usize,
}

impl<const D: usize> LaneKernel<f64> for LayerSearch<'_, D> {
    type Output = Vec<(usize, [f64; D])>;

    /// Every node is a search of its own: only the fused operations of the instruction set are
    /// used, not its lanes.
    #[inline(always)]
    fn run<L: Lane<Element = f64>>(self) -> Self::Output {
        let lattice = Lattice::nodes(self.grid);
        let per_layer = self.grid.n_cells() / self.grid.cells_per_axis()[D - 1];
        let mut found = Vec::with_capacity(per_layer + per_layer / 4);
        for cell in self.layer * per_layer..(self.layer + 1) * per_layer {
            let index = cell;
            let cell = self.grid.cell(index);
            let h = self.grid.spacing();
            search_cell(
                self.grid,
                self.displacement.as_slice(),
                cell,
                &lattice,
                &mut |node, local| {
                    let local = mutant!(local, InverseMirrored => local.map(|x| 1.0 - x));
                    let x = std::array::from_fn(|k| (cell[k] as f64 + local[k]) * h);
                    found.push((node, x));
                },
            );
        }
        found
    }
}

/// Calls `found` with the points of a lattice in the image of a cell, and the local coordinates of
/// the points that are mapped to them.
#[inline(always)]
pub(crate) fn search_cell<const D: usize>(
    grid: &Grid<D>,
    displacement: &[f64],
    cell: [usize; D],
    lattice: &Lattice<D>,
    found: &mut impl FnMut(usize, [f64; D]),
) {
    let h = grid.spacing();
    let strides = grid.strides();
    let base = grid.node_index(cell);
    let n = grid.n_nodes();
    // Deformed corners in units of the spacing.
    let mut corners = [[0.0; D]; MAX_CORNERS];
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for c in 0..1usize << D {
        let index = base + (0..D).map(|k| (c >> k & 1) * strides[k]).sum::<usize>();
        for k in 0..D {
            let y = (cell[k] + (c >> k & 1)) as f64 + displacement[k * n + index] / h;
            corners[c][k] = y;
            low[k] = low[k].min(y);
            high[k] = high[k].max(y);
        }
    }
    let first: [usize; D] =
        std::array::from_fn(|k| lattice.not_below(low[k] - OVERLAP).max(0.0) as usize);
    let count: [usize; D] = std::array::from_fn(|k| {
        let end = (lattice.count[k] - 1) as f64;
        let last = lattice.not_above(high[k] + OVERLAP).min(end);
        if last < first[k] as f64 {
            0
        } else {
            last as usize + 1 - first[k]
        }
    });
    let total: usize = count.iter().product();
    if total == 0 {
        return;
    }
    let frame = CentreFrame::new(&corners);
    for mut code in 0..total {
        let point: [usize; D] = std::array::from_fn(|k| {
            let i = first[k] + code % count[k];
            code /= count[k];
            i
        });
        let target = point.map(|i| lattice.coordinate(i));
        let Some(start) = frame.start(&target) else {
            continue;
        };
        if let Some(local) = invert_cell(&corners, &target, start) {
            found(lattice.index(point), local);
        }
    }
}

/// The affine map that a cell's map is close to at its centre. The image of the cell lies in the
/// convex hull of its corners, so that most nodes of the bounding box that are not in the image
/// are recognised by being outside the corners' box in these coordinates.
struct CentreFrame<const D: usize> {
    centre: [f64; D],
    /// Inverse of the Jacobian at the centre; none where it is singular.
    inverse: Option<[[f64; D]; D]>,
    low: [f64; D],
    high: [f64; D],
}

impl<const D: usize> CentreFrame<D> {
    #[inline(always)]
    fn new(corners: &[[f64; D]; MAX_CORNERS]) -> Self {
        let (centre, jacobian) = evaluate_cell(corners, &[0.5; D]);
        let mut frame = Self {
            centre,
            inverse: inverse(&jacobian),
            low: [f64::INFINITY; D],
            high: [f64::NEG_INFINITY; D],
        };
        for corner in &corners[..1 << D] {
            if let Some(local) = frame.local(corner) {
                for k in 0..D {
                    frame.low[k] = frame.low[k].min(local[k] - OVERLAP);
                    frame.high[k] = frame.high[k].max(local[k] + OVERLAP);
                }
            }
        }
        frame
    }

    #[inline(always)]
    fn local(&self, y: &[f64; D]) -> Option<[f64; D]> {
        let inverse = self.inverse.as_ref()?;
        let offset: [f64; D] = std::array::from_fn(|k| y[k] - self.centre[k]);
        Some(apply(inverse, &offset))
    }

    /// Where to start the search for a target; none where it is not in the cell's image.
    #[inline(always)]
    fn start(&self, target: &[f64; D]) -> Option<[f64; D]> {
        let Some(local) = self.local(target) else {
            return Some([0.5; D]);
        };
        let outside = (0..D).any(|k| local[k] < self.low[k] || local[k] > self.high[k]);
        (!outside).then(|| local.map(|s| (s + 0.5).clamp(0.0, 1.0)))
    }
}

/// Solves the multilinear map of a cell for a target; none where the solution is not in the cell.
#[inline(always)]
fn invert_cell<const D: usize>(
    corners: &[[f64; D]; MAX_CORNERS],
    target: &[f64; D],
    start: [f64; D],
) -> Option<[f64; D]> {
    let mut local = start;
    let tolerance = TOLERANCE * (1.0 + largest(target));
    let mut small = false;
    for _ in 0..40 {
        let (value, jacobian) = evaluate_cell(corners, &local);
        let residual: [f64; D] = std::array::from_fn(|k| target[k] - value[k]);
        let size = largest(&residual);
        if small {
            // The step after the small residual was the last.
            let inside = local
                .iter()
                .all(|&s| (-OVERLAP..=1.0 + OVERLAP).contains(&s));
            return (inside && size <= 100.0 * tolerance).then_some(local);
        }
        let step = apply(&inverse(&jacobian)?, &residual);
        // Far outside the cell the map may fold: steps stay near it.
        let next: [f64; D] = std::array::from_fn(|k| (local[k] + step[k]).clamp(-0.5, 1.5));
        let moved: [f64; D] = std::array::from_fn(|k| next[k] - local[k]);
        small = size <= tolerance || largest(&moved) <= 1e-15;
        local = next;
    }
    None
}

#[inline(always)]
fn largest<const D: usize>(x: &[f64; D]) -> f64 {
    x.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Value and Jacobian of the multilinear map of a cell.
#[inline(always)]
fn evaluate_cell<const D: usize>(
    corners: &[[f64; D]; MAX_CORNERS],
    local: &[f64; D],
) -> ([f64; D], [[f64; D]; D]) {
    let mut value = [0.0; D];
    let mut jacobian = [[0.0; D]; D];
    for m in 0..D {
        (value[m], jacobian[m]) = multilinear(corners.map(|corner| corner[m]), local);
    }
    (value, jacobian)
}

/// The inverse matrix by its cofactors; none where the determinant vanishes.
#[inline(always)]
fn inverse<const D: usize>(a: &[[f64; D]; D]) -> Option<[[f64; D]; D]> {
    let cofactor = tensor::cofactor(a);
    let determinant = tensor::determinant_with(a, &cofactor);
    if determinant.is_nan() || determinant.abs() < 1e-300 {
        return None;
    }
    let scale = 1.0 / determinant;
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|k| cofactor[k][i] * scale)
    }))
}

#[inline(always)]
fn apply<const D: usize>(a: &[[f64; D]; D], x: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| (1..D).fold(a[i][0] * x[0], |sum, k| a[i][k].mul_add(x[k], sum)))
}
