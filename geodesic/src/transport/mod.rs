//! A first deformation of one shape into another from the optimal transport of its volume.
//!
//! Minimisers follow the gradient of a mismatch, which is local: where a finger of one hand covers parts of two
//! fingers of the other one, it may become a part of both. A transport is global. It carries the uniform measure of
//! one shape to that of the other one at the least sum of squared distances, so that what is covered twice has to
//! go elsewhere, and every finger goes to one. It is neither continuous nor an elastic deformation, but it is in the
//! valley of one: [`along_transport`] follows it by a flow that does not fold, and is a start of a path.
//!
//! Both are computed on a coarse grid, whose nodes inside of the shapes are the points of the measures.

mod guided;
mod plan;

pub(crate) use guided::along_transport;
use plan::{Cloud, targets};
