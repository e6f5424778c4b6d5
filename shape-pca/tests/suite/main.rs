//! All tests of the modes of variation, as one program: what is generic is compiled once for all.

mod support;

mod balancing;
mod distributed;
mod groups;
mod oracle;
mod properties;
mod variation;
