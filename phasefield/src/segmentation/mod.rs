//! Segmentation of grey images: computes the edges of a picture or volume as a phase field, by the
//! approximation of Ambrosio and Tortorelli to the Mumford-Shah functional.
//!
//! For an image `u0` on a box, a smoothed image `u` and a phase field `v`, which is 0 on the edges
//! and 1 away from them, minimise
//!
//! ```text
//! E[u, v] = alpha int (u - u0)^2 + beta int (v^2 + k_eps) |grad u|^2
//!         + nu int eps |grad v|^2 + (v - 1)^2 / (4 eps).
//! ```
//!
//! Source: L. Ambrosio and V. M. Tortorelli, *Approximation of functionals depending on jumps by
//! elliptic functionals via Gamma-convergence*, Comm. Pure Appl. Math. 43 (1990).
//!
//! # Method
//! The energy is a quadratic form in `u` for fixed `v`, and in `v` for fixed `u`: two linear
//! systems are solved alternately ([`relax`]), each by conjugate gradients preconditioned with a
//! multigrid cycle. Every conjugate-gradient step decreases the quadratic form, so the energy never
//! increases, however accurately the systems are solved. From coarse grids to fine, the interface
//! width `eps` is the same number of grid spacings on every level, and the image on a coarse grid
//! is a local mean: noise is averaged out of the coarse images, and the edges found there are the
//! start on the finer levels.
//!
//! Each quadratic form has one minimum, the energy has many: in a smooth image a jump must be
//! higher to become an edge than to remain one. Therefore every level has a second start, obtained
//! with a quarter and a half of the cost of edges, and continues from the one with the lower
//! energy.
//!
//! # Parameters
//! The minimiser depends on the ratios of the weights only. They are determined by two meaningful
//! quantities ([`Weights::for_scales`]): in one dimension a jump of height `c` is an edge if
//! `c^2 sqrt(alpha beta) / 2 > nu`, and `u` is smooth over the length `l = sqrt(beta / alpha)`. At
//! finite width, and starting without edges, a jump `j` is detected if `j > c sqrt(l / (2 eps))`.
//! Noise of variance `s^2` is smoothed rather than classified as edges if `s^2 < l c^2 / (8 eps)`;
//! noisier images need a larger length or contrast.

mod alternation;
mod doubts;
mod energy;
mod memory;
mod params;
mod relax;
mod solve;
mod split;

pub use alternation::{Alternation, SegmentationObjective};
pub use energy::{AmbrosioTortorelli, SegmentationEnergy};
pub use memory::memory_estimate;
pub use params::{SegmentationParams, Weights};
pub use relax::{Part, Relaxation, relax};
pub use solve::{Segmentation, SegmentationLevel, coarser_image, segment};
pub use split::{Classes, split_classes};
