//! What an analysis has found.

use std::time::Instant;

use shape_pca::{Pca, Quality};

use super::args::PcaArgs;
use super::read::GivenAverage;

/// Everything there is to tell about an analysis.
pub(super) struct Outcome<'a, const D: usize> {
    pub args: &'a PcaArgs,
    pub given: &'a GivenAverage<D>,
    pub pca: &'a Pca<D>,
    pub quality: Quality,
    pub start: Instant,
}
