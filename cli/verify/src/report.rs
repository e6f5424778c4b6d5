//! `report.html`: the table, and every statement with its figures and its plot, in one file.

use std::fmt::Write as _;

use crate::plot::Plot;
use crate::record::{LawRecord, StatementRecord, VerifyRecord};
use crate::table::hypotheses;
use crate::verdict::Verdict;

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;color:#21262e;max-width:72rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.1rem;margin:2.2rem 0 .3rem}
table{border-collapse:collapse;font-size:13px;width:100%}
th,td{text-align:left;vertical-align:top;padding:.25rem .6rem .25rem 0;border-bottom:1px solid #e4e6e9}
th{color:#5a6069;font-weight:600}
.all td:nth-child(3){max-width:15rem}.all td:nth-child(n+5){white-space:nowrap}
a{color:inherit}code{font-size:92%}
.confirmed,.refuted,.not{font-weight:600;white-space:nowrap}
.confirmed{color:#1f7a4d}.refuted{color:#b3261e}.not{color:#8a6100}
.miss td{color:#b3261e}.reason,.notes{color:#5a6069;font-size:13px}
.reference{color:#5a6069;font-weight:400}
svg{max-width:100%;height:auto;border:1px solid #e4e6e9;margin-top:.6rem}";

/// The report as HTML.
pub fn page(record: &VerifyRecord, plots: &[Plot]) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write_page(&mut text, record, plots);
    text
}

fn write_page(text: &mut String, record: &VerifyRecord, plots: &[Plot]) -> std::fmt::Result {
    let title = if record.broken {
        "Theory with broken ingredients"
    } else {
        "Theory, verified by runs"
    };
    writeln!(
        text,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<p>{}.</p>",
        escaped(&capital(&record.summary()))
    )?;
    let (head, why) = if record.broken {
        (
            "broken ingredient",
            "Each experiment is made with one wrong ingredient, by the same code as without it; \
             what it claims must then be refuted.",
        )
    } else {
        (
            "hypotheses",
            "Shown is the figure that decides. The same experiments with one wrong ingredient each, \
             <code>--broken</code>, must all end refuted.",
        )
    };
    writeln!(
        text,
        "<p>{why}</p>\n<table class=\"all\"><tr><th>statement<th>reference<th>{head}<th>observable<th>expected\
         <th>measured<th>verdict</tr>"
    )?;
    for s in &record.statements {
        let middle = s
            .broken_ingredient
            .map_or_else(|| hypotheses(s), str::to_owned);
        writeln!(
            text,
            "<tr><td><a href=\"#{0}\"><code>{0}</code></a><td>{1}<td>{2}<td>{3}<td>{4}<td>{5}<td>{6}</tr>",
            s.name,
            escaped(s.reference),
            escaped(&middle),
            escaped(&s.observable),
            escaped(&s.expected),
            escaped(&s.measured),
            verdict(&s.decided),
        )?;
    }
    writeln!(text, "</table>")?;
    for s in &record.statements {
        write_statement(text, s)?;
        if let Some(plot) = plots.iter().find(|plot| plot.name == s.name) {
            writeln!(text, "{}", plot.svg)?;
        }
    }
    writeln!(text, "</body></html>")
}

fn write_statement(text: &mut String, s: &StatementRecord) -> std::fmt::Result {
    writeln!(
        text,
        "<h2 id=\"{0}\"><code>{0}</code> <span class=\"reference\">{1}</span> {2}</h2>\n<p>{3}.</p>",
        s.name,
        escaped(s.reference),
        verdict(&s.decided),
        escaped(s.claim),
    )?;
    if let Some(what) = s.broken_ingredient {
        writeln!(text, "<p>Broken: {}.</p>", escaped(what))?;
    }
    if let Some(law) = &s.law {
        write_law(text, law)?;
    }
    if !s.hypotheses.is_empty() {
        writeln!(text, "<p class=\"notes\">Hypotheses:")?;
        for h in &s.hypotheses {
            let mark = if h.met { "✓" } else { "✗" };
            writeln!(text, "<br>{mark} {}", escaped(&h.name))?;
        }
        writeln!(text, "</p>")?;
    }
    writeln!(
        text,
        "<table><tr><th>observable<th>expected<th>measured<th>why</tr>"
    )?;
    for f in &s.figures {
        let (class, mark) = if f.holds {
            ("", "")
        } else {
            (" class=\"miss\"", " ≠")
        };
        writeln!(
            text,
            "<tr{class}><td>{}<td>{}<td>{}{mark}<td class=\"reason\">{}</tr>",
            escaped(&f.observable),
            escaped(&f.expected),
            escaped(&f.measured),
            escaped(&f.reason),
        )?;
    }
    writeln!(text, "</table>")?;
    for note in &s.notes {
        writeln!(text, "<p class=\"notes\">{}</p>", escaped(note))?;
    }
    Ok(())
}

/// A law, and what it satisfies.
fn write_law(text: &mut String, law: &LawRecord) -> std::fmt::Result {
    let (moduli, h) = (law.spec.moduli, &law.satisfies);
    writeln!(
        text,
        "<p class=\"notes\">Law: <code>{}</code>, λ = {}, μ = {}, in {} dimensions.<br>",
        escaped(&law.spec.law.to_string()),
        moduli.lambda,
        moduli.mu,
        h.dimension
    )?;
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
        let mark = if met { "✓" } else { "✗" };
        write!(text, "{mark} {name} &ensp;")?;
    }
    writeln!(text, "</p>")
}

fn verdict(verdict: &Verdict) -> String {
    let class = match verdict {
        Verdict::Confirmed => "confirmed",
        Verdict::NotCovered { .. } => "not",
        Verdict::Refuted { .. } => "refuted",
    };
    format!("<span class=\"{class}\">{}</span>", verdict.word())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().chain(letters).collect())
        .unwrap_or_default()
}
