//! Signed distances of built-in shapes and of files.

use std::path::PathBuf;

use fe_grid::{Grid, ScalarField};
use levelset::{ContourDistance, signed_distance};
use shape_average::align::align_group;
use shapespace_generate::{Bar, Ellipsoid, Implicit, Placed, area_share};
use shapespace_input::place::fit_frames;
use shapespace_input::{AnyImages, LEVEL, ReadOptions, boundary, read_images};

use crate::outcome::Outcome;

/// The signed distance of a shape drawn about the origin, turned by an angle in degrees.
pub fn drawn(shape: &dyn Implicit<2>, turn: f64, nodes: usize) -> Outcome<ScalarField<f64, 2>> {
    let placed = Placed {
        rotation: turn,
        ..Placed::centred(shape)
    };
    Ok(signed_distance(
        &area_share(&placed, Grid::cube(nodes)),
        LEVEL,
    )?)
}

/// A bar of the given inner angle: .6 long, .12 wide.
pub fn bar(angle: f64, turn: f64, nodes: usize) -> Outcome<ScalarField<f64, 2>> {
    drawn(&Bar::new(0.6, 0.12, angle), turn, nodes)
}

/// The straight bar and the bent one.
pub fn bars(nodes: usize) -> Outcome<Vec<ScalarField<f64, 2>>> {
    Ok(vec![bar(180.0, 0.0, nodes)?, bar(118.0, 0.0, nodes)?])
}

/// A disk.
pub fn disk(radius: f64, nodes: usize) -> Outcome<ScalarField<f64, 2>> {
    drawn(&Ellipsoid { radii: [radius; 2] }, 0.0, nodes)
}

/// Masks from files, placed in one box and aligned with the first.
pub fn aligned_files(files: &[PathBuf], nodes: usize) -> Outcome<Vec<ScalarField<f64, 2>>> {
    let AnyImages::D2(images) = read_images(files, &ReadOptions::default())? else {
        return Err("pictures were expected".into());
    };
    let grid = Grid::cube(nodes);
    let mut distances = Vec::new();
    for (image, frame) in images.iter().zip(fit_frames(&images, Some(&grid))) {
        let contour = boundary(image, &frame)?;
        distances.push(ContourDistance::new(&contour)?.sample(grid));
    }
    aligned(&distances)
}

/// Shapes aligned with the first.
pub fn aligned(shapes: &[ScalarField<f64, 2>]) -> Outcome<Vec<ScalarField<f64, 2>>> {
    let motions = align_group(&shapes.iter().collect::<Vec<_>>())?;
    let moved = shapes.iter().zip(motions);
    let moved = moved.map(|(shape, found)| signed_distance(&found.motion.apply(shape), 0.0));
    Ok(moved.collect::<Result<_, _>>()?)
}
