//! Built-in shapes, as functions whose sign distinguishes inside from outside.
//!
//! Every shape is defined about the origin and [`Placed`] in the unit box. [`area_share`] samples
//! it on a grid: the value at a node is the fraction of the box of one spacing around it that lies
//! inside, so that the level 1/2 approximates the boundary to a small fraction of a cell.
//!
//! **Invariant:** no files, no options; shapes are returned as fields of nodal values.
//!
//! # Example
//! ```
//! use fe_grid::Grid;
//! use shapespace_generate::{Bar, Placed, area_share};
//!
//! // A bent bar, .6 long and .12 wide, in the middle of the unit box.
//! let bar = Placed::<_, 2>::centred(Bar::new(0.6, 0.12, 118.0));
//! let share = area_share(&bar, Grid::cube(65));
//! assert_eq!(share.as_slice()[0], 0.0);
//! ```
//!
//! # Features
//! - `clap`: letters and families are options of a command line (`clap::Args`).

#![forbid(unsafe_code)]

mod blob;
mod family;
mod hand;
mod implicit;
mod letter;
mod member;
mod outline;
mod parts;
mod placed;
mod random;
mod sample;
mod solid;

pub use blob::Blob;
pub use family::{Family, family, letters};
pub use hand::Hand;
pub use implicit::Implicit;
pub use letter::{Letter, letter};
pub use member::Member;
pub use outline::{Outline, Pen};
pub use parts::parts;
pub use placed::Placed;
pub use sample::{area_share, make_grey};
pub use solid::{Bar, Cross, Ellipsoid, Star};
