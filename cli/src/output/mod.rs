//! Result directories, which appear complete or not at all, and the formats of their files.

pub mod apng;
mod arrays;
mod directory;
pub mod energy;
mod handle;
mod interrupted;
mod json;
mod kept;
pub mod matrix;
pub(crate) mod names;
pub mod nifti;
pub mod npy;
pub mod outline;
pub mod pvd;
mod sealed;
mod staging;
pub mod steps;
pub mod surface;
pub mod vti;
mod work;

use std::io;
use std::path::{Path, PathBuf};

use fe_grid::Field;
use shapespace_report::chart::{Chart, stacked};

pub use directory::{ResultDir, write_new_file};
pub(crate) use interrupted::{CANCELLED, RESULT};
pub use json::write_json;
pub(crate) use kept::Kept;
pub use kept::{KeptArray, KeptNumbers};
pub(crate) use sealed::{is_as_written, sealed_text, sum_of, unsealed};
pub(crate) use staging::discard_all;
pub use work::WorkDir;
pub(crate) use work::{DESCRIPTION, sync};

/// A result that cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The target exists.
    #[error("the output '{}' exists already", path.display())]
    Exists {
        /// The target.
        path: PathBuf,
    },
    /// The folder of the target does not exist.
    #[error("the folder '{}' for the output does not exist", path.display())]
    NoParent {
        /// The folder.
        path: PathBuf,
    },
    /// Another run of the program computes the same results.
    #[error("another run uses '{}'", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A symbolic link in a folder of unfinished work.
    #[error("'{}' is a symbolic link", path.display())]
    Link {
        /// The link.
        path: PathBuf,
    },
    /// The system does not allow it.
    #[error("cannot write '{}'", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The extension of the name is not that of a known format.
    #[error("cannot write '{}' in this format", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// A result is not a finite number.
    #[error("the result '{key}' is not a finite number")]
    NotFinite {
        /// Where in the results.
        key: String,
    },
}

impl OutputError {
    /// The remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Exists { .. } => {
                "choose another name, or move the old results away; nothing is overwritten (interrupted results are renamed)"
            }
            Self::NoParent { .. } => "create it first, or choose another place",
            Self::Busy { .. } => "wait for it to end, or choose another name",
            Self::Link { .. } => {
                "remove the link; unfinished work is kept in plain files and folders"
            }
            Self::Unwritable { .. } => "check the free space and the permissions of the folder",
            Self::Format { .. } => "name the file .npy, or .png for a picture",
            Self::NotFinite { .. } => {
                "this is an error of the program; please report it with the inputs"
            }
        }
    }

    /// For `map_err` on the errors of one file.
    pub fn at(path: &Path) -> impl Fn(io::Error) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Unwritable {
            path: handle::shown(&path),
            source,
        }
    }
}

/// Writes a file of text.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
    std::fs::write(path, text).map_err(OutputError::at(path))
}

/// Writes charts of this size together, one above the other, as SVG.
///
/// # Errors
/// [`OutputError::Unwritable`].
pub(crate) fn write_charts(
    path: &Path,
    size: (u32, u32),
    charts: &[Chart<'_>],
) -> Result<(), OutputError> {
    let failed = |error| OutputError::at(path)(io::Error::other(error));
    write_text(path, &stacked(size, charts).map_err(failed)?)
}

/// The name of a file that belongs to one of several shapes, `kind_000.npy` and so on.
pub(crate) fn numbered(kind: &str, index: usize, ending: &str) -> PathBuf {
    PathBuf::from(format!("{kind}_{index:03}.{ending}"))
}

/// Deformed positions `x + u(x)`.
pub(crate) fn deformation<const D: usize>(displacement: &Field<f64, D, D>) -> Field<f64, D, D> {
    let mut positions = Field::identity(*displacement.grid());
    for (x, u) in positions
        .as_mut_slice()
        .iter_mut()
        .zip(displacement.as_slice())
    {
        *x += u;
    }
    positions
}
