//! The pictures of a directory: PNG, SVG, and animations with a slider.

use shapespace_report::html::{Markup, data_url, element, single};

use super::overview::section;
use super::source::Source;
use super::values::one;
use crate::output::names::MODE;

const PNG: &str = "image/png";
const SVG: &str = "image/svg+xml";

/// The picture that a summary names.
pub(super) fn main(source: &Source<'_>) -> Markup {
    let name = source.summary.picture();
    picture(source, name, PNG).unwrap_or_default()
}

/// All other pictures: animations, then pictures, then plots.
pub(super) fn others(source: &Source<'_>) -> Markup {
    let animations = source
        .ending(".apng")
        .filter_map(|name| player(source, name));
    let animations: Markup = animations.collect();
    let main = source.summary.picture();
    let pictures = source.ending(".png").filter(|name| *name != main);
    let pictures = pictures.filter_map(|name| picture(source, name, PNG));
    let pictures: Markup = pictures.collect();
    let plots = source
        .ending(".svg")
        .filter(|name| !name.starts_with(MODE))
        .filter_map(|name| picture(source, name, SVG));
    let plots: Markup = plots.collect();
    let row = |figures: Markup| {
        if figures.is_empty() {
            figures
        } else {
            element("div", &[("class", "row")], figures)
        }
    };
    [
        section("In motion", row(animations)),
        section("Pictures", pictures),
        section("Plots", row(plots)),
    ]
    .into_iter()
    .collect()
}

/// A figure of a file of this type.
fn picture(source: &Source<'_>, name: &str, kind: &str) -> Option<Markup> {
    embedded(source, name, kind, |image| {
        let inner = [image, element("figcaption", &[], name)];
        element("figure", &[], inner.into_iter().collect::<Markup>())
    })
}

/// An animation, with a slider for those who run scripts.
fn player(source: &Source<'_>, name: &str) -> Option<Markup> {
    embedded(source, name, PNG, |image| {
        let slider = [
            ("type", "range"),
            ("min", "0"),
            ("max", "0"),
            ("value", "0"),
            ("aria-label", name),
        ];
        let controls: Markup = [
            element("button", &[("type", "button")], "pause"),
            single("input", &slider),
            element("output", &[], ""),
        ]
        .into_iter()
        .collect();
        let inner: Markup = [
            image,
            element("div", &[("class", "controls"), ("hidden", "")], controls),
            element("figcaption", &[], name),
        ]
        .into_iter()
        .collect();
        let (word, [low, high]) = range(source, name);
        let attributes = [
            ("class", "player"),
            ("data-word", word),
            ("data-low", low.as_str()),
            ("data-high", high.as_str()),
        ];
        element("figure", &attributes, inner)
    })
}

/// What runs in an animation, and from where to where: scores of a mode, or time.
fn range(source: &Source<'_>, name: &str) -> (&'static str, [String; 2]) {
    let amplitude = one(&source.record, "/parameters/amplitude");
    match amplitude.and_then(serde_json::Value::as_f64) {
        Some(most) if name.starts_with("mode_") => ("score", [-most, most].map(|s| s.to_string())),
        _ => ("time", [0, 1].map(|t| t.to_string())),
    }
}

/// What is made of the image of a file of this type, or its name where there is no room for it;
/// nothing where it is not there.
fn embedded(
    source: &Source<'_>,
    name: &str,
    kind: &str,
    figure: impl FnOnce(Markup) -> Markup,
) -> Option<Markup> {
    let url = data_url(kind, &source.bytes(name)?);
    Some(if source.take(url.len()) {
        figure(single("img", &[("alt", name), ("src", &url)]))
    } else {
        element("p", &[], format!("{name}: too large for this page"))
    })
}
