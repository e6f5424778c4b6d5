//! Squared distances of lattice points to the nearest marked one.
//!
//! One axis after the other: along a line the least value of `g(p) + (q - p)^2` over all `p` is the
//! lower envelope of parabolas, which two sweeps find. All finite values are integers, so they are
//! exact.
//!
//! Source: Felzenszwalb and Huttenlocher, *Distance transforms of sampled functions* (2012).

/// Replaces zeros at marked points and infinity elsewhere by the squared distances to the nearest
/// marked point, in units of the spacing. Axis 0 is the fastest.
///
/// # Panics
/// If the number of values is not that of the points.
pub(crate) fn squared_distances<const D: usize>(points: [usize; D], values: &mut [f64]) {
    assert_eq!(values.len(), points.iter().product::<usize>());
    let longest = points.into_iter().max().unwrap_or(0);
    let mut envelope = Envelope::with_capacity(longest);
    let mut line = Vec::with_capacity(longest);
    let mut stride = 1;
    for count in points {
        let lines = values.len() / count.max(1);
        for index in 0..lines {
            let first = index % stride + index / stride * stride * count;
            line.clear();
            line.extend((0..count).map(|i| values[first + i * stride]));
            envelope.of(&line);
            envelope.visit(&line, |i, value| values[first + i * stride] = value);
        }
        stride *= count;
    }
}

/// The lower envelope of parabolas along a line.
struct Envelope {
    /// The vertices of its parabolas, from left to right.
    vertices: Vec<usize>,
    /// From where each of them is the lowest.
    starts: Vec<f64>,
}

impl Envelope {
    fn with_capacity(capacity: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(capacity),
            starts: Vec::with_capacity(capacity),
        }
    }

    /// The envelope of `line[p] + (q - p)^2`, over all `p` of finite value.
    fn of(&mut self, line: &[f64]) {
        self.vertices.clear();
        self.starts.clear();
        let height = |p: usize| line[p] + (p * p) as f64;
        for (p, value) in line.iter().enumerate() {
            if value.is_infinite() {
                continue;
            }
            let mut start = f64::NEG_INFINITY;
            while let Some(&last) = self.vertices.last() {
                start = (height(p) - height(last)) / (2 * (p - last)) as f64;
                if start > self.starts[self.starts.len() - 1] {
                    break;
                }
                self.vertices.pop();
                self.starts.pop();
                start = f64::NEG_INFINITY;
            }
            self.vertices.push(p);
            self.starts.push(start);
        }
    }

    /// Passes the values of the envelope to `write`; nothing if there is no parabola.
    fn visit(&self, line: &[f64], mut write: impl FnMut(usize, f64)) {
        let mut current = 0;
        for q in 0..line.len() {
            while self
                .starts
                .get(current + 1)
                .is_some_and(|&next| next < q as f64)
            {
                current += 1;
            }
            if let Some(&p) = self.vertices.get(current) {
                write(q, line[p] + (q.abs_diff(p) as f64).powi(2));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    /// Against all pairs of points, in boxes of unequal sides.
    #[test]
    fn distances_are_those_to_the_nearest_of_all_points() {
        let points = [7, 5, 6];
        let position = |i: usize| [i % 7, i / 7 % 5, i / 35];
        let mut random = SplitMix64::new(3);
        for marked in [0, 1, 2, 5, 20] {
            let mut values = vec![f64::INFINITY; 210];
            let marks: Vec<usize> = (0..marked)
                .map(|_| (random.uniform() * 210.0) as usize)
                .collect();
            for &mark in &marks {
                values[mark] = 0.0;
            }
            squared_distances(points, &mut values);
            for (i, value) in values.into_iter().enumerate() {
                let squared = marks.iter().map(|&mark| {
                    let [a, b] = [position(i), position(mark)];
                    (0..3).map(|k| a[k].abs_diff(b[k]).pow(2)).sum::<usize>() as f64
                });
                assert_eq!(value, squared.fold(f64::INFINITY, f64::min), "{i}");
            }
        }
    }
}
