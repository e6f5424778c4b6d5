//! The numbers of a file read as a mask: values in `[0, 1]`, with an object and a background.

use std::collections::BTreeSet;
use std::path::Path;

use super::decode::{Samples, check_size};
use super::number::Meaning;
use super::values::{Step, Values};
use super::{AnyImage, Image, InputError, LEVEL, ReadOptions};

/// Up to this number of different values, they are always treated as labels.
const SURE_LABELS: usize = 32;
/// Above this number of different values, they are not treated as labels.
const MOST_LABELS: usize = 4096;
/// Values may exceed `[0, 1]` by rounding: single precision of a resampled mask.
const RANGE_SLACK: f64 = 1e-6;

/// The smallest and the largest spacing, from nanometres to kilometres in units of millimetres.
const SPACINGS: [f64; 2] = [1e-6, 1e6];

/// Checks the numbers and turns them into an image.
pub(crate) fn into_image(
    mut samples: Samples,
    path: &Path,
    options: &ReadOptions,
) -> Result<AnyImage, InputError> {
    let size: Vec<u64> = samples.size.iter().map(|&n| n as u64).collect();
    check_size(&size, path)?;
    check_spacing(&samples, path)?;
    check_finite(&samples, path)?;
    match options.label {
        Some(label) => select_label(&mut samples, label, path)?,
        None => scale(&mut samples, path)?,
    }
    if options.invert {
        samples.values.reverse();
    }
    check_two_sides(&samples, path)?;
    Ok(shaped_any(samples, path))
}

/// Checks the numbers of a label image, which are not scaled.
pub(crate) fn into_label_image(samples: Samples, path: &Path) -> Result<AnyImage, InputError> {
    let size: Vec<u64> = samples.size.iter().map(|&n| n as u64).collect();
    check_size(&size, path)?;
    check_spacing(&samples, path)?;
    check_finite(&samples, path)?;
    check_whole(&samples, path)?;
    if samples.values.iter().all(|v| v == 0.0) {
        return Err(InputError::Empty {
            path: path.into(),
            largest: 0.0,
        });
    }
    if samples.values.iter().all(|v| v != 0.0) {
        return Err(full(&samples, path));
    }
    Ok(shaped_any(samples, path))
}

/// An image of as many axes as the samples have.
pub(crate) fn shaped_any(samples: Samples, path: &Path) -> AnyImage {
    if samples.size.len() == 2 {
        AnyImage::D2(shaped(samples, path))
    } else {
        AnyImage::D3(shaped(samples, path))
    }
}

/// `D` equals the number of axes, which the caller has checked.
fn shaped<const D: usize>(samples: Samples, path: &Path) -> Image<D> {
    Image {
        size: std::array::from_fn(|k| samples.size[k]),
        spacing: std::array::from_fn(|k| samples.spacing[k]),
        origin: [0.0; D],
        values: samples.values,
        path: path.into(),
        affine: samples.affine,
        direction: None,
        plain_array: samples.plain_array,
        outline: None,
        remark: None,
    }
}

pub(crate) fn check_spacing(samples: &Samples, path: &Path) -> Result<(), InputError> {
    let usable = |h: &f64| (SPACINGS[0]..=SPACINGS[1]).contains(h);
    if samples.spacing.iter().all(usable) {
        return Ok(());
    }
    Err(InputError::Spacing {
        path: path.into(),
        spacing: samples.spacing.clone(),
    })
}

pub(crate) fn check_finite(samples: &Samples, path: &Path) -> Result<(), InputError> {
    match find(samples, |v| !v.is_finite()) {
        None => Ok(()),
        Some((value, position)) => Err(InputError::NotFinite {
            path: path.into(),
            value,
            position,
        }),
    }
}

fn full(samples: &Samples, path: &Path) -> InputError {
    InputError::Full {
        path: path.into(),
        size: samples.size.clone(),
    }
}

fn check_two_sides(samples: &Samples, path: &Path) -> Result<(), InputError> {
    let (smallest, largest) = range(&samples.values);
    if smallest == largest && smallest > 0.0 && smallest < 1.0 {
        return Err(InputError::Constant {
            path: path.into(),
            value: smallest,
        });
    }
    if largest <= LEVEL {
        return Err(InputError::Empty {
            path: path.into(),
            largest,
        });
    }
    if smallest > LEVEL {
        return Err(full(samples, path));
    }
    Ok(())
}

/// First value with a property, and its index as stored (`x` last).
fn find(samples: &Samples, property: impl Fn(f64) -> bool) -> Option<(f64, Vec<usize>)> {
    let found = samples.values.iter().position(property)?;
    let mut index = found;
    let mut position: Vec<usize> = samples
        .size
        .iter()
        .map(|n| {
            let i = index % n;
            index /= n;
            i
        })
        .collect();
    position.reverse();
    Some((samples.values.get(found), position))
}

fn range(values: &Values) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        })
}

fn check_whole(samples: &Samples, path: &Path) -> Result<(), InputError> {
    match find(samples, |v| v.fract() != 0.0) {
        None => Ok(()),
        Some((value, position)) => Err(InputError::NotLabels {
            path: path.into(),
            value,
            position,
        }),
    }
}

fn select_label(samples: &mut Samples, label: i64, path: &Path) -> Result<(), InputError> {
    check_whole(samples, path)?;
    let target = label as f64;
    if !samples.values.iter().any(|v| v == target) {
        let present: BTreeSet<i64> = samples.values.iter().map(|v| v as i64).collect();
        return Err(InputError::LabelMissing {
            path: path.into(),
            label,
            present: present.into_iter().take(12).collect(),
        });
    }
    samples.values.threshold(|v| v == target);
    Ok(())
}

fn scale(samples: &mut Samples, path: &Path) -> Result<(), InputError> {
    let (smallest, largest) = range(&samples.values);
    let in_unit_range = smallest >= -RANGE_SLACK && largest <= 1.0 + RANGE_SLACK;
    match samples.meaning {
        Meaning::Grey(_) if in_unit_range => {}
        Meaning::Real { .. } if in_unit_range => {
            samples.values.then(Step::Clamped);
        }
        Meaning::Grey(_) | Meaning::Real { .. } if has_two_levels(&samples.values) => {
            samples.values.threshold(|v| v == largest);
        }
        Meaning::Grey(full) => samples.values.then(Step::Divided(full)),
        Meaning::Real { labels: true } if samples.values.iter().all(|v| v.fract() == 0.0) => {
            merge_labels(&mut samples.values, path)?;
        }
        Meaning::Labels => merge_labels(&mut samples.values, path)?,
        Meaning::Real { .. } => return Err(out_of_range(samples, path)),
    }
    Ok(())
}

fn out_of_range(samples: &Samples, path: &Path) -> InputError {
    let outside = |v: f64| !(-RANGE_SLACK..=1.0 + RANGE_SLACK).contains(&v);
    // The caller has found a value outside, so that the default is never used.
    let (value, position) = find(samples, outside).unwrap_or_default();
    InputError::OutOfRange {
        path: path.into(),
        value,
        position,
    }
}

/// Converts label images to masks of all labels. Many different values that mostly differ between
/// neighbours are intensities, not labels.
fn merge_labels(values: &mut Values, path: &Path) -> Result<(), InputError> {
    let mut labels = BTreeSet::new();
    let (mut pairs, mut equal, mut last) = (0usize, 0usize, 0.0);
    for v in values.iter() {
        if v != 0.0 {
            if v != last && labels.len() <= MOST_LABELS {
                labels.insert(v as i64);
            }
            pairs += usize::from(last != 0.0);
            equal += usize::from(v == last);
        }
        last = v;
    }
    if labels.len() > MOST_LABELS || (labels.len() > SURE_LABELS && 2 * equal < pairs) {
        return Err(InputError::Intensities {
            path: path.into(),
            levels: labels.len(),
        });
    }
    values.threshold(|v| v != 0.0);
    Ok(())
}

fn has_two_levels(values: &Values) -> bool {
    let first = values.get(0);
    let second = values.iter().find(|&v| v != first);
    second.is_some_and(|second| values.iter().all(|v| v == first || v == second))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(values: &[f64], meaning: Meaning, label: Option<i64>) -> Result<Vec<f64>, InputError> {
        let samples = Samples {
            values: values.to_vec().into(),
            size: vec![2, values.len() / 2],
            meaning,
            spacing: vec![1.0, 1.0],
            affine: None,
            plain_array: false,
        };
        match into_image(
            samples,
            Path::new("m"),
            &ReadOptions {
                label,
                ..ReadOptions::default()
            },
        )? {
            AnyImage::D2(image) => Ok(image.values.to_vec()),
            AnyImage::D3(_) => unreachable!("the array has two axes"),
        }
    }

    #[test]
    fn numbers_become_values_by_their_meaning() {
        let grey = Meaning::Grey(255.0);
        let real = Meaning::Real { labels: false };
        assert_eq!(
            read(&[0., 1., 1., 0.], grey, None).unwrap(),
            [0., 1., 1., 0.]
        );
        assert_eq!(
            read(&[0., 255., 0., 0.], grey, None).unwrap(),
            [0., 1., 0., 0.]
        );
        assert_eq!(
            read(&[9., 90., 9., 9.], grey, None).unwrap(),
            [0., 1., 0., 0.]
        );
        assert_eq!(
            read(&[0., 255., 51., 0.], grey, None).unwrap(),
            [0., 1., 0.2, 0.]
        );
        assert_eq!(
            read(&[0.2, 0.8, 0.2, 0.2], real, None).unwrap(),
            [0.2, 0.8, 0.2, 0.2]
        );
        assert_eq!(
            read(&[0., -2., 7., 0.], Meaning::Labels, None).unwrap(),
            [0., 1., 1., 0.]
        );
        assert_eq!(
            read(&[0., 2., 7., 0.], Meaning::Labels, Some(7)).unwrap(),
            [0., 0., 1., 0.]
        );
    }

    #[test]
    fn what_is_no_mask_is_refused_with_its_reason() {
        let grey = Meaning::Grey(255.0);
        let real = Meaning::Real { labels: false };
        let error = |values: &[f64], meaning, label| read(values, meaning, label).unwrap_err();
        assert!(matches!(
            error(&[0.; 4], grey, None),
            InputError::Empty { .. }
        ));
        assert!(matches!(
            error(&[1.; 4], grey, None),
            InputError::Full { .. }
        ));
        assert!(matches!(
            error(&[0.3; 4], real, None),
            InputError::Constant { .. }
        ));
        assert!(matches!(
            error(&[0., 0.1, 0.2, 0.3], real, None),
            InputError::Empty { .. }
        ));
        assert!(matches!(
            error(&[0., 2.5, 7., 0.], real, None),
            InputError::OutOfRange { .. }
        ));
        let nan = error(&[0., 1., 0., f64::NAN], real, None);
        assert!(matches!(nan, InputError::NotFinite { ref position, .. } if position == &[1, 1]));
        let missing = error(&[0., 2., 7., 0.], Meaning::Labels, Some(5));
        assert!(
            matches!(missing, InputError::LabelMissing { ref present, .. } if present == &[0, 2, 7])
        );
        let many: Vec<f64> = (0..600).map(f64::from).collect();
        assert!(matches!(
            error(&many, Meaning::Labels, None),
            InputError::Intensities { .. }
        ));
    }
}
