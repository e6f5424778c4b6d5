//! Certificate, inverse and transfer of deformations.

use crate::support::smooth_displacement;
use fe_grid::composition::{Interpolant, Outside};
use fe_grid::random::noise;
use fe_grid::transfer::{average_cells, inject_into, prolong_into, restrict_into};
use fe_grid::{
    Element, Field, Grid, InverseDeformation, Restrained, ScalarField, certify, certify_below,
    certify_within, restrain_step, restrain_together, tensor, violations,
};
use proptest::prelude::*;

/// Smallest determinant over a lattice of points in every cell.
fn sampled_minimum<const D: usize>(grid: &Grid<D>, u: &[f64], points: usize) -> f64 {
    let n = grid.n_nodes();
    let components: Vec<_> = (0..D)
        .map(|k| Interpolant::new(*grid, &u[k * n..(k + 1) * n]))
        .collect();
    let mut least = f64::INFINITY;
    for cell in 0..grid.n_cells() {
        let cell = grid.cell(cell);
        for mut code in 0..points.pow(D as u32) {
            let x: [f64; D] = std::array::from_fn(|k| {
                let s = (code % points) as f64 + 0.5;
                code /= points;
                (cell[k] as f64 + s / points as f64) * grid.spacing()
            });
            let gradient: [[f64; D]; D] = std::array::from_fn(|k| components[k].sample(&x).1);
            least = least.min(tensor::determinant(&tensor::add_identity(&gradient)));
        }
    }
    least
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn certificate_is_exact_in_two_dimensions(seed in 0u64..1000, size in 0.0f64..0.08) {
        let grid = Grid::<2>::cube(6);
        let u: Vec<f64> = noise(2 * grid.n_nodes(), seed).iter().map(|x| x * size).collect();
        let certificate = certify(&grid, &u, 0.0);
        let sampled = sampled_minimum(&grid, &u, 40);
        // The determinant is affine: the points stand within 1/80 of a corner in each variable,
        // and a cell of det between -4 and 6 changes by no more than that share of its range.
        prop_assert!(certificate.min_det <= sampled + 1e-12);
        prop_assert!(certificate.min_det >= sampled - 0.3);
        prop_assert_eq!(certificate.min_det, certificate.min_corner_det);
        prop_assert_eq!(certificate.certified, certificate.min_det > 0.0);
    }

    #[test]
    fn certificate_bounds_from_below_in_three_dimensions(seed in 0u64..1000, size in 0.0f64..0.12) {
        let grid = Grid::<3>::cube(4);
        let u: Vec<f64> = noise(3 * grid.n_nodes(), seed).iter().map(|x| x * size).collect();
        let certificate = certify(&grid, &u, 1e-3);
        let sampled = sampled_minimum(&grid, &u, 12);
        prop_assert!(certificate.min_det <= sampled + 1e-12);
        if certificate.certified {
            prop_assert!(sampled > 1e-3);
        } else {
            // A refusal is justified by a corner, or up to what six splits of a cell leave open.
            let justified = certificate.min_corner_det <= 1e-3 || sampled < 0.1;
            prop_assert!(justified, "{} but refused", sampled);
        }
    }

    #[test]
    fn the_estimate_decides_as_the_exact_bound_does(
        seed in 0u64..1000,
        size in 0.0f64..0.3,
        detail in 1e-3f64..0.9,
    ) {
        let grid = Grid::<3>::with_nodes([11, 9, 6], 0.1).unwrap();
        let u = smooth_displacement(&grid, size, seed);
        let exact = certify(&grid, &u, 1e-3);
        let quick = certify_below(&grid, &u, 1e-3, detail);
        prop_assert_eq!(exact.certified, quick.certified);
        if exact.min_det > detail {
            // An estimate is a lower bound; where it is not above the detail it is not used.
            prop_assert!(detail < quick.min_det && quick.min_det <= exact.min_det + 1e-12);
        } else {
            prop_assert_eq!(exact.min_det, quick.min_det);
        }
        if exact.min_corner_det <= detail {
            prop_assert_eq!(exact.min_corner_det, quick.min_corner_det);
        } else {
            prop_assert!(quick.min_corner_det > detail);
        }
    }

    #[test]
    fn inverse_undoes_the_deformation(seed in 0u64..1000, size in 0.0f64..0.12) {
        check_inverse(&Grid::<2>::cube(17), seed, size)?;
        check_inverse(&Grid::<3>::cube(9), seed, size)?;
        check_inverse(&Grid::<2>::with_nodes([9, 21], 0.05).unwrap(), seed, size)?;
    }
}

fn check_inverse<const D: usize>(
    grid: &Grid<D>,
    seed: u64,
    size: f64,
) -> Result<(), TestCaseError> {
    let u = smooth_displacement(grid, size, seed);
    prop_assume!(certify(grid, &u, 0.05).certified);
    let displacement = Field::from_vec(*grid, u).unwrap();
    let inverse = InverseDeformation::new(&displacement);
    let mut found = 0;
    for node in 0..grid.n_nodes() {
        let target = grid.position(grid.node(node));
        if let Some(x) = inverse.position(node) {
            found += 1;
            let u = displacement.sample(x);
            for k in 0..D {
                prop_assert!((x[k] + u[k] - target[k]).abs() < 1e-10);
            }
        } else {
            // Only nodes near the faces can lie outside the image.
            let extent = grid.extent();
            let margin = (0..D)
                .map(|k| target[k].min(extent[k] - target[k]))
                .fold(1.0, f64::min);
            let largest = displacement
                .as_slice()
                .iter()
                .fold(0.0f64, |m, x| m.max(x.abs()));
            prop_assert!(margin <= largest);
        }
    }
    prop_assert!(found > grid.n_nodes() / 3);
    Ok(())
}

#[test]
fn a_certified_affine_map_has_its_determinant() {
    let grid = Grid::<3>::cube(5);
    let map = [[0.3, 0.1, -0.2], [0.0, -0.4, 0.1], [0.05, 0.2, 0.1]];
    let field = Field::<f64, 3, 3>::from_fn(grid, |x| {
        std::array::from_fn(|m| (0..3).map(|k| map[m][k] * x[k]).sum())
    });
    let certificate = certify(&grid, field.as_slice(), 1e-3);
    let exact = tensor::determinant(&tensor::add_identity(&map));
    assert!((certificate.min_det - exact).abs() < 1e-12);
    assert!(certificate.certified);
}

#[test]
fn a_fold_is_found() {
    let grid = Grid::<3>::cube(5);
    let mut u = vec![0.0; 3 * grid.n_nodes()];
    u[grid.node_index([2, 2, 2])] = 0.3;
    let certificate = certify(&grid, &u, 0.0);
    assert!(!certificate.certified && certificate.min_det < 0.0);
    u[5] = f64::NAN;
    assert!(!certify(&grid, &u, 0.0).certified);
    assert!(!certify_below(&grid, &u, 0.0, 0.2).certified);
}

#[test]
fn push_forward_moves_a_field() {
    let grid = Grid::<2>::cube(33);
    let shift = Field::<f64, 2, 2>::from_fn(grid, |_| [0.125, -0.0625]);
    let bump = |x: [f64; 2]| [(-20.0 * ((x[0] - 0.4).powi(2) + (x[1] - 0.5).powi(2))).exp()];
    let field = ScalarField::from_fn(grid, bump);
    let pushed = InverseDeformation::new(&shift).push_forward(&field, -1.0);
    for node in 0..grid.n_nodes() {
        let x = grid.position(grid.node(node));
        let source = [x[0] - 0.125, x[1] + 0.0625];
        let inside = source[0] >= -1e-12 && source[1] <= 1.0 + 1e-12;
        // The shift is a whole number of cells: nodal values move to nodes.
        let expected = if inside { bump(source)[0] } else { -1.0 };
        assert!((pushed.at(node)[0] - expected).abs() < 1e-9);
    }
}

#[test]
fn transfer_is_nested_and_adjoint() {
    fn check<const D: usize>(nodes: [usize; D]) {
        let coarse = Grid::with_nodes(nodes, 0.25).unwrap();
        let fine = coarse.finer();
        let x = noise(2 * coarse.n_nodes(), 1);
        let y = noise(2 * fine.n_nodes(), 2);
        let (mut px, mut ry) = (vec![0.0; y.len()], vec![0.0; x.len()]);
        prolong_into(&coarse, &x, &mut px);
        restrict_into(&coarse, &y, &mut ry);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&px, &y) - dot(&x, &ry)).abs() < 1e-12);
        let interpolant = Interpolant::new(coarse, &x[..coarse.n_nodes()]);
        for node in 0..fine.n_nodes() {
            let (value, _) = interpolant.sample::<f64>(&fine.position(fine.node(node)));
            assert!((value - px[node]).abs() < 1e-12);
        }
        let mut back = vec![0.0; x.len()];
        inject_into(&coarse, &px, &mut back);
        assert_eq!(x, back);
        let cells = noise(fine.n_cells(), 3);
        let means = average_cells(&coarse, &cells);
        let (all, mean) = (cells.iter().sum::<f64>(), means.iter().sum::<f64>());
        assert!((all - mean * f64::from(1u32 << D)).abs() < 1e-12);
    }
    check([5, 9]);
    check([3, 5, 4]);
}

#[test]
fn only_marked_cells_count() {
    let grid = Grid::<2>::cube(5);
    let mut u = vec![0.0; 2 * grid.n_nodes()];
    // The second node of the first row goes past the third: the second cell folds.
    u[1] = 0.3;
    let fold = violations(&grid, &u, 0.0, None);
    assert_eq!(fold, [1]);
    let mut marks = vec![true; grid.n_cells()];
    marks[1] = false;
    assert!(violations(&grid, &u, 0.0, Some(&marks)).is_empty());
    assert!(!certify(&grid, &u, 0.0).certified);
    let certificate = certify_within(&grid, &u, 0.0, f64::INFINITY, Some(&marks));
    assert!(certificate.certified && certificate.cell != 1);
    let nothing = certify_within(&grid, &u, 0.0, 0.0, Some(&vec![false; grid.n_cells()]));
    assert!(nothing.certified && nothing.min_det == f64::INFINITY);
}

/// A step of two deformations, one of which would fold, with a field that belongs to both.
#[test]
fn parts_of_a_step_are_damped_alike() {
    let grid = Grid::<2>::cube(9);
    let n = grid.n_nodes();
    let rest = vec![0.0; 2 * n];
    let mut step = vec![1.0; 5 * n];
    for (node, s) in step[..n].iter_mut().enumerate() {
        let [x, _] = grid.position(grid.node(node));
        *s = if x < 0.5 { 0.3 } else { 0.0 };
    }
    step[n..2 * n].fill(0.0);
    let part = |first: usize| Restrained {
        displacement: &rest,
        range: first * n..(first + 2) * n,
        within: None,
    };
    restrain_together(&grid, &[part(0), part(2)], &mut step, 0.1);
    assert!(certify(&grid, &step[..2 * n], 0.1).certified);
    for node in 0..n {
        let kept = step[4 * n + node];
        assert!((0.0..=1.0).contains(&kept));
        assert_eq!(step[2 * n + node], kept);
        let [x, _] = grid.position(grid.node(node));
        assert_eq!(step[node], if x < 0.5 { 0.3 * kept } else { 0.0 });
    }
    assert!(step[4 * n..].iter().any(|&kept| kept < 1.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Outside, the value at the nearest point less the distance to it, and its slope.
    #[test]
    fn falling_fields_fall_off(seed in 0u64..1000, x in -1.0..2.0f64, y in -1.0..2.0f64) {
        let grid = Grid::<2>::cube(4);
        let values = noise(grid.n_nodes(), seed);
        let inner = Interpolant::new(grid, &values);
        let falling = inner.with_outside(Outside::Falling);
        let nearest = [x.clamp(0.0, 1.0), y.clamp(0.0, 1.0)];
        let away = (x - nearest[0]).hypot(y - nearest[1]);
        let (value, slope) = falling.sample(&[x, y]);
        prop_assert!((value - (inner.sample(&nearest).0 - away)).abs() < 1e-12);
        let h = 1e-6;
        for (k, slope) in slope.into_iter().enumerate() {
            let at = |t: f64| {
                let mut p = [x, y];
                p[k] += t;
                falling.sample(&p).0
            };
            // Differences across the face of a cell are between the slopes on its two sides.
            let (left, right) = ((at(0.0) - at(-h)) / h, (at(h) - at(0.0)) / h);
            let close = (slope - left).abs().min((slope - right).abs());
            prop_assert!(close < 1e-4, "{} {} {}", slope, left, right);
        }
    }
}

/// Comparisons with NaN are false, and minima leave it out.
#[test]
fn what_is_not_finite_is_not_certified() {
    fn check<T: Element, const D: usize>(values: [T; 3]) {
        let grid = Grid::<D>::dyadic(3);
        let n = D * grid.n_nodes();
        for value in values {
            let mut one = vec![T::default(); n];
            one[n / 2] = value;
            for field in [one, vec![value; n]] {
                let bad = violations(&grid, &field, 0.0, None);
                assert!(!bad.is_empty());
                for detail in [0.3, f64::INFINITY] {
                    let found = certify_below(&grid, &field, 0.0, detail);
                    assert!(!found.certified, "{found:?}");
                    assert_eq!(found.min_det, f64::NEG_INFINITY);
                    assert!(bad.contains(&found.cell));
                }
            }
        }
    }
    check::<f64, 2>([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
    check::<f64, 3>([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
    check::<f32, 2>([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
    check::<f32, 3>([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
}

/// A step that is not finite is not taken.
#[test]
fn steps_that_are_not_finite_are_not_taken() {
    let grid = Grid::<2>::dyadic(3);
    let n = 2 * grid.n_nodes();
    let displacement = vec![0.0; n];
    for value in [f64::INFINITY, f64::NAN] {
        let mut step = vec![1e-3; n];
        step[n / 2] = value;
        restrain_step(&grid, &displacement, &mut step, 0.0, None);
        assert_eq!(step, displacement, "{value}");
    }
}
