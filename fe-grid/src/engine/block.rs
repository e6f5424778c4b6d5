//! A block of neighbouring cells of a row, one a lane, with all that is read in them.

use super::element::{MAX_CORNERS, differences, interpolate, point_coordinate};
use super::rows::{Row, first_cell, gather, iota};
use super::{Data, Jet, MAX_CELL_DATA, MAX_COEFFICIENTS, Point, Reads};
use crate::{Element, Grid, Lane};

/// Values and gradients of a nodal field of `M` components at the quadrature points of a block.
#[derive(Clone, Copy)]
pub(crate) struct Evaluated<L, const D: usize, const M: usize> {
    value: [[L; MAX_CORNERS]; M],
    gradient: [[[L; MAX_CORNERS]; D]; M],
}

impl<L: Lane, const D: usize, const M: usize> Evaluated<L, D, M> {
    /// Gathers and evaluates what a formula reads of a field, from cell `i` of a row on.
    #[inline(always)]
    pub fn read<R: Reads, T: Element>(grid: &Grid<D>, field: &[T], row: Row, i: usize) -> Self
    where
        L: Lane<Element = T>,
    {
        let n = grid.n_nodes();
        let inverse_h = L::splat(1.0 / grid.spacing());
        let zero = [L::zero(); MAX_CORNERS];
        let mut at = Self {
            value: [zero; M],
            gradient: [[zero; D]; M],
        };
        for m in 0..M {
            let mut corners = gather::<T, L, D>(grid, &field[m * n..(m + 1) * n], row, i);
            if R::USES_GRADIENT {
                for k in 0..D {
                    at.gradient[m][k] = differences::<L, D>(&corners, k, R::POINT_OFFSET);
                    for g in &mut at.gradient[m][k] {
                        *g *= inverse_h;
                    }
                }
            }
            if R::USES_VALUE {
                interpolate::<L, D>(&mut corners, R::POINT_OFFSET);
                at.value[m] = corners;
            }
        }
        at
    }

    /// Value and gradient at quadrature point `q`.
    #[inline(always)]
    pub fn jet(&self, q: usize) -> Jet<L, D, M> {
        let mut jet = Jet::zero();
        for m in 0..M {
            jet.value[m] = self.value[m][q];
            for k in 0..D {
                jet.gradient[m][k] = self.gradient[m][k][q & !(1 << k)];
            }
        }
        jet
    }
}

/// The unknown and the data of a block.
pub(crate) struct Block<L, const D: usize, const M: usize> {
    state: Evaluated<L, D, M>,
    coefficient: [[L; MAX_CORNERS]; MAX_COEFFICIENTS],
    cell: [L; MAX_CELL_DATA],
    first_x: L,
    row: Row,
    spacing: f64,
    offset: f64,
}

impl<L: Lane, const D: usize, const M: usize> Block<L, D, M> {
    /// Gathers and evaluates what a formula reads, from cell `i` of a row on.
    #[inline(always)]
    pub fn read<R: Reads, T: Element>(
        grid: &Grid<D>,
        state: &[T],
        data: &Data<'_, T>,
        row: Row,
        i: usize,
    ) -> Self
    where
        L: Lane<Element = T>,
    {
        let length = grid.cells_per_axis()[0];
        let mut coefficient = [[L::zero(); MAX_CORNERS]; MAX_COEFFICIENTS];
        for f in 0..R::COEFFICIENTS {
            coefficient[f] = gather::<T, L, D>(grid, data.coefficients[f], row, i);
            interpolate::<L, D>(&mut coefficient[f], R::POINT_OFFSET);
        }
        let start = first_cell(grid, row);
        let mut cell = [L::zero(); MAX_CELL_DATA];
        for f in 0..R::CELL_DATA {
            cell[f] = L::load(&data.cells[f][start + i..start + length]);
        }
        Self {
            state: Evaluated::read::<R, T>(grid, state, row, i),
            coefficient,
            cell,
            first_x: iota::<L>() + L::splat(i as f64),
            row,
            spacing: grid.spacing(),
            offset: R::POINT_OFFSET,
        }
    }

    /// What a law sees at quadrature point `q`.
    #[inline(always)]
    pub fn point(&self, q: usize) -> Point<L, D, M> {
        let Jet { value, gradient } = self.state.jet(q);
        let mut position = [L::zero(); D];
        position[0] =
            (self.first_x + L::splat(point_coordinate(self.offset, q, 0))).scale(self.spacing);
        for k in 1..D {
            let cells = self.row[k - 1] as f64 + point_coordinate(self.offset, q, k);
            position[k] = L::splat(cells * self.spacing);
        }
        let mut coefficient = [L::zero(); MAX_COEFFICIENTS];
        for f in 0..MAX_COEFFICIENTS {
            coefficient[f] = self.coefficient[f][q];
        }
        Point {
            position,
            value,
            gradient,
            coefficient,
            cell: self.cell,
        }
    }
}
