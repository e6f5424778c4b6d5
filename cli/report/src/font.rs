//! Labels in the embedded font, see `assets/README.md`.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScaleFont, ScaleFont, point};

/// Height of capitals in labels.
pub const SIZE: f32 = 9.0;
/// Height of capitals in small labels.
pub const SMALL: f32 = 7.5;

/// Height of capitals in units of the font.
const CAPITALS: f32 = 1493.0;

static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    let bytes = include_bytes!("../assets/DejaVuSans.ttf");
    // It cannot fail: the file is compiled into the program, and every test of this module reads
    // it.
    FontRef::try_from_slice(bytes).expect("the embedded font is a whole file")
});

/// The size of the font with capitals of this height.
pub fn size(height: f32) -> f32 {
    height * FONT.units_per_em().unwrap_or(2048.0) / CAPITALS
}

/// The font with capitals of this height.
fn sized(height: f32) -> PxScaleFont<&'static FontRef<'static>> {
    FONT.as_scaled(height / CAPITALS * FONT.height_unscaled())
}

/// Returns the glyphs of a text with the positions of their origins, and the total width. Missing
/// characters have the replacement box of the font.
fn layout(text: &str, height: f32) -> (Vec<(GlyphId, f32)>, f32) {
    let font = sized(height);
    let mut glyphs: Vec<(GlyphId, f32)> = Vec::new();
    let mut x = 0.0;
    for character in text.chars() {
        let glyph = font.glyph_id(character);
        if let Some((last, _)) = glyphs.last() {
            x += font.kern(*last, glyph);
        }
        glyphs.push((glyph, x));
        x += font.h_advance(glyph);
    }
    (glyphs, x)
}

/// Width of a text whose capitals have the given height.
pub fn width(text: &str, height: f32) -> f32 {
    layout(text, height).1
}

/// Returns the text, shortened around an ellipsis to the width `most`; empty if the ellipsis does
/// not fit.
pub fn shortened(text: &str, height: f32, most: f32) -> String {
    let fits = |text: &str| width(text, height) <= most;
    if fits(text) {
        return text.to_owned();
    }
    let characters: Vec<char> = text.chars().collect();
    let keeping = |kept: usize| -> String {
        let head = characters[..kept.div_ceil(2)].iter();
        let tail = characters[characters.len() - kept / 2..].iter();
        head.chain(&['…']).chain(tail).collect()
    };
    // Widths grow with the number of characters that are kept, up to kerning.
    let counts: Vec<usize> = (0..characters.len()).collect();
    let fitting = counts.partition_point(|&kept| fits(&keeping(kept)));
    fitting.checked_sub(1).map_or_else(String::new, keeping)
}

/// Lays out a text from the upper left corner of its capitals, with its baseline on a row of
/// pixels, and calls `pixel` with the fraction of every pixel that is covered; pixels left of or
/// above the picture are ignored.
pub fn cover(text: &str, corner: [f32; 2], height: f32, mut pixel: impl FnMut([usize; 2], f32)) {
    let font = sized(height);
    let foot = (corner[1] + height).round();
    for (id, x) in layout(text, height).0 {
        let glyph = id.with_scale_and_position(font.scale(), point(corner[0] + x, foot));
        let Some(outline) = FONT.outline_glyph(glyph) else {
            continue; // A space.
        };
        let low = outline.px_bounds().min;
        outline.draw(|i, j, share| {
            let place = [low.x + i as f32, low.y + j as f32];
            if share > 0.0 && place.iter().all(|p| *p >= 0.0) {
                pixel(place.map(|p| p as usize), share);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Darkness of all pixels of a text.
    fn drawn(text: &str) -> Vec<f32> {
        let mut pixels = vec![0.0; 60 * 24];
        cover(text, [8.0, 8.0], SIZE, |[x, y], share| {
            pixels[60 * y + x] += share;
        });
        pixels
    }

    #[test]
    fn letters_of_three_scripts_differ_and_what_is_missing_is_a_box() {
        let letters = "aAsSßuüUÜoöyÿłşğλΛωΩπµЖжяЯйшdbpq019.,:;_-–…→√≤²₀∈∅";
        let pictures: Vec<Vec<f32>> = letters.chars().map(|c| drawn(&c.to_string())).collect();
        let missing = drawn("語");
        assert!(missing.iter().sum::<f32>() > 10.0);
        assert_eq!(missing, drawn("\n"));
        for (i, (letter, picture)) in letters.chars().zip(&pictures).enumerate() {
            assert_ne!(FONT.glyph_id(letter), GlyphId(0), "{letter}");
            assert!(picture.iter().sum::<f32>() > 0.8, "{letter}");
            assert!(!pictures[..i].contains(picture), "{letter}");
        }
        assert!(drawn(" ").iter().all(|share| *share == 0.0));
    }

    #[test]
    fn capitals_have_the_given_height_and_letters_their_own_widths() {
        let rows: Vec<f32> = drawn("H").chunks(60).map(|row| row.iter().sum()).collect();
        let inked = |y: usize| rows[y] > 0.0;
        assert!((8..17).all(inked) && !inked(7) && !inked(17), "{rows:?}");
        assert!(width("i", SIZE) < 0.5 * width("m", SIZE));
        // Letters under the arm of the other.
        assert!(width("To", SIZE) < width("T", SIZE) + width("o", SIZE));
        // Rounding of sums.
        assert!((width("Müller", 18.0) - 2.0 * width("Müller", SIZE)).abs() < 1e-3);
        assert_eq!(width("", SIZE), 0.0);
    }

    #[test]
    fn long_texts_keep_both_ends_and_fit() {
        let long = "größe Müller λ Ж_very_long_name_001.png";
        let mut last = 0;
        for most in 0..300 {
            let short = shortened(long, SIZE, most as f32);
            assert!(width(&short, SIZE) <= most as f32, "{most} {short}");
            let count = short.chars().count();
            assert!(count >= last, "{most} {short}");
            last = count;
            if count > 2 && short != long {
                let (head, tail) = short.split_once('…').unwrap();
                assert!(long.starts_with(head) && long.ends_with(tail), "{short}");
            }
        }
        assert_eq!(shortened(long, SIZE, 300.0), long);
        assert_eq!(shortened("abc", SIZE, 80.0), "abc");
        assert_eq!(shortened("abc", SIZE, 1.0), "");
    }

    #[test]
    fn pixels_left_of_the_picture_are_left_out() {
        let covered = |x: f32| {
            let mut count = 0;
            cover("größe", [x, 4.0], SIZE, |[x, _], _| {
                count += usize::from(x < 60);
            });
            count
        };
        assert_eq!(covered(-200.0), 0);
        assert!((1..covered(4.0)).contains(&covered(-10.0)));
    }
}
