//! The verdict on a result: sound, or doubtful for stated reasons.
//!
//! A [`Doubt`] says which figure of a result lies beyond its limit. [`criteria`](crate::criteria)
//! has all limits. Theories and inspections of shapes return lists of doubts; a result without any
//! is sound.

use fe_grid::minimise::Curvature;
use serde::{Deserialize, Serialize};

use crate::criteria::{Cause, DETERMINANT_FLOOR, Limit, RESOLVED_DISTANCE};

/// Whether a result can be relied upon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// No figure lies beyond its limit.
    Sound,
    /// At least one does, or nothing was checked.
    #[default]
    Doubtful,
}

impl Verdict {
    /// The verdict on a result with these doubts.
    pub fn of<T>(doubts: &[T]) -> Self {
        if doubts.is_empty() {
            Self::Sound
        } else {
            Self::Doubtful
        }
    }
}

/// A figure that lies beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Doubt {
    /// Index of the shape, from 0; missing where the doubt is about the result as a whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<usize>,
    /// Index of the component of the shape, from 0; missing where the doubt is about all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<usize>,
    /// What the figure measures.
    #[serde(rename = "what")]
    pub cause: Cause,
    /// The figure. One that is not finite is left out of files.
    #[serde(skip_serializing_if = "not_finite")]
    pub figure: f64,
    /// Its limit.
    pub limit: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn not_finite(figure: &f64) -> bool {
    !figure.is_finite()
}

impl Doubt {
    /// A doubt if a figure lies beyond the limit of its cause, or is not a number.
    pub fn check(cause: Cause, figure: f64) -> Option<Self> {
        match cause.criterion().limit {
            Limit::AtLeast(limit) => Self::below(cause, figure, limit),
            Limit::AtMost(limit) => Self::above(cause, figure, limit),
        }
    }

    /// A doubt if a figure is below a limit, or is not a number.
    pub fn below(cause: Cause, figure: f64, limit: f64) -> Option<Self> {
        let sound = figure >= limit;
        (!sound).then_some(Self::new(cause, figure, limit))
    }

    /// A doubt if a figure is above a limit, or is not a number.
    pub fn above(cause: Cause, figure: f64, limit: f64) -> Option<Self> {
        let sound = figure <= limit;
        (!sound).then_some(Self::new(cause, figure, limit))
    }

    /// A doubt if the energy falls along the direction of its least curvature: the state is no minimum.
    pub fn saddle(curvature: &Curvature) -> Option<Self> {
        Self::check(Cause::Saddle, curvature.fall)
    }

    /// A doubt if the smallest determinant of a deformation is close to the lower bound that the
    /// minimiser enforces; see [`DETERMINANT_FLOOR`].
    pub fn determinant(least: f64, lower_bound: f64) -> Option<Self> {
        Self::below(Cause::Determinant, least, DETERMINANT_FLOOR * lower_bound)
    }

    /// A doubt about a Dice overlap, unless the mean distance of the boundaries, in spacings, is
    /// below the resolution of the grid; see [`RESOLVED_DISTANCE`].
    pub fn overlap(cause: Cause, dice: f64, mean_distance: f64) -> Option<Self> {
        Self::check(cause, dice).filter(|_| {
            let resolved = mean_distance <= RESOLVED_DISTANCE;
            !resolved
        })
    }

    fn new(cause: Cause, figure: f64, limit: f64) -> Self {
        Self {
            shape: None,
            component: None,
            cause,
            figure,
            limit,
        }
    }

    /// The same about one shape.
    #[must_use]
    pub fn about(self, shape: usize) -> Self {
        Self {
            shape: Some(shape),
            ..self
        }
    }

    /// The same about one component.
    #[must_use]
    pub fn within(self, component: usize) -> Self {
        Self {
            component: Some(component),
            ..self
        }
    }

    /// How far the figure is beyond its limit: infinite for one that is not a number.
    fn excess(&self) -> f64 {
        let excess = match self.cause.criterion().limit {
            Limit::AtLeast(_) => self.limit - self.figure,
            Limit::AtMost(_) => self.figure - self.limit,
        };
        if excess.is_nan() {
            f64::INFINITY
        } else {
            excess
        }
    }
}

/// For every shape, component and cause the worst doubt, by cause and then by shape and component: the doubts of several
/// computations with the same shapes as one list.
pub fn worst(doubts: impl IntoIterator<Item = Doubt>) -> Vec<Doubt> {
    let mut all: Vec<Doubt> = doubts.into_iter().collect();
    let subject = |doubt: &Doubt| (doubt.cause, doubt.shape, doubt.component);
    all.sort_by(|a, b| {
        let order = subject(a).cmp(&subject(b));
        order.then(b.excess().total_cmp(&a.excess()))
    });
    all.dedup_by_key(|doubt| subject(doubt));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_at_its_limit_is_sound_and_one_beyond_or_unknown_is_not() {
        for cause in Cause::ALL {
            let (limit, beyond) = match cause.criterion().limit {
                Limit::AtLeast(limit) => (limit, limit - 1e-9),
                Limit::AtMost(limit) => (limit, limit + 1e-9),
            };
            assert_eq!(Doubt::check(cause, limit), None, "{cause:?}");
            let doubt = Doubt::check(cause, beyond).unwrap();
            assert_eq!((doubt.cause, doubt.limit), (cause, limit));
            assert!(Doubt::check(cause, f64::NAN).is_some(), "{cause:?}");
        }
    }

    #[test]
    fn the_worst_doubt_of_a_shape_and_cause_remains() {
        let overlap = |shape: usize, dice| {
            let doubt = Doubt::check(Cause::Overlap, dice).unwrap();
            doubt.about(shape)
        };
        let specks = Doubt::check(Cause::Specks, 2.0).unwrap().about(1);
        let all = [overlap(1, 0.9), specks, overlap(0, 0.5), overlap(1, 0.7)];
        assert_eq!(worst(all), [overlap(0, 0.5), overlap(1, 0.7), specks]);
        let [first, second] = [0, 1].map(|c| overlap(0, 0.5).within(c));
        assert_eq!(worst([second, first, first]), [first, second]);
        let unknown = Doubt::check(Cause::Overlap, f64::NAN).unwrap().about(1);
        assert!(worst([overlap(1, 0.1), unknown])[0].figure.is_nan());
        assert_eq!(worst([]), []);
    }

    #[test]
    fn a_result_is_sound_without_doubts_only() {
        assert_eq!(Verdict::of::<Doubt>(&[]), Verdict::Sound);
        let doubt = Doubt::check(Cause::Border, 1.0).unwrap();
        assert_eq!(Verdict::of(&[doubt]), Verdict::Doubtful);
        assert_eq!(Verdict::default(), Verdict::Doubtful);
    }

    #[test]
    fn a_doubt_is_written_by_the_name_of_its_cause() {
        let doubt = Doubt::check(Cause::ThinParts, 0.5).unwrap().about(3);
        let text = serde_json::to_string(&doubt).unwrap();
        let limit = doubt.limit;
        let expected = format!(r#"{{"shape":3,"what":"thin_parts","figure":0.5,"limit":{limit}}}"#);
        assert_eq!(text, expected);
        let unknown = Doubt::check(Cause::Border, f64::NAN).unwrap();
        let text = serde_json::to_string(&unknown).unwrap();
        assert_eq!(text, r#"{"what":"border","limit":0.0}"#);
    }
}
