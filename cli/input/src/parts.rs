//! The files of one input: headers may have their data in another file.

use std::path::{Path, PathBuf};

use crate::content::extension_of;
use crate::volume::MAX_HEADER;
use crate::{files, metaimage, nifti, nrrd};

/// The files that an input is read from: its own, and the one that holds the rest of it. A header that cannot be
/// read names none.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    let other = match &*extension_of(path) {
        "hdr" | "img" => Some(nifti::other_of_pair(path)),
        "nrrd" | "nhdr" => header(path).and_then(|bytes| nrrd::data_file_of(&bytes, path)),
        "mha" | "mhd" => header(path).and_then(|bytes| metaimage::data_file_of(&bytes, path)),
        _ => None,
    };
    std::iter::once(path.to_path_buf()).chain(other).collect()
}

/// A header; none where the file is longer, and thus holds its data.
fn header(path: &Path) -> Option<Vec<u8>> {
    files::read(path, MAX_HEADER as u64).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_name_the_files_of_their_data() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        let nrrd = "NRRD0004\ndimension: 2\n";
        let meta = "NDims = 2\nElementDataFile = ";
        for (name, text, other) in [
            ("a.nhdr", format!("{nrrd}data file: a.raw\n"), Some("a.raw")),
            ("b.nhdr", format!("{nrrd}data file: ../b.raw\n"), None),
            ("c.nrrd", format!("{nrrd}\nabc"), None),
            ("d.mhd", format!("{meta}d.raw\n"), Some("d.raw")),
            ("e.mha", format!("{meta}LOCAL\nabc"), None),
            ("f.mhd", "nothing".into(), None),
            ("g.hdr", String::new(), Some("g.IMG")),
            ("g.IMG", String::new(), Some("g.hdr")),
            ("h.npy", String::new(), None),
        ] {
            std::fs::write(at(name), text).unwrap();
            let all: Vec<PathBuf> = [Some(name), other].into_iter().flatten().map(at).collect();
            assert_eq!(files_of(&at(name)), all);
        }
        assert_eq!(files_of(&at("none.mhd")), [at("none.mhd")]);
    }
}
