//! The Python package of the build to which a test belongs.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// The folder of the outputs of this build: test programs, and the module of the Python package.
///
/// # Errors
/// Those of [`env::current_exe`].
pub fn outputs() -> io::Result<PathBuf> {
    let program = env::current_exe()?;
    Ok(program.parent().unwrap_or(&program).into())
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
    }
    Ok(())
}

/// Puts the package with the compiled module into a folder that Python can import from.
///
/// # Errors
/// Of the kind `NotFound` where the module has not been built; those of copying files.
pub fn install_package(folder: &Path) -> io::Result<()> {
    let module = outputs()?.join(format!("{DLL_PREFIX}_shapespace{DLL_SUFFIX}"));
    let package = folder.join("shapespace");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    copy(&here.join("../../python/package/shapespace"), &package)?;
    let ending = if cfg!(windows) { "pyd" } else { "abi3.so" };
    fs::copy(module, package.join(format!("_shapespace.{ending}")))?;
    Ok(())
}
