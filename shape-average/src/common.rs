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
use crate::params::{AverageParams, Precision};
use fe_grid::multigrid::MultigridParams;
use fe_grid::vector::{axpy, dot};
use fe_grid::{
    Buffer, Distribution, Element, Grid, GridError, LinearOperator, compiled_once, locate, parallel,
};
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
    /// For every shape of this process where in `grid` each node is moved to.
    places: Places,
    distribution: Distribution,
}

/// Places in a grid, shape by shape.
enum Places {
    /// The cell, as the number of its first node, and the `D` coordinates there.
    InCells(Buffer<f32>),
    /// The `D` coordinates in the grid, in parts of a cell: each is divided into so many powers of two.
    Parts(Buffer<u16>, u32),
}

/// A place in a grid: the first node of a cell, and the coordinates there.
type Place<const D: usize> = (usize, [f64; D]);

compiled_once! {
    fn metric_of_motions<'a, D>(
        shapes: &'a LevelShapes<D>,
        params: &'a AverageParams,
        weights: &'a [f64],
        x: &'a [f64],
        regularisation: f64,
    ) -> Result<CommonMotion<D>, GridError> = CommonMotion::at;
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
        metric_of_motions(shapes, params, weights, x, regularisation)
    }

    fn at(
        shapes: &LevelShapes<D>,
        params: &AverageParams,
        weights: &[f64],
        x: &[f64],
        regularisation: f64,
    ) -> Result<Self, GridError> {
        let fine = *shapes.grid();
        let grid = coarsened(fine);
        let n_nodes = fine.n_nodes();
        let mut places = Places::new(params, shapes, &grid)?;
        let distribution = shapes.distribution().clone();
        let own = &weights[distribution.own()];
        let dim = D * n_nodes;
        let void = params
            .void_stiffness
            .max(Corotational::<D>::LEAST_VOID_STIFFNESS);
        let parts = places.of_shapes::<D>(n_nodes).into_iter().enumerate();
        let stiffness: Vec<Vec<f64>> = parallel::map(parts, &|(i, mut places)| {
            let moved = find(&fine, &grid, shape(x, i, dim), &mut places);
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
    pub fn add<T: Element>(&self, gradient: &[T], out: &mut [T]) {
        let (n, m, dim) = (self.n_nodes, self.grid.n_nodes(), D * self.n_nodes);
        let loads = parallel::map(0..gradient.len() / dim, &|i| {
            let mut load = vec![0.0; D * m];
            let gradient = shape(gradient, i, dim);
            self.visit(i, |node, coarse, weight| {
                for k in 0..D {
                    load[k * m + coarse] += weight * gradient[k * n + node].to_f64();
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
                    let entry = &mut out[k * n + node];
                    *entry = T::from_f64(entry.to_f64() + weight * motion[k * m + coarse]);
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
        let mut visit = |node: usize, (first, local): Place<D>| {
            for (c, offset) in offsets.iter().enumerate() {
                let mut weight = 1.0;
                for k in 0..D {
                    weight *= if c >> k & 1 == 1 {
                        local[k]
                    } else {
                        1.0 - local[k]
                    };
                }
                work(node, first + offset, weight);
            }
        };
        match &self.places {
            Places::InCells(places) => {
                let places = &places[shape * (D + 1) * n..(shape + 1) * (D + 1) * n];
                for node in 0..n {
                    let local = std::array::from_fn(|k| f64::from(places[(k + 1) * n + node]));
                    visit(node, (places[node] as usize, local));
                }
            }
            Places::Parts(places, shift) => {
                let places = &places[shape * D * n..(shape + 1) * D * n];
                for node in 0..n {
                    let parts = std::array::from_fn(|k| places[k * n + node]);
                    visit(node, place_of_parts(&self.grid, parts, *shift));
                }
            }
        }
    }
}

impl Places {
    /// Room for the places of all nodes of shapes in a grid.
    fn new<const D: usize>(
        params: &AverageParams,
        shapes: &LevelShapes<D>,
        grid: &Grid<D>,
    ) -> Result<Self, GridError> {
        let nodes = shapes.grid().n_nodes() * shapes.n_own();
        Ok(match params.precision_on(shapes.grid()) {
            Precision::Double => Self::InCells(params.storage.zeros((D + 1) * nodes)?),
            Precision::Mixed => {
                let most = grid.cells_per_axis().into_iter().fold(1, usize::max);
                let shift = (usize::from(u16::MAX) / most).max(1).ilog2();
                Self::Parts(params.storage.zeros(D * nodes)?, shift)
            }
        })
    }

    /// The places of each shape.
    fn of_shapes<const D: usize>(&mut self, n_nodes: usize) -> Vec<ShapePlaces<'_>> {
        match self {
            Self::InCells(places) => {
                let shapes = places.chunks_exact_mut((D + 1) * n_nodes);
                shapes.map(ShapePlaces::InCells).collect()
            }
            Self::Parts(places, shift) => {
                let shapes = places.chunks_exact_mut(D * n_nodes);
                shapes
                    .map(|places| ShapePlaces::Parts(places, *shift))
                    .collect()
            }
        }
    }

    fn rest(&self) {
        match self {
            Self::InCells(places) => places.rest(),
            Self::Parts(places, _) => places.rest(),
        }
    }
}

/// The [`Places`] of one shape, to be written.
enum ShapePlaces<'a> {
    InCells(&'a mut [f32]),
    Parts(&'a mut [u16], u32),
}

/// Returns the place with these coordinates, in parts of a cell.
#[inline(always)]
fn place_of_parts<const D: usize>(grid: &Grid<D>, parts: [u16; D], shift: u32) -> Place<D> {
    let (cells, strides) = (grid.cells_per_axis(), grid.strides());
    let size = f64::from(1u32 << shift);
    let mut first = 0;
    let local = std::array::from_fn(|k| {
        let part = usize::from(parts[k]);
        // The last node belongs to the last cell.
        let cell = (part >> shift).min(cells[k] - 1);
        first += cell * strides[k];
        (part - (cell << shift)) as f64 / size
    });
    (first, local)
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
    places: &mut ShapePlaces<'_>,
) -> Vec<usize> {
    let n = fine.n_nodes();
    let mut place = |node: usize| {
        let mut position = fine.position(fine.node(node));
        for k in 0..D {
            position[k] += displacement[k * n + node];
        }
        let (cell, local) = locate(grid, position);
        match places {
            ShapePlaces::InCells(places) => {
                places[node] = grid.node_index(cell) as f32;
                for k in 0..D {
                    places[(k + 1) * n + node] = local[k] as f32;
                }
            }
            ShapePlaces::Parts(places, shift) => {
                let size = f64::from(1u32 << *shift);
                for k in 0..D {
                    let part = (cell[k] as f64 + local[k]) * size;
                    places[k * n + node] = part.round() as u16;
                }
            }
        }
        grid.cell_index(cell)
    };
    (0..n).map(&mut place).collect()
}
