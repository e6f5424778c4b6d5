//! Compositions `V o Phi` of a nodal field with a deformation, exact at quadrature points.
//!
//! A deformation is stored as its displacement `u`, `Phi(x) = x + u(x)`. At a quadrature point
//! the position `x_q + u(x_q)` is found and `V` is evaluated there by its own multilinear
//! interpolation, with no nodal interpolation in between. Positions outside the box take the
//! value at its nearest point; the derivative across the face is then zero.
//!
//! Both adjoints exist: with respect to the deformation through [`Matching`] (a [`CellLaw`],
//! whose gradient scatters `f' (grad V) o Phi`), with respect to `V` through
//! [`crate::scatter`] (which scatters the shape functions at the deformed points). A model of the
//! second derivatives in both arguments is that of [`SmoothMatching`] and of [`crate::coupling`].

use crate::engine::element::{MAX_CORNERS, multilinear};
use crate::engine::{CellLaw, Jet, MAX_COEFFICIENTS, Point, Reads};
use crate::grid::Grid;
use crate::lane::{Element, Lane, MAX_LANES};

/// Extension of a nodal field outside the box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outside {
    /// Constant extension by the value at the nearest point of the box.
    #[default]
    Constant,
    /// That value minus the distance to the box, as for a signed distance that is positive inside
    /// an object in the box: the gradient points back towards the box.
    Falling,
}

/// A nodal field to be evaluated at arbitrary points.
#[derive(Clone, Copy)]
pub struct Interpolant<'a, T, const D: usize> {
    grid: Grid<D>,
    field: &'a [T],
    outside: Outside,
}

/// Where points lie in a grid: cells and coordinates in them, one point a lane.
pub(crate) struct Location<L, const D: usize> {
    /// Index of the cell along each axis, as a number.
    pub cell: [L; D],
    /// Coordinates in the cell, in `[0, 1]`.
    pub local: [L; D],
    /// One where the point is inside the box along an axis, zero where it was moved to a face.
    pub inside: [L; D],
}

/// Finds the cells that hold points; points outside are moved to the nearest point of the box.
#[inline(always)]
pub(crate) fn locate_lanes<L: Lane, const D: usize>(
    grid: &Grid<D>,
    position: &[L; D],
) -> Location<L, D> {
    let cells = grid.cells_per_axis();
    let inverse_h = L::splat(1.0 / grid.spacing());
    let mut at = Location {
        cell: *position,
        local: *position,
        inside: *position,
    };
    for k in 0..D {
        let s = position[k] * inverse_h;
        let (low, high) = (L::zero(), L::splat(cells[k] as f64));
        let above = L::select(s.less(low), L::zero(), L::one());
        at.inside[k] = L::select(high.less(s), L::zero(), above);
        // The order of the operands sends NaN to a number: no index leaves the field.
        let s = s.max(low).min(high);
        at.cell[k] = s.floor().min(L::splat((cells[k] - 1) as f64));
        at.local[k] = s - at.cell[k];
    }
    at
}

impl<'a, T: Element, const D: usize> Interpolant<'a, T, D> {
    /// Binds a nodal field to its grid.
    ///
    /// # Panics
    /// If the field has another length than the grid has nodes.
    pub fn new(grid: Grid<D>, field: &'a [T]) -> Self {
        assert_eq!(field.len(), grid.n_nodes());
        Self {
            grid,
            field,
            outside: Outside::Constant,
        }
    }

    /// The same field with another continuation outside the box.
    pub fn with_outside(mut self, outside: Outside) -> Self {
        self.outside = outside;
        self
    }

    /// Value and gradient at one point a lane.
    #[inline(always)]
    pub fn sample<L: Lane>(&self, position: &[L; D]) -> (L, [L; D]) {
        let at = locate_lanes(&self.grid, position);
        let (value, slope) = multilinear(self.gather(&at.cell), &at.local);
        let inverse_h = L::splat(1.0 / self.grid.spacing());
        let mut gradient = [L::zero(); D];
        for k in 0..D {
            gradient[k] = slope[k] * inverse_h * at.inside[k];
        }
        if self.outside == Outside::Constant {
            return (value, gradient);
        }
        let h = L::splat(self.grid.spacing());
        let mut offset = [L::zero(); D];
        let mut squared = L::zero();
        for k in 0..D {
            offset[k] = position[k] - (at.cell[k] + at.local[k]) * h;
            offset[k] = L::select(L::zero().less(at.inside[k]), L::zero(), offset[k]);
            squared = offset[k].mul_add(offset[k], squared);
        }
        let distance = squared.sqrt();
        let inverse = L::one() / distance.max(L::splat(f64::from(f32::MIN_POSITIVE)));
        for k in 0..D {
            gradient[k] -= offset[k] * inverse;
        }
        (value - distance, gradient)
    }

    /// Value at points that were located on the same grid.
    #[inline(always)]
    pub(crate) fn value_at<L: Lane>(&self, at: &Location<L, D>) -> L {
        multilinear(self.gather(&at.cell), &at.local).0
    }

    #[inline(always)]
    fn gather<L: Lane>(&self, cell: &[L; D]) -> [L; MAX_CORNERS] {
        let strides = self.grid.strides();
        let mut base = [0usize; MAX_LANES];
        for k in 0..D {
            let mut index = [L::Element::default(); MAX_LANES];
            cell[k].store(&mut index);
            for l in 0..L::COUNT {
                base[l] += index[l].to_f64() as usize * strides[k];
            }
        }
        let mut corners = [L::zero(); MAX_CORNERS];
        for c in 0..1usize << D {
            let corner = mutant!(c, CompositionCorners => (c >> 1 | c << 1) & ((1 << D) - 1));
            let offset: usize = (0..D).map(|k| (corner >> k & 1) * strides[k]).sum();
            let mut values = [L::Element::default(); MAX_LANES];
            for l in 0..L::COUNT {
                values[l] = L::Element::from_f64(self.field[base[l] + offset].to_f64());
            }
            corners[c] = L::load(&values);
        }
        corners
    }
}

/// A pointwise density `f(s; c)` of a composed value `s = V(Phi(x))` and of coefficients at `x`.
pub trait MatchDensity: Sync {
    /// Number of nodal coefficient fields read.
    const COEFFICIENTS: usize;
    /// `f`.
    fn value<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> L;
    /// `f`, `f'` and a curvature that is not negative: `f''`, or its positive part.
    fn derivatives<L: Lane>(&self, s: L, coefficient: &[L; MAX_COEFFICIENTS]) -> (L, L, L);
}

/// The energy of a composition, `sum_q w f(V(x_q + u(x_q)); c(x_q))`, as a law for the
/// displacement `u`.
///
/// Its Hessian action is that of Gauss and Newton, `f'' (grad V . d) grad V`: the term with the
/// second derivatives of `V`, which is not definite, is left out.
#[derive(Clone, Copy)]
pub struct Matching<'a, F, T, const D: usize> {
    density: F,
    field: Interpolant<'a, T, D>,
}

impl<'a, F, T: Element, const D: usize> Matching<'a, F, T, D> {
    /// The composition of a field with the deformation, under a density.
    pub fn new(density: F, field: Interpolant<'a, T, D>) -> Self {
        Self { density, field }
    }

    #[inline(always)]
    fn sample<L: Lane>(&self, point: &Point<L, D, D>) -> (L, [L; D]) {
        self.field.sample(&point.deformed_position())
    }
}

impl<F: MatchDensity, T: Element, const D: usize> Reads for Matching<'_, F, T, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = F::COEFFICIENTS;
    const CELL_DATA: usize = 0;
}

impl<F: MatchDensity, T: Element, const D: usize> CellLaw<D, D> for Matching<'_, F, T, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.density.value(self.sample(point).0, &point.coefficient)
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let (s, slope) = self.sample(point);
        let (value, derivative, _) = self.density.derivatives(s, &point.coefficient);
        let derivative = mutant!(derivative, CompositionSlope => derivative.scale(0.5));
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = derivative * slope[k];
        }
        (value, jet)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let (s, slope) = self.sample(point);
        let (_, _, curvature) = self.density.derivatives(s, &point.coefficient);
        let mut along = slope[0] * direction.value[0];
        for k in 1..D {
            along = slope[k].mul_add(direction.value[k], along);
        }
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = curvature * along * slope[k];
        }
        jet
    }
}

/// Computes the gradient of a nodal field at the nodes, component by component: by central
/// differences, one-sided on the faces of the box.
pub fn nodal_gradient<const D: usize>(grid: &Grid<D>, field: &[f64]) -> Vec<f64> {
    let (n, strides, nodes) = (grid.n_nodes(), grid.strides(), grid.nodes_per_axis());
    assert_eq!(field.len(), n);
    let mut gradient = vec![0.0; D * n];
    crate::parallel::for_each_chunk(&mut gradient, nodes[0], 64, &|line, out| {
        let first = line * nodes[0];
        let (k, start) = (first / n, first % n);
        for (i, slope) in out.iter_mut().enumerate() {
            let node = start + i;
            let place = grid.node(node)[k];
            let low = node - if place == 0 { 0 } else { strides[k] };
            let high = node + if place + 1 == nodes[k] { 0 } else { strides[k] };
            let width = ((high - low) / strides[k]) as f64 * grid.spacing();
            *slope = (field[high] - field[low]) / width;
        }
    });
    gradient
}

/// A model of the second derivatives of a composition's energy in the deformation and in the field:
/// Gauss and Newton's, with the gradient of `V` replaced by the interpolation `G` of its nodal
/// gradient ([`nodal_gradient`]).
///
/// As a law it is [`Matching`], except for its Hessian action: in a direction `d` of the
/// displacement together with a change `Z` of the field that is `f'' (G . d + Z) G`, all of `G` and
/// `Z` at deformed points.
///
/// The gradient of the multilinear `V` jumps between cells, and the energy has a kink wherever a
/// quadrature point changes cell. Within a cell a motion that the field could follow looks stiff:
/// `grad V . d` is not continuous and hence no change of a nodal field. The kinks cancel this
/// stiffness over distances of a fraction of a cell. `G . d` is continuous, so that the model has
/// neither.
#[derive(Clone, Copy)]
pub struct SmoothMatching<'a, F, T, const D: usize> {
    matching: Matching<'a, F, T, D>,
    slopes: [Interpolant<'a, T, D>; D],
    change: Option<Interpolant<'a, T, D>>,
}

impl<'a, F, T: Element, const D: usize> SmoothMatching<'a, F, T, D> {
    /// The model for a field with its nodal gradient, component by component, and for no change of
    /// the field.
    ///
    /// # Panics
    /// If the gradient does not have `D` numbers a node.
    pub fn new(density: F, field: Interpolant<'a, T, D>, gradient: &'a [T]) -> Self {
        let (grid, n) = (field.grid, field.grid.n_nodes());
        assert_eq!(gradient.len(), D * n);
        Self {
            matching: Matching::new(density, field),
            slopes: std::array::from_fn(|k| Interpolant::new(grid, &gradient[k * n..(k + 1) * n])),
            change: None,
        }
    }

    /// The same with a change of the field.
    pub fn with_change(self, change: Interpolant<'a, T, D>) -> Self {
        Self {
            change: Some(change),
            ..self
        }
    }
}

impl<F: MatchDensity, T: Element, const D: usize> SmoothMatching<'_, F, T, D> {
    /// The slope `G` and the curvature `f''` at located points.
    #[inline(always)]
    pub(crate) fn model<L: Lane>(
        &self,
        at: &Location<L, D>,
        coefficient: &[L; MAX_COEFFICIENTS],
    ) -> ([L; D], L) {
        let s = self.matching.field.value_at(at);
        let (_, _, curvature) = self.matching.density.derivatives(s, coefficient);
        let mut slope = [L::zero(); D];
        for k in 0..D {
            slope[k] = self.slopes[k].value_at(at);
        }
        (slope, curvature)
    }
}

impl<F: MatchDensity, T: Element, const D: usize> Reads for SmoothMatching<'_, F, T, D> {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = F::COEFFICIENTS;
    const CELL_DATA: usize = 0;
}

impl<F: MatchDensity, T: Element, const D: usize> CellLaw<D, D> for SmoothMatching<'_, F, T, D> {
    #[inline(always)]
    fn value<L: Lane>(&self, point: &Point<L, D, D>) -> L {
        self.matching.value(point)
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, point: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        self.matching.gradient(point)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(
        &self,
        point: &Point<L, D, D>,
        direction: &Jet<L, D, D>,
    ) -> Jet<L, D, D> {
        let at = locate_lanes(&self.matching.field.grid, &point.deformed_position());
        let (slope, curvature) = self.model(&at, &point.coefficient);
        let mut along = match &self.change {
            Some(change) => change.value_at(&at),
            None => L::zero(),
        };
        for k in 0..D {
            along = slope[k].mul_add(direction.value[k], along);
        }
        let mut jet = Jet::zero();
        for k in 0..D {
            jet.value[k] = curvature * along * slope[k];
        }
        jet
    }
}
