//! Links between documents, and from documents to pictures.

use std::fs;
use std::io;
use std::path::Path;

use super::Finding;

/// Checks the Markdown files of the root and of `docs`.
pub fn check(root: &Path) -> io::Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for folder in [root.to_path_buf(), root.join("docs")] {
        if !folder.is_dir() {
            continue;
        }
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.extension().is_none_or(|e| e != "md") {
                continue;
            }
            let text = fs::read_to_string(&path)?;
            for (line, target) in broken(&text, |target| folder.join(target).exists()) {
                findings.push(Finding {
                    path: path.strip_prefix(root).unwrap_or(&path).into(),
                    line: Some(line),
                    message: format!("there is no {target}"),
                });
            }
        }
    }
    findings.sort_by(|a, b| (&a.path, a.line).cmp(&(&b.path, b.line)));
    Ok(findings)
}

/// Lines and targets of links to files that do not exist.
fn broken(text: &str, exists: impl Fn(&str) -> bool) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (i, line) in text.lines().enumerate() {
        for rest in line.split("](").skip(1) {
            let target = rest.split(')').next().unwrap_or(rest);
            let file = target.split('#').next().unwrap_or(target);
            let elsewhere = file.is_empty() || target.contains("://");
            if !elsewhere && !exists(file) {
                found.push((i + 1, target.to_owned()));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_to_missing_files_are_found() {
        let text = "[a](here.md) and ![b](gone.png)\n[c](https://x.org) [d](#e) [f](here.md#g)\n";
        let found = broken(text, |target| target == "here.md");
        assert_eq!(found, [(1, "gone.png".to_owned())]);
    }
}
