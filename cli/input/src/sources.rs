//! Inputs by name: files, or arrays in memory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::decode::Samples;
use super::number::{Meaning, NumberType};
use super::packed::Packed;
use super::raster::Colours;
use super::volume::usable_affine;
use super::{
    AnyImage, AnyImages, GreyRange, InputError, ReadOptions, bytes_of, decode_image,
    decode_samples, grey, mask,
};

/// The type of the numbers of an array, which decides what they mean, as in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArrayType {
    /// True in the object.
    Bool,
    /// Grey values from 0 to 255.
    U8,
    /// Grey values from 0 to 65535.
    U16,
    /// Other integers: labels.
    Integer,
    /// Floating-point numbers.
    Real,
}

/// An array in memory with its place, as a file would state it.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedArray {
    /// The numbers, `x` fastest.
    pub values: Vec<f64>,
    /// The type that they had.
    pub numbers: ArrayType,
    /// Samples along each axis, `x` first.
    pub size: Vec<usize>,
    /// Distance of neighbouring samples along each axis, `x` first.
    pub spacing: Option<Vec<f64>>,
    /// Affine map from sample indices to the world: right, front, up, in millimetres.
    pub affine: Option<[[f64; 4]; 3]>,
}

impl NamedArray {
    /// The numbers as those of a `.npy` file, or, in a volume with a spacing or a place, as those of
    /// a file of volumes.
    fn into_samples(self) -> Samples {
        let plain = self.spacing.is_none() && self.affine.is_none();
        let axes = self.size.len();
        let volume = self.affine.is_some() || (!plain && axes == 3);
        let numbers = match self.numbers {
            ArrayType::Bool => NumberType::Bool,
            ArrayType::U8 => NumberType::U8,
            ArrayType::U16 => NumberType::U16,
            ArrayType::Integer => NumberType::I64,
            ArrayType::Real => NumberType::F64,
        };
        let meaning = match self.numbers {
            ArrayType::Real if volume => Meaning::Real { labels: true },
            _ if volume => Meaning::Labels,
            _ => numbers.meaning(),
        };
        let of_affine = |affine: [[f64; 4]; 3]| -> Vec<f64> {
            let length = |k: usize| affine.iter().map(|row| row[k] * row[k]).sum::<f64>().sqrt();
            (0..axes).map(length).collect()
        };
        let spacing = self
            .spacing
            .or_else(|| self.affine.map(of_affine))
            .unwrap_or_else(|| vec![1.0; axes]);
        Samples {
            values: match self.numbers {
                // They were bytes.
                ArrayType::Bool | ArrayType::U8 if self.values.iter().copied().all(is_byte) => {
                    let bytes = self.values.iter().map(|x| *x as u8);
                    bytes.collect::<Vec<u8>>().into()
                }
                _ => self.values.into(),
            },
            size: self.size,
            meaning,
            spacing,
            affine: self.affine,
            plain_array: plain,
        }
    }
}

/// The inputs of a command: arrays by their names, and files by their paths.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    arrays: BTreeMap<PathBuf, Arc<Samples>>,
}

impl Sources {
    /// Files only.
    pub fn files() -> Self {
        Self::default()
    }

    /// Adds an array, which is read where an input has this name.
    ///
    /// # Errors
    /// [`InputError::Axes`] for numbers that are not as many as the size or the spacing states,
    /// [`InputError::Malformed`] for an affine map that is singular.
    pub fn insert(&mut self, name: &Path, array: NamedArray) -> Result<(), InputError> {
        let axes = array.size.len();
        let whole = array.size.iter().try_fold(1usize, |n, k| n.checked_mul(*k));
        let fits = whole == Some(array.values.len());
        let spaced = array.spacing.as_ref().is_none_or(|h| h.len() == axes);
        if !fits || !spaced {
            return Err(InputError::Axes {
                path: name.into(),
                found: axes,
            });
        }
        if let Some(affine) = array.affine {
            let format = "array with an affine map";
            usable_affine(affine, axes.clamp(2, 3), Packed { path: name, format })?;
        }
        let samples = Arc::new(array.into_samples());
        self.arrays.insert(name.into(), samples);
        Ok(())
    }

    /// The numbers of an input.
    fn samples(&self, path: &Path, colours: Colours) -> Result<Samples, InputError> {
        match self.arrays.get(path) {
            Some(samples) => Ok(Samples::clone(samples)),
            None => decode_samples(&bytes_of(path)?, path, colours),
        }
    }

    /// Reads one mask.
    ///
    /// # Errors
    /// [`InputError`] names the input, the defect and the remedy.
    pub fn read_image(&self, path: &Path, options: &ReadOptions) -> Result<AnyImage, InputError> {
        match self.arrays.get(path) {
            Some(samples) => mask::into_image(Samples::clone(samples), path, options),
            None => decode_image(&bytes_of(path)?, path, options),
        }
    }

    /// Reads masks that all have the same number of axes.
    ///
    /// # Errors
    /// As [`Self::read_image`], and [`InputError::MixedDimensions`].
    pub fn read_images(
        &self,
        paths: &[PathBuf],
        options: &ReadOptions,
    ) -> Result<AnyImages, InputError> {
        let images = paths.iter().map(|path| self.read_image(path, options));
        same_dimension(images.collect::<Result<_, _>>()?)
    }

    /// Reads label images that all have the same number of axes: whole numbers, not scaled; 0 is the
    /// background.
    ///
    /// # Errors
    /// As [`Self::read_images`].
    pub fn read_label_images(&self, paths: &[PathBuf]) -> Result<AnyImages, InputError> {
        let read =
            |path: &PathBuf| mask::into_label_image(self.samples(path, Colours::Refused)?, path);
        same_dimension(paths.iter().map(read).collect::<Result<_, _>>()?)
    }

    /// Reads grey images that all have the same number of axes, each on a scale on which nearly all
    /// values lie between 0 and 1.
    ///
    /// # Errors
    /// As [`Self::read_images`].
    pub fn read_grey_images(
        &self,
        paths: &[PathBuf],
    ) -> Result<(AnyImages, Vec<GreyRange>), InputError> {
        let read =
            |path: &PathBuf| grey::into_grey_image(self.samples(path, Colours::Luminance)?, path);
        let read: Result<Vec<_>, _> = paths.iter().map(read).collect();
        let (images, ranges) = read?.into_iter().unzip();
        Ok((same_dimension(images)?, ranges))
    }

    /// Reads the numbers of an image as they are; of a picture in colours their luminance.
    ///
    /// # Errors
    /// As [`Self::read_image`].
    pub fn read_numbers(&self, path: &Path) -> Result<Numbers, InputError> {
        let samples = self.samples(path, Colours::Luminance)?;
        mask::check_finite(&samples, path)?;
        Ok(Numbers {
            size: samples.size,
            affine: samples.affine,
            values: samples.values.into_vec(),
        })
    }
}

/// The numbers of an image as they are, and their place in the world.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// The numbers, `x` fastest.
    pub values: Vec<f64>,
    /// Samples along each axis, `x` first.
    pub size: Vec<usize>,
    /// Sample indices to world coordinates, if the file states them.
    pub affine: Option<[[f64; 4]; 3]>,
}

impl Numbers {
    /// Whether all are whole.
    pub fn are_whole(&self) -> bool {
        self.values.iter().all(|value| value.fract() == 0.0)
    }

    /// Whether they look like labels, and not like grey values stored as whole numbers: there are few of them,
    /// or most neighbours in a row are equal.
    pub fn are_labels(&self) -> bool {
        self.are_whole() && (self.are_few() || self.are_in_pieces())
    }

    fn are_few(&self) -> bool {
        let mut found: Vec<f64> = Vec::new();
        self.values.iter().all(|value| {
            if !found.contains(value) {
                found.push(*value);
            }
            found.len() <= FEW
        })
    }

    fn are_in_pieces(&self) -> bool {
        let row = self.size.first().copied().unwrap_or(0).max(1);
        let (mut pairs, mut equal) = (0, 0);
        for row in self.values.chunks(row) {
            for pair in row.windows(2) {
                // The background says nothing.
                let counts = pair[0] != 0.0 || pair[1] != 0.0;
                pairs += usize::from(counts);
                equal += usize::from(counts && pair[0] == pair[1]);
            }
        }
        2 * equal >= pairs
    }
}

/// Images of at most so many whole numbers are label images, however small their parts.
const FEW: usize = 8;

fn is_byte(x: f64) -> bool {
    f64::from(x as u8) == x
}

fn same_dimension(images: Vec<AnyImage>) -> Result<AnyImages, InputError> {
    let (mut flat, mut solid) = (Vec::new(), Vec::new());
    for image in images {
        match image {
            AnyImage::D2(image) => flat.push(image),
            AnyImage::D3(image) => solid.push(image),
        }
    }
    match (flat.first(), solid.first()) {
        (Some(flat), Some(solid)) => Err(InputError::MixedDimensions {
            flat: flat.path.clone(),
            solid: solid.path.clone(),
        }),
        (None, Some(_)) => Ok(AnyImages::D3(solid)),
        _ => Ok(AnyImages::D2(flat)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_values_are_no_labels() {
        let numbers = |size: [usize; 2], value: &dyn Fn(usize, usize) -> usize| Numbers {
            values: (0..size[0] * size[1])
                .map(|i| value(i % size[0], i / size[0]) as f64)
                .collect(),
            size: size.into(),
            affine: None,
        };
        let scan = numbers([40, 30], &|x, y| (x * 37 + y * 91) % 200);
        assert!(scan.are_whole() && !scan.are_labels());
        // Twelve blocks of numbers, and eight single points.
        assert!(numbers([40, 30], &|x, y| x / 10 + 4 * (y / 10)).are_labels());
        let point = |x: usize, y: usize| if x == y && x < 7 { x + 1 } else { 0 };
        assert!(numbers([40, 30], &point).are_labels());
        let mut halves = numbers([40, 30], &|x, _| x / 20);
        halves.values[0] = 0.5;
        assert!(!halves.are_labels());
    }

    fn array(values: &[f64], numbers: ArrayType) -> NamedArray {
        NamedArray {
            values: values.to_vec(),
            numbers,
            size: vec![2, values.len() / 2],
            spacing: None,
            affine: None,
        }
    }

    #[test]
    fn an_array_is_read_by_its_name_and_all_else_is_a_file() {
        let mut sources = Sources::files();
        let name = Path::new("mask_000");
        let values = [0.0, 255.0, 0.0, 51.0];
        sources.insert(name, array(&values, ArrayType::U8)).unwrap();
        match sources.read_image(name, &ReadOptions::default()).unwrap() {
            AnyImage::D2(image) => {
                assert_eq!(image.values, [0.0, 1.0, 0.0, 0.2]);
                assert!(image.plain_array);
            }
            AnyImage::D3(_) => panic!("the array has two axes"),
        }
        let other = sources.read_image(Path::new("mask_001"), &ReadOptions::default());
        assert!(matches!(other, Err(InputError::Unreadable { .. })));
    }

    #[test]
    fn sizes_have_to_fit() {
        let mut sources = Sources::files();
        let mut wrong = array(&[0.0; 4], ArrayType::Real);
        wrong.size = vec![3, 2];
        assert!(sources.insert(Path::new("a"), wrong).is_err());
        let mut flat = array(&[0.0; 4], ArrayType::Real);
        flat.affine = Some([[1.0; 4]; 3]);
        let refused = sources.insert(Path::new("a"), flat);
        assert!(matches!(refused, Err(InputError::Malformed { .. })));
    }

    #[test]
    fn a_volume_with_a_place_has_labels_and_the_spacing_of_its_axes() {
        let samples = NamedArray {
            values: vec![0.0, 2.0],
            numbers: ArrayType::U8,
            size: vec![1, 1, 2],
            spacing: None,
            affine: Some([
                [0.0, -2.0, 0.0, 5.0],
                [3.0, 0.0, 0.0, 6.0],
                [0.0, 0.0, 4.0, 7.0],
            ]),
        }
        .into_samples();
        assert_eq!(samples.spacing, [3.0, 2.0, 4.0]);
        assert_eq!(samples.meaning, Meaning::Labels);
        assert!(!samples.plain_array);
    }
}
