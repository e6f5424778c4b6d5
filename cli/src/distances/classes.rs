//! Known classes of the inputs.
//!
//! - `folder`: the name of the folder that the file is in.
//! - `prefix`: the file name up to its last `-`, `_`, `.` or space; without one, the name
//!   without the digits at its end: `bat-07.png` is a `bat`, `horse12.png` a `horse`.
//! - a table of files and their classes, separated by commas, semicolons or tabs: the file as on the command
//!   line, the end of its path, or its name with or without extension. The class is in the column
//!   `class` or `group`, if there is a header with one of these, else in the last. Empty lines are left out.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::args::DistancesConfig;
use crate::error::CliError;
use crate::shapes::FileIndex;
use shapespace_input::files::read_text;

const FOLDER: &str = "folder";
const PREFIX: &str = "prefix";
/// Values of the option that are no files.
pub(crate) const NAMED: [&str; 2] = [FOLDER, PREFIX];

/// The classes of all inputs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Classes {
    /// Their names, in the order of their first objects.
    pub names: Vec<String>,
    /// The number of each input's class.
    pub of_input: Vec<usize>,
}

impl Classes {
    /// The classes according to the option `--classes`.
    ///
    /// # Errors
    /// [`CliError::Classes`] for a file that cannot be read or lacks an input, and for inputs whose
    /// names contain no class.
    pub fn of(option: &Path, inputs: &[PathBuf]) -> Result<Self, CliError> {
        let named = inputs.iter().zip(named(option, inputs)?);
        let named = named.map(|(path, name)| {
            let name = name.filter(|name| !name.is_empty());
            name.ok_or_else(|| CliError::Classes {
                source_name: option.display().to_string(),
                reason: format!("'{}' has no class there", path.display()),
            })
        });
        Ok(Self::numbered(named.collect::<Result<Vec<_>, _>>()?))
    }

    /// The classes of inputs that have these names of classes.
    pub fn numbered(names: impl IntoIterator<Item = String>) -> Self {
        let mut numbers: HashMap<String, usize> = HashMap::new();
        let mut classes = Self {
            names: Vec::new(),
            of_input: Vec::new(),
        };
        for name in names {
            let next = classes.names.len();
            let number = *numbers.entry(name).or_insert_with_key(|name| {
                classes.names.push(name.clone());
                next
            });
            classes.of_input.push(number);
        }
        classes
    }
}

/// The classes of the shapes of distances.
pub(super) struct Labels {
    /// Of all shapes, or of the stored ones.
    given: Classes,
    /// Those of new shapes before them, as far as stored shapes have them, too.
    expected: Vec<Option<usize>>,
}

impl Labels {
    /// The classes according to the option `--classes`.
    ///
    /// # Errors
    /// As [`Classes::of`]; new shapes need none.
    pub fn of(option: &Path, config: &DistancesConfig) -> Result<Self, CliError> {
        if config.against.is_empty() {
            return Ok(Self {
                given: Classes::of(option, &config.inputs)?,
                expected: Vec::new(),
            });
        }
        let given = Classes::of(option, &config.against)?;
        let number = |name: Option<String>| {
            let name = name?;
            given.names.iter().position(|known| *known == name)
        };
        let expected = named(option, &config.inputs)?;
        Ok(Self {
            expected: expected.into_iter().map(number).collect(),
            given,
        })
    }

    /// The names of all classes.
    pub fn names(&self) -> &[String] {
        &self.given.names
    }

    /// The class of a shape, if it is known.
    pub fn class(&self, shape: usize) -> Option<usize> {
        match self.expected.get(shape) {
            Some(expected) => *expected,
            None => Some(self.given.of_input[shape - self.expected.len()]),
        }
    }

    /// Its name.
    pub fn name(&self, shape: usize) -> Option<&str> {
        Some(&self.given.names[self.class(shape)?])
    }

    /// The classes, if those of all shapes are known.
    pub fn all(&self) -> Option<&Classes> {
        self.expected.is_empty().then_some(&self.given)
    }
}

/// The names of the classes of inputs, where they have one.
fn named(option: &Path, inputs: &[PathBuf]) -> Result<Vec<Option<String>>, CliError> {
    Ok(match option.to_str() {
        Some(FOLDER) => inputs.iter().map(|path| folder(path)).collect(),
        Some(PREFIX) => inputs.iter().map(|path| Some(prefix(path))).collect(),
        _ => listed(option, inputs)?,
    })
}

fn folder(path: &Path) -> Option<String> {
    let name = path.parent()?.file_name()?;
    Some(name.to_string_lossy().into_owned())
}

fn prefix(path: &Path) -> String {
    let name = crate::shapes::stem(path);
    let end = name.rfind(['-', '_', '.', ' ']);
    let head = match end {
        Some(end) => &name[..end],
        None => name.trim_end_matches(|c: char| c.is_ascii_digit()),
    };
    head.to_owned()
}

/// The classes that a file lists.
fn listed(list: &Path, inputs: &[PathBuf]) -> Result<Vec<Option<String>>, CliError> {
    let failed = |reason: String| CliError::Classes {
        source_name: list.display().to_string(),
        reason,
    };
    let text = read_text(list).map_err(|error| failed(error.to_string()))?;
    let index = FileIndex::new(inputs);
    // Where several lines fit an input, the one with more of its path counts.
    let mut known: Vec<Option<(usize, String)>> = vec![None; inputs.len()];
    let mut column = None;
    for (i, cells) in table_reader(&text, false).records().enumerate() {
        let cells = cells.map_err(|error| failed(error.to_string()))?;
        let line = cells.position().map_or(0, csv::Position::line);
        let cells: Vec<&str> = cells.iter().collect();
        if cells.iter().all(|cell| cell.is_empty()) {
            continue;
        }
        if i == 0 && is_hint(cells[0]) {
            return Err(failed(format!(
                "line 1, '{}', is no header but a hint for spreadsheets: leave it out",
                cells[0]
            )));
        }
        if i == 0
            && let Some(at) = class_column(&cells)
        {
            column = Some(at);
            if cells[at + 1..].contains(&cells[at]) {
                return Err(failed(format!("it has two columns '{}'", cells[at])));
            }
            continue;
        }
        let (file, class) = match (column, cells.as_slice()) {
            (Some(at), [file, ..]) if at < cells.len() => ((*file).to_owned(), cells[at]),
            // Without a header a file name may have commas.
            (None, [file @ .., class]) if !file.is_empty() => (file.join(","), *class),
            _ => {
                return Err(failed(format!(
                    "line {line} has no class: '{}'",
                    cells.join(",")
                )));
            }
        };
        let fitting = index.find(&file);
        for &input in fitting.files {
            match &known[input] {
                Some((components, _)) if *components > fitting.components => {}
                Some((components, other))
                    if *components == fitting.components && other != class =>
                {
                    return Err(failed(format!(
                        "line {line}: '{file}' is both {other} and {class}"
                    )));
                }
                _ => known[input] = Some((fitting.components, class.to_owned())),
            }
        }
    }
    let classes = known.into_iter().map(|found| Some(found?.1));
    Ok(classes.collect())
}

/// The column of the groups after the first, `group` or else `class`, in a header.
pub(crate) fn class_column(header: &[impl AsRef<str>]) -> Option<usize> {
    let at = |name: &str| {
        let is_it = |cell: &_| AsRef::<str>::as_ref(cell).eq_ignore_ascii_case(name);
        header.iter().skip(1).position(is_it)
    };
    Some(at("group").or_else(|| at("class"))? + 1)
}

/// Whether the first cell of a table states its separator, as some spreadsheets have it.
pub(crate) fn is_hint(cell: &str) -> bool {
    cell.to_lowercase().starts_with("sep=")
}

/// Reads a table whose cells are separated by commas, or where its first line has none by semicolons or tabs. Lines
/// may have any number of cells.
pub(crate) fn table_reader(text: &str, has_header: bool) -> csv::Reader<&[u8]> {
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().next().unwrap_or_default().as_bytes();
    let separators = [b',', b';', b'\t'];
    let separator = separators
        .into_iter()
        .find(|separator| first.contains(separator));
    csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .delimiter(separator.unwrap_or(b','))
        .has_headers(has_header)
        .flexible(true)
        .from_reader(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn names_contain_classes() {
        let inputs = paths(&[
            "a/bat-01.png",
            "a/bat-2.png",
            "b/device7-3.nii.gz",
            "b/ray12.npy",
        ]);
        let found = Classes::of(Path::new("prefix"), &inputs).unwrap();
        assert_eq!(found.names, ["bat", "device7", "ray"]);
        assert_eq!(found.of_input, [0, 0, 1, 2]);
        let found = Classes::of(Path::new("folder"), &inputs).unwrap();
        assert_eq!((found.names.len(), found.of_input), (2, vec![0, 0, 1, 1]));
        let nowhere = Classes::of(Path::new("folder"), &paths(&["x.png"]));
        assert!(matches!(nowhere, Err(CliError::Classes { .. })));
        let number = Classes::of(Path::new("prefix"), &paths(&["12.png"]));
        assert!(matches!(number, Err(CliError::Classes { .. })));
    }

    #[test]
    fn a_file_lists_classes() {
        let place = tempfile::tempdir().unwrap();
        let list = place.path().join("classes.csv");
        let read = |text: &str| {
            std::fs::write(&list, text).unwrap();
            Classes::of(&list, &paths(&["in/a.png", "in/b, c.png"]))
        };
        let found = read("file,class\nin/a.png, long \n\n\"b, c.png\",short\n").unwrap();
        assert_eq!(found.names, ["long", "short"]);
        let read = |text: &str| read(text).map(|found| (found.names, found.of_input));
        let table = "name;age;Group\na;12;long\nb, c;13;short\n";
        assert_eq!(read(table).unwrap().0, ["long", "short"]);
        let table = "name\tgroup\tage\nin/a.png\tlong\t3\nb, c.png\tlong\t4\n";
        assert_eq!(read(table).unwrap(), (vec!["long".into()], vec![0, 0]));
        for bad in [
            "a.png,x\n",
            "name,class,age\na.png\nb.png,x,2\n",
            "a.png;x\nb, c.png,y",
            "a.png,x\na.png,y\nb, c.png,x",
            "sep=;\na.png;x\nb, c.png;y\n",
            "name,group,age,group\na,x,1,y\nb,x,1,y\n",
        ] {
            assert!(matches!(read(bad), Err(CliError::Classes { .. })), "{bad}");
        }
        let table = "a.png,long\nin/a.png,short\nb,long\n\"b, c\",long\n";
        assert_eq!(read(table).unwrap().0, ["short", "long"]);
        let missing = Classes::of(&place.path().join("none.csv"), &paths(&["a.png"]));
        assert!(matches!(missing, Err(CliError::Classes { .. })));
    }
}
