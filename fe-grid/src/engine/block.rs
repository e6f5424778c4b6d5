//! A block of neighbouring cells of a row, one a lane, with all that is read in them.

use super::element::{
    MAX_CORNERS, MAX_FACE_CORNERS, differences_into, face_corner, interpolate, point_coordinate,
};
use super::rows::{NodeRows, Row, first_cell, iota};
use super::{Data, Jet, MAX_CELL_DATA, MAX_COEFFICIENTS, Point, Reads};
use crate::grid::Grid;
use crate::half::Half;
use crate::kept::KeptSlice;
use crate::lane::{Element, Lane};

/// The derivatives of a field of `M` components at the quadrature points of a block: component, axis,
/// point. A derivative along an axis of a multilinear function is the same at the two points that
/// differ in that axis alone: only those of the lower face are stored, at the places of
/// [`face_corner`].
pub type BlockGradients<L, const D: usize, const M: usize> = [[[L; MAX_FACE_CORNERS]; D]; M];

/// Values and gradients of a nodal field of `M` components at the quadrature points of a block.
///
/// It is made once and read into again and again: the arrays are too large to be handed around.
#[repr(C, align(64))]
pub struct Evaluated<L, const D: usize, const M: usize> {
    value: [[L; MAX_CORNERS]; M],
    gradient: BlockGradients<L, D, M>,
}

impl<L: Lane, const D: usize, const M: usize> Evaluated<L, D, M> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self {
            value: [[L::zero(); MAX_CORNERS]; M],
            gradient: [[[L::zero(); MAX_FACE_CORNERS]; D]; M],
        }
    }

    /// Gathers and evaluates what a formula reads of a field, from cell `i` of a row on.
    #[inline(always)]
    pub(crate) fn read<R: Reads, T: Element>(
        &mut self,
        components: &[NodeRows<'_, T>; M],
        i: usize,
        inverse_h: f64,
    ) where
        L: Lane<Element = T>,
    {
        for m in 0..M {
            let mut corners = components[m].corners::<L, D>(i);
            if R::USES_GRADIENT {
                for k in 0..D {
                    let derivatives = &mut self.gradient[m][k];
                    let offset = R::POINT_OFFSET;
                    differences_into::<L, D>(&corners, k, inverse_h, offset, derivatives);
                }
            }
            if R::USES_VALUE {
                interpolate::<L, D>(&mut corners, 1.0, R::POINT_OFFSET);
                write_points::<L, D>(&corners, &mut self.value[m]);
            }
        }
    }

    /// The gradients at all points.
    #[inline(always)]
    pub fn gradients(&self) -> &BlockGradients<L, D, M> {
        &self.gradient
    }

    /// Value and gradient at quadrature point `q`.
    #[inline(always)]
    pub fn jet(&self, q: usize) -> Jet<L, D, M> {
        let mut jet = Jet::zero();
        for m in 0..M {
            jet.value[m] = self.value[m][q];
            for k in 0..D {
                jet.gradient[m][k] = self.gradient[m][k][face_corner(q, k)];
            }
        }
        jet
    }
}

/// Writes the values at the points of a cell; in two dimensions, half of the array is idle.
#[inline(always)]
fn write_points<L: Lane, const D: usize>(values: &[L; MAX_CORNERS], to: &mut [L; MAX_CORNERS]) {
    to[..1 << D].copy_from_slice(&values[..1 << D]);
}

/// Derivatives of a law's density with respect to value and gradient at the points of a block.
#[repr(C)]
pub struct BlockFluxes<L, const D: usize, const M: usize> {
    pub(super) values: [[L; MAX_CORNERS]; M],
    pub(super) gradients: BlockGradients<L, D, M>,
}

impl<L: Lane, const D: usize, const M: usize> BlockFluxes<L, D, M> {
    #[inline(always)]
    pub(super) fn zero() -> Self {
        Self {
            values: [[L::zero(); MAX_CORNERS]; M],
            gradients: [[[L::zero(); MAX_FACE_CORNERS]; D]; M],
        }
    }

    /// Sets the derivatives by the gradients to zero.
    #[inline(always)]
    pub(super) fn clear_gradients(&mut self) {
        for component in &mut self.gradients {
            for axis in component {
                for point in 0..1 << (D - 1) {
                    axis[point] = L::zero();
                }
            }
        }
    }

    /// Adds the derivative of a density that reads `R` at quadrature point `q`.
    #[inline(always)]
    pub fn add<R: Reads>(&mut self, q: usize, flux: &Jet<L, D, M>) {
        for m in 0..M {
            if R::USES_VALUE {
                self.values[m][q] = flux.value[m];
            }
            if R::USES_GRADIENT {
                for k in 0..D {
                    self.gradients[m][k][face_corner(q, k)] += flux.gradient[m][k];
                }
            }
        }
    }

    /// The derivatives by the gradients, to which a law adds those of all points.
    #[inline(always)]
    pub fn gradients_mut(&mut self) -> &mut BlockGradients<L, D, M> {
        &mut self.gradients
    }
}

/// The nodes around a row of cells, of every component of a field.
#[inline(always)]
pub(crate) fn component_rows<'a, T: Element, const D: usize, const M: usize>(
    grid: &Grid<D>,
    field: &'a [T],
    row: Row,
) -> [NodeRows<'a, T>; M] {
    let n = grid.n_nodes();
    std::array::from_fn(|m| NodeRows::new(grid, &field[m * n..(m + 1) * n], row))
}

/// All that a formula reads in a row of cells.
pub(crate) struct RowData<'a, T, const D: usize, const M: usize> {
    state: [NodeRows<'a, T>; M],
    coefficients: [NodeRows<'a, T>; MAX_COEFFICIENTS],
    cells: [KeptSlice<'a, T>; MAX_CELL_DATA],
    row: Row,
}

impl<'a, T: Element, const D: usize, const M: usize> RowData<'a, T, D, M> {
    #[inline(always)]
    pub fn new<R: Reads>(grid: &Grid<D>, state: &'a [T], data: &Data<'a, T>, row: Row) -> Self {
        let mut coefficients = [NodeRows::none(); MAX_COEFFICIENTS];
        for f in 0..R::COEFFICIENTS {
            coefficients[f] = NodeRows::new(grid, data.coefficients[f], row);
        }
        let (start, length) = (first_cell(grid, row), grid.cells_per_axis()[0]);
        let mut cells = [KeptSlice::Whole(&[][..]); MAX_CELL_DATA];
        for (f, numbers) in data.cells.iter().enumerate().take(R::CELL_DATA) {
            cells[f] = KeptSlice::Whole(&numbers[start..start + length]);
        }
        Self {
            state: component_rows(grid, state, row),
            coefficients,
            cells,
            row,
        }
    }

    /// Reads the data of the cells from halves.
    #[inline(always)]
    pub fn with_halves(mut self, grid: &Grid<D>, halves: &'a [&'a [Half]]) -> Self {
        let (start, length) = (first_cell(grid, self.row), grid.cells_per_axis()[0]);
        for (cells, halves) in self.cells.iter_mut().zip(halves) {
            *cells = KeptSlice::Halves(&halves[start..start + length]);
        }
        self
    }
}

/// The unknown and the data of a block. The order of the fields keeps registers within cache lines.
#[repr(C, align(64))]
pub struct Block<L, const D: usize, const M: usize> {
    state: Evaluated<L, D, M>,
    coefficient: [[L; MAX_CORNERS]; MAX_COEFFICIENTS],
    cell: [L; MAX_CELL_DATA],
    first: f64,
    row: Row,
    spacing: f64,
    inverse_spacing: f64,
    offset: f64,
}

impl<L: Lane, const D: usize, const M: usize> Block<L, D, M> {
    /// A block of a grid, filled with zeros.
    #[inline(always)]
    pub(crate) fn zero<R: Reads>(grid: &Grid<D>) -> Self {
        Self {
            state: Evaluated::zero(),
            coefficient: [[L::zero(); MAX_CORNERS]; MAX_COEFFICIENTS],
            cell: [L::zero(); MAX_CELL_DATA],
            first: 0.0,
            row: [0, 0],
            spacing: grid.spacing(),
            inverse_spacing: 1.0 / grid.spacing(),
            offset: R::POINT_OFFSET,
        }
    }

    /// Gathers and evaluates what a formula reads, from cell `i` of a row on.
    #[inline(always)]
    pub(crate) fn read<R: Reads, T: Element>(&mut self, data: &RowData<'_, T, D, M>, i: usize)
    where
        L: Lane<Element = T>,
    {
        for f in 0..R::COEFFICIENTS {
            let mut corners = data.coefficients[f].corners::<L, D>(i);
            interpolate::<L, D>(&mut corners, 1.0, R::POINT_OFFSET);
            write_points::<L, D>(&corners, &mut self.coefficient[f]);
        }
        for f in 0..R::CELL_DATA {
            self.cell[f] = data.cells[f].load_from(i);
        }
        self.state
            .read::<R, T>(&data.state, i, self.inverse_spacing);
        self.first = i as f64;
        self.row = data.row;
    }

    /// The unknown at the points.
    #[inline(always)]
    pub fn state(&self) -> &Evaluated<L, D, M> {
        &self.state
    }

    /// A nodal coefficient field at the points.
    #[inline(always)]
    pub fn coefficient(&self, field: usize) -> &[L; MAX_CORNERS] {
        &self.coefficient[field]
    }

    /// Returns the point data of a law at quadrature point `q`.
    #[inline(always)]
    pub fn point(&self, q: usize) -> Point<L, D, M> {
        let Jet { value, gradient } = self.state.jet(q);
        let mut coefficient = [L::zero(); MAX_COEFFICIENTS];
        for f in 0..MAX_COEFFICIENTS {
            coefficient[f] = self.coefficient[f][q];
        }
        Point {
            position: self.position(q),
            value,
            gradient,
            coefficient,
            cell: self.cell,
        }
    }

    #[inline(always)]
    fn position(&self, q: usize) -> [L; D] {
        let mut position = [L::zero(); D];
        let first = iota::<L>() + L::splat(self.first);
        position[0] = (first + L::splat(point_coordinate(self.offset, q, 0))).scale(self.spacing);
        for k in 1..D {
            let cells = self.row[k - 1] as f64 + point_coordinate(self.offset, q, k);
            position[k] = L::splat(cells * self.spacing);
        }
        position
    }
}
