//! Numbers in text.

/// Words of a text, and the numbers that they are.
pub(super) struct Words<'a> {
    words: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Words<'a> {
    pub fn new(text: &'a str) -> Self {
        Self {
            words: text.split_ascii_whitespace(),
        }
    }

    pub fn next(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    /// The next word as a number.
    pub fn number(&mut self) -> Result<f64, String> {
        let word = self.next().ok_or("it is cut off: a number is missing")?;
        parsed(word)
    }
}

/// A number in text.
pub(super) fn parsed(word: &str) -> Result<f64, String> {
    let shown: String = word.chars().take(20).collect();
    word.parse()
        .map_err(|_| format!("'{shown}' is not a number"))
}

/// Bytes as text; those that are none become signs that no number has.
pub(super) fn text(bytes: &[u8]) -> std::borrow::Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// A number that counts or points, from a number of any type.
pub(super) fn index(number: f64) -> Result<u32, String> {
    if number.fract() == 0.0 && (0.0..f64::from(u32::MAX)).contains(&number) {
        Ok(number as u32)
    } else {
        Err(format!("{number} is not the number of a corner"))
    }
}
