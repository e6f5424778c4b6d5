//! Mismatch and interface length on grids: closed forms, derivatives, convexity.

use fe_grid::composition::{Interpolant, MatchDensity, Matching};
use fe_grid::engine::MAX_COEFFICIENTS;
use fe_grid::scatter::{Source, normal_equations};
use fe_grid::stencil::Background;
use fe_grid::{
    Assembly, CgParams, CgScratch, Data, Diagonal, Field, Grid, LinearOperator, ScalarField,
    conjugate_gradient,
};
use phasefield::profile::{MISMATCH_FLOOR, MISMATCH_MATCHED, MISMATCH_UNMATCHED};
use phasefield::{InterfaceLength, Mismatch, Profile};
use proptest::prelude::*;

/// A straight edge across the middle of a box of side one along the last axis, two cells wide
/// along the others: fields vary along the last axis alone.
struct Edge<const D: usize> {
    grid: Grid<D>,
    width: f64,
    phase_field: ScalarField<f64, D>,
}

impl<const D: usize> Edge<D> {
    /// The width is the same on all grids, and so narrow that the profile ends in the box.
    fn new(cells: usize) -> Self {
        let width = 0.02;
        let mut nodes = [3; D];
        nodes[D - 1] = cells + 1;
        let grid = Grid::with_nodes(nodes, 1.0 / cells as f64).unwrap();
        let distance = ScalarField::from_fn(grid, |x| [x[D - 1] - 0.5]);
        let phase_field = Profile::new(width).unwrap().phase_field(&distance);
        Self {
            grid,
            width,
            phase_field,
        }
    }

    /// Length (area) of the edge in the box.
    fn size(&self) -> f64 {
        let extent = self.grid.extent();
        extent[..D - 1].iter().product()
    }

    fn density(&self) -> Mismatch {
        Mismatch {
            interface_width: self.width,
            scale: 1.0,
        }
    }

    /// Mismatch a unit of the edge with a field.
    fn mismatch(&self, average: &[f64]) -> f64 {
        let law = Matching::new(self.density(), Interpolant::new(self.grid, average));
        let coefficients = [self.phase_field.as_slice()];
        let data = Data {
            coefficients: &coefficients,
            cells: &[],
        };
        let still = vec![0.0; D * self.grid.n_nodes()];
        Assembly::new(self.grid, &law, data).value(&still).unwrap() / self.size()
    }

    /// The field of least mismatch, from the normal equations.
    fn best(&self) -> Vec<f64> {
        let still = vec![0.0; D * self.grid.n_nodes()];
        let coefficients = [self.phase_field.as_slice()];
        let source = Source {
            displacement: &still,
            coefficients: &coefficients,
            weight: 1.0,
        };
        let background = Background::default();
        let (matrix, rhs) = normal_equations(&self.grid, &self.density(), &[source], background);
        let jacobi = Diagonal::jacobi(&matrix.diagonal()).unwrap();
        let mut best = vec![1.0; rhs.len()];
        let mut scratch = CgScratch::default();
        let params = CgParams::default();
        conjugate_gradient(&matrix, &jacobi, &rhs, &mut best, &params, &mut scratch).unwrap();
        best
    }

    fn length(&self) -> f64 {
        let law = InterfaceLength {
            interface_width: self.width,
        };
        let assembly = Assembly::<_, f64, D, 1>::new(self.grid, &law, Data::default());
        let phase_field = self.phase_field.as_slice();
        let length = assembly.value(phase_field).unwrap();
        // A sum over nodes in place of one over quadrature points.
        let applied = law.of(&self.grid, phase_field);
        assert!(
            (applied - length).abs() < 1e-11 * length,
            "{applied} {length}"
        );
        length / self.size()
    }

    /// What the closed forms are for: unmatched, matched, best match, length.
    fn figures(&self) -> [f64; 4] {
        let ones = vec![1.0; self.grid.n_nodes()];
        [
            self.mismatch(&ones),
            self.mismatch(self.phase_field.as_slice()),
            self.mismatch(&self.best()),
            self.length(),
        ]
    }
}

const CLOSED_FORMS: [f64; 4] = [MISMATCH_UNMATCHED, MISMATCH_MATCHED, MISMATCH_FLOOR, 1.0];

/// Errors fall with the second power of the spacing (the edge, where the profile has a kink, is a
/// plane of nodes on all grids). Where the density is a function `f` of the phase field alone, the
/// leading term is a multiple of `f(1) - f(0)`; it vanishes for an edge against itself and
/// against its best match, and the next is of the fourth power.
const ORDERS: [f64; 4] = [2.0, 4.0, 4.0, 2.0];

fn check_convergence<const D: usize>() {
    let grids = [200, 400, 800].map(|cells| Edge::<D>::new(cells).figures());
    for (f, exact) in CLOSED_FORMS.into_iter().enumerate() {
        let errors = grids.map(|figures| (figures[f] - exact).abs());
        assert!(errors[2] < 1e-3 * exact, "{errors:?}");
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!(
                (order - ORDERS[f]).abs() < 0.15,
                "figure {f}: order {order}"
            );
        }
    }
}

#[test]
fn a_straight_edge_has_its_closed_forms_in_2d() {
    check_convergence::<2>();
}

#[test]
fn a_straight_edge_has_its_closed_forms_in_3d() {
    check_convergence::<3>();
}

/// A width of two spacings, as averages have it, keeps all figures within a few percent.
#[test]
fn two_spacings_resolve_an_edge() {
    let edge = Edge::<2>::new(25);
    assert!(
        (edge.width * 25.0 - 0.5).abs() < 1e-12,
        "half a spacing: far too coarse"
    );
    let edge = Edge::<2>::new(100);
    assert!((edge.width * 100.0 - 2.0).abs() < 1e-12);
    for (found, exact) in edge.figures().into_iter().zip(CLOSED_FORMS) {
        assert!((found / exact - 1.0).abs() < 0.04, "{found} {exact}");
    }
}

proptest! {
    /// The density, its slope and its curvature: it is quadratic in the composed value, so that
    /// differences of any step are exact up to rounding.
    #[test]
    fn derivatives_of_the_density(
        s in -0.5f64..1.5, v in -0.2f64..1.2, width in 0.01f64..1.0, t in 0.1f64..1.0
    ) {
        let density = Mismatch { interface_width: width, scale: 0.7 };
        let mut coefficient = [0.0; MAX_COEFFICIENTS];
        coefficient[0] = v;
        let value = |s: f64| density.value(s, &coefficient);
        let (f, slope, curvature) = density.derivatives(s, &coefficient);
        prop_assert_eq!(f.to_bits(), value(s).to_bits());
        let scale = 1.0 / (width * t * t);
        let difference = (value(s + t) - value(s - t)) / (2.0 * t);
        prop_assert!((slope - difference).abs() < 1e-13 * scale);
        let second = (value(s + t) - 2.0 * value(s) + value(s - t)) / (t * t);
        prop_assert!((curvature - second).abs() < 1e-13 * scale);
        // Convex in s whatever v, and nowhere negative.
        prop_assert!(curvature > 0.0 && f >= 0.0);
    }
}

/// Smooth fields with nothing special about them.
fn wave<const D: usize, const M: usize>(grid: Grid<D>, phase: f64) -> Field<f64, D, M> {
    Field::from_fn(grid, |x| {
        std::array::from_fn(|m| {
            let terms = (0..D).map(|k| (4.0 * x[k] + phase * (m + 1) as f64 + k as f64).sin());
            terms.product()
        })
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn moved(x: &[f64], t: f64, d: &[f64]) -> Vec<f64> {
    x.iter().zip(d).map(|(x, d)| x + t * d).collect()
}

fn check_mismatch_gradient<const D: usize>(cells: usize) {
    let grid = Grid::<D>::cube(cells + 1);
    let density = Mismatch {
        interface_width: 0.3,
        scale: 1.0,
    };
    let (average, phase_field) = (wave::<D, 1>(grid, 0.3), wave::<D, 1>(grid, 1.1));
    let law = Matching::new(density, Interpolant::new(grid, average.as_slice()));
    let coefficients = [phase_field.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let assembly = Assembly::new(grid, &law, data);
    let mut u = wave::<D, D>(grid, 0.7).into_vec();
    for u in &mut u {
        *u *= 0.03;
    }
    let direction = wave::<D, D>(grid, 2.0).into_vec();
    let mut gradient = vec![0.0; u.len()];
    assembly.value_and_gradient_into(&u, &mut gradient).unwrap();
    // So short a step moves no point into a cell where the slope of the average is another.
    let t = 1e-6;
    let ahead = assembly.value(&moved(&u, t, &direction)).unwrap();
    let behind = assembly.value(&moved(&u, -t, &direction)).unwrap();
    let (slope, difference) = (dot(&gradient, &direction), (ahead - behind) / (2.0 * t));
    // Rounding of the values over the step.
    assert!(
        (slope - difference).abs() < 1e-8 * slope.abs(),
        "{slope} {difference}"
    );
    // The action that stands in for the Hessian is that of Gauss and Newton: never negative.
    let mut action = vec![0.0; u.len()];
    assembly.hessian_action_into(&u, &direction, &mut action);
    assert!(dot(&action, &direction) > 0.0);
}

#[test]
fn the_gradient_by_the_deformation_agrees_with_differences() {
    check_mismatch_gradient::<2>(12);
    check_mismatch_gradient::<3>(6);
}

/// The mismatch is a quadratic form of the average: exact second differences along a line, all
/// of them positive.
fn check_convexity<const D: usize>(cells: usize) {
    let grid = Grid::<D>::cube(cells + 1);
    let density = Mismatch {
        interface_width: 0.3,
        scale: 1.0,
    };
    let phase_field = wave::<D, 1>(grid, 1.1);
    let mut u = wave::<D, D>(grid, 0.7).into_vec();
    for u in &mut u {
        *u *= 0.05;
    }
    let coefficients = [phase_field.as_slice()];
    let data = Data {
        coefficients: &coefficients,
        cells: &[],
    };
    let energy = |v: &[f64]| {
        let law = Matching::new(density, Interpolant::new(grid, v));
        Assembly::new(grid, &law, data).value(&u).unwrap()
    };
    let source = Source {
        displacement: &u,
        coefficients: &coefficients,
        weight: 1.0,
    };
    let (matrix, rhs) = normal_equations(&grid, &density, &[source], Background::default());
    for phase in [0.0, 0.9, 2.3] {
        let v = wave::<D, 1>(grid, phase).into_vec();
        let d = wave::<D, 1>(grid, phase + 1.7).into_vec();
        let second = energy(&moved(&v, 1.0, &d)) - 2.0 * energy(&v) + energy(&moved(&v, -1.0, &d));
        let first = 0.5 * (energy(&moved(&v, 1.0, &d)) - energy(&moved(&v, -1.0, &d)));
        let mut product = vec![0.0; v.len()];
        matrix.apply_into(&d, &mut product);
        let curvature = 2.0 * dot(&product, &d);
        assert!(curvature > 0.0);
        assert!(
            (second - curvature).abs() < 1e-12 * energy(&v),
            "{second} {curvature}"
        );
        let slope = 2.0 * (dot(&product, &v) - dot(&rhs, &d));
        assert!(
            (first - slope).abs() < 1e-12 * energy(&v),
            "{first} {slope}"
        );
    }
}

#[test]
fn the_mismatch_is_convex_in_the_average() {
    check_convexity::<2>(12);
    check_convexity::<3>(6);
}

/// Quadratic as well: its value, slope and curvature fit together.
fn check_length<const D: usize>(cells: usize) {
    let grid = Grid::<D>::cube(cells + 1);
    let law = InterfaceLength {
        interface_width: 0.13,
    };
    let assembly = Assembly::<_, f64, D, 1>::new(grid, &law, Data::default());
    let v = wave::<D, 1>(grid, 0.3).into_vec();
    let d = wave::<D, 1>(grid, 1.9).into_vec();
    let (mut gradient, mut action) = (vec![0.0; v.len()], vec![0.0; v.len()]);
    let value = assembly.value_and_gradient_into(&v, &mut gradient).unwrap();
    assembly.hessian_action_into(&v, &d, &mut action);
    let expected = value + dot(&gradient, &d) + 0.5 * dot(&action, &d);
    let found = assembly.value(&moved(&v, 1.0, &d)).unwrap();
    assert!(
        (found - expected).abs() < 1e-12 * found,
        "{found} {expected}"
    );
    assert!(dot(&action, &d) > 0.0);
    // Nothing but the constant one has no length.
    assert_eq!(law.of(&grid, &vec![1.0; v.len()]), 0.0);
    let applied = law.of(&grid, &v);
    assert!((applied - value).abs() < 1e-12 * value, "{applied} {value}");
}

#[test]
fn the_length_is_a_convex_quadratic_form() {
    check_length::<2>(12);
    check_length::<3>(6);
}
