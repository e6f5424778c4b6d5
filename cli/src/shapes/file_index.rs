//! Inputs by the names that tables give them.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use super::label::stem;

/// Finds files by their path, by the end of their path, or by their name without extension.
pub(crate) struct FileIndex {
    /// By their paths as they were given.
    given: HashMap<PathBuf, Vec<usize>>,
    /// By every end of their absolute paths, in whole components.
    ends: HashMap<PathBuf, Vec<usize>>,
    /// By their names without extension.
    stems: HashMap<String, Vec<usize>>,
}

/// The files that a name fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Fitting<'a> {
    /// Their numbers.
    pub files: &'a [usize],
    /// How many components of their paths the name has, more than any if it is the path as it was given; none if it
    /// only has the name without extension.
    pub components: usize,
}

impl FileIndex {
    pub fn new(files: &[PathBuf]) -> Self {
        let mut index = Self {
            given: HashMap::new(),
            ends: HashMap::new(),
            stems: HashMap::new(),
        };
        for (i, file) in files.iter().enumerate() {
            index.given.entry(plain(file)).or_default().push(i);
            // Of a folder that is gone the path as it is.
            let whole = std::path::absolute(file).unwrap_or_else(|_| file.clone());
            let mut rest = whole.components();
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
        let path = &*plain(Path::new(name));
        let components = path.components().count();
        if let Some(files) = self.given.get(path) {
            let components = usize::MAX;
            return Fitting { files, components };
        }
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

/// A path without a dot in front.
fn plain(path: &Path) -> PathBuf {
    let is_dot = |part: &Component<'_>| matches!(part, Component::CurDir);
    path.components().filter(|part| !is_dot(part)).collect()
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
        let most = usize::MAX;
        assert_eq!(found("/in/a.png"), (vec![0], most));
        assert_eq!(found("in/b.nii.gz"), (vec![1], most));
        assert_eq!(found("./in/b.nii.gz"), (vec![1], most));
        let here = std::env::current_dir().unwrap();
        let (files, components) = found(&here.join("in/b.nii.gz").to_string_lossy());
        assert_eq!(files, [1]);
        assert!(components > 2 && components < most);
        assert_eq!(found("in/a.png"), (vec![0], 2));
        assert_eq!(found("a.png"), (vec![0], 1));
        assert_eq!(found("a"), (vec![0], 0));
        assert_eq!(found("a.npy"), (vec![0], 0));
        assert_eq!(found("b"), (vec![1, 2], 0));
        assert_eq!(found("b.png"), (vec![2], 1));
        assert_eq!(found("c.npy"), (vec![3], most));
        // The path as it was given, though it is also the end of another one.
        let files = ["x/a.png", "y/x/a.png"].map(PathBuf::from);
        assert_eq!(FileIndex::new(&files).find("./x/a.png").files, [0]);
        for name in ["", ".", "n/a.png", "n/a", "d"] {
            assert_eq!(found(name), (vec![], 0), "{name}");
        }
    }
}
