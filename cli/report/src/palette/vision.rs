//! Perceived differences of colours, for tests.

use super::Colour;

/// Normal vision, or one without one of the three cones.
#[derive(Clone, Copy, Debug)]
pub enum Sight {
    Normal,
    Protanopia,
    Deuteranopia,
    Tritanopia,
}

pub const SIGHTS: [Sight; 4] = [
    Sight::Normal,
    Sight::Protanopia,
    Sight::Deuteranopia,
    Sight::Tritanopia,
];

impl Sight {
    /// What linear red, green and blue look like: Machado, Oliveira and Fernandes (2009),
    /// severity 1.
    fn matrix(self) -> [[f64; 3]; 3] {
        match self {
            Self::Normal => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Protanopia => [
                [0.152286, 1.052583, -0.204868],
                [0.114503, 0.786281, 0.099216],
                [-0.003882, -0.048116, 1.051998],
            ],
            Self::Deuteranopia => [
                [0.367322, 0.860646, -0.227968],
                [0.280085, 0.672501, 0.047413],
                [-0.011820, 0.042940, 0.968881],
            ],
            Self::Tritanopia => [
                [1.255528, -0.076749, -0.178779],
                [-0.078411, 0.930809, 0.147602],
                [0.004733, 0.691367, 0.303900],
            ],
        }
    }
}

fn times(matrix: [[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| (0..3).map(|k| row[k] * x[k]).sum())
}

/// CIE `L*`, `a*`, `b*` under D65 of a colour under this vision.
pub fn lab(colour: Colour, sight: Sight) -> [f64; 3] {
    const XYZ: [[f64; 3]; 3] = [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ];
    let linear = colour.map(f64::from).map(|c| {
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    });
    let seen = times(sight.matrix(), linear).map(|c| c.clamp(0.0, 1.0));
    let (xyz, white) = (times(XYZ, seen), times(XYZ, [1.0; 3]));
    let f = [0, 1, 2].map(|k| {
        let t: f64 = xyz[k] / white[k];
        if t > (6.0f64 / 29.0).powi(3) {
            t.cbrt()
        } else {
            t * (29.0f64 / 6.0).powi(2) / 3.0 + 4.0 / 29.0
        }
    });
    [
        116.0 * f[1] - 16.0,
        500.0 * (f[0] - f[1]),
        200.0 * (f[1] - f[2]),
    ]
}

/// CIEDE2000 of two colours, as in Sharma, Wu and Dalal (2005), equations 2 to 22.
pub fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    // 1 without chroma, and nearly 0 with much of it.
    let seventh = |c: f64| (c.powi(7) / (c.powi(7) + 25f64.powi(7))).sqrt();
    let mean = |x: f64, y: f64| 0.5 * (x + y);
    let g = 0.5 * (1.0 - seventh(mean(a[1].hypot(a[2]), b[1].hypot(b[2]))));
    let polar = |[l, a, b]: [f64; 3]| {
        let a = (1.0 + g) * a;
        (l, a.hypot(b), b.atan2(a).to_degrees().rem_euclid(360.0))
    };
    let ((l1, c1, h1), (l2, c2, h2)) = (polar(a), polar(b));
    let grey = c1 * c2 == 0.0;
    let turn = (h2 - h1 + 180.0).rem_euclid(360.0) - 180.0;
    let hue_step = 2.0 * (c1 * c2).sqrt() * (turn.to_radians() / 2.0).sin();
    let hue = if grey {
        h1 + h2
    } else {
        (h1 + 0.5 * turn).rem_euclid(360.0)
    };
    let (light, chroma) = (mean(l1, l2), mean(c1, c2));
    let wave = |factor: f64, shift: f64| (factor * hue + shift).to_radians().cos();
    let t = 1.0 - 0.17 * wave(1.0, -30.0) + 0.24 * wave(2.0, 0.0) + 0.32 * wave(3.0, 6.0)
        - 0.20 * wave(4.0, -63.0);
    let away = (light - 50.0).powi(2);
    let light = (l2 - l1) / (1.0 + 0.015 * away / (20.0 + away).sqrt());
    let strong = (c2 - c1) / (1.0 + 0.045 * chroma);
    let turned = hue_step / (1.0 + 0.015 * chroma * t);
    let blue = 60.0 * (-((hue - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * seventh(chroma) * blue.to_radians().sin();
    (light * light + strong * strong + turned * turned + rotation * strong * turned).sqrt()
}

#[test]
fn differences_are_those_of_the_published_table() {
    // Pairs 1, 7, 16, 17, 20, 25 and 34 of Sharma, Wu and Dalal.
    for (a, b, expected) in [
        ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
        ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
        ([50.0, 2.5, 0.0], [50.0, 0.0, -2.5], 4.3065),
        ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
        ([50.0, 2.5, 0.0], [58.0, 24.0, 15.0], 19.4535),
        (
            [60.2574, -34.0099, 36.2677],
            [60.4626, -34.1751, 39.4387],
            1.2644,
        ),
        (
            [2.0776, 0.0795, -1.1350],
            [0.9033, -0.0636, -0.5514],
            0.9082,
        ),
    ] {
        // Four digits are published.
        assert!((difference(a, b) - expected).abs() < 5e-5, "{a:?} {b:?}");
    }
    let white = lab([1.0; 3], Sight::Normal);
    assert!((white[0] - 100.0).abs() < 1e-9 && white[1].abs() < 1e-9);
}
