//! Views of shapes of either dimension: flat shapes as filled curves, solid shapes as
//! shaded surfaces.

use std::any::Any;

use levelset::Contour;

use super::{Bounds, Canvas, Colour, Curve, Paint, Surface, View, Window, solid, tint};

/// Elevation of the view, in degrees.
const ELEVATION: f64 = 22.0;
/// Width of an outline in pixels.
const LINE: f32 = 1.6;

/// A shape to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// The curves around a shape in 2D.
    Flat(Vec<Curve>),
    /// The surface of a shape in 3D.
    Solid {
        /// Points.
        vertices: Vec<[f64; 3]>,
        /// Corners of the triangles, counterclockwise as seen from outside.
        triangles: Vec<[usize; 3]>,
    },
}

impl Shape {
    /// The shape inside a boundary in two or three dimensions.
    pub fn of<const D: usize>(contour: &Contour<D>) -> Self {
        const { assert!(D == 2 || D == 3) };
        let contour: &dyn Any = contour;
        if let Some(solid) = contour.downcast_ref::<Contour<3>>() {
            let corners = solid.simplices().iter();
            return Self::Solid {
                vertices: solid.points().to_vec(),
                triangles: corners.map(|c| c.map(|corner| corner as usize)).collect(),
            };
        }
        let flat = contour.downcast_ref::<Contour<2>>();
        let lines = flat.into_iter().flat_map(Contour::polylines);
        let curve = |line: levelset::Polyline| Curve {
            points: line.points,
            closed: line.closed,
        };
        Self::Flat(lines.map(curve).collect())
    }

    /// The curves of a flat shape.
    pub fn curves(&self) -> &[Curve] {
        match self {
            Self::Flat(curves) => curves,
            Self::Solid { .. } => &[],
        }
    }

    /// The closed curves of a flat shape.
    pub fn closed_curves(&self) -> Vec<&[[f64; 2]]> {
        match self {
            Self::Flat(curves) => {
                let closed = curves.iter().filter(|curve| curve.closed);
                closed.map(|curve| curve.points.as_slice()).collect()
            }
            Self::Solid { .. } => Vec::new(),
        }
    }

    /// The surface of a solid shape.
    pub fn surface(&self) -> Surface<'_> {
        match self {
            Self::Flat(_) => Surface {
                vertices: &[],
                triangles: &[],
            },
            Self::Solid {
                vertices,
                triangles,
            } => Surface {
                vertices,
                triangles,
            },
        }
    }
}

/// Solid shapes as one, with the colour of each at all of its vertices; flat ones as all of their curves.
pub fn joined(parts: &[(Shape, Colour)]) -> (Shape, Vec<Colour>) {
    let (mut vertices, mut triangles, mut colours) = (Vec::new(), Vec::new(), Vec::new());
    let mut curves = Vec::new();
    for (part, colour) in parts {
        curves.extend_from_slice(part.curves());
        let (first, surface) = (vertices.len(), part.surface());
        vertices.extend_from_slice(surface.vertices);
        triangles.extend(
            surface
                .triangles
                .iter()
                .map(|t| t.map(|corner| first + corner)),
        );
        colours.resize(vertices.len(), solid(*colour));
    }
    if vertices.is_empty() {
        return (Shape::Flat(curves), colours);
    }
    let shape = Shape::Solid {
        vertices,
        triangles,
    };
    (shape, colours)
}

/// A view of shapes of one dimension.
#[derive(Clone, Copy, Debug)]
pub enum Camera {
    /// Part of the plane.
    Flat(Window),
    /// View of space, in pictures of this side.
    Solid(View, Bounds, usize),
}

impl Camera {
    /// Shows all these shapes in pictures of this width; solid ones from the broad side of the
    /// first.
    pub fn around(shapes: &[Shape], width: usize) -> Self {
        let Some(first @ Shape::Solid { .. }) = shapes.first() else {
            return Self::Flat(Window::around(shapes.iter().flat_map(Shape::curves), width));
        };
        let view = View::broadside(first.surface(), ELEVATION);
        let bounds = Bounds::around(view, shapes.iter().map(Shape::surface));
        Self::Solid(view, bounds, width)
    }

    /// The same with this many pixels along the longer side.
    pub fn with_longer_side(self, pixels: usize) -> Self {
        match self {
            Self::Flat(window) => Self::Flat(window.with_longer_side(pixels)),
            Self::Solid(view, bounds, _) => Self::Solid(view, bounds, pixels),
        }
    }

    /// A shape in one colour.
    pub fn portrait(&self, shape: &Shape, colour: Colour) -> Canvas {
        self.drawn(shape, tint(colour), LINE, colour)
    }

    /// A shape in one colour; `fill` and the width of the outline are those of flat shapes.
    pub fn drawn(&self, shape: &Shape, fill: Colour, width: f32, colour: Colour) -> Canvas {
        match *self {
            Self::Flat(window) => {
                let mut canvas = window.canvas();
                window.fill(&mut canvas, shape.curves(), fill);
                window.outline(&mut canvas, shape.curves(), width, colour);
                canvas
            }
            Self::Solid(view, bounds, side) => {
                let paint = Paint::Plain(solid(colour));
                shape.surface().render(view, bounds, paint, side)
            }
        }
    }

    /// The components of a shape, each in its colour.
    pub fn parts(&self, parts: &[(Shape, Colour)]) -> Canvas {
        match *self {
            Self::Flat(_) => {
                let mut canvas = self.blank();
                for (part, colour) in parts {
                    self.draw_over(&mut canvas, part, *colour);
                }
                canvas
            }
            Self::Solid(view, bounds, side) => {
                let (shape, colours) = joined(parts);
                let paint = Paint::Vertices(&colours);
                shape.surface().render(view, bounds, paint, side)
            }
        }
    }

    /// A shape with a colour at every point: of the area of a flat shape, which gets an outline, and
    /// of the surface of a solid one.
    pub fn shaded(
        &self,
        shape: &Shape,
        outline: Colour,
        shade: impl Fn(&[f64]) -> Colour,
    ) -> Canvas {
        match *self {
            Self::Flat(window) => {
                let mut canvas = window.canvas();
                window.paint(&mut canvas, shape.curves(), |p| shade(&p));
                window.outline(&mut canvas, shape.curves(), 1.0, outline);
                canvas
            }
            Self::Solid(view, bounds, side) => {
                let surface = shape.surface();
                let colours: Vec<Colour> = surface.vertices.iter().map(|p| shade(p)).collect();
                surface.render(view, bounds, Paint::Vertices(&colours), side)
            }
        }
    }

    /// Draws a flat shape over a picture, or replaces the picture by that of a solid shape.
    pub fn draw_over(&self, canvas: &mut Canvas, shape: &Shape, colour: Colour) {
        match self {
            Self::Flat(window) => {
                window.fill(canvas, shape.curves(), tint(colour));
                window.outline(canvas, shape.curves(), LINE, colour);
            }
            Self::Solid(..) => *canvas = self.portrait(shape, colour),
        }
    }

    /// Draws the outline of a flat shape over a picture.
    pub fn outline_over(&self, canvas: &mut Canvas, shape: &Shape, colour: Colour) {
        if let Self::Flat(window) = self {
            window.outline(canvas, shape.curves(), 1.0, colour);
        }
    }

    /// A white picture.
    pub fn blank(&self) -> Canvas {
        match *self {
            Self::Flat(window) => window.canvas(),
            Self::Solid(_, _, side) => Canvas::new(side, side),
        }
    }
}
