//! The energy of a deformation as a function of a further one: for energies
//! `E_i[Phi] = sum_q w f_i(DPhi)` and fixed deformations `Phi_i`, the function
//!
//! ```text
//! u  ->  sum_i c_i E_i[(1 + u) o Phi_i] = sum_i c_i sum_q w f_i((1 + Du(Phi_i(x_q))) DPhi_i(x_q))
//! ```
//!
//! of a displacement `u` of the deformed box, with its gradient and its Hessian. No inverse
//! deformation is needed: at a deformed quadrature point `u` is evaluated by its own multilinear
//! interpolation. Since every such point lies in one cell, the Hessian couples neighbouring nodes
//! only; it is assembled as a [`BlockStencil`], once for many products. Where a point has left the
//! box, `u` goes on constantly.
//!
//! With `A = (1 + Du) DPhi`, stress `P = f'(A)` and shape functions `N_j`,
//!
//! ```text
//! gradient_(j,r)      = sum w (P DPhi^T)_rb d_b N_j,
//! Hessian_(j,r),(k,s) = sum w d_a N_j T_(ra)(sb) d_b N_k,
//! T_(ra)(sb)          = (f''(A)[e_s (x) e_b DPhi] DPhi^T)_ra,
//! ```
//!
//! all at deformed points. Every slab of deformed cells is processed by one task, which searches
//! the sources for points inside it: a cell receives its points in a fixed order, independent of
//! the number of threads.

mod cell_sums;

use crate::composition::locate_lanes;
use crate::engine::block::{Block, RowData};
use crate::engine::element::{MAX_CORNERS, multilinear};
use crate::engine::rows::{Row, rows_of_layer};
use crate::engine::slabs::{Slab, over_slabs};
use crate::engine::{CellLaw, Data, Jet, MAX_COEFFICIENTS, Point, Reads};
use crate::error::GridError;
use crate::grid::Grid;
use crate::lane::{Element, Lane, LaneKernel, MAX_LANES};
use crate::stencil::{BlockStencil, corner_pairs, half_offsets};
use crate::tensor::{Tensor, add, add_identity, product, product_transposed};
use cell_sums::{
    CornerMatrix, Found, Places, Sums, block_entries, scatter_flux, scatter_tangent, slopes, upper,
};

/// Below this number of cells everything stays on one thread.
const PARALLEL_CELLS: usize = 1024;

/// One deformation with its weight and the coefficient fields of its energy.
#[derive(Clone, Copy)]
pub struct PullbackSource<'a> {
    /// Factor `c_i` of the energy.
    pub weight: f64,
    /// Displacement of `Phi_i`, component by component.
    pub displacement: &'a [f64],
    /// Nodal coefficient fields.
    pub coefficients: &'a [&'a [f64]],
}

/// Quantities to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Derivatives {
    /// The value alone.
    Value,
    /// The gradient, too.
    Gradient,
    /// The gradient and the Hessian.
    Hessian,
}

/// The function at a state.
#[derive(Clone, Debug)]
pub struct Pullback<const D: usize> {
    /// Its value.
    pub value: f64,
    /// Its derivatives, component by component; empty where they were not asked for.
    pub gradient: Vec<f64>,
    /// Its second derivatives, with the stiffness of every deformed cell.
    pub hessian: Option<(BlockStencil<D, D>, Vec<f64>)>,
}

/// The function `u -> sum_i c_i E_i[(1 + u) o Phi_i]` at a displacement; an empty one is zero.
///
/// With the Hessian comes for every cell of the deformed box the mean over its volume of the trace
/// of `T`, `sum w T_(ra)(ra) / h^D`: how stiff the cell has become.
///
/// # Errors
/// [`GridError::Inadmissible`] with a cell of a source where a density is not finite.
///
/// # Panics
/// If a source or the state does not fit the grid, or the law reads more than displacement
/// gradients and coefficients.
pub fn pull_back<F: CellLaw<D, D>, const D: usize>(
    grid: &Grid<D>,
    law: &F,
    sources: &[PullbackSource<'_>],
    state: &[f64],
    derivatives: Derivatives,
) -> Result<Pullback<D>, GridError> {
    const { assert!(!F::USES_VALUE && F::CELL_DATA == 0) };
    let n = grid.n_nodes();
    assert!(state.is_empty() || state.len() == D * n);
    for source in sources {
        assert_eq!(source.displacement.len(), D * n);
        assert!(source.coefficients.len() >= F::COEFFICIENTS);
    }
    let ranges: Vec<Vec<[f64; 2]>> = sources.iter().map(|s| layer_ranges(grid, s)).collect();
    let outputs = match derivatives {
        Derivatives::Value => 0,
        Derivatives::Gradient => D,
        Derivatives::Hessian => D + D * D * half_offsets::<D>().len(),
    };
    let mut out = vec![0.0; outputs * n];
    let parallel = grid.n_cells() >= PARALLEL_CELLS;
    let parts = over_slabs(grid, outputs, &mut out, parallel, &|slab| {
        f64::run_kernel(SlabTask {
            grid,
            law,
            sources,
            ranges: &ranges,
            state,
            derivatives,
            slab,
        })
    });
    let mut value = 0.0;
    let mut stiffness = Vec::with_capacity(grid.n_cells());
    for part in parts {
        if let Some(cell) = part.inadmissible {
            return Err(GridError::Inadmissible { cell });
        }
        value += part.value;
        stiffness.extend(part.stiffness);
    }
    if derivatives < Derivatives::Hessian {
        return Ok(Pullback {
            value,
            gradient: out,
            hessian: None,
        });
    }
    // The stencil is by far the larger part, and stays where it is.
    let gradient = out.drain(..D * n).collect();
    Ok(Pullback {
        value,
        gradient,
        hessian: Some((BlockStencil::from_parts(*grid, out), stiffness)),
    })
}

/// For every layer of cells of a source the smallest and largest deformed coordinate along the last
/// axis, in units of the spacing: a multilinear map stays between its corner values.
fn layer_ranges<const D: usize>(grid: &Grid<D>, source: &PullbackSource<'_>) -> Vec<[f64; 2]> {
    let n = grid.nodes_per_axis();
    let plane = grid.n_nodes() / n[D - 1];
    let last = &source.displacement[(D - 1) * grid.n_nodes()..];
    let of_plane: Vec<[f64; 2]> = last
        .chunks_exact(plane)
        .enumerate()
        .map(|(p, nodes)| {
            let place = |u: f64| p as f64 + u / grid.spacing();
            nodes
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |r, &u| {
                    [r[0].min(place(u)), r[1].max(place(u))]
                })
        })
        .collect();
    of_plane
        .windows(2)
        .map(|pair| [pair[0][0].min(pair[1][0]), pair[0][1].max(pair[1][1])])
        .collect()
}

/// What the source's displacement is read for: position and gradient.
struct Seen<F>(std::marker::PhantomData<F>);

impl<F: Reads> Reads for Seen<F> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = F::COEFFICIENTS;
    const CELL_DATA: usize = 0;
}

/// Number of cells whose points are added together, quadrature point by quadrature point: that of
/// the widest lane on any machine, so that the order of summation is the same on all.
const RUN: usize = 8;

/// Result of a slab besides its contributions to nodal arrays.
struct SlabPart {
    value: f64,
    stiffness: Vec<f64>,
    inadmissible: Option<usize>,
}

struct SlabTask<'a, F, const D: usize> {
    grid: &'a Grid<D>,
    law: &'a F,
    sources: &'a [PullbackSource<'a>],
    ranges: &'a [Vec<[f64; 2]>],
    state: &'a [f64],
    derivatives: Derivatives,
    slab: Slab<'a, f64>,
}

impl<F: CellLaw<D, D>, const D: usize> LaneKernel<f64> for SlabTask<'_, F, D> {
    type Output = SlabPart;

    #[inline(always)]
    fn run<L: Lane<Element = f64>>(mut self) -> SlabPart {
        let cells = self.grid.cells_per_axis();
        let per_layer: usize = cells[..D - 1].iter().product();
        let count = self.slab.layers.len() * per_layer;
        let wants_gradient = self.derivatives >= Derivatives::Gradient;
        let wants_hessian = self.derivatives == Derivatives::Hessian;
        let none = Sums::<D> {
            gradient: [[0.0; MAX_CORNERS]; D],
            trace: 0.0,
        };
        let mut sums = vec![none; if wants_gradient { count } else { 0 }];
        let matrices = if wants_hessian { count } else { 0 } * block_entries(D);
        let mut matrices: Vec<CornerMatrix> = vec![[[0.0; MAX_CORNERS]; MAX_CORNERS]; matrices];
        let mut part = SlabPart {
            value: 0.0,
            stiffness: Vec::new(),
            inadmissible: None,
        };
        let (low, high) = self.slab.reach(cells[D - 1]);
        let mut found = Found::new();
        let mut blocks: Vec<Block<L, D, D>> = (0..RUN.div_ceil(L::COUNT))
            .map(|_| Block::zero::<Seen<F>>(self.grid))
            .collect();
        for (source, ranges) in self.sources.iter().zip(self.ranges) {
            let factor = mutant!(source.weight, PullbackWeight => 1.0);
            let weight = factor * self.grid.cell_volume() / f64::from(1u32 << D);
            let data = Data {
                coefficients: source.coefficients,
                cells: &[],
            };
            for (layer, range) in ranges.iter().enumerate() {
                if range[0] > high || range[1] < low {
                    continue;
                }
                for row in rows_of_layer(self.grid, layer) {
                    let nodes = RowData::new::<Seen<F>>(self.grid, source.displacement, &data, row);
                    for run in (0..cells[0]).step_by(RUN) {
                        let starts = (run..cells[0].min(run + RUN)).step_by(L::COUNT);
                        for (i, block) in starts.clone().zip(&mut blocks) {
                            block.read::<Seen<F>, f64>(&nodes, i);
                        }
                        // Points are large, and not passed on by iterators, which would copy them.
                        for place in 0..blocks.len() << D {
                            let (q, b) = (place / blocks.len(), place % blocks.len());
                            let i = run + b * L::COUNT;
                            if i >= cells[0] {
                                continue;
                            }
                            let mut point = blocks[b].point(q);
                            let places = self.places(&point, cells[0] - i);
                            if places.count == 0 {
                                continue;
                            }
                            self.evaluate(&mut point, &places, weight, &mut found);
                            for &l in &places.lanes[..places.count] {
                                part.value += found.value[l];
                                if !found.value[l].is_finite() {
                                    let first = (row[1] * cells[1] + row[0]) * cells[0];
                                    part.inadmissible.get_or_insert(first + i + l);
                                    return part;
                                }
                                if !wants_gradient {
                                    continue;
                                }
                                let slopes = slopes(self.grid, &places, l);
                                let cell = places.cell[l];
                                scatter_flux(&found, &slopes, l, &mut sums[cell]);
                                if wants_hessian {
                                    let entries = block_entries(D);
                                    let own = &mut matrices[cell * entries..][..entries];
                                    scatter_tangent::<L, D>(
                                        &found,
                                        &slopes,
                                        l,
                                        own,
                                        &mut sums[cell],
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
        if wants_gradient {
            self.finish(&sums, &matrices);
        }
        if wants_hessian {
            let volume = self.grid.cell_volume();
            part.stiffness = sums.iter().map(|sum| sum.trace / volume).collect();
        }
        part
    }
}

/// Most entries of a displacement gradient.
const MAX_DIRECTIONS: usize = 9;

impl<F: CellLaw<D, D>, const D: usize> SlabTask<'_, F, D> {
    #[inline(always)]
    fn places<L: Lane<Element = f64>>(&self, point: &Point<L, D, D>, left: usize) -> Places<D> {
        let at = locate_lanes(self.grid, &point.deformed_position());
        let mut places = Places {
            lanes: [0; MAX_LANES],
            count: 0,
            cell: [0; MAX_LANES],
            local: [[0.0; MAX_LANES]; D],
            inside: [[0.0; MAX_LANES]; D],
        };
        let mut index = [[0.0; MAX_LANES]; D];
        for k in 0..D {
            at.cell[k].store(&mut index[k]);
            at.local[k].store(&mut places.local[k]);
            at.inside[k].store(&mut places.inside[k]);
        }
        let cells = self.grid.cells_per_axis();
        for l in 0..L::COUNT.min(left) {
            let layer = index[D - 1][l] as usize;
            if !self.slab.layers.contains(&layer) {
                continue;
            }
            let mut cell = layer - self.slab.layers.start;
            for k in (0..D - 1).rev() {
                cell = cell * cells[k] + index[k][l] as usize;
            }
            places.cell[l] = cell;
            places.lanes[places.count] = l;
            places.count += 1;
        }
        places
    }

    /// The gradient of the state at deformed points.
    #[inline(always)]
    fn state_gradient<L: Lane<Element = f64>>(&self, places: &Places<D>) -> Tensor<L, D> {
        let (n, strides) = (self.grid.n_nodes(), self.grid.strides());
        let cells = self.grid.cells_per_axis();
        let mut gradient = [[[0.0; MAX_LANES]; D]; D];
        for &l in &places.lanes[..places.count] {
            let mut rest = places.cell[l];
            let mut base = self.slab.layers.start * strides[D - 1];
            for k in 0..D {
                let index = if k + 1 == D { rest } else { rest % cells[k] };
                base += index * strides[k];
                rest /= cells[k];
            }
            let mut local = [0.0; D];
            for k in 0..D {
                local[k] = places.local[k][l];
            }
            for r in 0..D {
                let mut corners = [0.0; MAX_CORNERS];
                for c in 0..1usize << D {
                    let offset: usize = (0..D).map(|k| (c >> k & 1) * strides[k]).sum();
                    corners[c] = self.state[r * n + base + offset];
                }
                let (_, slope) = multilinear::<f64, D>(corners, &local);
                for b in 0..D {
                    gradient[r][b][l] = slope[b] / self.grid.spacing() * places.inside[b][l];
                }
            }
        }
        let mut lanes = [[L::zero(); D]; D];
        for r in 0..D {
            for b in 0..D {
                lanes[r][b] = L::load(&gradient[r][b]);
            }
        }
        lanes
    }

    #[inline(always)]
    fn evaluate<L: Lane<Element = f64>>(
        &self,
        point: &mut Point<L, D, D>,
        places: &Places<D>,
        weight: f64,
        found: &mut Found<D>,
    ) {
        let inner = add_identity(&point.gradient);
        if !self.state.is_empty() {
            let outer = self.state_gradient::<L>(places);
            point.gradient = add(&point.gradient, &product(&outer, &inner));
        }
        point.value = [L::zero(); D];
        for f in F::COEFFICIENTS..MAX_COEFFICIENTS {
            point.coefficient[f] = L::zero();
        }
        let weight = L::splat(weight);
        if self.derivatives == Derivatives::Value {
            (self.law.value(point) * weight).store(&mut found.value);
            return;
        }
        let (value, jet) = self.law.gradient(point);
        (value * weight).store(&mut found.value);
        let flux = product_transposed(&jet.gradient, &inner);
        for r in 0..D {
            for b in 0..D {
                (flux[r][b] * weight).store(&mut found.flux[r][b]);
            }
        }
        if self.derivatives == Derivatives::Gradient {
            return;
        }
        let mut directions = [Jet::zero(); MAX_DIRECTIONS];
        let mut changes = [Jet::zero(); MAX_DIRECTIONS];
        for s in 0..D {
            for b in 0..D {
                directions[s * D + b].gradient[s] = inner[b];
            }
        }
        let (directions, changes) = (&directions[..D * D], &mut changes[..D * D]);
        self.law.hessian_actions(point, directions, changes);
        for s in 0..D {
            for b in 0..D {
                let pulled = product_transposed(&changes[s * D + b].gradient, &inner);
                for r in 0..=s {
                    for a in 0..D {
                        (pulled[r][a] * weight).store(&mut found.tangent[r][s][a][b]);
                    }
                }
            }
        }
    }

    /// Sums of the cells to nodal arrays.
    #[inline(always)]
    fn finish(&mut self, sums: &[Sums<D>], matrices: &[CornerMatrix]) {
        let length = self.grid.cells_per_axis()[0];
        let entries = block_entries(D);
        let pairs = corner_pairs::<D>();
        let mut first = 0;
        for layer in self.slab.layers.clone() {
            for row in rows_of_layer(self.grid, layer) {
                let own = &sums[first..first + length];
                for r in 0..D {
                    for c in 0..1usize << D {
                        self.add(r, layer, row, c, |i| own[i].gradient[r][c]);
                    }
                }
                if !matrices.is_empty() {
                    let own = &matrices[first * entries..(first + length) * entries];
                    for &(corner, other, offset) in &pairs {
                        for r in 0..D {
                            for s in 0..D {
                                let output = D + (offset * D + r) * D + s;
                                let (e, j, k) = if r <= s {
                                    (upper::<D>(r, s), corner, other)
                                } else {
                                    (upper::<D>(s, r), other, corner)
                                };
                                let value = |i: usize| own[i * entries + e][j][k];
                                self.add(output, layer, row, corner, value);
                            }
                        }
                    }
                }
                first += length;
            }
        }
    }

    /// Adds a number of every cell of a row to one corner of it.
    #[inline(always)]
    fn add(
        &mut self,
        output: usize,
        layer: usize,
        row: Row,
        corner: usize,
        value: impl Fn(usize) -> f64,
    ) {
        let n = self.grid.nodes_per_axis();
        let plane = if D == 3 { n[0] * n[1] } else { n[0] };
        let side = if D == 3 {
            (row[0] + (corner >> 1 & 1)) * n[0]
        } else {
            0
        };
        let target = self.slab.plane(output, layer, corner >> (D - 1), plane);
        let start = side + (corner & 1);
        for (i, t) in target[start..start + n[0] - 1].iter_mut().enumerate() {
            *t += value(i);
        }
    }
}
