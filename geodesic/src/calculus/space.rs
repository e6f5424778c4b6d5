//! Exponential map, logarithm and parallel transport in any space of discrete paths.

/// A space in which paths are discretised in time: points, and an energy `W(a, b)` of a step that
/// approximates the squared distance of close points.
///
/// Three points `a, b, c` are a geodesic of two steps where `b` is stationary between its
/// neighbours,
///
/// ```text
/// d_2 W(a, b) + d_1 W(b, c) = 0,
/// ```
///
/// and a path is a discrete geodesic where all its inner points are. The calculus asks for the
/// third point of such a triple ([`extended`](Self::extended)) or for the second
/// ([`midpoint`](Self::midpoint)); all else is made of the two here, once for all spaces. Points
/// are coordinates: differences of close points stand for tangent vectors.
///
/// Source: Rumpf and Wirth, *Variational time discretization of geodesic calculus*, IMA Journal of
/// Numerical Analysis 35 (2015), sections 3 to 5.
pub trait PathSpace {
    /// A point, or a difference of points.
    type Point: Clone;
    /// What can go wrong for good.
    type Error;

    /// `Exp^2`: the point `c` that makes `b` the middle of the geodesic `a, b, c`; none where
    /// there is none to be found.
    ///
    /// # Errors
    /// Those of the space.
    fn extended(
        &mut self,
        a: &Self::Point,
        b: &Self::Point,
    ) -> Result<Option<Self::Point>, Self::Error>;

    /// The point `b` in the middle of the geodesic `a, b, c`; none where there is none to be found.
    ///
    /// # Errors
    /// Those of the space.
    fn midpoint(
        &mut self,
        a: &Self::Point,
        c: &Self::Point,
    ) -> Result<Option<Self::Point>, Self::Error>;

    /// `s x + t y`, in coordinates.
    fn combination(&self, s: f64, x: &Self::Point, t: f64, y: &Self::Point) -> Self::Point;

    /// The discrete exponential map `Exp^k`: the points that continue the geodesic which begins
    /// with `first` and `second`, in steps of equal length. Fewer than asked for where the geodesic
    /// cannot be continued.
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
            let before = match k {
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

    /// The discrete logarithm: `K (x_1 - x_0)` for a geodesic `x_0, ..., x_K`, the initial velocity
    /// of the path in unit time up to `O(1/K)`; none for a path without steps.
    fn logarithm(&self, path: &[Self::Point]) -> Option<Self::Point> {
        let [first, second, ..] = path else {
            return None;
        };
        let steps = (path.len() - 1) as f64;
        Some(self.combination(steps, second, -steps, first))
    }

    /// Parallel transport of `variation` from the first point of a path to its last, rung by rung:
    /// see [`carried`](Self::carried). None where a rung cannot be made.
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

    /// Parallel transport of `variation` over one step, from `a` to `b`, by a rung of Schild's
    /// ladder of the length of a share `s` of it: with `y = a + s variation` the middle `c` of the
    /// geodesic `y, c, b` and the end `z` of the geodesic `a, c, z` give `(z - b) / s`. A symmetric
    /// rung is half the difference of that and the same for `-s`. None where there is no such
    /// geodesic.
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

/// The end of a rung.
fn rung<S: PathSpace + ?Sized>(
    space: &mut S,
    a: &S::Point,
    b: &S::Point,
    variation: &S::Point,
    share: f64,
) -> Result<Option<S::Point>, S::Error> {
    let side = space.combination(1.0, a, share, variation);
    match space.midpoint(&side, b)? {
        Some(middle) => space.extended(a, &middle),
        None => Ok(None),
    }
}

/// How Schild's ladder is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    /// The share `s` of the variation that a rung is long; `1/K` where none is given, which makes
    /// rungs and rails equally fine.
    pub share: Option<f64>,
    /// Whether the opposite variation is transported, too, and half the difference of both is the
    /// result. That doubles the work; errors that are even in the length of a rung cancel, the
    /// leading one among them.
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
    /// The share in force for a path of so many steps.
    pub fn share_of(&self, steps: usize) -> f64 {
        self.share.unwrap_or(1.0 / steps.max(1) as f64)
    }
}
