//! Text for standard output, which does not have to exist.

use std::io::{self, Write};
use std::path::Path;

use crate::output::OutputError;
use shapespace_input::terminal::note;

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

/// Prints what stands in files, too: that it cannot be printed is said on standard error.
pub(crate) fn print_or_note(text: &str) {
    if let Err(error) = print(text) {
        note(format!("warning: {error}"));
    }
}
