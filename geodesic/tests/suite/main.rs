//! All tests of the shortest paths and of their calculus, as one program: what is generic is
//! compiled once for all.

mod calculus;
mod calculus_finite;
mod components;
mod distances;
mod finite;
mod known;
mod oracle;
