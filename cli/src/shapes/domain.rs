//! The box of the grid.
//!
//! Shapes are placed and aligned in the unit box, in which the longest side of the largest is
//! `1 - 2 MARGIN`: its side is the unit of length of all energies, and the place of a shape in it depends on
//! nothing but the shapes. The grid is chosen after that. It lies in the middle of the unit box
//! ([`corner_in_unit_box`]); its first node becomes the origin, so that frames and motions are those
//! of the unit box, moved.
//!
//! - A cube of `n` nodes a side is the unit box: what all results were computed on before there was a
//!   choice, and what results of different inputs are compared on.
//! - A box that fits ([`Sides::Fit`]) has the spacing of that cube, and its nodes. As much room is left
//!   on all sides as the cube leaves along the side where the shapes reach farthest; there, both end at
//!   the same place. It is symmetric about the centre of the unit box.
//! - A box of given nodes has a longest side of one. Shapes that do not fit into it are moved to its
//!   middle and made smaller together, as those that do not fit into the unit box are.
//! - A given spacing is one of the inputs' units; it does not change the unit of length. The cube is as
//!   long as the unit box, or a little longer.
//!
//! Sides that are not given are rounded up to numbers of cells that can be halved as often as those of
//! the longest side, down to 8 to 15 ([`divisor`]): a minimisation that starts on a coarsest grid of
//! another spacing than that of a cube may end in another minimum.
//!
//! Void around shapes is soft, so that its extent matters little for deformations and their energies;
//! `docs/performance.md` has figures. The mismatch of phase fields, which have tails in the void, is
//! smaller in a smaller box, by a part that vanishes with the spacing.

use fe_grid::{Grid, GridError, ScalarField};
use levelset::Contour;
use nalgebra::SVector;
use shape_average::align::RigidMotion;
use shapespace_input::frame::corner_in_unit_box;
use shapespace_input::place::divisor;

use super::align::{ROOM, keep_inside};
use super::{Input, common_scale};
use crate::error::CliError;
use crate::grid::{Counts, Sides, counts, is_allowed};
use crate::numbers::shown;
use crate::options::{MaskOptions, Size, positive};

/// Room around shapes at least, in a box of given nodes at most a share of its side.
const LEAST_ROOM: f64 = ROOM[0];
const ROOM_SHARE: f64 = 1.0 / 6.0;
/// Cells along the longest side to which grids can be coarsened at least: the coarsest grid of averages
/// has so many.
const COARSEST_CELLS: usize = 8;
/// Nodes of the smallest cube of which the void is worth a word.
const LEAST_ADVISED: usize = 30_000;
/// Sides that are longer than a number of cells by rounding do not need one more.
const ROUNDING: f64 = 1e-6;

/// What is known of the grid before shapes are placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Domain<const D: usize> {
    /// All of the unit box, with this number of nodes a side.
    Cube(usize),
    /// The part of that cube that shapes need.
    Fit(usize),
    /// A box whose longest side is one.
    Box(Grid<D>),
    /// A grid of this spacing, in the units of the inputs.
    Spaced(f64, Sides),
}

impl<const D: usize> Domain<D> {
    /// The domain that the options ask for.
    ///
    /// # Errors
    /// [`CliError::Option`] for numbers of nodes that are not allowed, and for options that do not go
    /// together.
    pub fn new(options: &MaskOptions) -> Result<Self, CliError> {
        let refused = |option, value: String, remedy: &str| CliError::Option {
            option,
            value,
            remedy: remedy.into(),
        };
        let Some(spacing) = options.spacing else {
            return match (counts(options.grid)?, options.sides) {
                (Counts::Cube(nodes), Sides::Cube) => Ok(Self::Cube(nodes)),
                (Counts::Cube(nodes), Sides::Fit) => Ok(Self::Fit(nodes)),
                (Counts::Box(grid), Sides::Cube) => Ok(Self::Box(grid)),
                (Counts::Box(_), Sides::Fit) => Err(refused(
                    "--box",
                    "fit".into(),
                    "--grid says how long all sides are: give the nodes along the longest side only, \
                     or leave out --box",
                )),
            };
        };
        positive("spacing", Some(spacing))?;
        if options.grid.is_some() {
            return Err(refused(
                "--spacing",
                shown(spacing),
                "--grid says how many nodes there are: leave out one of both",
            ));
        }
        if options.size == Size::Equal {
            return Err(refused(
                "--spacing",
                shown(spacing),
                "shapes that are scaled to equal size have no common unit of length: use --grid",
            ));
        }
        Ok(Self::Spaced(spacing, options.sides))
    }

    /// The grid whose nodal values an array has that is used as it is.
    pub fn nodal(&self) -> Option<Grid<D>> {
        match *self {
            Self::Cube(nodes) | Self::Fit(nodes) => Some(Grid::cube(nodes)),
            Self::Box(grid) => Some(grid),
            Self::Spaced(..) => None,
        }
    }

    /// Chooses the grid for shapes in the unit box, and moves them to it.
    ///
    /// # Errors
    /// [`CliError::Option`] for a spacing of too many or too few nodes.
    pub fn settle(&self, inputs: &mut [Input<D>]) -> Result<Grid<D>, CliError> {
        if let Self::Box(grid) = self {
            let nodal = |input: &Input<D>| input.is_nodal();
            if !inputs.iter().any(nodal) {
                keep_inside(inputs, room(&grid.extent()));
            }
        }
        let sides = sides(inputs);
        let grid = match *self {
            Self::Spaced(spacing, _) => {
                let scale = common_scale(inputs.iter().map(Input::scale)).ok_or_else(|| {
                    CliError::Option {
                        option: "--spacing",
                        value: shown(spacing),
                        remedy: "the shapes have no common unit of length: use --grid".into(),
                    }
                })?;
                self.grid(sides, scale)?
            }
            _ => self.grid(sides, 1.0)?,
        };
        let corner = corner_in_unit_box(&grid);
        if corner.iter().any(|x| *x != 0.0) {
            for input in inputs {
                input.shift(corner.map(|x| -x));
            }
        }
        Ok(grid)
    }

    /// Advice to leave out the void beside settled shapes, where that is half of the nodes or more.
    pub fn advice(&self, inputs: &[Input<D>]) -> Option<String> {
        let Self::Cube(nodes) = *self else {
            return None;
        };
        let cube = Grid::<D>::cube(nodes).n_nodes();
        let fit = Self::Fit(nodes).grid(sides(inputs), 1.0).ok()?;
        let saves = cube >= LEAST_ADVISED && 2 * fit.n_nodes() <= cube;
        saves.then(|| {
            format!(
                "--box fit would take {} nodes instead of {cube}",
                fit.n_nodes()
            )
        })
    }

    /// The grid for shapes that need these sides in the unit box, whose side is `scale` for one length
    /// unit of the inputs.
    ///
    /// # Errors
    /// As [`Self::settle`].
    pub fn grid(&self, sides: [f64; D], scale: f64) -> Result<Grid<D>, CliError> {
        match *self {
            Self::Cube(nodes) => Ok(Grid::cube(nodes)),
            Self::Box(grid) => Ok(grid),
            Self::Fit(nodes) => {
                let most = nodes - 1;
                let unit = divisor(most, COARSEST_CELLS);
                let cells = sides.map(|side| {
                    let needed = rounded_up(side * most as f64, unit).min(most);
                    // The nodes are those of the cube if as many cells are missing at both ends.
                    needed + (most - needed) % 2
                });
                let grid = Grid::with_nodes(cells.map(|c| c + 1), (most as f64).recip());
                grid.map_err(|error| unusable("--box", "fit".into(), &error))
            }
            Self::Spaced(spacing, sides_of) => {
                let h = spacing * scale;
                let longest = sides.into_iter().fold(1.0, f64::max);
                let sides = match sides_of {
                    Sides::Cube => [longest; D],
                    Sides::Fit => sides,
                };
                let most = sides.into_iter().fold(0.0, f64::max) / h;
                let unit = divisor((most - ROUNDING).ceil().max(1.0) as usize, COARSEST_CELLS);
                let cells = sides.map(|side| rounded_up(side / h, unit));
                if !is_allowed(cells) {
                    return Err(CliError::Option {
                        option: "--spacing",
                        value: shown(spacing),
                        remedy: format!(
                            "the grid would have {} nodes; a spacing of {} gives as many as usual",
                            cells.map(|c| c.saturating_add(1).to_string()).join("x"),
                            shown(usual_spacing::<D>(scale))
                        ),
                    });
                }
                let grid = Grid::with_nodes(cells.map(|c| c + 1), h);
                grid.map_err(|error| unusable("--spacing", shown(spacing), &error))
            }
        }
    }
}

fn unusable(option: &'static str, value: String, error: &GridError) -> CliError {
    CliError::Option {
        option,
        value,
        remedy: error.to_string(),
    }
}

/// The spacing of the usual cube, with three figures, in the units of inputs of this scale.
fn usual_spacing<const D: usize>(scale: f64) -> f64 {
    let spacing = 1.0 / (if D == 2 { 128.0 } else { 64.0 } * scale);
    let digits = 10f64.powf(spacing.log10().floor() - 2.0);
    (spacing / digits).round() * digits
}

/// The smallest multiple of a number of cells that is no smaller than a number.
fn rounded_up(cells: f64, unit: usize) -> usize {
    let units = ((cells - ROUNDING) / unit as f64).ceil().max(1.0);
    (units as usize).saturating_mul(unit)
}

/// The sides of the box that shapes need in the unit box.
fn sides<const D: usize>(inputs: &[Input<D>]) -> [f64; D] {
    let reach = reach(inputs);
    let room = f64::max(LEAST_ROOM, 0.5 - reach.into_iter().fold(0.0, f64::max));
    reach.map(|reach| 2.0 * (reach + room))
}

/// How far boundaries reach from the centre of the unit box, along each axis.
fn reach<const D: usize>(inputs: &[Input<D>]) -> [f64; D] {
    let points = inputs.iter().flat_map(|input| input.contour.points());
    points.fold([0.0; D], |far, p| {
        std::array::from_fn(|k| f64::max(far[k], (p[k] - 0.5).abs()))
    })
}

/// Where shapes stay in a box of these sides in the middle of the unit box.
pub(super) fn room<const D: usize>(sides: &[f64; D]) -> [[f64; 2]; D] {
    sides.map(|side| {
        let (end, room) = (0.5 - 0.5 * side, f64::min(LEAST_ROOM, ROOM_SHARE * side));
        [end + room, 1.0 - end - room]
    })
}

impl<const D: usize> Input<D> {
    /// Moves it together with its frame.
    fn shift(&mut self, by: [f64; D]) {
        self.contour = moved(&self.contour, by);
        self.frame = self.frame.moved(by);
        if let Some(alignment) = &mut self.alignment {
            // y + b = R (x + b) + t - R b + b.
            let (b, rotation) = (SVector::from(by), *alignment.motion.rotation());
            let translation = alignment.motion.translation() - rotation * b + b;
            if let Some(motion) = RigidMotion::new(rotation, translation) {
                alignment.motion = motion;
            }
        }
    }
}

/// A boundary that is moved by a vector.
pub(crate) fn moved<const D: usize>(contour: &Contour<D>, by: [f64; D]) -> Contour<D> {
    contour.map(|p| std::array::from_fn(|k| p[k] + by[k]))
}

/// The values at the nodes of a grid in the middle of that of a field; none where these are no nodes of
/// the field.
pub(super) fn middle_part<const D: usize>(
    field: &ScalarField<f64, D>,
    grid: Grid<D>,
) -> Option<ScalarField<f64, D>> {
    if field.grid().spacing() != grid.spacing() {
        return None;
    }
    let (all, own) = (field.grid().nodes_per_axis(), grid.nodes_per_axis());
    let mut first = [0; D];
    for k in 0..D {
        let rest = all[k].checked_sub(own[k])?;
        if rest % 2 != 0 {
            return None;
        }
        first[k] = rest / 2;
    }
    let value = |index| {
        let node = grid.node(index);
        let whole = std::array::from_fn(|k| first[k] + node[k]);
        field.as_slice()[field.grid().node_index(whole)]
    };
    let values = (0..grid.n_nodes()).map(value).collect();
    ScalarField::from_vec(grid, values).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn boxes_have_room_for_their_sides_and_are_as_coarse_as_cubes(
            level in 4u32..9,
            sides in prop::array::uniform2(0.02..1.0f64),
        ) {
            let nodes = (1usize << level) + 1;
            let sides = [1.0, sides[0], sides[1]];
            let grid = Domain::<3>::Fit(nodes).grid(sides, 1.0).unwrap();
            let cube = Grid::<3>::cube(nodes);
            prop_assert_eq!(grid.spacing(), cube.spacing());
            prop_assert_eq!(grid.nodes_per_axis()[0], nodes);
            let coarsest = [grid, cube].map(|grid| grid.hierarchy(9)[0].spacing());
            prop_assert_eq!(coarsest[0], coarsest[1]);
            for k in 0..3 {
                // An eighth of the longest side is one cell of the coarsest grid.
                let (own, asked) = (grid.extent()[k], sides[k]);
                prop_assert!(own + 1e-6 > asked && own < asked + 0.2500001, "{own} {asked}");
                prop_assert_eq!((nodes - grid.nodes_per_axis()[k]) % 2, 0);
            }
        }

        #[test]
        fn spacings_are_kept(spacing in 0.02..0.2f64, side in 0.1..1.0f64, scale in 0.01..100.0f64) {
            let spacing = spacing / scale;
            for sides in [Sides::Cube, Sides::Fit] {
                let domain = Domain::<2>::Spaced(spacing, sides);
                let Ok(grid) = domain.grid([1.0, side], scale) else {
                    // Fewer than nine nodes a side.
                    prop_assert!(side / (spacing * scale) < 8.0);
                    continue;
                };
                prop_assert_eq!(grid.spacing(), spacing * scale);
                let [x, y] = grid.extent();
                prop_assert!(x > 1.0 - 1e-6 && y > side - 1e-6);
                prop_assert_eq!(x == y || side < 1.0, true);
                prop_assert!(is_allowed(grid.cells_per_axis()));
            }
        }
    }

    #[test]
    fn the_middle_of_a_field_has_its_values() {
        let all = ScalarField::<f64, 2>::from_fn(Grid::cube(17), |[x, y]| [x + 10.0 * y]);
        let grid = Grid::with_nodes([17, 9], 1.0 / 16.0).unwrap();
        let part = middle_part(&all, grid).unwrap();
        assert_eq!(part.as_slice()[0], 2.5);
        assert_eq!(part.as_slice()[17 * 9 - 1], 1.0 + 7.5);
        let other = Grid::with_nodes([17, 9], 0.1).unwrap();
        assert!(middle_part(&all, other).is_none());
        let beside = Grid::with_nodes([17, 10], 1.0 / 16.0).unwrap();
        assert!(middle_part(&all, beside).is_none());
    }
}
