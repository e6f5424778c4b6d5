//! All tests of the program that run it, linked once.

mod common;

mod absurd_options;
mod against;
mod api;
mod average;
mod bad_input;
mod book;
mod boxes;
mod calculus;
#[cfg(unix)]
mod clusters;
mod compare;
mod config;
mod damaged_files;
mod distances;
mod extremes;
mod figure;
mod formats;
mod frames;
mod generate;
mod geodesic;
mod hostile;
mod integrity;
mod joint;
mod log;
mod long_runs;
mod malformed;
mod malformed_surfaces;
mod materials;
mod meshes;
mod metric;
mod natural;
mod own_law;
mod page;
mod pca;
mod processes;
mod readme;
mod real_data;
mod resume;
mod segment;
mod skipping;
mod surfaces_elsewhere;
mod verdict;
mod verify;
mod warps;
