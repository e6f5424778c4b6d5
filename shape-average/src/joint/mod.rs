//! Edges of images and their average at the same time.
//!
//! Shapes are image morphologies: the object is the whole box, a shape the set of edges of an image
//! `u_i0`. Images `u_i`, their phase fields `v_i`, deformations `phi_i` and the average phase field
//! `v` minimise together
//!
//! ```text
//! E = (1/n) sum_i ( int W(D phi_i) + gamma F[v o phi_i, v_i] + E_AT[u_i, v_i, u_i0] ) + mu_L L[v]
//! ```
//!
//! with the energy of Ambrosio and Tortorelli, [`phasefield::segmentation`]. A minimum exists, and
//! its deformations are homeomorphisms, where the law grows as Theorem 4.8 of the lecture notes
//! asks. What one image shows badly, the others tell: an edge that all have in common costs an
//! image little, and one that it has alone costs more than it would on its own.
//!
//! # Method
//! On every level, coarsest first: at fixed phase fields, steps of the minimiser of averages for
//! `(phi_i)`, with `v` eliminated; then for every image the two linear systems of `v_i` and `u_i`,
//! the mismatch being quadratic in `v_i`, too. It is evaluated at the same points in both, so that
//! neither half ever raises the energy. Round by round, until that falls no more.
//!
//! The two systems of an image end in a minimum near to where they begin, and an edge that noise
//! hides is not near. So they are solved from a second start as well, at which the phase field is the
//! average's, seen through the deformation, and the pair of the lower energy is kept.
//!
//! # Weights
//! The mismatch has two minima where a phase field meets one that it agrees with: both 0 and both 1.
//! With a weight `nu` of the edges well below `gamma` it wins over the energy of the phase fields, and
//! edges that lie close together fill the space between them; so `nu` should be no less than `gamma`.
//! With twice `gamma` images that are unlike keep what is their own, and those that are alike still
//! tell each other of their edges.

mod density;
mod maps;
mod params;
mod result;
mod round;
mod solve;

pub use maps::StrainMaps;
pub use params::JointParams;
pub use result::{JointEnergy, JointLevel, JointResult, spread};
pub use solve::{joint_average, joint_average_from};
