//! Finite elements on uniform 2D and 3D grids.
//!
//! **Invariant:** nothing here knows what elasticity or a shape is; physics enters as a
//! pointwise law.

mod error;
mod field;
mod grid;
mod lane;
mod simd;
pub mod tensor;

pub mod csr;
pub mod linear;
pub mod minimise;
mod pool;
mod spectral;
pub mod vector;

pub use error::GridError;
pub use field::{Field, ScalarField, VectorField, locate};
pub use grid::Grid;
pub use lane::{Element, Lane, LaneKernel, MAX_LANES};
pub use simd::SimdLevel;
pub use tensor::Tensor;

pub use linear::conjugate_gradient;
pub use linear::{CgInfo, CgParams, CgScratch, CgStatus, Diagonal, Identity, LinearOperator};
pub use spectral::{Boundary, SpectralSolver};
