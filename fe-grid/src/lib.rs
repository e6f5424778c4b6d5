//! Finite elements on uniform 2D and 3D grids.
//!
//! **Invariant:** nothing here knows what elasticity or a shape is; physics enters as a
//! pointwise law.

mod certificate;
pub mod composition;
pub mod csr;
pub mod engine;
mod error;
mod field;
mod grid;
mod inverse;
mod lane;
pub mod linear;
pub mod minimise;
pub mod multigrid;
pub mod operators;
mod pool;
mod restraint;
pub mod scatter;
mod simd;
mod spectral;
pub mod stencil;
pub mod tensor;
pub mod transfer;
pub mod vector;

pub use certificate::{Certificate, certify, violations};
pub use engine::{Assembly, CellLaw, CellProbe, Data, Jet, Point, Reads, probe_cells};
pub use error::GridError;
pub use field::{Field, ScalarField, VectorField, locate};
pub use grid::Grid;
pub use inverse::InverseDeformation;
pub use lane::{Element, Lane, LaneKernel, MAX_LANES};
pub use linear::conjugate_gradient;
pub use linear::{CgInfo, CgParams, CgScratch, CgStatus, Diagonal, Identity, LinearOperator};
pub use restraint::restrain_step;
pub use simd::SimdLevel;
pub use spectral::{Boundary, SpectralSolver};
pub use tensor::Tensor;
