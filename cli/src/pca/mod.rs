//! `shapespace pca`, `shapespace synthesize` and `shapespace score`: modes of variation about an
//! average, synthesis of shapes from scores, and scores of new shapes.
//!
//! `read` reads directories, `balance` continues averages, `components` has those of several labels, `displaced` is the average under a displacement, `command`, `synthesize` and `score` compute, `record` is the content
//! of `result.json`, `outliers` names shapes far from the others, `procrustes` compares boundaries, `write`, `draw`, `images`, `tables` and
//! `report` write the rest of the directory.

mod args;
mod balance;
mod command;
mod components;
mod displaced;
mod draw;
mod images;
mod map;
mod outliers;
mod procrustes;
mod read;
mod record;
mod report;
mod score;
mod synthesize;
mod tables;
mod write;

pub(crate) use displaced::Displaced;
pub(crate) use map::ScoreMap;
pub(crate) use read::{StoredAverage, StoredPca, read_average, read_pca};

pub use args::{PcaConfig, ScoreConfig, SynthesizeConfig};
pub use procrustes::Procrustes;
