//! Where inputs lie and how large shapes are, as `result.json` tells it.

use serde::Serialize;

use super::Input;
use super::align::AlignmentRecord;
use crate::input::place::FrameTransform;

/// One input, where it lies, and how large it is.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct InputRecord<const D: usize> {
    pub path: String,
    /// Samples along each axis, `x` first.
    size: Vec<usize>,
    frame: FrameTransform<D>,
    /// Sample indices to world coordinates, where the file states them.
    #[serde(skip_serializing_if = "Option::is_none")]
    affine: Option<[[f64; 4]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alignment: Option<AlignmentRecord>,
    #[serde(flatten)]
    object: SizeRecord,
}

/// Area in 2D, volume in 3D.
#[derive(Clone, Debug, Default, Serialize)]
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

/// Where the coordinates of a surface are at home.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct SurfaceRecord {
    /// `world` (the affine map of that input), `input` (sample times spacing) or `unit_box`.
    pub coordinates: &'static str,
    /// Position of the input whose coordinates these are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_input: Option<usize>,
}

/// The scale of all frames, where they have one. Scales that are one up to rounding are one.
pub(crate) fn common_scale<const D: usize>(inputs: &[Input<D>]) -> Option<f64> {
    let first = inputs.first()?.frame.scale();
    let same = |input: &Input<D>| (input.frame.scale() / first - 1.0).abs() < 1e-12;
    inputs.iter().all(same).then_some(first)
}

impl<const D: usize> InputRecord<D> {
    /// The record of an input.
    pub fn new(input: &Input<D>) -> Self {
        Self {
            path: input.path.display().to_string(),
            size: input.size.to_vec(),
            frame: input.frame,
            affine: input.affine,
            alignment: input.alignment.map(|alignment| alignment.record()),
            object: SizeRecord::new::<D>(input.volume, Some(input.frame.scale())),
        }
    }
}

impl SizeRecord {
    /// The record of an area or volume in the unit box, and in lengths of the inputs, where they
    /// have one scale.
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
