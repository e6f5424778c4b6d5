//! Polygons, and their triangles.

use super::Mesh;

/// More corners than this has no polygon.
const MOST_CORNERS: usize = 1000;

/// Polygons with common points, not checked yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygons {
    pub points: Vec<[f64; 3]>,
    /// The corners of all polygons, one after the other.
    corners: Vec<u32>,
    /// Where each polygon ends among them.
    ends: Vec<usize>,
}

impl Polygons {
    /// Adds a corner to the polygon that is not ended yet.
    pub fn corner(&mut self, point: u32) {
        self.corners.push(point);
    }

    /// Ends a polygon.
    pub fn end(&mut self) {
        self.ends.push(self.corners.len());
    }

    /// Adds a polygon.
    pub fn polygon(&mut self, corners: &[u32]) {
        self.corners.extend_from_slice(corners);
        self.end();
    }

    /// Adds a strip of triangles.
    pub fn strip(&mut self, corners: &[u32]) {
        for (number, three) in corners.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1], three[2]];
            self.polygon(&if number % 2 == 0 {
                [a, b, c]
            } else {
                [b, a, c]
            });
        }
    }

    /// All polygons as triangles.
    pub fn triangulated(self) -> Result<Mesh, String> {
        let finite = |p: &[f64; 3]| p.iter().all(|x| x.abs() <= LONGEST);
        if let Some(point) = self.points.iter().position(|p| !finite(p)) {
            let place = self.points[point];
            return Err(format!("point {point} lies at {place:?}"));
        }
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut first = 0;
        for (number, &end) in self.ends.iter().enumerate() {
            let corners = &self.corners[first..end];
            first = end;
            let count = self.points.len();
            if let Some(missing) = corners.iter().find(|&&c| c as usize >= count) {
                return Err(format!(
                    "polygon {number} names point {missing}, and there are {count}"
                ));
            }
            if !(3..=MOST_CORNERS).contains(&corners.len()) {
                let n = corners.len();
                return Err(format!("polygon {number} has {n} corners"));
            }
            cut(&self.points, corners, &mut triangles);
        }
        if triangles.is_empty() {
            return Err("it has no triangles".into());
        }
        Ok(Mesh {
            points: self.points,
            triangles,
        })
    }
}

/// Coordinates beyond this, in millimetres, are damage.
const LONGEST: f64 = 1e9;

/// Cuts a polygon into triangles, ear by ear: a corner is cut off where it turns as the polygon does
/// and no other corner lies in its triangle. Meisters, *Polygons have ears* (1975).
fn cut(points: &[[f64; 3]], corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [a, b, c] = *corners {
        triangles.push([a, b, c]);
        return;
    }
    let at = |c: u32| points[c as usize];
    let normal = newell(corners.iter().map(|&c| at(c)));
    // The plane of the two axes along which the polygon is widest.
    let axis = (0..3)
        .max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))
        .unwrap_or(2);
    let [u, v] = if normal[axis] < 0.0 {
        [(axis + 2) % 3, (axis + 1) % 3]
    } else {
        [(axis + 1) % 3, (axis + 2) % 3]
    };
    let flat = |c: u32| [at(c)[u], at(c)[v]];
    let mut left = corners.to_vec();
    while left.len() > 3 {
        let n = left.len();
        let is_ear = |&i: &usize| {
            let ear = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let [a, b, c] = ear.map(flat);
            let inside =
                |p: [f64; 2]| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            let others = left.iter().filter(|other| !ear.contains(other));
            turn(a, b, c) > 0.0 && !others.into_iter().any(|&other| inside(flat(other)))
        };
        // A polygon that crosses itself, or has no area, may have no ear.
        let i = (0..n).find(is_ear).unwrap_or(0);
        triangles.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    triangles.push([left[0], left[1], left[2]]);
}

/// Twice the area of a polygon, as a vector along its normal.
fn newell(points: impl Iterator<Item = [f64; 3]> + Clone) -> [f64; 3] {
    let next = points.clone().cycle().skip(1);
    points.zip(next).fold([0.0; 3], |sum, (p, q)| {
        std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            sum[k] + (p[i] - q[i]) * (p[j] + q[j])
        })
    })
}

/// Twice the signed area of a triangle in the plane.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_notched_polygon_is_cut_into_triangles_that_turn_as_it_does() {
        // An L in each of the three planes, in both senses.
        let outline = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]];
        for plane in 0..3 {
            for reverse in [false, true] {
                let mut polygons = Polygons::default();
                for [u, v] in outline {
                    let mut p = [0.5; 3];
                    p[plane] = f64::from(u);
                    p[(plane + 1) % 3] = f64::from(v);
                    polygons.points.push(p);
                }
                let mut corners = [0, 1, 2, 3, 4, 5];
                if reverse {
                    corners.reverse();
                }
                polygons.polygon(&corners);
                let mesh = polygons.triangulated().unwrap();
                assert_eq!(mesh.triangles.len(), 4);
                for triangle in &mesh.triangles {
                    let area = newell(triangle.iter().map(|&c| mesh.points[c as usize]));
                    let along = area[(plane + 2) % 3];
                    assert!(if reverse { along < 0.0 } else { along > 0.0 }, "{area:?}");
                }
                let whole = newell(corners.iter().map(|&c| mesh.points[c as usize]));
                assert_eq!(whole[(plane + 2) % 3].abs(), 8.0);
            }
        }
    }
}
