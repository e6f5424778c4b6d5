//! The balance of forces in the average.

use fe_grid::pullback::Derivatives;
use fe_grid::{Boundary, Grid, InverseDeformation, ScalarField, SpectralSolver};
use levelset::{Contour, centroid};
use shape_average::{AverageResult, cauchy_stress_at_nodes};
use shape_pca::{Average, PcaError, Source, evaluate};
use shapespace_report::table::Cell;

use super::scene::{Scene, outline};
use super::sheet::{Comparison, Sheet, Tiles};
use crate::error::CliError;
use shapespace_picture::{Canvas, INK, Slice, WHITE, colour, heat};

/// Weights of the mismatch.
const WEIGHTS: [f64; 3] = [0.1, 1.0, 10.0];
/// Interface widths, in spacings.
const CELLS: [f64; 3] = [2.0, 4.0, 8.0];
/// The length weight is fixed and small: the length term contributes to the forces.
const LENGTH_WEIGHT: f64 = 1e-6;
/// Between these fractions of the greatest depth, the weight of the interior increases from 0 to 1:
/// the forces of the mismatch reach some interface widths into the object.
const INSIDE: [f64; 2] = [0.5, 0.8];

/// On a quarter of fewer nodes there is no object.
const FEWEST_NODES: usize = 17;

/// Residuals of the two balances.
struct Residuals {
    /// The share of the forces `div sigma_i` that lies inside the object, as forces smoothed over the
    /// width of the interface, in `L^2`: zero where every deformation is in equilibrium there.
    inside: f64,
    /// What `sum_i lambda_i sigma_i nu` does, over the sum of what `lambda_i sigma_i nu` do.
    boundary: f64,
}

fn residuals<const D: usize>(
    result: &AverageResult<D>,
    params: &shape_average::AverageParams,
) -> Result<Residuals, CliError> {
    let average = Average::of_result(result, params)?;
    let grid = *average.grid();
    let response = Response::new(grid)?;
    let width = result.shapes.interface_width();
    let smoothing = SpectralSolver::new(grid, 1.0, width * width, Boundary::Natural)?;
    let smoothing = smoothing.with_components(D);
    let depths = levelset::signed_distance(&result.average_indicator, 0.5)?;
    let deepest = depths.as_slice().iter().copied().fold(0.0, f64::max);
    let law = params.law.compile().map_err(shape_pca::PcaError::from)?;
    let n = grid.n_nodes();
    let mut sum = vec![0.0; D * n];
    let (mut separate, mut all, mut inside) = (0.0, 0.0, 0.0);
    for (i, weight) in average.weights().iter().enumerate() {
        let source = [Source {
            weight: *weight,
            ..average.source(i)
        }];
        // The load of the object's stress alone: the void is a device.
        let derivatives = Derivatives::Gradient;
        let load = evaluate(&grid, &law, 0.0, &source, &[], derivatives)?.gradient;
        for (s, f) in sum.iter_mut().zip(&load) {
            *s += f;
        }
        separate += response.size(&load);
        let mut forces = vec![0.0; D * n];
        smoothing.solve_into(&load, &mut forces);
        all += fe_grid::vector::dot(&forces, &forces).sqrt();
        for (k, f) in forces.iter_mut().enumerate() {
            let share = depths.as_slice()[k % n] / deepest;
            let t = ((share - INSIDE[0]) / (INSIDE[1] - INSIDE[0])).clamp(0.0, 1.0);
            *f *= t * t * (3.0 - 2.0 * t);
        }
        inside += fe_grid::vector::dot(&forces, &forces).sqrt();
    }
    Ok(Residuals {
        inside: inside / all,
        boundary: response.size(&sum) / separate,
    })
}

/// The norm of a load by the displacement it causes: the norm in `L^2` of `(M + L)^-1 f`, the displacement of an elastic
/// box. Forces that change sign from node to node, which the grid brings along, do next to nothing.
struct Response<const D: usize>(SpectralSolver<D>);

impl<const D: usize> Response<D> {
    fn new(grid: Grid<D>) -> Result<Self, CliError> {
        let solver = SpectralSolver::new(grid, 1.0, 1.0, Boundary::Natural)?;
        Ok(Self(solver.with_components(D)))
    }

    fn size(&self, load: &[f64]) -> f64 {
        let mut displacement = vec![0.0; load.len()];
        self.0.solve_into(load, &mut displacement);
        fe_grid::vector::dot(&displacement, &displacement).sqrt()
    }
}

/// Averages of growing mismatch weight on three grids, and a picture of the stresses.
pub(super) fn force_balance<const D: usize>(scene: &Scene<'_, D>) -> Result<Sheet, CliError> {
    let nodes = scene.grid().nodes_per_axis()[0];
    if nodes < FEWEST_NODES {
        return Err(CliError::Option {
            option: "--grid",
            value: nodes.to_string(),
            remedy: format!(
                "the figure compares three grids: at least {FEWEST_NODES} nodes a side"
            ),
        });
    }
    let first = ["nodes a side", "interface cells", "mismatch weight"];
    let residual = ["imbalance inside", "imbalance on the boundary"];
    let columns = (scene.n_shapes() + 2).min(5);
    let mut compared = Comparison::new(&scene.grid(), columns, &first, &residual);
    let mut last = None;
    for times in [2, 1, 0] {
        let Some(shapes) = scene.coarser(times) else {
            continue;
        };
        let nodes = shapes[0].grid().nodes_per_axis()[0];
        for (cells, weight) in CELLS.into_iter().flat_map(|c| WEIGHTS.map(|w| (c, w))) {
            let mut params = scene.params.clone();
            let what = format!("{nodes} nodes a side, {cells} cells, weight {weight}");
            let result = scene.average_of(&what, &shapes, &[], |own| {
                own.mismatch_weight = weight;
                own.interface_cells = cells;
                own.length_weight = Some(LENGTH_WEIGHT);
                params = own.clone();
            })?;
            let first: [Cell; 3] = [nodes.into(), cells.into(), weight.into()];
            match residuals(&result, &params) {
                Ok(left) => {
                    compared.row(first, &result, [left.inside, left.boundary]);
                    last = Some((result, params));
                }
                // On a coarse grid a weak match and a wide interface may leave nothing of thin shapes.
                Err(CliError::Pca(PcaError::EmptyObject)) => {
                    compared.row(first, &result, ["none", "none"]);
                }
                Err(error) => return Err(error),
            }
        }
    }
    compared.tiles.shapes("shapes", &scene.distances, 0.0);
    if let Some((result, params)) = last {
        stresses(&mut compared.tiles, scene, &result, &params)?;
    }
    Ok(compared.sheet(
        "Balance of forces",
        format!(
            "At the average the stresses of all deformations balance: inside the object the divergence \
             of each vanishes, and on the boundary the tractions add up to zero. What is left on the \
             boundary, by the displacement that it would cause, relative to what the tractions of each \
             would, falls with the spacing where the interface stays as wide. At no spacing does a larger \
             weight help: the average is at its minimum whatever the weight, and the error of the grid, \
             which is left, is multiplied by it. What is left inside (deeper \
             than {} of the greatest depth, as a share of all forces, smoothed over an interface width) \
             falls where the interface becomes thin beside the object. Length weight {LENGTH_WEIGHT}. The \
             picture shows, on the last average, the magnitude of the Cauchy stress of each shape, and \
             the tractions of all on the boundary in their colours.",
            INSIDE[0]
        ),
    ))
}

/// Tiles with the magnitude of each stress, and with the tractions of all.
fn stresses<const D: usize>(
    tiles: &mut Tiles<D>,
    scene: &Scene<'_, D>,
    result: &AverageResult<D>,
    params: &shape_average::AverageParams,
) -> Result<(), CliError> {
    let boundary = outline(result)?;
    let mut pushed = Vec::new();
    for displacement in &result.displacements {
        let inverse = InverseDeformation::new(displacement);
        let entries = cauchy_stress_at_nodes(&params.law, displacement)?;
        let entries: Vec<ScalarField<f64, D>> = entries
            .iter()
            .map(|entry| inverse.push_forward(entry, 0.0))
            .collect();
        pushed.push(entries);
    }
    let magnitude = |entries: &[ScalarField<f64, D>], x: [f64; D]| -> f64 {
        let squares = entries.iter().map(|entry| entry.sample(x)[0].powi(2));
        squares.sum::<f64>().sqrt()
    };
    // The largest stress that is not of a few nodes at a corner.
    let mut all: Vec<f64> = pushed
        .iter()
        .flat_map(|entries| boundary.points().iter().map(|p| magnitude(entries, *p)))
        .filter(|m| m.is_finite())
        .collect();
    all.sort_unstable_by(f64::total_cmp);
    let most = all
        .get(all.len() * 95 / 100)
        .copied()
        .unwrap_or(1.0)
        .max(1e-12);
    let indicator = &result.average_indicator;
    for (name, entries) in scene.names.iter().zip(&pushed) {
        let mut tile = tiles.slice.painted(|x| {
            if indicator.sample(x)[0] > 0.5 {
                heat(magnitude(entries, x) / most)
            } else {
                WHITE
            }
        });
        tiles.slice.outline(&mut tile, &boundary, 1.2, INK);
        tiles.push(&format!("{name}, up to {most:.2}"), tile);
    }
    let mut tile = tiles.slice.painted(|_| WHITE);
    tiles.slice.outline(&mut tile, &boundary, 1.2, INK);
    for (i, entries) in pushed.iter().enumerate() {
        tractions(&mut tile, &tiles.slice, &boundary, entries, i, most);
    }
    tiles.push("tractions", tile);
    Ok(())
}

/// Draws the tractions `sigma nu` of one shape at every fourth piece of the boundary.
fn tractions<const D: usize>(
    tile: &mut Canvas,
    slice: &Slice<D>,
    boundary: &Contour<D>,
    entries: &[ScalarField<f64, D>],
    shape: usize,
    most: f64,
) {
    const LENGTH: f64 = 0.12;
    const EVERY: usize = 4;
    if D != 2 {
        return;
    }
    for corners in boundary.all_corners().step_by(EVERY) {
        let middle = centroid(&corners);
        let along = [corners[1][0] - corners[0][0], corners[1][1] - corners[0][1]];
        let size = along[0].hypot(along[1]).max(1e-12);
        // The object lies to the left.
        let normal = [along[1] / size, -along[0] / size];
        // The stress of the object, a little below its boundary.
        let mut below = middle;
        for k in 0..2 {
            below[k] -= 2.0 * normal[k] * entries[0].grid().spacing();
        }
        let mut end = middle;
        for (i, x) in end.iter_mut().enumerate().take(2) {
            let traction: f64 = (0..2)
                .map(|j| entries[i * D + j].sample(below)[0] * normal[j])
                .sum();
            *x += LENGTH * traction / most;
        }
        if end.iter().all(|x| x.is_finite()) {
            slice.line(tile, &[middle, end], 1.3, colour(shape));
        }
    }
}
