//! The components of label images, and the visible part of a shape.
//!
//! The first level set of a shape is that of all labels. Of `n` labels in order, label `i` lies
//! inside the level set `c = 1, 2, ...` where bit `c - 1` of `i` is set: these `1 + log2 n` level
//! sets (rounded up) distinguish all labels.

use std::collections::BTreeSet;
use std::path::Path;

use fe_grid::{Grid, ScalarField};
use levelset::{Compact, Contour, ContourDistance, Step};

use super::{Input, distance, placed};
use crate::error::CliError;
use shapespace_input::{Image, ReadOptions, Sources};

/// Label images, split into components.
#[derive(Clone, Debug)]
pub(crate) struct Components<const D: usize> {
    /// The labels in order, without 0.
    pub labels: Vec<i64>,
    /// For every input the masks of its components but the first, which is that of all labels.
    masks: Vec<Vec<Image<D>>>,
}

/// Whether a label, by its place among all, lies inside a level set.
pub(crate) fn belongs(index: usize, component: usize) -> bool {
    component == 0 || index >> (component - 1) & 1 == 1
}

impl<const D: usize> Components<D> {
    /// The masks of all that is labelled, and the parts.
    ///
    /// # Errors
    /// [`CliError::Option`] where the images do not have the same labels.
    pub fn split(images: &[Image<D>]) -> Result<(Vec<Image<D>>, Self), CliError> {
        let sets: Vec<BTreeSet<i64>> = images.iter().map(labels_of).collect();
        if let Some(other) = sets.iter().position(|set| *set != sets[0]) {
            return Err(CliError::Option {
                option: "--labels",
                value: format!("{:?} and {:?}", sets[0], sets[other]),
                remedy: format!(
                    "'{}' and '{}' must have the same labels, which stand for the same parts; \
                     relabel one of them, or leave out --labels",
                    images[0].path.display(),
                    images[other].path.display()
                ),
            });
        }
        let labels: Vec<i64> = sets
            .first()
            .map(|set| set.iter().copied().collect())
            .unwrap_or_default();
        let components = 1 + labels.len().next_power_of_two().ilog2() as usize;
        let mask = |image: &Image<D>, component: usize| {
            let inside = |value: f64| {
                let place = labels.binary_search(&(value as i64));
                u8::from(place.is_ok_and(|index| belongs(index, component)))
            };
            Image {
                values: image.values.iter().map(inside).collect::<Vec<_>>().into(),
                ..image.clone()
            }
        };
        let masks = images
            .iter()
            .map(|image| (1..components).map(|c| mask(image, c)).collect())
            .collect();
        let whole = images.iter().map(|image| mask(image, 0)).collect();
        Ok((whole, Self { labels, masks }))
    }

    /// The signed distances of the components of an input but the first.
    ///
    /// # Errors
    /// [`CliError`] with exit code 2 for a component that is lost on the grid.
    pub fn distances(
        &self,
        number: usize,
        input: &Input<D>,
        grid: Grid<D>,
    ) -> Result<Vec<ScalarField<f64, D>>, CliError> {
        let masks = self.masks[number].iter();
        masks
            .map(|mask| distance(mask, input, &placed(mask, input)?, grid))
            .collect()
    }
}

fn labels_of<const D: usize>(image: &Image<D>) -> BTreeSet<i64> {
    let labels = image.values.iter().map(|value| value as i64);
    labels.filter(|&label| label != 0).collect()
}

/// A visibility mask, bright where an input is visible, and its option.
#[derive(Clone, Debug)]
pub(crate) struct VisibilityMask<const D: usize> {
    pub image: Image<D>,
    pub option: &'static str,
}

/// Reads the visibility mask that an option names.
///
/// # Errors
/// [`CliError`] for masks that cannot be read, or do not have `D` axes.
pub(crate) fn read_view<const D: usize>(
    path: &Path,
    sources: &Sources,
    option: &'static str,
) -> Result<VisibilityMask<D>, CliError> {
    match sources.read_image(path, &ReadOptions::default())?.of_type() {
        Some(image) => Ok(VisibilityMask { image, option }),
        None => Err(CliError::Option {
            option,
            value: format!("'{}'", path.display()),
            remedy: "give a mask with as many axes and values as the image of its shape".into(),
        }),
    }
}

/// The visible part of an input.
pub(crate) struct View<const D: usize> {
    /// The signed distance to the visible boundary, whose nearest piece determines the sign; it is
    /// extended behind the occlusion.
    pub distance: ScalarField<f64, D>,
    /// The visible boundary.
    pub boundary: Contour<D>,
    /// 1 at visible nodes and outside of the image, 0 at the others and near them, where an end of
    /// the visible boundary is nearest, with a ramp of two grid spacings in between.
    pub weight: ScalarField<f64, D>,
}

/// Pieces of a boundary nearer to the occlusion than this, in samples, belong to the occlusion and
/// not to the shape.
const EDGE: f64 = 1.5;

/// The visible part of an input in its placement, from a mask of its size.
///
/// # Errors
/// [`CliError::Option`] if the mask has another size than the input, or no part of the boundary is
/// visible.
pub(crate) fn view_of<const D: usize>(
    mask: &VisibilityMask<D>,
    input: &Input<D>,
    grid: Grid<D>,
) -> Result<View<D>, CliError> {
    let (mut image, option) = (mask.image.clone(), mask.option);
    let wrong = |value: String, remedy: String| CliError::Option {
        option,
        value,
        remedy,
    };
    if image.size != input.size {
        return Err(wrong(
            format!("of {:?} values", image.size),
            format!(
                "'{}' must have as many values as '{}', which has {:?}",
                image.path.display(),
                input.path.display(),
                input.size
            ),
        ));
    }
    image.outline = None;
    // The occlusion is bounded; the visible region extends beyond the image.
    image.values.reverse();
    let failed = |source| CliError::Shape {
        path: image.path.clone(),
        source,
    };
    let screen = ContourDistance::new(&placed(&image, input)?).map_err(failed)?;
    let sample = image.spacing.iter().fold(0.0f64, |a, b| a.max(*b));
    let margin = EDGE * sample * input.frame.scale();
    let visible = |corner: &[f64; D]| screen.signed_distance(*corner) < -margin;
    let boundary = input.contour.part(|corners| corners.iter().all(visible));
    if boundary.is_empty() {
        return Err(wrong(
            format!("'{}'", image.path.display()),
            "no part of the shape's boundary is visible; is the mask inverted?".into(),
        ));
    }
    let mut weight = screen.sample(grid);
    let ramp = Step::Compact(Compact::new(grid.spacing()).map_err(failed)?);
    for w in weight.as_mut_slice() {
        *w = 1.0 - ramp.value(*w + margin + grid.spacing());
    }
    Ok(View {
        distance: ContourDistance::new(&boundary)
            .map_err(failed)?
            .sample(grid),
        boundary,
        weight,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapespace_input::block;

    #[test]
    fn few_level_sets_distinguish_all_labels() {
        for n in 1..9usize {
            let components = 1 + n.next_power_of_two().ilog2() as usize;
            let codes: BTreeSet<Vec<bool>> = (0..n)
                .map(|i| (0..components).map(|c| belongs(i, c)).collect())
                .collect();
            assert_eq!(codes.len(), n);
            assert!(codes.iter().all(|code| code[0]));
        }
    }

    #[test]
    fn images_with_other_labels_are_refused() {
        let mut image = block([8, 8], [1.0; 2], [2, 2], [5, 5]);
        let one = image.clone();
        let mut values = image.values.to_vec();
        values[0] = 3.0;
        image.values = values.into();
        assert!(Components::split(&[one.clone(), image.clone()]).is_err());
        let (whole, parts) = Components::split(&[image.clone(), image]).unwrap();
        assert_eq!(parts.labels, [1, 3]);
        assert_eq!(whole[0].values.iter().sum::<f64>(), 17.0);
        assert_eq!(parts.masks[1][0].values.iter().sum::<f64>(), 1.0);
    }
}
