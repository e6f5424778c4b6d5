//! `cargo xtask figures`: regenerates docs/figures, every figure of `shapespace figure` on built-in
//! shapes.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// The figures in the order of the page, with their options.
const FIGURES: [(&str, &[&str]); 12] = [
    ("weights", &[]),
    ("median", &["--grid", "65"]),
    (
        "force-balance",
        &["--tolerance", "1e-7", "--max-iterations", "1000"],
    ),
    ("elastic-domain", &[]),
    ("stiffness", &[]),
    ("adding-shapes", &[]),
    (
        "mismatch-weight",
        &["--tolerance", "1e-7", "--max-iterations", "1000"],
    ),
    ("large-bends", &[]),
    ("missing-parts", &[]),
    (
        "inverse-model",
        &["--tolerance", "1e-7", "--max-iterations", "1000"],
    ),
    ("pins", &[]),
    ("modes", &[]),
];

/// Runs the task; with names, only for those figures.
pub fn run(names: &[String]) -> ExitCode {
    match make(names) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn make(names: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let known = |name: &String| FIGURES.iter().any(|(known, _)| known == name);
    if let Some(name) = names.iter().find(|name| !known(name)) {
        return Err(format!("there is no figure {name}").into());
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let docs = root.join("docs/figures");
    std::fs::create_dir_all(&docs)?;
    let place = std::env::temp_dir().join(format!("shapespace-figures-{}", std::process::id()));
    std::fs::create_dir_all(&place)?;
    for (name, options) in FIGURES {
        if !names.is_empty() && !names.iter().any(|own| own == name) {
            continue;
        }
        let folder = place.join(name);
        figure(&root, name, options, &folder)?;
        let page = std::fs::read_to_string(folder.join("figure.md"))?;
        let page = page.replace("](figure.png)", &format!("]({name}.png)"));
        let command = [&["shapespace figure", name], options].concat().join(" ");
        std::fs::write(
            docs.join(format!("{name}.md")),
            format!("{page}\n`{command} -o {name}`\n"),
        )?;
        std::fs::copy(folder.join("figure.png"), docs.join(format!("{name}.png")))?;
    }
    std::fs::remove_dir_all(&place)?;
    std::fs::write(docs.join("README.md"), contents(&docs))?;
    Ok(())
}

fn figure(
    root: &Path,
    name: &str,
    options: &[&str],
    folder: &PathBuf,
) -> Result<(), Box<dyn std::error::Error>> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .current_dir(root)
        .args(["run", "--release", "--package", "shapespace", "--"])
        .args(["figure", name])
        .args(options)
        .arg("-o")
        .arg(folder)
        .status()?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("cannot create the figure {name}").into())
    }
}

/// The list of all figures with their titles.
fn contents(docs: &Path) -> String {
    let mut text =
        "# Figures\n\nMade by `cargo xtask figures`; each by the command under it.\n\n".to_owned();
    for (name, _) in FIGURES {
        let Ok(page) = std::fs::read_to_string(docs.join(format!("{name}.md"))) else {
            continue;
        };
        let title = page.lines().next().unwrap_or(name).trim_start_matches("# ");
        let _ = writeln!(text, "- [{title}]({name}.md)");
    }
    text
}
