//! Exact inversion of `a M + c L` on a uniform grid by cosine or sine transforms.
//!
//! In one dimension the mass and stiffness matrices of linear elements, with the rows of the two
//! end nodes doubled, are convolutions of evenly extended data. The DCT-I diagonalises both, with
//! the symbols, for `theta = pi k / (n-1)`,
//!
//! `m = h (4 + 2 cos theta) / 6` and `l = (2 - 2 cos theta) / h`.
//!
//! In several dimensions `M` is the tensor product of the masses and `L` the sum over the axes of
//! the products with one mass replaced by a stiffness. With zero values on the boundary the data
//! are extended oddly and the DST-I takes the place of the DCT-I.

mod lines;

use crate::error::GridError;
use crate::grid::Grid;
use crate::linear::LinearOperator;
use crate::parallel;
use crate::pool::Pool;
use lines::{BATCH, Ends, LineScratch, LineTransform};

/// Boundary condition on the faces of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// No condition is imposed, so the normal derivative vanishes.
    Natural,
    /// The values are zero; the right-hand side at boundary nodes is ignored.
    Dirichlet,
}

/// The inverse of `mass_coefficient M + stiffness_coefficient L` for multilinear elements.
///
/// Mass `M` and stiffness `L` on a uniform grid are diagonal in the basis of the DCT-I (natural
/// boundary, with the rows of boundary nodes doubled) or of the DST-I (zero values). Their symbols
/// along one axis are `h (4 + 2 cos theta)/6` and `(2 - 2 cos theta)/h`, `theta = pi k/(n-1)`.
///
/// An application costs `O(n log n)` and is exact up to rounding. Two lines at a time share one
/// complex transform, in fixed pairs: the result does not depend on the number of threads.
pub struct SpectralSolver<const D: usize> {
    grid: Grid<D>,
    n_components: usize,
    /// One for each axis.
    transforms: Vec<LineTransform>,
    /// Symbols `(m, l)` along the last axis.
    last_symbols: Vec<(f64, f64)>,
    /// For every wave number of a plane the factors `(alpha, beta)` of `alpha m + beta l`.
    plane_symbols: Vec<(f64, f64)>,
    normalisation: f64,
    boundary: Boundary,
    blocks: Pool<Vec<f64>>,
    scratch: Pool<LineScratch>,
}

impl<const D: usize> SpectralSolver<D> {
    /// Prepares the transforms for a grid.
    ///
    /// # Errors
    /// [`GridError::NotPositiveDefinite`] where the operator has an eigenvalue that is not
    /// positive (for example without mass and with natural boundary).
    pub fn new(
        grid: Grid<D>,
        mass_coefficient: f64,
        stiffness_coefficient: f64,
        boundary: Boundary,
    ) -> Result<Self, GridError> {
        let n = grid.nodes_per_axis();
        let symbols = n.map(|n| axis_symbols(n, grid.spacing(), boundary));
        let plane = symbols[..D - 1].iter();
        let plane = plane.fold(vec![(1.0, 0.0)], |inner, axis| tensor_product(&inner, axis));
        let factors = |(m, l)| {
            let alpha = mass_coefficient * m + stiffness_coefficient * l;
            (alpha, stiffness_coefficient * m)
        };
        let plane_symbols: Vec<_> = plane.into_iter().map(factors).collect();
        let solver = Self {
            grid,
            n_components: 1,
            transforms: LineTransform::all(&n, boundary),
            last_symbols: symbols[D - 1].clone(),
            plane_symbols,
            normalisation: n.iter().map(|&n| 0.5 / (n - 1) as f64).product(),
            boundary,
            blocks: Pool::new(),
            scratch: Pool::new(),
        };
        solver.check_definite()?;
        Ok(solver)
    }

    /// The same operator on every component of vector data, as a [`LinearOperator`] of
    /// `n_components` times as many unknowns as nodes.
    pub fn with_components(mut self, n_components: usize) -> Self {
        self.n_components = n_components;
        self
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Solves `(a M + c L) out = rhs`, for each component where the data have several, one after
    /// the other.
    ///
    /// # Panics
    /// If the lengths differ or are no multiple of the number of nodes.
    pub fn solve_into(&self, rhs: &[f64], out: &mut [f64]) {
        let n = self.grid.n_nodes();
        assert_eq!(rhs.len(), out.len());
        assert_eq!(rhs.len() % n, 0, "whole components only");
        let n_blocks = self.plane_symbols.len().div_ceil(BATCH);
        let room = n_blocks * BATCH * self.last_symbols.len();
        self.blocks.with(
            || vec![0.0; room],
            |blocks| {
                for (rhs, out) in rhs.chunks(n).zip(out.chunks_mut(n)) {
                    self.planes_forward(rhs, out);
                    self.last_axis(out, blocks);
                    self.planes_backward(blocks, out);
                }
            },
        );
    }

    /// Transforms along all axes but the last, plane by plane.
    fn planes_forward(&self, rhs: &[f64], out: &mut [f64]) {
        let chunk = self.plane_symbols.len() * self.planes_at_once();
        parallel::for_each_chunk(out, chunk, 1, &|chunk_idx, planes| {
            planes.copy_from_slice(&rhs[chunk_idx * chunk..][..planes.len()]);
            self.scratch.with(LineScratch::default, |scratch| {
                self.transform_planes(planes, self.forward_ends(), scratch);
            });
        });
    }

    /// Transforms along the last axis, divides by the symbol and transforms back. A block of
    /// columns at a time goes from the planes into a room of its own, so that memory is read and
    /// written in whole cache lines.
    fn last_axis(&self, planes: &[f64], blocks: &mut [f64]) {
        let n = self.last_symbols.len();
        let width = self.plane_symbols.len();
        let transform = &self.transforms[D - 1];
        parallel::for_each_chunk(blocks, BATCH * n, 1, &|block_idx, block| {
            let first = block_idx * BATCH;
            let columns = BATCH.min(width - first);
            let block = &mut block[..columns * n];
            for (row, plane) in block.chunks_mut(columns).zip(planes.chunks(width)) {
                row.copy_from_slice(&plane[first..first + columns]);
            }
            self.scratch.with(LineScratch::default, |scratch| {
                transform.columns(block, columns, self.forward_ends(), scratch);
                self.divide(block, &self.plane_symbols[first..first + columns]);
                transform.columns(block, columns, Ends::Kept, scratch);
            });
        });
    }

    fn divide(&self, block: &mut [f64], columns: &[(f64, f64)]) {
        for (row, &(mass, stiffness)) in block.chunks_mut(columns.len()).zip(&self.last_symbols) {
            for (x, &(alpha, beta)) in row.iter_mut().zip(columns) {
                *x *= self.normalisation / (alpha * mass + beta * stiffness);
            }
        }
    }

    /// Collects the planes from the blocks of columns and transforms them back.
    fn planes_backward(&self, blocks: &[f64], out: &mut [f64]) {
        let n = self.last_symbols.len();
        let width = self.plane_symbols.len();
        let at_once = self.planes_at_once();
        parallel::for_each_chunk(out, width * at_once, 1, &|chunk_idx, planes| {
            for (p, plane) in planes.chunks_mut(width).enumerate() {
                let k = chunk_idx * at_once + p;
                for (block, part) in blocks.chunks(BATCH * n).zip(plane.chunks_mut(BATCH)) {
                    let columns = part.len();
                    part.copy_from_slice(&block[k * columns..(k + 1) * columns]);
                }
            }
            self.scratch.with(LineScratch::default, |scratch| {
                self.transform_planes(planes, Ends::Kept, scratch);
            });
            if self.boundary == Boundary::Dirichlet {
                self.clear_boundary(planes, chunk_idx * at_once);
            }
        });
    }

    /// Sets boundary values to zero: rounding leaves traces there of the lines beside them.
    fn clear_boundary(&self, planes: &mut [f64], first_plane: usize) {
        let n = self.grid.nodes_per_axis();
        let strides = self.grid.strides();
        for k in 0..D - 1 {
            for slab in planes.chunks_mut(strides[k] * n[k]) {
                slab[..strides[k]].fill(0.0);
                slab[strides[k] * (n[k] - 1)..].fill(0.0);
            }
        }
        for (p, plane) in planes.chunks_mut(strides[D - 1]).enumerate() {
            if first_plane + p == 0 || first_plane + p == n[D - 1] - 1 {
                plane.fill(0.0);
            }
        }
    }

    fn transform_planes(&self, planes: &mut [f64], ends: Ends, scratch: &mut LineScratch) {
        let n = self.grid.nodes_per_axis();
        let strides = self.grid.strides();
        for k in 0..D - 1 {
            if k == 0 {
                self.transforms[0].rows(planes, ends, scratch);
            } else {
                for slab in planes.chunks_mut(strides[k] * n[k]) {
                    self.transforms[k].columns(slab, strides[k], ends, scratch);
                }
            }
        }
    }

    /// Natural rows at the ends are half rows of the convolution.
    fn forward_ends(&self) -> Ends {
        match self.boundary {
            Boundary::Natural => Ends::Doubled,
            Boundary::Dirichlet => Ends::Kept,
        }
    }

    /// Planes that one task transforms: enough for a batch of lines.
    fn planes_at_once(&self) -> usize {
        let lines = self.plane_symbols.len() / self.grid.nodes_per_axis()[0];
        BATCH.div_ceil(lines.max(1))
    }

    fn check_definite(&self) -> Result<(), GridError> {
        for &(alpha, beta) in &self.plane_symbols {
            for &(mass, stiffness) in &self.last_symbols {
                let curvature = alpha * mass + beta * stiffness;
                if !(curvature > 0.0 && curvature.is_finite()) {
                    return Err(GridError::NotPositiveDefinite {
                        curvature,
                        iteration: 0,
                    });
                }
            }
        }
        Ok(())
    }
}

impl<const D: usize> LinearOperator for SpectralSolver<D> {
    fn dim(&self) -> usize {
        self.n_components * self.grid.n_nodes()
    }
    fn apply_into(&self, x: &[f64], y: &mut [f64]) {
        assert_eq!(x.len(), self.dim());
        self.solve_into(x, y);
    }
}

/// Symbols `(m, l)` of the mass and stiffness along an axis.
fn axis_symbols(n: usize, h: f64, boundary: Boundary) -> Vec<(f64, f64)> {
    let symbol = |k: usize| {
        let cos = (std::f64::consts::PI * k as f64 / (n - 1) as f64).cos();
        // 2 - 2 cos loses its digits for small angles, 4 sin^2 of the half angle does not.
        let sin = (std::f64::consts::FRAC_PI_2 * k as f64 / (n - 1) as f64).sin();
        let factor = mutant!(4.0, SpectralStiffness => 2.0);
        (h * (4.0 + 2.0 * cos) / 6.0, factor * sin * sin / h)
    };
    let mut symbols: Vec<_> = (0..n).map(symbol).collect();
    if boundary == Boundary::Dirichlet {
        // Sine transforms are zero there; any positive symbol keeps the division harmless.
        symbols[0] = (h, 1.0 / h);
        symbols[n - 1] = (h, 1.0 / h);
    }
    symbols
}

/// Symbols of mass and stiffness on the product of a box (running fastest) and an axis.
fn tensor_product(inner: &[(f64, f64)], axis: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let pairs = axis
        .iter()
        .flat_map(|&b| inner.iter().map(move |&a| (a, b)));
    pairs
        .map(|((m, l), (axis_m, axis_l))| (m * axis_m, l * axis_m + m * axis_l))
        .collect()
}
