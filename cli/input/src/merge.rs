//! Points that are one.

use std::collections::HashMap;

/// Makes one of points that are equal, or nearer to each other than a distance, the first of them: those
/// that are kept, and the number among them of every point.
pub(crate) fn merged<const D: usize>(
    points: &[[f64; D]],
    distance: f64,
) -> (Vec<[f64; D]>, Vec<u32>) {
    let mut known: HashMap<[i64; D], Vec<u32>> = HashMap::new();
    let mut kept: Vec<[f64; D]> = Vec::new();
    let cell = |p: &[f64; D]| {
        p.map(|x| {
            if distance > 0.0 {
                (x / distance).floor() as i64
            } else {
                // Adding zero turns -0 into +0.
                (x + 0.0).to_bits() as i64
            }
        })
    };
    let reach = i64::from(distance > 0.0);
    let mut numbers = Vec::with_capacity(points.len());
    for p in points {
        let own = cell(p);
        let around = (0..3i64.pow(D as u32)).filter_map(|mut n: i64| {
            let step: [i64; D] = std::array::from_fn(|_| {
                let digit = n % 3 - 1;
                n /= 3;
                digit
            });
            (step.iter().all(|s| s.abs() <= reach))
                .then(|| std::array::from_fn(|k| own[k].wrapping_add(step[k])))
        });
        let near = around
            .filter_map(|cell: [i64; D]| known.get(&cell))
            .flatten()
            .copied()
            .filter(|&c| {
                let q = &kept[c as usize];
                (0..D).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>() <= distance * distance
            })
            .min();
        numbers.push(near.unwrap_or_else(|| {
            let fresh = kept.len() as u32;
            known.entry(own).or_default().push(fresh);
            kept.push(*p);
            fresh
        }));
    }
    (kept, numbers)
}
