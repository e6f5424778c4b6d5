//! The part of the metric for common motions: displacements `w o phi_i` of all shapes by one field
//! `w` on the average.
//!
//! The average follows such a motion, so that only the elastic energy resists it, while the metric
//! of one shape holds the average fixed and adds the whole stiffness of the mismatch, which is larger
//! by orders of magnitude. With `R w = (w o phi_i)_i` and the stiffness `K` of all deformed objects
//! together, `R K^-1 R^T` is added to the inverse metrics of the shapes: an additive Schwarz method.
//! `w` lives on a coarser grid, because the two stiffnesses differ little in motions whose length is
//! a few widths of the interface. Rigid motions, which nothing resists, are taken out: the shapes
//! would drift.

use crate::level::{LevelShapes, shape};
use crate::params::AverageParams;
use fe_grid::multigrid::MultigridParams;
use fe_grid::vector::{axpy, dot};
use fe_grid::{Buffer, Distribution, Grid, GridError, LinearOperator, locate, parallel};
use hyperelastic::{Corotational, CorotationalMultigrid};

/// How many times the spacing of the grid of common motions is doubled.
const COARSENINGS: usize = 2;
/// Least number of cells along an axis of that grid.
const LEAST_CELLS: usize = 4;
/// Regularisation in a minimisation, relative to the stiffness of the object: with 0.3 every second step
/// of crosses and hands has to be shortened, with 10 half of the gain is lost.
pub(crate) const MINIMISATION: f64 = 3.0;
/// Regularisation for the estimate of the remaining energy: with 3 its few iterations miss a half of
/// it, and on bars and ellipses 0.01 needs twice as many.
pub(crate) const ESTIMATE: f64 = 0.3;

/// The inverse metric of common motions.
pub(crate) struct CommonMotion<const D: usize> {
    n_nodes: usize,
    grid: Grid<D>,
    cycle: CorotationalMultigrid<D>,
    rigid: Rigid,
    /// For every shape of this process the cell of `grid` into which each node is moved, as the number of its first
    /// node, and the `D` coordinates there.
    places: Buffer<f32>,
    distribution: Distribution,
}

impl<const D: usize> CommonMotion<D> {
    /// Computes the metric at displacements, for given weights of the elastic energies of all shapes and a
    /// regularisation relative to their shear modulus times the weights.
    pub fn new(
        shapes: &LevelShapes<D>,
        params: &AverageParams,
        weights: &[f64],
        x: &[f64],
        regularisation: f64,
    ) -> Result<Self, GridError> {
        let fine = *shapes.grid();
        let grid = coarsened(fine);
        let n_nodes = fine.n_nodes();
        let mut places = params
            .storage
            .zeros::<f32>((D + 1) * n_nodes * shapes.n_own())?;
        let distribution = shapes.distribution().clone();
        let own = &weights[distribution.own()];
        let dim = D * n_nodes;
        let void = params
            .void_stiffness
            .max(Corotational::<D>::LEAST_VOID_STIFFNESS);
        let parts = places.chunks_exact_mut((D + 1) * n_nodes).enumerate();
        let stiffness: Vec<Vec<f64>> = parallel::map(parts, &|(i, places)| {
            let moved = find(&fine, &grid, shape(x, i, dim), places);
            let indicator = shapes.indicators[i].as_slice();
            let mut sums = vec![0.0; grid.n_cells()];
            for (cell, chi) in moved.into_iter().zip(indicator) {
                sums[cell] += own[i] * ((1.0 - void) * chi + void);
            }
            sums
        });
        places.rest();
        let stiffness = distribution.sum_vectors(&stiffness, grid.n_cells());
        let total: f64 = weights.iter().sum();
        // Every node stands for the volume of a cell.
        let volume = fine.cell_volume() / grid.cell_volume();
        let mut cells = vec![vec![0.0; grid.n_cells()]; Corotational::<D>::CELL_DATA];
        for (cell, sum) in stiffness.iter().enumerate() {
            let mean = (sum * volume).max(void * total) as f32;
            cells[0][cell] = mean;
            for k in 0..D {
                cells[1 + k * D + k][cell] = mean;
            }
        }
        let rigid = Rigid::new(&grid, &cells[0]);
        let law = Corotational {
            moduli: params.law.moduli,
            regularisation: regularisation * total * params.law.moduli.mu,
            rotations: true,
            factored: false,
        };
        let cycle = CorotationalMultigrid::new(grid, law, cells, MultigridParams::default())?;
        Ok(Self {
            n_nodes,
            grid,
            cycle,
            rigid,
            places,
            distribution,
        })
    }

    /// Adds `R K^-1 R^T gradient`.
    pub fn add(&self, gradient: &[f64], out: &mut [f64]) {
        let (n, m, dim) = (self.n_nodes, self.grid.n_nodes(), D * self.n_nodes);
        let loads = parallel::map(0..gradient.len() / dim, &|i| {
            let mut load = vec![0.0; D * m];
            let gradient = shape(gradient, i, dim);
            self.visit(i, |node, coarse, weight| {
                for k in 0..D {
                    load[k * m + coarse] += weight * gradient[k * n + node];
                }
            });
            load
        });
        let mut sum = self.distribution.sum_vectors(&loads, D * m);
        self.rigid.balance(&mut sum);
        let mut motion = vec![0.0; D * m];
        self.cycle.apply_into(&sum, &mut motion);
        self.rigid.remove(&mut motion);
        parallel::for_each(out.chunks_exact_mut(dim).enumerate(), &|(i, out)| {
            self.visit(i, |node, coarse, weight| {
                for k in 0..D {
                    out[k * n + node] += weight * motion[k * m + coarse];
                }
            });
        });
        self.places.rest();
    }

    /// Calls `work` with every node of a shape, every node of the coarse grid about its image, and
    /// the value of the shape function.
    #[inline(always)]
    fn visit(&self, shape: usize, mut work: impl FnMut(usize, usize, f64)) {
        let n = self.n_nodes;
        let strides = self.grid.strides();
        let offsets: Vec<usize> = (0..1usize << D)
            .map(|c| (0..D).map(|k| (c >> k & 1) * strides[k]).sum())
            .collect();
        let places = &self.places[shape * (D + 1) * n..(shape + 1) * (D + 1) * n];
        for node in 0..n {
            let first = places[node] as usize;
            for (c, offset) in offsets.iter().enumerate() {
                let mut weight = 1.0;
                for k in 0..D {
                    let local = f64::from(places[(k + 1) * n + node]);
                    weight *= if c >> k & 1 == 1 { local } else { 1.0 - local };
                }
                work(node, first + offset, weight);
            }
        }
    }
}

/// Returns the grid of common motions.
fn coarsened<const D: usize>(fine: Grid<D>) -> Grid<D> {
    let mut grid = fine;
    for _ in 0..COARSENINGS {
        match grid.coarser() {
            Some(coarser) if coarser.cells_per_axis().iter().all(|&c| c >= LEAST_CELLS) => {
                grid = coarser;
            }
            _ => break,
        }
    }
    grid
}

/// Rigid motions, orthonormal for a mass at every node.
struct Rigid {
    /// The mass, once for every component.
    mass: Vec<f64>,
    motions: Vec<Vec<f64>>,
}

impl Rigid {
    /// The motions for a density per cell.
    fn new<const D: usize>(grid: &Grid<D>, density: &[f32]) -> Self {
        let (n, strides) = (grid.n_nodes(), grid.strides());
        let mut mass = vec![0.0; D * n];
        for (cell, density) in density.iter().enumerate() {
            let first = grid.node_index(grid.cell(cell));
            for c in 0..1usize << D {
                let offset: usize = (0..D).map(|k| (c >> k & 1) * strides[k]).sum();
                for k in 0..D {
                    mass[k * n + first + offset] += f64::from(*density);
                }
            }
        }
        let mut motions = Vec::new();
        for i in 0..D {
            motions.push(Self::motion(grid, |k, _| f64::from(u8::from(k == i))));
            for j in 0..i {
                motions.push(Self::motion(grid, |k, x| match k {
                    k if k == i => x[j],
                    k if k == j => -x[i],
                    _ => 0.0,
                }));
            }
        }
        let mut rigid = Self {
            mass,
            motions: Vec::new(),
        };
        for motion in motions {
            rigid.push(motion);
        }
        rigid
    }

    /// Adds a motion, made orthonormal to those before.
    fn push(&mut self, mut motion: Vec<f64>) {
        self.remove(&mut motion);
        let size = self.product(&motion, &motion).sqrt();
        for x in &mut motion {
            *x /= size;
        }
        self.motions.push(motion);
    }

    fn motion<const D: usize>(grid: &Grid<D>, of: impl Fn(usize, [f64; D]) -> f64) -> Vec<f64> {
        let n = grid.n_nodes();
        let value = |i: usize| of(i / n, grid.position(grid.node(i % n)));
        (0..D * n).map(value).collect()
    }

    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let terms = a.iter().zip(b).zip(&self.mass);
        terms.map(|((a, b), mass)| mass * a * b).sum()
    }

    /// Removes the rigid part of a motion.
    fn remove(&self, motion: &mut [f64]) {
        for rigid in &self.motions {
            axpy(-self.product(rigid, motion), rigid, motion);
        }
    }

    /// Removes the total force and moment of a load: the transpose of [`Self::remove`].
    fn balance(&self, load: &mut [f64]) {
        for rigid in self.motions.iter().rev() {
            let work = dot(rigid, load);
            for ((load, rigid), mass) in load.iter_mut().zip(rigid).zip(&self.mass) {
                *load -= work * mass * rigid;
            }
        }
    }
}

/// Finds the cells of a coarse grid into which the nodes of a fine one are moved.
fn find<const D: usize>(
    fine: &Grid<D>,
    grid: &Grid<D>,
    displacement: &[f64],
    places: &mut [f32],
) -> Vec<usize> {
    let n = fine.n_nodes();
    let mut place = |node: usize| {
        let mut position = fine.position(fine.node(node));
        for k in 0..D {
            position[k] += displacement[k * n + node];
        }
        let (cell, local) = locate(grid, position);
        places[node] = grid.node_index(cell) as f32;
        for k in 0..D {
            places[(k + 1) * n + node] = local[k] as f32;
        }
        grid.cell_index(cell)
    };
    (0..n).map(&mut place).collect()
}
