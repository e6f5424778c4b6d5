//! Deformations as displacement fields in the world, as ITK applies them, and volumes of shapes.
//!
//! A deformation `φ` maps an input onto the average in the unit box. With the maps `A` of the world of
//! the average and `S` of the world of the input to the box, it is `A⁻¹ φ S` in the world. A program
//! that resamples an image asks the other way round, for every point of its result: `warp` is
//! `S⁻¹ φ⁻¹ A`, which resamples the input in the space of the average, `inverse_warp` is `A⁻¹ φ S`,
//! which resamples the average in the space of the input. Both are given at the nodes of the grid,
//! whose piecewise multilinear interpolation is the deformation itself.

use fe_grid::{Field, Grid, InverseDeformation, ScalarField, parallel};
use levelset::{Contour, ContourDistance};

use crate::error::CliError;
use crate::output::nifti::{Values, write_volume};
use crate::output::{ResultDir, numbered};
use crate::shapes::{InputRecord, WorldFrame, in_space};
use shapespace_input::lattice::Lattice;

/// Share of the longest side of the box, at all of its faces, where no volumes of shapes are written: shapes
/// do not reach it. Grey images fill the box.
const BORDER: f64 = 0.05;

/// Most samples of a volume that is written, or if that is more, of one for every node of the grid: finer ones say
/// nothing more.
const MOST_SAMPLES: usize = 1 << 24;
/// See [`MOST_SAMPLES`].
const FINEST: usize = 64;

/// Samples that one thread evaluates at a time.
pub(super) const SAMPLES_AT_ONCE: usize = 1024;

/// The world of an input with its samples there. Flat shapes have none.
pub(crate) struct Space<const D: usize> {
    world: WorldFrame<D>,
    samples: Lattice,
    /// The share of the box that volumes leave out.
    border: f64,
}

impl<const D: usize> Space<D> {
    /// That of the results of these inputs, for results in files.
    pub fn of_inputs(directory: &ResultDir, inputs: &[InputRecord<D>]) -> Option<Self> {
        let world = WorldFrame::of_inputs(inputs).filter(|_| directory.has_files())?;
        Self::of_input(inputs, world.number())
    }

    /// That of one of several inputs.
    pub fn of_input(inputs: &[InputRecord<D>], number: usize) -> Option<Self> {
        let (world, input) = (WorldFrame::of_one(inputs, number)?, &inputs[number]);
        Some(Self {
            world,
            samples: Lattice::of_frame(&input.size, &input.frame)?,
            border: border_of(input),
        })
    }

    /// The point of the box at world coordinates.
    pub(super) fn unit(&self, world: [f64; D]) -> [f64; D] {
        self.world.unit(world)
    }

    /// The part of a lattice, continued where needed, that lies in the box of a grid.
    fn within(&self, samples: &Lattice, grid: &Grid<D>) -> Lattice {
        let position = |unit| in_space(self.world.position(unit));
        within_box(samples, grid, self.border, &position)
    }

    /// Where volumes are written: the samples, continued where needed, in the box of a grid. Other programs
    /// refuse sheared axes; volumes lie on the nodes then. They lie on the nodes and those half way between, too,
    /// where the samples are far finer, such as those of a small surface beside a large one.
    pub(super) fn lattice(&self, grid: &Grid<D>) -> Option<Lattice> {
        if self.samples.is_orthogonal() {
            let own = self.within(&self.samples, grid);
            if own.count() <= MOST_SAMPLES.max(FINEST * grid.n_nodes()) {
                return Some(own);
            }
            return Some(self.within(&self.world.lattice(grid)?.refined(2), grid));
        }
        Some(self.within(&self.world.lattice(grid)?, grid))
    }
}

/// Writes the steps of a path, from 1, and their inverses, where its inputs have a world: `warp` of a step
/// resamples the shape before it as that after it.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_steps_in_world<const D: usize>(
    directory: &ResultDir,
    inputs: &[InputRecord<D>],
    displacements: &[Field<f64, D, D>],
) -> Result<(), CliError> {
    let Some(space) = Space::of_inputs(directory, inputs) else {
        return Ok(());
    };
    for (k, displacement) in displacements.iter().enumerate() {
        let inverse = inverted(displacement);
        write_both(directory, k + 1, [&space; 2], [displacement, &inverse])?;
    }
    Ok(())
}

/// Writes the deformation of a shape in one space onto one in another, and its inverse.
pub(super) fn write_both<const D: usize>(
    directory: &ResultDir,
    number: usize,
    [start, end]: [&Space<D>; 2],
    [displacement, inverse]: [&Field<f64, D, D>; 2],
) -> Result<(), CliError> {
    let warps = [
        ("warp", end, start, inverse),
        ("inverse_warp", start, end, displacement),
    ];
    for (kind, from, to, displacement) in warps {
        let Some(nodes) = from.world.lattice(displacement.grid()) else {
            continue;
        };
        // Where images are resampled by it there must be a way: elsewhere ITK takes none for a way of zero.
        let resampled = from.within(&from.samples, displacement.grid());
        let (lattice, before) = nodes.reaching(resampled.corners());
        let vectors = ways(displacement, &from.world, &to.world, (&lattice, before));
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
    inputs: &[InputRecord<D>],
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

/// Writes average grey images in the world of the results, on the samples of the input that leads, continued
/// where needed, in all of the box.
///
/// # Errors
/// [`CliError::Output`].
pub(crate) fn write_images<const D: usize>(
    directory: &ResultDir,
    inputs: &[InputRecord<D>],
    images: &[(&str, &ScalarField<f64, D>)],
) -> Result<(), CliError> {
    let Some(space) = Space::of_inputs(directory, inputs) else {
        return Ok(());
    };
    let world = &space.world;
    for (name, image) in images {
        let Some(lattice) = space.lattice(image.grid()) else {
            continue;
        };
        let mut values = vec![0.0; lattice.count()];
        parallel::for_each_chunk(&mut values, SAMPLES_AT_ONCE, 1, &|chunk, values| {
            for (i, value) in values.iter_mut().enumerate() {
                let unit = world.unit(of_space(lattice.position(chunk * SAMPLES_AT_ONCE + i)));
                *value = image.sample(unit)[0] as f32;
            }
        });
        let file = directory.file(format!("{name}.nii.gz"));
        write_volume(&file, &lattice, &Values::Numbers(&values))?;
    }
    Ok(())
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
    inputs: &[InputRecord<D>],
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
    inputs: &[InputRecord<D>],
    grid: Grid<D>,
) -> Option<(WorldFrame<D>, Lattice)> {
    let space = Space::of_inputs(directory, inputs)?;
    let lattice = space.lattice(&grid)?;
    Some((space.world, lattice))
}

fn distance_of<const D: usize>(shape: &Contour<D>) -> Result<ContourDistance<D>, CliError> {
    ContourDistance::new(shape).map_err(|error| CliError::Computation {
        message: format!("the shape has no distance: {error}"),
        remedy: "use a finer --grid".into(),
    })
}

/// The share of the box that volumes leave out which are written on the samples of this input.
pub(super) fn border_of<const D: usize>(leading: &InputRecord<D>) -> f64 {
    if leading.grey.is_some() { 0.0 } else { BORDER }
}

/// The samples of a lattice, continued where needed, that lie in the box of a grid without its border, whose
/// points have these positions.
pub(super) fn within_box<const D: usize>(
    samples: &Lattice,
    grid: &Grid<D>,
    border: f64,
    position: &dyn Fn([f64; D]) -> [f64; 3],
) -> Lattice {
    let sides = grid.extent();
    let border = border * sides.into_iter().fold(0.0, f64::max);
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
    parallel::for_each_chunk(&mut near, SAMPLES_AT_ONCE, 1, &|chunk, near| {
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
    let mut ways = vec![[0.0; D]; n];
    parallel::for_each_mut(&mut ways, SAMPLES_AT_ONCE, &|node, way| {
        let here = grid.position(grid.node(node));
        *way = match inverse.position(node) {
            Some(there) => std::array::from_fn(|k| there[k] - here[k]),
            None => displacement.at(node).map(|u| -u),
        };
    });
    let mut back = Field::zeros(grid);
    for (k, component) in back.as_mut_slice().chunks_exact_mut(n).enumerate() {
        for (back, way) in component.iter_mut().zip(&ways) {
            *back = way[k];
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
    let mut ways = vec![[0.0; 3]; lattice.count()];
    parallel::for_each_mut(&mut ways, SAMPLES_AT_ONCE, &|index, found| {
        let sample = lattice.sample(index);
        let nearest = std::array::from_fn(|k| sample[k].saturating_sub(before[k]).min(n[k] - 1));
        let here = std::array::from_fn(|k| (sample[k] as f64 - before[k] as f64) * h);
        let u = displacement.at(grid.node_index(nearest));
        let there = to.position(std::array::from_fn(|k| here[k] + u[k]));
        let start = from.position(here);
        let way = in_space::<D>(std::array::from_fn(|k| there[k] - start[k]));
        *found = [-way[0] as f32, -way[1] as f32, way[2] as f32];
    });
    ways
}

/// The first coordinates of a point.
pub(super) fn of_space<const D: usize>(p: [f64; 3]) -> [f64; D] {
    std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0))
}
