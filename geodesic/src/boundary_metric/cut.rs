//! The cells of an object: whole, void, or cut by its boundary, with quadrature on the occupied part.
//!
//! The level set is interpolated linearly on the simplices of a cell's diagonal (two triangles, six
//! tetrahedra). Their occupied parts are simplices, too, on which a rule of degree two is used, with
//! positive weights: linear velocities, and the stresses that hold them, are integrated exactly. The
//! fraction of a cell as the weight of its whole would not do: the bilinear parts of the velocities in
//! cut cells would relax under it, with an error of order one in the spacing.

use fe_grid::{Grid, ScalarField};

/// A quadrature point in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutPoint<const D: usize> {
    /// Its position, from 0 to 1 along every axis of the cell.
    pub local: [f64; D],
    /// Its share of the cell's volume.
    pub weight: f64,
}

/// The cells of an object.
#[derive(Clone, Debug)]
pub(super) struct ObjectCells<const D: usize> {
    pub grid: Grid<D>,
    /// The occupied fraction of every cell.
    pub fractions: Vec<f64>,
    /// The cells that are neither whole nor void, with the points in their occupied parts.
    pub cut: Vec<(usize, Vec<CutPoint<D>>)>,
}

/// Fractions nearer to 0 or 1 are rounding errors.
const ROUNDING: f64 = 1e-12;

impl<const D: usize> ObjectCells<D> {
    /// The cells of the object `{u > 0}`.
    pub fn new(level_set: &ScalarField<f64, D>) -> Self {
        let (grid, values) = (*level_set.grid(), level_set.as_slice());
        let strides = grid.strides();
        let mut fractions = Vec::with_capacity(grid.n_cells());
        let mut cut = Vec::new();
        for cell in 0..grid.n_cells() {
            let first = grid.node_index(grid.cell(cell));
            let corners: [f64; 8] = std::array::from_fn(|c| {
                let c = c % (1 << D);
                let offset: usize = (0..D).map(|k| (c >> k & 1) * strides[k]).sum();
                values[first + offset]
            });
            let inside = corners.iter().filter(|&&u| u > 0.0).count();
            let mut fraction = if inside > 0 { 1.0 } else { 0.0 };
            if inside % 8 != 0 {
                let points = points_of_cell(&corners);
                fraction = points.iter().map(|point| point.weight).sum();
                if fraction < ROUNDING {
                    fraction = 0.0;
                } else if fraction > 1.0 - ROUNDING {
                    fraction = 1.0;
                } else {
                    cut.push((cell, points));
                }
            }
            fractions.push(fraction);
        }
        Self {
            grid,
            fractions,
            cut,
        }
    }
}

/// The orders of the axes along which the simplices of a cell go from the first corner to the
/// opposite one.
const ORDERS: [[usize; 3]; 8] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
    // In the plane.
    [0, 1, 0],
    [1, 0, 0],
];

/// The points in the part of a cell where the level set is positive, from its values at the corners.
fn points_of_cell<const D: usize>(corners: &[f64; 8]) -> Vec<CutPoint<D>> {
    let orders = if D == 2 { &ORDERS[6..] } else { &ORDERS[..6] };
    let mut points = Vec::new();
    for order in orders {
        let mut corner = 0;
        let mut vertices = vec![([0.0; D], corners[0])];
        for &axis in &order[..D] {
            corner |= 1 << axis;
            let place = std::array::from_fn(|k| f64::from(u8::from(corner >> k & 1 == 1)));
            vertices.push((place, corners[corner]));
        }
        for simplex in occupied(&mut vertices) {
            points_of_simplex(&simplex, &mut points);
        }
    }
    points
}

/// The simplices of the part of a simplex in which the linear function of these values is positive.
fn occupied<const D: usize>(vertices: &mut [([f64; D], f64)]) -> Vec<Vec<[f64; D]>> {
    vertices.sort_by(|a, b| b.1.total_cmp(&a.1));
    let inside = vertices.iter().filter(|(_, u)| *u > 0.0).count();
    let at = |i: usize| vertices[i].0;
    // The point on an edge where the function is zero.
    let between = |i: usize, j: usize| {
        let (a, b) = (vertices[i], vertices[j]);
        let share = a.1 / (a.1 - b.1);
        std::array::from_fn(|k| a.0[k] + share * (b.0[k] - a.0[k]))
    };
    match (D, inside) {
        (_, 0) => Vec::new(),
        (_, 1) => {
            let ends = (1..=D).map(|j| between(0, j));
            vec![std::iter::once(at(0)).chain(ends).collect()]
        }
        (2, 2) => vec![
            vec![at(0), at(1), between(1, 2)],
            vec![at(0), between(0, 2), between(1, 2)],
        ],
        (3, 2) => vec![
            vec![at(0), between(0, 2), between(0, 3), between(1, 3)],
            vec![at(0), between(0, 2), between(1, 2), between(1, 3)],
            vec![at(0), at(1), between(1, 2), between(1, 3)],
        ],
        (3, 3) => vec![
            vec![at(0), at(1), at(2), between(2, 3)],
            vec![at(0), at(1), between(1, 3), between(2, 3)],
            vec![at(0), between(0, 3), between(1, 3), between(2, 3)],
        ],
        _ => vec![(0..=D).map(at).collect()],
    }
}

/// Adds the points of a simplex, `D + 1` of equal weight, which integrate polynomials of degree two.
fn points_of_simplex<const D: usize>(corners: &[[f64; D]], points: &mut Vec<CutPoint<D>>) {
    let edge = |j: usize, k: usize| corners[j][k] - corners[0][k];
    let (volume, apart) = if D == 2 {
        let det = edge(1, 0) * edge(2, 1) - edge(1, 1) * edge(2, 0);
        (det.abs() / 2.0, 1.0 / 6.0)
    } else {
        let minor = |k: usize| {
            let (i, j) = ((k + 1) % D, (k + 2) % D);
            edge(2, i) * edge(3, j) - edge(2, j) * edge(3, i)
        };
        let det: f64 = (0..D).map(|k| edge(1, k) * minor(k)).sum();
        (det.abs() / 6.0, (5.0 - 5f64.sqrt()) / 20.0)
    };
    let weight = volume / (D + 1) as f64;
    if weight <= 0.0 {
        return;
    }
    for i in 0..=D {
        let near = 1.0 - D as f64 * apart;
        let share = |j: usize| if i == j { near } else { apart };
        points.push(CutPoint {
            local: std::array::from_fn(|k| (0..=D).map(|j| share(j) * corners[j][k]).sum()),
            weight,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The part of the box on one side of a plane, with the integrals of 1, x and x^2 over it.
    fn integrals<const D: usize>(level_set: impl Fn([f64; D]) -> f64) -> [f64; 3] {
        let field = ScalarField::from_fn(Grid::<D>::cube(9), |x| [level_set(x)]);
        let cells = ObjectCells::new(&field);
        let h = field.grid().spacing();
        let mut sums = [0.0; 3];
        let mut add = |x: f64, weight: f64| {
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += weight * h.powi(D as i32) * x.powi(power as i32);
            }
        };
        for (cell, &fraction) in cells.fractions.iter().enumerate() {
            let x = field.grid().cell(cell)[0] as f64;
            match cells.cut.iter().find(|(cut, _)| *cut == cell) {
                Some((_, points)) => {
                    for point in points {
                        add((x + point.local[0]) * h, point.weight);
                    }
                }
                None => {
                    for side in [-0.5, 0.5] {
                        add((x + 0.5 + side / 3f64.sqrt()) * h, 0.5 * fraction);
                    }
                }
            }
        }
        sums
    }

    fn halves<const D: usize>(normal: [f64; D], offset: f64) {
        let height = |x: [f64; D]| (0..D).map(|k| normal[k] * x[k]).sum::<f64>() - offset;
        let (one, other) = (integrals(height), integrals(|x| -height(x)));
        for (power, (a, b)) in one.into_iter().zip(other).enumerate() {
            let all = 1.0 / (power + 1) as f64;
            assert!((a + b - all).abs() < 1e-13, "{power} {a} {b}");
        }
    }

    #[test]
    fn both_sides_of_a_plane_fill_the_box() {
        halves([0.8, 0.1], 0.31);
        halves([0.3, -0.7], 0.02);
        halves([0.3, 0.5, -0.4], 0.13);
        halves([0.9, -0.2, 0.1], 0.4);
    }

    #[test]
    fn a_corner_has_its_volume_and_moments() {
        // x + y + z < 1/2: volume 1/48, first moment of x s^4/24, second s^5/60.
        let found = integrals::<3>(|[x, y, z]| 0.5 - x - y - z);
        let s = 0.5f64;
        let exact = [s.powi(3) / 6.0, s.powi(4) / 24.0, s.powi(5) / 60.0];
        for (found, exact) in found.into_iter().zip(exact) {
            assert!((found - exact).abs() < 1e-14, "{found} {exact}");
        }
        let found = integrals::<2>(|[x, y]| 0.7 - x - y);
        let s = 0.7f64;
        let exact = [s.powi(2) / 2.0, s.powi(3) / 6.0, s.powi(4) / 12.0];
        for (found, exact) in found.into_iter().zip(exact) {
            assert!((found - exact).abs() < 1e-14, "{found} {exact}");
        }
    }

    #[test]
    fn the_volume_of_a_ball_has_order_two() {
        let error = |nodes| {
            let ball = ScalarField::<f64, 3>::from_fn(Grid::cube(nodes), |x| {
                [0.3 - x.iter().map(|x| (x - 0.5).powi(2)).sum::<f64>().sqrt()]
            });
            let sum: f64 = ObjectCells::new(&ball).fractions.iter().sum();
            let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.3f64.powi(3);
            sum * ball.grid().cell_volume() / exact - 1.0
        };
        let (coarse, fine) = (error(17), error(33));
        assert!(
            coarse.abs() < 0.03 && (coarse / fine).log2() > 1.7,
            "{coarse} {fine}"
        );
    }
}
