//! What a record says about itself: its verdict follows from its doubts, and a computation that has not converged has one.

use fe_grid::minimise::Status;
use levelset::Verdict;
use serde::Deserialize;
use serde_json::Value;

use super::Findings;
use crate::report::word;

/// Commands whose status is that of a minimisation.
const MINIMISING: [&str; 4] = ["average", "geodesic", "metric", "segment"];

/// Compares the verdict of a record with its doubts, and these with the status of a minimisation. Records of commands that
/// do not compute have neither. Returns whether both or none are stated.
pub(super) fn check_verdict(record: &Value, findings: &mut Findings) -> bool {
    let (verdict, doubts) = (record["verdict"].as_str(), record["doubts"].as_array());
    let (verdict, doubts) = match (verdict, doubts) {
        (None, None) => return true,
        (Some(verdict), Some(doubts)) => (verdict, doubts),
        _ => {
            let found = "the record states only one of verdict and doubts";
            findings.add("verdict", found, false);
            return false;
        }
    };
    let counted = match doubts.len() {
        0 => "no doubts".to_owned(),
        1 => "1 doubt".to_owned(),
        n => format!("{n} doubts"),
    };
    let found = format!("{verdict}, with {counted}");
    findings.add("verdict", found, verdict == word(&Verdict::of(doubts)));
    let minimises = MINIMISING
        .iter()
        .any(|command| record["command"] == *command);
    let ended = Status::deserialize(&record["status"]);
    if minimises && doubts.is_empty() && ended.is_ok_and(|status| !status.converged()) {
        let found = "it has not converged, and there is no doubt";
        findings.add("status", found, false);
    }
    true
}
