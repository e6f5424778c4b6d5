//! The top of a report: what was computed, the verdict with its doubts, the figures that lead, and
//! those of every shape.

use serde_json::Value;
use shapespace_report::html::{Markup, element};
use shapespace_report::table::{Cell, Table};

use super::leads::{Lead, figure};
use super::source::Source;
use super::values::{at, cell, one, sides, text};
use crate::doubts::grouped;

/// Most shapes in the table.
const SHAPES: usize = 200;

/// What was computed, how sound it is, and the figures that lead.
pub(super) fn overview(source: &Source<'_>, lead: &Lead) -> Markup {
    let head = [
        element("h1", &[], source.summary.title()),
        element("p", &[("class", "facts")], facts(&source.record)),
    ];
    let mut all = element("header", &[], head.into_iter().collect::<Markup>());
    all.push(verdict(source));
    let pair = |name: &str, value: &str| {
        let inner = [element("dt", &[], name), element("dd", &[], value)];
        element("div", &[], inner.into_iter().collect::<Markup>())
    };
    let figures = lead.figures.iter().filter_map(|wanted| {
        let value = figure(&source.record, wanted)?;
        Some(pair(wanted.0, &value))
    });
    let figures: Markup = figures.collect();
    if !figures.is_empty() {
        all.push(element("dl", &[("class", "figures")], figures));
    }
    let said = text(&source.record, "/text");
    if !said.is_empty() {
        all.push(element("p", &[], said));
    }
    let words = source.summary.lines().join("\n");
    all.push(folded("Summary, as printed", element("pre", &[], words)));
    all
}

/// Something behind a line that opens it.
pub(super) fn folded(title: &str, inner: Markup) -> Markup {
    let both = [element("summary", &[], title), inner];
    element("details", &[], both.into_iter().collect::<Markup>())
}

/// A part with its title; nothing where it is empty.
pub(super) fn section(title: &str, inner: Markup) -> Markup {
    if inner.is_empty() {
        return inner;
    }
    let both = [element("h2", &[], title), inner];
    element("section", &[], both.into_iter().collect::<Markup>())
}

/// The program, the command, and what all results have.
fn facts(record: &Value) -> String {
    let number = |place| one(record, place).and_then(Value::as_f64);
    let mut facts = vec![
        format!(
            "shapespace {} {}",
            text(record, "/version"),
            text(record, "/command")
        ),
        match sides(one(record, "/nodes")) {
            sides if sides.is_empty() => String::new(),
            sides => format!("{sides} nodes"),
        },
        text(record, "/status").replace('_', " "),
    ];
    facts.extend(number("/seconds").map(|seconds| format!("{seconds:.1} s")));
    let memory = number("/peak_memory_bytes");
    facts.extend(memory.map(|bytes| format!("{:.0} MiB", bytes / f64::from(1 << 20))));
    facts.retain(|fact| !fact.is_empty());
    facts.join(" · ")
}

/// The verdict, with all doubts and their remedies.
fn verdict(source: &Source<'_>) -> Markup {
    let summary = source.summary;
    let (class, word) = match (summary.interrupted, summary.doubts.is_empty()) {
        (true, _) => ("bad", "Stopped before its end"),
        (_, true) => ("good", "Sound"),
        (_, false) => ("fair", "Doubtful"),
    };
    let mut inner = element("p", &[("class", "word")], word);
    for same in grouped(&summary.doubts) {
        let items = same.sentences.into_iter();
        let items = items.map(|sentence| element("li", &[], sentence));
        inner.push(element("ul", &[], items.collect::<Markup>()));
        let remedy = format!("Remedy: {}.", same.remedy);
        inner.push(element("p", &[("class", "remedy")], remedy));
    }
    let class = format!("verdict {class}");
    element("section", &[("class", &class), ("id", "verdict")], inner)
}

/// The shapes with their figures.
pub(super) fn shapes(source: &Source<'_>, lead: &Lead) -> Markup {
    let record = &source.record;
    let names = at(record, lead.names.1);
    let columns = lead.columns().filter_map(|(name, place)| {
        let values = at(record, place);
        let known = values.iter().any(Option::is_some);
        (known && values.len() == names.len()).then_some((*name, values))
    });
    let columns: Vec<_> = columns.collect();
    if names.is_empty() {
        return Markup::default();
    }
    let none = || Cell::from(None::<&str>);
    let cell = |value: Option<&Value>| value.and_then(cell).unwrap_or_else(none);
    let titles = columns.iter().map(|(name, _)| *name);
    let mut table = Table::new([lead.names.0].into_iter().chain(titles));
    for (i, name) in names.iter().enumerate().take(SHAPES) {
        let figures = columns.iter().map(|(_, values)| cell(values[i]));
        table.row([cell(*name)].into_iter().chain(figures));
    }
    let mut inner = wide(table.html());
    if names.len() > SHAPES {
        let more = format!("and {} more", names.len() - SHAPES);
        inner.push(element("p", &[], more));
    }
    section("Shapes", inner)
}

/// A table that may be wider than the page.
pub(super) fn wide(table: Markup) -> Markup {
    element("div", &[("class", "wide")], table)
}
