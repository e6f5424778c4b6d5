//! Rust source with everything except code replaced by blanks.

/// Returns the text with comments, strings and characters replaced by spaces; lines are kept.
pub fn blanked(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    while at < bytes.len() {
        let length = quiet_length(text, at);
        if length == 0 {
            let next = text[at..].chars().next().map_or(1, char::len_utf8);
            out.push_str(&text[at..at + next]);
            at += next;
            continue;
        }
        let end = (at + length).min(bytes.len());
        let newlines = text[at..end].chars();
        out.extend(newlines.map(|c| if c == '\n' { '\n' } else { ' ' }));
        at = end;
    }
    out
}

/// Returns the length of the comment, string or character that begins here, or zero.
fn quiet_length(text: &str, at: usize) -> usize {
    let rest = &text[at..];
    let after_word = text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    if rest.starts_with("//") {
        return rest.find('\n').unwrap_or(rest.len());
    }
    if rest.starts_with("/*") {
        return block_comment_length(rest);
    }
    if let Some(opened) = rest.strip_prefix('"') {
        return 1 + string_length(opened);
    }
    if rest.starts_with('\'') {
        return character_length(rest);
    }
    if !after_word && (rest.starts_with('r') || rest.starts_with("br")) {
        return raw_string_length(rest);
    }
    0
}

/// Comments nest.
fn block_comment_length(rest: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest[at..].starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += rest[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    rest.len()
}

/// The rest of a string after the opening quotation mark, with the closing one.
fn string_length(rest: &str) -> usize {
    let mut escaped = false;
    for (i, c) in rest.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return i + 1,
            _ => {}
        }
    }
    rest.len()
}

fn raw_string_length(rest: &str) -> usize {
    let start = rest.trim_start_matches('b').trim_start_matches('r');
    let hashes = start.len() - start.trim_start_matches('#').len();
    if !start[hashes..].starts_with('"') {
        return 0;
    }
    let opened = rest.len() - start.len() + hashes + 1;
    let close = format!("\"{}", "#".repeat(hashes));
    let found = rest[opened..].find(&close);
    found.map_or(rest.len(), |i| opened + i + close.len())
}

/// A character, as opposed to a lifetime.
fn character_length(rest: &str) -> usize {
    let mut chars = rest.char_indices().skip(1);
    match chars.next() {
        Some((_, '\\')) => {
            let escape = rest[3.min(rest.len())..].find('\'');
            escape.map_or(0, |i| 3 + i + 1)
        }
        Some(_) => match chars.next() {
            Some((i, '\'')) => i + 1,
            _ => 0,
        },
        None => 0,
    }
}

/// Blanked code without the items under `#[cfg(test)]`.
pub fn without_tests(code: &str) -> String {
    let mut out = String::with_capacity(code.len());
    let mut rest = code;
    while let Some(start) = rest.find("#[cfg(test)]") {
        let (before, item) = rest.split_at(start);
        let (tests, after) = item.split_at(item_length(item));
        out.push_str(before);
        out.extend(tests.chars().filter(|&c| c == '\n'));
        rest = after;
    }
    out.push_str(rest);
    out
}

/// The text up to the brace that closes an item, or to the semicolon of an item without braces.
fn item_length(item: &str) -> usize {
    let mut depth = 0;
    for (i, c) in item.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 1 => return i + 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return i + 1,
            _ => {}
        }
    }
    item.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_vanish_and_code_stays() {
        let cases = [
            ("a // b\nc", "a     \nc"),
            ("a /* b /* c */ d */ e", "a                   e"),
            (r#"f("a\"b", 'c')"#, "f(      ,    )"),
            (r##"f(r#"a"b"#)"##, "f(        )"),
            (r"x: &'a str = '\n'", "x: &'a str =     "),
            (r"'\'' y '\u{e9}'", "     y         "),
            ("bar\"x\" for r in", "bar    for r in"),
            ("\"one\ntwo\" z", "    \n     z"),
        ];
        for (text, expected) in cases {
            assert_eq!(blanked(text), expected, "{text}");
        }
    }

    #[test]
    fn items_for_tests_are_left_out_and_lines_stay() {
        let code = "a\n#[cfg(test)]\nmod t {\n { b }\n}\nc\n#[cfg(test)]\nuse d;\ne";
        assert_eq!(without_tests(code), "a\n\n\n\n\nc\n\n\ne");
    }
}
