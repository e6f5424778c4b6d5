//! How the deformations of an average strain its shapes: arrays, a picture, and ranges.

use std::fmt::Write as _;

use fe_grid::{Field, Grid, ScalarField, parallel};
use shape_average::{StrainMaps, StrainRange, StrainRanges, cells_inside};

use crate::error::CliError;
use crate::output::{ResultDir, numbered};
use crate::shapes::Input;
use shapespace_picture::{Canvas, ColourBar, INK, Slice, TileRows, WHITE, heat};

/// Colours end where this share of the cells lies beyond, on either side.
const OUTLIERS: f64 = 0.01;

/// The strains of all shapes.
pub(super) struct Strains {
    pub maps: Vec<StrainMaps>,
    /// The cells of every shape.
    cells: Vec<Vec<usize>>,
}

impl Strains {
    /// Computes the strains of shapes with these indicators.
    pub fn new<const D: usize>(
        displacements: &[Field<f64, D, D>],
        indicators: &[ScalarField<f64, D>],
    ) -> Self {
        Self {
            maps: parallel::map(displacements, &StrainMaps::new),
            cells: parallel::map(indicators, &cells_inside),
        }
    }

    /// The ranges over every shape; `None` for one without cells.
    pub fn ranges(&self) -> Vec<Option<StrainRanges>> {
        let pairs = self.maps.iter().zip(&self.cells);
        pairs.map(|(maps, cells)| maps.ranges(cells)).collect()
    }
}

/// The maps that are shown: the cofactor has the norm of the gradient in the plane.
fn kinds<const D: usize>(maps: &StrainMaps) -> Vec<(&'static str, &'static str, &[f64])> {
    let norm = ("norm", "|Dφ|", &*maps.norm);
    let cofactor = ("cofactor", "|cof Dφ|", &*maps.cofactor);
    let determinant = ("determinant", "det Dφ", &*maps.determinant);
    if D == 2 {
        vec![norm, determinant]
    } else {
        vec![norm, cofactor, determinant]
    }
}

/// Writes the maps of all shapes, one number a cell.
///
/// # Errors
/// [`CliError::Output`].
pub(super) fn write_maps<const D: usize>(
    directory: &ResultDir,
    grid: &Grid<D>,
    maps: &[StrainMaps],
) -> Result<(), CliError> {
    let lattice = Grid::with_nodes(grid.cells_per_axis(), grid.spacing())?;
    directory.for_each(maps.iter().enumerate(), &|(i, maps)| {
        for (kind, _, map) in kinds::<D>(maps) {
            let map = ScalarField::from_vec(lattice, map.to_vec())?;
            directory.array(numbered(kind, i, "npy"), &map)?;
        }
        Ok(())
    })
}

/// `strain.png`: the maps of every shape on the shape itself, in 3D in the plane through its middle, and the
/// scales of their colours, which are those of all shapes.
pub(super) fn picture<const D: usize>(
    inputs: &[Input<D>],
    displacements: &[Field<f64, D, D>],
    strains: &Strains,
) -> Canvas {
    let shown = strains.maps.first().map_or(0, |m| kinds::<D>(m).len());
    // Two shapes beside each other in 2D.
    let columns = if D == 2 { 4 } else { 3 };
    let side = TileRows::width(columns);
    let scales: Vec<[f64; 2]> = (0..shown).map(|k| scale::<D>(strains, k)).collect();
    let pairs = inputs.iter().zip(displacements).enumerate();
    let tiles = parallel::map(pairs, &|(i, (input, displacement))| {
        let grid = displacement.grid();
        let mut inside = vec![false; grid.n_cells()];
        for &cell in &strains.cells[i] {
            inside[cell] = true;
        }
        let [low, high] = input.contour.bounds();
        let slice = Slice::around(&low, &high, side);
        let kinds = kinds::<D>(&strains.maps[i]).into_iter().enumerate();
        let tile = |(k, (_, name, map)): (usize, (_, _, &[f64]))| {
            let [least, most] = scales[k];
            let mut tile = slice.painted(|x| {
                let cell = grid.cell_index(fe_grid::locate(grid, x).0);
                if inside[cell] {
                    heat(share(map[cell], [least, most]))
                } else {
                    WHITE
                }
            });
            slice.outline(&mut tile, &input.contour, 1.2, INK);
            let mut label = format!("{}: {name}", input.name);
            if let Some(own) = StrainRange::over(map, &strains.cells[i]) {
                let _ = write!(label, " {:.2} to {:.2}", own.least, own.greatest);
            }
            (label, tile)
        };
        kinds.map(tile).collect::<Vec<_>>()
    });
    let mut rows = TileRows::new(columns);
    for (label, tile) in tiles.into_iter().flatten() {
        rows.push(label, tile);
    }
    rows.end_row();
    if let Some(maps) = strains.maps.first() {
        for ((_, name, _), [least, most]) in kinds::<D>(maps).into_iter().zip(scales) {
            let label = format!("colours of {name}: {least:.2} to {most:.2}");
            let bar = ColourBar::linear(label, [least, most], heat);
            rows.push(bar.title.clone(), bar.draw(side));
        }
    }
    rows.draw()
}

/// The place of a value in a range.
fn share(value: f64, [least, most]: [f64; 2]) -> f64 {
    (value - least) / f64::max(most - least, f64::MIN_POSITIVE)
}

/// The range of nearly all values of a map on all shapes.
fn scale<const D: usize>(strains: &Strains, kind: usize) -> [f64; 2] {
    let shapes = strains.maps.iter().zip(&strains.cells);
    let mut all: Vec<f64> = shapes
        .flat_map(|(maps, cells)| {
            let map = kinds::<D>(maps)[kind].2;
            cells.iter().map(|&cell| map[cell])
        })
        .filter(|value| value.is_finite())
        .collect();
    if all.is_empty() {
        return [0.0, 1.0];
    }
    all.sort_unstable_by(f64::total_cmp);
    let rank = (OUTLIERS * (all.len() - 1) as f64) as usize;
    [all[rank], all[all.len() - 1 - rank]]
}
