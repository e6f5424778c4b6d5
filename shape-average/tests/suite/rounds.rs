//! The rounds of the finest level, and runs that resume within them.

use crate::support::shapes::bar;
use fe_grid::Grid;
use fe_grid::minimise::{Memory, Observer};
use shape_average::{AverageParams, AverageResult, average};

/// Keeps what minimisers remember, and returns one memory to the run that it is from.
#[derive(Default)]
struct Tape {
    run: usize,
    kept: Vec<(usize, Memory<'static>)>,
    pending: Option<(usize, Memory<'static>)>,
}

impl Observer for Tape {
    fn resume(&mut self) -> Option<Memory<'static>> {
        self.run += 1;
        let (_, memory) = self.pending.take_if(|(run, _)| *run == self.run)?;
        Some(memory)
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        self.kept.push((self.run, memory.clone().into_owned()));
    }
}

/// The levels without their times.
fn levels(result: &AverageResult<2>) -> Vec<String> {
    let levels = result.levels.iter();
    let texts = levels.map(|level| {
        let mut level = serde_json::to_value(level).unwrap();
        level.as_object_mut().unwrap().remove("seconds");
        level.to_string()
    });
    texts.collect()
}

/// Wherever a run resumes, it ends with the bits and the record of one that was not interrupted.
#[test]
fn runs_resume_within_rounds() {
    let grid = Grid::<2>::dyadic(5);
    // Bars so different that the first round ends with more than 1 % of the elastic energy left.
    let shapes = [
        bar(grid, 180.0, 0.0),
        bar(grid, 60.0, 1.0),
        bar(grid, 140.0, -1.0),
    ];
    let params = AverageParams::default();
    let mut tape = Tape::default();
    let whole = average(&shapes, &params, &mut tape).unwrap();
    let last = tape.run;
    let of_finest: Vec<_> = tape.kept.into_iter().filter(|m| m.0 == last).collect();
    let starts = of_finest.iter().filter(|m| m.1.energies.len() == 1).count();
    // A round begins with the first memory of a minimiser.
    assert!(starts > 1, "{starts}");
    for memory in of_finest {
        let mut tape = Tape {
            pending: Some(memory),
            ..Tape::default()
        };
        let resumed = average(&shapes, &params, &mut tape).unwrap();
        assert!(tape.pending.is_none());
        assert!(resumed.average == whole.average);
        assert!(resumed.displacements == whole.displacements);
        assert_eq!(levels(&resumed), levels(&whole));
    }
}
