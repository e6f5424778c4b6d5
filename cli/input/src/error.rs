//! Errors of inputs, with their remedies.

use std::io;
use std::path::{Path, PathBuf};

use crate::bytes::format_bytes;

/// A mask that cannot be used. Positions are indices in the order of the array as stored, the
/// last one being `x`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The file cannot be opened or read.
    #[error("cannot read '{}'", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The name has no known format.
    #[error("'{}' has no known image format", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The bytes do not follow the format.
    #[error("'{}' is not a readable {format} file: {reason}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Name of the format.
        format: &'static str,
        /// Why.
        reason: String,
    },
    /// The file holds less data than its header states.
    #[error(
        "'{}' is cut off: its header states {expected} bytes of data, found {found}",
        path.display()
    )]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Bytes according to the header.
        expected: u64,
        /// Bytes found.
        found: u64,
    },
    /// Too many values.
    #[error("'{}' has {} values, more than the limit of {}", path.display(), size_text(size), super::MAX_VALUES)]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Values along each axis.
        size: Vec<u64>,
    },
    /// More memory than there is, or than is allowed.
    #[error("'{}' needs {} of memory, and there are {}", path.display(), format_bytes(*needed), format_bytes(*limit))]
    Memory {
        /// The file.
        path: PathBuf,
        /// Bytes that are needed, with those of the inputs before.
        needed: u64,
        /// Bytes that are allowed.
        limit: u64,
    },
    /// Neither a picture nor a volume.
    #[error("'{}' has {found} axes; a mask has two or three", path.display())]
    Axes {
        /// The file.
        path: PathBuf,
        /// Axes found.
        found: usize,
    },
    /// Too few samples along an axis.
    #[error("'{}' has {} values; every axis needs at least two", path.display(), size_text(size))]
    TooSmall {
        /// The file.
        path: PathBuf,
        /// Values along each axis, as stored.
        size: Vec<u64>,
    },
    /// A colour picture.
    #[error("'{}' is a colour picture, not a mask", path.display())]
    Colour {
        /// The file.
        path: PathBuf,
    },
    /// NaN or an infinite number.
    #[error("'{}' holds {value} at index {position:?}", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The value.
        value: f64,
        /// Where.
        position: Vec<usize>,
    },
    /// A floating-point value outside `[0, 1]`.
    #[error("'{}' is not a mask: the value {value} at index {position:?} is outside [0, 1]", path.display())]
    OutOfRange {
        /// The file.
        path: PathBuf,
        /// The value.
        value: f64,
        /// Where.
        position: Vec<usize>,
    },
    /// All values are the same, and neither 0 nor full.
    #[error("'{}' is not a mask: all values are {value}", path.display())]
    Constant {
        /// The file.
        path: PathBuf,
        /// The value.
        value: f64,
    },
    /// An image without any contrast.
    #[error("'{}' shows nothing: all values are {value}", path.display())]
    Blank {
        /// The file.
        path: PathBuf,
        /// The value.
        value: f64,
    },
    /// An intensity image where labels are expected.
    #[error("'{}' is not a mask: it has {levels} grey levels, and neighbours mostly differ", path.display())]
    Intensities {
        /// The file.
        path: PathBuf,
        /// Different numbers found, up to a limit.
        levels: usize,
    },
    /// No value reaches the level of the object.
    #[error("'{}' holds an empty shape: no value reaches half of full white (the largest is {largest})", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// Largest value, full white being 1.
        largest: f64,
    },
    /// Every value reaches the level of the object.
    #[error("'{}' holds a full shape: the object covers the whole image", path.display())]
    Full {
        /// The file.
        path: PathBuf,
        /// Samples along each axis.
        size: Vec<usize>,
    },
    /// The label does not occur.
    #[error("'{}' has no label {label}; its labels are {present:?}", path.display())]
    LabelMissing {
        /// The file.
        path: PathBuf,
        /// The requested label.
        label: i64,
        /// Labels that occur, the smallest ones.
        present: Vec<i64>,
    },
    /// A label is requested but the numbers are not integers.
    #[error("'{}' holds {value} at index {position:?}, so it is not a label image", path.display())]
    NotLabels {
        /// The file.
        path: PathBuf,
        /// The value.
        value: f64,
        /// Where.
        position: Vec<usize>,
    },
    /// A voxel size that is not a positive number.
    #[error("'{}' states the voxel size {spacing:?}; it must be positive, from 1e-6 to 1e6", path.display())]
    Spacing {
        /// The file.
        path: PathBuf,
        /// Spacing along each axis, `x` first.
        spacing: Vec<f64>,
    },
    /// A surface or an outline in a unit of length that does not exist.
    #[error("the surface or outline in '{}' is {extent:e} long; lengths must lie between 1e-4 and 1e8", path.display())]
    Extent {
        /// The file.
        path: PathBuf,
        /// Its longest side, in millimetres.
        extent: f64,
    },
    /// A folder or a pattern without inputs.
    #[error("there is nothing to read in '{}': {}", path.display(), others_text(*others))]
    NoInputs {
        /// The folder or the pattern.
        path: PathBuf,
        /// Files that are no inputs.
        others: usize,
    },
    /// A result where inputs are needed.
    #[error("'{}' is a result of the program, not a folder of inputs", path.display())]
    ResultFolder {
        /// The folder.
        path: PathBuf,
    },
    /// A surface where an image is needed.
    #[error("'{}' is a surface or an outline, not an image", path.display())]
    NoImage {
        /// The file.
        path: PathBuf,
    },
    /// A label or an inversion of a surface.
    #[error("'{}' is a surface or an outline, which has no labels and no background", path.display())]
    NoLabels {
        /// The file.
        path: PathBuf,
    },
    /// Too many triangles.
    #[error("'{}' has {found} triangles, more than the limit of {}", path.display(), super::mesh::MAX_TRIANGLES)]
    TooManyTriangles {
        /// The file.
        path: PathBuf,
        /// Triangles found.
        found: usize,
    },
    /// A surface with holes that are not small.
    #[error(
        "'{}' is not closed: {holes} holes with {open} open edges, the widest {widest:.3} across, where \
         holes up to {limit:.3} are closed; {crowded} edges have more than two triangles",
        path.display()
    )]
    OpenSurface {
        /// The file.
        path: PathBuf,
        /// Edges where the surface ends.
        open: usize,
        /// Closed ways of such edges.
        holes: usize,
        /// Edges of more than two triangles.
        crowded: usize,
        /// The largest diagonal of the box around a hole.
        widest: f64,
        /// The largest one that is closed.
        limit: f64,
    },
    /// A surface without an inside.
    #[error("'{}' encloses no volume", path.display())]
    FlatSurface {
        /// The file.
        path: PathBuf,
    },
    /// A file that states no place in the world, where one is needed.
    #[error("'{}' is no volume with a place in the world", path.display())]
    Placeless {
        /// The file.
        path: PathBuf,
    },
    /// Pictures among volumes.
    #[error("'{}' is a picture, but '{}' is a volume", flat.display(), solid.display())]
    MixedDimensions {
        /// A file with two axes.
        flat: PathBuf,
        /// A file with three axes.
        solid: PathBuf,
    },
}

/// How many files that are no inputs there are.
fn others_text(others: usize) -> String {
    match others {
        0 => "no files".into(),
        1 => "1 file of another kind".into(),
        more => format!("{more} files of other kinds"),
    }
}

/// What to make of a file whose format is not read.
fn remedy_of_format(path: &Path) -> &'static str {
    let extension = path.extension().unwrap_or_default();
    match &*extension.to_string_lossy().to_lowercase() {
        "npz" => "save one array of it by numpy.save, as .npy",
        "dcm" | "dicom" => "convert the series to .nii.gz, with dcm2niix for example",
        "gif" | "webp" | "heic" | "avif" | "psd" | "pdf" => "save the picture as .png",
        "bz2" | "xz" | "zip" | "7z" | "rar" | "zst" => {
            "unpack it: of packed files only .nii.gz is read"
        }
        _ => {
            "use .png, .jpg, .pgm, .pbm, .ppm, .tif, .bmp, .npy, .nii, .nii.gz, .hdr with .img, \
             .nrrd, .nhdr, .mha, .mhd, .stl, .ply, .obj, .vtk, .vtp, .svg or .csv, and use that extension"
        }
    }
}

impl InputError {
    /// The remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "check that the path is right and that the file may be read",
            Self::UnknownFormat { path } => remedy_of_format(path),
            Self::Malformed { .. } => {
                "open the file in the program it came from and export it again"
            }
            Self::Truncated { .. } => "copy or download the file again",
            Self::Memory { .. } => {
                "crop or downsample the image to what the shape needs, or allow more by --memory where it is set"
            }
            Self::TooLarge { .. } => "crop or downsample the image to what the shape needs",
            Self::Axes { .. } => "store one picture [y][x] or one volume [z][y][x] per file",
            Self::TooSmall { .. } => "give an image with at least two samples along every axis",
            Self::Colour { .. } => {
                "segment the object first and save it white on black, or as a cut-out with transparency"
            }
            Self::NotFinite { .. } => {
                "replace values that are not finite numbers, for instance by 0"
            }
            Self::OutOfRange { .. } => {
                "scale the values to [0, 1] with 1 inside the object, or save a mask of 0 and 1; of signed distances, such as the level sets in a result, the positive ones. Outlines and surfaces beside these can be read, too"
            }
            Self::Constant { .. } => {
                "give a mask with the object at 1 (or 255) and the background at 0"
            }
            Self::Blank { .. } => "give an image in which the object differs from its surroundings",
            Self::Intensities { .. } => {
                "this looks like a scan; give its segmentation, or choose one label by --label N"
            }
            Self::Empty { .. } => {
                "the object must be at or near 1 (or 255); in a label image choose the object by --label N"
            }
            Self::Full { .. } => {
                "the background must be at or near 0; --invert reads dark objects on a bright background"
            }
            Self::LabelMissing { .. } => {
                "give one of the labels that occur to --label, or leave the option out"
            }
            Self::NotLabels { .. } => "leave --label out, or give an image of whole numbers",
            Self::Spacing { .. } => "write the voxel size in millimetres into the header (pixdim)",
            Self::Extent { .. } => {
                "multiply its coordinates by the factor that makes them millimetres"
            }
            Self::NoInputs { .. } => {
                "name a folder with masks or images, or a pattern that matches some, in quotes: 'masks/*.png'"
            }
            Self::ResultFolder { .. } => {
                "name the files in it that are masks, for instance 'DIR/mask_*.npy'"
            }
            Self::NoImage { .. } => {
                "give a picture or a volume; surfaces and outlines go to the commands that take masks, such as \
                 average"
            }
            Self::NoLabels { .. } => "leave --label and --invert out, or give images",
            Self::TooManyTriangles { .. } => {
                "reduce the number of triangles in a mesh program (decimation)"
            }
            Self::OpenSurface { .. } => {
                "close its holes in a mesh program, or give the mask from which it was made"
            }
            Self::FlatSurface { .. } => "give a closed surface, or the mask from which it was made",
            Self::Placeless { .. } => {
                "give a volume whose header has an affine map, such as a NIfTI file with an sform"
            }
            Self::MixedDimensions { .. } => "give masks that all have two axes, or all three",
        }
    }
}

/// The numbers of samples along each axis, as text.
pub fn size_text<N: ToString>(size: &[N]) -> String {
    let sides: Vec<_> = size.iter().map(N::to_string).collect();
    sides.join(" x ")
}
