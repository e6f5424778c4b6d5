//! All tests of the program that run it, linked once.

mod common;

mod absurd_options;
mod api;
mod average;
mod bad_input;
mod book;
mod calculus;
mod compare;
mod config;
mod damaged_files;
mod distances;
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
mod meshes;
mod metric;
mod natural;
mod own_law;
mod page;
mod pca;
mod readme;
mod real_data;
mod segment;
mod surfaces_elsewhere;
mod verdict;
mod verify;
