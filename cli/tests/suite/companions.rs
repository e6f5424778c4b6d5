//! Images that belong to an input, its visible part, a variation of it, or what is carried with it, lie by their own
//! places in the world, however they are stored.

use crate::common::solid::{mapped, nifti_of};
use crate::common::{Place, Results, array_of_singles, succeeded};

const SIZE: [usize; 3] = [40, 30, 1];

/// Writes a picture as it is and with its first axis reversed, with affine maps that send both to one place.
fn written(place: &Place, name: &str, value: impl Fn(f64, f64) -> f64) {
    for (name, step, first) in [
        (name.to_owned(), 1.5, -20.0),
        (format!("{name}_flip"), -1.5, 38.5),
    ] {
        let affine = [
            [step, 0.0, 0.0, first],
            [0.0, 1.5, 0.0, 7.0],
            [0.0, 0.0, 1.0, 0.0],
        ];
        let samples = (0..SIZE[0] * SIZE[1]).map(|n| [n % SIZE[0], n / SIZE[0], 0]);
        let values = samples.map(|sample| {
            let [x, y, _] = mapped(&affine, sample.map(|i| i as f64));
            value(x, y) as f32
        });
        let values: Vec<f32> = values.collect();
        place.write(&format!("{name}.nii"), &nifti_of(SIZE, &affine, &values));
    }
}

/// An egg, blunt on the right.
fn egg(x: f64, y: f64, height: f64) -> f64 {
    let (x, y) = ((x - 10.0) / 16.0, (y - 28.0) / height);
    let width = 1.0 + 0.35 * x;
    (0.5 + 5.0 * (1.0 - x.hypot(y / width))).clamp(0.0, 1.0)
}

#[test]
fn they_are_the_same_in_another_order() {
    let place = Place::new();
    written(&place, "low", |x, y| egg(x, y, 9.0));
    written(&place, "high", |x, y| egg(x, y, 12.0));
    // The right end is hidden.
    written(&place, "seen", |x, _| f64::from(u8::from(x < 18.0)));

    let path = [
        "geodesic", "low.nii", "high.nii", "--grid", "33", "-K", "2", "-o", "path",
    ];
    succeeded(&place.compute(&path));
    let transported = |variation: &str, output: &str| {
        let transport = ["transport", "path", variation, "--steps", "1", "-o", output];
        succeeded(&place.compute(&transport));
        Results::read(&place.path(output)).number("/length_variation")
    };
    let both = [
        transported("high.nii", "up"),
        transported("high_flip.nii", "up_flip"),
    ];
    assert!(
        both[0] > 0.03 && (both[0] - both[1]).abs() < 1e-3 * both[0],
        "{both:?}"
    );

    let average = |seen: &str, output: &str| {
        let average = [
            "average", "low.nii", "high.nii", "--grid", "33", "-o", output,
        ];
        succeeded(&place.compute(&[&average[..], &["--valid", seen, "all"]].concat()));
        Results::read(&place.path(output)).number("/energy/total")
    };
    let both = [
        average("seen.nii", "seen"),
        average("seen_flip.nii", "seen_flip"),
    ];
    assert!((both[0] - both[1]).abs() < 1e-3 * both[0], "{both:?}");

    let warp = [
        "warp",
        "path",
        "low.nii",
        "low_flip.nii",
        "--time",
        "1",
        "-o",
        "carried",
    ];
    succeeded(&place.compute(&warp));
    let [one, other] = ["low", "low_flip"]
        .map(|name| array_of_singles(&place.path(&format!("carried/{name}.npy"))));
    assert_eq!(one.0, other.0);
    let differences = one.1.iter().zip(&other.1).map(|(a, b)| (a - b).abs());
    assert!(differences.fold(0.0, f32::max) < 1e-5);
    assert!(one.1.iter().sum::<f32>() > 100.0);
}

#[test]
fn outlines_have_coordinates_of_their_own() {
    let place = Place::new();
    for radius in [40, 50, 80] {
        let point = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 90.0;
            let [x, y] = [angle.cos(), angle.sin()].map(|c| f64::from(radius) * c);
            format!("{x},{y}\n")
        };
        let points: String = (0..90).map(point).collect();
        place.write(&format!("r{radius}.csv"), points.as_bytes());
    }
    let path = [
        "geodesic", "r40.csv", "r80.csv", "--grid", "33", "-K", "2", "-o", "path",
    ];
    succeeded(&place.compute(&[&path[..], &["--align", "none"]].concat()));
    let length = Results::read(&place.path("path")).number("/length");
    succeeded(&place.compute(&["transport", "path", "r50.csv", "--steps", "1", "-o", "out"]));
    let found = Results::read(&place.path("out"));
    // Distances of disks about one centre are proportional to the difference of their radii.
    let share = found.number("/length_variation") / length;
    assert!((share - 0.25).abs() < 0.02, "{share}");
    // An outline is no mask of what is visible.
    let hidden = [
        "average", "r40.csv", "r50.csv", "--valid", "r80.csv", "all", "-o", "no",
    ];
    let run = place.run(&hidden);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("--valid"));
}
