//! The statements as a table: in the terminal, and as Markdown.

use std::fmt::Write as _;

use shapespace_report::table::Table;

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

/// A line for every statement, with the decisive figure.
pub fn plain(record: &VerifyRecord) -> String {
    let mut table = Table::new([
        "statement",
        "reference",
        "hypotheses",
        "observable",
        "expected",
        "measured",
        "verdict",
    ]);
    for s in &record.statements {
        table.texts([
            s.name.to_owned(),
            s.reference.to_owned(),
            shortened(&hypotheses(s), 36),
            shortened(&s.observable, 60),
            s.expected.clone(),
            s.measured.clone(),
            s.decided.word().to_owned(),
        ]);
    }
    table.aligned("")
}

/// A table with a row for every figure.
pub fn markdown(record: &VerifyRecord) -> String {
    let broken = record.broken.then_some("broken");
    let figure = [
        "hypotheses",
        "observable",
        "expected",
        "measured",
        "verdict",
    ];
    let columns = ["statement", "reference"].into_iter();
    let mut table = Table::new(columns.chain(broken).chain(figure));
    for s in &record.statements {
        for (i, f) in s.figures.iter().enumerate() {
            let first = |text: String| if i == 0 { text } else { String::new() };
            let mark = if f.holds { "" } else { " **≠**" };
            let statement = [format!("`{}`", s.name), s.reference.to_owned()];
            let ingredient = broken.map(|_| first(s.broken_ingredient.unwrap_or_default().into()));
            table.texts(statement.map(first).into_iter().chain(ingredient).chain([
                first(hypotheses(s)),
                f.observable.clone(),
                f.expected.clone(),
                format!("{}{mark}", f.measured),
                first(verdict(&s.decided)),
            ]));
        }
    }
    let summary = capital(&record.summary());
    format!("{summary} ({} run).\n\n{}", record.effort, table.markdown())
}

/// The law, and the number of satisfied hypotheses, or the one that fails.
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

/// The verdict with its reason.
pub fn verdict(verdict: &Verdict) -> String {
    match verdict {
        Verdict::Confirmed => "confirmed".into(),
        Verdict::NotCovered { .. } => "not covered".into(),
        Verdict::Refuted { .. } => "**refuted**".into(),
    }
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
