//! `report.html`: the table, and every statement with its figures and its plot, in one file.

use shapespace_report::html::{Markup, Page, cell, element, head, row, single};

use crate::plot::Plot;
use crate::record::{LawRecord, StatementRecord, VerifyRecord};
use crate::table::hypotheses;
use crate::verdict::Verdict;

const STYLE: &str = "\
table{width:100%}
.all td:nth-child(3){max-width:15rem}.all td:nth-child(n+5){white-space:nowrap}
.confirmed,.refuted,.not{font-weight:600;white-space:nowrap}
.confirmed{color:var(--good)}.refuted{color:var(--bad)}.not{color:var(--fair)}
.miss td{color:var(--bad)}.reason,.notes{color:var(--faint);font-size:13px}
.reference{color:var(--faint);font-weight:400}
svg{max-width:100%;height:auto;border:1px solid var(--line);margin-top:.6rem}
";

/// The report as HTML.
pub fn page(record: &VerifyRecord, plots: &[Plot]) -> String {
    let title = if record.broken {
        "Theory with broken ingredients"
    } else {
        "Theory, verified by runs"
    };
    let summary = format!("{}.", capital(&record.summary()));
    let mut body = element("h1", &[], title);
    body.push(element("p", &[], summary));
    body.push(overview(record));
    for s in &record.statements {
        body.push(statement(s));
        if let Some(plot) = plots.iter().find(|plot| plot.name == s.name) {
            body.push(Markup::trusted(plot.svg.as_str()));
        }
    }
    let page = Page {
        title,
        style: STYLE,
        script: "",
        body,
    };
    page.document()
}

/// All statements, with the figure that decides.
fn overview(record: &VerifyRecord) -> Markup {
    let (third, why): (_, Markup) = if record.broken {
        (
            "broken ingredient",
            "Each experiment is made with one wrong ingredient, by the same code as without it; \
             what it claims must then be refuted."
                .into(),
        )
    } else {
        (
            "hypotheses",
            [
                "Shown is the figure that decides. The same experiments with one wrong ingredient \
                 each, "
                    .into(),
                element("code", &[], "--broken"),
                ", must all end refuted.".into(),
            ]
            .into_iter()
            .collect(),
        )
    };
    let columns = [
        "statement",
        "reference",
        third,
        "observable",
        "expected",
        "measured",
        "verdict",
    ];
    let rows = record.statements.iter().map(|s| {
        let middle = s
            .broken_ingredient
            .map_or_else(|| hypotheses(s), str::to_owned);
        let link = [("href", &*format!("#{}", s.name))];
        let name = element("a", &link, element("code", &[], s.name));
        let cells = [
            name,
            s.reference.into(),
            middle.into(),
            s.observable.as_str().into(),
            s.expected.as_str().into(),
            s.measured.as_str().into(),
            verdict(&s.decided),
        ];
        row("", cells.map(cell))
    });
    let table = [head(columns.map(Markup::from))].into_iter().chain(rows);
    let mut all = element("p", &[], why);
    all.push(element(
        "table",
        &[("class", "all")],
        table.collect::<Markup>(),
    ));
    all
}

fn statement(s: &StatementRecord) -> Markup {
    let title: Markup = [
        element("code", &[], s.name),
        " ".into(),
        element("span", &[("class", "reference")], s.reference),
        " ".into(),
        verdict(&s.decided),
    ]
    .into_iter()
    .collect();
    let mut all = element("h2", &[("id", s.name)], title);
    all.push(element("p", &[], format!("{}.", s.claim)));
    if let Some(what) = s.broken_ingredient {
        all.push(element("p", &[], format!("Broken: {what}.")));
    }
    if let Some(law) = &s.law {
        all.push(law_notes(law));
    }
    if !s.hypotheses.is_empty() {
        let mut lines = Markup::from("Hypotheses:");
        for h in &s.hypotheses {
            lines.push(single("br", &[]));
            lines.push(format!("{} {}", mark(h.met), h.name));
        }
        all.push(notes(lines));
    }
    let rows = s.figures.iter().map(|f| {
        let (class, sign) = if f.holds { ("", "") } else { ("miss", " ≠") };
        let cells = [
            cell(f.observable.as_str()),
            cell(f.expected.as_str()),
            cell(format!("{}{sign}", f.measured)),
            element("td", &[("class", "reason")], f.reason.as_str()),
        ];
        row(class, cells)
    });
    let columns = ["observable", "expected", "measured", "why"].map(Markup::from);
    let table = [head(columns)].into_iter().chain(rows);
    all.push(element("table", &[], table.collect::<Markup>()));
    for note in &s.notes {
        all.push(notes(note.as_str()));
    }
    all
}

/// A law, and what it satisfies.
fn law_notes(law: &LawRecord) -> Markup {
    let (moduli, h) = (law.spec.moduli, &law.satisfies);
    let mut lines = Markup::from("Law: ");
    lines.push(element("code", &[], law.spec.law.to_string()));
    lines.push(format!(
        ", λ = {}, μ = {}, in {} dimensions.",
        moduli.lambda, moduli.mu, h.dimension
    ));
    lines.push(single("br", &[]));
    for (name, met) in [
        ("frame indifferent", h.frame_indifferent),
        ("isotropic", h.isotropic),
        ("stress free", h.stress_free),
        ("polyconvex", h.polyconvex),
        ("barrier", h.barrier),
        ("least on rotations", h.minimum_on_rotations),
        ("growth of Theorem 4.2", h.existence_theorem()),
        ("growth of Theorem 4.7", h.homeomorphism_theorem()),
    ] {
        lines.push(format!("{} {name} \u{2002}", mark(met)));
    }
    notes(lines)
}

fn notes(inner: impl Into<Markup>) -> Markup {
    element("p", &[("class", "notes")], inner)
}

fn mark(met: bool) -> char {
    if met { '✓' } else { '✗' }
}

fn verdict(verdict: &Verdict) -> Markup {
    let class = match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::NotCovered { .. } => "not",
        Verdict::Refuted { .. } => "refuted",
    };
    element("span", &[("class", class)], verdict.word())
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}
