//! Inputs by the names that tables give them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::label::stem;

/// Finds files by their path, by the end of their path, or by their name without extension.
pub(crate) struct FileIndex {
    /// By every end of their paths, in whole components.
    ends: HashMap<PathBuf, Vec<usize>>,
    /// By their names without extension.
    stems: HashMap<String, Vec<usize>>,
}

/// The files that a name fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Fitting<'a> {
    /// Their numbers.
    pub files: &'a [usize],
    /// How many components of their paths the name has; none if it only has the name without extension.
    pub components: usize,
}

impl FileIndex {
    pub fn new(files: &[PathBuf]) -> Self {
        let mut index = Self {
            ends: HashMap::new(),
            stems: HashMap::new(),
        };
        for (i, file) in files.iter().enumerate() {
            let mut rest = file.components();
            while rest.clone().next().is_some() {
                let end = rest.as_path().to_path_buf();
                index.ends.entry(end).or_default().push(i);
                rest.next();
            }
            index.stems.entry(stem(file)).or_default().push(i);
        }
        index
    }

    /// The files that a name fits best.
    pub fn find(&self, name: &str) -> Fitting<'_> {
        let path = Path::new(name);
        let components = path.components().count();
        match self.ends.get(path) {
            Some(files) => Fitting { files, components },
            // A name with a folder is a path.
            None if components == 1 => Fitting {
                files: self.stems.get(&stem(path)).map_or(&[], |files| files),
                components: 0,
            },
            None => Fitting::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_by_path_end_and_stem() {
        let files = ["/in/a.png", "in/b.nii.gz", "other/b.png", "./c.npy"].map(PathBuf::from);
        let index = FileIndex::new(&files);
        let found = |name: &str| {
            let Fitting { files, components } = index.find(name);
            (files.to_vec(), components)
        };
        assert_eq!(found("/in/a.png"), (vec![0], 3));
        assert_eq!(found("in/a.png"), (vec![0], 2));
        assert_eq!(found("a.png"), (vec![0], 1));
        assert_eq!(found("a"), (vec![0], 0));
        assert_eq!(found("a.npy"), (vec![0], 0));
        assert_eq!(found("b"), (vec![1, 2], 0));
        assert_eq!(found("b.png"), (vec![2], 1));
        assert_eq!(found("c.npy"), (vec![3], 1));
        for name in ["", "n/a.png", "n/a", "d"] {
            assert_eq!(found(name), (vec![], 0), "{name}");
        }
    }
}
