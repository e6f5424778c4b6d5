//! Shaded views of surfaces: an own small rasteriser with a depth buffer.

use levelset::bounds;

use super::{Canvas, Colour, WHITE, mix};

/// Room around the disk of the bounds.
const MARGIN: f64 = 1.12;
/// Samples a pixel along each axis.
const SAMPLES: usize = 3;
/// Samples of a pixel show one surface where their depths differ by at most this, in samples: that of a slope of three.
const ONE_SURFACE: f64 = 6.0;

/// A surface of triangles.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Points.
    pub vertices: &'a [[f64; 3]],
    /// Corners of the triangles, counterclockwise as seen from outside.
    pub triangles: &'a [[usize; 3]],
}

/// Where the eye is, far away: angles in degrees about the `z` axis, which points up, and over
/// the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Angle from the `x` axis towards the `y` axis.
    pub azimuth: f64,
    /// Height over the horizon.
    pub elevation: f64,
}

/// The colour of a surface.
#[derive(Clone, Copy, Debug)]
pub enum Paint<'a> {
    /// One for all.
    Plain(Colour),
    /// One a vertex, mixed on the triangles.
    Vertices(&'a [Colour]),
}

impl Paint<'_> {
    /// The colour of a vertex; vertices that have none are white.
    fn of(self, vertex: usize) -> Colour {
        match self {
            Self::Plain(colour) => colour,
            Self::Vertices(colours) => colours.get(vertex).copied().unwrap_or(WHITE),
        }
    }
}

/// A surface with a colour at every vertex, or with none.
#[derive(Clone, Copy, Debug)]
pub struct PaintedSurface<'a> {
    /// The surface.
    pub surface: Surface<'a>,
    /// Of every vertex; empty where the surface has one colour that its picture chooses.
    pub colours: &'a [Colour],
}

impl<'a> PaintedSurface<'a> {
    /// A surface without colours of its own.
    pub fn plain(surface: Surface<'a>) -> Self {
        Self {
            surface,
            colours: &[],
        }
    }

    /// Its paint, with a colour for a surface that has none.
    pub fn paint(&self, plain: Colour) -> Paint<'a> {
        if self.colours.is_empty() {
            Paint::Plain(plain)
        } else {
            Paint::Vertices(self.colours)
        }
    }
}

/// A ball that is shown as the largest disk of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its middle.
    pub centre: [f64; 3],
    /// Its radius.
    pub radius: f64,
}

impl Bounds {
    /// A ball whose disk just covers the square around the projection of the surfaces.
    pub fn around<'a>(view: View, surfaces: impl IntoIterator<Item = Surface<'a>>) -> Self {
        let axes = view.axes();
        let vertices = surfaces.into_iter().flat_map(|s| s.vertices);
        let [low, high] = bounds(vertices.map(|vertex| axes.map(|axis| dot(axis, *vertex))));
        if low[0] > high[0] {
            return Self {
                centre: [0.5; 3],
                radius: 0.5,
            };
        }
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (low[k] + high[k]));
        Self {
            centre: std::array::from_fn(|c| (0..3).map(|k| middle[k] * axes[k][c]).sum()),
            radius: (0.5 * (high[0] - low[0]).max(high[1] - low[1])).max(1e-9),
        }
    }
}

impl View {
    /// From this height, a little from the left: where there is no reason to look from elsewhere.
    pub fn front(elevation: f64) -> Self {
        Self {
            azimuth: -60.0,
            elevation,
        }
    }

    /// From this height, the side with the largest projection of a surface: the direction, in steps
    /// of 15 degrees, in which it has the largest shadow (each part counted as often as a ray
    /// crosses it).
    pub fn broadside(surface: Surface<'_>, elevation: f64) -> Self {
        let towards = |azimuth: f64| Self { azimuth, elevation };
        let shadow = |view: Self| -> f64 {
            let [_, _, eye] = view.axes();
            surface.area_vectors().map(|n| dot(n, eye).abs()).sum()
        };
        // Opposite sides have nearly the same shadow; the front is where y is small.
        let views = (0..12).map(|k| towards(f64::from(k).mul_add(15.0, -165.0)));
        views
            .map(|view| (shadow(view), view))
            .reduce(|best, next| if next.0 > best.0 { next } else { best })
            .map_or(Self::front(elevation), |(_, view)| view)
    }

    /// The view from an angle further to the right.
    pub fn turned(self, angle: f64) -> Self {
        Self {
            azimuth: self.azimuth + angle,
            ..self
        }
    }

    /// Right, up and towards the eye.
    fn axes(self) -> [[f64; 3]; 3] {
        let (sa, ca) = self.azimuth.to_radians().sin_cos();
        let (se, ce) = self.elevation.to_radians().sin_cos();
        [
            [-sa, ca, 0.0],
            [-se * ca, -se * sa, ce],
            [ce * ca, ce * sa, se],
        ]
    }
}

impl Surface<'_> {
    /// A square picture of the surface on white.
    pub fn render(&self, view: View, bounds: Bounds, paint: Paint<'_>, side: usize) -> Canvas {
        let buffer = self.rasterise(view, bounds, paint, side * SAMPLES);
        let mut canvas = Canvas::new(side, side);
        for y in 0..side {
            for x in 0..side {
                canvas.blend(x, y, buffer.pixel(x, y), 1.0);
            }
        }
        canvas
    }

    fn rasterise(&self, view: View, bounds: Bounds, paint: Paint<'_>, side: usize) -> Buffer {
        let axes = view.axes();
        let scale = 0.5 * side as f64 / (MARGIN * bounds.radius);
        let turned = |v: [f64; 3]| axes.map(|axis| dot(axis, v));
        let corners: Vec<[f64; 3]> = self
            .vertices
            .iter()
            .map(|&vertex| {
                let [x, y, z] = turned(sub(vertex, bounds.centre));
                let half = 0.5 * side as f64;
                [half + scale * x, half - scale * y, scale * z]
            })
            .collect();
        let normals: Vec<[f64; 3]> = self.normals().into_iter().map(turned).collect();
        let mut buffer = Buffer::new(side);
        for triangle in self.triangles {
            if triangle.iter().all(|&v| v < corners.len()) {
                buffer.add(Facet {
                    corners: triangle.map(|v| corners[v]),
                    normals: triangle.map(|v| normals[v].map(|x| x as f32)),
                    colours: triangle.map(|v| paint.of(v)),
                });
            }
        }
        buffer
    }

    /// Normals of the triangles that have all their corners, twice their area long.
    fn area_vectors(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let whole = |t: &&[usize; 3]| t.iter().all(|&v| v < self.vertices.len());
        self.triangles.iter().filter(whole).map(|triangle| {
            let [a, b, c] = triangle.map(|v| self.vertices[v]);
            cross(sub(b, a), sub(c, a))
        })
    }

    /// Normals at the vertices: means of those of the triangles, weighted by area.
    fn normals(&self) -> Vec<[f64; 3]> {
        let mut normals = vec![[0.0; 3]; self.vertices.len()];
        for triangle in self.triangles {
            if triangle.iter().any(|&v| v >= normals.len()) {
                continue;
            }
            let [a, b, c] = triangle.map(|v| self.vertices[v]);
            let normal = cross(sub(b, a), sub(c, a));
            for &v in triangle {
                normals[v] = std::array::from_fn(|k| normals[v][k] + normal[k]);
            }
        }
        normals
    }
}

/// A triangle in the picture: positions in samples with the depth towards the eye, and normals in the same axes.
struct Facet {
    corners: [[f64; 3]; 3],
    normals: [[f32; 3]; 3],
    colours: [Colour; 3],
}

impl Facet {
    /// The barycentric coordinates at the origin of the picture, and their derivatives along `x` and `y`; `None` for
    /// a triangle that is seen from its side.
    fn coordinates(&self) -> Option<[[f64; 3]; 3]> {
        let [a, b, c] = self.corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area.abs() <= 1e-12 {
            return None;
        }
        let part = |p: [f64; 3], q: [f64; 3]| {
            [
                (p[0] * q[1] - p[1] * q[0]) / area,
                (p[1] - q[1]) / area,
                (q[0] - p[0]) / area,
            ]
        };
        Some([part(b, c), part(c, a), part(a, b)])
    }

    /// Its colour in the light at a point of the picture.
    fn shade(&self, [x, y]: [f64; 2]) -> Colour {
        let weights = self.coordinates().map_or([1.0 / 3.0; 3], |parts| {
            parts.map(|[at, along_x, along_y]| (at + along_x * x + along_y * y) as f32)
        });
        let mean = |values: [[f32; 3]; 3]| {
            std::array::from_fn(|c| (0..3).map(|k| weights[k] * values[k][c]).sum())
        };
        lit(mean(self.normals), mean(self.colours))
    }
}

/// The nearest triangle at every sample, and its depth.
struct Buffer {
    side: usize,
    facets: Vec<Facet>,
    depth: Vec<f64>,
    nearest: Vec<u32>,
}

impl Buffer {
    fn new(side: usize) -> Self {
        Self {
            side,
            facets: Vec::new(),
            depth: vec![f64::NEG_INFINITY; side * side],
            nearest: vec![0; side * side],
        }
    }

    fn add(&mut self, facet: Facet) {
        let Some(parts) = facet.coordinates() else {
            return;
        };
        let side = self.side as f64;
        let rows = {
            let ys = facet.corners.map(|p| p[1]);
            let low = ys.iter().copied().fold(f64::INFINITY, f64::min);
            let high = ys.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (low - 0.5).clamp(0.0, side) as usize..(high + 0.5).clamp(0.0, side) as usize
        };
        let number = self.facets.len() as u32;
        for j in rows {
            let y = j as f64 + 0.5;
            // The coordinates along this row, at the middle of its first sample, and the samples where none of
            // them is negative; those at both ends are looked at once more, for rounding.
            let row = parts.map(|[at, along_x, along_y]| at + along_y * y + along_x * 0.5);
            let (mut first, mut end) = (0.0, side);
            for (at, [_, slope, _]) in row.iter().zip(&parts) {
                let root = -at / slope;
                if *slope > 0.0 {
                    first = root.max(first);
                } else if *slope < 0.0 {
                    end = (root + 1.0).min(end);
                } else if *at < 0.0 {
                    end = 0.0;
                }
            }
            let (first, end) = (first.floor() as usize, end.ceil() as usize);
            for i in first..end.min(self.side) {
                let weights: [f64; 3] = std::array::from_fn(|k| row[k] + parts[k][1] * i as f64);
                if weights.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let depth: f64 = (0..3).map(|k| weights[k] * facet.corners[k][2]).sum();
                let at = j * self.side + i;
                if depth > self.depth[at] {
                    self.depth[at] = depth;
                    self.nearest[at] = number;
                }
            }
        }
        self.facets.push(facet);
    }

    /// The mean of the samples of a pixel. Where they show one surface it is lit at the middle one alone.
    fn pixel(&self, x: usize, y: usize) -> Colour {
        let samples: [[usize; 2]; SAMPLES * SAMPLES] =
            std::array::from_fn(|k| [x * SAMPLES + k % SAMPLES, y * SAMPLES + k / SAMPLES]);
        let depths = samples.map(|[i, j]| self.depth[j * self.side + i]);
        let low = depths.into_iter().fold(f64::INFINITY, f64::min);
        let high = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if high == f64::NEG_INFINITY {
            WHITE
        } else if high - low <= ONE_SURFACE {
            self.shade(samples[SAMPLES * SAMPLES / 2])
        } else {
            let sum = samples.into_iter().fold([0.0; 3], |sum, sample| {
                let colour = self.shade(sample);
                std::array::from_fn(|c| sum[c] + colour[c])
            });
            sum.map(|c| c / (SAMPLES * SAMPLES) as f32)
        }
    }

    /// The colour of a sample.
    fn shade(&self, [i, j]: [usize; 2]) -> Colour {
        let at = j * self.side + i;
        if self.depth[at] == f64::NEG_INFINITY {
            return WHITE;
        }
        self.facets[self.nearest[at] as usize].shade([i as f64 + 0.5, j as f64 + 0.5])
    }
}

/// A surface of a colour in a soft light from above left and a weaker one from the right, with sky light, a faint
/// highlight and darker rims (Blinn 1977).
fn lit(n: [f32; 3], colour: Colour) -> Colour {
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt().max(1e-30);
    // Surfaces are lit from both sides, so that a wrong orientation is no black hole.
    let side = if n[2] < 0.0 { -length } else { length };
    let n = n.map(|x| x / side);
    let against = |l: [f32; 3]| (n[0] * l[0] + n[1] * l[1] + n[2] * l[2]).max(0.0);
    let diffuse = 0.42
        + 0.10 * n[1]
        + 0.52 * against([-0.40, 0.56, 0.73])
        + 0.16 * against([0.80, 0.10, 0.59]);
    // Half way between the first light and the eye.
    let highlight = 0.22 * against([-0.215, 0.301, 0.929]).powi(40);
    let rim = 0.25 * (1.0 - n[2]).powi(3);
    let shaded = colour.map(|c| (c * diffuse * (1.0 - rim)).min(1.0));
    mix(shaded, WHITE, highlight)
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::INK;
    use super::*;

    /// Vertices and triangles of the surface `|x - 1/2| = radius(direction)`.
    pub fn star_surface(
        radius: impl Fn([f64; 3]) -> f64,
        n: usize,
    ) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
        let (rows, columns) = (n, 2 * n);
        let mut vertices = Vec::new();
        for j in 0..=rows {
            for i in 0..columns {
                let polar = std::f64::consts::PI * j as f64 / rows as f64;
                let (sa, ca) = (std::f64::consts::PI * i as f64 / n as f64).sin_cos();
                let d = [polar.sin() * ca, polar.sin() * sa, polar.cos()];
                vertices.push(d.map(|x| 0.5 + radius(d) * x));
            }
        }
        let mut triangles = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                let at = |i: usize, j: usize| j * columns + i % columns;
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
        (vertices, triangles)
    }

    #[test]
    fn a_ball_is_a_disk_of_the_right_size_brightest_at_the_upper_left() {
        let (vertices, triangles) = star_surface(|_| 0.25, 48);
        let ball = Surface {
            vertices: &vertices,
            triangles: &triangles,
        };
        let bounds = Bounds {
            centre: [0.5; 3],
            radius: 0.5,
        };
        let view = View {
            azimuth: 30.0,
            elevation: 20.0,
        };
        let canvas = ball.render(view, bounds, Paint::Plain([0.2, 0.4, 0.7]), 120);
        let covered = (0..120 * 120)
            .filter(|k| canvas.pixel(k % 120, k / 120)[0] < 0.99)
            .count() as f64;
        let radius = 60.0 * 0.25 / (MARGIN * 0.5);
        // Pixels partly covered count as well: half a pixel of rim.
        let most = std::f64::consts::PI * (radius + 1.0f64).powi(2);
        let least = std::f64::consts::PI * (radius - 0.5f64).powi(2);
        assert!(
            covered > least && covered < most,
            "{covered} {least} {most}"
        );
        let bright = canvas.pixel(52, 50)[2];
        assert!(bright > canvas.pixel(78, 74)[2] + 0.1);
    }

    #[test]
    fn the_nearer_surface_hides_the_farther() {
        let vertices = [
            [0.2, -1.0, -1.0],
            [0.2, 1.0, -1.0],
            [0.2, 0.0, 1.0],
            [-0.2, -1.0, -1.0],
            [-0.2, 1.0, -1.0],
            [-0.2, 0.0, 1.0],
        ];
        // Seen from +x; the second triangle is turned, so that its normal differs.
        let surface = Surface {
            vertices: &vertices,
            triangles: &[[3, 4, 5], [0, 1, 2]],
        };
        let bounds = Bounds {
            centre: [0.0; 3],
            radius: 1.5,
        };
        let buffer = surface.rasterise(
            View {
                azimuth: 0.0,
                elevation: 0.0,
            },
            bounds,
            Paint::Vertices(&[WHITE, WHITE, WHITE, INK, INK, INK]),
            60,
        );
        let middle = buffer.depth[30 * 60 + 30];
        assert!(
            (middle - 0.2 * 30.0 / (1.5 * MARGIN)).abs() < 1e-9,
            "{middle}"
        );
        assert_eq!(
            buffer.facets[buffer.nearest[30 * 60 + 30] as usize].colours,
            [WHITE; 3]
        );
    }
}
