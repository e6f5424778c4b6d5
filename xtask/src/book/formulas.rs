//! Formulas of the guide as MathML, which browsers draw themselves, so that its pages load nothing.
//!
//! mdBook leaves them as they are, between `\(` and `\)` or `\[` and `\]`, for a script from the network.

use std::path::Path;
use std::{fs, io};

use pulldown_latex::config::DisplayMode;
use pulldown_latex::{Parser, RenderConfig, Storage, push_mathml};

/// Replaces the formulas of all pages; returns their number.
///
/// # Errors
/// Those of files, and a formula that is not understood.
pub fn draw(folder: &Path) -> io::Result<usize> {
    let mut n = 0;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "html") {
            let page = fs::read_to_string(&path)?;
            let (page, n_page) = drawn(&without_script(&page)).map_err(|formula| {
                io::Error::other(format!("{}: not understood: {formula}", path.display()))
            })?;
            fs::write(&path, page)?;
            n += n_page;
        }
    }
    Ok(n)
}

/// A page without the script that draws formulas from the network.
fn without_script(page: &str) -> String {
    let lines = page.lines().filter(|line| !line.contains("MathJax.js"));
    lines.map(|line| line.to_owned() + "\n").collect()
}

/// A page with its formulas drawn, and their number; or the formula that is not understood.
fn drawn(page: &str) -> Result<(String, usize), String> {
    let (mut text, mut n, mut rest) = (String::new(), 0, page);
    while let Some(place) = rest.find(['\\', '<']) {
        let (before, from) = rest.split_at(place);
        text += before;
        let code = ["<code", "<pre", "<script"]
            .iter()
            .find(|tag| from.starts_with(**tag));
        let formula = [("\\(", "\\)", false), ("\\[", "\\]", true)];
        let formula = formula.iter().find(|(begin, ..)| from.starts_with(begin));
        if let Some(tag) = code {
            let end = format!("</{}", &tag[1..]);
            let length = from.find(&end).map_or(from.len(), |at| at + end.len());
            text += &from[..length];
            rest = &from[length..];
        } else if let Some((begin, end, is_block)) = formula {
            let inside = &from[begin.len()..];
            let Some(length) = inside.find(end) else {
                return Err(inside.chars().take(80).collect());
            };
            text += &mathml(&unescaped(&inside[..length]), *is_block)?;
            n += 1;
            rest = &inside[length + end.len()..];
        } else {
            text += &from[..1];
            rest = &from[1..];
        }
    }
    Ok((text + rest, n))
}

/// A formula as MathML, or the formula if it is not understood.
fn mathml(formula: &str, is_block: bool) -> Result<String, String> {
    let storage = Storage::new();
    let parser = Parser::new(formula, &storage);
    let wrong = || formula.to_owned();
    // The events are read twice: errors are no errors of writing.
    if Parser::new(formula, &Storage::new()).any(|event| event.is_err()) {
        return Err(wrong());
    }
    let config = RenderConfig {
        display_mode: if is_block {
            DisplayMode::Block
        } else {
            DisplayMode::Inline
        },
        ..RenderConfig::default()
    };
    let mut text = String::new();
    push_mathml(&mut text, parser, config).map_err(|_| wrong())?;
    Ok(text)
}

/// Text of a page without the names of its characters.
fn unescaped(text: &str) -> String {
    let names = [
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&#39;", "'"),
        ("&#x27;", "'"),
    ];
    let text = names.iter().fold(text.to_owned(), |text, (name, sign)| {
        text.replace(name, sign)
    });
    text.replace("&amp;", "&")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_drawn_outside_of_code() {
        let (page, n) = drawn(r"<p>a \(x_1 &lt; 2\) <code>\(y\)</code> \[z\]</p>").unwrap();
        assert_eq!(n, 2);
        assert!(
            page.contains(r"<code>\(y\)</code>") && !page.contains(r"\[z"),
            "{page}"
        );
        assert_eq!(page.matches("<math").count(), 2);
        assert!(drawn(r"\(\nosuchcommand{x}\)").is_err());
        assert!(drawn(r"\(x").is_err());
    }

    #[test]
    fn every_formula_of_the_guide_is_understood() {
        let folder = crate::tidy::root().join("docs/book/src");
        let mut n = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "md") {
                // Markdown removes one of two backslashes.
                let text = fs::read_to_string(&path).unwrap().replace(r"\\", r"\");
                // Blocks and names in backticks are code.
                let text: String = text.split("```").step_by(2).collect();
                let text: String = text.split('`').step_by(2).collect();
                n += drawn(&text)
                    .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
                    .1;
            }
        }
        assert!(n > 100, "{n}");
    }
}
