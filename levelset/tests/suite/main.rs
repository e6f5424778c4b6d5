//! All tests of signed distances, contours and measures, as one program: what is generic is compiled once for all.

mod common;

mod contour;
mod distance;
mod facing;
mod heaviside;
mod inspect;
mod measures;
mod surface;
mod topology;
