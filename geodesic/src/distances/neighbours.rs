//! Nearest neighbours of an object, and the class that most of them have.

use serde::Serialize;

/// A neighbour of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Neighbour {
    /// Number of the neighbour.
    pub object: usize,
    /// Its distance.
    pub distance: f64,
}

/// Returns the nearest of these objects, at most `count`, nearest first; of equally near ones that of
/// the smaller number comes first. Objects without a distance are left out.
///
/// ```
/// use geodesic::distances::nearest;
/// let row = [(0, Some(2.0)), (1, None), (2, Some(1.0)), (3, Some(3.0))];
/// let found: Vec<usize> = nearest(row, 2).iter().map(|n| n.object).collect();
/// assert_eq!(found, [2, 0]);
/// ```
pub fn nearest(
    distances: impl IntoIterator<Item = (usize, Option<f64>)>,
    count: usize,
) -> Vec<Neighbour> {
    let known = distances.into_iter().filter_map(|(object, distance)| {
        let distance = distance?;
        Some(Neighbour { object, distance })
    });
    let mut all: Vec<Neighbour> = known.collect();
    all.sort_by(|a, b| {
        let order = a.distance.total_cmp(&b.distance);
        order.then(a.object.cmp(&b.object))
    });
    all.truncate(count);
    all
}

/// Returns the class that most of these neighbours have, which are sorted by distance; of several
/// equally frequent ones that of the nearest neighbour among them. `None` without neighbours.
///
/// This is the rule of the `k` nearest neighbours (Fix and Hodges 1951) with equal weights.
pub fn vote(neighbours: &[Neighbour], class: impl Fn(usize) -> usize) -> Option<usize> {
    let classes: Vec<usize> = neighbours.iter().map(|n| class(n.object)).collect();
    let votes = |of: usize| classes.iter().filter(|c| **c == of).count();
    let mut best: Option<(usize, usize)> = None;
    for &of in &classes {
        let found = votes(of);
        // A later class needs more votes, not as many.
        if best.is_none_or(|(most, _)| found > most) {
            best = Some((found, of));
        }
    }
    best.map(|(_, of)| of)
}
