//! All tests of the grids and the solvers on them, as one program: what is generic is compiled once for all.

mod support;

mod deformations;
mod engine;
mod held;
mod history;
mod lanes;
mod least_eigenvalue;
mod linear;
mod minimise;
mod multigrid;
mod multilevel;
mod parallel;
mod resume;
mod spectral;
mod uniform;
