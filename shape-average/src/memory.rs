//! Estimate of the memory of an average, available before the computation starts.
//!
//! Every array whose size grows with the grid is counted with its size on the finest level. Of the
//! temporary arrays (of an evaluation, a multigrid cycle, a damped step) only the largest set is
//! counted, as they do not exist at the same time. The program itself, the boundaries of shapes and
//! pictures are not counted.

use crate::hierarchy::HISTORY;
use crate::params::{AverageParams, Precision, Solver};
use fe_grid::{Distribution, Grid, Storage, parallel};
use hyperelastic::{Corotational, CycleMemory};
use serde::Serialize;

/// Size of a number in double and in single precision, and of a half, in bytes.
const DOUBLE: u64 = 8;
const SINGLE: u64 = 4;
const HALF: u64 = 2;

/// Memory by purpose, in bytes. Arrays that [`AverageParams::storage`] places in files are counted
/// under their purpose and in [`MemoryEstimate::files`], not in [`MemoryEstimate::memory`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MemoryEstimate {
    /// Signed distances, phase fields, indicators and visibility masks.
    pub shapes: u64,
    /// The displacements.
    pub displacements: u64,
    /// Gradients, the direction and the trial state.
    pub minimiser: u64,
    /// The L-BFGS pairs.
    pub history: u64,
    /// The metrics of all shapes, or the state that they are computed from.
    pub metric: u64,
    /// The average, its normal equations and the vectors of their solver.
    pub average: u64,
    /// Work space of the multigrid cycles, and the largest set of temporary arrays.
    pub temporary: u64,
    /// Memory needed to assemble the result, in place of everything except the shapes and the
    /// displacements.
    pub result: u64,
    /// Peak memory.
    pub memory: u64,
    /// Size of the temporary files.
    pub files: u64,
}

/// Estimates the memory of an average with the given finest grid, with as many threads as the present
/// pool has; `partly_visible` is true if there are visibility masks
/// ([`average_of_visible`](crate::average_of_visible)), and shapes have `n_components` components. Where the shapes are distributed to processes, it
/// is that of the first one, which collects the result.
pub fn memory_estimate<const D: usize>(
    params: &AverageParams,
    distribution: &Distribution,
    n_components: usize,
    partly_visible: bool,
    grid: &Grid<D>,
) -> MemoryEstimate {
    let all = distribution.n_parts() as u64;
    let components = n_components as u64;
    // Where there are several, the whole shapes are one more.
    let parts = if n_components > 1 { components } else { 0 };
    let n = distribution.own().len() as u64;
    let mixed = params.precision_on(grid) == Precision::Mixed;
    let sizes = Sizes::new(grid, distribution.own().len(), mixed);
    let state = n * sizes.d * sizes.field;
    let spilled = params.storage != Storage::Memory;
    let lbfgs = params.solver == Solver::Lbfgs;
    let remade = params.remakes_metrics && lbfgs;
    // The previous level's phase fields and indicators exist until the next level is set up.
    let coarser = grid.coarser().map_or(0, |g| g.n_nodes() as u64 * DOUBLE);
    let seen = u64::from(partly_visible);
    // The signed distances are those of all shapes.
    let shapes = all * (1 + parts + seen) * sizes.field
        + n * (1 + components + seen) * (sizes.field + coarser);
    let metric = sizes.metric();
    // The part for common motions stores a cell and a position for every node, or the position in halves.
    let common = if mixed {
        n * sizes.d * sizes.field * HALF / DOUBLE
    } else {
        n * (sizes.d + 1) * sizes.field * SINGLE / DOUBLE
    };
    let (minimiser, history, metrics) = if lbfgs {
        let vectors = 2 * HISTORY as u64 * state;
        let own = if remade { state } else { n * metric };
        if sizes.mixed {
            // A byte a number, and the scales of blocks of 32 numbers.
            let pairs = vectors / DOUBLE + vectors / DOUBLE / 32 * SINGLE;
            (4 * state * SINGLE / DOUBLE, pairs, own + common)
        } else {
            (4 * state, vectors * SINGLE / DOUBLE, own + common)
        }
    } else {
        // The direction, the gradient and the trial state of one shape, and a spectral solve.
        (3 * sizes.d * sizes.field + 2 * sizes.field, 0, 0)
    };
    let metric_vectors = if remade { metrics } else { common };
    // The average, four vectors of its solver and the diagonal; each component has its equations.
    let copies = if remade { 2 } else { 1 };
    let average = (5 + copies * components) * sizes.field + components * sizes.equations();
    let at_once = if spilled { 1 } else { sizes.at_once };
    let (work_space, transfer) = if lbfgs {
        let own = if remade { metric } else { 0 };
        let building = if remade { sizes.metric_building() } else { 0 };
        let transfer = own + building.max(sizes.transfer());
        (at_once * sizes.cycle.work_space, at_once * transfer)
    } else {
        (0, 0)
    };
    let temporary = work_space + sizes.temporary(at_once).max(transfer);
    // Per shape the displacement, the signed distance and the pushed-forward distance, with the
    // masks; during an inversion, the points found. Of shapes of other processes the first collects the
    // displacements, the phase fields and the indicators.
    let collected = (all - n) * (sizes.d + 1 + components + seen) * sizes.field;
    let measured = all * (sizes.d + 2 + 2 * parts + seen) * sizes.field;
    let result = measured + collected + sizes.at_once * 10 * sizes.field;
    let vectors = minimiser + history + if spilled { metric_vectors } else { 0 };
    let files = if spilled && lbfgs { state + vectors } else { 0 };
    let everything = shapes + state + minimiser + history + metrics + average + temporary;
    let in_files_at_the_end = if files > 0 { state } else { 0 };
    let at_the_end = shapes + state + result - in_files_at_the_end;
    MemoryEstimate {
        shapes,
        displacements: state,
        minimiser,
        history,
        metric: metrics,
        average,
        temporary,
        result,
        memory: (everything - files).max(at_the_end),
        files,
    }
}

/// Sizes on the finest grid, in bytes.
struct Sizes<const D: usize> {
    /// The dimension.
    d: u64,
    /// One scalar field in double precision.
    field: u64,
    /// Whether vectors are kept in less memory.
    mixed: bool,
    /// Number of shapes that are processed at the same time.
    at_once: u64,
    threads: u64,
    n_cells: u64,
    /// Node planes shared by two slabs of cells, which are stored twice, as a fraction of all
    /// planes.
    shared_planes: f64,
    /// Number of cells of a slab.
    slab_cells: u64,
    /// Numbers of nodes and cells of all levels of a metric together.
    nodes: u64,
    cells: u64,
    /// A metric in single precision.
    cycle: CycleMemory,
}

impl<const D: usize> Sizes<D> {
    fn new(grid: &Grid<D>, n_shapes: usize, mixed: bool) -> Self {
        let threads = parallel::n_threads();
        let layers = grid.cells_per_axis()[D - 1];
        // The same partition as in the cell engine.
        let thickness = layers.div_ceil(32).max(if D == 3 { 4 } else { 8 });
        let slabs = layers.div_ceil(thickness);
        let (mut nodes, mut cells) = (0, 0);
        let mut level = Some(*grid);
        while let Some(grid) = level {
            nodes += grid.n_nodes() as u64;
            cells += grid.n_cells() as u64;
            level = grid.coarser();
        }
        Self {
            d: D as u64,
            field: grid.n_nodes() as u64 * DOUBLE,
            mixed,
            at_once: threads.min(n_shapes) as u64,
            threads: threads as u64,
            n_cells: grid.n_cells() as u64,
            shared_planes: (slabs - 1) as f64 / (layers + 1) as f64,
            slab_cells: (grid.n_cells() / layers * thickness.min(layers)) as u64,
            nodes,
            cells,
            cycle: CycleMemory::on(grid),
        }
    }

    /// Returns the size of the coefficients per cell and the inverse diagonal blocks.
    fn metric(&self) -> u64 {
        if self.mixed {
            let per_cell = Corotational::<D>::CELL_DATA as u64;
            let blocks = self.d * (self.d + 1) / 2 * self.nodes;
            return HALF * per_cell * self.cells + SINGLE * blocks;
        }
        self.cycle.matrices
    }

    /// Returns the size of a zero state and of the planes shared by slabs.
    fn metric_building(&self) -> u64 {
        let planes = (self.field as f64 * self.shared_planes) as u64;
        (self.d * self.field + self.d * self.d * planes) * SINGLE / DOUBLE
    }

    /// Returns the size of the intermediate vectors between two levels.
    fn transfer(&self) -> u64 {
        3 * self.d * self.field / 2 * SINGLE / DOUBLE
    }

    /// Returns the size of the couplings, the space for the right-hand side behind them, the
    /// right-hand side itself, and twice the moments of the cells of one slab per thread.
    fn equations(&self) -> u64 {
        let moments = (4 * 3u64.pow(D as u32 - 1) + (1 << D)).next_multiple_of(8) * DOUBLE;
        let moments = moments * self.slab_cells.min(self.n_cells);
        let matrix = (Self::outputs() - 1) * self.field;
        let assembled = if self.mixed {
            // In single precision, and the right-hand side.
            matrix * SINGLE / DOUBLE + self.field
        } else {
            matrix + 2 * self.field
        };
        assembled + 2 * self.threads * moments
    }

    /// Returns the largest of: the planes shared by the slabs of the normal equations; those of the
    /// gradients of the shapes processed at the same time; a damped step.
    fn temporary(&self, at_once: u64) -> u64 {
        if self.mixed {
            // The equations while they are assembled, or three vectors of a shape in double precision, with
            // the nodal fields of a second derivative.
            let second = (3 * self.d * at_once + self.d + 1) * self.field;
            return second.max(Self::outputs() * self.field);
        }
        let shared = |bytes: u64| (bytes as f64 * self.shared_planes) as u64;
        let equations = shared(Self::outputs() * self.field);
        let gradients = at_once * shared(self.d * self.field);
        let restraint = at_once * (self.d + 1) * self.field;
        equations.max(gradients).max(restraint)
    }

    /// Returns the number of nodal arrays of the normal equations.
    fn outputs() -> u64 {
        3u64.pow(D as u32).div_ceil(2) + 1
    }
}
