//! Grids of boxes: of given nodes, of given spacing, and around the shapes.
//!
//! A box that fits has the spacing of the cube and nodes of it, so that results are compared at the
//! same nodes. They differ by what the void beyond the box contributes. Its stiffness is 1e-4 of that of
//! the shapes.

use serde_json::Value;

use crate::average::averaged;
use crate::common::solid::{Affine, nifti_of};
use crate::common::{Place, Results, arrays, grey_png, npy_f64, picture_size, succeeded};

/// Samples of pictures of rods along `x` and `y`.
const SIZE: [usize; 2] = [120, 80];
/// Minimisations to nearly the end, so that they differ in their energies, not in where they stop.
const EXACT: [&str; 4] = ["--tolerance", "1e-8", "--max-iterations", "2000"];

/// Inside a rod along `x` about the middle of a box, with a knob: a ramp of two samples.
fn rod([x, y]: [f64; 2], half_length: f64, radius: f64, knob: f64) -> f64 {
    let along = (x.abs() - half_length).max(0.0);
    let body = radius - along.hypot(y);
    let end = 1.4 * radius - (x - knob).hypot(y - 0.8 * radius);
    (0.5 + 0.5 * body.max(end)).clamp(0.0, 1.0)
}

/// Two rods as pictures.
fn rods(place: &Place) -> Vec<String> {
    let shapes = [("long", 38.0, 7.0, 20.0), ("thick", 33.0, 9.0, 6.0)];
    let draw = |(name, length, radius, knob): (&str, f64, f64, f64)| {
        let grey = (0..SIZE[0] * SIZE[1]).map(|i| {
            let at = [i % SIZE[0], i / SIZE[0]];
            let p = [0, 1].map(|k| at[k] as f64 - 0.5 * (SIZE[k] - 1) as f64);
            (255.0 * rod(p, length, radius, knob)).round() as u8
        });
        let name = format!("{name}.png");
        place.write(
            &name,
            &grey_png(SIZE[0] as u32, SIZE[1] as u32, &grey.collect::<Vec<_>>()),
        );
        name
    };
    shapes.map(draw).into()
}

/// The volumes of two rods, of half a millimetre a sample, anywhere in the world.
fn solid_rods(place: &Place) -> Vec<String> {
    let size = [88, 40, 36];
    let affine: Affine = [
        [0.5, 0.0, 0.0, -70.0],
        [0.0, 0.5, 0.0, 12.0],
        [0.0, 0.0, 0.5, 30.0],
    ];
    let shapes = [("long", 30.0, 7.0, 14.0), ("thick", 27.0, 8.5, 4.0)];
    let draw = |(name, length, radius, knob): (&str, f64, f64, f64)| {
        let values = (0..size.iter().product()).map(|i: usize| {
            let at = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            let [x, y, z] = [0, 1, 2].map(|k| at[k] as f64 - 0.5 * (size[k] - 1) as f64);
            rod([x, y.hypot(z)], length, radius, knob) as f32
        });
        let name = format!("{name}.nii");
        place.write(&name, &nifti_of(size, &affine, &values.collect::<Vec<_>>()));
        name
    };
    shapes.map(draw).into()
}

fn nodes(results: &Results) -> Vec<usize> {
    let nodes = results.numbers("/nodes");
    nodes.into_iter().map(|n| n as usize).collect()
}

/// The values of an array on a cube at the nodes of a box in its middle.
fn middle(cube: &[f64], n: &[usize], own: &[usize]) -> Vec<f64> {
    let count = own.iter().product();
    let value = |mut index: usize| {
        let (mut at, mut stride) = (0, 1);
        for (all, own) in n.iter().zip(own) {
            assert_eq!((all - own) % 2, 0);
            at += stride * (index % own + (all - own) / 2);
            index /= own;
            stride *= all;
        }
        cube[at]
    };
    (0..count).map(value).collect()
}

/// The mean and the largest difference of an array of two results at common nodes.
fn apart(cube: &Results, fit: &Results, name: &str) -> [f64; 2] {
    let ((_, all), (_, own)) = (cube.array(name), fit.array(name));
    let all = middle(&all, &nodes(cube), &nodes(fit));
    assert_eq!(all.len(), own.len());
    let differences: Vec<f64> = all.iter().zip(&own).map(|(a, b)| (a - b).abs()).collect();
    let most = differences.iter().copied().fold(0.0, f64::max);
    [differences.iter().sum::<f64>() / own.len() as f64, most]
}

fn run(place: &Place, command: &[&str], inputs: &[String], options: &[&str]) -> Results {
    let output = options.last().unwrap();
    let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
    succeeded(&place.compute(&[command, &inputs, options].concat()));
    Results::read(&place.path(output))
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

#[test]
fn averages_in_a_box_that_fits_are_those_of_the_cube() {
    let place = Place::new();
    let inputs = rods(&place);
    let options = [&EXACT[..], &["--grid", "65"]].concat();
    let cube = averaged(&place, &inputs, &options, "cube");
    let fit = averaged(&place, &inputs, &[&options[..], &["--box", "fit"]].concat(), "fit");
    assert_eq!(nodes(&cube), [65, 65]);
    assert_eq!(nodes(&fit)[0], 65);
    assert!((29..=41).contains(&nodes(&fit)[1]), "{:?}", nodes(&fit));
    assert_eq!(fit.json["spacing"], cube.json["spacing"]);
    println!("{:?}", apart(&cube, &fit, "average.npy"));
    for k in ["/energy/elastic/0", "/energy/elastic/1", "/energy/total", "/average/area"] {
        println!("{k} {} {}", cube.number(k), fit.number(k));
    }
    println!("{} {}", cube.json["memory_estimate"], fit.json["memory_estimate"]);
}
