//! Signed distances at any point, in their box and beyond it.

use fe_grid::{Field, Grid};

/// A signed distance `u` at any point `x`: the multilinear interpolant of its nodes in the box, and
/// `u(c) - |x - c|` beyond it, with `c` the nearest point of the box.
#[derive(Clone, Copy, Debug)]
pub struct Continued<'a, const D: usize> {
    distance: &'a Field<f64, D, 1>,
    strides: [usize; D],
    cells: [usize; D],
    spacing: f64,
    per_spacing: f64,
}

/// A point in a cell: the values at the corners, of which bit `k` of the index says whether they lie at the
/// upper end of axis `k`, the coordinates of the point in the cell, from 0 to 1, and by how much the point lies
/// beyond the box, in spacings.
struct Place<const D: usize> {
    corners: [f64; 8],
    local: [f64; D],
    beyond: [f64; D],
}

impl<'a, const D: usize> Continued<'a, D> {
    /// Continues the signed distance of a shape, positive inside.
    pub fn new(distance: &'a Field<f64, D, 1>) -> Self {
        const { assert!(D <= 3) };
        let grid = distance.grid();
        Self {
            distance,
            strides: grid.strides(),
            cells: grid.nodes_per_axis().map(|n| n - 1),
            spacing: grid.spacing(),
            per_spacing: grid.spacing().recip(),
        }
    }

    /// The grid of the signed distance.
    pub fn grid(&self) -> &'a Grid<D> {
        self.distance.grid()
    }

    #[inline]
    fn place(&self, x: &[f64; D]) -> Place<D> {
        let (mut local, mut beyond) = ([0.0; D], [0.0; D]);
        let mut base = 0;
        for k in 0..D {
            let own = x[k] * self.per_spacing;
            let nearest = own.clamp(0.0, self.cells[k] as f64);
            let cell = (nearest as usize).min(self.cells[k] - 1);
            local[k] = nearest - cell as f64;
            beyond[k] = own - nearest;
            base += cell * self.strides[k];
        }
        let values = &self.distance.as_slice()[base..];
        let mut corners = [0.0; 8];
        for (corner, value) in corners.iter_mut().enumerate().take(1 << D) {
            let offset = |k: usize| (corner >> k & 1) * self.strides[k];
            *value = values[(0..D).map(offset).sum::<usize>()];
        }
        Place {
            corners,
            local,
            beyond,
        }
    }

    /// The value at a point.
    #[inline]
    pub fn value(&self, x: &[f64; D]) -> f64 {
        let Place {
            mut corners,
            local,
            beyond,
        } = self.place(x);
        let mut n = 1 << D;
        for share in local {
            n /= 2;
            for i in 0..n {
                corners[i] = between(corners[2 * i], corners[2 * i + 1], share);
            }
        }
        let square: f64 = beyond.iter().map(|b| b * b).sum();
        if square > 0.0 {
            corners[0] - self.spacing * square.sqrt()
        } else {
            corners[0]
        }
    }

    /// The gradient of the interpolant at a point; at one beyond the box, where the distance decreases away
    /// from it, only its part tangential to the box.
    #[inline]
    pub fn gradient(&self, x: &[f64; D]) -> [f64; D] {
        let Place {
            mut corners,
            local,
            beyond,
        } = self.place(x);
        let mut slopes = [[0.0; 4]; D];
        let mut n = 1 << D;
        for (k, &share) in local.iter().enumerate() {
            n /= 2;
            for i in 0..n {
                let [low, high] = [corners[2 * i], corners[2 * i + 1]];
                for slope in &mut slopes[..k] {
                    slope[i] = between(slope[2 * i], slope[2 * i + 1], share);
                }
                slopes[k][i] = high - low;
                corners[i] = between(low, high, share);
            }
        }
        std::array::from_fn(|k| {
            if beyond[k] == 0.0 {
                slopes[k][0] * self.per_spacing
            } else {
                0.0
            }
        })
    }
}

/// Interpolates between two numbers.
#[inline]
fn between(low: f64, high: f64, share: f64) -> f64 {
    low + share * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::random::SplitMix64;

    fn check<const D: usize>(nodes: [usize; D]) {
        let mut random = SplitMix64::new(3);
        let grid = Grid::with_nodes(nodes, 0.25).unwrap();
        let values = (0..grid.n_nodes()).map(|_| random.uniform()).collect();
        let field = Field::from_vec(grid, values).unwrap();
        let u = Continued::new(&field);
        let extent = grid.extent();
        for _ in 0..500 {
            let x: [f64; D] = std::array::from_fn(|k| (1.4 * random.uniform() - 0.2) * extent[k]);
            let nearest: [f64; D] = std::array::from_fn(|k| x[k].clamp(0.0, extent[k]));
            let away = (0..D).map(|k| (x[k] - nearest[k]).powi(2)).sum::<f64>();
            let expected = field.sample(nearest)[0] - away.sqrt();
            assert!((u.value(&x) - expected).abs() < 1e-13);
            // In a cell the interpolant is linear along every axis.
            for k in 0..D {
                let [low, high] = [-1e-3, 1e-3].map(|h| {
                    let mut at = nearest;
                    at[k] += h;
                    at
                });
                let cell = |p: &[f64; D]| (p[k] / 0.25).floor();
                let slope = u.gradient(&x)[k];
                if x[k] != nearest[k] {
                    assert_eq!(slope, 0.0);
                } else if cell(&low) == cell(&high) {
                    let difference = (field.sample(high)[0] - field.sample(low)[0]) / 2e-3;
                    assert!((slope - difference).abs() < 1e-10);
                }
            }
        }
    }

    #[test]
    fn values_and_gradients_are_those_of_the_interpolant() {
        check([5, 4]);
        check([3, 5, 4]);
    }
}
