//! Placement of inputs and sizes of shapes in `result.json`.

use std::path::PathBuf;

use levelset::RigidMotion;
use serde::{Deserialize, Serialize};

use super::Input;
use super::align::Alignment;
use crate::numbers::rounded;
use shapespace_input::frame::FrameTransform;
use shapespace_input::{GreyRange, Image};

/// One input, its placement and its size.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct InputRecord<const D: usize> {
    pub path: PathBuf,
    /// As in tables and pictures.
    pub name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// Samples along each axis, `x` first.
    pub size: Vec<usize>,
    /// The numbers of a grey image that are 0 and 1 here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grey: Option<GreyRange>,
    pub frame: FrameTransform<D>,
    /// Factor by which it was scaled before, to the mean size of all inputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_factor: Option<f64>,
    /// Sample indices to world coordinates, where the file states them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) affine: Option<[[f64; 4]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment: Option<Alignment<D>>,
    /// Whether the results lie in its world.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub leads: bool,
    /// The checksum of its files, which is added where a result is sealed.
    #[serde(default, skip_serializing)]
    pub sha256: Option<String>,
    #[serde(flatten)]
    object: SizeRecord,
}

/// Area in 2D, volume in 3D.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct SizeRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area_input_units: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_input_units: Option<f64>,
}

/// Coordinate system of a surface or an outline.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct SurfaceRecord {
    /// `world` (the affine map of that input), `input` (sample times spacing) or `unit_box`.
    pub coordinates: &'static str,
    /// Number of the input whose coordinates these are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_input: Option<usize>,
}

/// Coordinate systems of the boundaries of a result: of surfaces in 3D, of outlines in 2D.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct BoundaryRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outline: Option<SurfaceRecord>,
}

/// The records of all inputs.
pub(crate) fn records_of<const D: usize>(inputs: &[Input<D>]) -> Vec<InputRecord<D>> {
    inputs.iter().map(InputRecord::new).collect()
}

/// The common one of the scales of inputs, if there is one; one up to rounding counts as one.
pub(crate) fn common_scale(scales: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut scales = scales.into_iter();
    let first = scales.next()?;
    let same = |scale: f64| (scale / first - 1.0).abs() < 1e-12;
    scales.all(same).then_some(first)
}

/// How inputs were aligned and scaled, if they were.
pub(crate) fn describe_placement<const D: usize>(inputs: &[InputRecord<D>]) -> Option<String> {
    let aligned = || inputs.iter().filter_map(|input| input.alignment);
    let is_reference =
        |input: &&InputRecord<D>| input.alignment.is_some_and(|alignment| alignment.reference);
    let scaled = inputs.iter().any(|input| input.size_factor.is_some());
    let angles = aligned().map(|alignment| alignment.motion.angle().to_degrees());
    let turned = angles.fold(0.0, f64::max);
    let mut parts = Vec::new();
    if let Some(reference) = inputs.iter().find(is_reference) {
        let ways: Option<Vec<f64>> = aligned().map(|alignment| alignment.moved).collect();
        let moved = ways.map_or_else(String::new, |ways| {
            let most = ways.into_iter().fold(0.0, f64::max);
            format!(" and moved by up to {most:.1} mm")
        });
        parts.push(format!(
            "rigid, onto '{}', turned by up to {turned:.1} degrees{moved} (--align none keeps \
             positions)",
            reference.name
        ));
    }
    if scaled {
        parts.push("scaled to equal sizes".into());
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

impl<const D: usize> InputRecord<D> {
    /// The motion by which it was aligned, the identity for one that was not.
    pub fn motion(&self) -> RigidMotion<D> {
        let identity = RigidMotion::identity();
        self.alignment
            .map_or(identity, |alignment| alignment.motion)
    }

    /// Length in the box of one length unit of the file.
    pub fn scale(&self) -> f64 {
        self.size_factor.unwrap_or(1.0) * self.frame.scale()
    }

    /// Whether its file states its place in the world.
    pub fn states_place(&self) -> bool {
        self.affine.is_some() || self.frame.in_world()
    }

    /// The record of a grey image with its label in pictures, its grey values and its placement.
    pub fn of_image(
        image: &Image<D>,
        name: String,
        range: GreyRange,
        frame: FrameTransform<D>,
    ) -> Self {
        Self {
            path: image.path.clone(),
            name,
            class: None,
            size: image.size.to_vec(),
            grey: Some(range),
            frame,
            size_factor: None,
            affine: image.affine,
            alignment: None,
            leads: false,
            sha256: None,
            object: SizeRecord::default(),
        }
    }

    /// The record of an input.
    pub fn new(input: &Input<D>) -> Self {
        Self {
            path: input.path.clone(),
            name: input.name.clone(),
            class: None,
            size: input.size.to_vec(),
            grey: None,
            frame: input.frame,
            size_factor: Some(input.size_factor).filter(|&factor| factor != 1.0),
            affine: input.affine,
            alignment: input.alignment,
            leads: input.leads && input.frame.in_world(),
            sha256: None,
            object: SizeRecord::new::<D>(input.volume, Some(input.scale())),
        }
    }
}

impl SizeRecord {
    /// The area or volume in words, in millimetres in the world, else in units of the inputs where they have one in
    /// common.
    pub fn in_words(&self, in_world: bool) -> String {
        let power = if self.area.is_some() { 2 } else { 3 };
        let physical = self.area_input_units.or(self.volume_input_units);
        let whole = self.area.or(self.volume).unwrap_or_default();
        match physical {
            Some(size) if in_world => format!("{} mm^{power}", rounded(size)),
            Some(size) => format!("{} in units of the inputs", rounded(size)),
            None => format!("{} in the unit box", rounded(whole)),
        }
    }

    /// The record of an area or volume in the unit box, and in length units of the inputs, if these
    /// have a common scale.
    pub fn new<const D: usize>(volume: f64, scale: Option<f64>) -> Self {
        let physical = scale.map(|scale| volume / scale.powi(D as i32));
        if D == 2 {
            Self {
                area: Some(volume),
                area_input_units: physical,
                ..Self::default()
            }
        } else {
            Self {
                volume: Some(volume),
                volume_input_units: physical,
                ..Self::default()
            }
        }
    }
}
