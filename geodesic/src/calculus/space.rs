//! Exponential map, logarithm and parallel transport in any space of discrete paths.

use fe_grid::mutant;

/// A space in which paths are discretised in time: points, and an energy `W(a, b)` of a step that
/// approximates the squared distance of close points.
///
/// Three points `a, b, c` are a geodesic of two steps if `b` is stationary between its neighbours,
///
/// ```text
/// d_2 W(a, b) + d_1 W(b, c) = 0,
/// ```
///
/// and a path is a discrete geodesic if this holds at all its inner points. An implementation
/// provides the third point of such a triple ([`extended`](Self::extended)) and the second
/// ([`midpoint`](Self::midpoint)); the other operations are built from these two for all spaces.
/// Points are coordinates: differences of close points represent tangent vectors.
///
/// Source: Rumpf and Wirth, *Variational time discretization of geodesic calculus*, IMA Journal of
/// Numerical Analysis 35 (2015), sections 3 to 5.
pub trait PathSpace {
    /// A point, or a difference of points.
    type Point: Clone;
    /// Error of the space.
    type Error;

    /// Computes `Exp^2`: the point `c` such that `b` is the middle of the geodesic `a, b, c`;
    /// `None` if no such point is found.
    ///
    /// # Errors
    /// Those of the space.
    fn extended(
        &mut self,
        a: &Self::Point,
        b: &Self::Point,
    ) -> Result<Option<Self::Point>, Self::Error>;

    /// Computes the point `b` in the middle of the geodesic `a, b, c`; `None` if none is found.
    ///
    /// # Errors
    /// Those of the space.
    fn midpoint(
        &mut self,
        a: &Self::Point,
        c: &Self::Point,
    ) -> Result<Option<Self::Point>, Self::Error>;

    /// Returns `s x + t y`, in coordinates.
    fn combination(&self, s: f64, x: &Self::Point, t: f64, y: &Self::Point) -> Self::Point;

    /// Computes the discrete exponential map `Exp^k`: the points that extend the geodesic starting
    /// with `first` and `second`, in steps of equal length. Returns fewer points than requested if
    /// the geodesic cannot be extended further.
    ///
    /// With `second = first + v / K` the point at time one, `K - 1` steps further, is
    /// `exp_first(v) + O(1/K)`.
    ///
    /// # Errors
    /// Those of the space.
    fn exponential(
        &mut self,
        first: &Self::Point,
        second: &Self::Point,
        steps: usize,
    ) -> Result<Vec<Self::Point>, Self::Error> {
        let mut found: Vec<Self::Point> = Vec::with_capacity(steps);
        for k in 0..steps {
            let at = if k > 0 { &found[k - 1] } else { second };
            let before = match mutant!(k, ExponentialNeighbour => 0) {
                0 => first,
                1 => second,
                _ => &found[k - 2],
            };
            let Some(next) = self.extended(before, at)? else {
                break;
            };
            found.push(next);
        }
        Ok(found)
    }

    /// Computes the discrete logarithm: `K (x_1 - x_0)` for a geodesic `x_0, ..., x_K`, the initial
    /// velocity of the path in unit time up to `O(1/K)`; `None` for a path without steps.
    fn logarithm(&self, path: &[Self::Point]) -> Option<Self::Point> {
        let [first, second, ..] = path else {
            return None;
        };
        let steps = mutant!((path.len() - 1) as f64, LogarithmScale => 1.0);
        Some(self.combination(steps, second, -steps, first))
    }

    /// Transports `variation` parallel from the first point of a path to its last, rung by rung:
    /// see [`carried`](Self::carried). `None` if a rung cannot be computed.
    ///
    /// # Errors
    /// Those of the space.
    fn transport(
        &mut self,
        path: &[Self::Point],
        variation: &Self::Point,
        ladder: Ladder,
    ) -> Result<Option<Self::Point>, Self::Error> {
        let share = ladder.share_of(path.len().saturating_sub(1));
        let mut carried = variation.clone();
        for pair in path.windows(2) {
            let Some(next) = self.carried(&pair[0], &pair[1], &carried, share, ladder.symmetric)?
            else {
                return Ok(None);
            };
            carried = next;
        }
        Ok(Some(carried))
    }

    /// Transports `variation` parallel over one step, from `a` to `b`, by a rung of Schild's
    /// ladder, scaled by `s`: with `y = a + s variation`, the midpoint `c` of the geodesic
    /// `y, c, b` and the end `z` of the geodesic `a, c, z`, the result is `(z - b) / s`. A
    /// symmetric rung is half the difference of this and the same for `-s`. `None` if there is no
    /// such geodesic.
    ///
    /// # Errors
    /// Those of the space.
    fn carried(
        &mut self,
        a: &Self::Point,
        b: &Self::Point,
        variation: &Self::Point,
        share: f64,
        symmetric: bool,
    ) -> Result<Option<Self::Point>, Self::Error> {
        let Some(ahead) = rung(self, a, b, variation, share)? else {
            return Ok(None);
        };
        if !symmetric {
            return Ok(Some(self.combination(1.0 / share, &ahead, -1.0 / share, b)));
        }
        let Some(behind) = rung(self, a, b, variation, -share)? else {
            return Ok(None);
        };
        let half = 0.5 / share;
        Ok(Some(self.combination(half, &ahead, -half, &behind)))
    }
}

/// Computes the end of a rung.
fn rung<S: PathSpace + ?Sized>(
    space: &mut S,
    a: &S::Point,
    b: &S::Point,
    variation: &S::Point,
    share: f64,
) -> Result<Option<S::Point>, S::Error> {
    let side = space.combination(1.0, a, share, variation);
    match space.midpoint(&side, b)? {
        Some(middle) => space.extended(mutant!(a, TransportRung => &side), &middle),
        None => Ok(None),
    }
}

/// Parameters of Schild's ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    /// Factor `s` of the variation in a rung; by default `1/K`, for which rungs and rails are
    /// equally fine.
    pub share: Option<f64>,
    /// Whether the opposite variation is transported, too, and half the difference of both is the
    /// result. This doubles the work; errors that are even in the length of a rung cancel,
    /// including the leading one.
    pub symmetric: bool,
}

impl Default for Ladder {
    fn default() -> Self {
        Self {
            share: None,
            symmetric: true,
        }
    }
}

impl Ladder {
    /// Returns the factor `s` for a path of the given number of steps.
    pub fn share_of(&self, steps: usize) -> f64 {
        self.share.unwrap_or(1.0 / steps.max(1) as f64)
    }
}
