//! HTML whose texts are escaped by construction, and pages in one file that load nothing.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// Well-formed HTML: made of texts, which are escaped, and of elements, which are closed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Markup(String);

/// What all pages look like, by day and by night.
const STYLE: &str = include_str!("page.css");
/// Elements that begin a line of their own.
const BLOCKS: [&str; 16] = [
    "article", "body", "dd", "details", "div", "dl", "figure", "h1", "h2", "h3", "header", "li",
    "p", "section", "table", "tr",
];

impl Markup {
    /// Markup that is not text, such as an SVG drawing of this crate.
    pub fn trusted(markup: impl Into<String>) -> Self {
        Self(markup.into())
    }

    /// Adds markup at the end.
    pub fn push(&mut self, other: impl Into<Self>) {
        self.0.push_str(&other.into().0);
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The HTML.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// A text.
impl From<&str> for Markup {
    fn from(text: &str) -> Self {
        Self(escaped(text))
    }
}

/// A text.
impl From<String> for Markup {
    fn from(text: String) -> Self {
        Self(escaped(&text))
    }
}

impl FromIterator<Markup> for Markup {
    fn from_iter<I: IntoIterator<Item = Markup>>(parts: I) -> Self {
        let mut all = Self::default();
        for part in parts {
            all.push(part);
        }
        all
    }
}

/// A text that is only text in elements and in attributes.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            // The only controls that HTML allows.
            '\n' | '\t' => safe.push(letter),
            control if control.is_control() => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

/// An element with what is in it.
pub fn element(
    name: &'static str,
    attributes: &[(&str, &str)],
    inner: impl Into<Markup>,
) -> Markup {
    let inner = inner.into();
    let block = BLOCKS.contains(&name);
    let lines = ["body", "section", "table", "div", "dl"].contains(&name);
    let mut text = opened(name, attributes);
    text.push_str(if lines { ">\n" } else { ">" });
    text.push_str(&inner.0);
    text.push_str("</");
    text.push_str(name);
    text.push_str(if block { ">\n" } else { ">" });
    Markup(text)
}

/// An element that has nothing in it, such as `img` or `br`.
pub fn single(name: &'static str, attributes: &[(&str, &str)]) -> Markup {
    Markup(opened(name, attributes) + "/>")
}

fn opened(name: &str, attributes: &[(&str, &str)]) -> String {
    let mut text = format!("<{name}");
    for (key, value) in attributes {
        text.push(' ');
        text.push_str(key);
        text.push_str("=\"");
        text.push_str(&escaped(value));
        text.push('"');
    }
    text
}

/// The first row of a table.
pub fn head(cells: impl IntoIterator<Item = Markup>) -> Markup {
    let cells = cells.into_iter().map(|cell| element("th", &[], cell));
    element("tr", &[], cells.collect::<Markup>())
}

/// A row of a table with its cells; its class may be empty.
pub fn row(class: &str, cells: impl IntoIterator<Item = Markup>) -> Markup {
    let class = [("class", class)];
    let attributes = if class[0].1.is_empty() {
        &[]
    } else {
        &class[..]
    };
    element("tr", attributes, cells.into_iter().collect::<Markup>())
}

/// A cell of a table.
pub fn cell(inner: impl Into<Markup>) -> Markup {
    element("td", &[], inner)
}

/// Bytes as letters.
pub fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// A file within a page, of a type such as `image/png`.
pub fn data_url(kind: &str, bytes: &[u8]) -> String {
    let mut url = format!("data:{kind};base64,");
    STANDARD.encode_string(bytes, &mut url);
    url
}

/// JSON for the scripts of a page, as a block with this identifier, which is never run.
pub fn data_block(id: &str, json: &str) -> Markup {
    // In JSON these letters stand in strings only.
    let mut safe = String::with_capacity(json.len());
    for letter in json.chars() {
        match letter {
            '<' => safe.push_str("\\u003c"),
            '>' => safe.push_str("\\u003e"),
            '&' => safe.push_str("\\u0026"),
            '\u{2028}' => safe.push_str("\\u2028"),
            '\u{2029}' => safe.push_str("\\u2029"),
            other => safe.push(other),
        }
    }
    let attributes = [("type", "application/json"), ("id", id)];
    element("script", &attributes, Markup(safe))
}

/// A page in one file. Its policy lets it run its own script, show pictures that stand in it, and
/// nothing else.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// The title of the window.
    pub title: &'a str,
    /// What is added to the style of all pages.
    pub style: &'a str,
    /// The script; empty for none.
    pub script: &'a str,
    /// What the page shows.
    pub body: Markup,
}

impl Page<'_> {
    /// The file.
    pub fn document(&self) -> String {
        let script = if self.script.is_empty() {
            "'none'".to_owned()
        } else {
            hash(self.script)
        };
        let style = format!("{STYLE}{}", self.style);
        let policy = format!(
            "default-src 'none'; script-src {script}; style-src {}; img-src data: blob:; \
             base-uri 'none'; form-action 'none'",
            hash(&style)
        );
        let mut head: Markup = [
            single("meta", &[("charset", "utf-8")]),
            single(
                "meta",
                &[
                    ("http-equiv", "Content-Security-Policy"),
                    ("content", &policy),
                ],
            ),
            single(
                "meta",
                &[("name", "viewport"), ("content", "width=device-width")],
            ),
            single(
                "meta",
                &[("name", "color-scheme"), ("content", "light dark")],
            ),
            element("title", &[], self.title),
        ]
        .into_iter()
        .collect();
        // Hashes are those of the bytes between the tags.
        head.push(Markup(format!("<style>{style}</style>")));
        let mut body = self.body.clone();
        if !self.script.is_empty() {
            body.push(Markup(format!("<script>{}</script>\n", self.script)));
        }
        let inner: Markup = [element("head", &[], head), element("body", &[], body)]
            .into_iter()
            .collect();
        format!(
            "<!DOCTYPE html>\n{}\n",
            element("html", &[("lang", "en")], inner).0
        )
    }
}

/// How a policy names a script or a style sheet.
fn hash(text: &str) -> String {
    format!("'sha256-{}'", base64(&Sha256::digest(text.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVIL: &str = "<img src=x onerror=\"alert(1)\"> & '</script>\u{1b}";

    #[test]
    fn no_text_becomes_markup() {
        let safe =
            "&lt;img src=x onerror=&quot;alert(1)&quot;&gt; &amp; &#39;&lt;/script&gt;\u{fffd}";
        assert_eq!(Markup::from(EVIL).as_str(), safe);
        assert_eq!(
            element("b", &[("title", EVIL)], EVIL).as_str(),
            format!("<b title=\"{safe}\">{safe}</b>")
        );
        let block = data_block("names", "[\"</script><!--&\"]");
        assert_eq!(
            block.as_str(),
            "<script type=\"application/json\" id=\"names\">\
             [\"\\u003c/script\\u003e\\u003c!--\\u0026\"]</script>"
        );
    }

    #[test]
    fn a_page_runs_its_own_script_only() {
        let page = Page {
            title: EVIL,
            style: "p{}",
            script: "1<2",
            body: element("p", &[], EVIL),
        };
        let text = page.document();
        assert!(text.contains(&escaped(&hash("1<2"))) && text.contains("<script>1<2</script>"));
        let (_, rest) = text.split_once("<style>").unwrap();
        let (style, _) = rest.split_once("</style>").unwrap();
        assert!(style.ends_with("p{}") && text.contains(&escaped(&hash(style))));
        assert!(text.contains("default-src &#39;none&#39;"));
        assert!(!text.contains("<img"));
        // FIPS 180-4: the hash of the empty message.
        let none = "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='";
        assert_eq!(hash(""), none);
        let quiet = Page { script: "", ..page }.document();
        assert!(quiet.contains("script-src &#39;none&#39;") && !quiet.contains("<script"));
    }

    #[test]
    fn files_are_letters() {
        assert_eq!(
            data_url("image/png", b"abcd"),
            "data:image/png;base64,YWJjZA=="
        );
    }
}
