//! Where points go: deformations, one after the other, between the coordinates of two files.

use std::sync::Arc;

use fe_grid::Field;

use super::fields::inverted;
use crate::error::CliError;
use crate::memory::announce;
use crate::progress::Progress;
use crate::shapes::Coordinates;

/// Steps that refine the inverse at a point between nodes.
const STEPS: usize = 8;

/// A deformation of the box by a displacement, or the inverse of one.
#[derive(Clone)]
pub(super) struct Leg<const D: usize> {
    displacement: Arc<Field<f64, D, D>>,
    /// For the inverse, a first guess of its displacement.
    guess: Option<Arc<Field<f64, D, D>>>,
}

/// Where a point goes, and how far, in the box, the image of what is found by an inverse is from the point:
/// deformations that fold in the void have none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub position: [f64; 3],
    pub defect: f64,
    /// How far from the box it was on the way. Beyond the box a displacement is that of the nearest point of its
    /// faces.
    pub outside: f64,
}

/// From the coordinates of one file to those of another, by way of the box.
#[derive(Clone)]
pub(super) struct Route<const D: usize> {
    pub from: Coordinates<D>,
    pub to: Coordinates<D>,
    pub legs: Vec<Leg<D>>,
}

/// A route of either dimension.
pub(crate) struct WorldMap(Box<dyn Fn([f64; 3]) -> Found + Send + Sync>);

impl<const D: usize> Leg<D> {
    /// The deformation by a displacement.
    pub fn by(displacement: Field<f64, D, D>) -> Self {
        Self {
            displacement: Arc::new(displacement),
            guess: None,
        }
    }

    /// The way back.
    pub fn reversed(&self) -> Self {
        let guess = match self.guess {
            Some(_) => None,
            None => Some(Arc::new(inverted(&self.displacement))),
        };
        Self {
            displacement: Arc::clone(&self.displacement),
            guess,
        }
    }

    /// How far a point lies outside of the box.
    fn distance_from_box(&self, unit: [f64; D]) -> f64 {
        let ends = self.displacement.grid().extent();
        let beyond = (0..D).map(|k| (unit[k] - unit[k].clamp(0.0, ends[k])).powi(2));
        beyond.sum::<f64>().sqrt()
    }

    /// Where a point of the box goes, and the defect.
    fn point(&self, unit: [f64; D]) -> ([f64; D], f64) {
        let Some(guess) = &self.guess else {
            return (self.displacement.image(unit), 0.0);
        };
        let residual = |x: [f64; D]| {
            let y = self.displacement.image(x);
            let r: [f64; D] = std::array::from_fn(|k| y[k] - unit[k]);
            (r.iter().map(|r| r * r).sum::<f64>(), r)
        };
        let mut image = guess.image(unit);
        let mut best = residual(image);
        for _ in 0..STEPS {
            let next = std::array::from_fn(|k| image[k] - best.1[k]);
            let found = residual(next);
            if found.0 >= best.0 {
                break;
            }
            (image, best) = (next, found);
        }
        (image, best.0.sqrt())
    }
}

impl<const D: usize> Route<D> {
    /// The way back.
    pub fn reversed(&self) -> Self {
        Self {
            from: self.to,
            to: self.from,
            legs: self.legs.iter().rev().map(Leg::reversed).collect(),
        }
    }

    /// Says how much memory it needs, the way back, and other data of so many bytes.
    ///
    /// # Errors
    /// [`CliError::TooLarge`] if less is free.
    pub fn announce(&self, others: u64, progress: &Progress) -> Result<(), CliError> {
        let Some(first) = self.legs.first() else {
            return Ok(());
        };
        let grid = first.displacement.grid();
        // Of every deformation, or of its inverse, a first guess is computed.
        let fields = 2 * D * self.legs.len() * grid.n_nodes();
        let needed = others.saturating_add((size_of::<f64>() * fields) as u64);
        announce(needed, grid, progress)
    }

    fn point(&self, position: [f64; 3]) -> Found {
        let mut unit = self.from.unit(position);
        let (mut defect, mut outside) = (0.0, 0.0);
        for leg in &self.legs {
            outside = f64::max(outside, leg.distance_from_box(unit));
            let (image, own) = leg.point(unit);
            unit = image;
            defect = f64::max(defect, own);
        }
        Found {
            position: self.to.position(unit),
            defect,
            outside,
        }
    }

    /// The same without its dimension.
    pub fn map(self) -> WorldMap {
        WorldMap(Box::new(move |position| self.point(position)))
    }
}

impl WorldMap {
    /// Where a point goes.
    pub fn point(&self, position: [f64; 3]) -> Found {
        (self.0)(position)
    }
}

/// The deformations of a path of these steps from one time to another, of which 0 is that of the first
/// shape and 1 that of the last. Within a step points move along straight lines at constant speed.
pub(super) fn along<const D: usize>(steps: &[Field<f64, D, D>], from: f64, to: f64) -> Vec<Leg<D>> {
    if from > to {
        let forwards = along(steps, to, from);
        return forwards.iter().rev().map(Leg::reversed).collect();
    }
    let n = steps.len() as f64;
    let mut legs = Vec::new();
    for (k, step) in steps.iter().enumerate() {
        let [start, end] = [from, to].map(|t| (t * n - k as f64).clamp(0.0, 1.0));
        if start >= end {
            continue;
        }
        if start > 0.0 {
            legs.push(part(step, start).reversed());
        }
        legs.push(part(step, end));
    }
    legs
}

/// A part of a step.
fn part<const D: usize>(step: &Field<f64, D, D>, share: f64) -> Leg<D> {
    let mut displacement = step.clone();
    if share < 1.0 {
        fe_grid::vector::scale(share, displacement.as_mut_slice());
    }
    Leg::by(displacement)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Grid;

    /// Two steps, of which the second bends.
    fn steps() -> Vec<Field<f64, 2, 2>> {
        let grid = Grid::cube(33);
        let bent = |[x, y]: [f64; 2]| [0.1 * (3.0 * y).sin(), 0.05 * (4.0 * x).cos() * y];
        vec![
            Field::from_fn(grid, |_| [0.05, -0.02]),
            Field::from_fn(grid, bent),
        ]
    }

    fn end(legs: &[Leg<2>], start: [f64; 2]) -> [f64; 2] {
        legs.iter().fold(start, |p, leg| leg.point(p).0)
    }

    #[test]
    fn times_of_a_path_follow_each_other() {
        let steps = steps();
        let start = [0.4, 0.55];
        // A quarter of the path is half of the first step.
        let quarter = end(&along(&steps, 0.0, 0.25), start);
        assert!((quarter[0] - 0.425).abs() < 1e-12 && (quarter[1] - 0.54).abs() < 1e-12);
        for (from, between, to) in [
            (0.0, 0.3, 0.9),
            (0.2, 0.5, 1.0),
            (1.0, 0.6, 0.1),
            (0.7, 0.0, 0.8),
        ] {
            let at_once = end(&along(&steps, from, to), start);
            let first = end(&along(&steps, from, between), start);
            let then = end(&along(&steps, between, to), first);
            for k in 0..2 {
                assert!((at_once[k] - then[k]).abs() < 1e-6, "{from} {between} {to}");
            }
        }
        assert!(along(&steps, 0.3, 0.3).is_empty());
    }

    /// Where a deformation folds, its inverse is sought in vain, and the defect says by how much.
    #[test]
    fn the_defect_is_the_distance_of_the_image() {
        let folded = Leg::by(Field::from_fn(Grid::<2>::cube(33), |[x, _]| {
            [0.3 * (20.0 * x).sin(), 0.0]
        }));
        let back = folded.reversed();
        let mut most = 0.0f64;
        for k in 0..100 {
            let point = [0.01 * f64::from(k), 0.5];
            let (image, defect) = back.point(point);
            let there = folded.point(image).0;
            assert!(((there[0] - point[0]).hypot(there[1] - point[1]) - defect).abs() < 1e-12);
            most = most.max(defect);
        }
        assert!(most > 1e-3, "{most}");
        // Beyond the box a displacement is that of the nearest point of its faces.
        let squeezed = Leg::by(Field::from_fn(Grid::<2>::cube(17), |[x, _]| {
            [0.4 * (1.0 - x), 0.0]
        }));
        let (image, defect) = squeezed.reversed().point([0.7, 0.5]);
        assert!((image[0] - 0.5).abs() < 1e-9 && defect < 1e-9);
        let (image, defect) = squeezed.reversed().point([0.1, 0.5]);
        assert!((image[0] + 0.3).abs() < 1e-9 && defect < 1e-9);
    }
}
