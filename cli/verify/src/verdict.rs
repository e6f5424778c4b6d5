//! The verdict on an outcome; it is decided here only.

use serde::Serialize;

use crate::outcome::{Check, Expectation, Outcome};
use crate::statement::Ingredient;

/// The verdict on a statement.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "verdict")]
pub enum Verdict {
    /// All figures are as expected.
    Confirmed,
    /// The statement does not cover this case.
    NotCovered {
        /// The hypothesis that fails.
        hypothesis: String,
    },
    /// A figure is not as expected.
    Refuted {
        /// What was measured.
        observable: String,
    },
}

impl Check {
    /// Whether the figure is as expected; NaN never is.
    pub fn holds(&self) -> bool {
        match self.expected {
            Expectation::Value { value, tolerance } => {
                (self.measured - value).abs() <= tolerance && self.uncertainty <= tolerance
            }
            Expectation::AtMost(bound) => self.measured <= bound,
            Expectation::AtLeast(bound) => self.measured >= bound,
            // A fit that is less certain than its tolerance decides nothing.
            Expectation::Order { order, tolerance } => {
                (self.measured - order).abs() <= tolerance && self.uncertainty <= tolerance
            }
        }
    }
}

impl Verdict {
    /// The verdict on an outcome. In a broken run hypotheses are assumed to hold, so that the
    /// effect of a violated one appears in the figures.
    pub fn of(outcome: &Outcome, ingredient: Ingredient) -> Self {
        let unmet = outcome.conditions.iter().find(|c| !c.met);
        if let (Some(condition), Ingredient::Sound) = (unmet, ingredient) {
            return Self::NotCovered {
                hypothesis: condition.name.clone(),
            };
        }
        match outcome.checks.iter().find(|check| !check.holds()) {
            Some(check) => Self::Refuted {
                observable: check.observable.clone(),
            },
            None => Self::Confirmed,
        }
    }

    /// Whether it is the required verdict: a sound run must not be refuted, a broken one must.
    pub fn is_well(&self, ingredient: Ingredient) -> bool {
        matches!(self, Self::Refuted { .. }) == (ingredient == Ingredient::Broken)
    }

    /// In a word or two.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::NotCovered { .. } => "not covered",
            Self::Refuted { .. } => "refuted",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(measured: f64, expected: Expectation) -> Outcome {
        let mut outcome = Outcome::default();
        outcome.check("x", measured, 0.0, expected, "");
        outcome
    }

    #[test]
    fn figures_decide() {
        let value = Expectation::Value {
            value: 1.0,
            tolerance: 0.1,
        };
        let order = Expectation::Order {
            order: 2.0,
            tolerance: 0.15,
        };
        for (measured, expected, well) in [
            (1.05, value, true),
            (1.2, value, false),
            (f64::NAN, value, false),
            (2.1, order, true),
            (1.8, order, false),
            (1.0, Expectation::AtMost(1.0), true),
            (1.1, Expectation::AtMost(1.0), false),
            (f64::NAN, Expectation::AtMost(1.0), false),
            (1.0, Expectation::AtLeast(1.0), true),
            (f64::NAN, Expectation::AtLeast(1.0), false),
        ] {
            let verdict = Verdict::of(&outcome(measured, expected), Ingredient::Sound);
            assert_eq!(
                verdict == Verdict::Confirmed,
                well,
                "{measured} {expected:?}"
            );
            assert_eq!(verdict.is_well(Ingredient::Sound), well);
            assert_eq!(verdict.is_well(Ingredient::Broken), !well);
        }
    }

    #[test]
    fn an_uncertain_order_is_none() {
        let mut outcome = Outcome::default();
        let expected = Expectation::Order {
            order: 2.0,
            tolerance: 0.15,
        };
        outcome.check("x", 2.0, 0.3, expected, "");
        assert_eq!(Verdict::of(&outcome, Ingredient::Sound).word(), "refuted");
    }

    #[test]
    fn an_unmet_hypothesis_comes_first_unless_the_run_is_broken() {
        let mut outcome = outcome(2.0, Expectation::AtMost(1.0));
        outcome.condition("growth", false);
        let sound = Verdict::of(&outcome, Ingredient::Sound);
        assert_eq!(sound.word(), "not covered");
        assert!(sound.is_well(Ingredient::Sound));
        assert_eq!(Verdict::of(&outcome, Ingredient::Broken).word(), "refuted");
    }
}
