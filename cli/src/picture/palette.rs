//! Colours that are told apart, of about the same lightness.

use super::Colour;

/// Blue, vermilion, green, purple, ochre, teal, rose, olive: muted so that none shouts.
const FIRST: [Colour; 8] = [
    [0.16, 0.42, 0.69],
    [0.82, 0.36, 0.16],
    [0.18, 0.55, 0.34],
    [0.52, 0.34, 0.66],
    [0.74, 0.56, 0.10],
    [0.10, 0.56, 0.60],
    [0.78, 0.33, 0.50],
    [0.45, 0.50, 0.20],
];

/// The colour of a shape by its number. After the first eight, hues follow the golden angle.
pub fn colour(index: usize) -> Colour {
    FIRST.get(index).copied().unwrap_or_else(|| {
        let hue = (0.08 + 0.618_034 * index as f32).fract();
        let lightness = if index.is_multiple_of(2) { 0.40 } else { 0.50 };
        hsl(hue, 0.52, lightness)
    })
}

fn hsl(hue: f32, saturation: f32, lightness: f32) -> Colour {
    let amplitude = saturation * lightness.min(1.0 - lightness);
    [0.0, 8.0, 4.0].map(|n: f32| {
        let k = (n + 12.0 * hue) % 12.0;
        lightness - amplitude * (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_colours_differ_and_are_dark_enough_on_white() {
        for i in 0..20 {
            let c = colour(i);
            let luminance = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
            assert!(luminance < 0.68, "{i}: {c:?}");
            for j in 0..i {
                let d = colour(j);
                let distance: f32 = (0..3).map(|k| (c[k] - d[k]).abs()).sum();
                assert!(distance > 0.05, "{i} {j}");
            }
        }
    }
}
