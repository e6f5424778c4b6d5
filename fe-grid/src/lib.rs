//! Finite elements on uniform 2D and 3D grids.
//!
//! - Nodes and data: [`Grid`], [`Field`], and [`transfer`] to the grid of half the spacing.
//! - Energies: a pointwise density is a [`CellLaw`], written once for every [`Lane`];
//!   [`Assembly`] gives its integral, gradient and Hessian action on a grid.
//! - Deformations: fields seen through one ([`composition`], [`scatter`], [`coupling`]), energies as
//!   functions of a further one ([`pullback`]), its inverse ([`InverseDeformation`]), and the [`Certificate`] that it does not fold.
//! - Linear systems: [`UniformOperator`], [`conjugate_gradient`], [`SpectralSolver`],
//!   [`multigrid`].
//! - Given values: [`HeldValues`], on the boundary or anywhere, for operators and objectives.
//! - Minimisation: [`minimise`], from coarse levels to fine, and a check of derivatives.
//! - Threads: [`parallel`] loops, whose scheduler is compiled once. Processes: [`communicator`], and
//!   the [`Distribution`] of the parts of a problem to them.
//! - Compilation: [`dimension`] forwards generic code to a version for 2D and one for 3D.
//!
//! Everything holds for `D = 2` and `D = 3` alike. Elements are multilinear, with two quadrature
//! points an axis. Nodal data are stored component by component, `x` fastest, as `f64` or `f32`;
//! sums are taken in double precision. No result depends on the number of threads or on the
//! instruction set.
//!
//! **Invariant:** nothing here knows what elasticity or a shape is; physics enters as a
//! pointwise law.
//!
//! # Example
//! The Dirichlet energy `1/2 int |grad u|^2` of `u = 3 x + 4 y` on the unit square:
//! ```
//! use fe_grid::operators::MassStiffness;
//! use fe_grid::{Assembly, Data, Grid, ScalarField};
//!
//! let grid = Grid::<2>::dyadic(3);
//! let u = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| [3.0 * x + 4.0 * y]);
//! let law = MassStiffness { mass: 0.0, stiffness: 1.0 };
//! let energy = Assembly::<_, f64, 2, 1>::new(grid, &law, Data::default());
//! assert!((energy.value(u.as_slice())? - 12.5).abs() < 1e-12);
//! # Ok::<(), fe_grid::GridError>(())
//! ```
//!
//! # Features
//! - `mutants`: errors that tests build into formulas, to see whether they are found. Not for use.

// Unsafe code is in the modules that allow it, one for each subject; each states its invariant.
#![deny(unsafe_code)]

/// A formula, and what stands in its place while a built-in error is switched on:
/// `mutant!(right, Name => wrong)`. Without the feature `mutants` it is the formula alone.
#[cfg(feature = "mutants")]
#[macro_export]
macro_rules! mutant {
    ($right:expr, $name:ident => $wrong:expr) => {
        if $crate::mutants::Mutant::$name.is_on() {
            $wrong
        } else {
            $right
        }
    };
}

/// A formula, and what would stand in its place with a built-in error:
/// `mutant!(right, Name => wrong)`. Without the feature `mutants` it is the formula alone.
#[cfg(not(feature = "mutants"))]
#[macro_export]
macro_rules! mutant {
    ($right:expr, $name:ident => $wrong:expr) => {{ $right }};
}

#[allow(unsafe_code, reason = "the allocator of the system")]
mod allocator;
mod blocks;
mod buffer;
mod certificate;
pub mod communicator;
pub mod composition;
pub mod coupling;
mod covering;
mod cubic;
#[allow(unsafe_code, reason = "one type under two names")]
pub mod dimension;
mod dirichlet;
mod distribution;
pub mod engine;
mod error;
mod field;
mod grid;
mod half;
mod inverse;
mod kept;
mod lane;
mod lattice;
pub mod linear;
#[allow(unsafe_code, reason = "memory maps")]
mod mapped;
pub mod minimise;
mod moments;
pub mod multigrid;
mod multilinear;
#[cfg(feature = "mutants")]
pub mod mutants;
mod nearest;
pub mod operators;
#[allow(unsafe_code, reason = "parts of a slice on several threads")]
pub mod parallel;
mod pool;
mod preimages;
pub mod pullback;
pub mod random;
mod restraint;
mod rigid;
#[allow(unsafe_code, reason = "functions behind pointers")]
pub mod routine;
mod scalar;
pub mod scatter;
#[allow(unsafe_code, reason = "registers")]
mod simd;
mod simd_level;
mod spectral;
pub mod stencil;
pub mod tensor;
pub mod transfer;
mod uniform;
pub mod vector;

pub use allocator::ExitWithoutMemory;
pub use buffer::{Buffer, Storage};
pub use certificate::{Certificate, certify, certify_below, certify_within, repair, violations};
pub use dirichlet::{Held, HeldValues};
pub use distribution::{Distribution, Quantum};
pub use engine::{Assembly, CellLaw, CellProbe, Data, Jet, Point, Reads, probe_cells};
pub use error::GridError;
pub use field::{Field, ScalarField, VectorField, locate};
pub use grid::Grid;
pub use half::Half;
pub use inverse::InverseDeformation;
pub use lane::{Element, Lane, LaneKernel, MAX_LANES, Stored};
#[doc(hidden)]
pub use lane::{Numbers, NumbersMut};
pub use lattice::Lattice;
pub use linear::conjugate_gradient;
pub use linear::{CgInfo, CgParams, CgScratch, CgStatus, Diagonal, Identity, LinearOperator};
pub use preimages::{Preimage, preimages};
pub use restraint::{Restrained, restrain_step, restrain_together, shorten_together};
pub use rigid::{Motion, object_mass, rigid_motions};
pub use simd_level::SimdLevel;
pub use spectral::{Boundary, SpectralSolver};
pub use tensor::Tensor;
pub use uniform::UniformOperator;

/// The examples of the README are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
