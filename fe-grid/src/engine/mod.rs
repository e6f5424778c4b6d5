//! The one cell engine: gather, evaluate, law, integrate, scatter.
//!
//! An energy is `sum over cells, sum over quadrature points of w f(u, Du; data)`, with a
//! pointwise density `f` that is all that varies: a [`CellLaw`]. [`Assembly`] gathers the nodal
//! values of a row of cells, evaluates `u` and `Du` at the `2^D` Gauss points of every cell by
//! sum factorisation, asks the law, and scatters the derivative back, the same way for the
//! elastic energy, for phase-field energies, for compositions and for linear operators (the
//! Hessian action of a quadratic law).
//!
//! Cells of a row stand side by side in the lanes; rows form slabs of a fixed thickness that
//! depends on the grid alone, and slabs go to threads. Energies and shared node planes are added
//! in one fixed order, so that results do not depend on the number of threads or on the
//! instruction set.

mod assembly;
pub(crate) mod block;
pub(crate) mod element;
pub(crate) mod kernel;
mod probe;
pub(crate) mod rows;
pub(crate) mod slabs;

pub use assembly::Assembly;
pub use block::{Block, BlockFluxes, BlockGradients, Evaluated};
pub use element::{CORNERS, GAUSS, MAX_CORNERS, MAX_FACE_CORNERS, face_corner};
pub use probe::probe_cells;

use crate::lane::{Element, Lane};

/// The most nodal coefficient fields that a law reads.
pub const MAX_COEFFICIENTS: usize = 4;
/// Maximal number of values per cell that a law reads.
pub const MAX_CELL_DATA: usize = 18;

/// Data of a law at a quadrature point; every lane holds another cell.
#[derive(Clone, Copy)]
pub struct Point<L, const D: usize, const M: usize> {
    /// Coordinates of the point in the undeformed box.
    pub position: [L; D],
    /// The unknown there; zero unless the law sets [`Reads::USES_VALUE`].
    pub value: [L; M],
    /// Its derivatives, `gradient[i][k]` of component `i` along axis `k`; zero unless the law
    /// sets [`Reads::USES_GRADIENT`].
    pub gradient: [[L; D]; M],
    /// Nodal coefficient fields, interpolated to the point.
    pub coefficient: [L; MAX_COEFFICIENTS],
    /// Data of the cell.
    pub cell: [L; MAX_CELL_DATA],
}

impl<L: Lane, const D: usize> Point<L, D, D> {
    /// The position under the displacement that the unknown is.
    #[inline(always)]
    pub fn deformed_position(&self) -> [L; D] {
        let mut deformed = self.position;
        for k in 0..D {
            deformed[k] += self.value[k];
        }
        deformed
    }
}

/// A pair of a value and a gradient: a direction, or the derivative of a density with respect to
/// the two.
#[derive(Clone, Copy)]
pub struct Jet<L, const D: usize, const M: usize> {
    /// Value part.
    pub value: [L; M],
    /// Gradient part, `gradient[i][k]` for component `i` and axis `k`.
    pub gradient: [[L; D]; M],
}

impl<L: Lane, const D: usize, const M: usize> Jet<L, D, M> {
    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            value: [L::zero(); M],
            gradient: [[L::zero(); D]; M],
        }
    }
}

/// The point data read by a formula; everything else is not evaluated.
pub trait Reads: Sync {
    /// Whether it depends on `u`.
    const USES_VALUE: bool;
    /// Whether it depends on `Du`.
    const USES_GRADIENT: bool;
    /// Number of nodal coefficient fields read.
    const COEFFICIENTS: usize;
    /// Number of data per cell read.
    const CELL_DATA: usize;
    /// Distance of the quadrature points from the faces of the cell, in units of the cell: the
    /// Gauss rule unless said otherwise, [`CORNERS`] for the trapezoid rule.
    const POINT_OFFSET: f64 = GAUSS;
}

/// A pointwise density `f(u, Du; x, coefficients, cell data)` for an unknown of `M` components.
///
/// All methods are `#[inline(always)]`, as is everything they call. A density that is not finite
/// marks the state as inadmissible.
pub trait CellLaw<const D: usize, const M: usize>: Reads + Sized {
    /// Whether the second derivative is the same all over a cell: a quadratic density whose
    /// coefficients are constants or cell data.
    const UNIFORM_HESSIAN: bool = false;

    /// The density.
    fn value<L: Lane>(&self, point: &Point<L, D, M>) -> L;

    /// The density and its derivative with respect to `(u, Du)`.
    fn gradient<L: Lane>(&self, point: &Point<L, D, M>) -> (L, Jet<L, D, M>);

    /// The second derivative applied to a direction.
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        direction: &Jet<L, D, M>,
    ) -> Jet<L, D, M>;

    /// The second derivative applied to several directions, one result for each.
    ///
    /// A law that enters a compiled routine overrides it, to enter it less often.
    #[inline(always)]
    fn hessian_actions<L: Lane>(
        &self,
        point: &Point<L, D, M>,
        directions: &[Jet<L, D, M>],
        changes: &mut [Jet<L, D, M>],
    ) {
        for (change, direction) in changes.iter_mut().zip(directions) {
            *change = self.hessian_action(point, direction);
        }
    }

    /// The sum of the densities at the quadrature points of a block.
    ///
    /// This and the next two go from point to point. A law that enters a compiled routine
    /// ([`crate::routine`]) overrides them, to enter it once a block.
    #[inline(always)]
    fn block_value<L: Lane>(&self, block: &Block<L, D, M>) -> L {
        let mut sum = L::zero();
        for q in 0..1usize << D {
            sum += self.value(&block.point(q));
        }
        sum
    }

    /// The sum of the densities of a block; their derivatives are added to `fluxes`.
    #[inline(always)]
    fn block_gradient<L: Lane>(
        &self,
        block: &Block<L, D, M>,
        fluxes: &mut BlockFluxes<L, D, M>,
    ) -> L {
        let mut sum = L::zero();
        for q in 0..1usize << D {
            let (value, flux) = self.gradient(&block.point(q));
            sum += value;
            fluxes.add::<Self>(q, &flux);
        }
        sum
    }

    /// The second derivative of a block applied to a direction is added to `fluxes`.
    #[inline(always)]
    fn block_hessian_action<L: Lane>(
        &self,
        block: &Block<L, D, M>,
        direction: &Evaluated<L, D, M>,
        fluxes: &mut BlockFluxes<L, D, M>,
    ) {
        for q in 0..1usize << D {
            let flux = self.hessian_action(&block.point(q), &direction.jet(q));
            fluxes.add::<Self>(q, &flux);
        }
    }
}

/// A pointwise formula whose mean over each cell is wanted.
pub trait CellProbe<const D: usize, const M: usize>: Reads {
    /// Numbers per cell.
    const OUTPUTS: usize;
    /// Evaluates the formula at a point; entries from [`CellProbe::OUTPUTS`] on are ignored.
    fn probe<L: Lane>(&self, point: &Point<L, D, M>) -> [L; MAX_CELL_DATA];
    /// Postprocesses the means over a cell.
    #[inline(always)]
    fn finish<L: Lane>(&self, means: [L; MAX_CELL_DATA]) -> [L; MAX_CELL_DATA] {
        means
    }
}

/// The fields that accompany the unknown: nodal coefficients and numbers per cell.
#[derive(Clone, Copy, Default)]
pub struct Data<'a, T: Element> {
    /// Nodal coefficient fields, one number a node each.
    pub coefficients: &'a [&'a [T]],
    /// Cell data, one number a cell each, cells in memory order.
    pub cells: &'a [&'a [T]],
}
