//! What every `result.json` tells in the same words.

use fe_grid::Certificate;
use fe_grid::minimise::Status;
use serde::Serialize;

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct CertificateRecord {
    /// Whether all deformations are proven to be injective on every cell.
    pub certified: bool,
    /// A lower bound of their determinants.
    pub min_det: f64,
}

impl CertificateRecord {
    /// The record of a certificate.
    pub fn new(certificate: &Certificate) -> Self {
        Self {
            certified: certificate.certified,
            min_det: certificate.min_det,
        }
    }

    /// The same in words.
    pub fn words(&self) -> &'static str {
        if self.certified {
            "certified without folds"
        } else {
            "NOT certified"
        }
    }
}

/// The name of [`Status::Cancelled`].
pub(crate) const CANCELLED: &str = "cancelled";

/// The status of a whole computation, and that of its last level, in one word.
pub(crate) fn overall(status: Status, last: Option<Status>) -> &'static str {
    if last == Some(Status::Cancelled) {
        return CANCELLED;
    }
    if status.converged() {
        return "converged";
    }
    name(status)
}

/// The name of a status.
pub(crate) fn name(status: Status) -> &'static str {
    match status {
        Status::GradientTolerance => "gradient_tolerance",
        Status::EnergyTolerance => "energy_tolerance",
        Status::MaxIterations => "max_iterations",
        Status::LineSearchFailed => "line_search_failed",
        Status::IndefiniteMetric => "indefinite_metric",
        Status::Cancelled => CANCELLED,
        Status::InadmissibleStart => "inadmissible_start",
        _ => "other",
    }
}

/// The most memory this process has had, where the system tells (Linux).
pub(crate) fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kib)
}
