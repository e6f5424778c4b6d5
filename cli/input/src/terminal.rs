//! Text for terminals: names and messages without what controls them, and notes on standard error.

use std::io::{self, Write};

/// Text from files and names without the characters that control terminals.
pub fn printable(text: &str) -> String {
    let controls = |c: char| c.is_control() && c != '\n';
    if !text.contains(controls) {
        return text.into();
    }
    let shown = |c: char| {
        if controls(c) {
            c.escape_default().to_string()
        } else {
            c.into()
        }
    };
    text.chars().map(shown).collect()
}

/// Prints a line on standard error. It is lost where that cannot be written, which ends no
/// computation.
pub fn note(line: impl AsRef<str>) {
    let _ = writeln!(io::stderr(), "{}", line.as_ref());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_not_controlled() {
        assert_eq!(printable("größe\n2"), "größe\n2");
        assert_eq!(printable("a\u{1b}[31m\u{9b}\r"), "a\\u{1b}[31m\\u{9b}\\r");
    }
}
