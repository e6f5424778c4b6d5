//! The Python module `shapespace._shapespace`: the calls of `shapespace::api` with NumPy arrays.
//!
//! `arrays` converts between arrays, `call` runs commands on a thread of their own while Python
//! goes on to hear signals, `result` holds results, `report` makes exceptions, `warped` carries
//! volumes and points. All that a user sees is written in Python, in `package/shapespace`.

#![forbid(unsafe_code)]

mod arrays;
mod call;
mod report;
mod result;
mod wait;
mod warped;

/// Calls of the commands of Shapespace; see the package `shapespace`.
#[pyo3::pymodule]
mod _shapespace {
    /// The version of the package.
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "the name that Python uses")]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    #[pymodule_export]
    use super::arrays::check_size;
    #[pymodule_export]
    use super::call::{commands, keys, run, verify};
    #[pymodule_export]
    use super::result::{Computed, Verified};
    #[pymodule_export]
    use super::warped::{warp_image, warp_points};
}
