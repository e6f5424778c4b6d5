//! The errors of the program, their reports, and the exit codes.

use std::borrow::Cow;
use std::error::Error;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::numbers::shown;
use crate::output::OutputError;
use hyperelastic::LawError;
use shape_pca::PcaError;
use shapespace_input::InputError;
use shapespace_input::terminal::{note, printable};

/// The exit code of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Success.
    Success = 0,
    /// The computation or the system failed.
    Failure = 1,
    /// The inputs or options cannot be used.
    BadInput = 2,
    /// The result is doubtful; it has been written.
    Doubtful = 3,
    /// The user pressed Ctrl-C; the current state has been written.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// The reason for which a command failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// An input cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// An output cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Fewer inputs than a command needs.
    #[error("'{command}' needs at least {needed} inputs, found {found}")]
    TooFewInputs {
        /// The command.
        command: &'static str,
        /// Inputs it needs.
        needed: usize,
        /// Inputs found.
        found: usize,
    },
    /// An input that is not named.
    #[error("'{command}' needs {what}")]
    Missing {
        /// The command.
        command: &'static str,
        /// The missing input.
        what: &'static str,
    },
    /// Several processes for a command that runs on one.
    #[error("{command} runs on one process, and there are {processes}")]
    OneProcess {
        /// The command.
        command: &'static str,
        /// The processes.
        processes: usize,
    },
    /// Several processes for a program that cannot exchange messages.
    #[error("{processes} processes were started, and this program was built without MPI")]
    WithoutMpi {
        /// The processes.
        processes: usize,
    },
    /// An error that has been reported: the last line of a log.
    #[error("reported in the log")]
    Reported(Exit),
    /// Weights of the wrong number.
    #[error("--weights has {found} numbers for {expected} masks")]
    WeightCount {
        /// Masks.
        expected: usize,
        /// Weights.
        found: usize,
    },
    /// Weights that do not add up to 1.
    #[error("the weights add up to {}, not to 1", shown(*sum))]
    WeightSum {
        /// Their sum.
        sum: f64,
        /// The weights divided by their sum, where it is positive.
        normalised: Vec<f64>,
    },
    /// Classes that are not known.
    #[error("--classes {source_name} cannot be used: {reason}")]
    Classes {
        /// The value of the option.
        source_name: String,
        /// Why not.
        reason: String,
    },
    /// An unfinished run with other parameters or inputs.
    #[error("'{}' belongs to a run with other parameters or inputs: {differences}", path.display())]
    OtherWork {
        /// The folder.
        path: PathBuf,
        /// The differences.
        differences: String,
    },
    /// A directory whose paths cannot be used.
    #[error("the paths in '{path}' are not those of this computation: {differences}", path = path.display())]
    OtherPaths {
        /// The directory.
        path: PathBuf,
        /// The differences.
        differences: String,
    },
    /// An option that is out of its range.
    #[error("{option} {value} is not allowed")]
    Option {
        /// The option.
        option: &'static str,
        /// The value.
        value: String,
        /// The allowed values.
        remedy: String,
    },
    /// A parameter that is out of its range.
    #[error("--{} {value} is not allowed", name.replace('_', "-"))]
    Parameter {
        /// Its name.
        name: &'static str,
        /// The value.
        value: String,
        /// The allowed values.
        expected: String,
    },
    /// A configuration file with a wrong key or value; line 0 if no line is wrong.
    #[error("{}: {message}", place(path, *line))]
    Config {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The defect.
        message: String,
        /// The remedy.
        remedy: String,
    },
    /// An option of a call that does not exist, or has another type.
    #[error("{message}")]
    Key {
        /// The defect.
        message: String,
        /// The remedy.
        remedy: String,
    },
    /// A law that does not exist for the moduli.
    #[error("--law {law} cannot be used: {source}")]
    Law {
        /// The law.
        law: String,
        /// Why.
        source: LawError,
    },
    /// A shape that contains no node of the grid.
    #[error("no node of {nodes} a side lies inside the object of '{}'", path.display())]
    LostOnGrid {
        /// The file.
        path: PathBuf,
        /// Nodes along the longest side.
        nodes: usize,
    },
    /// An input without a usable boundary.
    #[error("'{}' has no usable boundary: {source}", path.display())]
    Shape {
        /// The file.
        path: PathBuf,
        /// Why.
        source: levelset::LevelsetError,
    },
    /// An array or a directory that is not the one that its record or another result states.
    #[error("'{}' cannot be used: {reason}", path.display())]
    Damaged {
        /// The array or directory.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// A shape that is drawn outside of its grid, or around all of it.
    #[error("the shape {} on a grid of {nodes} nodes a side", if *full { "covers the whole box" } else { "is empty" })]
    NoObject {
        /// Whether it covers everything.
        full: bool,
        /// Nodes a side.
        nodes: usize,
    },
    /// The average cannot be computed.
    #[error("the average cannot be computed: {0}")]
    Average(shape_average::AverageError),
    /// The geodesic cannot be computed.
    #[error("the geodesic cannot be computed: {0}")]
    Geodesic(geodesic::GeodesicError),
    /// A directory that does not contain a geodesic that can be continued.
    #[error("'{}' is not a geodesic that can be continued: {reason}", path.display())]
    NoGeodesic {
        /// The directory.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The modes of variation cannot be computed.
    #[error("the modes of variation cannot be computed: {0}")]
    Pca(PcaError),
    /// Ctrl-C before there was a result.
    #[error("stopped before there was a result; nothing has been written")]
    Stopped,
    /// Ctrl-C before all pairs were finished.
    #[error("stopped with {done} of {total} pairs finished, which are kept in '{}'", path.display())]
    Unfinished {
        /// Finished pairs.
        done: usize,
        /// Requested pairs.
        total: usize,
        /// The directory of the finished pairs.
        path: PathBuf,
    },
    /// A directory that is not the result of the required command.
    #[error("'{}' is not a result of `shapespace {command}`: {reason}", path.display())]
    NoResult {
        /// The directory.
        path: PathBuf,
        /// The command whose result it should be.
        command: &'static str,
        /// The reason.
        reason: String,
    },
    /// A directory without the record of a result.
    #[error("'{}' is not a result of shapespace: {reason}", path.display())]
    NoRecord {
        /// The directory.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// A variation that does not fit a geodesic.
    #[error("'{}' is not a variation of the geodesic's first shape: it {reason}", path.display())]
    Variation {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Temporary files cannot be written.
    #[error("{0}")]
    Spill(fe_grid::GridError),
    /// There is too little memory, even with temporary files.
    #[error("{} of memory are not enough for {shapes} shapes on {nodes} nodes, which need {} even with temporary files", shapespace_input::bytes::format_bytes(*limit), shapespace_input::bytes::format_bytes(*needed))]
    Memory {
        /// The memory limit.
        limit: u64,
        /// The required memory.
        needed: u64,
        /// Shapes.
        shapes: usize,
        /// Nodes a side, or along each axis.
        nodes: String,
    },
    /// A computation needs more memory than is free.
    #[error("the computation on {nodes} nodes needs about {} of memory, and {} are free", shapespace_input::bytes::format_bytes(*needed), shapespace_input::bytes::format_bytes(*free))]
    TooLarge {
        /// The required memory.
        needed: u64,
        /// The free memory.
        free: u64,
        /// Nodes a side, or along each axis.
        nodes: String,
    },
    /// A computation failed.
    #[error("{message}")]
    Computation {
        /// What failed.
        message: String,
        /// The remedy.
        remedy: String,
    },
}

/// Errors of a library: a parameter that is out of its range is the same in all of them.
macro_rules! from_library {
    ($error:ty, $other:expr) => {
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                type Error = $error;
                match error {
                    Error::Parameter {
                        name,
                        expected,
                        value,
                    } => Self::Parameter {
                        name,
                        value: shown(value),
                        expected: expected.into(),
                    },
                    other => $other(other),
                }
            }
        }
    };
}

from_library!(shape_average::AverageError, average_error);
from_library!(geodesic::GeodesicError, geodesic_error);
from_library!(PcaError, Self::Pca);
from_library!(phasefield::PhaseFieldError, segmentation_error);

fn geodesic_error(error: geodesic::GeodesicError) -> CliError {
    match error {
        geodesic::GeodesicError::BothHidden => CliError::Option {
            option: "--occluded",
            value: "both".into(),
            remedy: "a path of deformations, or of a single step, compares the two shapes once, where \
                     every difference may be hidden: use --form level-sets with two steps (-K) or more, or \
                     state what is visible (--valid-start, --valid-end)"
                .into(),
        },
        geodesic::GeodesicError::Middle => CliError::Option {
            option: "--domain",
            value: "middle".into(),
            remedy: "no shape between both was found, as for shapes that lie apart or of which a part is \
                     hidden: use --domain better"
                .into(),
        },
        other => CliError::Geodesic(other),
    }
}

fn average_error(error: shape_average::AverageError) -> CliError {
    match error {
        shape_average::AverageError::Grid(spill @ fe_grid::GridError::Spill { .. }) => {
            CliError::Spill(spill)
        }
        shape_average::AverageError::Distributed { what, processes } => CliError::OneProcess {
            command: what,
            processes,
        },
        other => CliError::Average(other),
    }
}

#[expect(clippy::needless_pass_by_value, reason = "an error is consumed")]
fn segmentation_error(error: phasefield::PhaseFieldError) -> CliError {
    CliError::Computation {
        message: format!("the image cannot be segmented: {error}"),
        remedy: "try another --smooth or --contrast; if that does not help, please report it with the image".into(),
    }
}

impl From<levelset::LevelsetError> for CliError {
    fn from(error: levelset::LevelsetError) -> Self {
        Self::Computation {
            message: format!("a boundary cannot be found or measured: {error}"),
            remedy: "use a finer --grid, on which no shape is lost; if that does not help, please report it \
                     with the inputs"
                .into(),
        }
    }
}

impl From<fe_grid::GridError> for CliError {
    fn from(error: fe_grid::GridError) -> Self {
        shape_average::AverageError::from(error).into()
    }
}

fn normalised_help(normalised: &[f64]) -> Cow<'static, str> {
    if normalised.is_empty() {
        return "weights must not be negative and must add up to 1".into();
    }
    let numbers: Vec<String> = normalised.iter().map(|w| format!("{w:.6}")).collect();
    format!("divided by their sum they are {}", numbers.join(",")).into()
}

/// A file and a line of it.
fn place(path: &Path, line: usize) -> String {
    match line {
        0 => format!("'{}'", path.display()),
        _ => format!("'{}', line {line}", path.display()),
    }
}

impl CliError {
    /// The key of a configuration that this is about.
    pub(crate) fn key(&self) -> Option<String> {
        match self {
            Self::Parameter { name, .. } => Some((*name).into()),
            Self::Option { option, .. } => Some(option.strip_prefix("--")?.replace('-', "_")),
            Self::WeightCount { .. } | Self::WeightSum { .. } => Some("weights".into()),
            Self::Law { .. } => Some("law".into()),
            _ => None,
        }
    }

    /// The exit code of this error.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Pca(PcaError::NoVariation | PcaError::TooFewShapes { .. }) => Exit::BadInput,
            Self::Computation { .. }
            | Self::Average(_)
            | Self::Geodesic(_)
            | Self::Pca(_)
            | Self::Spill(_)
            | Self::Output(OutputError::Unwritable { .. } | OutputError::NotFinite { .. }) => {
                Exit::Failure
            }
            Self::Reported(exit) => *exit,
            Self::Stopped | Self::Unfinished { .. } => Exit::Interrupted,
            _ => Exit::BadInput,
        }
    }

    /// The remedy.
    pub fn help(&self) -> Cow<'_, str> {
        let text = match self {
            Self::Input(error) => error.help(),
            Self::Output(error) => error.help(),
            Self::Option { remedy, .. }
            | Self::Computation { remedy, .. }
            | Self::Config { remedy, .. }
            | Self::Key { remedy, .. } => remedy,
            Self::Parameter { expected, .. } => return format!("allowed: {expected}").into(),
            Self::Missing { .. } => "give it on the command line, or in the file after --config",
            Self::WeightSum { normalised, .. } => return normalised_help(normalised),
            Self::NoResult { command, .. } => {
                return format!("name a directory that `shapespace {command}` has written").into();
            }
            Self::NoRecord { .. } => "name a directory that a command has written (-o DIR)",
            Self::Reported(_) => "see the log",
            Self::OneProcess { .. } => "start it without mpirun",
            Self::WithoutMpi { .. } => {
                "start it without mpirun, or build it with `cargo build --release --features mpi`"
            }
            Self::TooFewInputs { .. } => "name the mask files after the command",
            Self::WeightCount { .. } => {
                "give one weight for each mask, in the same order, or leave --weights out"
            }
            Self::Classes { .. } => {
                "give 'folder', 'prefix', or a file with a line 'file,class' for every mask"
            }
            Self::OtherWork { .. } => {
                "repeat that command to continue it, choose another name after -o, or remove the folder"
            }
            Self::OtherPaths { .. } => {
                "compute all parts with the same program, inputs and options, and name their result directories after --merge"
            }
            Self::Law {
                source: LawError::NotPolyconvex { .. },
                ..
            } => "change --coefficients or --exponents",
            Self::Law { .. } => {
                "change --lambda or --mu, or choose another law; logdet accepts all --lambda from 0 to 1e12 and --mu \
                 from 1e-12 to 1e12"
            }
            Self::LostOnGrid { .. } => {
                "ask for a finer grid with --grid, or use --size equal where inputs have pixels of different sizes"
            }
            Self::Shape { .. } => "check the mask: the object must be a region brighter than 1/2",
            Self::Damaged { .. } => {
                "copy the result again, or name the directory that belongs to it; --trust uses it nevertheless"
            }
            Self::NoObject { .. } => {
                "change its size or its --shift, in units of the box side, or use a finer --grid"
            }
            Self::Average(_) => {
                "try --mismatch-weight .1 or --void-stiffness 1e-2; if that does not help, please report it with the inputs"
            }
            Self::Geodesic(_) => {
                "try a finer --grid or --void-stiffness 1e-2; if that does not help, please report it with the inputs"
            }
            Self::NoGeodesic { .. } => {
                "name a directory that `shapespace geodesic` has written, with --form lagrangian"
            }
            Self::Pca(PcaError::NotSolved { .. }) => "increase --max-iterations",
            Self::Pca(PcaError::NoVariation | PcaError::TooFewShapes { .. }) => {
                "average two or more shapes that differ, with weights above zero"
            }
            Self::Pca(_) => {
                "check that the average has at least two shapes that differ; if that does not help, please report it with the inputs"
            }
            Self::Unfinished { .. } => "repeat the command to compute the others",
            Self::Stopped => "run it again; a smaller --grid takes less time",
            Self::Variation { .. } => {
                "draw it over the first mask, in an image of the same size and inside the box of the geodesic: with --box cube that is wider"
            }
            Self::Spill(_) => {
                "free some space there, name another folder in the environment variable TMPDIR, or ask for a coarser --grid"
            }
            Self::Memory { .. } => "increase --memory, or ask for a coarser --grid",
            Self::TooLarge { .. } => {
                "take a coarser grid, fewer shapes or steps, or end other programs"
            }
        };
        text.into()
    }

    /// The error, and those of its causes that it does not state itself.
    pub fn causes(&self) -> Vec<String> {
        let mut texts = vec![printable(&self.to_string())];
        let mut cause = self.source();
        while let Some(error) = cause {
            let reason = printable(&error.to_string());
            if texts.last().is_none_or(|text| !text.contains(&reason)) {
                texts.push(reason);
            }
            cause = error.source();
        }
        texts
    }

    /// Writes the report to standard error: the error, its causes, and the remedy.
    pub fn report(&self) {
        if matches!(self, Self::Reported(_)) {
            return;
        }
        let [red, cyan, plain] = if std::io::stderr().is_terminal() {
            ["\x1b[31m", "\x1b[36m", "\x1b[0m"]
        } else {
            [""; 3]
        };
        let mut marks = [format!("  {red}×{plain}")].into_iter();
        let line = |text: String| match marks.next() {
            Some(mark) => format!("{mark} {text}"),
            None => format!("  {red}╰─▶{plain} {text}"),
        };
        let mut lines: Vec<String> = self.causes().into_iter().map(line).collect();
        lines.push(format!("  {cyan}help:{plain} {}", printable(&self.help())));
        note(lines.join("\n"));
    }
}
