//! Segments of the plane in pieces that meet only at their ends.
//!
//! Segments are divided where they cross, and where the end of one lies on another one; pieces that lie on
//! each other then have the same ends. Ends that are nearer to each other than a tolerance become one, and an end
//! that is as near to a segment lies on it. As a division moves a segment by up to the tolerance, it is
//! repeated until nothing is left to divide.

use super::merge::merged;
use super::nearby::{Tree, around};

/// More repetitions than this are not needed: each divides what the last one has moved.
const MOST_ROUNDS: usize = 16;

/// What a point that divides segments costs: a limit of the memory that these need.
const DIVISION: usize = 128;

/// Pairs of segments that may still be compared.
pub(crate) struct Budget(pub usize);

impl Budget {
    /// Whether there were as many more.
    pub fn spend(&mut self, number: usize) -> bool {
        let enough = self.0 >= number;
        self.0 = self.0.saturating_sub(number);
        enough
    }
}

/// A part of a segment, from its first end to its second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub ends: [u32; 2],
    /// The number of the segment.
    pub source: u32,
}

/// Pieces that meet only at their ends, or are equal.
pub(crate) struct Arrangement {
    pub points: Vec<[f64; 2]>,
    pub pieces: Vec<Piece>,
    /// Whether segments cross.
    pub crosses: bool,
}

/// Where a piece is to be divided.
#[derive(Clone, Copy)]
struct Division {
    piece: u32,
    /// Which share of the piece lies before.
    share: f64,
    point: u32,
}

impl Arrangement {
    /// The pieces of segments; none where comparing them needs more than the budget.
    pub(crate) fn new(
        points: &[[f64; 2]],
        segments: &[[u32; 2]],
        tolerance: f64,
        budget: &mut Budget,
    ) -> Option<Self> {
        let numbered = (0..).zip(segments);
        let mut all = Self {
            points: points.to_vec(),
            pieces: numbered
                .map(|(source, &ends)| Piece { ends, source })
                .collect(),
            crosses: false,
        };
        for _ in 0..MOST_ROUNDS {
            all.merge(tolerance);
            let divisions = all.divisions(tolerance, budget)?;
            if divisions.is_empty() {
                return Some(all);
            }
            all.divide(divisions);
        }
        None
    }

    /// Makes one of ends that are one within the tolerance, and leaves out what is left without a length.
    fn merge(&mut self, tolerance: f64) {
        let (kept, numbers) = merged(&self.points, tolerance);
        self.points = kept;
        for piece in &mut self.pieces {
            piece.ends = piece.ends.map(|end| numbers[end as usize]);
        }
        self.pieces.retain(|piece| piece.ends[0] != piece.ends[1]);
    }

    fn corners(&self, piece: &Piece) -> [[f64; 2]; 2] {
        piece.ends.map(|end| self.points[end as usize])
    }

    fn divisions(&mut self, tolerance: f64, budget: &mut Budget) -> Option<Vec<Division>> {
        let boxes = self.pieces.iter();
        let tree = Tree::new(
            boxes
                .map(|piece| around(&self.corners(piece), tolerance))
                .collect(),
        );
        let mut found = Vec::new();
        for one in 0..self.pieces.len() {
            let mut others = Vec::new();
            let mut enough = true;
            tree.visit(tree.bounds(one), |other| {
                if other > one {
                    enough &= budget.spend(1);
                    if enough {
                        others.push(other);
                    }
                }
            });
            if !enough {
                return None;
            }
            others.sort_unstable();
            for other in others {
                let before = found.len();
                self.compare([one, other], tolerance, &mut found);
                if !budget.spend(DIVISION * (found.len() - before)) {
                    return None;
                }
            }
        }
        Some(found)
    }

    /// Adds the points that divide one of two pieces.
    fn compare(&mut self, pair: [usize; 2], tolerance: f64, found: &mut Vec<Division>) {
        let [one, other] = pair.map(|number| self.pieces[number]);
        let before = found.len();
        for (number, piece, ends) in [(pair[0], one, other.ends), (pair[1], other, one.ends)] {
            for point in ends {
                if piece.ends.contains(&point) {
                    continue;
                }
                let place = self.points[point as usize];
                if let Some(share) = foot(self.corners(&piece), place, tolerance) {
                    found.push(Division {
                        piece: number as u32,
                        share,
                        point,
                    });
                }
            }
        }
        let meet = one.ends.iter().any(|end| other.ends.contains(end));
        if meet || found.len() > before {
            return;
        }
        let corners = [one, other].map(|piece| self.corners(&piece));
        let Some(shares) = crossing(corners) else {
            return;
        };
        let [p, q] = corners[0];
        let point = self.points.len() as u32;
        self.points
            .push(std::array::from_fn(|k| p[k] + shares[0] * (q[k] - p[k])));
        self.crosses = true;
        for (number, share) in pair.into_iter().zip(shares) {
            found.push(Division {
                piece: number as u32,
                share,
                point,
            });
        }
    }

    fn divide(&mut self, mut divisions: Vec<Division>) {
        divisions.sort_by(|a, b| {
            let by_place = a.piece.cmp(&b.piece).then(a.share.total_cmp(&b.share));
            by_place.then(a.point.cmp(&b.point))
        });
        let mut next = divisions.into_iter().peekable();
        let mut pieces = Vec::with_capacity(self.pieces.len() + next.len());
        for (number, piece) in (0u32..).zip(&self.pieces) {
            let mut from = piece.ends[0];
            while let Some(division) = next.next_if(|division| division.piece == number) {
                if division.point != from {
                    pieces.push(Piece {
                        ends: [from, division.point],
                        source: piece.source,
                    });
                    from = division.point;
                }
            }
            pieces.push(Piece {
                ends: [from, piece.ends[1]],
                source: piece.source,
            });
        }
        self.pieces = pieces;
    }
}

/// Twice the area of a triangle, positive if the third corner lies where the second axis points, seen along the
/// first two.
fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// The share of a segment before the foot of a point that lies on it within the tolerance.
fn foot([p, q]: [[f64; 2]; 2], place: [f64; 2], tolerance: f64) -> Option<f64> {
    let along = [q[0] - p[0], q[1] - p[1]];
    let length = along[0].hypot(along[1]);
    let dot = along[0] * (place[0] - p[0]) + along[1] * (place[1] - p[1]);
    let share = dot / (length * length);
    let is_between = 0.0 < share && share < 1.0;
    (is_between && turn(p, q, place).abs() <= tolerance * length).then_some(share)
}

/// The shares of two segments before the point where they cross, no end of which lies on the other one.
fn crossing([one, other]: [[[f64; 2]; 2]; 2]) -> Option<[f64; 2]> {
    let share = |[p, q]: [[f64; 2]; 2], [r, s]: [[f64; 2]; 2]| {
        let (first, second) = (turn(r, s, p), turn(r, s, q));
        ((first > 0.0) != (second > 0.0)).then(|| first / (first - second))
    };
    Some([share(one, other)?, share(other, one)?])
}
