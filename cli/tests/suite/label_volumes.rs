//! Volumes of labels before and after `warp`, against the determinants of the deformation.

use shapespace_input::Sources;

use crate::common::solid::{Affine, mapped, nifti_of};
use crate::common::{Place, Results, npy_f64, succeeded};

/// Nodes a side of the flat images, which are those of the grid.
const NODES: usize = 65;

/// The place of a node relative to the middle of the box.
fn from_middle(node: usize) -> [f64; 2] {
    [node % NODES, node / NODES].map(|i| i as f64 / (NODES - 1) as f64 - 0.5)
}

/// Writes an ellipse with these half axes.
fn ellipse(place: &Place, name: &str, [a, b]: [f64; 2]) {
    let value = |node: usize| {
        let [x, y] = from_middle(node);
        (0.5 + (1.0 - (x / a).hypot(y / b)) * 8.0).clamp(0.0, 1.0)
    };
    let values: Vec<f64> = (0..NODES * NODES).map(value).collect();
    place.write(name, &npy_f64(&[NODES, NODES], &values));
}

/// A label map of three sectors of an ellipse.
fn sectors([a, b]: [f64; 2]) -> Vec<f64> {
    let label = |node: usize| {
        let [x, y] = from_middle(node);
        let turn = (y - 0.03).atan2(x + 0.02) / std::f64::consts::TAU + 0.5;
        let inside = f64::from(u8::from((x / a).hypot(y / b) < 1.0));
        inside * (1.0 + (3.0 * turn).min(2.0).floor())
    };
    (0..NODES * NODES).map(label).collect()
}

/// Integrals of cell means over labels, in nodes: around each node there is a quarter of each of its four cells.
fn over_labels(labels: &[f64], of_cells: &[f64]) -> [f64; 3] {
    let cells = NODES - 1;
    let mut sums = [0.0; 3];
    for (cell, mean) in of_cells.iter().enumerate() {
        let [i, j] = [cell % cells, cell / cells];
        for corner in [0, 1, NODES, NODES + 1] {
            let label = labels[i + NODES * j + corner] as usize;
            if label > 0 {
                sums[label - 1] += 0.25 * mean;
            }
        }
    }
    sums
}

/// Areas of the cells after a deformation, over those before: that of the quadrilateral of the corners.
fn areas(deformation: &[f64]) -> Vec<f64> {
    let (cells, plane) = (NODES - 1, NODES * NODES);
    let area = |cell: usize| {
        let first = cell % cells + NODES * (cell / cells);
        let corner = |node: usize| [deformation[node], deformation[plane + node]];
        let [a, b, c, d] = [0, 1, NODES + 1, NODES].map(|step| corner(first + step));
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
        let across = [c[0] - a[0], c[1] - a[1]];
        let other = [d[0] - b[0], d[1] - b[1]];
        0.5 * cross(across, other) * (cells * cells) as f64
    };
    (0..cells * cells).map(area).collect()
}

/// The samples of a label, by its number from 1.
fn counts(values: &[f64]) -> [f64; 3] {
    [1.0, 2.0, 3.0].map(|label| values.iter().filter(|v| **v == label).count() as f64)
}

/// `warp` carries a label, nearest samples, to the image of the squares around its nodes, whose area is the integral
/// of the determinant over them. What is left is the count of samples for an area: with 8 samples in a spacing and a
/// perimeter of `p` of them some `0.3 sqrt(p)` samples, .1 % of the smallest label; and that a quarter of a cell has not
/// quite the determinant of the cell.
#[test]
fn areas_of_labels_are_integrals_of_the_determinant() {
    const FINE: f64 = 8.0;
    let place = Place::new();
    let axes = [[0.2, 0.16], [0.3, 0.27]];
    ellipse(&place, "small.npy", axes[0]);
    ellipse(&place, "large.npy", axes[1]);
    let average = ["average", "small.npy", "large.npy", "--align", "none"];
    let options = ["--grid", "65", "-o", "mean"];
    succeeded(&place.compute(&[&average[..], &options].concat()));
    let found = Results::read(&place.path("mean"));
    for (shape, sides) in axes.into_iter().enumerate() {
        let labels = sectors(sides);
        place.write("parts.npy", &npy_f64(&[NODES, NODES], &labels));
        let (number, out) = (shape.to_string(), format!("carried_{shape}"));
        let warp = ["warp", "mean", "parts.npy", "--shape", &number];
        let options = ["--refine", "8", "-o", &out];
        succeeded(&place.compute(&[&warp[..], &options].concat()));
        let path = place.path(&format!("{out}/parts.npy"));
        let carried = Sources::files().read_numbers(&path).unwrap();
        let after = counts(&carried.values).map(|count| count / FINE.powi(2));
        let (_, stored) = found.array(&format!("determinant_{shape:03}.npy"));
        let (_, deformation) = found.array(&format!("deformation_{shape:03}.npy"));
        let before = counts(&labels);
        for (name, of_cells) in [("stored", stored), ("computed", areas(&deformation))] {
            let expected = over_labels(&labels, &of_cells);
            for label in 0..3 {
                let [before, after, expected] = [before[label], after[label], expected[label]];
                let text = format!("{name} {shape} {label}: {before} {after} {expected}");
                assert!((after / expected - 1.0).abs() < 0.005, "{text}");
                // The labels have grown, or shrunk.
                assert!((after / before - 1.0).abs() > 0.1, "{text}");
            }
        }
    }
}

/// Samples of the volumes, and their spacing in millimetres: from left to right, from front to back and upwards.
const SIZE: [usize; 3] = [31, 33, 23];
const STEPS: [f64; 3] = [1.0, 1.0, 1.5];

fn affine() -> Affine {
    [
        [-STEPS[0], 0.0, 0.0, 30.0],
        [0.0, -STEPS[1], 0.0, -12.0],
        [0.0, 0.0, STEPS[2], 7.0],
    ]
}

/// The volumes of both halves of a ball, in samples; the file has them as labels.
fn halves(place: &Place, name: &str, radius: f64) -> [f64; 2] {
    let affine = affine();
    let middle = mapped(&affine, SIZE.map(|n| 0.5 * (n - 1) as f64));
    let label = |index: usize| {
        let sample = [
            index % SIZE[0],
            index / SIZE[0] % SIZE[1],
            index / SIZE[0] / SIZE[1],
        ];
        let p = mapped(&affine, sample.map(|n| n as f64));
        let away = [0, 1, 2].map(|k| p[k] - middle[k]);
        let inside = away.iter().map(|x| x * x).sum::<f64>() < radius * radius;
        let half = 1.0 + f32::from(u8::from(away[0] + 0.3 * away[2] > 1.2));
        if inside { half } else { 0.0 }
    };
    let values: Vec<f32> = (0..SIZE.iter().product()).map(label).collect();
    place.write(name, &nifti_of(SIZE, &affine, &values));
    [1.0, 2.0].map(|label| values.iter().filter(|v| **v == label).count() as f64)
}

/// In the world: the sum of `1 / det` over a label after the deformation, times the volume of a sample, is its volume
/// before. Counts of samples for volumes are off by some `0.3 sqrt(area)` samples, .5 % of these, on both sides; the
/// determinant, a mean over cells, is interpolated, and beyond the boundary it is that of the void: 1 to 3 % here, of
/// volumes that change by a quarter to a half.
#[test]
fn volumes_of_labels_are_integrals_of_the_jacobian_map() {
    let place = Place::new();
    let radii = [8.0, 11.0];
    let names = ["small.nii", "large.nii"];
    let before = [0, 1].map(|k| halves(&place, names[k], radii[k]));
    let average = ["average", names[0], names[1], "--grid", "33", "-o", "mean"];
    succeeded(&place.compute(&average));
    let read = |name: &str| Sources::files().read_numbers(&place.path(name)).unwrap();
    for shape in 0..2 {
        let (number, out) = (shape.to_string(), format!("carried_{shape}"));
        let warp = ["warp", "mean", names[shape], "--shape", &number, "-o", &out];
        succeeded(&place.compute(&warp));
        let name = names[shape].replace(".nii", ".nii.gz");
        let labels = read(&format!("{out}/{name}"));
        let jacobian = read(&format!("mean/jacobian_{shape:03}.nii.gz"));
        assert_eq!(labels.size, jacobian.size);
        // Samples of the average are as large as those of the first input.
        for (label, before) in before[shape].into_iter().enumerate() {
            let of_label = |(value, _): &(&f64, &f64)| **value == (label + 1) as f64;
            let samples = labels.values.iter().zip(&jacobian.values);
            let dets: Vec<f64> = samples.filter(of_label).map(|(_, det)| *det).collect();
            let back: f64 = dets.iter().map(|det| det.recip()).sum();
            let text = format!("{shape} {label}: {before} {} {back}", dets.len());
            assert!((back / before - 1.0).abs() < 0.05, "{text}");
            assert!((dets.len() as f64 / before - 1.0).abs() > 0.2, "{text}");
        }
    }
}
