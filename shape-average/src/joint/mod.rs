//! Simultaneous segmentation of images and averaging of their edges.
//!
//! Shapes are image morphologies: the object is the whole box, a shape the set of edges of an image
//! `u_i0`. The images `u_i`, their phase fields `v_i`, the deformations `phi_i` and the average
//! phase field `v` jointly minimise
//!
//! ```text
//! E = (1/n) sum_i ( int W(D phi_i) + gamma F[v o phi_i, v_i] + E_AT[u_i, v_i, u_i0] ) + mu_L L[v]
//! ```
//!
//! with the energy of Ambrosio and Tortorelli, [`phasefield::segmentation`]. A minimiser exists,
//! and its deformations are homeomorphisms, if the law satisfies the growth conditions of Theorem
//! 4.8 of the lecture notes. The images share information on their edges: an edge common to all
//! images costs a single image little, and an edge of one image alone costs more than in a separate
//! segmentation.
//!
//! # Method
//! On every level, coarsest first, each round consists of two halves: with the phase fields fixed,
//! some steps of the minimiser of averages for `(phi_i)`, with `v` eliminated; then for every image
//! the two linear systems of `v_i` and `u_i` (the mismatch is quadratic in `v_i`, too). Both halves
//! use the same quadrature points for the mismatch, so neither increases the energy. A level ends
//! when the energy no longer decreases.
//!
//! The two systems of an image converge to a minimum near their start, which may miss an edge that
//! is hidden by noise. They are therefore also solved from a second start, whose phase field is the
//! average composed with the deformation, and the pair of lower energy is chosen.
//!
//! # Given edges
//! With [`Edges::Separate`] and [`Edges::Given`] the phase fields are known and held, on every level with its own
//! interface width: those of separate segmentations, or `v_i = 1 - exp(-d_i / 2 eps)` at the distance `d_i` from
//! drawn edges. The energy is that of an average whose shapes are sets of edges, without the terms of the images:
//!
//! ```text
//! E = (1/n) sum_i ( int W(D phi_i) + gamma F[v o phi_i, v_i] ) + mu_L L[v]
//! ```
//!
//! # Weights
//! The mismatch vanishes where both phase fields are 0 and where both are 1. If the weight `nu` of
//! the edges is well below `gamma`, it dominates the energy of the phase fields, and the space
//! between nearby edges is filled; `nu` should therefore be at least `gamma`. With twice `gamma`,
//! dissimilar images keep their individual edges, and similar images still share information on
//! theirs.

mod density;
mod memory;
mod params;
mod result;
mod round;
mod solve;

pub use memory::memory_estimate;
pub use params::{Edges, JointParams};
pub use result::{JointEnergy, JointLevel, JointResult, spread};
pub use solve::{DRAWN_EDGE, joint_average, joint_average_distributed, joint_average_from};
