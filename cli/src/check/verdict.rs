//! What a record says about itself: its verdict follows from its doubts, and a computation that has not converged has one.

use fe_grid::minimise::Status;
use levelset::Verdict;
use serde::Deserialize;
use serde_json::Value;

use super::Findings;
use crate::report::word;

/// Compares the verdict of a record with its doubts, and these with its status. Records of commands that do not compute
/// have neither.
pub(super) fn check_verdict(record: &Value, findings: &mut Findings) {
    let (verdict, doubts) = (record["verdict"].as_str(), record["doubts"].as_array());
    let (verdict, doubts) = match (verdict, doubts) {
        (None, None) => return,
        (Some(verdict), Some(doubts)) => (verdict, doubts),
        _ => {
            let found = "the record states only one of verdict and doubts";
            return findings.add("verdict", found, false);
        }
    };
    let follows = if doubts.is_empty() {
        Verdict::Sound
    } else {
        Verdict::Doubtful
    };
    let counted = match doubts.len() {
        0 => "no doubts".to_owned(),
        1 => "1 doubt".to_owned(),
        n => format!("{n} doubts"),
    };
    let found = format!("{verdict}, with {counted}");
    findings.add("verdict", found, verdict == word(&follows));
    let ended = Status::deserialize(&record["status"]);
    if ended.is_ok_and(|status| !status.converged()) && doubts.is_empty() {
        findings.add(
            "status",
            "it has not converged, and there is no doubt",
            false,
        );
    }
}
