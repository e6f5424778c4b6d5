//! Short labels in capitals, drawn as strokes: no font file is needed.

use super::{Canvas, Colour};

/// Glyphs on a grid of 5 x 7 points, `xy` digits with `y` down; a comma starts a new stroke.
const GLYPHS: &[(char, &str)] = &[
    ('A', "0602204246,0444"),
    ('B', "0006364544330300,3342413000"),
    ('C', "4130100105163645"),
    ('D', "00062644422000"),
    ('E', "40000646,0333"),
    ('F', "400006,0333"),
    ('G', "41301001051636454323"),
    ('H', "0006,4046,0343"),
    ('I', "1030,2026,1636"),
    ('J', "4045361605"),
    ('K', "0006,400346"),
    ('L', "000646"),
    ('M', "0600234046"),
    ('N', "06004640"),
    ('O', "103041453616050110"),
    ('P', "06003041423303"),
    ('Q', "103041453616050110,2446"),
    ('R', "06003041423303,2346"),
    ('S', "413010010213334445361605"),
    ('T', "0040,2026"),
    ('U', "000516364540"),
    ('V', "002640"),
    ('W', "0016233640"),
    ('X', "0046,4006"),
    ('Y', "002340,2326"),
    ('Z', "00400646"),
    ('0', "103041453616050110"),
    ('1', "112026,1636"),
    ('2', "01103041420646"),
    ('3', "004023334445361605"),
    ('4', "36300444"),
    ('5', "400003334445361605"),
    ('6', "30100105163645443303"),
    ('7', "004016"),
    ('8', "13334241301001021304051636454433"),
    ('9', "16364541301001021343"),
    ('-', "1333"),
    ('_', "0646"),
    ('.', "2526"),
    (',', "2517"),
    (':', "2122,2425"),
    ('/', "0640"),
    ('(', "30121436"),
    (')', "10323416"),
    ('+', "0343,2125"),
    ('=', "0242,0444"),
    ('^', "022042"),
    ('#', "1016,3036,0242,0444"),
];

/// Grid points from one character to the next.
const ADVANCE: f32 = 6.0;

/// Width of a text whose capitals have the given height.
pub(super) fn width(text: &str, height: f32) -> f32 {
    (text.chars().count() as f32 * ADVANCE - 2.0).max(0.0) * height / 6.0
}

/// The text shortened in its middle so that it is no wider than `most`.
pub(super) fn shortened(text: &str, height: f32, most: f32) -> String {
    let characters: Vec<char> = text.chars().collect();
    let fitting = ((6.0 * most / height + 2.0) / ADVANCE) as usize;
    if characters.len() <= fitting {
        return text.to_owned();
    }
    let kept = fitting.saturating_sub(2);
    let (head, tail) = (kept.div_ceil(2), kept / 2);
    let mut short: String = characters[..head].iter().collect();
    short.push_str("..");
    short.extend(&characters[characters.len() - tail..]);
    short
}

/// Draws a text from its upper left corner.
pub(super) fn draw(canvas: &mut Canvas, text: &str, corner: [f32; 2], height: f32, colour: Colour) {
    let unit = height / 6.0;
    let mut x = corner[0];
    for character in text.chars() {
        let capital = character.to_ascii_uppercase();
        let strokes = GLYPHS.iter().find(|(c, _)| *c == capital).map(|(_, s)| *s);
        for stroke in strokes.unwrap_or_default().split(',') {
            let points: Vec<[f32; 2]> = stroke
                .as_bytes()
                .chunks_exact(2)
                .map(|p| {
                    let at = |digit: u8| f32::from(digit - b'0') * unit;
                    [x + at(p[0]), corner[1] + at(p[1])]
                })
                .collect();
            canvas.line(&points, false, (0.17 * height).max(1.1), colour);
        }
        x += ADVANCE * unit;
    }
}

/// Draws a text centred on a point at the upper edge of the capitals.
pub(super) fn centred(
    canvas: &mut Canvas,
    text: &str,
    middle: [f32; 2],
    height: f32,
    most: f32,
    colour: Colour,
) {
    let text = shortened(text, height, most);
    let left = (middle[0] - 0.5 * width(&text, height)).round();
    draw(canvas, &text, [left, middle[1]], height, colour);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glyphs_are_points_of_the_grid() {
        for (character, strokes) in GLYPHS {
            for stroke in strokes.split(',') {
                assert!(stroke.len() >= 4 && stroke.len() % 2 == 0, "{character}");
                for point in stroke.as_bytes().chunks_exact(2) {
                    let inside =
                        (b'0'..=b'4').contains(&point[0]) && (b'0'..=b'7').contains(&point[1]);
                    assert!(inside, "{character}");
                }
            }
        }
    }

    #[test]
    fn long_texts_keep_both_ends() {
        let short = shortened("hippocampus_001_label", 9.0, 80.0);
        assert!(short.starts_with("hip") && short.ends_with("el"), "{short}");
        assert!(width(&short, 9.0) <= 80.0);
        assert_eq!(shortened("abc", 9.0, 80.0), "abc");
    }
}
