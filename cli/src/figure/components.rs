//! The same bodies as one shape and as shapes of several labelled components.

use std::path::Path;

use fe_grid::{Grid, InverseDeformation, ScalarField};
use levelset::{BoxEdge, Contour, contour, dice};
use shape_average::{AverageResult, Shapes};
use shape_pca::Pca;
use shapespace_generate::Implicit;
use shapespace_report::table::{Cell, Table};

use super::drawn::drawn_image;
use super::modes::{AMPLITUDE, COLUMNS, KINDS, MODES, analyse, draw_rows, eigenvalues};
use super::scene::{Scene, outline};
use super::sheet::{Sheet, Tiles};
use crate::average::boundaries;
use crate::error::CliError;
use crate::shapes::Components;
use shapespace_input::Image;
use shapespace_picture::{Colour, INK, colour};

/// The built-in shapes: bars with their names.
pub(super) fn bars() -> Vec<(String, Box<dyn Implicit<2>>)> {
    let bars = shapespace_generate::parts::<2>().into_iter();
    bars.map(|bar| (bar.name, bar.shape)).collect()
}

/// The components of the built-in shapes, as images with this number of nodes per side.
pub(super) fn parts(nodes: usize, folder: &Path) -> Components<2> {
    let grid = Grid::<2>::cube(nodes);
    let mask = |part: &dyn Implicit<2>| drawn_image("part", part, grid, folder);
    let bars = shapespace_generate::parts::<2>();
    let masks: Vec<Vec<Image<2>>> = bars
        .iter()
        .map(|bar| bar.parts.iter().map(|part| mask(part.as_ref())).collect())
        .collect();
    Components::of_masks(vec![1, 2], masks)
}

/// Averages and modes of shapes as they are, and of their components.
pub(super) fn components<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let n_components = scene.labels.len().max(1);
    let whole = Shapes::new(&scene.distances);
    let labelled = match scene.labels.len() {
        0 | 1 => whole,
        n => Shapes::of_components(&scene.distances, &scene.parts, n)?,
    };
    let mut tiles = Tiles::new(&scene.grid(), COLUMNS);
    let outlines = boundaries(&scene.parts)?;
    for (name, parts) in scene.names.iter().zip(outlines.chunks(n_components)) {
        tiles.outlines(name, &coloured(parts));
    }
    tiles.end_row();
    let mut table = Table::new([
        "shapes",
        "elastic energy",
        "Dice of the shapes",
        "Dice of the labels",
        "least det",
        "first eigenvalue",
        "second ratio",
        "third ratio",
    ]);
    for (what, shapes) in [("one component", whole), ("labelled", labelled)] {
        let result = scene.average_of_shapes(what, shapes, |_| ())?;
        let (pca, _) = analyse(scene, &result, &scene.params, &KINDS[0])?;
        let pushed = pushed(scene, &result);
        let elastic = &result.energy.elastic;
        let of_average: [Cell; 5] = [
            what.into(),
            (elastic.iter().sum::<f64>() / elastic.len() as f64).into(),
            result.mean_dice().into(),
            agreement(&pushed, n_components)?.into(),
            result.certificate.min_det.into(),
        ];
        let of_modes = eigenvalues(&pca);
        table.row(of_average.into_iter().chain(of_modes));
        let own = own_boundaries(&result)?;
        draw_average(&mut tiles, what, &own, &pushed, n_components)?;
        draw_modes(&mut tiles, what, &own, &pca);
    }
    Ok(Sheet {
        title: "One component and several",
        text: format!(
            "The same bodies, averaged as one shape each and as shapes of several labelled components \
             (`average --labels`), with the first {MODES} modes up to {AMPLITUDE} standard deviations. As one \
             shape they are deformed by their outlines alone: the labels, carried along, do not agree in the \
             average, and where they meet is no part of any mode. With labels one deformation of each body \
             moves all of its labels onto those of the average, which costs elastic energy, and their common \
             border varies in the modes. The Dice overlap of the labels is that of all pairs of deformed \
             bodies, on average."
        ),
        table,
        picture: tiles.draw(),
    })
}

/// The boundaries of the components of an average, or of the whole where there is one.
fn own_boundaries<const D: usize>(result: &AverageResult<D>) -> Result<Vec<Contour<D>>, CliError> {
    if result.components.is_empty() {
        return Ok(vec![outline(result)?]);
    }
    let parts = result.components.iter();
    let parts = parts.map(|part| contour(&part.average_indicator, 0.5, BoxEdge::Closed));
    let parts = parts.collect::<Result<_, _>>();
    Ok(parts?)
}

/// The components of all shapes by the deformations of a result, all of the first shape before those of the
/// second.
fn pushed<const D: usize>(
    scene: &Scene<'_, D>,
    result: &AverageResult<D>,
) -> Vec<ScalarField<f64, D>> {
    let n_components = scene.labels.len().max(1);
    let shapes = scene.parts.chunks(n_components).zip(&result.displacements);
    let moved = shapes.map(|(parts, u)| {
        let inverse = InverseDeformation::new(u);
        let push = |part| inverse.push_forward(part, -1.0);
        parts.iter().map(push).collect::<Vec<_>>()
    });
    moved.flatten().collect()
}

/// The mean overlap of equal components of all pairs of shapes.
fn agreement<const D: usize>(
    pushed: &[ScalarField<f64, D>],
    n_components: usize,
) -> Result<f64, CliError> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (place, part) in pushed.iter().enumerate() {
        let others = pushed[place + 1..].iter().enumerate();
        for (_, other) in others.filter(|(k, _)| (k + 1) % n_components == 0) {
            sum += dice(part, 0.0, other, 0.0)?;
            count += 1.0;
        }
    }
    Ok(sum / f64::max(count, 1.0))
}

fn coloured<const D: usize>(parts: &[Contour<D>]) -> Vec<(&Contour<D>, Colour)> {
    let numbered = parts.iter().enumerate();
    numbered.map(|(c, part)| (part, colour(c))).collect()
}

/// The average, and the deformed components of all shapes over it.
fn draw_average<const D: usize>(
    tiles: &mut Tiles<D>,
    what: &str,
    own: &[Contour<D>],
    pushed: &[ScalarField<f64, D>],
    n_components: usize,
) -> Result<(), CliError> {
    let outlines = boundaries(pushed)?;
    let mut drawn: Vec<(&Contour<D>, Colour)> = Vec::new();
    for parts in outlines.chunks(n_components) {
        drawn.extend(coloured(parts));
    }
    drawn.extend(own.iter().map(|part| (part, INK)));
    tiles.outlines(&format!("{what}: average"), &drawn);
    tiles.end_row();
    Ok(())
}

/// The first modes of shapes with these boundaries.
fn draw_modes<const D: usize>(tiles: &mut Tiles<D>, what: &str, own: &[Contour<D>], pca: &Pca<D>) {
    draw_rows(tiles, &pca.space, &[], |tiles, (j, i, share), moved| {
        let moved: Vec<Contour<D>> = own.iter().map(moved).collect();
        let words = match i {
            0 => format!("{what}, mode {}", j + 1),
            _ => format!("{:+.0} s.d.", share * AMPLITUDE),
        };
        let drawn = match &moved[..] {
            [one] => vec![(one, INK)],
            parts => coloured(parts),
        };
        tiles.outlines(&words, &drawn);
    });
}
