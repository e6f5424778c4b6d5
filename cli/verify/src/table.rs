//! The statements as a table: in the terminal, and as Markdown.

use std::fmt::Write as _;

use crate::record::{StatementRecord, VerifyRecord};
use crate::statement::Statement;
use crate::verdict::Verdict;

/// Names, references and claims.
pub fn list(statements: &[Statement]) -> String {
    let mut text = String::new();
    for s in statements {
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{:<34} {:<26} {}", s.name, s.reference, s.claim);
    }
    text
}

/// A line for every statement, with the figure that decided.
pub fn plain(record: &VerifyRecord) -> String {
    let head = [
        "statement",
        "reference",
        "hypotheses",
        "observable",
        "expected",
        "measured",
        "verdict",
    ]
    .map(str::to_owned);
    let mut rows = vec![head];
    for s in &record.statements {
        rows.push([
            s.name.to_owned(),
            s.reference.to_owned(),
            shortened(&hypotheses(s), 36),
            shortened(&s.observable, 60),
            s.expected.clone(),
            s.measured.clone(),
            s.decided.word().to_owned(),
        ]);
    }
    let widths: [usize; 7] =
        std::array::from_fn(|k| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in &rows {
        for (cell, width) in row.iter().zip(widths) {
            let _ = write!(text, "{cell:<width$}  ");
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    text
}

/// A table with a row for every figure.
pub fn markdown(record: &VerifyRecord) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = writeln!(
        text,
        "{} ({} run).\n",
        capital(&record.summary()),
        record.effort
    );
    let broken = if record.broken { " broken |" } else { "" };
    let rule = if record.broken { "---|" } else { "" };
    let _ = writeln!(
        text,
        "| statement | reference |{broken} hypotheses | observable | expected | measured | verdict |\n\
         |---|---|{rule}---|---|---|---|---|"
    );
    for s in &record.statements {
        for (i, f) in s.figures.iter().enumerate() {
            let first = |text: String| if i == 0 { text } else { String::new() };
            let mark = if f.holds { "" } else { " **≠**" };
            let ingredient = match s.broken_ingredient {
                Some(what) => format!(" {} |", first(cell(what))),
                None => String::new(),
            };
            let _ = writeln!(
                text,
                "| {} | {} |{ingredient} {} | {} | {} | {}{mark} | {} |",
                first(format!("`{}`", s.name)),
                first(cell(s.reference)),
                first(cell(&hypotheses(s))),
                cell(&f.observable),
                cell(&f.expected),
                cell(&f.measured),
                first(verdict(&s.decided)),
            );
        }
    }
    text
}

/// The law, and how many hypotheses are met, or the one that is not.
pub fn hypotheses(s: &StatementRecord) -> String {
    let law = s.law.as_ref().map(|law| law.spec.law.to_string());
    let met = match s.hypotheses.iter().find(|h| !h.met) {
        Some(unmet) => Some(format!("not met: {}", unmet.name)),
        None if s.hypotheses.is_empty() => None,
        None => Some(format!("{} met", s.hypotheses.len())),
    };
    match (law, met) {
        (None, None) => "none".into(),
        (Some(one), None) | (None, Some(one)) => one,
        (Some(law), Some(met)) => format!("{law}: {met}"),
    }
}

/// The verdict with what it rests on.
pub fn verdict(verdict: &Verdict) -> String {
    match verdict {
        Verdict::Confirmed => "confirmed".into(),
        Verdict::NotCovered { .. } => "not covered".into(),
        Verdict::Refuted { .. } => "**refuted**".into(),
    }
}

/// A text that does not end its cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.into();
    }
    let mut short: String = text.chars().take(most - 1).collect();
    short.push('…');
    short
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}
