//! The rotation of the polar decomposition, and the quadratic form that is built on it.

use crate::common::{
    Matrix, admissible, angles, any_rotation, config, direction, distance, minus_identity, moduli,
    norm, rotation, stretched,
};
use fe_grid::engine::{MAX_CELL_DATA, MAX_COEFFICIENTS};
use fe_grid::multigrid::{CoefficientLaw, MultigridParams};
use fe_grid::random::noise;
use fe_grid::{
    Assembly, CellLaw, Data, Element, Grid, GridError, Jet, Lane, LaneKernel, LinearOperator,
    Point, SimdLevel, Tensor, tensor,
};
use hyperelastic::{
    Corotational, CorotationalMultigrid, LameModuli, LogDet, StoredEnergy, ViscousDissipation,
    polar_rotation,
};
use proptest::prelude::*;

/// Rounding of a rotation that has been found by iteration.
const ROUNDING: f64 = 1e-13;

fn identity<const D: usize>() -> Matrix<D> {
    tensor::diagonal(1.0)
}

/// `r` is a rotation, and `r^T a` symmetric and positive definite: the two properties that define
/// the polar decomposition.
fn check_polar<const D: usize>(a: &Matrix<D>, least_stretch: f64) {
    let r = polar_rotation(a);
    let gram = tensor::transposed_product(&r, &r);
    assert!(distance(&gram, &identity()) < ROUNDING, "{r:?}");
    assert!((tensor::determinant(&r) - 1.0).abs() < ROUNDING);
    let stretch = tensor::transposed_product(&r, a);
    let skew = distance(&stretch, &tensor::transpose(&stretch));
    assert!(skew < ROUNDING * norm(a) / least_stretch, "{skew}");
    // Symmetric with the singular values of `a` up to signs; all of them positive where traces of
    // the matrix and of its cofactors are.
    assert!(tensor::trace(&stretch) > 0.0);
    assert!(tensor::trace(&tensor::cofactor(&stretch)) > 0.0);
}

proptest! {
    #![proptest_config(config("tests/corotational.proptest-regressions"))]

    #[test]
    fn polar_rotation_2d((s, a) in stretched::<2>(0.05, 5.0)) {
        check_polar(&a, s[0].min(s[1]));
    }

    #[test]
    fn polar_rotation_3d((s, a) in stretched::<3>(0.05, 5.0)) {
        check_polar(&a, s.into_iter().fold(f64::INFINITY, f64::min));
    }

    #[test]
    fn rotations_are_their_own_2d(q in any_rotation::<2>()) {
        prop_assert!(distance(&polar_rotation(&q), &q) < ROUNDING);
    }

    #[test]
    fn rotations_are_their_own_3d(q in any_rotation::<3>()) {
        prop_assert!(distance(&polar_rotation(&q), &q) < ROUNDING);
    }

    /// `polar(q a) = q polar(a)`.
    #[test]
    fn polar_rotation_turns_with_the_frame(q in any_rotation::<3>(), h in admissible::<3>()) {
        let a = tensor::add_identity(&h);
        let turned = polar_rotation(&tensor::product(&q, &a));
        prop_assert!(distance(&turned, &tensor::product(&q, &polar_rotation(&a))) < 1e-12);
    }

    #[test]
    fn deformed_cells_2d((_, f) in stretched::<2>(0.3, 4.0), b in direction::<2>(), lambda in 0.0f64..3.0) {
        check_deformed(&f, &b, lambda);
    }

    #[test]
    fn deformed_cells_3d((_, f) in stretched::<3>(0.3, 4.0), b in direction::<3>(), lambda in 0.0f64..3.0) {
        check_deformed(&f, &b, lambda);
    }

    /// Reflections and matrices that flatten have no rotation.
    #[test]
    fn without_orientation_it_is_the_identity((_, a) in stretched::<3>(0.1, 3.0)) {
        let mirrored = [a[0].map(|x| -x), a[1], a[2]];
        prop_assert_eq!(polar_rotation(&mirrored), identity());
        let flat = [a[0], a[1], a[0]];
        prop_assert_eq!(polar_rotation(&flat), identity());
    }
}

struct PolarKernel<'a, T, const D: usize> {
    /// Entries of many matrices, `[entry][matrix]`, and room for their rotations.
    matrices: &'a [Vec<T>],
    rotations: &'a mut [Vec<T>],
}

impl<T: Element, const D: usize> LaneKernel<T> for PolarKernel<'_, T, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane<Element = T>>(self) {
        let n = self.matrices[0].len();
        let mut at = 0;
        while at < n {
            let mut a = tensor::zero::<L, D>();
            for i in 0..D {
                for k in 0..D {
                    a[i][k] = L::load(&self.matrices[i * D + k][at..]);
                }
            }
            let r: Tensor<L, D> = polar_rotation(&a);
            for i in 0..D {
                for k in 0..D {
                    r[i][k].store(&mut self.rotations[i * D + k][at..]);
                }
            }
            at += L::COUNT;
        }
    }
}

/// Lanes give the bits of the scalar formula, mirrored neighbours or not.
fn check_lanes<T: Element, const D: usize>() {
    let n = 21;
    let matrix = |j: usize| -> Matrix<D> {
        let t = j as f64;
        let q = rotation::<D>([t, 2.0 * t + 0.3, 1.0 - t]);
        let mut a = q;
        for (k, row) in a.iter_mut().enumerate() {
            let stretch = 0.3 + ((t + 1.7 * k as f64).sin() + 1.0);
            *row = row.map(|x| stretch * x);
        }
        if j % 5 == 3 {
            a[0] = a[0].map(|x| -x);
        }
        a
    };
    let entries: Vec<Vec<T>> = (0..D * D)
        .map(|e| {
            (0..n)
                .map(|j| T::from_f64(matrix(j)[e / D][e % D]))
                .collect()
        })
        .collect();
    for level in [SimdLevel::Scalar, SimdLevel::Wide256, SimdLevel::Widest] {
        let mut found = vec![vec![T::default(); n]; D * D];
        let kernel = PolarKernel::<T, D> {
            matrices: &entries,
            rotations: &mut found,
        };
        T::dispatch(level, kernel);
        for j in 0..n {
            let mut a = tensor::zero::<T, D>();
            for e in 0..D * D {
                a[e / D][e % D] = entries[e][j];
            }
            let expected = polar_rotation(&a);
            for e in 0..D * D {
                let (x, y) = (found[e][j].to_f64(), expected[e / D][e % D].to_f64());
                assert_eq!(x.to_bits(), y.to_bits(), "{level:?} {j}");
            }
        }
    }
}

#[test]
fn lanes_find_the_same_rotations() {
    check_lanes::<f64, 2>();
    check_lanes::<f64, 3>();
    check_lanes::<f32, 2>();
    check_lanes::<f32, 3>();
}

#[test]
fn single_precision_is_as_good_as_it_can_be() {
    fn check<const D: usize>() {
        for j in 0..40 {
            let q = rotation::<D>([f64::from(j), 0.3 * f64::from(j), 2.0]);
            let narrow = q.map(|row| row.map(|x| 3.0 * x as f32));
            let wide = polar_rotation(&narrow).map(|row| row.map(f64::from));
            // A few units in the last place of single precision, 6e-8.
            assert!(distance(&wide, &q) < 5e-7, "{wide:?}");
        }
    }
    check::<2>();
    check::<3>();
}

/// The data of a cell: stiffness, rotation, and the matrix of the second part.
fn cell<const D: usize>(stiffness: f64, r: &Matrix<D>, mass: &Matrix<D>) -> [f64; MAX_CELL_DATA] {
    let mut data = [0.0; MAX_CELL_DATA];
    data[0] = stiffness;
    for i in 0..D {
        for k in 0..D {
            data[1 + i * D + k] = stiffness * r[i][k];
        }
        for k in i..D {
            data[Corotational::<D>::mass_entry(i, k)] = mass[i][k];
        }
    }
    data
}

fn point<const D: usize>(data: [f64; MAX_CELL_DATA], jet: &Jet<f64, D, D>) -> Point<f64, D, D> {
    Point {
        position: [0.0; D],
        value: jet.value,
        gradient: jet.gradient,
        coefficient: [0.0; MAX_COEFFICIENTS],
        cell: data,
    }
}

fn law<const D: usize>(lambda: f64, regularisation: f64) -> Corotational<D> {
    Corotational {
        moduli: moduli(lambda, 0.7),
        regularisation,
        rotations: true,
        factored: false,
    }
}

/// The data of a deformed cell: the matrix `M = R (1 + U^-1)/2` of `F = R U`, and twice the dissipation
/// of `Dd M^T` as the value of the form.
fn check_deformed<const D: usize>(f: &Matrix<D>, b: &Matrix<D>, lambda: f64) {
    let means = Corotational::at_point(3.0, &minus_identity(f));
    let data = Corotational::<D>::from_deformed_means(means, |det| 2.0 * det);
    let det = tensor::determinant(f);
    assert!((data[0] / (2.0 * det) - 1.0).abs() < ROUNDING);
    let mut m = tensor::zero::<f64, D>();
    for i in 0..D {
        for k in 0..D {
            m[i][k] = data[1 + i * D + k] / data[0];
        }
    }
    let stretch = minus_identity(&tensor::scale(&tensor::transposed_product(f, &m), 2.0));
    // Rounding of `F^-T`, up to 1/.3 in each direction.
    let tolerance = 1e-10;
    assert!(distance(&stretch, &tensor::transpose(&stretch)) < tolerance);
    let square = tensor::product(&stretch, &stretch);
    assert!(distance(&square, &tensor::transposed_product(f, f)) < tolerance);
    assert!(tensor::trace(&stretch) > 0.0);

    let jet = Jet {
        value: [0.0; D],
        gradient: *b,
    };
    let general = Corotational::<D> {
        rotations: false,
        ..law(lambda, 0.0)
    };
    let friction = ViscousDissipation {
        moduli: moduli(lambda, 0.7),
    };
    let rate = friction.rate(&tensor::product_transposed(b, &m));
    let value = general.value(&point(data, &jet));
    assert!((value - data[0] * rate).abs() < tolerance * (1.0 + rate) * (1.0 + data[0]));
}

/// At a rotation the form is the Hessian of the law, and twice the dissipation of the turned
/// direction.
fn check_hessian<const D: usize>(q: &Matrix<D>, b: &Matrix<D>, lambda: f64) {
    let elastic = LogDet::<D>::new(moduli(lambda, 0.7)).unwrap();
    let jet = Jet {
        value: [0.0; D],
        gradient: *b,
    };
    let at = point(cell(2.5, q, &tensor::zero()), &jet);
    let corotational = law::<D>(lambda, 0.0);
    let found = corotational.hessian_action(&at, &jet).gradient;
    let exact = tensor::scale(&elastic.hessian_action(&minus_identity(q), b), 2.5);
    let tolerance = 1e-12 * (1.0 + lambda) * (1.0 + norm(b));
    assert!(distance(&found, &exact) < tolerance);
    let friction = ViscousDissipation {
        moduli: moduli(lambda, 0.7),
    };
    let rate = friction.rate(&tensor::transposed_product(q, b));
    let value = corotational.value(&at);
    assert!((value - 2.5 * rate).abs() < tolerance * (1.0 + norm(b)));
}

fn check_definite<const D: usize>(q: &Matrix<D>, b: &Matrix<D>, m: &Matrix<D>, v: [f64; D]) {
    let jet = Jet {
        value: v,
        gradient: *b,
    };
    // G = m^T m is positive semidefinite.
    let mass = tensor::transposed_product(m, m);
    let data = cell(0.3, q, &mass);
    let at = point(data, &jet);
    let pair = |a: &Jet<f64, D, D>, b: &Jet<f64, D, D>| {
        let values: f64 = (0..D).map(|k| a.value[k] * b.value[k]).sum();
        values + tensor::contract(&a.gradient, &b.gradient)
    };
    let action = law::<D>(1.2, 0.0).hessian_action(&at, &jet);
    let square = pair(&action, &jet);
    assert!(square > -1e-13 * pair(&jet, &jet), "{square}");
    assert!((square - 2.0 * law::<D>(1.2, 0.0).value(&at)).abs() < 1e-12 * (1.0 + square));
    // The regularisation adds r (|d|^2 + |Dd|^2).
    let more = law::<D>(1.2, 0.1).hessian_action(&at, &jet);
    let expected = square + 0.1 * pair(&jet, &jet);
    assert!((pair(&more, &jet) - expected).abs() < 1e-12 * (1.0 + expected));
    // Symmetric.
    let other = Jet {
        value: [0.4; D],
        gradient: *m,
    };
    let there = law::<D>(1.2, 0.0).hessian_action(&at, &other);
    let (a, b) = (pair(&there, &jet), pair(&action, &other));
    assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()));
    // Rotations about the cell's own state cost nothing: q times a skew matrix.
    let skew = tensor::sub(m, &tensor::transpose(m));
    let spin = Jet {
        value: [0.0; D],
        gradient: tensor::product(q, &skew),
    };
    let flux = law::<D>(1.2, 0.0).hessian_action(&at, &spin).gradient;
    assert!(norm(&flux) < 1e-12 * (1.0 + norm(&skew)));
}

/// Children that are turned alike hand their rotation on, whatever their stiffness; others their
/// stiffness-weighted mean rotation, at full stiffness.
fn check_coarsening<const D: usize>(q: &Matrix<D>, tilt: f64) {
    let children = 1 << D;
    let (mut same, mut tilted) = ([0.0; MAX_CELL_DATA], [0.0; MAX_CELL_DATA]);
    let mut stiffness = 0.0;
    for child in 0..children {
        let k = 10f64.powi(-(child % 5)) / f64::from(children);
        stiffness += k;
        // Half of the children are turned to one side, half to the other.
        let sign = if child % 2 == 0 { tilt } else { -tilt };
        let turn = rotation::<D>([sign, 0.0, 0.0]);
        let data = [
            cell(k, q, &identity()),
            cell(
                1.0 / f64::from(children),
                &tensor::product(q, &turn),
                &identity(),
            ),
        ];
        for j in 0..MAX_CELL_DATA {
            same[j] += data[0][j];
            tilted[j] += data[1][j];
        }
    }
    for (means, k) in [(&mut same, stiffness), (&mut tilted, 1.0)] {
        law::<D>(1.0, 0.0).coarsen(means);
        let expected = cell(k, q, &tensor::diagonal(f64::from(children)));
        for j in 0..MAX_CELL_DATA {
            assert!(
                (means[j] - expected[j]).abs() < 1e-12,
                "{j}: {means:?} {expected:?}"
            );
        }
    }
}

proptest! {
    #![proptest_config(config("tests/corotational.proptest-regressions"))]

    #[test]
    fn the_form_is_the_hessian_at_a_rotation_2d(
        q in any_rotation::<2>(), b in direction::<2>(), lambda in 0.0f64..50.0
    ) {
        check_hessian(&q, &b, lambda);
    }

    #[test]
    fn the_form_is_the_hessian_at_a_rotation_3d(
        q in any_rotation::<3>(), b in direction::<3>(), lambda in 0.0f64..50.0
    ) {
        check_hessian(&q, &b, lambda);
    }

    #[test]
    fn the_form_is_semidefinite_2d(
        q in any_rotation::<2>(), b in direction::<2>(), m in direction::<2>()
    ) {
        check_definite(&q, &b, &m, m[0]);
    }

    #[test]
    fn the_form_is_semidefinite_3d(
        q in any_rotation::<3>(), b in direction::<3>(), m in direction::<3>()
    ) {
        check_definite(&q, &b, &m, m[0]);
    }

    #[test]
    fn coarsening_keeps_rotations(a in angles(), tilt in 0.0f64..1.2) {
        check_coarsening(&rotation::<2>(a), tilt);
        check_coarsening(&rotation::<3>(a), tilt);
    }
}

/// The blocks that the engine takes from moments, since the form is the same all over a cell, are
/// those of its Hessian action.
fn check_block_diagonal<const D: usize>(nodes: [usize; D]) {
    let grid = Grid::with_nodes(nodes, 0.1).unwrap();
    let (n, count) = (grid.n_nodes(), Corotational::<D>::CELL_DATA);
    let wave = |i: usize| ((i * 7919 + 13) % 1009) as f64 / 1009.0;
    let cells: Vec<Vec<f64>> = (0..count)
        .map(|f| {
            let entry = |i: usize| wave(f * grid.n_cells() + i) + f64::from(u8::from(f == 0));
            (0..grid.n_cells()).map(entry).collect()
        })
        .collect();
    let cells: Vec<&[f64]> = cells.iter().map(Vec::as_slice).collect();
    let law = Corotational::<D> {
        moduli: LameModuli {
            lambda: 1.3,
            mu: 0.7,
        },
        regularisation: 0.2,
        rotations: true,
        factored: false,
    };
    let data = Data {
        coefficients: &[],
        cells: &cells,
    };
    let assembly = Assembly::new(grid, &law, data);
    let zero = vec![0.0; D * n];
    let mut blocks = vec![0.0; D * D * n];
    assembly.block_diagonal_into(&zero, &mut blocks);
    let (mut unit, mut column) = (zero.clone(), zero.clone());
    for node in [0, n / 3, n - 1] {
        for m in 0..D {
            unit[m * n + node] = 1.0;
            assembly.hessian_action_into(&zero, &unit, &mut column);
            unit[m * n + node] = 0.0;
            for r in 0..D {
                let (a, b) = (column[r * n + node], blocks[(r * D + m) * n + node]);
                // The same sum in another order.
                assert!((a - b).abs() <= 1e-13 * column[m * n + node], "{a} {b}");
            }
        }
    }
}

#[test]
fn block_diagonal_from_moments() {
    check_block_diagonal([6, 4]);
    check_block_diagonal([4, 5, 3]);
}

/// Cells of one stiffness at rest, with `weight * n n^T` as their mass.
fn weighted<const D: usize>(grid: &Grid<D>, weight: f64, normal: [f64; D]) -> Vec<Vec<f32>> {
    let mass = normal.map(|a| normal.map(|b| weight * a * b));
    let of_cell = cell(1.0, &identity(), &mass);
    let used = Corotational::<D>::mass_entry(D - 1, D - 1) + 1;
    let data = of_cell[..used].iter();
    data.map(|&entry| vec![entry as f32; grid.n_cells()])
        .collect()
}

/// A mismatch of large weight acts along the normal of a contour. In single precision nothing is left of the
/// stiffness across it; the cycle is definite nevertheless, and refuses a mass that is negative. In halves
/// nothing is left of it from smaller weights on.
#[test]
fn cycles_stand_large_weights_along_one_direction() {
    check_large_weights(false);
    check_large_weights(true);
}

fn check_large_weights(in_halves: bool) {
    fn check<const D: usize>(grid: Grid<D>, normal: [f64; D], in_halves: bool) {
        let params = MultigridParams {
            in_halves,
            ..MultigridParams::default()
        };
        let new = |weight: f64| {
            let cells = weighted(&grid, weight, normal);
            CorotationalMultigrid::new(grid, law(1.2, 1e-6), cells, params)
        };
        for weight in [1e-12, 1.0, 1e6, 1e9, 1e12, 1e15] {
            let cycle = new(weight).unwrap();
            for seed in 0..3 {
                let r = noise(cycle.dim(), seed);
                let mut z = vec![0.0; r.len()];
                cycle.apply_into(&r, &mut z);
                let product: f64 = r.iter().zip(&z).map(|(a, b)| a * b).sum();
                assert!(product > 0.0 && product.is_finite(), "{weight}: {product}");
            }
        }
        // Halves have a factor of the mass.
        if in_halves {
            return;
        }
        let negative = new(-1e6).map(|_| ());
        assert!(
            matches!(negative, Err(GridError::NotPositiveDefinite { curvature, .. }) if curvature < 0.0)
        );
    }
    check(Grid::<2>::dyadic(4), [0.6, 0.8], in_halves);
    check(Grid::<2>::dyadic(4), [0.28, -0.96], in_halves);
    check(Grid::<3>::dyadic(3), [0.48, 0.6, 0.64], in_halves);
}

/// In halves a cycle stays the inverse that it is, though a large weight along one direction exceeds the
/// stiffness in the others by more than halves resolve: vectors in those are not changed by the weight.
#[test]
fn halves_keep_what_a_large_weight_leaves_free() {
    fn check<const D: usize>(grid: Grid<D>, normal: [f64; D], free: [f64; D]) {
        let quotient = |in_halves: bool| {
            let params = MultigridParams {
                in_halves,
                ..MultigridParams::default()
            };
            let cells = weighted(&grid, 3e4, normal);
            let cycle = CorotationalMultigrid::new(grid, law(1.2, 1e-3), cells, params).unwrap();
            let n = grid.n_nodes();
            let load: Vec<f64> = (0..D * n).map(|i| free[i / n]).collect();
            let mut image = vec![0.0; D * n];
            cycle.apply_into(&load, &mut image);
            load.iter().zip(&image).map(|(a, b)| a * b).sum::<f64>()
        };
        let (whole, halves) = (quotient(false), quotient(true));
        println!("{whole} {halves}");
        assert!((0.8..1.25).contains(&(halves / whole)), "{whole} {halves}");
    }
    check(Grid::<2>::dyadic(4), [0.6, 0.8], [0.8, -0.6]);
    check(Grid::<3>::dyadic(3), [0.48, 0.6, 0.64], [0.8, -0.64, 0.0]);
}
