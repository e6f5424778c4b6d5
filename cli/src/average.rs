//! `shapespace average`: from the options to a checked plan.

use fe_grid::Grid;
use serde::Serialize;

use crate::args::{Align, AverageArgs, Boundary, Law, Solver};
use crate::error::CliError;
use crate::input::fit::{FrameTransform, fit_frames};
use crate::input::{AnyImages, Image, ReadOptions, read_images};
use crate::output::ResultDir;

/// Fewest nodes a side.
const FEWEST_NODES: usize = 9;

/// All parameters of an average, with nothing left to choose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameters {
    /// Nodes a side.
    pub grid: usize,
    /// The minimiser.
    pub solver: Solver,
    /// The law.
    pub law: Law,
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
    /// Alignment.
    pub align: Align,
    /// Border of the box.
    pub boundary: Boundary,
}

/// Inputs that are read, placed and checked, and what is to be done with them.
#[derive(Clone, Debug)]
pub struct AveragePlan<const D: usize> {
    /// The masks.
    pub images: Vec<Image<D>>,
    /// Where each mask lies in the unit box.
    pub frames: Vec<FrameTransform<D>>,
    /// The finest grid.
    pub grid: Grid<D>,
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
    ResultDir::check(&args.output)?;
    if args.inputs.len() < 2 {
        return Err(CliError::TooFewInputs {
            command: "average",
            needed: 2,
            found: args.inputs.len(),
        });
    }
    let weights = weights(&args.weights, args.inputs.len())?;
    let options = ReadOptions { label: args.label };
    match read_images(&args.inputs, &options)? {
        AnyImages::D2(images) => plan(images, weights, args, 129, 4097).map(AnyPlan::D2),
        AnyImages::D3(images) => plan(images, weights, args, 65, 513).map(AnyPlan::D3),
    }
}

/// Runs `shapespace average`.
///
/// # Errors
/// As [`plan_average`].
pub fn run_average(args: &AverageArgs) -> Result<(), CliError> {
    plan_average(args).map(drop)
}

fn plan<const D: usize>(
    images: Vec<Image<D>>,
    weights: Vec<f64>,
    args: &AverageArgs,
    usual_nodes: usize,
    most_nodes: usize,
) -> Result<AveragePlan<D>, CliError> {
    let nodes = args.grid.unwrap_or(usual_nodes);
    check_nodes(nodes, most_nodes)?;
    let grid = Grid::cube(nodes);
    Ok(AveragePlan {
        frames: fit_frames(&images, nodes),
        images,
        grid,
        parameters: Parameters {
            grid: nodes,
            solver: args.solver,
            law: args.law,
            lambda: args.lambda,
            mu: args.mu,
            mismatch_weight: args.mismatch_weight,
            length_weight: args.length_weight.unwrap_or(1e-4 * args.mismatch_weight),
            interface_width: 2.0 * grid.spacing(),
            void_stiffness: args.void_stiffness,
            weights,
            align: args.align,
            boundary: args.boundary,
        },
    })
}

fn check_nodes(nodes: usize, most: usize) -> Result<(), CliError> {
    let cells = nodes.saturating_sub(1);
    if cells.is_power_of_two() && (FEWEST_NODES..=most).contains(&nodes) {
        return Ok(());
    }
    let near = cells.clamp(FEWEST_NODES - 1, most - 1).next_power_of_two() + 1;
    Err(CliError::Option {
        option: "--grid",
        value: nodes.to_string(),
        remedy: format!(
            "the grid needs 2^L + 1 nodes a side, from {FEWEST_NODES} to {most}; try --grid {near}"
        ),
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

    #[test]
    fn grids_are_two_to_a_power_plus_one() {
        assert!(check_nodes(9, 513).is_ok());
        assert!(check_nodes(513, 513).is_ok());
        for (wrong, hint) in [(0, "9"), (5, "9"), (64, "65"), (100, "129"), (5000, "513")] {
            match check_nodes(wrong, 513) {
                Err(CliError::Option { remedy, .. }) => {
                    assert!(remedy.ends_with(&format!("--grid {hint}")), "{remedy}");
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
