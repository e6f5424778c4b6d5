//! Averages of shapes of several components.

use crate::support::run;
use crate::support::shapes::{ball, ellipsoid, shape};
use fe_grid::communicator::on_threads;
use fe_grid::minimise::{Evaluation, Objective, SecondOrder, Silent};
use fe_grid::vector::dot;
use fe_grid::{Field, Grid, ScalarField};
use levelset::{Cause, Moments, signed_distance};
use shape_average::{
    AverageError, AverageObjective, AverageParams, AverageResult, LevelShapes, Mean, Shapes,
    average_distributed, average_of_components, match_components_to,
};

/// Shapes of two components.
#[derive(Clone)]
struct Pairs<const D: usize> {
    whole: Vec<ScalarField<f64, D>>,
    parts: Vec<ScalarField<f64, D>>,
}

impl<const D: usize> Pairs<D> {
    /// Shapes by the functions of their two components; the greater one is that of the whole.
    fn of<F: Fn([f64; D]) -> [f64; 2]>(grid: Grid<D>, shapes: impl IntoIterator<Item = F>) -> Self {
        let (mut whole, mut parts) = (Vec::new(), Vec::new());
        for both in shapes {
            whole.push(shape(grid, |x| f64::max(both(x)[0], both(x)[1])));
            parts.extend([0, 1].map(|c| shape(grid, |x| both(x)[c])));
        }
        Self { whole, parts }
    }

    /// Every shape twice, as two components that lie on each other.
    fn twice(shapes: &[ScalarField<f64, D>]) -> Self {
        let parts = shapes.iter().flat_map(|s| [s.clone(), s.clone()]);
        Self {
            parts: parts.collect(),
            whole: shapes.to_vec(),
        }
    }

    /// The same with the components in the other order.
    fn permuted(&self) -> Self {
        let mut parts = self.parts.clone();
        for pair in parts.chunks_exact_mut(2) {
            pair.swap(0, 1);
        }
        Self {
            parts,
            whole: self.whole.clone(),
        }
    }

    fn shapes(&self) -> Shapes<'_, D> {
        Shapes::of_components(&self.whole, &self.parts, 2).unwrap()
    }

    fn average(&self, params: &AverageParams) -> AverageResult<D> {
        let result = average_of_components(self.shapes(), &[], &[], params, &mut Silent).unwrap();
        assert!(result.certificate.certified);
        result
    }

    fn objective(&self, params: &AverageParams, seen: bool) -> AverageObjective<D> {
        let grid = *self.whole[0].grid();
        let mut level = LevelShapes::of_shapes(grid, self.shapes(), params).unwrap();
        if seen {
            let mask = |i: usize| ScalarField::from_fn(grid, |x| [1.0 - 0.5 * i as f64 * x[0]]);
            level = level.with_visibility((0..self.whole.len()).map(mask).collect());
        }
        AverageObjective::new(level, params, vec![1.0; 2 * grid.n_nodes()]).unwrap()
    }
}

/// A bar along the first axis whose two components meet at `border`.
fn bar<const D: usize>(border: f64) -> impl Fn([f64; D]) -> [f64; 2] {
    move |x| {
        let across = x[1..].iter().map(|x| (x - 0.5).abs() - 0.13);
        let out = across.fold((x[0] - 0.5).abs() - 0.3, f64::max);
        [f64::min(-out, border - x[0]), f64::min(-out, x[0] - border)]
    }
}

/// Bars of one outline, whose components meet at different places.
fn bars<const D: usize>(grid: Grid<D>) -> Pairs<D> {
    Pairs::of(grid, [bar(0.4), bar(0.55)])
}

/// Two balls of these radii, on either side of the middle.
fn balls<const D: usize>(radii: [f64; 2], apart: f64) -> impl Fn([f64; D]) -> [f64; 2] {
    move |x| {
        [0, 1].map(|c: usize| {
            let mut from = x.map(|x| x - 0.5);
            from[0] -= (c as f64 - 0.5) * apart;
            radii[c] - from.iter().map(|x| x * x).sum::<f64>().sqrt()
        })
    }
}

/// A smooth displacement of every shape.
fn smooth<const D: usize>(grid: Grid<D>, n: usize, amplitude: f64, phase: f64) -> Vec<f64> {
    let of = |i: usize| {
        let u = Field::<f64, D, D>::from_fn(grid, |x| {
            std::array::from_fn(|m| {
                let shift = |k: usize| phase * (1.0 + m as f64) + k as f64 + i as f64;
                let wave = |k: usize| (3.0 * x[k] + shift(k)).sin();
                amplitude * (0..D).map(wave).product::<f64>()
            })
        });
        u.into_vec()
    };
    (0..n).flat_map(of).collect()
}

fn value(found: Evaluation) -> f64 {
    match found {
        Evaluation::Value(value) => value,
        Evaluation::Inadmissible => panic!("an admissible state"),
    }
}

fn volume<const D: usize>(indicator: &ScalarField<f64, D>) -> f64 {
    Moments::of_density(indicator).unwrap().volume
}

/// Central differences of a step that moves hardly any quadrature point into another cell, as for one
/// component.
fn check_gradient<const D: usize>(pairs: &Pairs<D>, params: &AverageParams, seen: bool) {
    let grid = *pairs.whole[0].grid();
    let mut objective = pairs.objective(params, seen);
    let x = smooth(grid, 2, 0.03, 0.4);
    let mut gradient = vec![0.0; x.len()];
    value(objective.value_and_gradient(&x, &mut gradient).unwrap());
    for phase in [0.0, 2.0] {
        let direction = smooth(grid, 2, 1.0, phase);
        let t = 1e-6;
        let mut at = |t: f64| {
            let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + t * d).collect();
            value(objective.value(&moved).unwrap())
        };
        let difference = (at(t) - at(-t)) / (2.0 * t);
        let slope = dot(&gradient, &direction);
        let wrong = (difference - slope).abs();
        assert!(wrong < 1e-6 * slope.abs(), "{difference} {slope}");
    }
}

#[test]
fn the_gradient_is_that_of_the_reduced_functional() {
    let params = AverageParams {
        weights: Some(vec![0.3, 0.7]),
        length_weight: Some(0.1),
        void_stiffness: 0.01,
        ..AverageParams::default()
    };
    for seen in [false, true] {
        check_gradient(&bars(Grid::<2>::dyadic(5)), &params, seen);
        check_gradient(&bars(Grid::<3>::dyadic(3)), &params, seen);
    }
}

/// As for one component: symmetric, and the curvature along smooth directions is the mean change of the
/// gradient over a cell to 10 %.
fn check_hessian<const D: usize>(pairs: &Pairs<D>, params: &AverageParams) {
    let grid = *pairs.whole[0].grid();
    let mut objective = pairs.objective(params, false);
    let x = smooth(grid, 2, 0.01, 0.3);
    let mut gradient = vec![0.0; x.len()];
    value(objective.value_and_gradient(&x, &mut gradient).unwrap());
    let directions = [0.7, 1.9].map(|phase| smooth(grid, 2, 1.0, phase));
    let images = directions.each_ref().map(|d| {
        let mut image = vec![0.0; d.len()];
        objective.hessian_action(&x, d, &mut image).unwrap();
        image
    });
    let [[a, ab], [ba, b]] = [0, 1].map(|i| [0, 1].map(|j: usize| dot(&directions[i], &images[j])));
    // The changes of the averages are solved for to 1e-3.
    assert!((ab - ba).abs() <= 1e-3 * (a * b).sqrt(), "{ab} {ba}");
    for (direction, curvature) in directions.iter().zip([a, b]) {
        let step = 0.5 * grid.spacing();
        let mut slope = |t: f64| {
            let moved: Vec<f64> = x.iter().zip(direction).map(|(x, d)| x + t * d).collect();
            value(objective.value_and_gradient(&moved, &mut gradient).unwrap());
            dot(&gradient, direction)
        };
        let difference = (slope(step) - slope(-step)) / (2.0 * step);
        assert!(
            (curvature / difference - 1.0).abs() < 0.1,
            "{curvature} {difference}"
        );
    }
}

#[test]
fn the_hessian_is_the_mean_change_of_the_gradient() {
    let params = AverageParams {
        interface_cells: 6.0,
        ..AverageParams::default()
    };
    // Without corners, where the averages are not smooth on the scale of a cell.
    let radii = [[0.14, 0.1], [0.12, 0.13]];
    let grid = Grid::<2>::dyadic(6);
    check_hessian(&Pairs::of(grid, radii.map(|r| balls(r, 0.45))), &params);
    let grid = Grid::<3>::dyadic(4);
    check_hessian(&Pairs::of(grid, radii.map(|r| balls(r, 0.45))), &params);
}

/// The functional of shapes that exist twice, and of the same shapes with twice the weights, at one state: the
/// energies and averages have the same bits, as factors of two do not round; sums of three terms do.
fn assert_doubled<const D: usize>(shapes: &[ScalarField<f64, D>], params: &AverageParams) {
    let grid = *shapes[0].grid();
    let doubled = twice_the_weight(params);
    let level = LevelShapes::new(grid, shapes, &doubled).unwrap();
    let mut one = AverageObjective::new(level, &doubled, vec![1.0; grid.n_nodes()]).unwrap();
    let mut two = Pairs::twice(shapes).objective(params, false);
    let x = smooth(grid, shapes.len(), 0.02, 0.4);
    let direction = smooth(grid, shapes.len(), 1.0, 2.0);
    let [mut first, mut second] = [(); 2].map(|()| vec![0.0; x.len()]);
    let energies = [
        one.value_and_gradient(&x, &mut first).unwrap(),
        two.value_and_gradient(&x, &mut second).unwrap(),
    ];
    assert_eq!(value(energies[0]), value(energies[1]));
    assert_close(&first, &second, 1e-14);
    for average in two.average().chunks_exact(grid.n_nodes()) {
        assert!(average == one.average());
    }
    one.update_metric(&x).unwrap();
    two.update_metric(&x).unwrap();
    one.apply_inverse_metric(&direction, &mut first).unwrap();
    two.apply_inverse_metric(&direction, &mut second).unwrap();
    // In single precision, of cells whose sums do not round.
    assert_close(&first, &second, 1e-14);
    one.hessian_action(&x, &direction, &mut first).unwrap();
    two.hessian_action(&x, &direction, &mut second).unwrap();
    assert_close(&first, &second, 1e-13);
}

fn twice_the_weight(params: &AverageParams) -> AverageParams {
    AverageParams {
        mismatch_weight: 2.0 * params.mismatch_weight,
        length_weight: Some(2.0 * params.resolved_length_weight()),
        ..params.clone()
    }
}

fn assert_close(a: &[f64], b: &[f64], relative: f64) {
    let size = a.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let apart = a.iter().zip(b).map(|(x, y)| (x - y).abs());
    let most = apart.fold(0.0, f64::max);
    assert!(size > 0.0 && most <= relative * size, "{most} of {size}");
}

#[test]
fn a_component_that_exists_twice_has_twice_the_weight() {
    let params = AverageParams {
        weights: Some(vec![0.2, 0.3, 0.5]),
        ..AverageParams::default()
    };
    let grid = Grid::<2>::dyadic(5);
    assert_doubled(
        &[0.0, 0.3, 0.8].map(|turn| ellipsoid(grid, [0.3, 0.2], turn)),
        &params,
    );
    let grid = Grid::<3>::dyadic(4);
    let turns = [0.0, 0.3, 0.8];
    assert_doubled(
        &turns.map(|turn| ellipsoid(grid, [0.3, 0.2, 0.25], turn)),
        &params,
    );
}

/// Compares the results of shapes that exist twice, and of the same shapes with twice the weights.
fn check_twice(shapes: &[ScalarField<f64, 2>], params: &AverageParams) -> AverageResult<2> {
    let doubled = twice_the_weight(params);
    let plain = Shapes::new(shapes);
    let one = average_of_components(plain, &[], &[], &doubled, &mut Silent).unwrap();
    let two = Pairs::twice(shapes).average(params);
    // The minimiser carries rounding on. Energies count as resolved to 5e-4 of the whole, and where an estimate is at
    // its limit, a hundredth of that, one of both ends a round earlier; estimates are right to a factor.
    let resolved = 2.0 * 0.01 * 5e-4 * two.energy.total;
    assert!((one.energy.total - two.energy.total).abs() < resolved);
    // That of a part of the energy is larger: the parts make up for each other (3.5 % at most here).
    let [first, second] = [&one, &two].map(|result| result.energy.parts[0]);
    let apart = (first - second).abs();
    assert!(apart < 0.05 * second + resolved, "{first} {second}");
    for (component, terms) in two.components.iter().zip(&two.energy.components) {
        assert_close(&component.dice, &one.dice, 0.01);
        assert_close(&terms.mismatch, &one.energy.mismatch, 1e-3);
    }
    assert_eq!(
        [one.rounds.len(), one.components.len()],
        [two.rounds.len(), 0]
    );
    two
}

#[test]
fn medians_and_shapes_of_weight_zero_have_components() {
    let grid = Grid::<2>::dyadic(5);
    let shapes = [0.0, 0.3, 0.8].map(|turn| ellipsoid(grid, [0.3, 0.2], turn));
    let median = AverageParams {
        mean: Mean::Median,
        ..AverageParams::default()
    };
    assert!(!check_twice(&shapes, &median).rounds.is_empty());
    let weighted = AverageParams {
        weights: Some(vec![0.5, 0.0, 0.5]),
        ..AverageParams::default()
    };
    // The shape of weight zero has been deformed onto the average of the others.
    let two = check_twice(&shapes, &weighted);
    assert!(
        two.components[1].dice[1] > 0.95,
        "{:?}",
        two.components[1].dice
    );
}

/// The components are summed in their order: rounding alone tells it.
#[test]
fn the_order_of_components_does_not_matter() {
    let pairs = bars(Grid::<2>::dyadic(5));
    let params = AverageParams::default();
    let (one, other) = (pairs.average(&params), pairs.permuted().average(&params));
    let [first, second] = [&one, &other].map(|result| &result.levels[0].energies);
    for (a, b) in first.iter().zip(second) {
        assert!((a - b).abs() <= 1e-9 * a, "{a} {b}");
    }
    // The minimiser carries rounding on, far below its own tolerance.
    let [a, b] = [&one, &other].map(|result| result.energy.total);
    assert!((a - b).abs() <= 1e-6 * a, "{a} {b}");
    for c in 0..2 {
        let [a, b] = [&one.components[c], &other.components[1 - c]];
        let (a, b) = (volume(&a.average_indicator), volume(&b.average_indicator));
        assert!((a - b).abs() <= 1e-3 * a, "{a} {b}");
    }
}

/// As one shape each the bars are equal and nothing deforms them. Their components meet in the middle
/// between where they did, which stretches one and compresses the other.
#[test]
fn components_move_within_a_shape_that_does_not() {
    let grid = Grid::<2>::dyadic(6);
    let pairs = bars(grid);
    let params = AverageParams {
        tolerance: 1e-3,
        ..AverageParams::default()
    };
    let plain = run(&pairs.whole, &params);
    let result = pairs.average(&params);
    assert!(
        plain.energy.parts[0] < 1e-3 * result.energy.parts[0],
        "{:?}",
        plain.energy.parts
    );
    assert!(result.status.converged());
    let all = result
        .dice
        .iter()
        .chain(result.components.iter().flat_map(|c| &c.dice));
    assert!(
        all.clone().all(|dice| *dice > 0.96),
        "{:?}",
        all.collect::<Vec<_>>()
    );
    // Their ends lie at 0.2 and 0.8. Nothing holds the average in place: its lengths count.
    let length = |c: usize| volume(&result.components[c].average_indicator) / 0.26;
    let (left, right) = (length(0), length(1));
    let cell = grid.spacing();
    // Corners are rounded, and where the components meet there are ramps.
    assert!((left + right - 0.6).abs() < 2.0 * cell, "{left} {right}");
    assert!((right - left - 0.05).abs() < cell, "{left} {right}");
    // The phase field of the whole is small on all boundaries.
    let [first, second] = [0, 1].map(|c: usize| result.components[c].average.as_slice());
    let both = first.iter().zip(second).map(|(a, b)| a.min(*b));
    assert!(both.eq(result.average.as_slice().iter().copied()));
    // The components overlap by no more than the ramps of their indicators, a cell.
    let both = result.components[0].average_mask.as_slice().iter();
    let both = both.zip(result.components[1].average_mask.as_slice());
    assert_eq!(both.filter(|(a, b)| **a > 0.5 && **b > 0.5).count(), 0);
}

/// Components that lie far from each other are averaged as if each were alone. They are coupled by the
/// void, of a ten-thousandth of the stiffness, and by the tails of the phase fields, `exp(-4)` where
/// they meet: the volumes agree to a fortieth of those changes of volume, and the energies to 5 %.
#[test]
fn far_components_are_averaged_on_their_own() {
    let grid = Grid::<2>::dyadic(6);
    let params = AverageParams {
        tolerance: 1e-4,
        ..AverageParams::default()
    };
    let radii = [[0.09, 0.13], [0.13, 0.11]];
    let pairs = Pairs::of(grid, radii.map(|radii| balls(radii, 0.5)));
    let both = pairs.average(&params);
    let mut elastic = 0.0;
    for c in 0..2 {
        let centre = [0.25 + 0.5 * c as f64, 0.5];
        let alone = radii.map(|radii| ball(grid, centre, radii[c]));
        let alone = run(&alone, &params);
        elastic += alone.energy.parts[0];
        let found = volume(&both.components[c].average_indicator);
        let expected = volume(&alone.average_indicator);
        let change = std::f64::consts::PI * (radii[1][c].powi(2) - radii[0][c].powi(2)).abs();
        assert!(
            (found - expected).abs() < 0.025 * change,
            "{found} {expected} {change}"
        );
    }
    let found = both.energy.parts[0];
    assert!((found / elastic - 1.0).abs() < 0.05, "{found} {elastic}");
}

/// Two bodies draw nearer: as in the notes, a change of their relative position contributes, and the
/// average has the mean of it.
#[test]
fn bodies_that_draw_nearer_meet_half_way() {
    let grid = Grid::<3>::dyadic(4);
    let params = AverageParams::default();
    let pairs = Pairs::of(grid, [0.44, 0.56].map(|apart| balls([0.17, 0.15], apart)));
    let result = pairs.average(&params);
    let [left, right] = [0, 1].map(|c| {
        let moments = Moments::of_density(&result.components[c].average_indicator);
        moments.unwrap().centroid
    });
    let apart = right[0] - left[0];
    // A fifth of the cell; the distances of the inputs differ by two cells.
    assert!((apart - 0.5).abs() < 0.2 * grid.spacing(), "{apart}");
    let dice = result.components.iter().flat_map(|c| &c.dice);
    // Balls of two to three cells' radius.
    assert!(
        dice.clone().all(|d| *d > 0.8),
        "{:?}",
        dice.collect::<Vec<_>>()
    );
}

#[test]
fn a_shape_is_matched_component_by_component() {
    let pairs = bars(Grid::<2>::dyadic(5));
    let params = AverageParams {
        tolerance: 2e-4,
        ..AverageParams::default()
    };
    let result = pairs.average(&params);
    let distance = |indicator| signed_distance(indicator, 0.5).unwrap();
    let whole = [distance(&result.average_indicator)];
    let parts = [0, 1].map(|c: usize| distance(&result.components[c].average_indicator));
    let target = Shapes::of_components(&whole, &parts, 2).unwrap();
    let fields = [0, 1].map(|c: usize| result.components[c].average.clone());
    for i in 0..2 {
        let own = (&pairs.whole[i..=i], &pairs.parts[2 * i..2 * i + 2]);
        let shape = Shapes::of_components(own.0, own.1, 2).unwrap();
        let found = match_components_to(shape, target, &fields, &params, &mut Silent).unwrap();
        assert!(found.certificate.certified);
        assert!(
            found
                .components
                .iter()
                .zip(&fields)
                .all(|(c, v)| c.average == *v)
        );
        // Both are minimisers of the same terms, each to its own tolerance.
        let (one, other) = (found.energy.elastic[0], result.energy.elastic[i]);
        assert!((one / other - 1.0).abs() < 0.03, "{one} {other}");
    }
    let alone = Shapes::new(&pairs.whole[..1]);
    let refused = match_components_to(alone, target, &fields, &params, &mut Silent);
    assert!(
        matches!(refused, Err(AverageError::Components { .. })),
        "{refused:?}"
    );
    let refused = match_components_to(target, target, &fields[..1], &params, &mut Silent);
    assert!(
        matches!(refused, Err(AverageError::Components { .. })),
        "{refused:?}"
    );
}

/// What is hidden of one shape has no influence on any component.
#[test]
fn hidden_components_are_those_of_the_other_shape() {
    let grid = Grid::<2>::dyadic(5);
    let params = AverageParams::default();
    let pairs = Pairs::of(
        grid,
        [[0.14, 0.1], [0.14, 0.16]].map(|radii| balls(radii, 0.5)),
    );
    // The right ball of the first shape is hidden.
    let left = ScalarField::from_fn(grid, |x| [((0.6 - x[0]) / 0.06).clamp(0.0, 1.0)]);
    let seen = [left, ScalarField::from_fn(grid, |_| [1.0])];
    let shapes = pairs.shapes();
    let known = average_of_components(shapes, &seen, &[], &params, &mut Silent).unwrap();
    let blind = pairs.average(&params);
    let [known, blind] = [&known, &blind].map(|r| volume(&r.components[1].average_indicator));
    let visible = volume(&{
        let mut inside = pairs.parts[3].clone();
        for d in inside.as_mut_slice() {
            *d = (0.5 + *d / grid.spacing()).clamp(0.0, 1.0);
        }
        inside
    });
    // Without the mask the average is a quarter smaller.
    assert!(
        blind < 0.8 * visible && (known / visible - 1.0).abs() < 0.05,
        "{known} {blind}"
    );
}

#[test]
fn components_have_the_same_bits_on_any_number_of_processes() {
    let grid = Grid::<2>::dyadic(5);
    let pairs = Pairs::of(grid, [0.4, 0.45, 0.55].map(bar));
    let params = AverageParams::default();
    let on = |processes: usize| {
        let results = on_threads(processes, &|communicator| {
            average_distributed(communicator, pairs.shapes(), &[], &[], &params, &mut Silent)
        });
        results.into_iter().next().unwrap().unwrap().unwrap()
    };
    let alone = on(1);
    for processes in [2, 3, 5] {
        let found = on(processes);
        assert!(found.displacements == alone.displacements, "{processes}");
        assert_eq!(found.energy, alone.energy, "{processes}");
        assert!(found.shapes.phase_fields == alone.shapes.phase_fields);
        for (a, b) in found.components.iter().zip(&alone.components) {
            assert!(a.average == b.average && a.average_indicator == b.average_indicator);
            assert!(a.pushed == b.pushed && a.dice == b.dice);
        }
    }
}

#[test]
fn doubts_name_the_component() {
    let params = AverageParams::default();
    let mut result = bars(Grid::<2>::dyadic(5)).average(&params);
    let about = |result: &AverageResult<2>| -> Vec<(Option<usize>, Option<usize>)> {
        let doubts = result.doubts(&params).into_iter();
        let overlap = doubts.filter(|doubt| doubt.cause == Cause::Overlap);
        overlap
            .map(|doubt| (doubt.shape, doubt.component))
            .collect()
    };
    assert_eq!(about(&result), []);
    result.components[1].dice[0] = 0.8;
    result.components[1].hausdorff[0] = None;
    assert_eq!(about(&result), [(Some(0), Some(1))]);
}

#[test]
fn components_that_do_not_fit_are_refused() {
    let grid = Grid::<2>::dyadic(4);
    let pairs = bars(grid);
    let params = AverageParams::default();
    for (parts, n) in [
        (&pairs.parts[..3], 2),
        (&pairs.parts[..], 0),
        (&pairs.parts[..], 3),
    ] {
        let found = Shapes::of_components(&pairs.whole, parts, n).map(|shapes| shapes.len());
        let expected = AverageError::Components {
            shapes: 2,
            components: n,
            found: parts.len(),
        };
        assert_eq!(found, Err(expected));
    }
    let refused = |place: usize, field: ScalarField<f64, 2>| {
        let mut pairs = pairs.clone();
        pairs.parts[place] = field;
        average_of_components(pairs.shapes(), &[], &[], &params, &mut Silent).map(|r| r.dice)
    };
    let empty = ScalarField::from_fn(grid, |_| [-1.0]);
    let what = "empty";
    assert_eq!(
        refused(3, empty),
        Err(AverageError::Degenerate { index: 1, what })
    );
    let other = ball(Grid::<2>::dyadic(5), [0.5; 2], 0.3);
    assert_eq!(
        refused(1, other),
        Err(AverageError::GridsDiffer { index: 0 })
    );
}
