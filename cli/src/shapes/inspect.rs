//! Doubts about masks: whether they show an object, the whole of it, and nothing else, at a
//! resolution that the grid has.

use fe_grid::{Distribution, Grid, ScalarField, parallel};
use levelset::inspect::{border_share_of, narrow_gap_share, specks_of, thin_share};
use levelset::{Cause, Contour, Doubt};
use shape_average::align::mismatches;

use super::Input;
use crate::error::CliError;
use shapespace_input::{Image, LEVEL, grey_share};

/// Mismatch of aligned shapes up to which a shape is not compared with its reflection: nearly equal
/// shapes are not reflected.
const MATCHED: f64 = 0.02;

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

/// The doubts about a shape that the grid does not resolve, given by its signed distance and its
/// boundary.
pub(crate) fn inspect_resolution<const D: usize>(
    distance: &ScalarField<f64, D>,
    boundary: &Contour<D>,
) -> Vec<Doubt> {
    // A shape without a boundary has no gaps.
    let gaps = narrow_gap_share(boundary, distance.grid().spacing()).unwrap_or_default();
    let doubts = [
        inspect_thinness(distance),
        Doubt::check(Cause::NarrowGaps, gaps),
    ];
    doubts.into_iter().flatten().collect()
}

/// The doubt about parts that the grid does not resolve.
pub(crate) fn inspect_thinness<const D: usize>(distance: &ScalarField<f64, D>) -> Option<Doubt> {
    Doubt::check(Cause::ThinParts, thin_share(distance))
}

/// Adds the doubts about shapes that fit one of them better when they are reflected. `distances` are
/// those before an alignment, of that shape first. Collective.
///
/// # Errors
/// [`CliError::Computation`].
pub(super) fn inspect_reflections<const D: usize>(
    inputs: &mut [Input<D>],
    distances: &[ScalarField<f64, D>],
    order: &[usize],
    distribution: &Distribution,
) -> Result<(), CliError> {
    let loose = |i: usize| inputs[i].alignment.is_none_or(|a| a.mismatch > MATCHED);
    let others = order.iter().zip(distances).skip(1);
    let others: Vec<_> = others.filter(|(i, _)| loose(**i)).collect();
    let distribution = distribution.of(others.len());
    let shares = parallel::try_map(&others[distribution.own()], &|(_, distance)| {
        let [own, reflected] = mismatches(&distances[0], distance).map_err(super::align::failed)?;
        let alike = own <= MATCHED;
        Ok::<_, CliError>([if alike { 1.0 } else { reflected / own }])
    })?;
    let shares = distribution.share(&shares).into_iter().flatten();
    let mut of_all: Vec<f64> = order.iter().map(|_| 1.0).collect();
    for ((i, _), share) in others.into_iter().zip(shares) {
        if let Some(place) = order.iter().position(|other| other == i) {
            of_all[place] = share;
        }
    }
    for (i, doubt) in minority(&of_all, order) {
        inputs[i].doubts.push(doubt);
    }
    Ok(())
}

/// The reflected shapes among those of a list, with their doubts. They are compared with its first one:
/// shares are the mismatches of their reflections with it over their own, one where they fit as they are.
///
/// Shapes of one kind differ, and not every one fits a reflected one twice as well. Where most of the others
/// fit better at all when they are reflected, it is the first one that is reflected, and those that fit it.
fn minority(shares: &[f64], order: &[usize]) -> Vec<(usize, Doubt)> {
    let all = order.iter().copied().zip(shares.iter().copied());
    let found: Vec<(usize, Doubt)> = all
        .clone()
        .skip(1)
        .filter_map(|(i, share)| Some((i, Doubt::check(Cause::Reflection, share)?)))
        .collect();
    let others = shares.len().saturating_sub(1);
    let better = shares.iter().skip(1).filter(|share| **share < 1.0).count();
    let figure = |(_, doubt): &(usize, Doubt)| doubt.figure;
    let least_sure = found.iter().max_by(|a, b| figure(a).total_cmp(&figure(b)));
    match least_sure {
        Some(&(_, doubt)) if others > 1 && 2 * better > others => {
            let like_it = all.filter(|(_, share)| *share >= 1.0);
            like_it.map(|(i, _)| (i, doubt)).collect()
        }
        _ => found,
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

    #[test]
    fn of_many_shapes_the_few_are_reflected() {
        let named = |shares: &[f64], order: &[usize]| {
            let few = minority(shares, order);
            few.iter().map(|(i, d)| (*i, d.figure)).collect::<Vec<_>>()
        };
        assert_eq!(named(&[1.0, 1.0, 0.1, 1.0], &[1, 0, 2, 3]), [(2, 0.1)]);
        assert_eq!(named(&[1.0, 0.1], &[1, 0]), [(0, 0.1)]);
        let most = [1.0, 0.1, 1.0, 0.3, 0.2];
        assert_eq!(named(&most, &[3, 0, 1, 2, 4]), [(3, 0.3), (1, 0.3)]);
        assert_eq!(named(&[1.0, 1.0], &[0, 1]), []);
        // One of five is reflected, which the others are compared with; only one fits twice as well when it
        // is reflected, and all fit better.
        let first = [1.0, 0.8, 0.7, 0.3, 0.9];
        assert_eq!(named(&first, &[4, 0, 1, 2, 3]), [(4, 0.3)]);
        // Two of six.
        let two = [1.0, 0.4, 0.3, 1.8, 0.2, 0.9];
        assert_eq!(named(&two, &[5, 0, 1, 4, 2, 3]), [(5, 0.4), (4, 0.4)]);
    }
}
