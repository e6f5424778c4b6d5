//! Deformations as displacement fields in the world, as ITK applies them, and volumes of shapes.
//!
//! A deformation `φ` maps an input onto the average in the unit box. With the maps `A` of the world of
//! the average and `S` of the world of the input to the box, it is `A⁻¹ φ S` in the world. A program
//! that resamples an image asks the other way round, for every point of its result: `warp` is
//! `S⁻¹ φ⁻¹ A`, which resamples the input in the space of the average, `inverse_warp` is `A⁻¹ φ S`,
//! which resamples the average in the space of the input. Both are given at the nodes of the grid,
//! whose piecewise multilinear interpolation is the deformation itself.

use fe_grid::{Field, Grid, InverseDeformation};
use levelset::{Contour, ContourDistance};

use crate::error::CliError;
use crate::output::nifti::{Values, write_volume};
use crate::output::{ResultDir, numbered};
use crate::shapes::{Input, WorldFrame, in_space, lattice_of};
use shapespace_input::lattice::Lattice;

/// Share of the longest side of the box, at all of its faces, where no volumes of shapes are written.
const BORDER: f64 = 0.05;

/// Samples that one thread evaluates at a time.
const SAMPLES_AT_ONCE: usize = 1024;

/// Writes the deformations of inputs onto a shape, and their inverses, where they have a world.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_warps<const D: usize>(
    directory: &ResultDir,
    inputs: &[Input<D>],
    displacements: &[Field<f64, D, D>],
) -> Result<(), CliError> {
    let Some(average) = WorldFrame::of_inputs(inputs).filter(|_| directory.has_files()) else {
        return Ok(());
    };
    for (number, displacement) in displacements.iter().enumerate() {
        if let Some(subject) = WorldFrame::of_one(inputs, number) {
            let worlds = [&subject, &average];
            write_both(directory, inputs, number, worlds, displacement)?;
        }
    }
    Ok(())
}

/// Writes the steps of a path, from 1, and their inverses, where its inputs have a world: `warp` of a step
/// resamples the shape before it as that after it.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_steps_in_world<const D: usize>(
    directory: &ResultDir,
    inputs: &[Input<D>],
    displacements: &[Field<f64, D, D>],
) -> Result<(), CliError> {
    let Some(world) = WorldFrame::of_inputs(inputs).filter(|_| directory.has_files()) else {
        return Ok(());
    };
    for (k, displacement) in displacements.iter().enumerate() {
        write_both(directory, inputs, k + 1, [&world, &world], displacement)?;
    }
    Ok(())
}

/// Writes the deformation of a shape in one world onto one in another, and its inverse. Flat shapes have none.
fn write_both<const D: usize>(
    directory: &ResultDir,
    inputs: &[Input<D>],
    number: usize,
    [start, end]: [&WorldFrame<D>; 2],
    displacement: &Field<f64, D, D>,
) -> Result<(), CliError> {
    if D == 2 {
        return Ok(());
    }
    let inverse = inverted(displacement);
    let warps = [
        ("warp", end, start, &inverse),
        ("inverse_warp", start, end, displacement),
    ];
    for (kind, from, to, displacement) in warps {
        let nodes = from.lattice(displacement.grid());
        let Some((nodes, samples)) = nodes.zip(lattice_of(&inputs[from.number()])) else {
            continue;
        };
        // Where images are resampled by it there must be a way: elsewhere ITK takes none for a way of zero.
        let position = |unit| in_space(from.position(unit));
        let resampled = within_box(&samples, displacement.grid(), &position);
        let (lattice, before) = nodes.reaching(resampled.corners());
        let vectors = ways(displacement, from, to, (&lattice, before));
        let file = directory.file(numbered(kind, number, "nii.gz"));
        write_volume(&file, &lattice, &Values::Displacements(&vectors))?;
    }
    Ok(())
}

/// Writes a shape in the world of the results, on the samples of the input that leads, continued
/// where needed: its mask, and its signed distance in millimetres.
///
/// # Errors
/// [`CliError::Output`], [`CliError::Computation`] for a shape without a boundary.
pub(crate) fn write_shape<const D: usize>(
    directory: &ResultDir,
    name: &str,
    inputs: &[Input<D>],
    shape: &Contour<D>,
    grid: Grid<D>,
) -> Result<(), CliError> {
    let Some((world, lattice)) = samples_in_world(directory, inputs, grid) else {
        return Ok(());
    };
    let values = sampled(&distance_of(shape)?, grid, &lattice, &world);
    let mask: Vec<u8> = values.iter().map(|&u| u8::from(u > 0.0)).collect();
    let file = directory.file(format!("{name}.nii.gz"));
    write_volume(&file, &lattice, &Values::Mask(&mask))?;
    let file = directory.file(format!("{name}_distance.nii.gz"));
    Ok(write_volume(&file, &lattice, &Values::Numbers(&values))?)
}

/// Writes the components of a shape in the world of the results as a label image, on the samples of
/// [`write_shape`], whose mask it replaces: inside the shape every sample has the label of the component whose
/// inside it lies in most deeply, or whose boundary is nearest.
///
/// # Errors
/// As [`write_shape`].
pub(crate) fn write_labels<const D: usize>(
    directory: &ResultDir,
    name: &str,
    inputs: &[Input<D>],
    shape: &Contour<D>,
    (labels, components): (&[i64], &[Contour<D>]),
    grid: Grid<D>,
) -> Result<(), CliError> {
    let Some((world, lattice)) = samples_in_world(directory, inputs, grid) else {
        return Ok(());
    };
    let whole = sampled(&distance_of(shape)?, grid, &lattice, &world);
    let mut deepest = vec![f32::NEG_INFINITY; whole.len()];
    let mut found = vec![0i32; whole.len()];
    for (label, component) in labels.iter().zip(components) {
        // Other labels are refused when the images are read.
        let label = i32::try_from(*label).unwrap_or_default();
        let own = sampled(&distance_of(component)?, grid, &lattice, &world);
        for (((found, deepest), own), whole) in
            found.iter_mut().zip(&mut deepest).zip(own).zip(&whole)
        {
            if *whole > 0.0 && own > *deepest {
                (*found, *deepest) = (label, own);
            }
        }
    }
    let file = directory.file(format!("{name}.nii.gz"));
    let bytes: Option<Vec<u8>> = found
        .iter()
        .map(|&label| u8::try_from(label).ok())
        .collect();
    let values = match &bytes {
        Some(bytes) => Values::Mask(bytes),
        None => Values::Labels(&found),
    };
    Ok(write_volume(&file, &lattice, &values)?)
}

/// The world of the results with the samples there, for results in files.
fn samples_in_world<const D: usize>(
    directory: &ResultDir,
    inputs: &[Input<D>],
    grid: Grid<D>,
) -> Option<(WorldFrame<D>, Lattice)> {
    let world = WorldFrame::of_inputs(inputs).filter(|_| directory.has_files())?;
    // Other programs refuse sheared axes; results lie on the nodes then.
    let samples = lattice_of(&inputs[world.number()]).filter(Lattice::is_orthogonal);
    let samples = samples.or_else(|| world.lattice(&grid))?;
    let position = |unit| in_space(world.position(unit));
    let lattice = within_box(&samples, &grid, &position);
    Some((world, lattice))
}

fn distance_of<const D: usize>(shape: &Contour<D>) -> Result<ContourDistance<D>, CliError> {
    ContourDistance::new(shape).map_err(|error| CliError::Computation {
        message: format!("the shape has no distance: {error}"),
        remedy: "use a finer --grid".into(),
    })
}

/// The samples of a lattice, continued where needed, that lie in the box of a grid, whose points have these
/// positions.
pub(super) fn within_box<const D: usize>(
    samples: &Lattice,
    grid: &Grid<D>,
    position: &dyn Fn([f64; D]) -> [f64; 3],
) -> Lattice {
    let sides = grid.extent();
    let border = BORDER * sides.into_iter().fold(0.0, f64::max);
    let corner = |number: usize| {
        let unit = std::array::from_fn(|k| [border, sides[k] - border][number >> k & 1]);
        position(unit)
    };
    samples.around((0..8).map(corner))
}

/// A distance in millimetres at the samples of a lattice: interpolated between the nodes of the grid,
/// and exact outside of it, where corners of a lattice lie that is turned against it.
fn sampled<const D: usize>(
    distance: &ContourDistance<D>,
    grid: Grid<D>,
    lattice: &Lattice,
    world: &WorldFrame<D>,
) -> Vec<f32> {
    let nodal = distance.sample(grid);
    let extent = grid.extent();
    let unit = |index: usize| world.unit(of_space(lattice.position(index)));
    let within = |unit: &[f64; D]| (0..D).all(|k| (0.0..=extent[k]).contains(&unit[k]));
    let millimetres = |distance: f64| (world.length() * distance) as f32;
    let mut near: Vec<Option<f32>> = vec![None; lattice.count()];
    fe_grid::parallel::for_each_chunk(&mut near, SAMPLES_AT_ONCE, 1, &|chunk, near| {
        for (i, near) in near.iter_mut().enumerate() {
            let unit = unit(chunk * SAMPLES_AT_ONCE + i);
            *near = within(&unit).then(|| millimetres(nodal.sample(unit)[0]));
        }
    });
    let outside = near.iter().enumerate().filter(|(_, near)| near.is_none());
    let outside: Vec<[f64; D]> = outside.map(|(index, _)| unit(index)).collect();
    let mut outside = distance.signed_distances(&outside).into_iter();
    let value = |near: Option<f32>| near.or_else(|| outside.next().map(millimetres));
    near.into_iter().filter_map(value).collect()
}

/// The inverse of a deformation at the nodes. Where a node lies outside the image of the box, the
/// displacement there is taken back.
pub(super) fn inverted<const D: usize>(displacement: &Field<f64, D, D>) -> Field<f64, D, D> {
    let inverse = InverseDeformation::new(displacement);
    let grid = *displacement.grid();
    let n = grid.n_nodes();
    let mut back = Field::zeros(grid);
    for node in 0..n {
        let here = grid.position(grid.node(node));
        let u = match inverse.position(node) {
            Some(there) => std::array::from_fn(|k| there[k] - here[k]),
            None => displacement.at(node).map(|u| -u),
        };
        for k in 0..D {
            back.as_mut_slice()[k * n + node] = u[k];
        }
    }
    back
}

/// The ways from the nodes in one world to where they go in another, in millimetres to the left, to
/// the back and upwards, on a lattice that has other samples before the first node: nodes outside of the box
/// are displaced as the nearest one in it.
fn ways<const D: usize>(
    displacement: &Field<f64, D, D>,
    from: &WorldFrame<D>,
    to: &WorldFrame<D>,
    (lattice, before): (&Lattice, [usize; 3]),
) -> Vec<[f32; 3]> {
    let grid = *displacement.grid();
    let (n, h) = (grid.nodes_per_axis(), grid.spacing());
    (0..lattice.count())
        .map(|index| {
            let sample = lattice.sample(index);
            let nearest =
                std::array::from_fn(|k| sample[k].saturating_sub(before[k]).min(n[k] - 1));
            let here = std::array::from_fn(|k| (sample[k] as f64 - before[k] as f64) * h);
            let u = displacement.at(grid.node_index(nearest));
            let there = to.position(std::array::from_fn(|k| here[k] + u[k]));
            let start = from.position(here);
            let way = in_space::<D>(std::array::from_fn(|k| there[k] - start[k]));
            [-way[0] as f32, -way[1] as f32, way[2] as f32]
        })
        .collect()
}

/// The first coordinates of a point.
fn of_space<const D: usize>(p: [f64; 3]) -> [f64; D] {
    std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0))
}
