//! Surfaces of triangles as letters: coordinates in 16 bits, and fewer triangles where there is little
//! room.

use std::collections::HashMap;

use levelset::bounds;
use shapespace_report::html::base64;

/// A surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mesh {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Numbers at the points, one list a quantity.
    pub values: Vec<Vec<f64>>,
}

/// A cube around surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cube {
    pub low: [f64; 3],
    pub side: f64,
}

/// Cells of the finest lattice: what 16 bits distinguish.
pub(super) const FINEST: u32 = u16::MAX as u32;

impl Cube {
    /// The cube around all points; none where they have no extent.
    pub fn around<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> Option<Self> {
        let points = meshes.into_iter().flat_map(|mesh| &mesh.points);
        let [low, high] = bounds(points.copied());
        let sides = [0, 1, 2].map(|k| high[k] - low[k]);
        let side = sides.into_iter().fold(0.0, f64::max);
        let low = [0, 1, 2].map(|k| low[k] - 0.5 * (side - sides[k]));
        (side > 0.0 && side.is_finite()).then_some(Self { low, side })
    }

    /// The cell of a lattice with this many cells a side.
    fn cell(&self, point: &[f64; 3], cells: u32) -> [u16; 3] {
        [0, 1, 2].map(|k| {
            let share = (point[k] - self.low[k]) / self.side;
            (share * f64::from(cells))
                .round()
                .clamp(0.0, f64::from(FINEST)) as u16
        })
    }
}

impl Mesh {
    /// The same with the points in each cell of a lattice as one, their mean, with the means of their
    /// numbers, and without the triangles that become lines.
    pub fn joined(&self, cube: &Cube, cells: u32) -> Self {
        let mut known: HashMap<[u16; 3], u32> = HashMap::with_capacity(self.points.len());
        let mut sums: Vec<([f64; 3], f64)> = Vec::new();
        let place = self.points.iter().map(|point| {
            let index = *known.entry(cube.cell(point, cells)).or_insert_with(|| {
                sums.push(([0.0; 3], 0.0));
                sums.len() as u32 - 1
            });
            let (sum, count) = &mut sums[index as usize];
            *sum = [0, 1, 2].map(|k| sum[k] + point[k]);
            *count += 1.0;
            index
        });
        let place: Vec<u32> = place.collect();
        let triangles = self.triangles.iter().filter_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| place.get(corner as usize));
            let [a, b, c] = [*a?, *b?, *c?];
            (a != b && b != c && c != a).then_some([a, b, c])
        });
        let values = self.values.iter().map(|values| {
            let mut means = vec![0.0; sums.len()];
            for (value, &index) in values.iter().zip(&place) {
                means[index as usize] += value / sums[index as usize].1;
            }
            means
        });
        Self {
            triangles: triangles.collect(),
            values: values.collect(),
            points: sums
                .into_iter()
                .map(|(sum, n)| sum.map(|x| x / n))
                .collect(),
        }
    }

    /// Bytes of the points with their numbers, and of the corners.
    pub fn bytes(&self) -> usize {
        let width = if self.is_wide() { 4 } else { 2 };
        let of_point = 6 + 2 * self.values.len();
        of_point * self.points.len() + 3 * width * self.triangles.len()
    }

    /// Whether the numbers of its points need 32 bits.
    pub fn is_wide(&self) -> bool {
        self.points.len() > usize::from(u16::MAX)
    }

    /// The points as letters, in units of the finest lattice.
    pub fn points_as_letters(&self, cube: &Cube) -> String {
        let cells = self.points.iter().flat_map(|p| cube.cell(p, FINEST));
        let bytes: Vec<u8> = cells.flat_map(u16::to_le_bytes).collect();
        base64(&bytes)
    }

    /// The corners of the triangles as letters, of 16 or 32 bits.
    pub fn corners_as_letters(&self) -> String {
        let corners = self.triangles.as_flattened().iter();
        let bytes: Vec<u8> = if self.is_wide() {
            corners.flat_map(|corner| corner.to_le_bytes()).collect()
        } else {
            corners
                .flat_map(|corner| (*corner as u16).to_le_bytes())
                .collect()
        };
        base64(&bytes)
    }
}

/// Shares as letters, in bytes: 0 below 0, and 1 to `levels` from 0 to 1.
pub(super) fn shares_as_letters(shares: &[f64], levels: u8) -> String {
    let level = |share: &f64| {
        if *share < 0.0 {
            0
        } else {
            // A share that is no number becomes the first level.
            1 + (share.min(1.0) * f64::from(levels - 1)).round() as u8
        }
    };
    base64(&shares.iter().map(level).collect::<Vec<u8>>())
}

/// Vectors as letters, in 16 bits, and the length of the unit.
pub(super) fn vectors_as_letters(vectors: &[[f64; 3]]) -> (String, f64) {
    let numbers = vectors.as_flattened();
    let most = numbers.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
    let unit = if most > 0.0 {
        most / f64::from(i16::MAX)
    } else {
        1.0
    };
    let bytes = numbers
        .iter()
        .map(|x| ((x / unit).round() as i16).to_le_bytes());
    (base64(&bytes.flatten().collect::<Vec<u8>>()), unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles with an edge in common, each with its own corners, as in STL files.
    fn square() -> Mesh {
        let corners = [
            [0.0, 0.0, 5.0],
            [2.0, 0.0, 5.0],
            [2.0, 2.0, 5.0],
            [0.0, 2.0, 5.0],
        ];
        let points = [0, 1, 2, 0, 2, 3].map(|i: usize| corners[i]).to_vec();
        Mesh {
            points,
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            values: vec![vec![1.0, 2.0, 3.0, 1.0, 5.0, 4.0]],
        }
    }

    #[test]
    fn equal_points_become_one_and_lines_vanish() {
        let cube = Cube::around([&square()]).unwrap();
        assert_eq!(
            cube,
            Cube {
                low: [0.0, 0.0, 4.0],
                side: 2.0
            }
        );
        let fine = square().joined(&cube, FINEST);
        assert_eq!(fine.points.len(), 4);
        assert_eq!(fine.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(fine.bytes(), 4 * 8 + 2 * 6);
        assert_eq!(fine.values, [[1.0, 2.0, 4.0, 4.0]]);
        let mut broken = square();
        broken.triangles.push([0, 1, 77]);
        assert_eq!(broken.joined(&cube, FINEST), fine);
        // All corners but one are rounded to two cells.
        let coarse = square().joined(&Cube { side: 8.0, ..cube }, 1);
        assert!(coarse.triangles.is_empty());
        assert_eq!(Cube::around([&Mesh::default()]), None);
    }

    #[test]
    fn coordinates_are_kept_to_16_bits() {
        let cube = Cube::around([&square()]).unwrap();
        let fine = square().joined(&cube, FINEST);
        // (0, 0, 1/2), (1, 0, 1/2), ... in units of 1/65535, little endian.
        assert!(
            fine.points_as_letters(&cube)
                .starts_with("AAAAAACA//8AAACA")
        );
        assert_eq!(fine.corners_as_letters(), "AAABAAIAAAACAAMA");
        // 0, 1, 3 and 5.
        assert_eq!(shares_as_letters(&[-0.1, 0.0, 0.5, 7.0], 5), "AAEDBQ==");
        let (letters, unit) = vectors_as_letters(&[[0.5, -0.5, 0.0]]);
        assert_eq!((letters.as_str(), unit), ("/38BgAAA", 0.5 / 32767.0));
    }
}
