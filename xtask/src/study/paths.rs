//! Paths between letters and other built-in shapes, computed by the program itself: the tables of
//! geodesics of the notes, recomputed.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::Section;
use super::real::build;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Overlap that the end of a path should reach.
const LEAST_DICE: f64 = 0.98;
/// Largest allowed relative difference between the lengths in both directions at the largest `K`.
const LACK_OF_SYMMETRY: f64 = 0.05;

/// Largest allowed excess of the direct path over a detour at the largest `K`: a tenth of that of
/// the elastic energy of disks.
const EXCESS: f64 = 0.005;
/// The form that has an area term.
const LEVEL_SETS: [&str; 2] = ["--form", "level-sets"];

/// A temporary folder for shapes and results.
pub struct Place {
    /// Working directory of the commands.
    pub folder: PathBuf,
}

/// Results of a path.
pub struct Found {
    length: f64,
    /// In the units of the inputs, which are the same for all shapes.
    pub input_length: f64,
    dissipation: f64,
    /// Overlap of the deformed start shape with the end shape.
    pub dice: f64,
    /// Overlap of the pulled-back end shape with the start shape.
    pub pulled: f64,
    certified: bool,
    min_det: f64,
    volumes: Vec<f64>,
    boundaries: Vec<f64>,
    seconds: f64,
}

impl Place {
    /// Creates the folder and builds the program.
    pub fn new() -> Outcome<Self> {
        build()?;
        let name = format!("shapespace-paths-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder)?;
        Ok(Self { folder })
    }

    /// Runs the program.
    pub fn run(&self, arguments: &[&str]) -> Outcome<()> {
        // The program is in the folder of this one.
        let program = std::env::current_exe()?.with_file_name("shapespace");
        let output = Command::new(program)
            .args(arguments)
            .current_dir(&self.folder)
            .output()?;
        if output.status.success() {
            Ok(())
        } else {
            Err(String::from_utf8_lossy(&output.stderr).into_owned().into())
        }
    }

    fn draw(&self, name: &str, arguments: &[&str]) -> Outcome<()> {
        let file = format!("{name}.npy");
        self.run(&[&["generate"], arguments, &["-o", &file]].concat())
    }

    /// Draws letters.
    pub fn letters(&self, letters: &[&str]) -> Outcome<()> {
        for letter in letters {
            self.draw(letter, &["letter", letter])?;
        }
        Ok(())
    }

    /// The path between two drawn shapes.
    pub fn geodesic(&self, start: &str, end: &str, options: &[&str]) -> Outcome<Found> {
        let ends = [start, end].map(|name| format!("{name}.npy"));
        let output = "out";
        let fixed = [
            "geodesic",
            &ends[0],
            &ends[1],
            "--allow-doubtful",
            "-o",
            output,
        ];
        let arguments = [&fixed, options].concat();
        self.run(&arguments)?;
        let folder = self.folder.join(output);
        let record: Value = serde_json::from_str(&read(&folder.join("result.json"))?)?;
        std::fs::remove_dir_all(&folder)?;
        let number = |key: &str| {
            record
                .pointer(key)
                .and_then(Value::as_f64)
                .ok_or(key.to_owned())
        };
        let list = |key: &str| -> Vec<f64> {
            let values = record[key].as_array().cloned().unwrap_or_default();
            values.iter().filter_map(Value::as_f64).collect()
        };
        Ok(Found {
            length: number("/length")?,
            input_length: number("/length_input_units")?,
            dissipation: number("/dissipation")?,
            dice: number("/dice_end")?,
            pulled: number("/dice_pulled")?,
            certified: record["certificate"]["certified"] == true,
            min_det: number("/certificate/min_det")?,
            volumes: list("volumes"),
            boundaries: list("boundaries"),
            seconds: number("/seconds")?,
        })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // Files that remain are in the folder for temporary files.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn read(path: &Path) -> Outcome<String> {
    Ok(std::fs::read_to_string(path)?)
}

impl Found {
    fn cells(&self) -> [String; 3] {
        [
            format!("{:.4}", self.length),
            checked(
                format!("{:.3} / {:.3}", self.dice, self.pulled),
                self.pulled.max(self.dice) >= LEAST_DICE,
            ),
            checked(format!("{:.0e}", self.min_det), self.certified),
        ]
    }
}

/// Lengths for `K = 4, 8, 16`, there and back, and under variations of a shape.
pub fn letters() -> Outcome<Section> {
    let place = Place::new()?;
    place.letters(&["m", "o", "x", "c", "b", "b2"])?;
    let mut table = Table::new([
        "from, to",
        "K",
        "L",
        "Dice carried / pulled",
        "least det",
        "L², Diss",
        "seconds",
    ]);
    let mut lengths = Vec::new();
    for (start, end) in [
        ("m", "o"),
        ("o", "m"),
        ("x", "m"),
        ("m", "x"),
        ("b", "o"),
        ("b2", "o"),
        ("b", "b2"),
    ] {
        for steps in ["4", "8", "16"] {
            let options = ["--grid", "65", "-K", steps];
            let found = place.geodesic(start, end, &options)?;
            let [length, dice, det] = found.cells();
            let squares = (found.length.powi(2), found.dissipation);
            table.row([
                format!("{start} {end}"),
                steps.into(),
                length,
                dice,
                det,
                checked(
                    format!("{:.4} {:.4}", squares.0, squares.1),
                    squares.0 <= squares.1 * (1.0 + 1e-12),
                ),
                format!("{:.0}", found.seconds),
            ]);
            lengths.push(((start, end, steps), found.length));
        }
    }
    let length = |start, end| {
        let mut found = lengths.iter().filter(|(key, _)| *key == (start, end, "16"));
        found.next().map_or(f64::NAN, |(_, length)| *length)
    };
    for (a, b) in [("m", "o"), ("x", "m")] {
        let (there, back) = (length(a, b), length(b, a));
        let lack = 2.0 * (there - back).abs() / (there + back);
        table.row([
            format!("{a} {b} against {b} {a}"),
            "16".into(),
            checked(format!("{:.1} %", 100.0 * lack), lack <= LACK_OF_SYMMETRY),
            String::new(),
            String::new(),
            String::new(),
            String::new(),
        ]);
    }
    let (change, bound) = (
        (length("b", "o") - length("b2", "o")).abs(),
        length("b", "b2"),
    );
    table.row([
        "b o against b2 o, and b b2".into(),
        "16".into(),
        checked(format!("{change:.4} <= {bound:.4}"), change <= bound),
        String::new(),
        String::new(),
        String::new(),
        String::new(),
    ]);
    Ok(Section {
        title: "Paths between letters",
        text: "`shapespace geodesic START.npy END.npy --grid 65 -K K` on letters drawn by `shapespace \
               generate letter`. Ends must be reached with a Dice overlap of .98, no deformation may \
               fold inside its object, the lengths in both directions may differ by at most 5 % at \
               K = 16, and a change of one end may change the length at most by the length of that \
               change.",
        table,
        chart: None,
    })
}

/// The triangle inequality of the length, compared with that of the elastic distance.
pub fn triangles() -> Outcome<Section> {
    let place = Place::new()?;
    for (name, radius) in [("small", ".15"), ("middle", ".22"), ("large", ".3")] {
        place.draw(name, &["disk", "--radius", radius])?;
    }
    for (name, angle) in [("straight", "180"), ("bent", "130"), ("folded", "80")] {
        place.draw(name, &["bar", "--angle", angle])?;
    }
    let mut table = Table::new([
        "from, over, to",
        "elastic",
        "",
        "L, K = 4",
        "",
        "L, K = 8",
        "",
        "L, K = 16",
        "",
    ]);
    for [a, b, c] in [
        ["small", "middle", "large"],
        ["large", "middle", "small"],
        ["straight", "bent", "folded"],
    ] {
        let mut cells = vec![format!("{a} {b} {c}")];
        for steps in ["1", "4", "8", "16"] {
            let length = |from: &str, to: &str| -> Outcome<f64> {
                let options = ["--grid", "129", "-K", steps];
                Ok(place.geodesic(from, to, &options)?.input_length)
            };
            let (direct, over) = (length(a, c)?, length(a, b)? + length(b, c)?);
            let excess = direct / over - 1.0;
            cells.push(format!("{direct:.3}, {over:.3}"));
            cells.push(checked(
                format!("{:+.2} %", 100.0 * excess),
                steps != "16" || excess < EXCESS,
            ));
        }
        table.row(cells);
    }
    Ok(Section {
        title: "Triangle inequality",
        text: "Roots of the elastic energy (`-K 1`) and lengths of `shapespace geodesic --grid \
               129`, in units of the inputs: of the direct path and of the path through the middle \
               shape, and the excess of the direct path. The root of the elastic energy is not a \
               distance: a detour can be shorter. The length converges to a distance as K grows: \
               the excess decreases as 1/K.",
        table,
        chart: None,
    })
}

/// Compressible and nearly incompressible materials, and the area term.
pub fn materials() -> Outcome<Section> {
    let place = Place::new()?;
    place.letters(&["m", "o"])?;
    place.draw("straight", &["bar", "--angle", "180"])?;
    place.draw("folded", &["bar", "--angle", "80"])?;
    let mut table = Table::new([
        "path",
        "options",
        "L",
        "Dice carried / pulled",
        "least det",
        "areas of the shapes 0 ... K",
        "lengths of their boundaries",
    ]);
    let (bars, letters) = (("straight", "folded"), ("m", "o"));
    for ((start, end), options) in [
        (bars, vec!["--lambda", ".01"]),
        (bars, vec!["--lambda", "1"]),
        (bars, vec!["--lambda", "100"]),
        (letters, vec!["--lambda", ".01"]),
        (letters, vec!["--lambda", "1"]),
        (letters, vec!["--lambda", "100"]),
        (letters, vec!["--lambda", "100", "--starts", "3"]),
        (
            letters,
            vec![LEVEL_SETS[0], LEVEL_SETS[1], "--area-weight", "1e-9"],
        ),
        (
            letters,
            vec![LEVEL_SETS[0], LEVEL_SETS[1], "--area-weight", "1e-3"],
        ),
        (
            letters,
            vec![LEVEL_SETS[0], LEVEL_SETS[1], "--area-weight", "1e-1"],
        ),
    ] {
        let usual = ["--grid", "65", "-K", "8"];
        let found = place.geodesic(start, end, &[&usual, options.as_slice()].concat())?;
        let [length, dice, det] = found.cells();
        let series = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|v| format!("{v:.3}")).collect();
            values.join(" ")
        };
        table.row([
            format!("{start} {end}"),
            options.join(" "),
            length,
            dice,
            det,
            series(&found.volumes),
            series(&found.boundaries),
        ]);
    }
    Ok(Section {
        title: "Materials and the area term along paths",
        text: "`shapespace geodesic START.npy END.npy --grid 65 -K 8 OPTIONS`. mu is 1. A fluid of large \
               lambda preserves its area if the end shapes allow it. The area term is one of the form \
               of level sets.",
        table,
        chart: None,
    })
}
