//! The orientation that a camera states for its picture, in the metadata of EXIF.

use super::{Numbers, Pixels};

/// The tag of the orientation, and of a number of two bytes.
const ORIENTATION: u16 = 0x0112;
const SHORT: u16 = 3;
/// Bytes of an entry of a directory.
const ENTRY: usize = 12;

/// How a stored picture is turned or reflected to be seen upright.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Orientation {
    /// Whether the axes are exchanged, after the reflections.
    swaps: bool,
    /// Whether each stored axis is reversed, `x` first.
    reverses: [bool; 2],
}

impl Orientation {
    /// That of a number from 1, upright, to 8.
    fn of_number(number: u16) -> Option<Self> {
        let (swaps, reverses) = match number {
            1 => (false, [false, false]),
            2 => (false, [true, false]),
            3 => (false, [true, true]),
            4 => (false, [false, true]),
            5 => (true, [false, false]),
            6 => (true, [false, true]),
            7 => (true, [true, true]),
            8 => (true, [true, false]),
            _ => return None,
        };
        Some(Self { swaps, reverses })
    }

    /// That which EXIF metadata state, from the header of a TIFF file on; upright where they state none.
    pub fn of_exif(bytes: &[u8]) -> Self {
        let number = stated(bytes).unwrap_or(1);
        let upright = Self {
            swaps: false,
            reverses: [false; 2],
        };
        Self::of_number(number).unwrap_or(upright)
    }

    /// The picture as it is to be seen.
    pub fn upright(self, pixels: Pixels) -> Pixels {
        if !self.swaps && self.reverses == [false; 2] {
            return pixels;
        }
        let channels = pixels.channels;
        let [width, height] = pixels.size;
        let size = if self.swaps {
            [height, width]
        } else {
            [width, height]
        };
        let stored = |index: usize| {
            let (x, y) = (index % size[0], index / size[0]);
            let [x, y] = if self.swaps { [y, x] } else { [x, y] };
            let [x, y] = [(x, width), (y, height)].map(|(i, n)| [i, n - 1 - i]);
            let [back, down] = self.reverses.map(usize::from);
            channels * (x[back] + width * y[down])
        };
        let places = || (0..width * height).map(stored);
        let numbers = match &pixels.numbers {
            Numbers::Bytes(all) => Numbers::Bytes(
                places()
                    .flat_map(|p| &all[p..p + channels])
                    .copied()
                    .collect(),
            ),
            Numbers::Words(all) => Numbers::Words(
                places()
                    .flat_map(|p| &all[p..p + channels])
                    .copied()
                    .collect(),
            ),
        };
        Pixels {
            size,
            numbers,
            ..pixels
        }
    }
}

/// The number of the orientation in the first directory of metadata.
fn stated(bytes: &[u8]) -> Option<u16> {
    let is_little = match bytes.get(..2)? {
        b"II" => true,
        b"MM" => false,
        _ => return None,
    };
    let short = |place: usize| -> Option<u16> {
        let two = bytes.get(place..place.checked_add(2)?)?.try_into().ok()?;
        Some(if is_little {
            u16::from_le_bytes(two)
        } else {
            u16::from_be_bytes(two)
        })
    };
    let long = |place: usize| -> Option<usize> {
        let two = [short(place)?, short(place + 2)?].map(usize::from);
        let [low, high] = if is_little { two } else { [two[1], two[0]] };
        Some(low | high << 16)
    };
    let directory = long(4)?;
    let count = usize::from(short(directory)?);
    let entries = (0..count).map(|k| directory + 2 + ENTRY * k);
    for entry in entries {
        if short(entry)? == ORIENTATION && short(entry + 2)? == SHORT {
            return short(entry + 8);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Metadata with one other entry and the orientation, in either order of bytes.
    pub(crate) fn exif(number: u16, is_little: bool) -> Vec<u8> {
        let short = |x: u16| {
            if is_little {
                x.to_le_bytes()
            } else {
                x.to_be_bytes()
            }
        };
        let long = |x: u32| {
            if is_little {
                x.to_le_bytes()
            } else {
                x.to_be_bytes()
            }
        };
        let mut bytes = if is_little {
            b"II".to_vec()
        } else {
            b"MM".to_vec()
        };
        bytes.extend(short(42));
        bytes.extend(long(8));
        bytes.extend(short(2));
        for (tag, value) in [(0x0100, 7), (ORIENTATION, number)] {
            bytes.extend([short(tag), short(SHORT)].concat());
            bytes.extend(long(1));
            bytes.extend([short(value), short(0)].concat());
        }
        bytes.extend(long(0));
        bytes
    }

    #[test]
    fn orientations_turn_the_picture() {
        // Three pixels in two rows.
        let stored = Pixels {
            size: [3, 2],
            channels: 1,
            numbers: Numbers::Bytes(b"abcdef".to_vec()),
            palette: Vec::new(),
        };
        let upright = [
            (1, "abc def"),
            (2, "cba fed"),
            (3, "fed cba"),
            (4, "def abc"),
            (5, "ad be cf"),
            (6, "da eb fc"),
            (7, "fc eb da"),
            (8, "cf be ad"),
            (9, "abc def"),
        ];
        for (number, expected) in upright {
            for is_little in [true, false] {
                let orientation = Orientation::of_exif(&exif(number, is_little));
                let turned = orientation.upright(Pixels {
                    numbers: Numbers::Bytes(b"abcdef".to_vec()),
                    palette: Vec::new(),
                    ..stored
                });
                let Numbers::Bytes(bytes) = turned.numbers else {
                    panic!("bytes")
                };
                let rows: Vec<&[u8]> = bytes.chunks(turned.size[0]).collect();
                assert_eq!(String::from_utf8(rows.join(&b' ')).unwrap(), expected);
            }
        }
    }

    #[test]
    fn colours_stay_together() {
        let turned = Orientation::of_number(2).unwrap().upright(Pixels {
            size: [2, 1],
            channels: 3,
            numbers: Numbers::Words(vec![1, 2, 3, 4, 5, 6]),
            palette: Vec::new(),
        });
        assert_eq!(turned.numbers, Numbers::Words(vec![4, 5, 6, 1, 2, 3]));
    }

    #[test]
    fn damaged_metadata_state_nothing() {
        let whole = exif(6, true);
        let plain = Orientation::of_exif(b"");
        for end in 0..whole.len() - 9 {
            assert_eq!(Orientation::of_exif(&whole[..end]), plain, "{end}");
        }
        let mut far = whole.clone();
        far[4..8].fill(0xff);
        assert_eq!(Orientation::of_exif(&far), plain);
        assert_ne!(Orientation::of_exif(&whole), plain);
    }
}
