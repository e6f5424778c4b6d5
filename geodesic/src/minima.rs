//! Several minimal paths between two shapes: from different starts, told apart, with their lengths.
//!
//! The energy of a path is not convex. A minimiser finds the path in whose valley it begins: another one that
//! carries other parts of the start shape onto those of the end shape, and may be shorter, shows only from
//! other starts ([`geodesic_from`](crate::geodesic_from)). [`PathMinima`] collects where they end.

use crate::result::Geodesic;
use crate::stable::StablePath;
use fe_grid::minimise::{Curvature, Status};
use fe_grid::{Field, ScalarField};
use levelset::{Cause, Doubt};
use serde::Serialize;

/// Paths closer than this, see [`PathMinimum::distance`], are one. Minimisers end up to .06 apart in the same
/// valley, and where one finger of a hand takes the place of the next it is more.
const SAME_PATH: f64 = 0.1;
/// Of paths that are one the first is kept, unless another one is shorter by more than this share: the
/// minimiser's own limit of the remaining energy.
const RESOLVED: f64 = 0.01;

/// Lengths are compared with this where the path that is kept has none: equal shapes.
const LEAST_LENGTH: f64 = 1e-12;

/// A minimal path that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathMinimum {
    /// `sum sqrt W_k`.
    pub length: f64,
    /// `K sum W_k`.
    pub dissipation: f64,
    /// The functional, with the weight of the mismatch of the last minimisation.
    pub energy: f64,
    /// Dice overlap of the end shape with the deformed start shape.
    pub dice_end: f64,
    /// Whether the path arrives at the end shape ([`Geodesic::end_reached`]).
    pub end_reached: bool,
    /// The length above that of the path which is kept, relative to that one.
    pub excess: f64,
    /// Distance from the path which is kept: of the positions at the end of the path to which the points of
    /// the start shape are carried, root mean square, relative to the size of the end shape, which is their
    /// root mean square distance from its centre. Large where other parts correspond to each other. The
    /// positions in between are not compared: a rigid motion of a shape within the path costs nothing.
    pub distance: f64,
    /// The least eigenvalue of the Hessian of the energy, for the mass of the shape in the domain of the path,
    /// over all directions but rigid motions of the shapes between the ends. `None` where it could not be
    /// computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_eigenvalue: Option<Curvature>,
    /// Saddle points that the minimisation has left on its way here ([`stable_path`](crate::stable_path())).
    pub saddles: usize,
    /// Starts that ended here, from 1.
    pub starts: Vec<usize>,
    /// How the minimiser ended.
    pub status: Status,
}

/// What is kept of a path.
struct Kept<const D: usize> {
    minimum: PathMinimum,
    /// The displacement that carries the start shape to the end of the path.
    last: Field<f64, D, D>,
}

/// The minimal paths between two shapes found so far.
#[derive(Default)]
pub struct PathMinima<const D: usize> {
    kept: Vec<Kept<D>>,
    /// The best path, and its place in the list.
    best: Option<(usize, Geodesic<D>)>,
    starts: usize,
}

impl<const D: usize> PathMinima<D> {
    /// Creates an empty collection.
    pub fn new() -> Self {
        Self {
            kept: Vec::new(),
            best: None,
            starts: 0,
        }
    }

    /// Adds the path from the next start. One that is known is counted there; the first of these is kept, unless
    /// a later one arrives and it does not, or is shorter by more than a hundredth. Cancelled paths are no
    /// minima, and kept only where there is no other; nor are paths of level sets, whose points have no
    /// positions at the end. Returns whether the path is the best now: those that arrive come first, then the
    /// shortest; of paths whose lengths differ by less than a hundredth the first.
    pub fn add(&mut self, found: StablePath<D>) -> bool {
        let StablePath {
            path,
            curvature,
            saddles,
        } = found;
        self.starts += 1;
        let last = match path.motions.last() {
            Some(last) if path.status != Status::Cancelled => last.clone(),
            _ => {
                let first = self.best.is_none();
                if first {
                    self.best = Some((usize::MAX, path));
                }
                return first;
            }
        };
        let start = &path.level_sets[0];
        let known = self
            .kept
            .iter()
            .position(|kept| distance(start, &last, &kept.last) <= SAME_PATH);
        let mut starts = vec![self.starts];
        if let Some(place) = known {
            let minimum = &mut self.kept[place].minimum;
            minimum.starts.push(self.starts);
            starts.clone_from(&minimum.starts);
            if !precedes(rank(&path), (minimum.end_reached, minimum.length)) {
                return false;
            }
        }
        let new = Kept {
            minimum: PathMinimum {
                length: path.length(),
                dissipation: path.dissipation(),
                energy: path.energy.total,
                dice_end: path.dice_end,
                end_reached: path.end_reached(),
                excess: 0.0,
                distance: 0.0,
                least_eigenvalue: curvature,
                saddles,
                starts,
                status: path.status,
            },
            last,
        };
        let place = known.unwrap_or(self.kept.len());
        if known.is_some() {
            self.kept[place] = new;
        } else {
            self.kept.push(new);
        }
        let best = self.best.as_ref();
        let better = best.is_none_or(|(_, best)| precedes(rank(&path), rank(best)));
        if better {
            self.best = Some((place, path));
        }
        better
    }

    /// The best path and all minima, its own first and then by their lengths, those that arrive before the
    /// others, with their distances from it. `None` if nothing was added.
    pub fn finish(self) -> Option<(Geodesic<D>, Vec<PathMinimum>)> {
        let (place, best) = self.best?;
        let last = self.kept.get(place).map(|kept| kept.last.clone());
        let (mut first, mut others) = (Vec::new(), Vec::new());
        for (i, kept) in self.kept.into_iter().enumerate() {
            let mut minimum = kept.minimum;
            if i == place {
                first.push(minimum);
                continue;
            }
            if let Some(last) = &last {
                let length = best.length();
                minimum.excess = (minimum.length - length) / length.max(LEAST_LENGTH);
                minimum.distance = distance(&best.level_sets[0], &kept.last, last);
            }
            others.push(minimum);
        }
        others.sort_by(|a, b| {
            let arrival = b.end_reached.cmp(&a.end_reached);
            arrival.then(a.length.total_cmp(&b.length))
        });
        first.append(&mut others);
        Some((best, first))
    }
}

/// The doubts about a list of minimal paths, the best first: another one that arrives and is almost as short,
/// and a best one that is a saddle point.
pub fn doubts_of_minima(minima: &[PathMinimum]) -> Vec<Doubt> {
    let others = minima.iter().skip(1).filter(|m| m.end_reached);
    let nearest = others.map(|m| m.excess).min_by(f64::total_cmp);
    let ambiguous = nearest.and_then(|excess| Doubt::check(Cause::AmbiguousPath, excess));
    let best = minima
        .first()
        .and_then(|best| best.least_eigenvalue.as_ref());
    let saddle = best.and_then(Doubt::saddle);
    ambiguous.into_iter().chain(saddle).collect()
}

/// What paths are chosen by: whether they arrive, and their length.
fn rank<const D: usize>(path: &Geodesic<D>) -> (bool, f64) {
    (path.end_reached(), path.length())
}

/// Whether a path is better than another one by more than what the minimiser leaves.
fn precedes(path: (bool, f64), other: (bool, f64)) -> bool {
    match path.0.cmp(&other.0) {
        std::cmp::Ordering::Equal => path.1 < (1.0 - RESOLVED) * other.1,
        order => order.is_gt(),
    }
}

/// The distance of two deformations of a shape, as [`PathMinimum::distance`].
fn distance<const D: usize>(
    start: &ScalarField<f64, D>,
    a: &Field<f64, D, D>,
    b: &Field<f64, D, D>,
) -> f64 {
    let grid = *start.grid();
    let inside: Vec<usize> = (0..grid.n_nodes())
        .filter(|&node| start.as_slice()[node] > 0.0)
        .collect();
    let mut centre = [0.0; D];
    for &node in &inside {
        let own = b.deformed(node);
        for k in 0..D {
            centre[k] += own[k] / inside.len() as f64;
        }
    }
    let (mut apart, mut size) = (0.0, 0.0);
    for &node in &inside {
        let (a, b) = (a.deformed(node), b.deformed(node));
        for k in 0..D {
            apart += (a[k] - b[k]).powi(2);
            size += (b[k] - centre[k]).powi(2);
        }
    }
    (apart / size.max(f64::MIN_POSITIVE)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fe_grid::Grid;

    /// A disk that is turned about its centre by an angle: chords of length `2 sin(angle / 2)` radii.
    #[test]
    fn turned_shapes_are_apart_by_their_chords() {
        let grid = Grid::<2>::cube(33);
        let middle = |x: [f64; 2]| [x[0] - 0.5, x[1] - 0.5];
        let start = ScalarField::from_fn(grid, |x| {
            let [x, y] = middle(x);
            [0.3 - x.hypot(y)]
        });
        let turned = |angle: f64| {
            Field::<f64, 2, 2>::from_fn(grid, |x| {
                let [x, y] = middle(x);
                let (sin, cos) = angle.sin_cos();
                [cos * x - sin * y - x, sin * x + cos * y - y]
            })
        };
        for angle in [0.2, 1.0, 3.0] {
            let found = distance(&start, &turned(angle), &turned(0.0));
            // Every point is moved by that chord of its own circle.
            assert!((found - 2.0 * (0.5 * angle).sin()).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn arrival_comes_before_length() {
        assert!(precedes((true, 2.0), (false, 1.0)));
        assert!(!precedes((false, 1.0), (true, 2.0)));
        assert!(precedes((true, 0.98), (true, 1.0)));
        assert!(!precedes((true, 0.995), (true, 1.0)));
    }
}
