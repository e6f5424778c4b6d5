//! From the options to a checked plan.

use std::path::PathBuf;

use fe_grid::Grid;
use hyperelastic::{LameModuli, LawName, LawSpec};
use serde::Serialize;
use shape_average::{AverageParams, BoundaryCondition};

use super::args::{AverageArgs, Boundary, Mean, Solver};
use super::views;
use crate::error::CliError;
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::options::Align;
use crate::output::ResultDir;
use crate::shapes::{Placed, SeenMask};

/// All parameters of an average, with nothing left to choose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// Nodes a side.
    pub grid: usize,
    /// The minimiser.
    pub solver: Solver,
    /// Tolerance of a level.
    pub tolerance: f64,
    /// Most iterations of a level.
    pub max_iterations: u32,
    /// The law.
    pub law: LawName,
    /// First Lame modulus.
    pub lambda: f64,
    /// Second Lame modulus.
    pub mu: f64,
    /// Weight of the mismatch.
    pub mismatch_weight: f64,
    /// Weight of the length.
    pub length_weight: f64,
    /// Width of the interfaces on the finest grid: two spacings.
    pub interface_width: f64,
    /// Stiffness outside the objects.
    pub void_stiffness: f64,
    /// Weights of the shapes.
    pub weights: Vec<f64>,
    /// What of the elastic energies is least.
    pub mean: Mean,
    /// Alignment.
    pub align: Align,
    /// Border of the box.
    pub boundary: Boundary,
    /// The average whose deformations it began with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<PathBuf>,
    /// What was seen of the shapes, where that is not everything.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub valid: Vec<PathBuf>,
}

/// Inputs that are read, placed and checked, and what is to be done with them.
#[derive(Clone, Debug)]
pub struct AveragePlan<const D: usize> {
    /// The masks in the unit box.
    pub(crate) placed: Placed<D>,
    /// What was seen of them: none, or one each.
    pub(super) views: Vec<Option<SeenMask<D>>>,
    /// The parameters.
    pub parameters: Parameters,
}

/// A plan of either dimension.
#[derive(Clone, Debug)]
pub enum AnyPlan {
    /// In the plane.
    D2(AveragePlan<2>),
    /// In space.
    D3(AveragePlan<3>),
}

/// Reads, places and checks everything that an average needs.
///
/// # Errors
/// [`CliError`] with exit code 2 for anything that is wrong with inputs or options.
pub fn plan_average(args: &AverageArgs) -> Result<AnyPlan, CliError> {
    ResultDir::check(&args.common.output)?;
    if args.inputs.len() < 2 {
        return Err(CliError::TooFewInputs {
            command: "average",
            needed: 2,
            found: args.inputs.len(),
        });
    }
    let of_images = [
        ("--smooth", args.scales.smooth),
        ("--contrast", args.scales.contrast),
        ("--edge-weight", args.edge_weight),
    ];
    for (option, value) in of_images {
        if let Some(value) = value {
            return Err(CliError::Option {
                option,
                value: value.to_string(),
                remedy: "it is for grey images: add --joint, or leave it out".into(),
            });
        }
    }
    if args.sweep.is_some() && args.inputs.len() > 3 {
        return Err(CliError::Option {
            option: "--sweep",
            value: format!("of {} masks", args.inputs.len()),
            remedy: "give two masks for a line of averages, or three for a triangle".into(),
        });
    }
    // Weights are checked first: reading may take long.
    weights(&args.weights, args.inputs.len())?;
    let options = ReadOptions {
        label: args.common.label,
    };
    views::check(&args.valid, args.inputs.len())?;
    match read_images(&args.inputs, &options)? {
        AnyImages::D2(images) => {
            let views = views::read(&args.valid, |images| match images {
                AnyImages::D2(images) => Some(images),
                AnyImages::D3(_) => None,
            })?;
            let plan = plan_images(images, args)?;
            Ok(AnyPlan::D2(AveragePlan { views, ..plan }))
        }
        AnyImages::D3(images) => {
            let views = views::read(&args.valid, |images| match images {
                AnyImages::D2(_) => None,
                AnyImages::D3(images) => Some(images),
            })?;
            let plan = plan_images(images, args)?;
            Ok(AnyPlan::D3(AveragePlan { views, ..plan }))
        }
    }
}

/// Places images and checks all options.
///
/// # Errors
/// As [`plan_average`].
pub fn plan_images<const D: usize>(
    images: Vec<Image<D>>,
    args: &AverageArgs,
) -> Result<AveragePlan<D>, CliError> {
    let weights = weights(&args.weights, images.len())?;
    Ok(AveragePlan {
        placed: Placed::new(images, &args.common)?,
        views: Vec::new(),
        parameters: parameters::<D>(args, weights)?,
    })
}

impl Parameters {
    /// The same as the average takes them.
    pub fn average_params(&self) -> AverageParams {
        AverageParams {
            law: LawSpec {
                law: self.law,
                moduli: LameModuli {
                    lambda: self.lambda,
                    mu: self.mu,
                },
            },
            mismatch_weight: self.mismatch_weight,
            length_weight: Some(self.length_weight),
            void_stiffness: self.void_stiffness,
            weights: Some(self.weights.clone()),
            solver: match self.solver {
                Solver::Lbfgs => shape_average::Solver::Lbfgs,
                Solver::Descent => shape_average::Solver::Descent,
            },
            tolerance: self.tolerance,
            max_iterations: self.max_iterations as usize,
            boundary: boundary_condition(self.boundary),
            mean: match self.mean {
                Mean::Arithmetic => shape_average::Mean::Arithmetic,
                Mean::Median => shape_average::Mean::Median,
            },
            ..AverageParams::default()
        }
    }
}

/// The same as the average takes it.
pub(super) fn boundary_condition(boundary: Boundary) -> BoundaryCondition {
    match boundary {
        Boundary::Natural => BoundaryCondition::Natural,
        Boundary::Identity => BoundaryCondition::Identity,
    }
}

/// Checks the options and completes them.
fn parameters<const D: usize>(
    args: &AverageArgs,
    weights: Vec<f64>,
) -> Result<Parameters, CliError> {
    let common = &args.common;
    let nodes = common.nodes::<D>()?;
    let material = common.material::<D>()?;
    Ok(Parameters {
        grid: nodes,
        solver: args.solver,
        tolerance: args.tolerance,
        max_iterations: common.max_iterations,
        law: material.law,
        lambda: material.moduli.lambda,
        mu: material.moduli.mu,
        mismatch_weight: args.mismatch_weight,
        length_weight: args.length_weight.unwrap_or(1e-4 * args.mismatch_weight),
        interface_width: 2.0 * Grid::<D>::cube(nodes).spacing(),
        void_stiffness: common.void_stiffness,
        weights,
        mean: args.mean,
        align: common.align,
        boundary: args.boundary.unwrap_or_default(),
        start: args.start.clone(),
        valid: args.valid.clone(),
    })
}

fn weights(given: &[f64], shapes: usize) -> Result<Vec<f64>, CliError> {
    if given.is_empty() {
        return Ok(vec![1.0 / shapes as f64; shapes]);
    }
    if given.len() != shapes {
        return Err(CliError::WeightCount {
            expected: shapes,
            found: given.len(),
        });
    }
    let sum: f64 = given.iter().sum();
    let negative = given.iter().find(|w| **w < 0.0);
    if let Some(negative) = negative {
        return Err(CliError::Option {
            option: "--weights",
            value: negative.to_string(),
            remedy: "weights must not be negative and must add up to 1".into(),
        });
    }
    // Weights typed with six digits, such as .333333 three times, are meant to add up to 1.
    if (sum - 1.0).abs() > 1e-5 {
        let normalised = given.iter().map(|w| w / sum).collect();
        return Err(CliError::WeightSum {
            sum,
            normalised: if sum > 0.0 { normalised } else { Vec::new() },
        });
    }
    Ok(given.iter().map(|w| w / sum).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_checked_and_completed() {
        assert_eq!(weights(&[], 4).unwrap(), [0.25; 4]);
        assert_eq!(weights(&[0.25, 0.75], 2).unwrap(), [0.25, 0.75]);
        let thirds = weights(&[0.333333; 3], 3).unwrap();
        assert!((thirds.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!(matches!(
            weights(&[1.0], 2),
            Err(CliError::WeightCount { .. })
        ));
        assert!(matches!(
            weights(&[0.5, 0.6], 2),
            Err(CliError::WeightSum { .. })
        ));
        assert!(matches!(
            weights(&[-0.5, 1.5], 2),
            Err(CliError::Option { .. })
        ));
        assert!(matches!(
            weights(&[0.0, 0.0], 2),
            Err(CliError::WeightSum { .. })
        ));
    }
}
