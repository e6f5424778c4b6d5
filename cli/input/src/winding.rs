//! Winding numbers of a closed contour at the samples of a lattice.
//!
//! The lines along the first axis are followed from outside: the winding number changes by one where
//! a line goes through a segment or triangle, up or down by its orientation. A contour without a boundary
//! has a whole number everywhere, even where it crosses itself. A line that meets an edge or a corner
//! exactly counts as one that is moved by an infinitesimal amount, for all segments and triangles in the
//! same way.

use levelset::Contour;

/// What lies inside of a closed contour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// Points with a winding number other than 0.
    NonZero,
    /// Points with an odd winding number.
    EvenOdd,
}

impl Fill {
    /// Whether points of a winding number lie inside.
    pub fn holds(self, number: i32) -> bool {
        match self {
            Self::NonZero => number != 0,
            Self::EvenOdd => number % 2 != 0,
        }
    }
}

/// A box of samples with one spacing along all axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Samples<const D: usize> {
    pub size: [usize; D],
    pub spacing: f64,
    /// Position of the first sample.
    pub origin: [f64; D],
}

/// Where a line goes through a contour.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Crossing {
    line: usize,
    x: f64,
    change: i32,
}

/// More crossings than this has no contour that is a boundary.
const MOST_CROSSINGS: usize = 1 << 25;

/// The winding numbers at all samples, the first axis fastest, or why there are none.
pub(crate) fn winding_numbers<const D: usize>(
    contour: &Contour<D>,
    samples: &Samples<D>,
) -> Result<Vec<i32>, &'static str> {
    let mut numbers = vec![0; samples.size.iter().product()];
    for_each_number(contour, samples, |index, number| numbers[index] = number)?;
    Ok(numbers)
}

/// Visits the winding numbers at the samples where they are not 0, or says why there are none.
pub(crate) fn for_each_number<const D: usize>(
    contour: &Contour<D>,
    samples: &Samples<D>,
    mut visit: impl FnMut(usize, i32),
) -> Result<(), &'static str> {
    let mut crossings = Vec::new();
    for simplex in contour.simplices() {
        cross(contour.points(), simplex, samples, &mut crossings);
        if crossings.len() > MOST_CROSSINGS {
            return Err("it lies in too many layers");
        }
    }
    crossings.sort_unstable_by(|a, b| a.line.cmp(&b.line).then(a.x.total_cmp(&b.x)));
    let n = samples.size[0];
    for crossings in crossings.chunk_by(|a, b| a.line == b.line) {
        if crossings.iter().map(|c| c.change).sum::<i32>() != 0 {
            return Err("it is not closed");
        }
        let (line, mut next, mut number) = (crossings[0].line, 0, 0);
        // Not beyond the first crossing, whatever its rounding.
        let before = (crossings[0].x - samples.origin[0]) / samples.spacing - 1.0;
        for i in before.max(0.0) as usize..n {
            let x = samples.origin[0] + i as f64 * samples.spacing;
            while let Some(crossing) = crossings.get(next).filter(|crossing| crossing.x < x) {
                number += crossing.change;
                next += 1;
            }
            if number != 0 {
                visit(line * n + i, number);
            } else if next == crossings.len() {
                break;
            }
        }
    }
    Ok(())
}

/// Adds the lines that go through a segment or triangle.
fn cross<const D: usize>(
    points: &[[f64; D]],
    simplex: &[u32; D],
    samples: &Samples<D>,
    crossings: &mut Vec<Crossing>,
) {
    let corners = simplex.map(|c| points[c as usize]);
    // First and last line along each other axis.
    let mut lines = [[0, 1]; D];
    for k in 1..D {
        let (low, high) = corners
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                (low.min(p[k]), high.max(p[k]))
            });
        let number = |x: f64| (x - samples.origin[k]) / samples.spacing;
        let first = number(low).floor().max(0.0) as usize;
        let end = (number(high).ceil().max(0.0) as usize + 1).min(samples.size[k]);
        lines[k] = [first, end];
    }
    let count = |k: usize| lines[k][1].saturating_sub(lines[k][0]);
    let total: usize = (1..D).map(count).product();
    for mut number in 0..total {
        let mut line = 0;
        let mut place = [0.0; D];
        let mut step = 1;
        for k in 1..D {
            let i = lines[k][0] + number % count(k);
            number /= count(k);
            line += i * step;
            step *= samples.size[k];
            place[k] = samples.origin[k] + i as f64 * samples.spacing;
        }
        if let Some((x, change)) = through(simplex, &corners, &place) {
            crossings.push(Crossing { line, x, change });
        }
    }
}

/// Where the line along the first axis through a place goes through a simplex, and how the winding
/// number changes there.
fn through<const D: usize>(
    simplex: &[u32; D],
    corners: &[[f64; D]; D],
    place: &[f64; D],
) -> Option<(f64, i32)> {
    if D == 2 {
        let [p, q] = [corners[0], corners[1]];
        let above = [p[1] > place[1], q[1] > place[1]];
        if above[0] == above[1] {
            return None;
        }
        let share = (place[1] - p[1]) / (q[1] - p[1]);
        // The object lies to the left: a segment that points down is entered.
        return Some((p[0] + share * (q[0] - p[0]), if above[0] { 1 } else { -1 }));
    }
    let [u, v] = [1, D - 1];
    let mut sides = [0.0; 3];
    let mut signs = [false; 3];
    for k in 0..3 {
        let (mut a, mut b) = ((k + 1) % D, (k + 2) % D);
        // Both triangles of an edge compute the same number.
        let swapped = simplex[a] > simplex[b];
        if swapped {
            std::mem::swap(&mut a, &mut b);
        }
        let (p, q) = (&corners[a], &corners[b]);
        let along = [q[u] - p[u], q[v] - p[v]];
        let side = along[0] * (place[v] - p[v]) - along[1] * (place[u] - p[u]);
        // On the edge: a place that is moved along the second axis, and a little along the third.
        let moved = [side, -along[1], along[0]];
        let sign = moved.into_iter().find(|x| *x != 0.0)? > 0.0;
        sides[k] = if swapped { -side } else { side };
        signs[k] = sign != swapped;
    }
    if signs[0] != signs[1] || signs[1] != signs[2] {
        return None;
    }
    let sum: f64 = sides.iter().sum();
    let x = if sum == 0.0 {
        corners[0][0]
    } else {
        (0..3).map(|k| sides[k] * corners[k % D][0]).sum::<f64>() / sum
    };
    // Seen along the axis, a triangle that turns to the right is entered from outside.
    Some((x, if signs[0] { -1 } else { 1 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use test_support::cuboid;

    fn cube(shift: f64, side: f64) -> Contour<3> {
        let (points, triangles) = cuboid([shift; 3], [shift + side; 3]);
        Contour::new(points, triangles).unwrap()
    }

    /// Samples at whole numbers.
    const SAMPLES: Samples<3> = Samples {
        size: [9, 9, 9],
        spacing: 1.0,
        origin: [0.0; 3],
    };

    #[test]
    fn a_cube_on_the_samples_is_counted_once() {
        // Corners, edges and the diagonals of sides lie on the lines.
        for (shift, side, expected) in [(2.0, 4.0, 64), (2.0, 3.0, 27), (1.5, 2.0, 8)] {
            let numbers = winding_numbers(&cube(shift, side), &SAMPLES).unwrap();
            assert!(numbers.iter().all(|n| [0, 1].contains(n)));
            assert_eq!(numbers.iter().sum::<i32>(), expected);
            let turned = winding_numbers(&cube(shift, side).flipped(), &SAMPLES).unwrap();
            assert!(numbers.iter().zip(&turned).all(|(a, b)| *a == -b));
        }
    }

    /// Corners of four triangles lie on lines, whatever the order of the points.
    #[test]
    fn corners_on_the_lines_are_moved_all_together() {
        for shift in 0..6 {
            // The corners at +x, -x, +y, -y, +z and -z of the middle, stored from another one on.
            let corner = |n: usize| {
                let mut p = [4.0; 3];
                p[n / 2] += if n.is_multiple_of(2) { 3.0 } else { -3.0 };
                p
            };
            let stored = |n: usize| ((n + shift) % 6) as u32;
            let mut points = vec![[0.0; 3]; 6];
            for n in 0..6 {
                points[stored(n) as usize] = corner(n);
            }
            let mut triangles = Vec::new();
            for [x, y, z] in (0..8).map(|n| [n & 1, n >> 1 & 1, n >> 2]) {
                let [a, b, c] = [stored(x), stored(2 + y), stored(4 + z)];
                let right = (x + y + z) % 2 == 0;
                triangles.push(if right { [a, b, c] } else { [b, a, c] });
            }
            let octahedron = Contour::new(points, triangles).unwrap();
            let numbers = winding_numbers(&octahedron, &SAMPLES).unwrap();
            // 25 samples lie inside, and some of those on the triangles.
            let count = numbers.iter().sum::<i32>();
            assert!(numbers.iter().all(|n| [0, 1].contains(n)), "{shift}");
            assert!((25..=63).contains(&count), "{shift}: {count}");
        }
    }

    #[test]
    fn overlapping_cubes_have_two_and_open_ones_none() {
        let samples = Samples {
            size: [12, 12, 12],
            spacing: 0.7,
            origin: [0.1; 3],
        };
        let both = cube(1.0, 3.0).joined(&cube(2.5, 4.0));
        let numbers = winding_numbers(&both, &samples).unwrap();
        assert_eq!(numbers.iter().max(), Some(&2));
        let low = |corners: &[[f64; 3]; 3]| corners.iter().any(|p| p[0] < 2.0);
        assert!(winding_numbers(&both.part(low), &samples).is_err());
    }

    #[test]
    fn a_square_is_entered_where_it_points_down() {
        let points = vec![[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];
        let square = Contour::new(points, vec![[0, 1], [1, 2], [2, 3], [3, 0]]).unwrap();
        let samples = Samples {
            size: [5, 5],
            spacing: 1.0,
            origin: [-0.5; 2],
        };
        let numbers = winding_numbers(&square, &samples).unwrap();
        assert_eq!(numbers.iter().sum::<i32>(), 4);
        assert_eq!(numbers[2 + 2 * 5], 1);
    }
}
