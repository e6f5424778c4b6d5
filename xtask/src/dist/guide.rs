//! The archive of the guide, with the pictures of `docs` that it links.

use std::fs;
use std::io;
use std::path::Path;
use std::process::ExitCode;

use super::archive::Contents;
use super::step::{Step, is_installed};

/// Where a reader begins: the pages lie as deep as in the repository, so that their links hold.
const INDEX: &str = "<!doctype html><meta charset=\"utf-8\"><title>Shapespace: the guide</title>
<meta http-equiv=\"refresh\" content=\"0; url=book/book/index.html\">
<a href=\"book/book/index.html\">Shapespace: the guide</a>
";

/// Builds the guide, and writes its archive.
pub fn make(output: &Path, version: &str) -> Step {
    if !is_installed("mdbook", &["--version"]) {
        return Step::LeftOut(format!("no mdBook: {}", crate::book::installation()));
    }
    if crate::book::run() != ExitCode::SUCCESS {
        return Step::Failed("mdBook fails".into());
    }
    match written(output, version) {
        Ok(file) => Step::Done(file),
        Err(error) => Step::Failed(error.to_string()),
    }
}

fn written(output: &Path, version: &str) -> io::Result<String> {
    let docs = crate::tidy::root().join("docs");
    let mut contents = Contents::default();
    contents.add("index.html", INDEX.into());
    contents.add_folder(Path::new("book/book"), &docs.join("book/book"), &|_| true)?;
    let is_picture = |path: &Path| path.extension().is_some_and(|ending| ending == "png");
    contents.add_folder(Path::new("figures"), &docs.join("figures"), &is_picture)?;
    for entry in fs::read_dir(&docs)? {
        let path = entry?.path();
        if is_picture(&path) {
            let name = path.file_name().unwrap_or_default();
            contents.add(name, fs::read(&path)?);
        }
    }
    let name = format!("shapespace-{version}-guide");
    let file = format!("{name}.tar.gz");
    contents.write(&output.join(&file), &name)?;
    Ok(file)
}
