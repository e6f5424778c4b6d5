//! Short names of the inputs, for the picture.

use std::path::Path;

use shapespace_input::without_ending;

/// Longest label that fits under the tiles of many inputs.
const SHORT: usize = 12;

/// Distinct names for paths: the file names without extensions; where these are equal, with the folder in
/// front, or else with the extension, or else the whole path; long names are shortened by their common beginning
/// and end. Paths that are equal have equal names.
pub(crate) fn labels(paths: &[&Path]) -> Vec<String> {
    let names =
        |way: fn(&Path) -> String| -> Vec<String> { paths.iter().map(|path| way(path)).collect() };
    let ways = [stem, with_folder, file_name, whole];
    let mut distinct = ways
        .into_iter()
        .map(names)
        .filter(|names| all_differ(names));
    // Equal paths have no names that differ.
    let names = distinct.next().unwrap_or_else(|| names(with_folder));
    if names.len() < 2 || names.iter().all(|name| name.chars().count() <= SHORT) {
        return names;
    }
    let (head, tail) = (common(&names, false), common(&names, true));
    let short: Vec<String> = names
        .iter()
        .map(|name| {
            let length = name.chars().count();
            name.chars()
                .take(length.saturating_sub(tail))
                .skip(head)
                .collect()
        })
        .collect();
    if all_differ(&short) && short.iter().all(|name| !name.is_empty()) {
        short
    } else {
        names
    }
}

/// Longest name of an input in the name of a file: with what comes before and after it, it is no longer than file
/// systems allow, whatever its characters.
const LONGEST: usize = 48;

/// Distinct names for files that belong to inputs, such as `mask_fish` for `fish.png`: the kind, and the name of the
/// input without extension. Where two are equal but for their case, which not all systems tell apart, all have
/// the number of their input as well. A name that begins with the kind is not given it again.
pub(crate) fn file_names(kind: &str, paths: &[&Path]) -> Vec<String> {
    let kind = format!("{kind}_");
    let short = |path: &&Path| -> String {
        let stem = stem(path);
        let name = stem.strip_prefix(&kind).unwrap_or(&stem);
        kind.chars().chain(name.chars().take(LONGEST)).collect()
    };
    let names: Vec<String> = paths.iter().map(short).collect();
    let folded: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
    if all_differ(&folded) {
        return names;
    }
    let numbered = names.into_iter().enumerate();
    numbered.map(|(i, name)| format!("{name}_{i:03}")).collect()
}

fn all_differ(names: &[String]) -> bool {
    let mut sorted: Vec<&String> = names.iter().collect();
    sorted.sort();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

fn whole(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// The name of a file without its ending.
pub(crate) fn stem(path: &Path) -> String {
    without_ending(&file_name(path)).to_owned()
}

/// The name of the folder of a file, and that of the file without its ending.
pub(crate) fn with_folder(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name);
    match folder {
        Some(folder) => format!("{}/{}", folder.to_string_lossy(), stem(path)),
        None => stem(path),
    }
}

/// Characters that all names have in common at one end, as far as the last one that is neither
/// letter nor digit: numbers and words stay whole.
fn common(names: &[String], at_end: bool) -> usize {
    let characters = |name: &String| -> Vec<char> {
        if at_end {
            name.chars().rev().collect()
        } else {
            name.chars().collect()
        }
    };
    let first = characters(&names[0]);
    let shared = names[1..].iter().fold(first.len(), |shared, name| {
        let pairs = first.iter().zip(characters(name));
        shared.min(pairs.take_while(|(a, b)| **a == *b).count())
    });
    let whole = first[..shared].iter().rposition(|c| !c.is_alphanumeric());
    whole.map_or(0, |last| last + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(paths: &[&str], expected: &[&str]) {
        let paths: Vec<&Path> = paths.iter().map(|path| Path::new(*path)).collect();
        assert_eq!(labels(&paths), expected);
    }

    #[test]
    fn files_have_the_names_of_inputs() {
        let named = |paths: &[&str]| {
            let paths: Vec<&Path> = paths.iter().map(|path| Path::new(*path)).collect();
            file_names("mask", &paths)
        };
        assert_eq!(
            named(&["x/fish.png", "y/brain.nii.gz"]),
            ["mask_fish", "mask_brain"]
        );
        assert_eq!(named(&["mask_000.npy"]), ["mask_000"]);
        assert_eq!(
            named(&["x/a.png", "y/A.png", "y/b.png"]),
            ["mask_a_000", "mask_A_001", "mask_b_002"]
        );
        assert_eq!(
            named(&["a.png", "mask_a.png"]),
            ["mask_a_000", "mask_a_001"]
        );
        // An umlaut is cut off as a whole.
        let long = format!("{}.png", "ö".repeat(99));
        assert_eq!(named(&[&long]), [format!("mask_{}", "ö".repeat(LONGEST))]);
    }

    #[test]
    fn labels_tell_inputs_apart() {
        check(&["a/bar_000.npy", "b/bent.PNG"], &["bar_000", "bent"]);
        check(
            &["x/hippocampus_001.nii.gz", "x/hippocampus_013.nii.gz"],
            &["001", "013"],
        );
        check(
            &["/g/DejaVuSans-Bold/A.png", "/g/DejaVuSerif/A.png"],
            &["DejaVuSans-Bold", "DejaVuSerif"],
        );
        // One shape in two formats, and files of the same name in folders of the same name.
        check(&["x/a.tif", "x/a.bmp"], &["a.tif", "a.bmp"]);
        check(
            &["sub-01/anat/mask.nii.gz", "sub-02/anat/mask.nii.gz"],
            &["01", "02"],
        );
        check(&["m.npy", "m.npy"], &["m", "m"]);
        check(
            &["averylongname.npy", "averylongname.npy"],
            &["averylongname", "averylongname"],
        );
    }
}
