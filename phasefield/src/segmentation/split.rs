//! Classification of the values of a smoothed image.

/// Classes of values between thresholds.
#[derive(Clone, Debug, PartialEq)]
pub struct Classes {
    /// Thresholds between consecutive classes, in increasing order.
    pub thresholds: Vec<f64>,
    /// Fraction of the variance of the values that is between the classes, from 0 to 1.
    pub separation: f64,
}

/// Number of bins of the histogram.
const BINS: usize = 256;

/// Splits values into the given number of classes such that the variance between them is maximal.
///
/// Source: N. Otsu, *A threshold selection method from gray-level histograms*, IEEE Trans. Systems,
/// Man and Cybernetics 9 (1979); more than two classes by dynamic programming over a histogram of
/// 256 bins. `None` if there are fewer different values than classes.
///
/// # Panics
/// If fewer than two classes are requested.
pub fn split_classes(values: &[f64], classes: usize) -> Option<Classes> {
    assert!(classes >= 2, "one class needs no threshold");
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
    let width = (high - low) / BINS as f64;
    if !(width > 0.0 && width.is_finite()) {
        return None;
    }
    // Sums over the bins before each: numbers of values, and their sums.
    let mut histogram = [[0.0; 2]; BINS];
    for &v in values {
        let bin = (((v - low) / width) as usize).min(BINS - 1);
        histogram[bin][0] += 1.0;
        histogram[bin][1] += v - low;
    }
    let mut sums = [[0.0; 2]; BINS + 1];
    for (bin, counted) in histogram.iter().enumerate() {
        sums[bin + 1] = [0, 1].map(|k| sums[bin][k] + counted[k]);
    }
    let between = |from: usize, to: usize| {
        let [count, sum] = [0, 1].map(|k| sums[to][k] - sums[from][k]);
        (count > 0.0).then(|| sum * sum / count)
    };
    // best[c][b]: the optimal split of the bins before b into c + 1 classes, and the start of the
    // last one.
    let mut best: Vec<Vec<Option<(f64, usize)>>> =
        vec![(0..=BINS).map(|b| Some((between(0, b)?, 0))).collect()];
    for _ in 1..classes {
        let before = &best[best.len() - 1];
        let row = (0..=BINS).map(|to| {
            let begins =
                (1..to).filter_map(|from| Some((before[from]?.0 + between(from, to)?, from)));
            begins.reduce(|a, b| if b.0 > a.0 { b } else { a })
        });
        best.push(row.collect());
    }
    let gained = best[classes - 1][BINS]?.0;
    let mut thresholds = Vec::new();
    let mut end = BINS;
    for row in best[1..].iter().rev() {
        end = row[end]?.1;
        thresholds.push(middle_of_gap(&histogram, end, low, width));
    }
    thresholds.reverse();
    let count = values.len() as f64;
    let mean = sums[BINS][1] / count;
    let square: f64 = values.iter().map(|v| (v - low) * (v - low)).sum();
    let (all, found) = (square - count * mean * mean, gained - count * mean * mean);
    Some(Classes {
        thresholds,
        separation: (found / all).clamp(0.0, 1.0),
    })
}

/// Returns the threshold at an edge between bins. All thresholds in a gap between values are
/// equivalent; it is the middle of the empty bins.
fn middle_of_gap(histogram: &[[f64; 2]; BINS], edge: usize, low: f64, width: f64) -> f64 {
    let empty = |bin: usize| histogram[bin][0] == 0.0;
    let below = (0..edge).rev().take_while(|&bin| empty(bin)).count();
    let above = (edge..BINS).take_while(|&bin| empty(bin)).count();
    low + width * (edge as f64 + 0.5 * (above as f64 - below as f64))
}
