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
