//! The end of a report: how to repeat the computation, and the files of its directory.

use std::ffi::OsString;

use shapespace_report::html::{Markup, element, row};

use super::overview::{folded, section};
use super::source::{Listed, Source};

/// Most files that are listed.
const FILES: usize = 300;

/// The command line, the configuration, and the files.
pub(super) fn repeat(source: &Source<'_>) -> Markup {
    let mut inner = Markup::default();
    if let Some(line) = source.command_line {
        inner.push(element("pre", &[], line));
    }
    if let Some(config) = source.text("config.toml") {
        inner.push(folded("config.toml", element("pre", &[], config)));
    } else if let Some(parameters) = source.record.get("parameters") {
        let text = serde_json::to_string_pretty(parameters).unwrap_or_default();
        inner.push(folded("Parameters", element("pre", &[], text)));
    }
    let bytes: u64 = source.files.iter().map(|file| file.bytes).sum();
    let rows = source
        .files
        .iter()
        .take(FILES)
        .map(|Listed { name, bytes }| {
            let cells = [
                element("td", &[], link(name)),
                element("td", &[("class", "number")], size(*bytes)),
            ];
            row("", cells)
        });
    let mut files = element("table", &[], rows.collect::<Markup>());
    let count = source.files.len();
    if count > FILES {
        files.push(element("p", &[], format!("and {} more", count - FILES)));
    }
    let title = format!("{count} files besides this one, {}", size(bytes));
    inner.push(folded(&title, files));
    section("To repeat it", inner)
}

/// A link to a file beside the page, if its name needs no coding in a link.
fn link(name: &str) -> Markup {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "._-/".contains(letter);
    if name.chars().all(plain) {
        element("a", &[("href", name)], name)
    } else {
        name.into()
    }
}

fn size(bytes: u64) -> String {
    let bytes = bytes as f64;
    match bytes {
        ..1e3 => format!("{bytes:.0} B"),
        ..1e6 => format!("{:.1} kB", bytes / 1e3),
        _ => format!("{:.1} MB", bytes / 1e6),
    }
}

/// A command line as a shell reads it.
pub(super) fn quoted(arguments: impl IntoIterator<Item = OsString>) -> String {
    let words = arguments.into_iter().map(|argument| {
        let word = argument.to_string_lossy().into_owned();
        let plain = |letter: char| letter.is_alphanumeric() || "._-/=,:+%@".contains(letter);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    });
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_the_same_words() {
        let words = ["shapespace", "a b", "", "it's", "--mu=2", "<x>"].map(OsString::from);
        assert_eq!(quoted(words), "shapespace 'a b' '' 'it'\\''s' --mu=2 '<x>'");
    }

    #[test]
    fn sizes_are_short() {
        assert_eq!(
            [999, 1500, 2_500_000].map(size),
            ["999 B", "1.5 kB", "2.5 MB"]
        );
        assert!(link("a/b.npy").as_str().starts_with("<a "));
        assert_eq!(link("a b\"").as_str(), "a b&quot;");
    }
}
