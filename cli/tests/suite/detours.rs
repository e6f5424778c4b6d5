//! `distances` with paths from ways through third shapes.

use crate::common::{Place, Results};
use crate::distances::{measured, timeless};
use crate::refined::figure_of_limbs;

/// A bar with a short limb at one end, and a long one from its middle at an angle: a rotation as a whole does not help.
fn with_limb(degrees: f64) -> Vec<u8> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let from = [0.5, 0.35];
    let to = [from[0] + 0.45 * cos, from[1] + 0.45 * sin];
    let bar = ([[0.16, 0.3], [0.84, 0.3]], 0.2);
    let short = ([[0.16, 0.3], [0.16, 0.55]], 0.1);
    figure_of_limbs(&[bar, short, ([from, to], 0.09)])
}

/// A limb that moves far is drawn in, and grows elsewhere: that is longer than the way through a shape on which it has
/// moved a part of the way.
#[test]
fn ways_through_third_shapes_shorten_paths() {
    let place = Place::new();
    let inputs = ["right.npy", "up.npy", "left.npy"];
    for (name, degrees) in inputs.into_iter().zip([25.0, 90.0, 110.0]) {
        place.write(name, &with_limb(degrees));
    }
    let of = |options: &[&str], output: &str| {
        let options = [&["--align", "none"], options].concat();
        measured(&place, &inputs, &options, output)
    };
    let direct = of(&["--detours", "0"], "direct");
    let distance =
        |found: &Results, i: usize, j: usize| found.numbers(&format!("/distances/matrix/{i}"))[j];
    let way = distance(&direct, 0, 1) + distance(&direct, 1, 2);
    assert!(distance(&direct, 0, 2) > 1.2 * way);
    assert_eq!(direct.json["distances"]["triangles"]["violations"], 1);
    let has = |found: &Results, cause: &str| {
        let doubts = found.json["doubts"].as_array().unwrap().iter();
        doubts.filter(|doubt| doubt["what"] == cause).count()
    };
    assert_eq!(has(&direct, "triangle_inequality"), 1);

    let found = of(&[], "shortened");
    assert_eq!(found.json["distances"]["triangles"]["violations"], 0);
    assert_eq!(has(&found, "triangle_inequality"), 0);
    assert_eq!(found.json["detours"]["kept"], 1);
    // It leaves the third shape, and is shorter than the way through that.
    assert!(
        distance(&found, 0, 2) < 1.01 * way,
        "{}",
        distance(&found, 0, 2) / way
    );
    let [paths, before] = [&found, &direct].map(|found| timeless(found)["paths"].clone());
    for (path, before) in (0..6).map(|k| (&paths[k], &before[k])) {
        let mut ends = [&path["start"], &path["end"]].map(|end| end.as_u64().unwrap());
        ends.sort_unstable();
        if ends == [0, 2] {
            assert_eq!(path["through"], 1);
            assert_eq!(path["elastic"], before["elastic"]);
        } else {
            assert_eq!(path, before);
        }
    }
    // A finished result is continued, whichever rounds it had.
    let merged = of(&["--merge", "direct"], "merged");
    assert_eq!(timeless(&merged), timeless(&found));
}
