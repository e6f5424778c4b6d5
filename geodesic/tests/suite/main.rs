//! All tests of the shortest paths and of their calculus, as one program: what is generic is
//! compiled once for all.

mod both_ways;
mod boundary_metric;
mod calculus;
mod calculus_finite;
mod components;
mod contacts;
mod distances;
mod finite;
mod given;
mod known;
mod many_objects;
mod middle;
mod minima;
mod near;
mod oracle;
mod resume;
mod through;
mod transported;
mod turned;
mod units;
