//! A shape of a family.

use crate::implicit::Implicit;

/// A shape of a family and its name.
pub struct Member<const D: usize> {
    /// File name without extension.
    pub name: String,
    /// The shape about the origin.
    pub shape: Box<dyn Implicit<D>>,
    /// Its labelled parts, the first with the label one; none for a shape of one part.
    pub parts: Vec<Box<dyn Implicit<D>>>,
}
