//! A shape as a geodesic takes it: the level sets of its components, and where it is known.
//!
//! `m` level sets tell up to `2^m` phases of the plane apart, void among them; one motion carries
//! all of them, and the matter is the union `{max_i u_i > 0}`.
//!
//! Sources: the lecture notes of Rumpf and Wirth, section 6 ("Geodesics in the context of
//! multi-component objects", "Geodesics in the presence of partial occlusion"); Chan and Vese, *A
//! Multiphase Level Set Framework for Image Segmentation* (2002).

use crate::error::GeodesicError;
use crate::matching::Visibility;
use fe_grid::composition::Interpolant;
use fe_grid::{Field, Grid, ScalarField};

/// Where a shape is known.
#[derive(Clone, Debug, Default)]
pub enum Known<const D: usize> {
    /// Everywhere.
    #[default]
    Everywhere,
    /// Where there is matter: parts of the shape may be hidden, anywhere. What is seen has to be
    /// covered, and no mismatch counts where there is more.
    ///
    /// The notes multiply the mismatch by a smooth indicator of the shape made thinner, so that
    /// what is left of it is the volume of `O \\ phi^-1(O')`. Here that volume is taken as it stands,
    /// `int max(0, H(u) - H(u' o phi))^2`: a weight with the long tails of the arctangent still draws
    /// hidden parts in, and the profile of the boundary where the shape is cut off is none of its own.
    Inside,
    /// Where this weight is one, not where it is zero.
    Within(ScalarField<f64, D>),
}

/// A shape of one or several components.
#[derive(Clone, Debug)]
pub struct Shape<const D: usize> {
    components: Vec<ScalarField<f64, D>>,
    known: Known<D>,
}

impl<const D: usize> Shape<D> {
    /// A shape given by the signed distance to its boundary, positive inside.
    pub fn new(distance: ScalarField<f64, D>) -> Self {
        Self {
            components: vec![distance],
            known: Known::Everywhere,
        }
    }

    /// A shape of components that may touch or overlap, given by a signed distance each.
    ///
    /// # Errors
    /// [`GeodesicError::Components`] for none; [`GeodesicError::GridsDiffer`].
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

    /// The same shape, known in part.
    pub fn with_known(mut self, known: Known<D>) -> Self {
        self.known = known;
        self
    }

    /// The level sets of the components.
    pub fn components(&self) -> &[ScalarField<f64, D>] {
        &self.components
    }

    /// Where the shape is known.
    pub fn known(&self) -> &Known<D> {
        &self.known
    }

    /// The grid of the level sets.
    pub fn grid(&self) -> &Grid<D> {
        self.components[0].grid()
    }

    /// The level set of all matter: the largest of those of the components.
    pub fn union(&self) -> ScalarField<f64, D> {
        union_of(&self.components)
    }

    /// The shape at the nodes of a grid of the same box.
    pub(crate) fn on_grid(&self, grid: &Grid<D>) -> ShapeOnGrid<D> {
        let components: Vec<_> = self.components.iter().map(|u| on_grid(grid, u)).collect();
        let weight = match &self.known {
            Known::Within(weight) => Some(on_grid(grid, weight)),
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
    /// The weight of a mismatch at the nodes, where it is not one everywhere.
    pub weight: Option<ScalarField<f64, D>>,
    /// Whether the shape only has to be covered.
    pub only_covered: bool,
}

impl<const D: usize> ShapeOnGrid<D> {
    /// The weight where the overlap with another shape is measured.
    pub fn seen(&self) -> Option<ScalarField<f64, D>> {
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

/// A field to be evaluated at arbitrary points, where there is one.
fn interpolated<const D: usize>(
    field: Option<&ScalarField<f64, D>>,
) -> Option<Interpolant<'_, f64, D>> {
    let field = field?;
    Some(Interpolant::new(*field.grid(), field.as_slice()))
}

/// Both ends of a path on a level, by what is known of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownEnds<const D: usize> {
    start: Option<ScalarField<f64, D>>,
    end: Option<ScalarField<f64, D>>,
    /// Whether start and end only have to be covered.
    only_covered: [bool; 2],
}

impl<const D: usize> KnownEnds<D> {
    /// What is known of two shapes.
    pub fn new(start: &ShapeOnGrid<D>, end: &ShapeOnGrid<D>) -> Self {
        Self {
            start: start.weight.clone(),
            end: end.weight.clone(),
            only_covered: [start.only_covered, end.only_covered],
        }
    }

    /// What is visible in step `k` of so many.
    pub fn in_step(&self, k: usize, steps: usize) -> Visibility<'_, D> {
        let sides = match (
            k == 1 && self.only_covered[0],
            k == steps && self.only_covered[1],
        ) {
            (true, false) => [1.0, 0.0],
            (false, true) => [0.0, 1.0],
            // Of two shapes that are hidden in part nothing can be told in one step.
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

/// A level set at the nodes of a grid of the same box.
pub(crate) fn on_grid<const D: usize>(
    grid: &Grid<D>,
    level_set: &Field<f64, D, 1>,
) -> Field<f64, D, 1> {
    if grid == level_set.grid() {
        return level_set.clone();
    }
    Field::from_fn(*grid, |x| level_set.sample(x))
}

/// The largest of several level sets, everywhere.
pub(crate) fn union_of<const D: usize>(components: &[ScalarField<f64, D>]) -> ScalarField<f64, D> {
    let mut union = components[0].clone();
    for other in &components[1..] {
        for (u, v) in union.as_mut_slice().iter_mut().zip(other.as_slice()) {
            *u = u.max(*v);
        }
    }
    union
}
