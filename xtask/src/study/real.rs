//! Real shapes, averaged by the program itself.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::solvers::ITERATIONS;
use super::{Section, root};
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Sets of files, their options and their grids.
struct Set {
    name: &'static str,
    files: Vec<PathBuf>,
    /// The files as typed by a user.
    typed: &'static str,
    options: &'static [&'static str],
    grids: &'static [usize],
    least_dice: f64,
}

/// Pictures.
pub fn flat(data: &Path) -> Outcome<Section> {
    let letters = std::fs::read_dir(data.join("glyphs"))?
        .map(|entry| Ok(entry?.path().join("A.png")))
        .collect::<std::io::Result<Vec<_>>>()?;
    let mut letters: Vec<PathBuf> = letters.into_iter().filter(|path| path.is_file()).collect();
    letters.sort();
    let sets = [
        Set {
            name: "device7, all",
            files: files(&data.join("mpeg7/device7"), ".png")?,
            typed: "data/mpeg7/device7/*.png --align rigid",
            options: &["--align", "rigid"],
            grids: &[129, 257],
            least_dice: 0.97,
        },
        Set {
            name: "hands",
            files: files(&data.join("hands/mask512"), ".png")?,
            typed: "data/hands/mask512/*.png",
            options: &[],
            grids: &[129, 257],
            least_dice: 0.97,
        },
        Set {
            name: "letter A",
            files: letters,
            typed: "data/glyphs/*/A.png",
            options: &[],
            grids: &[129, 257],
            least_dice: 0.97,
        },
    ];
    section("Real shapes in 2D", &sets)
}

/// Volumes.
pub fn solid(data: &Path) -> Outcome<Section> {
    let mut files = files(&data.join("hippocampus/labels"), ".nii.gz")?;
    files.truncate(8);
    let set = Set {
        name: "hippocampi",
        files,
        typed: "the first 8 of data/hippocampus/labels",
        options: &[],
        grids: &[65],
        least_dice: 0.95,
    };
    section("Real shapes in 3D", &[set])
}

pub(super) fn files(folder: &Path, ending: &str) -> Outcome<Vec<PathBuf>> {
    let entries: std::io::Result<Vec<_>> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|e| e.path()))
        .collect();
    let mut files = entries?;
    files.retain(|path| path.to_string_lossy().ends_with(ending));
    files.sort();
    Ok(files)
}

fn section(title: &'static str, sets: &[Set]) -> Outcome<Section> {
    build()?;
    let mut table = Table::new([
        "shapes",
        "command: shapespace average",
        "certified, least det",
        "Dice: mean",
        "least",
        "iterations by level",
        "status",
        "seconds",
        "memory, MiB",
    ]);
    for set in sets {
        for nodes in set.grids {
            measure(set, *nodes, &mut table)?;
        }
    }
    Ok(Section {
        title,
        text: "Every deformation must be certified, the mean Dice overlap of the deformed shapes \
               with the average must be at least .97 in 2D and .95 in 3D, and no level may take \
               more than 40 iterations.",
        table,
        chart: None,
    })
}

/// Builds the program.
pub(super) fn build() -> Outcome<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["build", "--release", "--package", "shapespace"])
        .current_dir(root())
        .status()?;
    if status.success() {
        Ok(())
    } else {
        Err("the program could not be built".into())
    }
}

fn measure(set: &Set, nodes: usize, table: &mut Table) -> Outcome<()> {
    // The program is in the folder of this one.
    let program = std::env::current_exe()?.with_file_name("shapespace");
    let place = std::env::temp_dir().join(format!("shapespace-study-{}", std::process::id()));
    let grid = nodes.to_string();
    let output = Command::new(program)
        .arg("average")
        .args(&set.files)
        .args(set.options)
        .args(["--grid", &grid, "--allow-doubtful", "-o"])
        .arg(&place)
        .output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    let text = std::fs::read_to_string(place.join("result.json"))?;
    std::fs::remove_dir_all(&place)?;
    let record: Value = serde_json::from_str(&text)?;
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let dice: Vec<f64> = list(&record["dice"]).iter().map(number).collect();
    let mean = dice.iter().sum::<f64>() / dice.len() as f64;
    let least = dice.iter().fold(1.0f64, |a, b| a.min(*b));
    let levels = list(&record["levels"]);
    let iterations = levels.iter().map(|level| {
        let good = level["iterations"]
            .as_u64()
            .is_some_and(|n| n <= ITERATIONS as u64);
        checked(level["iterations"].to_string(), good)
    });
    let certificate = &record["certificate"];
    let certified = certificate["certified"] == true;
    let det = number(&certificate["min_det"]);
    let status = record["status"].as_str().unwrap_or("?").to_owned();
    table.row([
        format!("{} ({})", set.name, dice.len()),
        format!("`{} --grid {grid}`", set.typed),
        checked(
            format!("{}, {det:.3}", if certified { "yes" } else { "no" }),
            certified,
        ),
        checked(format!("{mean:.4}"), mean >= set.least_dice),
        format!("{least:.4}"),
        iterations.collect::<Vec<_>>().join(", "),
        status,
        format!("{:.1}", number(&record["seconds"])),
        format!("{:.0}", number(&record["peak_memory_bytes"]) / 1048576.0),
    ]);
    Ok(())
}
