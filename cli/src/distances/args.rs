//! Options of `shapespace distances`.

use std::path::{Path, PathBuf};

use ::geodesic::distances::Linkage;
use ::geodesic::{DomainChoice, Form, GeodesicParams};
use clap::Args;
use fe_grid::Grid;
use serde::{Deserialize, Serialize};

use super::classes;
use super::shard::Shard;
use crate::config::{Config, Configured, RUN, allow};
use crate::error::CliError;
use crate::geodesic::{check_form, check_path};
use crate::options::{Align, MaskOptions, RunOptions, at_least};
use shapespace_input::Kinds;

/// Options of `shapespace distances`.
#[derive(Clone, Debug, Args)]
pub struct DistancesArgs {
    /// Parameters of the computation.
    #[command(flatten)]
    pub config: Configured<DistancesConfig>,
    /// Options that do not influence the results.
    #[command(flatten)]
    pub run: RunOptions,
    /// Number of paths computed at the same time [default: one per thread]; fewer need less memory.
    /// The results do not depend on it.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..),
        help_heading = RUN
    )]
    pub at_once: Option<u32>,
    /// Compute the paths of a part of the pairs only, for example 3/8: the third of eight parts. Each
    /// part may be computed on another machine; `--merge` collects them.
    #[arg(long, value_name = "I/N", conflicts_with = "merge", help_heading = RUN)]
    pub shard: Option<Shard>,
    /// Use the paths in these result directories of the same inputs and parameters: parts, finished or
    /// not, or a complete result that is to be evaluated with other classes or clusters. Paths that
    /// are missing are computed.
    #[arg(long, value_name = "DIR", num_args = 1.., help_heading = RUN)]
    pub merge: Vec<PathBuf>,
}

/// Configuration of `shapespace distances`.
///
/// By default the shapes of each pair are aligned: a length does not depend on the positions of the
/// shapes, but the local minimum that is found does. Half as many steps as for a single path
/// suffice, since the mean of both directions is correct to second order in the steps.
#[derive(Clone, Debug, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct DistancesConfig {
    /// Input masks, the object bright: PNG, JPEG, PGM, PBM, PPM, TIFF, BMP, .npy, NIfTI, NRRD or
    /// MetaImage; closed surfaces: STL, PLY, OBJ, VTK or VTP; outlines: SVG or CSV. A folder, or a
    /// pattern in quotes, stands for its files.
    #[arg(value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Stored shapes, as files, folders or patterns: only the distances from the inputs to these are
    /// computed, and the nearest of them are listed for every input. `--classes` are theirs.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub against: Vec<PathBuf>,
    /// Number of nearest neighbours that are listed for every shape [default: none, 5 with --against
    /// and with --skip-far].
    #[arg(long, value_name = "K")]
    pub neighbours: Option<usize>,
    /// Skip the paths of pairs that are too far apart to be among the nearest neighbours: pairs with a
    /// lower bound of the length beyond them. The bound is calibrated on a random sample, of whose
    /// lengths this share is shorter, for example .05. The summary says how many neighbours are kept.
    #[arg(long, value_name = "SHARE")]
    pub skip_far: Option<f64>,
    /// Number of landmarks, shapes with paths to all others: the map of all shapes is made of these paths
    /// alone, and others are not computed unless --against or --skip-far ask for them [default: none,
    /// with --skip-far half the root of the number of shapes, at least 4].
    #[arg(long, value_name = "N")]
    pub landmarks: Option<usize>,
    /// How masks are read, placed and aligned, pair by pair.
    #[serde(flatten)]
    #[command(flatten)]
    pub masks: MaskOptions,
    /// Compute each path in one direction only, from the earlier to the later shape. This halves
    /// the work, but the distances are correct to first order in the steps only.
    #[arg(long)]
    pub one_way: bool,
    /// Also compute all paths with half as many steps, and extrapolate their lengths (Richardson).
    #[arg(long)]
    pub richardson: bool,
    /// Dice overlap with the end shape above which a path counts as complete [default: as in
    /// `geodesic`, 0.95 or boundaries within a quarter of a grid spacing]. The length of an
    /// incomplete path is too small, and is marked.
    #[arg(long, value_name = "DICE")]
    pub reached: Option<f64>,
    /// Compute paths that fold or do not reach their end once more in this form.
    #[arg(long, value_enum, value_name = "FORM")]
    pub retry: Option<Form>,
    /// How often the spacing of the grid is halved for a pair whose paths fold or do not reach their
    /// end: all its paths are computed again. [default: 1 in 2D up to 257 x 257 nodes, else 0, since a
    /// finer grid takes four times the memory, in 3D eight times]
    #[arg(long, value_name = "N")]
    pub refine: Option<u32>,
    /// Rounds in which pairs whose path does not arrive, or is longer than the way through a third shape, or
    /// little shorter than one through a shape in the middle, are minimised again from that way: what violates
    /// the triangle inequality is not the shortest path. 0 leaves them as they are.
    #[arg(long, value_name = "N")]
    pub detours: u32,
    /// Linkage: how the distance between two clusters is defined.
    #[arg(long, value_enum)]
    pub linkage: Linkage,
    /// Number of clusters [default: the number of classes; without classes, at the widest gap of
    /// the dendrogram].
    #[arg(long, value_name = "N")]
    pub clusters: Option<usize>,
    /// Known classes: "folder" or "prefix" to take them from the names of the inputs, or a file
    /// with lines "file,class".
    #[arg(long, value_name = "folder|prefix|FILE")]
    pub classes: Option<PathBuf>,
    /// Parameters of the paths.
    #[serde(flatten)]
    #[command(flatten)]
    pub params: GeodesicParams,
}

impl Default for DistancesConfig {
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            against: Vec::new(),
            neighbours: None,
            skip_far: None,
            landmarks: None,
            masks: MaskOptions {
                align: Some(Align::Rigid),
                ..MaskOptions::default()
            },
            one_way: false,
            richardson: false,
            reached: None,
            retry: None,
            refine: None,
            detours: 2,
            linkage: Linkage::default(),
            clusters: None,
            classes: None,
            params: GeodesicParams {
                steps: 4,
                // A shape between both takes as long as both ends together, for lengths that are a few percent less.
                domain: DomainChoice::Ends,
                ..GeodesicParams::default()
            },
        }
    }
}

impl Config for DistancesConfig {
    const COMMAND: &'static str = "distances";

    fn may_align(&self) -> bool {
        self.masks.may_align()
    }

    fn check(&self) -> Result<(), CliError> {
        let most = self.inputs.len();
        let needed = if self.against.is_empty() { 2 } else { 1 };
        at_least(needed, Self::COMMAND, &self.inputs)?;
        check_path(&self.params)?;
        let neighbours = self.neighbours != Some(0);
        allow(neighbours, "neighbours", &0, "at least 1")?;
        let share = self.skip_far.unwrap_or(0.5);
        let is_share = share > 0.0 && share < 1.0;
        allow(is_share, "skip_far", &share, "a number above 0 and below 1")?;
        let incomplete = [
            (!self.against.is_empty(), "--against"),
            (self.skip_far.is_some(), "--skip-far"),
            (self.landmarks.is_some(), "--landmarks"),
        ];
        let incomplete = incomplete.iter().find(|(given, _)| *given);
        if let (Some(clusters), Some((_, name))) = (self.clusters, incomplete) {
            return Err(CliError::Option {
                option: "--clusters",
                value: format!("{clusters} with {name}"),
                remedy: "clusters need the distances between all shapes, of new and of stored ones: leave \
                         out one of both"
                    .into(),
            });
        }
        self.check_landmarks()?;
        if self.retry != Some(Form::LevelSets) {
            check_form(&self.params)?;
        }
        if self.retry == Some(self.params.form) {
            return Err(CliError::Option {
                option: "--retry",
                value: "with the same --form".into(),
                remedy: "name the other form, or leave it out".into(),
            });
        }
        if self.richardson && !self.params.steps.is_multiple_of(2) {
            return Err(CliError::Option {
                option: "--richardson",
                value: format!("with {} steps", self.params.steps),
                remedy: "choose an even number of steps (-K): paths of half as many are computed, \
                         too"
                .into(),
            });
        }
        let refine = self.refine.unwrap_or(0);
        allow(refine <= MOST_REFINED, "refine", &refine, "at most 4")?;
        let reached = self.reached.unwrap_or(1.0);
        let share = reached > 0.0 && reached <= 1.0;
        allow(share, "reached", &reached, "a number above 0 and up to 1")?;
        match self.clusters {
            Some(clusters) if clusters > most => Err(CliError::Option {
                option: "--clusters",
                value: clusters.to_string(),
                remedy: format!("there are {most} shapes, and at most as many clusters"),
            }),
            clusters => allow(clusters != Some(0), "clusters", &0, "at least 1"),
        }
    }

    fn inputs(&mut self) -> Vec<(&mut Vec<PathBuf>, Kinds)> {
        let lists = [&mut self.inputs, &mut self.against];
        lists.map(|list| (list, Kinds::Masks)).into()
    }

    fn paths(&mut self) -> Vec<&mut PathBuf> {
        let file = |path: &&mut PathBuf| !classes::NAMED.map(Path::new).contains(&path.as_path());
        let classes = self.classes.iter_mut().filter(file);
        let shapes = self.inputs.iter_mut().chain(&mut self.against);
        shapes.chain(classes).collect()
    }
}

/// Nodes of the finest plane grid that is refined by default.
const REFINED_NODES: usize = 257 * 257;

/// A grid of 16 times the nodes of an axis is finer than any image.
const MOST_REFINED: u32 = 4;

/// Neighbours of new shapes, as in scikit-learn.
const NEIGHBOURS: usize = 5;

impl DistancesConfig {
    /// The files of all shapes: the inputs, then the stored ones.
    pub(super) fn shapes(&self) -> Vec<PathBuf> {
        self.inputs.iter().chain(&self.against).cloned().collect()
    }

    /// Number of neighbours that are listed, if any.
    pub(super) fn listed_neighbours(&self) -> Option<usize> {
        let asked = !self.against.is_empty() || self.skip_far.is_some();
        self.neighbours.or(asked.then_some(NEIGHBOURS))
    }

    fn check_landmarks(&self) -> Result<(), CliError> {
        let least = 3;
        let most = if self.against.is_empty() {
            self.inputs.len()
        } else {
            self.against.len()
        };
        match self.landmarks {
            Some(number) if number < least || number > most => Err(CliError::Option {
                option: "--landmarks",
                value: number.to_string(),
                remedy: format!(
                    "a map needs {least}, and there are {most} shapes from which they can be taken"
                ),
            }),
            Some(_) if self.against.is_empty() && self.skip_far.is_none() => match self.neighbours {
                Some(count) => Err(CliError::Option {
                    option: "--neighbours",
                    value: format!("{count} with --landmarks"),
                    remedy:
                        "the distances from landmarks alone tell no neighbours: add --skip-far, or \
                             leave out one of both"
                            .into(),
                }),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// Number of directions in which the path of a pair is computed.
    pub(super) fn directions(&self) -> usize {
        if self.one_way { 1 } else { 2 }
    }

    /// Numbers of steps of the paths for one distance, that of the reported length first.
    pub(super) fn steps(&self) -> Vec<usize> {
        let steps = self.params.steps;
        if self.richardson {
            vec![steps, steps / 2]
        } else {
            vec![steps]
        }
    }

    /// How often this grid is refined for pairs whose paths do not arrive.
    pub(super) fn refinements<const D: usize>(&self, grid: &Grid<D>) -> u32 {
        let few = D == 2 && grid.n_nodes() <= REFINED_NODES;
        self.refine.unwrap_or(u32::from(few))
    }

    /// Rounds of ways through third shapes, of which the deformations are known.
    pub(super) fn detours(&self) -> u32 {
        match self.params.form {
            Form::Lagrangian => self.detours,
            Form::LevelSets => 0,
        }
    }

    /// The forms of all attempts, in their order.
    pub(super) fn forms(&self) -> impl Iterator<Item = Form> + use<> {
        std::iter::once(self.params.form).chain(self.retry)
    }
}
