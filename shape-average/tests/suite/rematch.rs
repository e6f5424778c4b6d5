//! Shapes that fit much worse than the others are deformed anew, by way of another one.

use crate::support::shapes::{bar, shape};
use fe_grid::communicator::on_threads;
use fe_grid::minimise::Silent;
use fe_grid::{Grid, ScalarField};
use shape_average::{AverageParams, AverageResult, Shapes, average, average_distributed};

/// A palm with four fingers, with these degrees between neighbouring ones.
fn hand(grid: Grid<2>, spread: f64) -> ScalarField<f64, 2> {
    const PALM: [f64; 2] = [0.5, 0.68];
    const RADIUS: f64 = 0.13;
    const LENGTH: f64 = 0.38;
    const THICKNESS: f64 = 0.025;
    shape(grid, |[x, y]| {
        let (x, y) = (x - PALM[0], PALM[1] - y);
        let finger = |i: i32| {
            let (sin, cos) = (spread * (f64::from(i) - 1.5)).to_radians().sin_cos();
            let along = (x * sin + y * cos).clamp(0.0, LENGTH);
            THICKNESS - (x - along * sin).hypot(y - along * cos)
        };
        let palm = RADIUS - x.hypot(y);
        (0..4).map(finger).fold(palm, f64::max)
    })
}

/// Hands of which the last has its fingers spread much more than the others.
fn hands(grid: Grid<2>) -> Vec<ScalarField<f64, 2>> {
    let spreads = [18.0, 20.0, 22.0, 24.0, 26.0, 28.0, 55.0];
    spreads.iter().map(|&s| hand(grid, s)).collect()
}

fn rematched(result: &AverageResult<2>) -> Vec<usize> {
    let all = result.levels.iter().flat_map(|level| &level.rematched);
    all.map(|rematch| rematch.shape).collect()
}

#[test]
fn spread_fingers_are_deformed_by_way_of_other_hands() {
    let shapes = hands(Grid::dyadic(6));
    let result = average(&shapes, &AverageParams::default(), &mut Silent).unwrap();
    assert_eq!(rematched(&result), [6]);
    let levels = &result.levels;
    let (last, before) = levels.split_last().unwrap();
    assert!(last.rematched.is_empty() && before.last().unwrap().rematched.len() == 1);
    for level in levels {
        assert!(level.energies.windows(2).all(|w| w[1] <= w[0]), "{level:?}");
        assert_eq!(level.energies.len(), level.iterations + 1);
        for rematch in &level.rematched {
            assert!(rematch.by_way_of < 6 && rematch.energies[1] < rematch.energies[0]);
        }
    }
    // Without the second deformation .83, see the next test.
    assert!(result.dice[6] > 0.93, "{:?}", result.dice);
}

#[test]
fn from_the_second_finest_grid_on_nothing_is_deformed_anew() {
    // The finest grid alone, from the deformations of the second finest before.
    let shapes = hands(Grid::dyadic(6));
    let params = AverageParams {
        coarsest_nodes: 65,
        ..AverageParams::default()
    };
    let result = average(&shapes, &params, &mut Silent).unwrap();
    assert!(rematched(&result).is_empty());
}

#[test]
fn shapes_of_one_kind_are_left_alone() {
    let grid = Grid::dyadic(6);
    let shapes: Vec<_> = [120.0, 135.0, 150.0, 165.0, 180.0]
        .iter()
        .map(|&angle| bar(grid, angle, 0.0))
        .collect();
    let result = average(&shapes, &AverageParams::default(), &mut Silent).unwrap();
    assert!(rematched(&result).is_empty());
}

#[test]
fn processes_deform_the_same_shapes_anew() {
    let shapes = hands(Grid::dyadic(6));
    let params = AverageParams::default();
    let run = |communicator| {
        average_distributed(
            communicator,
            Shapes::new(&shapes),
            &[],
            &[],
            &params,
            &mut Silent,
        )
        .unwrap()
    };
    let alone = on_threads(1, &run).into_iter().next().flatten().unwrap();
    let three = on_threads(3, &run).into_iter().next().flatten().unwrap();
    assert_eq!(rematched(&alone), rematched(&three));
    assert_eq!(alone.energy, three.energy);
    assert_eq!(alone.displacements, three.displacements);
}
