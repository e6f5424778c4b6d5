//! The pictures of a geodesic, and its surfaces in 3D.

use fe_grid::parallel;
use levelset::Contour;

use super::path::Path;
use crate::error::CliError;
use crate::output::stl::write_surface;
use crate::output::{ResultDir, numbered};
use crate::picture::{
    Bounds, Canvas, Colour, Curve, FilmStrip, INK, Paint, View, Window, colour, heat, solid,
    tile_width, time, tint,
};
use crate::shapes::{Input, SurfaceRecord, curves, in_input_coordinates, surface, triangles};

/// Pictures of an animation, about.
const FRAMES: usize = 24;
/// Pixels of an animation's longer side, in 2D and 3D.
const SIDES: [usize; 2] = [360, 320];
/// Height of the eye, in degrees.
const ELEVATION: f64 = 22.0;
const TITLE: &str = "dissipation K^2 W(D phi)";

/// What is drawn in `D` dimensions.
pub(crate) trait Draw<const D: usize> {
    /// `geodesic.png`.
    fn film(path: &Path<D>) -> Canvas;

    /// The frames of `geodesic.apng`, from the first shape to the last.
    fn animation(path: &Path<D>) -> Vec<Canvas>;

    /// Shapes as they are seen beside each other, each in its colour.
    fn portraits(shapes: &[(&Contour<D>, Colour)]) -> Vec<Canvas>;

    /// Writes a boundary as a surface in the unit box where it is one.
    fn write_shape(path: &std::path::Path, shape: &Contour<D>) -> Result<(), CliError>;

    /// Writes `shape_000.stl` and so on in 3D, and returns their coordinate system.
    fn surfaces(
        directory: &ResultDir,
        inputs: &[Input<D>],
        path: &Path<D>,
    ) -> Result<Option<SurfaceRecord>, CliError>;
}

/// Drawing in two and three dimensions.
pub(crate) struct Pictures;

impl Draw<2> for Pictures {
    fn film(path: &Path<2>) -> Canvas {
        let outlines: Vec<Vec<Curve>> = path.contours.iter().map(curves).collect();
        let window = Window::around(outlines.iter().flatten(), tile_width(outlines.len()));
        let shapes = (0..outlines.len()).map(|k| {
            let mut canvas = window.canvas();
            filled(window, &mut canvas, &outlines[k], colour_at(path, k, 0.0));
            labelled(window, &mut canvas, path, k, 0.0);
            if let Some(target) = path.target.as_ref().filter(|_| k == path.steps()) {
                window.outline(&mut canvas, &curves(target), 1.0, INK);
            }
            canvas
        });
        let most = path.densest();
        let densities = path
            .densities
            .iter()
            .zip(&outlines)
            .map(|(density, outline)| {
                let mut canvas = window.canvas();
                let shade = |p| heat(density.sample(p)[0] / scale(most));
                window.paint(&mut canvas, outline, shade);
                window.outline(&mut canvas, outline, 1.0, INK);
                canvas
            });
        strip(path, shapes.collect(), densities.collect(), most)
    }

    fn animation(path: &Path<2>) -> Vec<Canvas> {
        let ends = [
            curves(&path.contours[0]),
            curves(&path.contours[path.steps()]),
        ];
        let all: Vec<Curve> = path.contours.iter().flat_map(curves).collect();
        let window = Window::around(&all, SIDES[0]).with_longer_side(SIDES[0]);
        parallel::map(moments(path.steps()), &|(k, share)| {
            let mut canvas = window.canvas();
            // Both ends are seen faintly where the shape is not.
            for (end, hue) in ends.iter().zip([time(0.0), time(1.0)]) {
                window.outline(&mut canvas, end, 1.0, tint(hue));
            }
            let outline = curves(&boundary(path, k, share));
            filled(window, &mut canvas, &outline, colour_at(path, k, share));
            labelled(window, &mut canvas, path, k, share);
            canvas
        })
    }

    fn portraits(shapes: &[(&Contour<2>, Colour)]) -> Vec<Canvas> {
        let all: Vec<Curve> = shapes.iter().flat_map(|(shape, _)| curves(shape)).collect();
        let window = Window::around(&all, SIDES[0]).with_longer_side(SIDES[0]);
        let portraits = shapes.iter().map(|(shape, hue)| {
            let mut canvas = window.canvas();
            filled(window, &mut canvas, &curves(shape), *hue);
            canvas
        });
        portraits.collect()
    }

    fn write_shape(_path: &std::path::Path, _shape: &Contour<2>) -> Result<(), CliError> {
        Ok(())
    }

    fn surfaces(
        _directory: &ResultDir,
        _inputs: &[Input<2>],
        _path: &Path<2>,
    ) -> Result<Option<SurfaceRecord>, CliError> {
        Ok(None)
    }
}

fn filled(window: Window, canvas: &mut Canvas, outline: &[Curve], colour: Colour) {
    window.fill(canvas, outline, tint(colour));
    window.outline(canvas, outline, 1.6, colour);
}

/// The labels of a shape on its way, where there are several.
fn labelled(window: Window, canvas: &mut Canvas, path: &Path<2>, k: usize, share: f64) {
    let Some(labels) = path.labels.get(k) else {
        return;
    };
    for (index, contour) in labels.iter().enumerate() {
        let outline = if share > 0.0 {
            curves(&path.moved(k, share, contour))
        } else {
            curves(contour)
        };
        filled(window, canvas, &outline, colour(index));
    }
}

impl Draw<3> for Pictures {
    fn film(path: &Path<3>) -> Canvas {
        let (view, bounds) = eye(&path.contours.iter().collect::<Vec<_>>());
        let side = tile_width(path.contours.len());
        let shapes = parallel::map(path.contours.iter().enumerate(), &|(k, contour)| {
            let triangles = triangles(contour);
            let paint = Paint::Plain(solid(colour_at(path, k, 0.0)));
            surface(contour, &triangles).render(view, bounds, paint, side)
        });
        let most = path.densest();
        let densities = path.densities.iter().zip(&path.contours);
        let densities = parallel::map(densities, &|(density, contour)| {
            let triangles = triangles(contour);
            let points = contour.points().iter();
            let colours: Vec<Colour> = points
                .map(|p| heat(density.sample(*p)[0] / scale(most)))
                .collect();
            surface(contour, &triangles).render(view, bounds, Paint::Vertices(&colours), side)
        });
        strip(path, shapes, densities, most)
    }

    fn animation(path: &Path<3>) -> Vec<Canvas> {
        let (view, bounds) = eye(&path.contours.iter().collect::<Vec<_>>());
        parallel::map(moments(path.steps()), &|(k, share)| {
            let contour = boundary(path, k, share);
            let triangles = triangles(&contour);
            let paint = Paint::Plain(solid(colour_at(path, k, share)));
            surface(&contour, &triangles).render(view, bounds, paint, SIDES[1])
        })
    }

    fn portraits(shapes: &[(&Contour<3>, Colour)]) -> Vec<Canvas> {
        let contours: Vec<&Contour<3>> = shapes.iter().map(|(shape, _)| *shape).collect();
        let (view, bounds) = eye(&contours);
        parallel::map(shapes, &|(contour, hue)| {
            let triangles = triangles(contour);
            let paint = Paint::Plain(solid(*hue));
            surface(contour, &triangles).render(view, bounds, paint, SIDES[1])
        })
    }

    fn write_shape(path: &std::path::Path, shape: &Contour<3>) -> Result<(), CliError> {
        Ok(write_surface(path, shape.points(), &triangles(shape))?)
    }

    fn surfaces(
        directory: &ResultDir,
        inputs: &[Input<3>],
        path: &Path<3>,
    ) -> Result<Option<SurfaceRecord>, CliError> {
        let mut told = None;
        for (k, contour) in path.contours.iter().enumerate() {
            let (placed, record) = in_input_coordinates(inputs, contour);
            let file = directory.file(numbered("shape", k, "stl"));
            write_surface(&file, placed.points(), &triangles(&placed))?;
            told = Some(record);
        }
        Ok(told)
    }
}

/// Where all surfaces are seen from: the broad side of the first.
fn eye(contours: &[&Contour<3>]) -> (View, Bounds) {
    let triangles: Vec<_> = contours.iter().map(|contour| triangles(contour)).collect();
    let surfaces = || {
        let pairs = contours.iter().zip(&triangles);
        pairs.map(|(contour, triangles)| surface(contour, triangles))
    };
    let view = surfaces().next().map_or(View::front(ELEVATION), |first| {
        View::broadside(first, ELEVATION)
    });
    (view, Bounds::seen(view, surfaces()))
}

fn strip<const D: usize>(
    path: &Path<D>,
    shapes: Vec<Canvas>,
    densities: Vec<Canvas>,
    most: f64,
) -> Canvas {
    let shapes: Vec<_> = path.names.iter().cloned().zip(shapes).collect();
    let densities: Vec<_> = path
        .energies
        .iter()
        .zip(densities)
        .map(|(energy, density)| (format!("W = {energy:.2e}"), density))
        .collect();
    FilmStrip {
        shapes: &shapes,
        densities: &densities,
        title: TITLE,
        most,
    }
    .draw()
}

/// Shapes and shares of the steps after them that an animation shows.
fn moments(steps: usize) -> Vec<(usize, f64)> {
    let parts = FRAMES.div_ceil(steps.max(1));
    let between = (0..steps * parts).map(|i| (i / parts, (i % parts) as f64 / parts as f64));
    between.chain([(steps, 0.0)]).collect()
}

fn boundary<const D: usize>(path: &Path<D>, k: usize, share: f64) -> Contour<D> {
    if share > 0.0 {
        path.between(k, share)
    } else {
        path.contours[k].clone()
    }
}

fn colour_at<const D: usize>(path: &Path<D>, k: usize, share: f64) -> Colour {
    time((k as f64 + share) / path.steps().max(1) as f64)
}

/// What a density is divided by.
fn scale(most: f64) -> f64 {
    if most > 0.0 { most } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_animation_goes_through_all_shapes() {
        let found = moments(5);
        assert_eq!(found.len(), 26);
        assert_eq!(
            (found[0], found[5], found[25]),
            ((0, 0.0), (1, 0.0), (5, 0.0))
        );
        assert_eq!(moments(40).len(), 41);
        assert_eq!(moments(0), [(0, 0.0)]);
    }
}
