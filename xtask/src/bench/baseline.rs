//! Counts of instructions, and their limits.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// A count above this multiple of the baseline fails.
const MOST: f64 = 1.10;
/// A count below this multiple calls for a new baseline.
const BETTER: f64 = 0.90;

/// Instructions of one run of every kernel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// The compiler that built the kernels.
    pub compiler: String,
    /// The program that counted.
    pub counter: String,
    /// Bits of the vectors.
    pub vectors: String,
    /// Instructions, kernel by kernel.
    pub instructions: BTreeMap<String, u64>,
}

/// Comparison of a kernel with the baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    Same,
    Better,
    Worse,
    /// It is not in the baseline.
    New,
    /// It is in the baseline only.
    Gone,
}

/// Two counts of every kernel.
#[derive(Debug)]
pub struct Comparison {
    rows: Vec<(String, Option<u64>, Option<u64>, Verdict)>,
    notes: Vec<String>,
}

/// Compares counts with the baseline.
pub fn compare(baseline: &Baseline, counted: &Baseline) -> Comparison {
    let mut names: Vec<&String> = baseline.instructions.keys().collect();
    names.extend(counted.instructions.keys());
    names.sort();
    names.dedup();
    let rows = names.into_iter().map(|name| {
        let before = baseline.instructions.get(name).copied();
        let now = counted.instructions.get(name).copied();
        (name.clone(), before, now, verdict(before, now))
    });
    let mut notes = Vec::new();
    for (what, before, now) in [
        ("compiler", &baseline.compiler, &counted.compiler),
        ("counter", &baseline.counter, &counted.counter),
        ("vectors", &baseline.vectors, &counted.vectors),
    ] {
        if before != now {
            notes.push(format!("{what}: {before} in the baseline, {now} here"));
        }
    }
    Comparison {
        rows: rows.collect(),
        notes,
    }
}

fn verdict(before: Option<u64>, now: Option<u64>) -> Verdict {
    match (before, now) {
        (Some(before), Some(now)) => {
            let ratio = now as f64 / before as f64;
            if ratio > MOST {
                Verdict::Worse
            } else if ratio < BETTER {
                Verdict::Better
            } else {
                Verdict::Same
            }
        }
        (None, _) => Verdict::New,
        (_, None) => Verdict::Gone,
    }
}

impl Comparison {
    /// Whether no kernel is worse, and all are in both counts.
    pub fn passes(&self) -> bool {
        let fine = |v: Verdict| matches!(v, Verdict::Same | Verdict::Better);
        self.rows.iter().all(|row| fine(row.3))
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.rows.iter().map(|r| r.0.len()).max().unwrap_or(0);
        writeln!(
            f,
            "{:width$} {:>14} {:>14} {:>8}",
            "kernel", "baseline", "now", "change"
        )?;
        let number = |x: Option<u64>| x.map_or_else(|| "–".to_owned(), |x| x.to_string());
        for (name, before, now, verdict) in &self.rows {
            let change = match (before, now) {
                (Some(b), Some(n)) => {
                    format!("{:+.2} %", 100.0 * (*n as f64 / *b as f64 - 1.0))
                }
                _ => "–".into(),
            };
            let (before, now) = (number(*before), number(*now));
            let said = match verdict {
                Verdict::Same => "",
                Verdict::Better => "  better: --bless",
                Verdict::Worse => "  WORSE",
                Verdict::New => "  NEW: --bless",
                Verdict::Gone => "  GONE: --bless",
            };
            writeln!(f, "{name:width$} {before:>14} {now:>14} {change:>8}{said}")?;
        }
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baseline<const N: usize>(counts: [(&str, u64); N]) -> Baseline {
        Baseline {
            compiler: "c".into(),
            counter: "v".into(),
            vectors: "256".into(),
            instructions: counts.map(|(name, n)| (name.to_owned(), n)).into(),
        }
    }

    #[test]
    fn ten_per_cent_more_pass_and_a_little_more_than_that_fails() {
        let before = baseline([("a", 1000), ("b", 1000)]);
        let passes = |a, b| compare(&before, &baseline([("a", a), ("b", b)])).passes();
        assert!(passes(1000, 1000));
        assert!(passes(1100, 500));
        assert!(!passes(1101, 500));
        assert!(!passes(1000, 2000));
    }

    #[test]
    fn a_kernel_that_is_new_or_gone_fails_until_it_is_blessed() {
        let before = baseline([("a", 1000)]);
        assert!(!compare(&before, &baseline([("a", 1000), ("b", 1)])).passes());
        assert!(!compare(&before, &baseline([])).passes());
    }

    #[test]
    fn the_table_names_what_is_worse_and_what_is_not_comparable() {
        let before = baseline([("slow", 1000), ("fast", 1000), ("same", 1000)]);
        let mut now = baseline([("slow", 1200), ("fast", 800), ("same", 1001)]);
        now.compiler = "another".into();
        let text = compare(&before, &now).to_string();
        let line = |name: &str| text.lines().find(|l| l.starts_with(name)).unwrap();
        assert!(line("slow").ends_with("+20.00 %  WORSE"));
        assert!(line("fast").contains("better"));
        assert!(line("same").ends_with("+0.10 %"));
        assert!(text.contains("compiler: c in the baseline, another here"));
    }
}
