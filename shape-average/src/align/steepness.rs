//! The largest rate at which a signed distance changes.

use fe_grid::Field;

/// Returns a Lipschitz constant of a multilinear interpolant that is continued beyond the box as
/// `u(c) - |x - c|`, with `c` the nearest point of the box: `|u(x) - u(y)| <= L |x - y|`.
///
/// In a cell, the derivative along an axis lies between the differences along the edges of that
/// direction. Beyond the box, `c` and `x - c` change by vectors whose squares add up to at most that of
/// the change of `x`, since the projection onto a convex set is firmly nonexpansive; so the constant
/// there is `sqrt(L^2 + 1)`. It is taken everywhere: a row of nodes leaves the box where it likes.
pub(super) fn steepness<const D: usize>(u: &Field<f64, D, 1>) -> f64 {
    let grid = u.grid();
    let (n, strides) = (grid.nodes_per_axis(), grid.strides());
    let values = u.as_slice();
    let row = n[0];
    let corners = 1usize << (D - 1);
    let mut steepest: f64 = 0.0;
    for first in (0..grid.n_nodes()).step_by(row) {
        let node = grid.node(first);
        if (1..D).any(|k| node[k] + 1 == n[k]) {
            continue;
        }
        // The rows of the cells' edges along the first axis: one for each corner of the other axes.
        let along = |corner: usize| {
            let offset: usize = (1..D).map(|k| (corner >> (k - 1) & 1) * strides[k]).sum();
            &values[first + offset..first + offset + row]
        };
        let mut squares = vec![0.0; row - 1];
        let mut largest = vec![0.0f64; row - 1];
        let mut add = |edges: &mut dyn FnMut(&mut [f64])| {
            largest.fill(0.0);
            edges(&mut largest);
            for (square, largest) in squares.iter_mut().zip(&largest) {
                *square += largest * largest;
            }
        };
        add(&mut |largest| {
            for corner in 0..corners {
                let ends = along(corner).iter().zip(&along(corner)[1..]);
                for (largest, (a, b)) in largest.iter_mut().zip(ends) {
                    *largest = largest.max((b - a).abs());
                }
            }
        });
        for axis in 0..D - 1 {
            add(&mut |largest| {
                for corner in (0..corners).filter(|corner| corner >> axis & 1 == 0) {
                    let (low, high) = (along(corner), along(corner | 1 << axis));
                    for shift in 0..2 {
                        let ends = low[shift..].iter().zip(&high[shift..]);
                        for (largest, (a, b)) in largest.iter_mut().zip(ends) {
                            *largest = largest.max((b - a).abs());
                        }
                    }
                }
            });
        }
        steepest = squares.iter().fold(steepest, |most, x| most.max(*x));
    }
    (steepest / grid.spacing().powi(2) + 1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Grid;
    use fe_grid::random::SplitMix64;
    use levelset::Continued;

    fn check<const D: usize>(n: usize) {
        let mut random = SplitMix64::new(7);
        let grid = Grid::<D>::cube(n);
        let noise: Vec<f64> = (0..grid.n_nodes()).map(|_| random.uniform()).collect();
        let noise = Field::from_vec(grid, noise).unwrap();
        let ball = Field::from_fn(grid, |x| {
            let r2: f64 = x.iter().map(|x| (x - 0.5).powi(2)).sum();
            [0.3 - r2.sqrt()]
        });
        for u in [&noise, &ball] {
            let (most, continued) = (steepness(u), Continued::new(u));
            for _ in 0..20_000 {
                let x: [f64; D] = std::array::from_fn(|_| 2.0 * random.uniform() - 0.5);
                let y: [f64; D] = std::array::from_fn(|k| x[k] + 0.02 * (random.uniform() - 0.5));
                let length: f64 = (0..D).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt();
                let change = (continued.value(&x) - continued.value(&y)).abs();
                assert!(change <= most * length * (1.0 + 1e-12));
            }
        }
        // Edges of cells differ by the spacing at most, and about the middle they do along all axes.
        let expected = ((D + 1) as f64).sqrt();
        assert!((steepness(&ball) - expected).abs() < 1e-12);
    }

    #[test]
    fn no_two_points_differ_by_more() {
        check::<2>(17);
        check::<3>(9);
    }
}
