//! Runs that are resumed from the memory of any of their minimisations.

use fe_grid::minimise::{Memory, Observer};
use fe_grid::{Grid, ScalarField};
use geodesic::{Form, Geodesic, GeodesicParams, Shape, geodesic_between};
use levelset::signed_distance;

/// Keeps what minimisers remember, and returns memories to the runs that they are from.
#[derive(Default)]
struct Tape {
    run: usize,
    kept: Vec<(usize, Memory<'static>)>,
    offered: Vec<(usize, Memory<'static>)>,
}

impl Tape {
    fn offering(memories: &[(usize, Memory<'static>)]) -> Self {
        Self {
            offered: memories.to_vec(),
            ..Self::default()
        }
    }
}

impl Observer for Tape {
    fn resume(&mut self) -> Option<Memory<'static>> {
        self.run += 1;
        let at = self.offered.iter().position(|(run, _)| *run == self.run)?;
        Some(self.offered.remove(at).1)
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.kept.push((self.run, memory.clone().into_owned()));
    }
}

/// A bone from one corner to the other, bent by `bend`.
fn bone<const D: usize>(levels: u32, bend: f64) -> Shape<D> {
    let implicit = ScalarField::from_fn(Grid::dyadic(levels), |x: [f64; D]| {
        let along = x[0] - 0.5;
        let away = x[1..].iter().map(|x| x - 0.5).enumerate().map(|(k, x)| {
            let axis = if k == 0 {
                bend * (16.0 * along * along - 0.6)
            } else {
                0.0
            };
            (x - axis).powi(2)
        });
        let across = away.sum::<f64>().sqrt();
        [0.13 + 0.4 * along * along - across.hypot(0.45 * along)]
    });
    Shape::new(signed_distance(&implicit, 0.0).unwrap())
}

/// Everything that is a result of a path; `levels` have no times.
fn assert_same<const D: usize>(one: &Geodesic<D>, other: &Geodesic<D>) {
    let json = |path| serde_json::to_value(path).unwrap();
    assert_eq!(json(one), json(other));
    assert!(one.level_sets == other.level_sets);
    assert!(one.displacements == other.displacements);
    assert!(one.motions == other.motions && one.backward_motions == other.backward_motions);
}

fn check<const D: usize>(ends: &[Shape<D>; 2], params: &GeodesicParams) -> usize {
    let path = |tape: &mut Tape| geodesic_between(&ends[0], &ends[1], params, tape).unwrap();
    let mut tape = Tape::default();
    let whole = path(&mut tape);
    let kept = tape.kept;
    let last = tape.run;
    assert!(
        last >= params.steps.ilog2() as usize && kept.len() > last,
        "{last}"
    );
    // Some of the last two runs: each costs a path.
    for memory in kept.iter().filter(|one| one.0 + 1 >= last).step_by(4) {
        let mut tape = Tape::offering(std::slice::from_ref(memory));
        assert_same(&path(&mut tape), &whole);
        assert!(tape.offered.is_empty());
    }
    // The newest of every run: almost nothing is repeated.
    let newest: Vec<_> = (1..=last)
        .filter_map(|run| kept.iter().rfind(|one| one.0 == run).cloned())
        .collect();
    let mut tape = Tape::offering(&newest);
    assert_same(&path(&mut tape), &whole);
    assert!(tape.offered.is_empty() && tape.kept.is_empty());
    last
}

#[test]
fn paths_of_a_domain_resume_to_the_same_bits() {
    let params = GeodesicParams {
        steps: 3,
        ..GeodesicParams::default()
    };
    check(&[bone::<2>(5, -0.05), bone(5, 0.1)], &params);
    check(&[bone::<3>(3, -0.05), bone(3, 0.1)], &params);
}

#[test]
fn paths_of_level_sets_resume_to_the_same_bits() {
    let params = GeodesicParams {
        form: Form::LevelSets,
        steps: 2,
        flow_nodes: 17,
        max_iterations: Some(30),
        ..GeodesicParams::default()
    };
    check(&[bone::<2>(5, -0.05), bone(5, 0.1)], &params);
}

/// Where a path does not arrive, the finest level is minimised again and again with other weights: each
/// of these runs has its own memory.
#[test]
fn rounds_resume_to_the_same_bits() {
    let disk = |radius: f64| {
        let field = ScalarField::<f64, 2>::from_fn(Grid::dyadic(4), |[x, y]| {
            [radius - (x - 0.5).hypot(y - 0.5)]
        });
        Shape::new(field)
    };
    let params = GeodesicParams {
        steps: 1,
        mismatch_weight: 1.0,
        ..GeodesicParams::default()
    };
    let ends = [disk(0.12), disk(0.3)];
    let whole = geodesic_between(&ends[0], &ends[1], &params, &mut Tape::default()).unwrap();
    let finest = whole.levels.iter().filter(|level| level.nodes == [17, 17]);
    assert!(finest.count() > 1);
    check(&ends, &params);
}
