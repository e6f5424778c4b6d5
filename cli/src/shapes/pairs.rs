//! Pairwise rigid alignment of shapes.
//!
//! For quantities of two shapes that do not depend on their positions, every pair is aligned
//! separately: the shape whose boundary has fewer points is moved onto the other one, as
//! [`mod@super::align`] moves all shapes onto one reference; this does not depend on their order. The pair is then moved to the middle of
//! the box, and both shapes are magnified by one factor such that they fill it: a grid resolves them
//! as well as it can, however small they are beside others. A length of a magnified pair is
//! `magnification^(D/2)` times that in the common scale of all shapes, in which values of pairs are
//! compared.
//!
//! All pairs have one grid: the unit box, a box of given sides, or the smallest box that contains all
//! of them. Where its spacing is given in the units of the inputs, shapes are not magnified.

use std::borrow::Cow;
use std::collections::BTreeMap;

use fe_grid::{Distribution, Grid, ScalarField, parallel};
use levelset::{Cause, Contour, ContourDistance, Doubt, bounds};
use shape_average::align::{Alignment, RigidMotion};

use super::align::{ROOM, coarse_distances};
use super::domain::{Domain, moved, room};
use super::inspect::Likeness;
use super::pose::pose;
use super::{Input, common_scale};
use crate::error::CliError;
use shapespace_input::frame::corner_in_unit_box;

/// The grid after its spacing has been halved so many times.
pub(crate) fn refined<const D: usize>(grid: &Grid<D>, times: u32) -> Grid<D> {
    (0..times).fold(*grid, |grid, _| grid.finer())
}

/// Shapes and the relative positions of all pairs.
pub(crate) struct Pairs<const D: usize> {
    pub inputs: Vec<Input<D>>,
    /// Signed distances of the shapes before the alignment.
    pub distances: Vec<ScalarField<f64, D>>,
    /// The grid of all pairs.
    pub grid: Grid<D>,
    /// From the unit box, in which pairs are aligned, to the boxes of the shapes and of the pairs.
    corners: [[f64; D]; 2],
    /// The pairs that are aligned, the smaller number first, sorted.
    aligned: Vec<[usize; 2]>,
    /// Their positions.
    positions: Vec<Position<D>>,
    /// Whether they are magnified to fill the box.
    magnified: bool,
}

/// The position of a pair.
#[derive(Clone, Copy, Debug)]
struct Position<const D: usize> {
    /// Motion of one of the shapes onto the other one.
    motion: RigidMotion<D>,
    /// Whether it is the first one that is moved.
    first_moves: bool,
    /// Where both lie after that.
    filling: Filling<D>,
}

/// The motion of shapes that lie on each other to the middle of the box.
#[derive(Clone, Copy, Debug)]
struct Filling<const D: usize> {
    /// The centre of all.
    middle: [f64; D],
    /// The factor by which they then fill the box.
    magnification: f64,
}

impl<const D: usize> Filling<D> {
    /// That of shapes between two corners which stay within these limits, magnified at most by a factor.
    fn new([low, high]: [[f64; D]; 2], within: &[[f64; 2]; D], most: f64) -> Self {
        let share = |k: usize| (within[k][1] - within[k][0]) / (high[k] - low[k]);
        Self {
            middle: std::array::from_fn(|k| 0.5 * (low[k] + high[k])),
            magnification: (0..D).map(share).fold(most, f64::min),
        }
    }

    fn centred(&self, p: [f64; D]) -> [f64; D] {
        std::array::from_fn(|k| 0.5 + self.magnification * (p[k] - self.middle[k]))
    }
}

/// Signed distances of both shapes of a pair.
pub(crate) type PairFields<'a, const D: usize> =
    (Cow<'a, ScalarField<f64, D>>, Cow<'a, ScalarField<f64, D>>);

/// The figure of a shape that is not doubted.
const UNDOUBTED: f64 = f64::MAX;

/// Whether the first shape of a pair is moved onto the second one: that with fewer points of its boundary, of as many
/// the smaller one.
fn first_moves<const D: usize>(inputs: &[Input<D>], [i, j]: [usize; 2]) -> bool {
    let points = |shape: usize| inputs[shape].contour.points().len();
    let order = points(i).cmp(&points(j));
    order
        .then(inputs[i].volume.total_cmp(&inputs[j].volume))
        .is_lt()
}

/// Adds the doubts about shapes that fit others better if they were reflected.
fn add_reflections<const D: usize>(
    inputs: &mut [Input<D>],
    pairs: &[[usize; 2]],
    figures: &[[f64; 1]],
) {
    let doubted = pairs.iter().zip(figures).filter_map(|(pair, [figure])| {
        Doubt::check(Cause::Reflection, *figure).map(|doubt| (*pair, doubt))
    });
    for (shape, doubt) in reflected_of_pairs(&doubted.collect::<Vec<_>>()) {
        inputs[shape].doubts.push(doubt);
    }
}

/// The reflected shapes of doubtful pairs, each with the doubt of its most doubtful one. One reflected shape makes all
/// its pairs doubtful: the shape of most pairs is named, without these that of most others, and so on. Of a single pair
/// it is the second shape.
fn reflected_of_pairs(doubted: &[([usize; 2], Doubt)]) -> Vec<(usize, Doubt)> {
    let mut of_shape: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (k, (pair, _)) in doubted.iter().enumerate() {
        for &shape in pair {
            of_shape.entry(shape).or_default().push(k);
        }
    }
    let mut left: BTreeMap<usize, usize> = of_shape.iter().map(|(i, of)| (*i, of.len())).collect();
    let mut is_left = vec![true; doubted.len()];
    let mut found = Vec::new();
    while let Some((&most, _)) = left
        .iter()
        .filter(|(_, count)| **count > 0)
        .max_by_key(|(shape, count)| (**count, **shape))
    {
        let mut worst: Option<Doubt> = None;
        for &k in &of_shape[&most] {
            if !std::mem::take(&mut is_left[k]) {
                continue;
            }
            let (pair, doubt) = doubted[k];
            for shape in pair {
                left.entry(shape).and_modify(|count| *count -= 1);
            }
            if worst.is_none_or(|worst| doubt.figure.total_cmp(&worst.figure).is_lt()) {
                worst = Some(doubt);
            }
        }
        found.extend(worst.map(|doubt| (most, doubt)));
    }
    found
}

impl<const D: usize> Pairs<D> {
    /// Pairs of shapes on one grid that are not aligned.
    pub fn placed(
        inputs: Vec<Input<D>>,
        distances: Vec<ScalarField<f64, D>>,
        grid: Grid<D>,
    ) -> Self {
        Self {
            inputs,
            distances,
            grid,
            corners: [[0.0; D]; 2],
            aligned: Vec::new(),
            positions: Vec::new(),
            magnified: false,
        }
    }

    /// Aligns these pairs of shapes, sorted and the smaller number first, which are on the grid `own`,
    /// and chooses the grid of the pairs; each process aligns some of them. Collective. `stop` is called between two pairs; if it returns true, the
    /// result is `None`.
    ///
    /// # Errors
    /// [`CliError::Computation`] where a shape is too small to be aligned, and those of
    /// [`Domain::grid`].
    pub fn aligned(
        mut inputs: Vec<Input<D>>,
        distances: Vec<ScalarField<f64, D>>,
        pairs: Vec<[usize; 2]>,
        own: &Grid<D>,
        domain: &Domain<D>,
        distribution: &Distribution,
        stop: impl Fn() -> bool + Sync,
    ) -> Result<Option<Self>, CliError> {
        let corner = corner_in_unit_box(own);
        let contours = inputs.iter().map(|input| moved(&input.contour, corner));
        let contours: Vec<Contour<D>> = contours.collect();
        let contours: Vec<&Contour<D>> = contours.iter().collect();
        let coarse = coarse_distances(&contours, distribution)?;
        let distribution = distribution.of(pairs.len());
        let found: Vec<Result<_, CliError>> = parallel::map(&pairs[distribution.own()], &|&pair| {
            if stop() {
                return Ok(None);
            }
            let [i, j] = if first_moves(&inputs, pair) {
                [pair[1], pair[0]]
            } else {
                pair
            };
            let aligned = pose(&coarse[i], &coarse[j])?;
            let own = aligned.mismatch;
            let doubt = Likeness::doubt_of_aligned(&coarse[i], &coarse[j], own)?;
            let figure = doubt.map_or(UNDOUBTED, |doubt| doubt.figure);
            Ok(Some((aligned.to_numbers(), [figure])))
        });
        let found: Result<Option<Vec<_>>, CliError> = found.into_iter().collect();
        // Interrupted on the first process, which ends the others.
        let Some(own) = found? else {
            return Ok(None);
        };
        let (own, figures): (Vec<_>, Vec<_>) = own.into_iter().unzip();
        add_reflections(&mut inputs, &pairs, &distribution.share(&figures));
        let found = distribution.share(&own).into_iter();
        let motions = found.map(|numbers| Alignment::from_numbers(numbers).motion);
        let mut positions = Vec::with_capacity(pairs.len());
        let within = match domain {
            Domain::Box(grid) => room(&grid.extent()),
            _ => [ROOM; D],
        };
        let mut sides = [0.0; D];
        for (&[i, j], motion) in pairs.iter().zip(motions) {
            let first_moves = first_moves(&inputs, [i, j]);
            let [fixed, other] = if first_moves { [j, i] } else { [i, j] };
            let moved = motion.apply_to_contour(contours[other]);
            let both = [contours[fixed], &moved].map(Contour::points);
            let [low, high] = bounds(both.into_iter().flatten().copied());
            let mut filling = Filling::new([low, high], &within, f64::INFINITY);
            if matches!(domain, Domain::Spaced(..)) {
                filling.magnification = 1.0;
            }
            sides = std::array::from_fn(|k| {
                let own = filling.magnification * (high[k] - low[k]) + 2.0 * ROOM[0];
                f64::max(sides[k], own)
            });
            positions.push(Position {
                motion,
                first_moves,
                filling,
            });
        }
        let grid = domain.grid(
            sides,
            common_scale(inputs.iter().map(Input::scale)).unwrap_or(1.0),
        )?;
        Ok(Some(Self {
            inputs,
            distances,
            grid,
            corners: [corner, corner_in_unit_box(&grid)],
            aligned: pairs,
            positions,
            magnified: !matches!(domain, Domain::Spaced(..)),
        }))
    }

    /// The position of a pair, the smaller number first; none if pairs are not aligned.
    fn position(&self, i: usize, j: usize) -> Option<&Position<D>> {
        let place = self.aligned.binary_search(&[i, j]).ok()?;
        self.positions.get(place)
    }

    /// The factor from the common scale of all shapes to the scale of a pair.
    pub fn magnification(&self, start: usize, end: usize) -> f64 {
        let position = self.position(start.min(end), start.max(end));
        position.map_or(1.0, |position| position.filling.magnification)
    }

    /// The signed distances of two shapes in the position of the pair, in this order, on the grid of all
    /// pairs after so many refinements.
    ///
    /// # Errors
    /// [`CliError`] for a shape that is lost on the grid.
    pub fn fields(
        &self,
        start: usize,
        end: usize,
        refinements: u32,
    ) -> Result<PairFields<'_, D>, CliError> {
        let (i, j) = (start.min(end), start.max(end));
        let (first, second) = if refinements > 0 || self.position(i, j).is_some() {
            let grid = refined(&self.grid, refinements);
            let [first, second] = self.sampled(i, j, grid)?;
            (Cow::Owned(first), Cow::Owned(second))
        } else {
            let [first, second] = [i, j].map(|shape| Cow::Borrowed(&self.distances[shape]));
            (first, second)
        };
        Ok(if start < end {
            (first, second)
        } else {
            (second, first)
        })
    }

    /// The signed distances of both shapes in the position of their pair, the smaller number first, on
    /// another grid of the same box.
    ///
    /// # Errors
    /// [`CliError`] for a shape that is lost on the grid.
    pub fn sampled(
        &self,
        i: usize,
        j: usize,
        grid: Grid<D>,
    ) -> Result<[ScalarField<f64, D>; 2], CliError> {
        Ok(match self.position(i, j) {
            None => [self.field(i, grid, |p| p)?, self.field(j, grid, |p| p)?],
            Some(position) => {
                let onto = |p| position.filling.centred(position.motion.map(p));
                let still = |p| position.filling.centred(p);
                if position.first_moves {
                    [self.field(i, grid, onto)?, self.field(j, grid, still)?]
                } else {
                    [self.field(i, grid, still)?, self.field(j, grid, onto)?]
                }
            }
        })
    }

    /// The motion of a shape onto another one in their pair.
    fn motion_onto(&self, shape: usize, onto: usize) -> RigidMotion<D> {
        match self.position(shape.min(onto), shape.max(onto)) {
            None => RigidMotion::identity(),
            Some(position) if position.first_moves == (shape < onto) => position.motion,
            Some(position) => position.motion.inverse(),
        }
    }

    /// The signed distances of a shape, of one between, and of another shape, on the grid of all pairs after so many
    /// refinements, and the factor from the common scale to theirs. Where pairs are aligned, both shapes lie on the one between
    /// as they do in their pairs with it, and all three are moved to the middle and magnified at most as the pair itself is.
    /// `None` where they do not fit.
    ///
    /// # Errors
    /// [`CliError`] for a shape that is lost on the grid.
    pub fn fields_through(
        &self,
        [start, end]: [usize; 2],
        between: usize,
        refinements: u32,
    ) -> Result<Option<(f64, [ScalarField<f64, D>; 3])>, CliError> {
        let shapes = [start, between, end];
        let grid = refined(&self.grid, refinements);
        if self.aligned.is_empty() {
            let fields: Result<Vec<_>, _> = shapes
                .into_iter()
                .map(|shape| match refinements {
                    0 => Ok(self.distances[shape].clone()),
                    _ => self.field(shape, grid, |p| p),
                })
                .collect();
            return Ok(fields?.try_into().ok().map(|fields| (1.0, fields)));
        }
        let motions = [
            self.motion_onto(start, between),
            RigidMotion::identity(),
            self.motion_onto(end, between),
        ];
        let [from, _] = self.corners;
        let placed = shapes.iter().zip(&motions);
        let placed = placed.map(|(&shape, motion)| {
            motion.apply_to_contour(&moved(&self.inputs[shape].contour, from))
        });
        let placed: Vec<Contour<D>> = placed.collect();
        let corners = bounds(placed.iter().flat_map(Contour::points).copied());
        let most = self.magnification(start, end);
        let filling = Filling::new(corners, &room(&grid.extent()), most);
        if filling.magnification < most && !self.magnified {
            return Ok(None);
        }
        let fields: Result<Vec<_>, _> = shapes
            .into_iter()
            .zip(&motions)
            .map(|(shape, motion)| self.field(shape, grid, |p| filling.centred(motion.map(p))))
            .collect();
        let fields = fields?.try_into().ok();
        Ok(fields.map(|fields| (filling.magnification, fields)))
    }

    fn field(
        &self,
        shape: usize,
        grid: Grid<D>,
        map: impl Fn([f64; D]) -> [f64; D],
    ) -> Result<ScalarField<f64, D>, CliError> {
        let input = &self.inputs[shape];
        let [from, to] = self.corners;
        let sum = |p: [f64; D], by: [f64; D]| std::array::from_fn(|k| p[k] + by[k]);
        let contour = input
            .contour
            .map(|p| sum(map(sum(p, from)), to.map(|x| -x)));
        let distance = ContourDistance::new(&contour)
            .map_err(|source| CliError::Shape {
                path: input.path.clone(),
                source,
            })?
            .sample(grid);
        super::on_the_grid(&input.path, distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use levelset::{BoxEdge, Moments, contour, dice};
    use shapespace_input::Image;
    use shapespace_input::block;
    use shapespace_input::place::fit_frames;

    const NODES: usize = 65;

    #[test]
    fn one_reflected_shape_is_named_for_all_its_pairs() {
        let named = |pairs: &[([usize; 2], f64)]| {
            let doubts = pairs
                .iter()
                .map(|(pair, figure)| (*pair, Doubt::check(Cause::Reflection, *figure).unwrap()));
            reflected_of_pairs(&doubts.collect::<Vec<_>>())
                .into_iter()
                .map(|(shape, doubt)| (shape, doubt.figure))
                .collect::<Vec<_>>()
        };
        assert_eq!(named(&[([0, 1], 0.2)]), [(1, 0.2)]);
        // The first of four, and the third.
        assert_eq!(
            named(&[([0, 1], 0.3), ([0, 2], 0.1), ([0, 3], 0.2)]),
            [(0, 0.1)]
        );
        assert_eq!(
            named(&[([0, 2], 0.3), ([1, 2], 0.4), ([2, 3], 0.2)]),
            [(2, 0.2)]
        );
        // Two of five, which do not differ in that from each other.
        let two = [[0, 1], [1, 2], [1, 4], [0, 3], [2, 3], [3, 4]].map(|pair| (pair, 0.4));
        assert_eq!(named(&two), [(3, 0.4), (1, 0.4)]);
        assert!(named(&[]).is_empty());
    }

    fn prepared(images: &[Image<2>]) -> (Vec<Input<2>>, Vec<ScalarField<f64, 2>>) {
        let frames = fit_frames(images, None);
        let inputs: Vec<Input<2>> = images
            .iter()
            .zip(frames)
            .map(|(image, frame)| super::super::input(image, frame, String::new()).unwrap())
            .collect();
        let sample = |input: &Input<2>| {
            ContourDistance::new(&input.contour)
                .unwrap()
                .sample(Grid::cube(NODES))
        };
        let distances = inputs.iter().map(sample).collect();
        (inputs, distances)
    }

    #[test]
    fn every_pair_lies_on_each_other_and_fills_the_box() {
        let lying = block([60, 60], [1.0; 2], [5, 25], [54, 34]);
        let upright = block([60, 60], [1.0; 2], [25, 5], [34, 54]);
        let mut slanted = block([60, 60], [1.0; 2], [0, 0], [0, 0]);
        let value = |index| {
            let [x, y] = slanted.sample(index).map(|i| i as f64 - 29.5);
            let inside = (x - y).abs() < 7.07 && (x + y).abs() < 35.36;
            u8::from(inside)
        };
        let values: Vec<u8> = (0..slanted.values.len()).map(value).collect();
        slanted.values = values.into();
        let (inputs, distances) = prepared(&[slanted, lying, upright]);
        let areas: Vec<f64> = inputs.iter().map(|input| input.volume).collect();
        let grid = Grid::cube(NODES);
        let all = vec![[0, 1], [0, 2], [1, 2]];
        let domain = Domain::Cube(NODES);
        let alone = Distribution::alone(3);
        let pairs = Pairs::aligned(inputs, distances, all, &grid, &domain, &alone, || false)
            .unwrap()
            .unwrap();
        for i in 0..3 {
            for j in (0..3).filter(|&j| j != i) {
                let (a, b) = pairs.fields(i, j, 0).unwrap();
                // Bars of one size, up to the steps of the slanted one.
                assert!(dice(&a, 0.0, &b, 0.0).unwrap() > 0.96, "{i} {j}");
                let (d, c) = pairs.fields(j, i, 0).unwrap();
                assert_eq!((a.as_slice(), b.as_slice()), (c.as_slice(), d.as_slice()));
                let outline = contour(&a, 0.0, BoxEdge::Open).unwrap();
                let area = Moments::of_contour(&outline).unwrap().volume;
                let magnification = pairs.magnification(i, j);
                // Corners are cut off by a part of a cell.
                assert!((area / (magnification.powi(2) * areas[i]) - 1.0).abs() < 0.02);
                let reach = [&a, &b].map(|u| {
                    let values = u.as_slice().iter().enumerate();
                    let inside = values.filter(|(_, u)| **u > 0.0).map(|(node, _)| node);
                    let columns: Vec<_> = inside.flat_map(|n| grid.node(n)).collect();
                    [columns.iter().min().copied(), columns.iter().max().copied()]
                });
                let low = reach.iter().filter_map(|r| r[0]).min().unwrap();
                let high = reach.iter().filter_map(|r| r[1]).max().unwrap();
                // The room is .08 to .92 of 64 cells; a node is inside from half a cell on.
                assert!(
                    (5..=6).contains(&low) && (58..=59).contains(&high),
                    "{low} {high}"
                );
            }
        }
    }

    #[test]
    fn a_wish_to_stop_is_heard() {
        let bar = block([60, 60], [1.0; 2], [5, 25], [54, 34]);
        let (inputs, distances) = prepared(&[bar.clone(), bar]);
        assert!(
            Pairs::aligned(
                inputs,
                distances,
                vec![[0, 1]],
                &Grid::cube(NODES),
                &Domain::Cube(NODES),
                &Distribution::alone(2),
                || true
            )
            .unwrap()
            .is_none()
        );
    }
}
