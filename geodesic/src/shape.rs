//! The input of a geodesic: the level sets of a shape's components, and its visibility.
//!
//! `m` level sets distinguish up to `2^m` phases of the plane, void among them; one motion deforms
//! all of them, and the matter is the union `{max_i u_i > 0}`.
//!
//! Sources: the lecture notes of Rumpf and Wirth, section 6 ("Geodesics in the context of
//! multi-component objects", "Geodesics in the presence of partial occlusion"); Chan and Vese, *A
//! Multiphase Level Set Framework for Image Segmentation* (2002).

use crate::error::GeodesicError;
use crate::mismatch::Visibility;
use fe_grid::composition::Interpolant;
use fe_grid::{Grid, ScalarField, mutant};
use levelset::is_mask;

/// Visibility of a shape.
#[derive(Clone, Debug, Default)]
pub enum Known<const D: usize> {
    /// Visible everywhere.
    #[default]
    Everywhere,
    /// Visible where there is matter: parts of the shape may be hidden anywhere. The visible part
    /// has to be covered, and a surplus does not count as a mismatch.
    ///
    /// The notes multiply the mismatch by a smooth indicator of a thinned shape, which leaves the
    /// volume of `O \\ phi^-1(O')`. Here that volume is computed directly, as
    /// `int max(0, H(u) - H(u' o phi))^2`: a weight with the long tails of the arctangent still
    /// attracts hidden parts, and the boundary profile is not that of the shape where it is cut
    /// off.
    Inside,
    /// Visible where this weight is one, hidden where it is zero.
    Within(ScalarField<f64, D>),
}

/// A shape of one or several components.
#[derive(Clone, Debug)]
pub struct Shape<const D: usize> {
    components: Vec<ScalarField<f64, D>>,
    known: Known<D>,
}

impl<const D: usize> Shape<D> {
    /// Creates a shape from the signed distance to its boundary, positive inside.
    pub fn new(distance: ScalarField<f64, D>) -> Self {
        Self {
            components: vec![distance],
            known: Known::Everywhere,
        }
    }

    /// Creates a shape from components that may touch or overlap, given by one signed distance
    /// each.
    ///
    /// # Errors
    /// [`GeodesicError::Components`] for an empty list; [`GeodesicError::GridsDiffer`].
    pub fn of_components(distances: Vec<ScalarField<f64, D>>) -> Result<Self, GeodesicError> {
        let Some(first) = distances.first() else {
            return Err(GeodesicError::Components { start: 0, end: 0 });
        };
        if distances.iter().any(|u| u.grid() != first.grid()) {
            return Err(GeodesicError::GridsDiffer);
        }
        Ok(Self {
            components: distances,
            known: Known::Everywhere,
        })
    }

    /// Sets the visibility of the shape.
    pub fn with_known(mut self, known: Known<D>) -> Self {
        self.known = known;
        self
    }

    /// Returns the level sets of the components.
    pub fn components(&self) -> &[ScalarField<f64, D>] {
        &self.components
    }

    /// Returns whether a part of the shape may be hidden.
    pub fn hidden(&self) -> bool {
        !matches!(self.known, Known::Everywhere)
    }

    /// Returns the visibility of the shape.
    pub fn known(&self) -> &Known<D> {
        &self.known
    }

    /// Returns the grid of the level sets.
    pub fn grid(&self) -> &Grid<D> {
        self.components[0].grid()
    }

    /// Computes the level set of the union: the maximum of those of the components.
    pub fn union(&self) -> ScalarField<f64, D> {
        union_of(&self.components)
    }

    /// Checks that all components have an inside and an outside, and the visibility.
    ///
    /// # Errors
    /// [`GeodesicError`], with which end of a path it is.
    pub(crate) fn check(&self, which: &'static str) -> Result<(), GeodesicError> {
        for component in self.components() {
            let values = component.as_slice();
            if let Some(node) = values.iter().position(|u| !u.is_finite()) {
                return Err(GeodesicError::NotFinite { which, node });
            }
            let inside = values.iter().filter(|&&u| u > 0.0).count();
            if inside == 0 || inside == values.len() {
                let what = if inside == 0 { "empty" } else { "full" };
                return Err(GeodesicError::Degenerate { which, what });
            }
            if is_mask(component) {
                return Err(GeodesicError::Mask { which });
            }
        }
        if let Known::Within(weight) = self.known() {
            let values = weight.as_slice();
            if let Some(node) = values.iter().position(|w| !(0.0..=1.0).contains(w)) {
                return Err(GeodesicError::Weight { which, node });
            }
            if weight.grid() != self.grid() {
                return Err(GeodesicError::GridsDiffer);
            }
        }
        Ok(())
    }

    /// Returns the shape at the nodes of a grid of the same box.
    pub(crate) fn on_grid(&self, grid: &Grid<D>) -> ShapeOnGrid<D> {
        let components: Vec<_> = self.components.iter().map(|u| u.on_grid(grid)).collect();
        let weight = match &self.known {
            Known::Within(weight) => Some(weight.on_grid(grid)),
            Known::Everywhere | Known::Inside => None,
        };
        ShapeOnGrid {
            components,
            weight,
            only_covered: matches!(self.known, Known::Inside),
        }
    }
}

/// A shape on the grid of a level.
#[derive(Clone, Debug)]
pub(crate) struct ShapeOnGrid<const D: usize> {
    pub components: Vec<ScalarField<f64, D>>,
    /// The visibility weight at the nodes; `None` if it is one everywhere.
    pub weight: Option<ScalarField<f64, D>>,
    /// Whether the shape only has to be covered.
    pub only_covered: bool,
}

impl<const D: usize> ShapeOnGrid<D> {
    /// Returns whether a part of the shape may be hidden.
    pub fn hidden(&self) -> bool {
        self.only_covered || self.weight.is_some()
    }

    /// Returns the shape as if no part of it were hidden.
    pub fn taken_for_whole(&self) -> Self {
        Self {
            components: self.components.clone(),
            weight: None,
            only_covered: false,
        }
    }

    /// Returns the weight for measuring the overlap with another shape.
    pub fn visibility(&self) -> Option<ScalarField<f64, D>> {
        if !self.only_covered {
            return self.weight.clone();
        }
        let mut inside = union_of(&self.components);
        for u in inside.as_mut_slice() {
            *u = f64::from(u8::from(*u > 0.0));
        }
        Some(inside)
    }
}

/// Checks that a path with so many mismatches has one that says something. Where both shapes only have
/// to be covered, every difference between them may be a hidden part: the shape between two mismatches
/// covers both, but a single mismatch does not count at all.
///
/// # Errors
/// [`GeodesicError::BothHidden`].
pub(crate) fn check_known<const D: usize>(
    start: &Shape<D>,
    end: &Shape<D>,
    mismatches: usize,
) -> Result<(), GeodesicError> {
    let covered = [start, end].map(|shape| matches!(shape.known, Known::Inside));
    if mismatches < 2 && covered == [true; 2] {
        return Err(GeodesicError::BothHidden);
    }
    Ok(())
}

/// Returns the interpolant of a field, if there is one.
fn interpolated<const D: usize>(
    field: Option<&ScalarField<f64, D>>,
) -> Option<Interpolant<'_, f64, D>> {
    let field = field?;
    Some(Interpolant::new(*field.grid(), field.as_slice()))
}

/// The visibility of both ends of a path on a level.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownEnds<const D: usize> {
    start: Option<ScalarField<f64, D>>,
    end: Option<ScalarField<f64, D>>,
    /// Whether start and end only have to be covered.
    only_covered: [bool; 2],
}

impl<const D: usize> KnownEnds<D> {
    /// Collects the visibility of two shapes.
    pub fn new(start: &ShapeOnGrid<D>, end: &ShapeOnGrid<D>) -> Self {
        Self {
            start: start.weight.clone(),
            end: end.weight.clone(),
            only_covered: [start.only_covered, end.only_covered],
        }
    }

    /// Returns the visibility in step `k` of the given number of steps.
    pub fn in_step(&self, k: usize, steps: usize) -> Visibility<'_, D> {
        let sides = match (
            k == 1 && self.only_covered[0],
            k == steps && self.only_covered[1],
        ) {
            (true, false) => [1.0, 0.0],
            (false, true) => [0.0, 1.0],
            // A single step does not have both: `check_known` refuses it.
            _ => [1.0, 1.0],
        };
        Visibility {
            sides,
            start: (k == 1)
                .then(|| interpolated(self.start.as_ref()))
                .flatten(),
            end: (k == steps)
                .then(|| interpolated(self.end.as_ref()))
                .flatten(),
        }
    }
}

/// Returns the pointwise maximum of several level sets.
pub(crate) fn union_of<const D: usize>(components: &[ScalarField<f64, D>]) -> ScalarField<f64, D> {
    let mut union = components[0].clone();
    for other in &components[1..mutant!(components.len(), UnionFirst => 1)] {
        for (u, v) in union.as_mut_slice().iter_mut().zip(other.as_slice()) {
            *u = u.max(*v);
        }
    }
    union
}
