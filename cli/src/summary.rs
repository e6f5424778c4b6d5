//! The summary of a result on standard output.

use std::fmt::Display;
use std::path::Path;

use fe_grid::Certificate;
use hyperelastic::LawSpec;

use crate::doubts::{DoubtRecord, in_words};
use crate::numbers::shown;
use crate::print::print_or_note;
use crate::report::{PAGE, RESULT, Record, certified};
use crate::shapes::describe_placement;
use shapespace_input::terminal::printable;
use shapespace_picture::Canvas;

/// A short description of a result.
pub(crate) struct Summary {
    lines: Vec<String>,
    /// Whether the user stopped the computation.
    pub interrupted: bool,
    /// The doubts about the result.
    pub doubts: Vec<DoubtRecord>,
    /// The file with the results.
    pub results: &'static str,
    /// The picture.
    picture: &'static str,
    /// Small pictures of the shapes, where they have been drawn.
    pub marks: Vec<Canvas>,
}

impl Summary {
    /// The summary of a record, with its first line and the name of its picture.
    pub fn new<C, T, const D: usize>(
        record: &Record<C, T, D>,
        picture: &'static str,
        title: String,
    ) -> Self {
        let mut summary = Self {
            lines: vec![title],
            interrupted: record.cancelled(),
            doubts: record.doubts.clone(),
            results: RESULT,
            picture,
            marks: Vec::new(),
        };
        if let Some(spacing) = record.spacing() {
            summary.line("spacing", spacing);
        }
        if let Some(alignment) = describe_placement(&record.input) {
            summary.line("alignment", alignment);
        }
        summary
    }

    /// Adds a line with a value; without a name, it continues the line above.
    pub fn line(&mut self, name: &str, value: impl Display) {
        self.lines.push(line(name, value));
    }

    /// Adds text as it is.
    pub fn text(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
    }

    /// Adds a line about the elastic law: its name, its moduli, and what was chosen of a power law.
    pub fn law(&mut self, law: &LawSpec) {
        let moduli = law.moduli;
        let (lambda, mu) = (rounded(moduli.lambda), rounded(moduli.mu));
        let mut words = vec![format!("{}, lambda {lambda}, mu {mu}", law.law)];
        let list = |numbers: &[f64]| {
            numbers
                .iter()
                .map(|x| rounded(*x))
                .collect::<Vec<_>>()
                .join(",")
        };
        if let Some(exponents) = law.power.exponents {
            words.push(format!("exponents {}", list(&<[f64; 4]>::from(exponents))));
        }
        if let Some(share) = law.power.norm_share {
            words.push(format!("norm share {}", rounded(share)));
        }
        if let Some(coefficients) = law.power.coefficients {
            words.push(format!(
                "coefficients {}",
                list(&<[f64; 3]>::from(coefficients))
            ));
        }
        self.line("law", words.join(", "));
    }

    /// Adds a line about the deformations.
    pub fn certificate(&mut self, certificate: &Certificate) {
        let (state, det) = (certified(certificate), certificate.min_det);
        self.line(
            "deformation",
            format!("{state}, determinant at least {det:.3e}"),
        );
    }

    /// The first line.
    pub fn title(&self) -> &str {
        let first = self.lines.first().and_then(|text| text.lines().next());
        first.unwrap_or_default()
    }

    /// All lines but the verdict and the files.
    pub fn lines(&self) -> &[String] {
        &self.lines
    }

    /// The name of the picture.
    pub fn picture(&self) -> &'static str {
        self.picture
    }

    /// The summary without the names of files.
    pub fn words(&self) -> String {
        let lines = self.lines.iter().cloned();
        let lines: Vec<String> = lines.chain(self.verdict()).collect();
        printable(&lines.join("\n"))
    }

    /// The verdict, with the doubts if there are any.
    fn verdict(&self) -> Vec<String> {
        if self.doubts.is_empty() {
            return vec![line("verdict", "sound")];
        }
        let doubts = in_words(&self.doubts).into_iter();
        let doubts = doubts.map(|doubt| format!("    {doubt}"));
        std::iter::once(line("verdict", "doubtful"))
            .chain(doubts)
            .collect()
    }

    /// Prints the summary. It ends with the picture, and with the doubts if there are any. The result has been
    /// written: that standard output cannot be is no error, and said on standard error.
    pub fn print(&self, directory: &Path) {
        let path = |name| directory.join(name).display().to_string();
        let mut lines = self.lines.clone();
        let mut files = vec![line("results", path(self.results))];
        if directory.join(PAGE).exists() {
            files.push(line("report", path(PAGE)));
        }
        files.push(line("picture", path(self.picture)));
        if self.doubts.is_empty() {
            lines.extend(self.verdict());
            lines.extend(files);
        } else {
            lines.extend(files);
            lines.extend(self.verdict());
        }
        lines.push(String::new());
        print_or_note(&printable(&lines.join("\n")));
    }
}

/// A number to seven digits: moduli that follow from coefficients have rounding errors.
fn rounded(number: f64) -> String {
    shown(format!("{number:.6e}").parse().unwrap_or(number))
}

/// A line with a value.
fn line(name: &str, value: impl Display) -> String {
    format!("  {name:<12} {value}")
}
