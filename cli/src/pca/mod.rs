//! `shapespace pca`, `shapespace synthesize` and `shapespace score`: modes of variation about an
//! average, shapes made of them, and new shapes measured by them.
//!
//! `read` reads directories back, `command`, `synthesize` and `score` compute, `record` is what
//! `result.json` tells, `procrustes` compares boundaries, `write`, `draw`, `images`, `tables` and `report` make the rest of the directory.

mod args;
mod command;
mod draw;
mod images;
mod outcome;
mod procrustes;
mod read;
mod record;
mod report;
mod score;
mod synthesize;
mod tables;
mod write;

pub use args::{PcaArgs, PcaConfig, ScoreArgs, ScoreConfig, SynthesizeArgs, SynthesizeConfig};
pub use command::run_pca;
pub use procrustes::{Procrustes, there_and_back};
pub use score::run_score;
pub use synthesize::run_synthesize;
