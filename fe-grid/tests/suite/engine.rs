//! The cell engine: derivatives, adjoints, symmetry, and bits that do not depend on threads.

use crate::support::smooth_displacement;
use fe_grid::composition::{Interpolant, MatchDensity, Matching};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::linear::LinearOperator;
use fe_grid::operators::{MassStiffness, WeightedMassStiffness};
use fe_grid::random::noise;
use fe_grid::scatter::{NormalEquations, PointWeights, Source, normal_equations};
use fe_grid::stencil::Background;
use fe_grid::{Assembly, CellLaw, Data, Grid, Half, Jet, Lane, Point, Reads, SimdLevel, tensor};
use proptest::prelude::*;
use test_support::on_threads;

/// A stored energy with all ingredients: a coefficient, the value, the gradient, the logarithm.
#[derive(Clone, Copy)]
struct TestLaw;

impl Reads for TestLaw {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = true;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 1;
}

impl<const D: usize> CellLaw<D, D> for TestLaw {
    #[inline(always)]
    fn value<L: Lane>(&self, p: &Point<L, D, D>) -> L {
        let det = tensor::determinant(&tensor::add_identity(&p.gradient));
        let mut quartic = L::zero();
        for u in p.value {
            quartic = (u * u).mul_add(u * u, quartic);
        }
        let elastic = tensor::squared_norm_excess(&p.gradient).scale(0.5) - det.ln();
        elastic.mul_add(p.coefficient[0], quartic * p.cell[0])
    }

    #[inline(always)]
    fn gradient<L: Lane>(&self, p: &Point<L, D, D>) -> (L, Jet<L, D, D>) {
        let a = tensor::add_identity(&p.gradient);
        let inverse = tensor::inverse_transpose(&a);
        let stress = tensor::add_scaled(&a, -L::one(), &inverse);
        let mut flux = Jet {
            value: p.value,
            gradient: tensor::scale(&stress, p.coefficient[0]),
        };
        for v in &mut flux.value {
            *v = (*v * *v * *v).scale(4.0) * p.cell[0];
        }
        (self.value(p), flux)
    }

    #[inline(always)]
    fn hessian_action<L: Lane>(&self, p: &Point<L, D, D>, d: &Jet<L, D, D>) -> Jet<L, D, D> {
        let inverse = tensor::inverse_transpose(&tensor::add_identity(&p.gradient));
        let turned = tensor::product_transposed(&inverse, &d.gradient);
        let change = tensor::add(&d.gradient, &tensor::product(&turned, &inverse));
        let mut flux = Jet {
            value: d.value,
            gradient: tensor::scale(&change, p.coefficient[0]),
        };
        for (v, u) in flux.value.iter_mut().zip(p.value) {
            *v = (*v * u * u).scale(12.0) * p.cell[0];
        }
        flux
    }
}

struct Case<const D: usize> {
    grid: Grid<D>,
    state: Vec<f64>,
    direction: Vec<f64>,
    coefficient: Vec<f64>,
    cells: Vec<f64>,
}

impl<const D: usize> Case<D> {
    fn new(nodes: [usize; D], seed: u64) -> Self {
        let grid = Grid::with_nodes(nodes, 0.1).unwrap();
        Self {
            grid,
            state: smooth_displacement(&grid, 0.04, seed),
            direction: noise(D * grid.n_nodes(), seed + 1),
            coefficient: noise(grid.n_nodes(), seed + 2)
                .iter()
                .map(|x| x + 2.0)
                .collect(),
            cells: noise(grid.n_cells(), seed + 3),
        }
    }

    fn with<R>(&self, run: impl FnOnce(Assembly<'_, TestLaw, f64, D, D>) -> R) -> R {
        let coefficients = [self.coefficient.as_slice()];
        let cells = [self.cells.as_slice()];
        run(Assembly::new(
            self.grid,
            &TestLaw,
            Data {
                coefficients: &coefficients,
                cells: &cells,
            },
        ))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn check_derivatives<const D: usize>(nodes: [usize; D], seed: u64) {
    let case = Case::new(nodes, seed);
    case.with(|assembly| {
        let n = case.state.len();
        let (mut gradient, mut hessian) = (vec![0.0; n], vec![0.0; n]);
        let value = assembly
            .value_and_gradient_into(&case.state, &mut gradient)
            .unwrap();
        assert_eq!(
            value.to_bits(),
            assembly.value(&case.state).unwrap().to_bits()
        );
        assembly.hessian_action_into(&case.state, &case.direction, &mut hessian);
        let moved = |t: f64| -> Vec<f64> {
            case.state
                .iter()
                .zip(&case.direction)
                .map(|(x, d)| x + t * d)
                .collect()
        };
        // Central differences: error t^2 in theory, observed by halving t.
        let errors = [2e-4, 1e-4].map(|t| {
            let (mut up, mut down) = (vec![0.0; n], vec![0.0; n]);
            let plus = assembly
                .value_and_gradient_into(&moved(t), &mut up)
                .unwrap();
            let minus = assembly
                .value_and_gradient_into(&moved(-t), &mut down)
                .unwrap();
            let slope = ((plus - minus) / (2.0 * t) - dot(&gradient, &case.direction)).abs();
            let curvature = (0..n)
                .map(|i| ((up[i] - down[i]) / (2.0 * t) - hessian[i]).abs())
                .fold(0.0, f64::max);
            (slope, curvature)
        });
        let scale = dot(&hessian, &case.direction).abs();
        for (coarse, fine) in [(errors[0].0, errors[1].0), (errors[0].1, errors[1].1)] {
            // Second order down to the rounding of the differences.
            assert!(fine < 0.3 * coarse + 1e-9 * scale, "{coarse} {fine}");
            assert!(fine < 1e-2 * scale);
        }
    });
}

#[test]
fn derivatives_agree_with_differences() {
    for seed in 0..4 {
        check_derivatives([6, 9], seed);
        check_derivatives([19, 4], seed);
        check_derivatives([4, 6, 5], seed);
        check_derivatives([13, 3, 4], seed);
    }
}

#[test]
fn hessian_and_its_diagonal_agree() {
    fn check<const D: usize>(nodes: [usize; D]) {
        let case = Case::new(nodes, 7);
        case.with(|assembly| {
            let n = case.grid.n_nodes();
            let mut diagonal = vec![0.0; D * D * n];
            assembly.block_diagonal_into(&case.state, &mut diagonal);
            let (mut unit, mut column) = (vec![0.0; D * n], vec![0.0; D * n]);
            for node in [0, n / 2, n - 1] {
                for m in 0..D {
                    unit[m * n + node] = 1.0;
                    assembly.hessian_action_into(&case.state, &unit, &mut column);
                    unit[m * n + node] = 0.0;
                    for r in 0..D {
                        let (a, b) = (column[r * n + node], diagonal[(r * D + m) * n + node]);
                        assert!(
                            (a - b).abs() <= 1e-13 * column[m * n + node].abs(),
                            "{a} {b}"
                        );
                    }
                }
            }
            let other = noise(D * n, 99);
            let (mut h1, mut h2) = (vec![0.0; D * n], vec![0.0; D * n]);
            assembly.hessian_action_into(&case.state, &case.direction, &mut h1);
            assembly.hessian_action_into(&case.state, &other, &mut h2);
            let (a, b) = (dot(&h1, &other), dot(&h2, &case.direction));
            assert!((a - b).abs() < 1e-12 * a.abs().max(b.abs()));
        });
    }
    check([7, 6]);
    check([5, 4, 6]);
}

/// All results that depend on the order of sums.
fn bits<const D: usize>(nodes: [usize; D], level: SimdLevel, threads: usize) -> Vec<u64> {
    let case = Case::new(nodes, 3);
    on_threads(threads, || {
        case.with(|assembly| {
            let assembly = assembly.with_simd_level(level);
            let n = case.state.len();
            let mut out = vec![0.0; 2 * n];
            let (gradient, hessian) = out.split_at_mut(n);
            let value = assembly
                .value_and_gradient_into(&case.state, gradient)
                .unwrap();
            assembly.hessian_action_into(&case.state, &case.direction, hessian);
            out.push(value);
            let density = Square;
            let field = Interpolant::new(case.grid, &case.coefficient);
            let law = Matching::new(density, field);
            let coefficients = [case.coefficient.as_slice()];
            let data = Data {
                coefficients: &coefficients,
                cells: &[],
            };
            let mut gradient = vec![0.0; n];
            let matching = Assembly::new(case.grid, &law, data).with_simd_level(level);
            out.push(
                matching
                    .value_and_gradient_into(&case.state, &mut gradient)
                    .unwrap(),
            );
            out.extend(gradient);
            let source = Source {
                displacement: &case.state,
                coefficients: &coefficients,
                weight: 1.0,
            };
            let (matrix, rhs) = normal_equations(
                &case.grid,
                &Square,
                &[source, source],
                Background::default(),
            );
            out.extend(matrix.row_sums());
            out.extend(rhs);
            out.iter().map(|x| x.to_bits()).collect()
        })
    })
}

#[test]
fn bits_depend_on_neither_threads_nor_instruction_set() {
    fn check<const D: usize>(nodes: [usize; D]) {
        let reference = bits(nodes, SimdLevel::Scalar, 1);
        for level in [SimdLevel::Scalar, SimdLevel::Wide256, SimdLevel::Widest] {
            for threads in [1, 2, 5] {
                assert_eq!(
                    reference,
                    bits(nodes, level, threads),
                    "{level:?}, {threads} threads"
                );
            }
        }
    }
    check([90, 70]);
    check([21, 18, 23]);
}

/// `f(s; c) = (s - c)^2`.
#[derive(Clone, Copy)]
struct Square;

impl MatchDensity for Square {
    const COEFFICIENTS: usize = 1;
    #[inline(always)]
    fn value<L: Lane>(&self, s: L, c: &[L; MAX_COEFFICIENTS]) -> L {
        (s - c[0]) * (s - c[0])
    }
    #[inline(always)]
    fn derivatives<L: Lane>(&self, s: L, c: &[L; MAX_COEFFICIENTS]) -> (L, L, L) {
        (self.value(s, c), (s - c[0]).scale(2.0), L::splat(2.0))
    }
}

impl Reads for Square {
    const USES_VALUE: bool = true;
    const USES_GRADIENT: bool = false;
    const COEFFICIENTS: usize = 1;
    const CELL_DATA: usize = 0;
}

impl<const D: usize> PointWeights<D> for Square {
    #[inline(always)]
    fn weights<L: Lane>(&self, point: &Point<L, D, D>, _: &[L; D]) -> (L, L) {
        (L::one(), point.coefficient[0])
    }
}

/// The composition energy `int (V o Phi - c)^2` as a quadratic form in `V` through the normal
/// equations, against the law: the same number, and the derivative by `V`.
#[test]
fn composition_and_its_adjoint_agree() {
    fn check<const D: usize>(nodes: [usize; D], amplitude: f64) {
        let grid = Grid::with_nodes(nodes, 1.0 / 16.0).unwrap();
        let displacement = smooth_displacement(&grid, amplitude, 5);
        let field = noise(grid.n_nodes(), 6);
        let target = noise(grid.n_nodes(), 7);
        let coefficients = [target.as_slice()];
        let law = Matching::new(Square, Interpolant::new(grid, &field));
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let value = Assembly::new(grid, &law, data)
            .value(&displacement)
            .unwrap();
        let source = Source {
            displacement: &displacement,
            coefficients: &coefficients,
            weight: 1.0,
        };
        let (matrix, rhs) = normal_equations(&grid, &Square, &[source], Background::default());
        let mut product = vec![0.0; field.len()];
        matrix.apply_into(&field, &mut product);
        // int c^2: the composition of zero.
        let zero = vec![0.0; grid.n_nodes()];
        let law = Matching::new(Square, Interpolant::new(grid, &zero));
        let constant = Assembly::new(grid, &law, data)
            .value(&displacement)
            .unwrap();
        let quadratic = dot(&field, &product) - 2.0 * dot(&field, &rhs) + constant;
        assert!(
            (value - quadratic).abs() < 1e-12 * value,
            "{value} {quadratic}"
        );
        // The sum of all entries is the volume: shape functions add to one everywhere.
        let volume: f64 = grid.extent().iter().product();
        assert!((matrix.row_sums().iter().sum::<f64>() - volume).abs() < 1e-12 * volume);
        let entries = matrix.entries();
        let dense: f64 = entries.map(|(i, j, a)| field[i] * a * field[j]).sum();
        assert!((dense - dot(&field, &product)).abs() < 1e-12 * dense);
    }
    check([17, 17], 0.05);
    check([21, 12], 0.4);
    check([9, 10, 11], 0.05);
    check([17, 6, 8], 0.4);
}

/// Memory that is used again leaves no trace.
#[test]
fn normal_equations_are_assembled_again() {
    fn check<const D: usize>(n: usize) {
        let grid = Grid::<D>::cube(n);
        let [first, second] = [1, 2].map(|seed| smooth_displacement(&grid, 0.05, seed));
        let target = noise(grid.n_nodes(), 3);
        let coefficients = [target.as_slice()];
        let source = |displacement| Source {
            displacement,
            coefficients: &coefficients,
            weight: 1.0,
        };
        let background = Background {
            mass: 0.1,
            stiffness: 0.2,
            load: 0.3,
        };
        let mut equations = NormalEquations::new(grid);
        equations.assemble(&Square, &[source(&first)], background, None);
        equations.assemble(&Square, &[source(&second)], background, None);
        let (matrix, rhs) = normal_equations(&grid, &Square, &[source(&second)], background);
        assert_eq!(equations.rhs(), rhs);
        assert_eq!(equations.matrix().row_sums(), matrix.row_sums());
        assert_eq!(equations.matrix().diagonal(), matrix.diagonal());
    }
    check::<2>(12);
    check::<3>(7);
}

#[test]
fn composition_gradient_agrees_with_differences() {
    fn check<const D: usize>(n: usize) {
        let grid = Grid::<D>::cube(n);
        let displacement = smooth_displacement(&grid, 0.05, 1);
        let direction = noise(displacement.len(), 2);
        let field = noise(grid.n_nodes(), 3);
        let target = noise(grid.n_nodes(), 4);
        let coefficients = [target.as_slice()];
        let law = Matching::new(Square, Interpolant::new(grid, &field));
        let assembly = Assembly::new(
            grid,
            &law,
            Data {
                coefficients: &coefficients,
                cells: &[],
            },
        );
        let mut gradient = vec![0.0; displacement.len()];
        assembly
            .value_and_gradient_into(&displacement, &mut gradient)
            .unwrap();
        let value = |t: f64| {
            let x: Vec<f64> = displacement
                .iter()
                .zip(&direction)
                .map(|(x, d)| x + t * d)
                .collect();
            assembly.value(&x).unwrap()
        };
        // Smooth between the kinks at the faces of cells, which a step this short rarely meets.
        let t = 1e-7;
        let slope = (value(t) - value(-t)) / (2.0 * t);
        let exact = dot(&gradient, &direction);
        assert!(
            (slope - exact).abs() < 1e-5 * exact.abs().max(1.0),
            "{slope} {exact}"
        );
    }
    check::<2>(9);
    check::<3>(5);
}

#[test]
fn mass_and_stiffness_agree_with_their_matrices() {
    fn check<const D: usize>(nodes: [usize; D]) {
        let grid = Grid::with_nodes(nodes, 0.2).unwrap();
        let x = noise(grid.n_nodes(), 1);
        for (mass, stiffness) in [(1.0, 0.0), (0.0, 1.0), (0.3, 2.0)] {
            let law = MassStiffness { mass, stiffness };
            let mut y = vec![0.0; x.len()];
            Assembly::<_, f64, D, 1>::new(grid, &law, Data::default())
                .hessian_action_into(&x, &x, &mut y);
            let background = Background {
                mass,
                stiffness,
                load: 0.0,
            };
            let (matrix, _) = normal_equations::<f64, _, D>(&grid, &Square, &[], background);
            let mut z = vec![0.0; x.len()];
            matrix.apply_into(&x, &mut z);
            for (a, b) in y.iter().zip(&z) {
                assert!((a - b).abs() < 1e-14, "{a} {b}");
            }
        }
    }
    check([6, 9]);
    check([5, 4, 7]);
}

#[test]
fn single_precision_agrees_to_its_accuracy() {
    let case = Case::<3>::new([9, 8, 7], 11);
    let narrow = |v: &[f64]| -> Vec<f32> { v.iter().map(|&x| x as f32).collect() };
    let (coefficient, cells) = (narrow(&case.coefficient), narrow(&case.cells));
    let data = Data {
        coefficients: &[coefficient.as_slice()],
        cells: &[cells.as_slice()],
    };
    let mut gradient = vec![0.0f32; case.state.len()];
    let value = Assembly::new(case.grid, &TestLaw, data)
        .value_and_gradient_into(&narrow(&case.state), &mut gradient)
        .unwrap();
    case.with(|assembly| {
        let mut exact = vec![0.0; case.state.len()];
        let exact_value = assembly
            .value_and_gradient_into(&case.state, &mut exact)
            .unwrap();
        assert!((value - exact_value).abs() < 1e-5 * exact_value.abs());
        let largest = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (a, b) in gradient.iter().zip(&exact) {
            assert!((f64::from(*a) - b).abs() < 1e-5 * largest);
        }
    });
}

/// Coefficients in halves give the bits of their numbers in single precision, at the ends of rows, too.
#[test]
fn cells_in_halves_have_the_bits_of_their_numbers() {
    let case = Case::<3>::new([21, 4, 5], 12);
    let state: Vec<f32> = case.state[..2 * case.grid.n_nodes()]
        .iter()
        .map(|x| *x as f32)
        .collect();
    let halves = [3, 4].map(|seed| -> Vec<Half> {
        let numbers = noise(case.grid.n_cells(), seed);
        numbers.iter().map(|x| Half::of(*x as f32)).collect()
    });
    let widened = [0, 1].map(|k| -> Vec<f32> { halves[k].iter().map(|x| x.to_single()).collect() });
    let data = Data {
        coefficients: &[],
        cells: &[&widened[0], &widened[1]],
    };
    let halves = [&halves[0][..], &halves[1][..]];
    let law = WeightedMassStiffness;
    let image = |assembly: Assembly<'_, WeightedMassStiffness, f32, 3, 2>| {
        let mut image = vec![0.0f32; state.len()];
        assembly.hessian_action_into(&state, &state, &mut image);
        image
    };
    let whole = image(Assembly::new(case.grid, &law, data));
    assert!(whole.iter().any(|x| *x != 0.0));
    assert!(image(Assembly::with_halves(case.grid, &law, &halves)) == whole);
}

#[test]
fn a_folded_state_names_its_cell() {
    let mut case = Case::<2>::new([8, 8], 1);
    let node = case.grid.node_index([5, 4]);
    case.state[node] -= 0.5;
    let error = case
        .with(|assembly| assembly.value(&case.state))
        .unwrap_err();
    let fe_grid::GridError::Inadmissible { cell } = error else {
        panic!("{error}")
    };
    let cell = case.grid.cell(cell);
    assert!(
        (3..=5).contains(&cell[0]) && (3..=4).contains(&cell[1]),
        "{cell:?}"
    );
}

proptest! {
    #[test]
    fn interpolants_give_nodal_values(i in 0usize..9, j in 0usize..7, seed in 0u64..50) {
        let grid = Grid::<2>::with_nodes([9, 7], 0.3).unwrap();
        let field = noise(grid.n_nodes(), seed);
        let interpolant = Interpolant::new(grid, &field);
        let (value, _) = interpolant.sample::<f64>(&grid.position([i, j]));
        prop_assert!((value - field[grid.node_index([i, j])]).abs() < 1e-13);
    }
}
