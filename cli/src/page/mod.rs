//! `report.html`: a result in one page that loads nothing, made of what its directory has.

mod leads;
mod map;
mod mesh;
mod modes;
mod overview;
mod pictures;
mod repeat;
mod scene;
mod source;
mod tables;
mod values;

use shapespace_report::html::{Markup, Page};

use crate::output::{OutputError, ResultDir, write_text};
use crate::summary::Summary;
use source::Source;

/// The name of the report.
pub(crate) const PAGE: &str = "report.html";
const STYLE: &str = include_str!("assets/page.css");
/// The scripts, each for the elements of one kind.
const SCRIPT: &str = concat!(
    "\n'use strict';\n",
    include_str!("assets/common.js"),
    include_str!("assets/player.js"),
    include_str!("assets/viewer.js"),
    include_str!("assets/map.js"),
);

/// Writes the report of an incomplete directory, unless it does without such files. What the
/// directory does not have is left out.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_page(
    directory: &ResultDir,
    summary: &Summary,
    command_line: Option<&str>,
) -> Result<(), OutputError> {
    directory.with_file(PAGE, |path| {
        let source = Source::read(directory.path(), summary, command_line);
        let source = source.map_err(OutputError::at(directory.path()))?;
        write_text(path, &page(&source))
    })
}

/// The command line of this process.
pub(crate) fn command_line() -> String {
    let mut arguments = std::env::args_os();
    // As it is called, wherever it lies.
    let program = arguments.next().map(|_| "shapespace".into());
    repeat::quoted(program.into_iter().chain(arguments))
}

/// The page of a result.
fn page(source: &Source<'_>) -> String {
    let lead = leads::lead(&source.record);
    // The first that asks gets room: what shows most comes first.
    let main = pictures::main(source);
    let turning = scene::scenes(source);
    let others = pictures::others(source);
    let body: Markup = [
        overview::overview(source, lead),
        main,
        turning,
        map::map(source),
        others,
        overview::shapes(source, lead),
        tables::tables(source),
        repeat::repeat(source),
    ]
    .into_iter()
    .collect();
    let page = Page {
        title: source.summary.title(),
        style: STYLE,
        script: SCRIPT,
        body,
    };
    page.document()
}

#[cfg(test)]
mod tests;
