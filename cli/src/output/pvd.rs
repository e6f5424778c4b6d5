//! ParaView collections (`.pvd`): which file belongs to which time.

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
    // The names are those of the program, without quotes.
    let entry = |(time, file): &(f64, PathBuf)| {
        let file = file.display();
        format!("    <DataSet timestep=\"{time}\" part=\"0\" file=\"{file}\"/>\n")
    };
    let entries: Vec<String> = series.iter().map(entry).collect();
    format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  \
         <Collection>\n{}  </Collection>\n</VTKFile>\n",
        entries.concat()
    )
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
