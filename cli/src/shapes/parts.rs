//! The components of label images, and the visible part of a shape.
//!
//! The first level set of a shape is that of all labels. Averages have one more for each label. Of paths,
//! whose level sets are unknowns, there are fewer: of `n` labels in order, label `i` lies
//! inside the level set `c = 1, 2, ...` where bit `c - 1` of `i` is set: these `1 + log2 n` level
//! sets (rounded up) distinguish all labels.

use std::collections::BTreeSet;
use std::path::Path;

use fe_grid::{Grid, ScalarField};
use levelset::{Compact, Contour, ContourDistance, LevelsetError, Step};

use super::{Input, distance, placed, placed_by};
use crate::error::CliError;
use shapespace_input::{Image, InputError, ReadOptions, Sources, size_text};

/// Label images, split into components.
#[derive(Clone, Debug)]
pub(crate) struct Components<const D: usize> {
    /// The labels in order, without 0.
    pub labels: Vec<i64>,
    /// For every input the masks of its components but that of all labels.
    masks: Vec<Vec<Image<D>>>,
}

/// Whether a label, by its place among all, lies inside a level set.
pub(crate) fn belongs(index: usize, component: usize) -> bool {
    component == 0 || index >> (component - 1) & 1 == 1
}

impl<const D: usize> Components<D> {
    /// The masks of all that is labelled, and as few parts as distinguish the labels.
    ///
    /// # Errors
    /// [`CliError::Option`] where the images do not have the same labels.
    pub fn split(images: &[Image<D>]) -> Result<(Vec<Image<D>>, Self), CliError> {
        let labels = common_labels(images)?;
        let coded = labels.len().next_power_of_two().ilog2() as usize;
        Ok(Self::parted(images, labels, coded, |index, part| {
            belongs(index, part + 1)
        }))
    }

    /// The masks of all that is labelled, and a part for every label.
    ///
    /// # Errors
    /// As [`split`](Self::split), and for labels that a NIfTI file of 32-bit integers does not hold.
    pub fn each(images: &[Image<D>]) -> Result<(Vec<Image<D>>, Self), CliError> {
        let labels = common_labels(images)?;
        if let Some(label) = labels.iter().find(|label| i32::try_from(**label).is_err()) {
            return Err(CliError::Option {
                option: "--labels",
                value: label.to_string(),
                remedy: format!("relabel the images with numbers of at most {}", i32::MAX),
            });
        }
        let parts = labels.len();
        Ok(Self::parted(images, labels, parts, |index, part| {
            index == part
        }))
    }

    /// Components with these labels and masks, of every input.
    pub fn of_masks(labels: Vec<i64>, masks: Vec<Vec<Image<D>>>) -> Self {
        Self { labels, masks }
    }

    /// The masks of all labels, and of a number of parts that labels belong to by their places.
    fn parted(
        images: &[Image<D>],
        labels: Vec<i64>,
        parts: usize,
        belongs: impl Fn(usize, usize) -> bool,
    ) -> (Vec<Image<D>>, Self) {
        let mask = |image: &Image<D>, belongs: &dyn Fn(usize) -> bool| {
            let inside = |value: f64| {
                let place = labels.binary_search(&(value as i64));
                u8::from(place.is_ok_and(belongs))
            };
            Image {
                values: image.values.iter().map(inside).collect::<Vec<_>>().into(),
                ..image.clone()
            }
        };
        let part = |image, part| mask(image, &|index| belongs(index, part));
        let of_image = |image| (0..parts).map(|p| part(image, p)).collect();
        let masks = images.iter().map(of_image).collect();
        let whole = images.iter().map(|image| mask(image, &|_| true)).collect();
        (whole, Self { labels, masks })
    }

    /// The masks of the components of an input.
    pub fn of(&self, number: usize) -> &[Image<D>] {
        self.masks.get(number).map_or(&[], Vec::as_slice)
    }

    /// The masks of all components of all inputs.
    pub fn masks(&self) -> impl Iterator<Item = &Image<D>> {
        self.masks.iter().flatten()
    }

    /// The signed distances of the components of an input to their visible boundaries, of those that have
    /// one: a component that is hidden altogether is taken as it is, and not compared.
    ///
    /// # Errors
    /// As [`distances`](Self::distances), and as [`view_of`].
    pub fn visible_distances(
        &self,
        number: usize,
        input: &Input<D>,
        mask: &VisibilityMask<D>,
        grid: Grid<D>,
    ) -> Result<Vec<ScalarField<f64, D>>, CliError> {
        let screen = Screen::new(mask, input)?;
        let of = |image: &Image<D>| {
            let whole = placed(image, input)?;
            let boundary = screen.visible(&whole);
            if boundary.is_empty() {
                return distance(image, input, &whole, grid);
            }
            let distance =
                ContourDistance::new(&boundary).map_err(|source| screen.failed(source))?;
            Ok(distance.sample(grid))
        };
        self.masks[number].iter().map(of).collect()
    }

    /// The signed distances of the components of an input.
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

/// The labels that all images have.
fn common_labels<const D: usize>(images: &[Image<D>]) -> Result<Vec<i64>, CliError> {
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
    let first = sets.first();
    Ok(first
        .map(|set| set.iter().copied().collect())
        .unwrap_or_default())
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

/// Reads the visibility mask of an image that an option names; none where it is bright everywhere, so that nothing is
/// hidden.
///
/// # Errors
/// [`CliError`] for masks that cannot be read, or do not have `D` axes, and for a bright one of another size.
pub(crate) fn read_view<const D: usize>(
    path: &Path,
    of: &Image<D>,
    sources: &Sources,
    option: &'static str,
) -> Result<Option<VisibilityMask<D>>, CliError> {
    let refused = |remedy: &str| CliError::Option {
        option,
        value: format!("'{}'", path.display()),
        remedy: remedy.into(),
    };
    let image = match sources.read_image(path, &ReadOptions::default()) {
        Err(InputError::Full { size, .. }) if size == of.size => return Ok(None),
        Err(InputError::Full { size, .. }) => {
            let (found, expected) = (size_text(&size), size_text(&of.size));
            let remedy = format!(
                "it is bright everywhere, of {found} values for {expected}: if nothing of '{}' is hidden, leave it out",
                of.path.display()
            );
            return Err(refused(&remedy));
        }
        image => image?,
    };
    match image.of_type() {
        Some(Image {
            outline: Some(_), ..
        }) => Err(refused(
            "give an image: an outline or a surface does not tell what is visible",
        )),
        Some(image) => Ok(Some(VisibilityMask { image, option })),
        None => Err(refused(
            "give a mask with as many axes and values as the image of its shape",
        )),
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

/// The visible part of an input in its placement, from a mask of its samples or with a place in the world.
///
/// # Errors
/// [`CliError::Option`] if the place of the mask is not known, or no part of the boundary is visible.
pub(crate) fn view_of<const D: usize>(
    mask: &VisibilityMask<D>,
    input: &Input<D>,
    grid: Grid<D>,
) -> Result<View<D>, CliError> {
    let screen = Screen::new(mask, input)?;
    let boundary = screen.visible(&input.contour);
    if boundary.is_empty() {
        return Err(CliError::Option {
            option: mask.option,
            value: format!("'{}'", mask.image.path.display()),
            remedy: "no part of the shape's boundary is visible; is the mask inverted?".into(),
        });
    }
    let mut weight = screen.occlusion.sample(grid);
    let ramp = Compact::new(grid.spacing()).map_err(|source| screen.failed(source))?;
    let ramp = Step::Compact(ramp);
    for w in weight.as_mut_slice() {
        *w = 1.0 - ramp.value(*w + screen.margin + grid.spacing());
    }
    let distance = ContourDistance::new(&boundary).map_err(|source| screen.failed(source))?;
    Ok(View {
        distance: distance.sample(grid),
        boundary,
        weight,
    })
}

/// What hides a part of an input.
struct Screen<'a, const D: usize> {
    mask: &'a VisibilityMask<D>,
    /// The signed distance to the hidden region, positive inside.
    occlusion: ContourDistance<D>,
    /// The distance from it at which boundaries belong to the shape.
    margin: f64,
}

impl<'a, const D: usize> Screen<'a, D> {
    fn new(mask: &'a VisibilityMask<D>, input: &Input<D>) -> Result<Self, CliError> {
        let mut image = mask.image.clone();
        let frame = input.frame.beside(&input.size, input.size_factor, &image);
        let frame = frame.ok_or_else(|| CliError::Option {
            option: mask.option,
            value: format!("of {:?} values", image.size),
            remedy: format!(
                "'{}' must have as many values as '{}', which has {:?}, or state its place in the world as that does",
                image.path.display(),
                input.path.display(),
                input.size
            ),
        })?;
        // The occlusion is bounded; the visible region extends beyond the image.
        image.values.reverse();
        let sample = frame.sample_size().into_iter().fold(0.0, f64::max);
        let outline = placed_by(&image, &frame, input)?;
        let occlusion = ContourDistance::new(&outline).map_err(|source| CliError::Shape {
            path: image.path.clone(),
            source,
        })?;
        Ok(Self {
            mask,
            occlusion,
            margin: EDGE * sample,
        })
    }

    /// The visible part of a boundary.
    fn visible(&self, whole: &Contour<D>) -> Contour<D> {
        let visible = |corner: &[f64; D]| self.occlusion.signed_distance(*corner) < -self.margin;
        whole.part(|corners| corners.iter().all(visible))
    }

    fn failed(&self, source: LevelsetError) -> CliError {
        CliError::Shape {
            path: self.mask.image.path.clone(),
            source,
        }
    }
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
        let labelled = [image.clone(), image];
        let (whole, parts) = Components::split(&labelled).unwrap();
        assert_eq!(parts.labels, [1, 3]);
        assert_eq!(whole[0].values.iter().sum::<f64>(), 17.0);
        assert_eq!(parts.masks[1][0].values.iter().sum::<f64>(), 1.0);
        let sums = |parts: &Components<2>| -> Vec<f64> {
            parts.masks().map(|mask| mask.values.iter().sum()).collect()
        };
        let both = [whole[0].clone(), whole[1].clone()];
        let (_, alone) = Components::each(&both).unwrap();
        assert_eq!(
            (alone.labels.clone(), sums(&alone)),
            (vec![1], vec![17.0; 2])
        );
        let (_, each) = Components::each(&labelled).unwrap();
        assert_eq!(sums(&each), [16.0, 1.0, 16.0, 1.0]);
    }
}
