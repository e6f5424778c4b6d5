//! All tests of phase fields and of segmentation, as one program: what is generic is compiled once for all.

mod energies;
mod profile;
mod segmentation;
