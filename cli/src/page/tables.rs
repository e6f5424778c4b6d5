//! The tables of a directory.

use shapespace_report::html::{Markup, element};
use shapespace_report::table::{Cell, Table};

use super::overview::{folded, section, wide};
use super::source::Source;

/// Tables with at most this many rows are shown at once.
const SHORT: usize = 12;
/// Most rows and columns of others.
const MOST: [usize; 2] = [200, 40];

/// All tables in files.
pub(super) fn tables(source: &Source<'_>) -> Markup {
    let all = source.ending(".csv").filter_map(|name| table(source, name));
    section("Tables", all.collect())
}

fn table(source: &Source<'_>, name: &str) -> Option<Markup> {
    let text = source.text(name)?;
    let (table, [rows, columns]) = read(&text)?;
    let mut inner = wide(table.html());
    if rows > MOST[0] || columns > MOST[1] {
        let cut = format!(
            "{} of {rows} rows and {} of {columns} columns; all are in {name}",
            rows.min(MOST[0]),
            columns.min(MOST[1])
        );
        inner.push(element("p", &[], cut));
    }
    Some(if rows <= SHORT && columns <= MOST[1] {
        let both = [element("h3", &[], name), inner];
        both.into_iter().collect()
    } else {
        folded(&format!("{name}: {rows} rows"), inner)
    })
}

/// The first rows and columns of a table, and how many there are.
fn read(text: &str) -> Option<(Table, [usize; 2])> {
    let mut reader = csv::ReaderBuilder::new()
        .flexible(true)
        .from_reader(text.as_bytes());
    let columns = reader.headers().ok()?.clone();
    let shown = columns.len().min(MOST[1]);
    let mut table = Table::new(columns.iter().take(shown));
    let mut rows = 0;
    for row in reader.records() {
        let row = row.ok()?;
        if rows < MOST[0] {
            table.row((0..shown).map(|k| cell(row.get(k).unwrap_or_default())));
        }
        rows += 1;
    }
    Some((table, [rows, columns.len()]))
}

/// A number where the text is one.
fn cell(text: &str) -> Cell {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Cell::Number(number),
        _ => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_tables_are_cut_and_counted() {
        let rows = "0.5,<b>\n".repeat(MOST[0] + 5);
        let (table, size) = read(&format!("n,\"a,b\"\n{rows}")).unwrap();
        assert_eq!(size, [MOST[0] + 5, 2]);
        let html = table.html();
        assert_eq!(html.as_str().matches("<tr>").count(), MOST[0] + 1);
        assert!(html.as_str().contains("<th>a,b</th>") && !html.as_str().contains("<b>"));
    }
}
