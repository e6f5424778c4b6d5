//! The outcome of an experiment: hypotheses, and measured and expected values.
//!
//! An experiment never decides on its verdict; see [`crate::verdict`].

use hyperelastic::{Hypotheses, LawSpec};
use serde::{Deserialize, Serialize};

use crate::error::VerifyError;
use crate::order::Fit;
use crate::tools::pointwise;

/// The expected value of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Expectation {
    /// A number.
    Value {
        /// The number.
        value: f64,
        /// The tolerance.
        tolerance: f64,
    },
    /// An upper bound.
    AtMost(f64),
    /// A lower bound.
    AtLeast(f64),
    /// An order of convergence.
    Order {
        /// The order.
        order: f64,
        /// The tolerance of the fitted order.
        tolerance: f64,
    },
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// What was measured.
    pub observable: String,
    /// What is expected.
    pub expected: Expectation,
    /// The reasons for the expected value and for the tolerance.
    pub reason: String,
    /// The measured value.
    pub measured: f64,
    /// Its uncertainty: the standard error of a fit, or an estimate; zero up to rounding.
    pub uncertainty: f64,
}

/// A hypothesis of the statement, checked for the data of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// The hypothesis.
    pub name: String,
    /// Whether it holds.
    pub met: bool,
}

/// A law that an experiment uses, and its properties.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawUsed {
    /// The law.
    pub spec: LawSpec,
    /// Its properties.
    pub hypotheses: Hypotheses,
}

/// A line of a plot on logarithmic axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// What it shows.
    pub label: String,
    /// The quantity on the horizontal axis.
    pub axis: String,
    /// Its points.
    pub points: Vec<(f64, f64)>,
    /// Its expected order.
    pub slope: f64,
}

/// The outcome of an experiment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The law used, if it matters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<LawUsed>,
    /// The hypotheses of the statement.
    pub conditions: Vec<Condition>,
    /// The figures, the most important one first.
    pub checks: Vec<Check>,
    /// The plotted lines.
    pub lines: Vec<Line>,
    /// Further remarks.
    pub notes: Vec<String>,
}

/// Hypotheses of a theorem on a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Requirement {
    /// `W(QA) = W(A)`.
    FrameIndifference,
    /// `W(1) = 0`, `W_,A(1) = 0`.
    StressFree,
    /// Convex in `(A, cof A, det A)`.
    Polyconvexity,
    /// Infinite where the deformation folds.
    Barrier,
    /// Theorem 4.2: growth faster than the dimension.
    NormGrowth,
    /// Theorem 4.7: its four exponents.
    HomeomorphismGrowth,
}

impl Requirement {
    fn answer(self, h: &Hypotheses) -> Condition {
        let d = h.dimension;
        let (name, met) = match self {
            Self::FrameIndifference => ("W is frame indifferent".to_owned(), h.frame_indifferent),
            Self::StressFree => ("W is stress free at the identity".to_owned(), h.stress_free),
            Self::Polyconvexity => ("W is polyconvex".to_owned(), h.polyconvex),
            Self::Barrier => ("W is infinite where det A <= 0".to_owned(), h.barrier),
            Self::NormGrowth => (
                format!(
                    "W grows as |A|^p with p > d = {d} (here p = {})",
                    h.growth.norm
                ),
                h.growth.norm > d as f64,
            ),
            Self::HomeomorphismGrowth => {
                let bound = if d == 2 { "q/(q-2)" } else { "2q/(q-3)" };
                let growth = h.growth;
                let found = format!(
                    "p = {}, q = {}, r = {}, s = {}",
                    growth.norm, growth.cofactor, growth.expansion, growth.compression
                );
                (
                    format!(
                        "W grows as |A|^p + |cof A|^q + D^r + D^-s with p, q > {d}, r > 1, \
                         s > {bound} (here {found})"
                    ),
                    h.homeomorphism_theorem(),
                )
            }
        };
        Condition { name, met }
    }
}

impl Outcome {
    /// The outcome of an experiment with a law in `D` dimensions, for which the statement has
    /// hypotheses.
    ///
    /// # Errors
    /// [`VerifyError::Law`] where there is no such law.
    pub fn with_law<const D: usize>(
        spec: LawSpec,
        required: &[Requirement],
    ) -> Result<Self, VerifyError> {
        let hypotheses = pointwise::hypotheses::<D>(&spec)?;
        Ok(Self {
            law: Some(LawUsed { spec, hypotheses }),
            conditions: required.iter().map(|r| r.answer(&hypotheses)).collect(),
            ..Self::default()
        })
    }

    /// A hypothesis that does not concern the law.
    pub fn condition(&mut self, name: impl Into<String>, met: bool) {
        self.conditions.push(Condition {
            name: name.into(),
            met,
        });
    }

    /// A figure with an expected number.
    pub fn value(
        &mut self,
        observable: impl Into<String>,
        measured: f64,
        value: f64,
        tolerance: f64,
        reason: &str,
    ) {
        let expected = Expectation::Value { value, tolerance };
        self.check(observable, measured, 0.0, expected, reason);
    }

    /// A figure with an upper bound.
    pub fn at_most(
        &mut self,
        observable: impl Into<String>,
        measured: f64,
        bound: f64,
        reason: &str,
    ) {
        let expected = Expectation::AtMost(bound);
        self.check(observable, measured, 0.0, expected, reason);
    }

    /// A figure with a lower bound.
    pub fn at_least(
        &mut self,
        observable: impl Into<String>,
        measured: f64,
        bound: f64,
        reason: &str,
    ) {
        let expected = Expectation::AtLeast(bound);
        self.check(observable, measured, 0.0, expected, reason);
    }

    /// An order of convergence: the least-squares slope of errors against steps on logarithmic
    /// axes. The points are plotted.
    pub fn order(
        &mut self,
        observable: impl Into<String>,
        axis: &str,
        points: Vec<(f64, f64)>,
        order: f64,
        tolerance: f64,
        reason: &str,
    ) {
        let expected = Expectation::Order { order, tolerance };
        self.slope(observable.into(), axis, points, order, expected, reason);
    }

    /// An order of convergence with a lower bound only.
    pub fn order_at_least(
        &mut self,
        observable: impl Into<String>,
        axis: &str,
        points: Vec<(f64, f64)>,
        bound: f64,
        reason: &str,
    ) {
        let expected = Expectation::AtLeast(bound);
        self.slope(observable.into(), axis, points, bound, expected, reason);
    }

    fn slope(
        &mut self,
        observable: String,
        axis: &str,
        points: Vec<(f64, f64)>,
        slope: f64,
        expected: Expectation,
        reason: &str,
    ) {
        let points: Vec<_> = points.into_iter().map(|(x, y)| (x, y.abs())).collect();
        let (measured, uncertainty) =
            Fit::of(&points).map_or((f64::NAN, f64::NAN), |fit| (fit.slope, fit.error));
        self.check(
            format!("order in {axis}: {observable}"),
            measured,
            uncertainty,
            expected,
            reason,
        );
        self.lines.push(Line {
            label: observable,
            axis: axis.to_owned(),
            points,
            slope,
        });
    }

    /// A figure with a known uncertainty.
    pub fn check(
        &mut self,
        observable: impl Into<String>,
        measured: f64,
        uncertainty: f64,
        expected: Expectation,
        reason: &str,
    ) {
        self.checks.push(Check {
            observable: observable.into(),
            expected,
            reason: reason.to_owned(),
            measured,
            uncertainty,
        });
    }

    /// Further remarks.
    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }
}
