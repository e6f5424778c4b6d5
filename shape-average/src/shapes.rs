//! The input of an average: the signed distances of shapes, of one or of several components each.
//!
//! Components correspond to each other by their order: component `c` of every shape is deformed onto
//! component `c` of the average. One deformation of a shape moves all of its components, and the matter
//! that resists is their union (lecture notes of Rumpf and Wirth, "Geodesics in the context of
//! multi-component objects").

use crate::error::AverageError;
use fe_grid::{Field, Grid};
use levelset::is_mask;

/// Shapes given by signed distances (positive inside) on one grid.
#[derive(Clone, Copy, Debug)]
pub struct Shapes<'a, const D: usize> {
    whole: &'a [Field<f64, D, 1>],
    components: &'a [Field<f64, D, 1>],
    n_components: usize,
}

impl<'a, const D: usize> Shapes<'a, D> {
    /// Shapes of one component.
    pub fn new(signed_distances: &'a [Field<f64, D, 1>]) -> Self {
        Self {
            whole: signed_distances,
            components: signed_distances,
            n_components: 1,
        }
    }

    /// Shapes of several components, which may touch or overlap: the signed distances to the boundaries
    /// of their unions, one a shape, and those to the boundaries of the components, all of the first shape
    /// before those of the second.
    ///
    /// The unions are inputs of their own because the greatest of the components' distances is zero
    /// wherever two components touch: matter of that weight would have a soft joint there.
    ///
    /// # Errors
    /// [`AverageError::Components`] where the number of signed distances is not that of the shapes times
    /// that of their components, of which there must be at least one.
    pub fn of_components(
        unions: &'a [Field<f64, D, 1>],
        components: &'a [Field<f64, D, 1>],
        n_components: usize,
    ) -> Result<Self, AverageError> {
        if n_components == 0 || components.len() != unions.len() * n_components {
            return Err(AverageError::Components {
                shapes: unions.len(),
                components: n_components,
                found: components.len(),
            });
        }
        Ok(Self {
            whole: unions,
            components,
            n_components,
        })
    }

    /// Returns the number of shapes.
    pub fn len(&self) -> usize {
        self.whole.len()
    }

    /// Returns whether there are no shapes.
    pub fn is_empty(&self) -> bool {
        self.whole.is_empty()
    }

    /// Returns the number of components of a shape.
    pub fn n_components(&self) -> usize {
        self.n_components
    }

    /// Returns the signed distances of the whole shapes.
    pub fn whole(&self) -> &'a [Field<f64, D, 1>] {
        self.whole
    }

    /// Returns the signed distances of the components of a shape.
    ///
    /// # Panics
    /// If there is no such shape.
    pub fn components_of(&self, shape: usize) -> &'a [Field<f64, D, 1>] {
        &self.components[shape * self.n_components..(shape + 1) * self.n_components]
    }

    /// Returns the signed distances of the components that are not the whole shape: none where there is
    /// one component.
    pub(crate) fn parts_of(&self, shape: usize) -> &'a [Field<f64, D, 1>] {
        if self.n_components > 1 {
            self.components_of(shape)
        } else {
            &[]
        }
    }

    /// Checks that the fields lie on the grid of the first one, that they are finite, and that every
    /// component has an inside and an outside; returns the grid.
    pub(crate) fn check(&self) -> Result<Grid<D>, AverageError> {
        let first = self.whole.first().ok_or(AverageError::NoShapes)?;
        for index in 0..self.len() {
            for field in self.whole[index..=index].iter().chain(self.parts_of(index)) {
                if field.grid() != first.grid() {
                    return Err(AverageError::GridsDiffer { index });
                }
                if let Some(node) = field.as_slice().iter().position(|u| !u.is_finite()) {
                    return Err(AverageError::NotFinite { index, node });
                }
                let inside = field.as_slice().iter().filter(|&&u| u > 0.0).count();
                if inside == 0 || inside == field.as_slice().len() {
                    let what = if inside == 0 { "empty" } else { "full" };
                    return Err(AverageError::Degenerate { index, what });
                }
                if is_mask(field) {
                    return Err(AverageError::Mask { index });
                }
            }
        }
        Ok(*first.grid())
    }

    /// The shapes with these numbers, each field changed.
    pub(crate) fn select(
        &self,
        shapes: impl IntoIterator<Item = usize>,
        change: impl Fn(&Field<f64, D, 1>) -> Field<f64, D, 1>,
    ) -> OwnShapes<D> {
        let mut own = OwnShapes {
            whole: Vec::new(),
            parts: Vec::new(),
            n_components: self.n_components,
        };
        for i in shapes {
            own.whole.push(change(&self.whole[i]));
            own.parts.extend(self.parts_of(i).iter().map(&change));
        }
        own
    }
}

/// Shapes that own their fields.
#[derive(Clone, Debug)]
pub(crate) struct OwnShapes<const D: usize> {
    whole: Vec<Field<f64, D, 1>>,
    /// The components; none where there is one, which is the whole.
    parts: Vec<Field<f64, D, 1>>,
    n_components: usize,
}

impl<const D: usize> OwnShapes<D> {
    /// The shapes as an input.
    pub fn as_shapes(&self) -> Shapes<'_, D> {
        let components = if self.n_components > 1 {
            &self.parts
        } else {
            &self.whole
        };
        Shapes {
            whole: &self.whole,
            components,
            n_components: self.n_components,
        }
    }

    /// Changes every field.
    pub fn change(&mut self, change: impl Fn(&Field<f64, D, 1>) -> Field<f64, D, 1>) {
        for field in self.whole.iter_mut().chain(&mut self.parts) {
            *field = change(field);
        }
    }
}
