//! All tests of the average but that of its memory, as one program: the average is generic, and every
//! program that uses it compiles it again, for minutes.

#[path = "../support/mod.rs"]
mod support;

mod align;
mod align_data;
mod align_symmetric;
mod average;
mod average_properties;
mod components;
mod distributed;
mod hessian;
mod inverse;
mod joint;
mod levels;
mod match_to;
mod minima;
mod oracle;
mod remaining;
mod rematch;
mod rounds;
mod seen;
mod start;
mod turned;
mod units;
mod weights;
