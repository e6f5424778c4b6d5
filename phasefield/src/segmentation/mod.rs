//! Shapes in grey images: the edges of a picture or volume as a phase field, by the approximation
//! of Ambrosio and Tortorelli to the functional of Mumford and Shah.
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
//! systems are solved in turn ([`relax`]), each by conjugate gradients that a multigrid cycle
//! preconditions. Conjugate gradients lower a quadratic form from their first step on, so that the
//! energy never rises, however accurately the systems are solved. From coarse grids to fine, the
//! interface width `eps` is the same number of grid spacings on every level, and the image on a
//! coarse grid is the mean over what its nodes stand for: what is noise has left the coarse images,
//! and the edges found there tell the finer levels where to begin.
//!
//! Each quadratic form has one minimum, the energy has many: from a smooth image a jump has to be
//! higher to become an edge than to stay one. So every level has a second start, by way of edges that
//! cost a quarter and a half of what they should, and goes on from the one with the lower energy.
//!
//! # Parameters
//! Alone, the energy knows only the ratios of its weights. They are chosen by two numbers with a
//! meaning ([`Weights::for_scales`]): in one dimension a jump of height `c` is an edge where
//! `c^2 sqrt(alpha beta) / 2 > nu`, and `u` is smooth over the length `l = sqrt(beta / alpha)`. At a
//! finite width, and from no edge at all, a jump `j` is found where `j > c sqrt(l / (2 eps))`. Noise
//! of variance `s^2` is cheaper to smooth than to call edges where `s^2 < l c^2 / (8 eps)`; noisier
//! images need a larger length or contrast.

mod alternation;
mod energy;
mod params;
mod relax;
mod solve;
mod split;

pub use alternation::Alternation;
pub use energy::{AmbrosioTortorelli, SegmentationEnergy};
pub use params::{SegmentationParams, Weights};
pub use relax::{Part, Relaxation, relax};
pub use solve::{Segmentation, SegmentationLevel, coarser_image, segment};
pub use split::{Classes, split_classes};
