//! All tests of the stored energies, as one program: what is generic is compiled once for all.

mod common;

mod constructors;
mod corotational;
mod hypotheses;
mod lanes;
mod oracle;
mod properties;
mod refutations;
