//! The colours of what is found on the boundary.

use shapespace_picture::{Colour, ColourBar, WHITE, heat};

/// False discovery rates at the ends of the colours.
const RATES: [f64; 2] = [0.05, 0.001];

/// The colours of differences of means, from none to the largest.
pub(crate) fn difference_bar(most: f64, unit: &str) -> ColourBar {
    let title = format!("difference of the means ({unit})");
    ColourBar::linear(title, [0.0, most], heat)
}

/// The colours of false discovery rates.
pub(crate) fn rate_bar() -> ColourBar {
    let marks = [RATES[0], 0.01, RATES[1]];
    ColourBar {
        title: "false discovery rate, white above .05".into(),
        colour: strength,
        marks: marks
            .map(|rate| (rate_share(rate), rate.to_string()))
            .to_vec(),
    }
}

/// The place of a rate in these colours; below 0 for rates that are too large.
pub(crate) fn rate_share(rate: f64) -> f64 {
    let [most, least] = RATES;
    (most / rate.max(least)).ln() / (most / least).ln()
}

/// White for rates that are too large, and dark for the least.
fn strength(share: f64) -> Colour {
    if share < 0.0 {
        WHITE
    } else {
        heat(0.3 + 0.7 * share)
    }
}
