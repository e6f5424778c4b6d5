//! All tests of phase fields and of segmentation, as one program: what is generic is compiled once for all.

#[path = "../../../shape-average/tests/support/oracle.rs"]
mod oracle;

mod energies;
mod profile;
mod segmentation;
