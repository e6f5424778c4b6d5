//! Partially hidden letters.

use std::path::Path;

use fe_grid::{Field, ScalarField};
use shapespace::output::npy::{Precision, write_field};
use shapespace_input::{AnyImage, ReadOptions, read_image};

use super::Section;
use super::paths::Place;
use crate::outcome::Outcome;
use crate::table::{Table, checked};

/// Largest allowed relative change of a length by a hidden part.
const CHANGE: f64 = 0.1;

/// Letters, and centres of the disks that hide a part of them.
const SCREENS: [(&str, &str, [f64; 2], f64); 2] =
    [("b", "b2", [0.35, 0.5], 0.09), ("x", "m", [0.3, 0.3], 0.1)];

/// Lengths with a part hidden, compared with those of the whole letters.
pub fn section() -> Outcome<Section> {
    let place = Place::new()?;
    let mut table = Table::new([
        "from, to",
        "what is known",
        "length",
        "against the whole",
        "Dice carried / pulled",
    ]);
    for (hidden, template, centre, radius) in SCREENS {
        place.letters(&[hidden, template])?;
        screen(&place.folder, hidden, centre, radius)?;
        let covered = format!("{hidden}-covered");
        let seen = format!("{hidden}-seen.npy");
        let there = (covered.as_str(), template);
        let back = (template, covered.as_str());
        for ((start, end), which, part) in [(there, "start", there), (back, "end", back)] {
            let whole = |name: &str| name.trim_end_matches("-covered").to_owned();
            let valid = format!("--valid-{which}");
            let runs: [(&str, Vec<&str>); 4] = [
                ("all of it", vec![]),
                ("the rest, taken for the whole", vec![]),
                (
                    "the rest, and that some is hidden",
                    vec!["--occluded", which],
                ),
                ("the rest, and where nothing is seen", vec![&valid, &seen]),
            ];
            let mut all = f64::NAN;
            for (i, (known, options)) in runs.into_iter().enumerate() {
                let usual = ["--form", "level-sets", "--grid", "65", "-K", "4"];
                let ends = if i == 0 {
                    (whole(start), whole(end))
                } else {
                    (part.0.to_owned(), part.1.to_owned())
                };
                let options = [&usual, options.as_slice()].concat();
                let found = place.geodesic(&ends.0, &ends.1, &options)?;
                if i == 0 {
                    all = found.input_length;
                }
                let change = found.input_length / all - 1.0;
                table.row([
                    format!("{} {}", whole(start), whole(end)),
                    known.into(),
                    format!("{:.2}", found.input_length),
                    checked(
                        format!("{:+.1} %", 100.0 * change),
                        i != 3 || change.abs() <= CHANGE,
                    ),
                    format!("{:.3} / {:.3}", found.dice, found.pulled),
                ]);
            }
        }
    }
    Ok(Section {
        title: "Letters of which a part is hidden",
        text: "`shapespace geodesic START.npy END.npy --form level-sets --grid 65 -K 4`, in units \
               of the inputs; a disk hides a part of the first letter of each pair. If the rest is \
               treated as the whole letter, the distance changes. With `--occluded` parts may be \
               hidden anywhere: the path only has to cover the visible part, and is too short if \
               shapes have to grow. With `--valid-start` and `--valid-end` the hidden region is \
               known; the length must change by less than a tenth.",
        table,
        chart: None,
    })
}

/// Writes a letter without the part in a disk, and a mask of its visible part.
fn screen(folder: &Path, letter: &str, centre: [f64; 2], radius: f64) -> Outcome<()> {
    let file = folder.join(format!("{letter}.npy"));
    let AnyImage::D2(image) = read_image(&file, &ReadOptions::default())? else {
        return Err("letters are flat".into());
    };
    let grid = fe_grid::Grid::cube(image.size[0]);
    let whole: ScalarField<f64, 2> = Field::from_vec(grid, image.values.into_vec())?;
    let seen = ScalarField::<f64, 2>::from_fn(grid, |[x, y]| {
        let hidden = (x - centre[0]).hypot(y - centre[1]) < radius;
        [if hidden { 0.0 } else { 1.0 }]
    });
    let left = whole.as_slice().iter().zip(seen.as_slice());
    let covered = Field::from_vec(grid, left.map(|(value, seen)| value * seen).collect())?;
    for (name, field) in [("covered", &covered), ("seen", &seen)] {
        let file = folder.join(format!("{letter}-{name}.npy"));
        write_field(&file, field, Precision::Double)?;
    }
    Ok(())
}
