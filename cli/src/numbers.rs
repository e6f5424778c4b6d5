//! Numbers on the command line.

/// A number as text, without the hundreds of digits of very large and very small ones.
pub(crate) fn shown(number: f64) -> String {
    if number == 0.0 || !number.is_finite() || (1e-5..1e16).contains(&number.abs()) {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}

/// A number with four figures.
pub(crate) fn rounded(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

/// A number that is neither infinite nor NaN.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("a finite number is needed".into()),
    }
}

/// A finite number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match finite(text)? {
        number if number > 0.0 => Ok(number),
        _ => Err("a number above 0 is needed".into()),
    }
}

/// A finite number that is not negative.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    match finite(text)? {
        number if number >= 0.0 => Ok(number),
        _ => Err("a number of at least 0 is needed".into()),
    }
}

/// The ending of a word of which there are so many.
pub(crate) fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_figures_are_left() {
        let all = [2913.6, 0.123456, 29_136_423.0, 0.0, 1e-300];
        assert_eq!(
            all.map(rounded),
            [2914.0, 0.1235, 29_140_000.0, 0.0, 1e-300]
        );
    }

    #[test]
    fn numbers_are_short() {
        let all = [0.0, -2.5, 1e15, 1e300, -1e-300, f64::NAN, f64::INFINITY];
        let texts = all.map(shown);
        assert_eq!(
            texts,
            [
                "0",
                "-2.5",
                "1000000000000000",
                "1e300",
                "-1e-300",
                "NaN",
                "inf"
            ]
        );
    }
}
