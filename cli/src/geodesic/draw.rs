//! The pictures of a geodesic.

use fe_grid::parallel;
use levelset::Contour;

use super::path::Path;
use shapespace_picture::{
    Camera, Canvas, Colour, FilmStrip, INK, Shape, colour, heat, tile_width, time, tint,
};

/// Approximate number of frames of an animation.
const FRAMES: usize = 24;
/// Pixels of an animation's longer side, in 2D and 3D.
const SIDES: [usize; 2] = [360, 320];
const TITLE: &str = "dissipation K^2 W(D phi)";

/// `geodesic.png`: the shapes, and below them the densities of the steps.
pub(crate) fn film<const D: usize>(path: &Path<D>) -> Canvas {
    let outlines: Vec<Shape> = path.contours.iter().map(Shape::of).collect();
    // The end shape is larger than the last one where a path does not arrive.
    let target = path.parts.target.as_ref().map(Shape::of);
    let seen: Vec<Shape> = outlines.iter().chain(&target).cloned().collect();
    let camera = Camera::around(&seen, tile_width(outlines.len()));
    let shapes = parallel::map(outlines.iter().enumerate(), &|(k, shape)| {
        let mut canvas = camera.portrait(shape, colour_at(path, k, 0.0));
        draw_labels(&camera, &mut canvas, path, k, 0.0);
        if let Some(target) = target.as_ref().filter(|_| k == path.steps()) {
            camera.outline_over(&mut canvas, target, INK);
        }
        canvas
    });
    let most = path.densest();
    let scale = if most > 0.0 { most } else { 1.0 };
    let densities = parallel::map(path.densities.iter().zip(&outlines), &|(density, shape)| {
        camera.shaded(shape, INK, |p| {
            heat(density.sample(std::array::from_fn(|k| p[k]))[0] / scale)
        })
    });
    let shapes: Vec<_> = path.parts.names.iter().cloned().zip(shapes).collect();
    let energies = path
        .parts
        .energies
        .iter()
        .map(|energy| format!("W = {energy:.2e}"));
    FilmStrip {
        shapes: &shapes,
        densities: &energies.zip(densities).collect::<Vec<_>>(),
        title: TITLE,
        most,
    }
    .draw()
}

/// The frames of `geodesic.apng`, from the first shape to the last.
pub(crate) fn animation<const D: usize>(path: &Path<D>) -> Vec<Canvas> {
    let outlines: Vec<Shape> = path.contours.iter().map(Shape::of).collect();
    let camera = camera::<D>(&outlines);
    parallel::map(moments(path.steps()), &|(k, share)| {
        let moved = (share > 0.0).then(|| Shape::of(&path.between(k, share)));
        let shape = moved.as_ref().unwrap_or(&outlines[k]);
        let mut canvas = camera.blank();
        // Both ends remain faintly visible where the shape is not.
        for (end, hue) in [(0, time(0.0)), (path.steps(), time(1.0))] {
            camera.outline_over(&mut canvas, &outlines[end], tint(hue));
        }
        camera.draw_over(&mut canvas, shape, colour_at(path, k, share));
        draw_labels(&camera, &mut canvas, path, k, share);
        canvas
    })
}

/// Pictures of shapes at one scale, each in its colour.
pub(crate) fn portraits<const D: usize>(shapes: &[(&Contour<D>, Colour)]) -> Vec<Canvas> {
    let outlines: Vec<Shape> = shapes.iter().map(|(shape, _)| Shape::of(shape)).collect();
    let camera = camera::<D>(&outlines);
    parallel::map(outlines.iter().zip(shapes), &|(shape, (_, hue))| {
        camera.portrait(shape, *hue)
    })
}

/// Pictures of shapes at one scale, with the components of each in their colours.
pub(crate) fn portraits_of_parts<const D: usize>(
    shapes: &[(&Contour<D>, &[(Contour<D>, Colour)])],
) -> Vec<Canvas> {
    let outlines: Vec<Shape> = shapes.iter().map(|(whole, _)| Shape::of(whole)).collect();
    let camera = camera::<D>(&outlines);
    parallel::map(shapes, &|(_, parts)| {
        let parts = parts.iter().map(|(part, hue)| (Shape::of(part), *hue));
        camera.parts(&parts.collect::<Vec<_>>())
    })
}

/// The view of an animation.
fn camera<const D: usize>(outlines: &[Shape]) -> Camera {
    let side = SIDES[usize::from(D == 3)];
    Camera::around(outlines, side).with_longer_side(side)
}

/// Draws the components of shape `k`, if there are several, at a fraction of the step after it.
fn draw_labels<const D: usize>(
    camera: &Camera,
    canvas: &mut Canvas,
    path: &Path<D>,
    k: usize,
    share: f64,
) {
    let labels = path.labels.get(k).filter(|_| D == 2);
    for (index, contour) in labels.into_iter().flatten().enumerate() {
        let shape = if share > 0.0 {
            Shape::of(&path.moved(k, share, contour))
        } else {
            Shape::of(contour)
        };
        camera.draw_over(canvas, &shape, colour(index));
    }
}

/// Shapes and shares of the steps after them that an animation shows.
fn moments(steps: usize) -> Vec<(usize, f64)> {
    let parts = FRAMES.div_ceil(steps.max(1));
    let between = (0..steps * parts).map(|i| (i / parts, (i % parts) as f64 / parts as f64));
    between.chain([(steps, 0.0)]).collect()
}

fn colour_at<const D: usize>(path: &Path<D>, k: usize, share: f64) -> Colour {
    time((k as f64 + share) / path.steps().max(1) as f64)
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
