//! Text for standard output and standard error; neither has to exist.

use std::io::{self, Write};
use std::path::Path;

use crate::output::OutputError;

/// Prints a result on standard output. A closed pipe is no error: its reader wants no more.
///
/// # Errors
/// [`OutputError::Unwritable`], for example on a full disk.
pub(crate) fn print(text: &str) -> Result<(), OutputError> {
    let mut stdout = io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(OutputError::at(Path::new("standard output"))(error))
        }
        _ => Ok(()),
    }
}

/// Text from files and names without the characters that control terminals.
pub(crate) fn printable(text: &str) -> String {
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
pub(crate) fn note(line: impl AsRef<str>) {
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
