//! `distances` on finer grids, for pairs that do not arrive.

use crate::common::{Place, Results, npy_f64, succeeded};
use crate::distances::measured;
use serde_json::Value;

/// A disk with limbs of these corners and widths, in units of the box, as a picture of 257 samples a side.
pub fn disk_with_limbs(limbs: &[([[f64; 2]; 2], f64)]) -> Vec<u8> {
    let disk = ([[0.5; 2]; 2], 0.3);
    figure_of_limbs(&[&[disk], limbs].concat())
}

/// A figure of segments with their widths.
pub fn figure_of_limbs(limbs: &[([[f64; 2]; 2], f64)]) -> Vec<u8> {
    let n = 257;
    let to_limb = |p: [f64; 2], [a, b]: [[f64; 2]; 2]| {
        let along = [b[0] - a[0], b[1] - a[1]];
        let offset = [p[0] - a[0], p[1] - a[1]];
        let length = along[0].hypot(along[1]);
        // A disk has no length.
        let t = (offset[0] * along[0] + offset[1] * along[1]) / length.max(1e-9).powi(2);
        let t = t.clamp(0.0, 1.0);
        (offset[0] - t * along[0]).hypot(offset[1] - t * along[1])
    };
    let inside = |p: [f64; 2]| {
        let mut limbs = limbs.iter();
        limbs.any(|(ends, width)| to_limb(p, *ends) < width / 2.0)
    };
    let at = |k: usize| [(k % n) as f64, (k / n) as f64].map(|x| x / (n - 1) as f64);
    let values: Vec<f64> = (0..n * n).map(|k| f64::from(inside(at(k)))).collect();
    npy_f64(&[n, n], &values)
}

/// Limbs thinner than a cell are lost on the way; on a grid of half the spacing they arrive.
#[test]
fn pairs_that_do_not_arrive_are_computed_on_a_finer_grid() {
    let place = Place::new();
    let first = [
        ([[0.5, 0.5], [0.2, 0.36]], 0.1),
        ([[0.2, 0.36], [0.04, 0.45]], 0.02),
        ([[0.5, 0.5], [0.12, 0.56]], 0.1),
        ([[0.12, 0.56], [0.04, 0.56]], 0.06),
        ([[0.5, 0.5], [0.57, 0.88]], 0.03),
        ([[0.57, 0.88], [0.58, 0.96]], 0.02),
    ];
    let second = [
        ([[0.5, 0.5], [0.75, 0.19]], 0.02),
        ([[0.75, 0.19], [0.93, 0.19]], 0.02),
        ([[0.5, 0.5], [0.88, 0.58]], 0.025),
        ([[0.88, 0.58], [0.92, 0.75]], 0.03),
    ];
    place.write("first.npy", &disk_with_limbs(&first));
    place.write("second.npy", &disk_with_limbs(&second));
    let inputs = ["first.npy", "second.npy"];
    let of = |options: &[&str], output: &str| measured(&place, &inputs, options, output).json;
    let arrived = |json: &Value| {
        let marked = json["marked"].as_array().unwrap().iter();
        2 - marked.filter(|mark| mark["steps"] == 2).count()
    };
    let coarse = of(&["--refine", "0"], "coarse");
    assert_eq!(arrived(&coarse), 0);
    let refined = of(&[], "refined");
    assert_eq!(arrived(&refined), 2);
    // The shapes are sampled anew: lengths are to the bit those on the finer grid.
    let on_65 = ["--grid", "65", "-K", "2", "--refine", "0", "-o", "fine"];
    let on_65 = [&["distances"], &inputs[..], &on_65].concat();
    succeeded(&place.compute(&on_65));
    let fine = Results::read(&place.path("fine")).json;
    for (path, of_fine) in [0, 1].map(|k| (&refined["paths"][k], &fine["paths"][k])) {
        assert_eq!(
            (&path["refinements"], &of_fine["refinements"]),
            (&1.into(), &0.into())
        );
        assert_eq!(path["length"], of_fine["length"]);
        assert_eq!(path["elastic"], of_fine["elastic"]);
    }
}
