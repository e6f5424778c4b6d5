//! Which of several good motions each shape of a group takes.

use fe_grid::{Grid, parallel};
use levelset::{Compact, LevelsetError};

use super::indicator::{Indicator, Masked};
use super::{AlignError, NOISE, at};
use levelset::RigidMotion;

/// Most rounds through all shapes; the second seldom changes anything.
const ROUNDS: usize = 8;

/// The weighted indicators of a number of shapes, summed: enough for the sum of their squared differences from
/// one more.
struct Sums {
    /// `sum w`, `sum w f` and `sum w f^2` at every value.
    values: Vec<[f64; 3]>,
}

impl Sums {
    fn add<const D: usize>(&mut self, sign: f64, shape: &Indicator<D>) {
        let shape = shape.values().zip(shape.weights());
        for (sums, (value, weight)) in self.values.iter_mut().zip(shape) {
            let weight = sign * weight;
            sums[0] += weight;
            sums[1] += weight * value;
            sums[2] += weight * value * value;
        }
    }

    /// The sum of the squared differences from all, where both are visible, and a scale of it.
    fn difference<const D: usize>(&self, shape: &Indicator<D>) -> [f64; 2] {
        let mut found = [0.0; 2];
        let shape = shape.values().zip(shape.weights());
        for ([w, first, second], (value, weight)) in self.values.iter().zip(shape) {
            found[0] += weight * (w * value * value - 2.0 * first * value + second);
            found[1] += weight * (w * value * value + second);
        }
        found
    }
}

/// Chooses one of the motions of every shape: in turn, the one by which it differs least from all others.
/// Each begins with its first motion, and leaves a motion for one that is better by more than the noise.
pub(super) fn choose<const D: usize>(
    shapes: &[Masked<'_, D>],
    motions: &[Vec<RigidMotion<D>>],
    nodes: Grid<D>,
    step: Compact,
) -> Result<Vec<usize>, AlignError> {
    let mut chosen = vec![0; shapes.len()];
    if shapes.len() < 3 || motions.iter().all(|motions| motions.len() < 2) {
        return Ok(chosen);
    }
    let indicator = |i: usize, choice: usize| -> Result<Indicator<D>, AlignError> {
        let moved = [(&shapes[i], motions[i][choice])];
        let found: Result<_, LevelsetError> = Indicator::mean(&moved, nodes, step);
        found.map_err(|source| at(i, source))
    };
    let mut sums = Sums { values: Vec::new() };
    for i in 0..shapes.len() {
        let own = indicator(i, 0)?;
        sums.values.resize(own.values().count(), [0.0; 3]);
        sums.add(1.0, &own);
    }
    for _ in 0..ROUNDS {
        let mut changed = false;
        for i in (0..shapes.len()).filter(|i| motions[*i].len() > 1) {
            let all: Vec<usize> = (0..motions[i].len()).collect();
            let all = parallel::try_map(all, &|choice| indicator(i, choice))?;
            sums.add(-1.0, &all[chosen[i]]);
            let [mut least, scale] = sums.difference(&all[chosen[i]]);
            least -= NOISE * scale;
            for (choice, own) in all.iter().enumerate() {
                let [difference, _] = sums.difference(own);
                if difference < least {
                    (chosen[i], least, changed) = (choice, difference, true);
                }
            }
            sums.add(1.0, &all[chosen[i]]);
        }
        if !changed {
            break;
        }
    }
    Ok(chosen)
}
