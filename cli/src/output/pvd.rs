//! ParaView collections (`.pvd`): which file belongs to which time.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use super::OutputError;

/// Writes a collection of files that lie beside it, each with its time.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub fn write_series(path: &Path, series: &[(f64, PathBuf)]) -> Result<(), OutputError> {
    fs::write(path, text(series)).map_err(OutputError::at(path))
}

fn text(series: &[(f64, PathBuf)]) -> String {
    let mut text = "<?xml version=\"1.0\"?>\n\
                    <VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  \
                    <Collection>\n"
        .to_owned();
    for (time, file) in series {
        // Writing into a string cannot fail. The names are the program's own, without quotes.
        let _ = writeln!(
            text,
            "    <DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>",
            file.display()
        );
    }
    text.push_str("  </Collection>\n</VTKFile>\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_has_its_time() {
        let found = text(&[(0.0, "a_000.vti".into()), (0.5, "a_001.vti".into())]);
        assert!(found.contains("timestep=\"0.5\" part=\"0\" file=\"a_001.vti\""));
        assert_eq!(found.matches("<DataSet").count(), 2);
        assert_eq!(found.matches("Collection>").count(), 2);
    }
}
