//! The result of an analysis.

use std::time::Instant;

use shape_pca::{Pca, Quality};

use super::args::PcaConfig;
use super::read::StoredAverage;

/// The result of a computation.
pub(super) struct Outcome<'a, const D: usize> {
    pub config: &'a PcaConfig,
    pub stored: &'a StoredAverage<D>,
    pub pca: &'a Pca<D>,
    pub quality: Quality,
    pub start: Instant,
}
