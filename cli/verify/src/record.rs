//! `result.json`, and the same figures as tables.

use hyperelastic::{Hypotheses, LawSpec};
use serde::Serialize;
use shapespace_report::table::{Table, exact, exact_or_empty};

use crate::outcome::{Check, Expectation, Line, Outcome};
use crate::statement::{Effort, Setting, Statement};
use crate::verdict::Verdict;

/// The result of a run of the command.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyRecord {
    /// `quick` or `full`.
    pub effort: &'static str,
    /// Whether one ingredient of every experiment was broken.
    pub broken: bool,
    /// Statements by verdict.
    pub confirmed: usize,
    /// Statements that do not cover the case of the run.
    pub not_covered: usize,
    /// Statements with a figure that is not as expected.
    pub refuted: usize,
    /// The statements, in the order of the notes.
    pub statements: Vec<StatementRecord>,
    /// Wall time.
    pub seconds: f64,
}

/// The result for one statement. `expected`, `measured` and `order` are those of the decisive
/// figure: the first that failed, or else the first.
#[derive(Clone, Debug, Serialize)]
pub struct StatementRecord {
    /// Its name.
    pub name: &'static str,
    /// Its reference.
    pub reference: &'static str,
    /// Its claim.
    pub claim: &'static str,
    /// The broken ingredient, in a broken run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub broken_ingredient: Option<&'static str>,
    /// The law used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<LawRecord>,
    /// The hypotheses of the statement.
    pub hypotheses: Vec<HypothesisRecord>,
    /// The decisive observable.
    pub observable: String,
    /// Its expected value.
    pub expected: String,
    /// What was found.
    pub measured: String,
    /// The first order of convergence among the figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<OrderRecord>,
    /// Whether the verdict is the one required of this run.
    pub well: bool,
    /// The verdict.
    #[serde(flatten)]
    pub decided: Verdict,
    /// All figures.
    pub figures: Vec<FigureRecord>,
    /// The plotted lines.
    pub lines: Vec<LineRecord>,
    /// Further remarks.
    pub notes: Vec<String>,
    /// Wall time.
    pub seconds: f64,
}

/// A law and its properties.
#[derive(Clone, Debug, Serialize)]
pub struct LawRecord {
    /// Name and moduli.
    #[serde(flatten)]
    pub spec: LawSpec,
    /// Its properties.
    pub satisfies: Hypotheses,
}

/// A hypothesis.
#[derive(Clone, Debug, Serialize)]
pub struct HypothesisRecord {
    /// In words.
    pub name: String,
    /// Whether it holds.
    pub met: bool,
}

/// An order of convergence.
#[derive(Clone, Debug, Serialize)]
pub struct OrderRecord {
    /// The theoretical order.
    pub expected: f64,
    /// The fitted order.
    pub observed: f64,
    /// Its standard error.
    pub error: f64,
}

/// A figure.
#[derive(Clone, Debug, Serialize)]
pub struct FigureRecord {
    /// What was measured.
    pub observable: String,
    /// What was expected.
    pub expected: String,
    /// Why.
    pub reason: String,
    /// The measured value; left out if it is not finite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The measured value as text.
    pub measured: String,
    /// Its uncertainty.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
    /// Whether it is as expected.
    pub holds: bool,
}

/// A line of a plot.
#[derive(Clone, Debug, Serialize)]
pub struct LineRecord {
    /// What it shows.
    pub label: String,
    /// What runs along the horizontal axis.
    pub axis: String,
    /// The order expected.
    pub order: f64,
    /// Its points, those that are positive and finite.
    pub points: Vec<(f64, f64)>,
}

impl VerifyRecord {
    /// Of all statements.
    pub fn new(setting: Setting, statements: Vec<StatementRecord>, seconds: f64) -> Self {
        let count = |word: &str| {
            let of = |s: &&StatementRecord| s.decided.word() == word;
            statements.iter().filter(of).count()
        };
        Self {
            effort: match setting.effort {
                Effort::Quick => "quick",
                Effort::Full => "full",
            },
            broken: setting.is_broken(),
            confirmed: count("confirmed"),
            not_covered: count("not covered"),
            refuted: count("refuted"),
            statements,
            seconds,
        }
    }

    /// Whether every statement has the required verdict.
    pub fn is_well(&self) -> bool {
        self.statements.iter().all(|s| s.well)
    }

    /// The counts as a sentence.
    pub fn summary(&self) -> String {
        let all = self.statements.len();
        if self.broken {
            return format!(
                "{} of {all} statements with a broken ingredient are refuted, as they should be",
                self.refuted
            );
        }
        format!(
            "of {all} statements {} are confirmed, {} not covered, {} refuted",
            self.confirmed, self.not_covered, self.refuted
        )
    }
}

impl StatementRecord {
    /// Of an outcome and its verdict.
    pub fn new(
        statement: &Statement,
        setting: Setting,
        outcome: &Outcome,
        verdict: &Verdict,
        seconds: f64,
    ) -> Self {
        let failed = outcome.checks.iter().find(|check| !check.holds());
        let decisive = failed.or(outcome.checks.first());
        let text = |f: fn(&Check) -> String| decisive.map(f).unwrap_or_default();
        Self {
            name: statement.name,
            reference: statement.reference,
            claim: statement.claim,
            broken_ingredient: setting.is_broken().then_some(statement.broken),
            law: outcome.law.map(|used| LawRecord {
                spec: used.spec,
                satisfies: used.hypotheses,
            }),
            hypotheses: outcome
                .conditions
                .iter()
                .map(|c| HypothesisRecord {
                    name: c.name.clone(),
                    met: c.met,
                })
                .collect(),
            observable: text(|check| check.observable.clone()),
            expected: text(Check::expected),
            measured: text(Check::measured),
            order: outcome.checks.iter().find_map(order),
            well: verdict.is_well(setting.ingredient),
            decided: verdict.clone(),
            figures: outcome.checks.iter().map(FigureRecord::new).collect(),
            lines: outcome.lines.iter().map(LineRecord::new).collect(),
            notes: outcome.notes.clone(),
            seconds,
        }
    }
}

impl FigureRecord {
    fn new(check: &Check) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        Self {
            observable: check.observable.clone(),
            expected: check.expected(),
            reason: check.reason.clone(),
            value: finite(check.measured),
            measured: check.measured(),
            uncertainty: finite(check.uncertainty).filter(|u| *u > 0.0),
            holds: check.holds(),
        }
    }
}

impl LineRecord {
    fn new(line: &Line) -> Self {
        let usable = |x: f64| x > 0.0 && x.is_finite();
        let points = line.points.iter().copied();
        Self {
            label: line.label.clone(),
            axis: line.axis.clone(),
            order: line.slope,
            points: points.filter(|&(x, y)| usable(x) && usable(y)).collect(),
        }
    }
}

fn order(check: &Check) -> Option<OrderRecord> {
    let Expectation::Order { order, .. } = check.expected else {
        return None;
    };
    (check.measured.is_finite() && check.uncertainty.is_finite()).then_some(OrderRecord {
        expected: order,
        observed: check.measured,
        error: check.uncertainty,
    })
}

impl Check {
    /// The expected value as text.
    pub fn expected(&self) -> String {
        match self.expected {
            Expectation::Value { value, tolerance } => {
                format!("{} ± {}", number(value), number(tolerance))
            }
            Expectation::AtMost(bound) => format!("≤ {}", number(bound)),
            Expectation::AtLeast(bound) => format!("≥ {}", number(bound)),
            Expectation::Order { order, tolerance } => {
                format!("order {} ± {}", number(order), number(tolerance))
            }
        }
    }

    /// The measured value as text.
    pub fn measured(&self) -> String {
        let value = match self.expected {
            Expectation::Order { .. } => format!("{:.2}", self.measured),
            Expectation::Value { tolerance, .. } => beside(self.measured, tolerance),
            _ => number(self.measured),
        };
        if self.uncertainty > 0.0 {
            format!("{value} ± {:.0e}", self.uncertainty)
        } else {
            value
        }
    }
}

/// A number with enough digits to show its deviation relative to a tolerance.
pub fn beside(x: f64, tolerance: f64) -> String {
    let plain = number(x);
    if plain.contains('e') || !(tolerance > 0.0 && x.is_finite()) {
        return plain;
    }
    let digits = (2.0 - tolerance.log10().floor()).clamp(0.0, 14.0) as usize;
    trimmed(&format!("{x:.digits$}"))
}

fn trimmed(text: &str) -> String {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text.into()
    }
}

/// A number with its significant digits.
pub fn number(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if !x.is_finite() {
        format!("{x}")
    } else if (1e-3..1e4).contains(&x.abs()) {
        let digits = (3 - x.abs().log10().floor() as i32).max(0) as usize;
        trimmed(&format!("{x:.digits$}"))
    } else {
        format!("{x:.2e}").replace(".00e", "e")
    }
}

/// The figures as comma-separated values, a line for each.
pub fn figures_csv(record: &VerifyRecord) -> String {
    let mut table = Table::new([
        "statement",
        "observable",
        "expected",
        "measured",
        "uncertainty",
        "holds",
    ]);
    for s in &record.statements {
        for f in &s.figures {
            table.texts([
                s.name.to_owned(),
                f.observable.clone(),
                f.expected.clone(),
                exact_or_empty(f.value),
                exact_or_empty(f.uncertainty),
                f.holds.to_string(),
            ]);
        }
    }
    table.csv()
}

/// The points that are plotted as comma-separated values, a line for each.
pub fn lines_csv(record: &VerifyRecord) -> String {
    let mut table = Table::new(["statement", "line", "x", "y"]);
    for s in &record.statements {
        for line in &s.lines {
            for (x, y) in &line.points {
                table.texts([s.name.to_owned(), line.label.clone(), exact(*x), exact(*y)]);
            }
        }
    }
    table.csv()
}
