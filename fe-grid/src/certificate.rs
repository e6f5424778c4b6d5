//! The certificate of injectivity: a lower bound of `det D Phi` on whole cells.
//!
//! In two dimensions the determinant of a bilinear map is affine on a cell, so that its minimum
//! is attained at a corner. In three dimensions it is a polynomial of degree two in each variable;
//! its 27 Bernstein coefficients bound it from below. Where that bound does not suffice the cell is
//! split, and the gap between bound and minimum decreases quadratically.

use crate::compiled_once;
use crate::engine::block::component_rows;
use crate::engine::element::MAX_CORNERS;
use crate::engine::rows::{NodeRows, block_starts, first_cell, rows_of_layer};
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel, Numbers};
use crate::parallel;
use crate::vector;
use serde::Serialize;

/// Bounds of the determinant of a deformation gradient.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Certificate {
    /// Whether the determinant exceeds the threshold everywhere.
    pub certified: bool,
    /// A lower bound of the determinant over all cells: its minimum in two dimensions.
    pub min_det: f64,
    /// The smallest determinant at a corner of a cell.
    pub min_corner_det: f64,
    /// The cell in which the lower bound is attained.
    pub cell: usize,
}

impl Certificate {
    /// The certificate of the identity, whose determinant is one everywhere.
    pub const IDENTITY: Self = Self {
        certified: true,
        min_det: 1.0,
        min_corner_det: 1.0,
        cell: 0,
    };

    /// Returns the certificate with the smallest bound, the first of several; that of the identity
    /// if there are none.
    pub fn worst(certificates: impl IntoIterator<Item = Self>) -> Self {
        let worse = |a: Self, b: Self| if b.min_det < a.min_det { b } else { a };
        let worst = certificates.into_iter().reduce(worse);
        worst.unwrap_or(Self::IDENTITY)
    }
}

/// Interpolates a displacement towards the identity until the determinant exceeds `threshold` on
/// the cells that `within` marks, or on all cells: the displacement is multiplied by 0.9 up to 40
/// times, and is zero afterwards if that does not suffice.
///
/// # Panics
/// If the displacement does not have `D` components of the grid, or `within` does not have one
/// entry per cell.
pub fn repair<const D: usize>(
    grid: &Grid<D>,
    displacement: &mut [f64],
    threshold: f64,
    within: Option<&[bool]>,
) {
    for _ in 0..REPAIRS {
        if certify_within(grid, displacement, threshold, threshold, within).certified {
            return;
        }
        vector::scale(0.9, displacement);
    }
    displacement.fill(0.0);
}

/// Maximal number of interpolations towards the identity.
const REPAIRS: usize = 40;

/// Maximal depth to which a cell is split.
const MAX_SPLITS: usize = 6;

/// Bounds `det(1 + D u)` for a displacement `u`, and compares it with `threshold`. In cells with a displacement that is
/// not finite the bound is minus infinity.
///
/// # Panics
/// If the displacement does not have `D` components of the grid.
pub fn certify<T: Element, const D: usize>(
    grid: &Grid<D>,
    displacement: &[T],
    threshold: f64,
) -> Certificate {
    certify_below(grid, displacement, threshold, f64::INFINITY)
}

/// Like [`certify`], but exact only where the determinant may be `detail` or less. Elsewhere a
/// cheaper estimate is used: `min_det` and `min_corner_det` are exact if they do not exceed
/// `detail`, and otherwise lower bounds that exceed it.
///
/// # Panics
/// If the displacement does not have `D` components of the grid.
pub fn certify_below<T: Element, const D: usize>(
    grid: &Grid<D>,
    displacement: &[T],
    threshold: f64,
    detail: f64,
) -> Certificate {
    certify_within(grid, displacement, threshold, detail, None)
}

/// Like [`certify_below`], but only on the cells that `within` marks, if it is given. An empty set
/// of cells is certified, with an infinite determinant.
///
/// # Panics
/// If the displacement does not have `D` components of the grid, or `within` does not have one
/// entry per cell.
pub fn certify_within<T: Element, const D: usize>(
    grid: &Grid<D>,
    displacement: &[T],
    threshold: f64,
    detail: f64,
    within: Option<&[bool]>,
) -> Certificate {
    let mut total = LayerBounds::none();
    for bounds in bound_layers(grid, displacement, threshold, detail.max(threshold), within) {
        total.include(bounds.bound, bounds.corner, bounds.cell);
    }
    Certificate {
        certified: total.bound > threshold,
        min_det: mutant!(total.bound, CertificateScale => 1.05 * total.bound),
        min_corner_det: total.corner,
        cell: total.cell,
    }
}

/// Returns the cells whose bound of the determinant does not exceed a threshold, in memory order:
/// of those that `within` marks, or of all.
///
/// # Panics
/// If the displacement does not have `D` components of the grid, or `within` does not have one
/// entry per cell.
pub fn violations<T: Element, const D: usize>(
    grid: &Grid<D>,
    displacement: &[T],
    threshold: f64,
    within: Option<&[bool]>,
) -> Vec<usize> {
    bound_layers(grid, displacement, threshold, threshold, within)
        .into_iter()
        .flat_map(|layer| layer.violations)
        .collect()
}

fn bound_layers<T: Element, const D: usize>(
    grid: &Grid<D>,
    displacement: &[T],
    threshold: f64,
    detail: f64,
    within: Option<&[bool]>,
) -> Vec<LayerBounds> {
    match T::numbers(displacement) {
        Numbers::Double(u) => bound_double(grid, u, threshold, detail, within),
        Numbers::Single(u) => bound_single(grid, u, threshold, detail, within),
    }
}

compiled_once! {
    fn bound_double<'a, D>(
        grid: &'a Grid<D>,
        displacement: &'a [f64],
        threshold: f64,
        detail: f64,
        within: Option<&'a [bool]>,
    ) -> Vec<LayerBounds> = bound_in;
}

compiled_once! {
    fn bound_single<'a, D>(
        grid: &'a Grid<D>,
        displacement: &'a [f32],
        threshold: f64,
        detail: f64,
        within: Option<&'a [bool]>,
    ) -> Vec<LayerBounds> = bound_in;
}

fn bound_in<T: Element, const D: usize>(
    grid: &Grid<D>,
    displacement: &[T],
    threshold: f64,
    detail: f64,
    within: Option<&[bool]>,
) -> Vec<LayerBounds> {
    assert_eq!(displacement.len(), D * grid.n_nodes());
    assert!(within.is_none_or(|marks| marks.len() == grid.n_cells()));
    let layers = grid.cells_per_axis()[D - 1];
    let per_layer = grid.n_cells() / layers;
    let mut bounds: Vec<_> = (0..layers).map(|_| LayerBounds::none()).collect();
    let min_len = 2048usize.div_ceil(per_layer);
    parallel::for_each_mut(&mut bounds, min_len, &|layer, bounds| {
        let kernel = BoundKernel {
            grid,
            displacement,
            layer,
            threshold,
            detail,
            within,
        };
        *bounds = T::run_kernel(kernel);
    });
    bounds
}

struct LayerBounds {
    bound: f64,
    corner: f64,
    cell: usize,
    /// Cells whose bound does not exceed the threshold.
    violations: Vec<usize>,
}

impl LayerBounds {
    fn none() -> Self {
        Self {
            bound: f64::INFINITY,
            corner: f64::INFINITY,
            cell: 0,
            violations: Vec::new(),
        }
    }

    fn include(&mut self, bound: f64, corner: f64, cell: usize) {
        // NaN counts as minus infinity.
        let worst_if_nan = |x: f64| if x.is_nan() { f64::NEG_INFINITY } else { x };
        let bound = worst_if_nan(bound);
        if bound < self.bound {
            (self.bound, self.cell) = (bound, cell);
        }
        self.corner = self.corner.min(worst_if_nan(corner));
    }
}

struct BoundKernel<'a, T, const D: usize> {
    grid: &'a Grid<D>,
    displacement: &'a [T],
    layer: usize,
    threshold: f64,
    /// Above this value an estimate of the determinant suffices.
    detail: f64,
    /// The cells that are considered; `None` for all.
    within: Option<&'a [bool]>,
}

impl<T: Element, const D: usize> LaneKernel<T> for BoundKernel<'_, T, D> {
    type Output = LayerBounds;

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) -> LayerBounds {
        let length = self.grid.cells_per_axis()[0];
        let (mut bounds, mut corners) = (vec![T::default(); length], vec![T::default(); length]);
        let mut total = LayerBounds::none();
        for row in rows_of_layer(self.grid, self.layer) {
            let nodes = component_rows::<T, D, D>(self.grid, self.displacement, row);
            for i in block_starts::<L>(length) {
                let map = self.corner_positions::<L>(&nodes, i);
                // In two dimensions an estimate is not cheaper than the determinant.
                if D == 2 || self.detail == f64::INFINITY {
                    let (bound, corner) = determinant_bounds::<L, D>(&map);
                    bound.store(&mut bounds[i..]);
                    corner.store(&mut corners[i..]);
                    continue;
                }
                let estimate = determinant_estimate::<L, D>(&map);
                estimate.store(&mut bounds[i..]);
                estimate.store(&mut corners[i..]);
                let end = (i + L::COUNT).min(length);
                let enough = |x: &T| x.to_f64() > self.detail;
                if !bounds[i..end].iter().all(enough) {
                    let enough = L::splat(self.detail).less(estimate);
                    let (bound, corner) = determinant_bounds::<L, D>(&map);
                    L::select(enough, estimate, bound).store(&mut bounds[i..]);
                    L::select(enough, estimate, corner).store(&mut corners[i..]);
                }
            }
            for i in 0..length {
                let cell = first_cell(self.grid, row) + i;
                if self.within.is_some_and(|marks| !marks[cell]) {
                    continue;
                }
                let (mut bound, corner) = (bounds[i].to_f64(), corners[i].to_f64());
                if D == 3 && bound <= self.threshold && corner > self.threshold {
                    let map = self.corner_positions::<T>(&nodes, i);
                    let map = map.map(|c| c.map(Element::to_f64));
                    bound = refined_bound::<D>(&map, self.threshold, MAX_SPLITS);
                }
                total.include(bound, corner, cell);
                if bound.is_nan() || bound <= self.threshold {
                    total.violations.push(cell);
                }
            }
        }
        total
    }
}

impl<T: Element, const D: usize> BoundKernel<'_, T, D> {
    /// Deformed corners of the cells from `i` on, in units of the spacing and relative to the
    /// first corner of each cell.
    #[inline(always)]
    fn corner_positions<L: Lane<Element = T>>(
        &self,
        nodes: &[NodeRows<'_, T>; D],
        i: usize,
    ) -> [[L; MAX_CORNERS]; D] {
        let inverse_h = L::splat(1.0 / self.grid.spacing());
        let mut map = [[L::zero(); MAX_CORNERS]; D];
        for k in 0..D {
            map[k] = nodes[k].corners::<L, D>(i);
            let first = map[k][0];
            for c in 0..1 << D {
                let own = L::splat((c >> k & 1) as f64);
                map[k][c] = (map[k][c] - first).mul_add(inverse_h, own);
            }
        }
        map
    }
}

/// A lower bound of the determinant of a trilinear map given by its corners. With `1 + G` the
/// gradient, `det(1 + G) = 1 + tr G + (tr^2 G - tr G^2) / 2 + det G` is at least
/// `1 + tr G - |G|^2 / 2 - |G|^3 / 3^(3/2)`; every column of `G` lies in the convex hull of its
/// values at the four edges along its axis, which bounds trace and norm.
#[inline(always)]
fn determinant_estimate<L: Lane, const D: usize>(map: &[[L; MAX_CORNERS]; D]) -> L {
    const DETERMINANT_SHARE: f64 = 0.192_450_089_729_875_26;
    let mut trace = L::zero();
    let mut squared_norm = L::zero();
    let mut all_squares = L::zero();
    for k in 0..D {
        let mut least = L::splat(f64::INFINITY);
        let mut largest = L::zero();
        for c in (0..1usize << D).filter(|c| c >> k & 1 == 0) {
            let mut squares = L::zero();
            for m in 0..D {
                let mut entry = map[m][c | 1 << k] - map[m][c];
                if m == k {
                    entry -= L::one();
                    least = entry.min(least);
                }
                squares = entry.mul_add(entry, squares);
            }
            largest = squares.max(largest);
            all_squares += squares;
        }
        trace += least;
        squared_norm += largest;
    }
    let higher = squared_norm
        .sqrt()
        .mul_add(L::splat(DETERMINANT_SHARE), L::splat(0.5));
    // Minima and maxima ignore NaN; this term propagates it.
    all_squares.scale(0.0) + L::one() + trace - squared_norm * higher
}

/// Smallest Bernstein coefficient and smallest corner value of the determinant of a multilinear
/// map given by its corners, `map[component][corner]`.
#[inline(always)]
fn determinant_bounds<L: Lane, const D: usize>(map: &[[L; MAX_CORNERS]; D]) -> (L, L) {
    // edge[k][c]: difference along axis k at the corner c whose bit k is unset.
    let edge = |k: usize, c: usize| -> [L; D] {
        let c = c & !(1 << k);
        let mut edge = [L::zero(); D];
        for m in 0..D {
            edge[m] = map[m][c | 1 << k] - map[m][c];
        }
        edge
    };
    let mut corner = L::splat(f64::INFINITY);
    let mut sum = L::zero();
    for c in 0..1 << D {
        let mut columns = [[L::zero(); D]; D];
        for k in 0..D {
            columns[k] = edge(k, c);
        }
        let own = crate::tensor::determinant(&columns);
        sum += own;
        corner = own.min(corner);
    }
    // A minimum is its second number where one is NaN: those above forget it, and those of the bound below keep it.
    let corner = corner + sum.scale(0.0);
    if D == 2 {
        return (corner, corner);
    }
    // Degree one in the two other variables for each column: the product has degree two in all.
    // Coefficient (i, j, k) collects the triple products of columns whose indices add up to it,
    // divided by the binomial coefficients of degree two.
    let mut coefficients = [L::zero(); 27];
    for yz in 0..4 {
        let a = edge(0, (yz & 1) << 1 | (yz >> 1) << 2);
        for xz in 0..4 {
            let b = edge(1, (xz & 1) | (xz >> 1) << 2);
            // The cross product of the first two columns is used for four third columns.
            let mut cross = [L::zero(); 3];
            for m in 0..3 {
                let (p, q) = ((m + 1) % 3, (m + 2) % 3);
                cross[m] = a[p].mul_add(b[q], -(a[q] * b[p]));
            }
            for xy in 0..4 {
                let e = edge(2, xy);
                let mut product = cross[0] * e[0];
                for m in 1..3 {
                    product = cross[m].mul_add(e[m], product);
                }
                let i = (xz & 1) + (xy & 1);
                let j = (yz & 1) + (xy >> 1);
                let k = (yz >> 1) + (xz >> 1);
                coefficients[i + 3 * j + 9 * k] += product;
            }
        }
    }
    let mut bound = corner;
    for (index, coefficient) in coefficients.into_iter().enumerate() {
        let ones = [index % 3, index / 3 % 3, index / 9]
            .iter()
            .filter(|&&i| i == 1)
            .count();
        bound = coefficient.scale(0.5f64.powi(ones as i32)).min(bound);
    }
    (bound, corner)
}

/// The bound over a cell after splitting it where the bound does not exceed the threshold.
fn refined_bound<const D: usize>(
    map: &[[f64; MAX_CORNERS]; D],
    threshold: f64,
    splits: usize,
) -> f64 {
    let (bound, corner) = determinant_bounds::<f64, D>(map);
    if bound > threshold || corner <= threshold || splits == 0 {
        return bound;
    }
    let mut least = f64::INFINITY;
    for child in 0..1 << D {
        // Scaled by two, so that the determinant in the coordinates of the child is that in the
        // coordinates of the cell.
        let part: [[f64; MAX_CORNERS]; D] =
            std::array::from_fn(|k| child_corners::<D>(&map[k], child).map(|x| 2.0 * x));
        least = least.min(refined_bound::<D>(&part, threshold, splits - 1));
    }
    least
}

/// Corner values of a child cell of a multilinear function.
fn child_corners<const D: usize>(values: &[f64; MAX_CORNERS], child: usize) -> [f64; MAX_CORNERS] {
    let mut v = *values;
    for k in 0..D {
        for c in 0..1 << D {
            if c >> k & 1 == 0 {
                let (low, high) = (v[c], v[c | 1 << k]);
                let middle = f64::midpoint(low, high);
                (v[c], v[c | 1 << k]) = if child >> k & 1 == 0 {
                    (low, middle)
                } else {
                    (middle, high)
                };
            }
        }
    }
    v
}
