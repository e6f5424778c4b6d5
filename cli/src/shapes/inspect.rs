//! Doubts about masks: whether they show an object, the whole of it, and nothing else, at a
//! resolution that the grid has.

use fe_grid::{Distribution, Grid, ScalarField, parallel};
use levelset::inspect::{border_share_of, narrow_gap_share, specks_of, thin_share};
use levelset::topology::Topology;
use levelset::{Cause, Contour, Doubt, signed_distance};
use shape_average::align::{AlignError, align_to, mismatches, reflected_mismatch};

use super::Input;
use crate::error::CliError;
use shapespace_input::{Image, LEVEL, grey_share};

/// Mismatch of aligned shapes up to which they are alike: nearly equal shapes are not reflected.
const MATCHED: f64 = 0.02;
/// Share of the mismatch below which a reflected shape fits better than the shape itself; beyond its inverse, it
/// fits worse. Shapes between are as like their reflection.
const MARGIN: f64 = 0.8;

/// Share of the mismatch of a shape that an average must differ from its own reflection by, to tell whether the
/// shape is reflected: a reflected shape differs from the average by as much as the average itself would.
const SIDES: f64 = 0.5;
/// Mismatch with an average up to which a shape is one of its kind, relative to the largest of those that it is the
/// average of: these are measured against the mean of their masks, which is more like them.
const USUAL: f64 = 1.5;

/// The doubts about a mask. The object of one that is partially visible may continue beyond the
/// border.
pub(crate) fn inspect_mask<const D: usize>(image: &Image<D>, partly: bool) -> Vec<Doubt> {
    let inside = |index| image.values.get(index) > LEVEL;
    let samples = Grid::with_nodes(image.size, 1.0)
        // Masks that were read have at least two samples along every axis.
        .expect("a grid of the samples");
    let share = if partly {
        0.0
    } else {
        border_share_of(&samples, &inside)
    };
    let border = Doubt::check(Cause::Background, share);
    // A thin part of an exact boundary may lose its connection between samples.
    let whole = |outline: &Contour<D>| outline.n_components() == 1;
    let specks = if image.outline.as_ref().is_some_and(whole) {
        0
    } else {
        specks_of(&samples, &inside)
    };
    let doubts = [
        border.or_else(|| Doubt::check(Cause::Border, share)),
        Doubt::check(Cause::GreyValues, grey_share(image)),
        Doubt::check(Cause::Specks, specks as f64),
    ];
    doubts.into_iter().flatten().collect()
}

/// The largest distance of neighbouring samples of a mask of two values, of which one length unit is `scale` long;
/// zero for other images: their boundary is known between samples.
pub(super) fn sample_distance<const D: usize>(image: &Image<D>, scale: f64) -> f64 {
    let two_values = || {
        image
            .values
            .iter()
            .all(|value| value == 0.0 || value == 1.0)
    };
    if image.outline.is_some() || !two_values() {
        return 0.0;
    }
    scale * image.spacing.into_iter().fold(0.0, f64::max)
}

/// What the grid does not resolve of a shape, given by its signed distance and its boundary: the shares of its parts
/// and of its gaps that are too thin.
pub(super) fn unresolved<const D: usize>(
    distance: &ScalarField<f64, D>,
    boundary: &Contour<D>,
) -> [f64; 2] {
    // A shape without a boundary has no gaps.
    let gaps = narrow_gap_share(boundary, distance.grid().spacing()).unwrap_or_default();
    [thin_share(distance), gaps]
}

/// The doubts about [`unresolved`] parts and gaps of a shape.
pub(crate) fn inspect_resolution<const D: usize>(
    distance: &ScalarField<f64, D>,
    boundary: &Contour<D>,
) -> impl Iterator<Item = Doubt> {
    doubts_of_resolution(unresolved(distance, boundary))
}

/// The doubts about these shares.
pub(super) fn doubts_of_resolution([parts, gaps]: [f64; 2]) -> impl Iterator<Item = Doubt> {
    let doubts = [
        Doubt::check(Cause::ThinParts, parts),
        Doubt::check(Cause::NarrowGaps, gaps),
    ];
    doubts.into_iter().flatten()
}

/// The doubt about parts that the grid does not resolve.
pub(crate) fn inspect_thinness<const D: usize>(distance: &ScalarField<f64, D>) -> Option<Doubt> {
    Doubt::check(Cause::ThinParts, thin_share(distance))
}

/// Adds the doubts about shapes, given by their signed distances, that have other parts or holes than their average,
/// given by its indicator.
pub(crate) fn add_topologies<const D: usize>(
    inputs: &mut [Input<D>],
    distances: &[ScalarField<f64, D>],
    average: &ScalarField<f64, D>,
) {
    // One without a boundary is doubted for its overlaps.
    let Ok(average) = signed_distance(average, 0.5) else {
        return;
    };
    let average = Topology::of(&average);
    let all = parallel::map(distances, &|own| Topology::of(own));
    let from =
        |other: &Topology| -> Vec<usize> { all.iter().map(|own| own.differences(other)).collect() };
    let mut others = from(&average);
    // Of two shapes the average can show a part so faintly that it differs from neither.
    if let [first, ..] = all.as_slice()
        && others.iter().all(|n| *n == 0)
    {
        others = from(first);
    }
    for (input, others) in inputs.iter_mut().zip(others) {
        let doubt = Doubt::check(Cause::Topology, others as f64);
        input.doubts.extend(doubt);
    }
}

/// How well a shape fits another one, as it is and when it is reflected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Likeness {
    /// Mismatch after an alignment.
    own: f64,
    /// That of the reflected shape.
    reflected: f64,
}

impl Likeness {
    /// Compares a shape with another one, both given by their signed distances on one grid.
    ///
    /// # Errors
    /// [`CliError::Computation`].
    pub fn new<const D: usize>(
        reference: &ScalarField<f64, D>,
        shape: &ScalarField<f64, D>,
    ) -> Result<Self, CliError> {
        let [own, reflected] = mismatches(reference, shape).map_err(super::align::failed)?;
        Ok(Self { own, reflected })
    }

    /// The doubt about a shape whose mismatch with another one is known, unless it fits as it is.
    ///
    /// # Errors
    /// [`CliError::Computation`].
    pub fn doubt_of_aligned<const D: usize>(
        reference: &ScalarField<f64, D>,
        shape: &ScalarField<f64, D>,
        own: f64,
    ) -> Result<Option<Doubt>, CliError> {
        if own <= MATCHED {
            return Ok(None);
        }
        let reflected = reflected_mismatch(reference, shape).map_err(super::align::failed)?;
        Ok(Self { own, reflected }.doubt())
    }

    /// The doubt about a shape that is compared with the average of many, unless it fits as it is, or as well as
    /// those do, whose mismatches are at most `usual`. An average that is about as like its own reflection as the
    /// shape is like it tells no sides.
    ///
    /// # Errors
    /// [`CliError::Computation`].
    pub fn doubt_of_average<const D: usize>(
        average: &ScalarField<f64, D>,
        shape: &ScalarField<f64, D>,
        usual: f64,
    ) -> Result<Option<Doubt>, CliError> {
        let found = Self::new(average, shape)?;
        let Some(doubt) = found.doubt().filter(|_| found.own > USUAL * usual) else {
            return Ok(None);
        };
        let sides = reflected_mismatch(average, average).map_err(super::align::failed)?;
        Ok((sides > SIDES * found.own).then_some(doubt))
    }

    /// The mismatch of the reflected shape, relative to that of the shape.
    fn share(self) -> f64 {
        self.reflected / self.own.max(f64::MIN_POSITIVE)
    }

    /// The doubt about the shape, unless it fits as it is.
    pub fn doubt(self) -> Option<Doubt> {
        let alike = self.own <= MATCHED;
        (!alike)
            .then(|| Doubt::check(Cause::Reflection, self.share()))
            .flatten()
    }

    /// Whether the shape tells its reflection from itself, and fits better as it is.
    fn is_sure(self) -> bool {
        self.share() > MARGIN.recip()
    }

    /// Whether it tells them from each other, and fits better when it is reflected.
    fn is_reflected(self) -> bool {
        self.share() < MARGIN
    }
}

/// Computes the mismatch of two shapes after an alignment, given by their signed distances.
type Mismatch<'a, const D: usize> =
    dyn Fn(&ScalarField<f64, D>, &ScalarField<f64, D>) -> Result<f64, AlignError> + Sync + 'a;

/// Adds the doubts about shapes that are reflected against most of the others. `distances` are those before an
/// alignment, in the order of the inputs that is given; the first one is compared with the others. Collective.
///
/// # Errors
/// [`CliError::Computation`].
pub(super) fn inspect_reflections<const D: usize>(
    inputs: &mut [Input<D>],
    distances: &[ScalarField<f64, D>],
    order: &[usize],
    distribution: &Distribution,
) -> Result<(), CliError> {
    let compare = |reference: usize, shapes: &[usize]| -> Result<Vec<Likeness>, CliError> {
        let distribution = distribution.of(shapes.len());
        let reference = &distances[reference];
        let of_all = |mismatch: &Mismatch<D>| -> Result<Vec<[f64; 1]>, CliError> {
            let found = parallel::try_map(&shapes[distribution.own()], &|&shape: &usize| {
                mismatch(reference, &distances[shape]).map(|found| [found])
            });
            Ok(distribution.share(&found.map_err(super::align::failed)?))
        };
        let own = of_all(&|reference, shape| Ok(align_to(reference, shape)?.mismatch))?;
        // None of those that are all alike is reflected.
        let reflected = if own.iter().all(|[own]| *own <= MATCHED) {
            own.clone()
        } else {
            of_all(&|reference, shape| reflected_mismatch(reference, shape))?
        };
        let both = own.into_iter().zip(reflected);
        let found = both.map(|([own], [reflected])| Likeness { own, reflected });
        Ok(found.collect())
    };
    for (place, doubt) in reflected(order.len(), compare)? {
        let input = &mut inputs[order[place]];
        // One that is like the mean of all is not reflected against them.
        if input.alignment.is_none_or(|a| a.mismatch > MATCHED) {
            input.doubts.push(doubt);
        }
    }
    Ok(())
}

/// The reflected ones of several shapes, with their doubts: the fewer of those that are like the first one and
/// those that are like its reflection. `compare` compares one of them with some.
///
/// Shapes of one kind differ, and not every one fits a reflected one twice as well: all that fit it better by a
/// margin have a vote.
fn reflected(
    n_shapes: usize,
    compare: impl Fn(usize, &[usize]) -> Result<Vec<Likeness>, CliError>,
) -> Result<Vec<(usize, Doubt)>, CliError> {
    let others: Vec<usize> = (1..n_shapes).collect();
    let found = compare(0, &others)?;
    let with_doubts = |shapes: &[usize], found: &[Likeness]| -> Vec<(usize, Doubt)> {
        let all = shapes.iter().zip(found);
        all.filter_map(|(shape, fit)| Some((*shape, fit.doubt()?)))
            .collect()
    };
    let doubted = with_doubts(&others, &found);
    let count = |vote: fn(Likeness) -> bool| found.iter().filter(|fit| vote(**fit)).count();
    let first_is_one = count(Likeness::is_reflected) > count(Likeness::is_sure);
    let surest = doubted
        .iter()
        .min_by(|a, b| a.1.figure.total_cmp(&b.1.figure));
    match surest {
        Some(&(surest, doubt)) if n_shapes > 2 && first_is_one => {
            let sides = others.iter().zip(&found);
            let like_first = sides
                .filter(|(_, fit)| fit.is_sure())
                .map(|(shape, _)| *shape);
            let like_first: Vec<usize> = like_first.collect();
            let again = compare(surest, &like_first)?;
            Ok([vec![(0, doubt)], with_doubts(&like_first, &again)].concat())
        }
        _ => Ok(doubted),
    }
}

/// The doubts about inputs, with their numbers.
pub(crate) fn doubts_of<const D: usize>(inputs: &[Input<D>]) -> Vec<Doubt> {
    let numbered = inputs.iter().enumerate();
    let doubts = numbered.flat_map(|(i, input)| input.doubts.iter().map(move |d| d.about(i)));
    doubts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reflected ones of shapes with these shares of mismatch with the first one, all unlike each other.
    fn named(shares: &[f64]) -> Vec<usize> {
        let shares = [&[1.0], shares].concat();
        let compare = |reference: usize, shapes: &[usize]| {
            let fit = |&shape: &usize| {
                let reflected = match reference {
                    0 => shares[shape],
                    // Both differ from the first one as it is or as it is reflected.
                    _ => shares[shape].recip(),
                };
                Likeness {
                    own: 0.1,
                    reflected: 0.1 * reflected,
                }
            };
            Ok(shapes.iter().map(fit).collect())
        };
        let found = reflected(shares.len(), compare).unwrap();
        found.into_iter().map(|(shape, _)| shape).collect()
    }

    #[test]
    fn of_many_shapes_the_few_are_reflected() {
        assert_eq!(named(&[1.5, 0.1, 2.0]), [2]);
        assert_eq!(named(&[0.1]), [1]);
        assert_eq!(named(&[0.1, 3.0, 0.3, 0.2]), [0, 2]);
        assert!(named(&[1.0, 1.0]).is_empty());
        // One of five is reflected, which the others are compared with; only one fits twice as well when it
        // is reflected.
        assert_eq!(named(&[0.8, 0.7, 0.3, 0.9]), [0]);
        // Two of six; another one is symmetric.
        assert_eq!(named(&[0.4, 0.3, 2.8, 0.2, 0.9]), [0, 3]);
    }

    #[test]
    fn shapes_that_are_alike_vote_and_are_not_named() {
        let alike = |own: f64, reflected: f64| Likeness { own, reflected };
        // All but one are nearly equal to the first one, and fit better as they are or reflected.
        for (near, expected) in [([0.01, 0.05], 4), ([0.01, 0.002], 0)] {
            let fits = [near, near, near, [0.1, 0.04]].map(|[a, b]| alike(a, b));
            let compare =
                |_, shapes: &[usize]| Ok(shapes.iter().map(|shape| fits[shape - 1]).collect());
            let found = reflected(5, compare).unwrap();
            assert_eq!(found.len(), 1, "{near:?}: {found:?}");
            assert_eq!(found[0].0, expected, "{near:?}");
        }
    }
}
