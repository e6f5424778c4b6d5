//! Compiles the anchor's file by the command in its head, runs it, and reads its results.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;
use tempfile::TempDir;

use crate::outcome::Outcome;

/// A result of the anchor: one JSON object per line.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Figure {
    /// The kernel.
    #[serde(rename = "k")]
    pub kernel: String,
    /// `double` or `float`.
    pub real: String,
    /// Number of threads.
    #[serde(default)]
    pub threads: usize,
    /// Nodes along every axis.
    #[serde(default)]
    pub n: usize,
    /// Quadrature points per second, in millions.
    #[serde(rename = "Mqps")]
    pub points: Option<f64>,
    /// Nodes per second, in millions.
    #[serde(rename = "MDoFs")]
    pub dofs: Option<f64>,
    /// Floating-point operations per second, in units of 10^9.
    #[serde(rename = "GFLOPs")]
    pub flops: Option<f64>,
    /// Bytes per second, in units of 10^9.
    #[serde(rename = "GBs")]
    pub bytes: Option<f64>,
    /// Size of the arrays of the triad.
    #[serde(rename = "MiB")]
    pub mebibytes: Option<f64>,
}

/// The anchor, compiled for both scalars.
pub struct Anchor {
    /// The folder of the programs, removed at the end.
    _folder: TempDir,
    programs: [PathBuf; 2],
    /// The command that compiled it for `f64`, without paths.
    pub command: String,
}

impl Anchor {
    /// Compiles a file with the command in its head, for `f64` and, with `-DF32`, for `f32`.
    pub fn compile(file: &Path) -> Outcome<Self> {
        let text = std::fs::read_to_string(file)
            .map_err(|e| format!("the anchor '{}' cannot be read: {e}", file.display()))?;
        let build = Build::of_head(&text).ok_or_else(|| {
            format!(
                "the head of '{}' has no line 'Build: cc FLAGS FILE -lm'",
                file.display()
            )
        })?;
        let folder = tempfile::tempdir()?;
        let mut programs = [folder.path().join("f64"), folder.path().join("f32")];
        for (program, define) in programs.iter_mut().zip([None, Some("-DF32")]) {
            let mut command = Command::new(&build.compiler);
            command.args(&build.flags).args(define);
            command.args([OsStr::new("-o"), program.as_os_str(), file.as_os_str()]);
            let output = command
                .args(&build.libraries)
                .output()
                .map_err(|e| format!("the compiler {} cannot be started: {e}", build.compiler))?;
            if !output.status.success() {
                let said = String::from_utf8_lossy(&output.stderr).into_owned();
                return Err(format!("'{}' does not compile:\n{said}", file.display()).into());
            }
        }
        let command = format!("{} {}", build.compiler, build.flags.join(" "));
        Ok(Self {
            _folder: folder,
            programs,
            command,
        })
    }

    /// Runs it for a scalar (`f64` or `f32`) on a number of threads.
    pub fn run(&self, real: &str, threads: usize) -> Outcome<Vec<Figure>> {
        let output = Command::new(&self.programs[usize::from(real == "f32")])
            .arg("0")
            .env("OMP_NUM_THREADS", threads.to_string())
            .output()?;
        if !output.status.success() {
            return Err(format!("the anchor ended with {}", output.status).into());
        }
        figures(&String::from_utf8_lossy(&output.stdout))
    }
}

fn figures(text: &str) -> Outcome<Vec<Figure>> {
    let lines = text.lines().filter(|line| line.starts_with('{'));
    let figures = lines.map(serde_json::from_str);
    Ok(figures.collect::<Result<_, _>>()?)
}

/// Compiler command of a file.
#[derive(Debug, PartialEq, Eq)]
struct Build {
    compiler: String,
    flags: Vec<String>,
    /// Arguments after the file.
    libraries: Vec<String>,
}

impl Build {
    /// Reads a comment line `Build: cc -O3 ... [-DOPTION] FILE.c -lm`; arguments in brackets are
    /// ignored.
    fn of_head(text: &str) -> Option<Self> {
        let line = text
            .lines()
            .take(20)
            .find_map(|l| l.trim().strip_prefix("Build:"))?;
        let mut words = line.split_whitespace().map(String::from);
        let compiler = words.next()?;
        let words: Vec<String> = words.filter(|w| !w.starts_with('[')).collect();
        let place = words.iter().position(|w| {
            Path::new(w)
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("c"))
        })?;
        Some(Self {
            compiler,
            flags: words[..place].to_vec(),
            libraries: words[place + 1..].to_vec(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_of_the_file_says_how_to_compile_it() {
        let head = "/* Limits.\n   Build: cc -O3 -fopenmp [-DF32] kernels.c -lm\n */\n";
        let build = Build::of_head(head).unwrap();
        assert_eq!(build.compiler, "cc");
        assert_eq!(build.flags, ["-O3", "-fopenmp"]);
        assert_eq!(build.libraries, ["-lm"]);
        assert_eq!(Build::of_head("int main(void) { return 0; }"), None);
    }

    #[test]
    fn figures_are_read_line_by_line() {
        let text = "{\"k\":\"fma\",\"real\":\"float\",\"threads\":2,\"GFLOPs\":320.5}\n\
                    {\"k\":\"hyper_EG\",\"real\":\"double\",\"threads\":1,\"n\":65,\"ms\":10.3,\
                    \"Mqps\":204.0,\"MDoFs\":80.3}\nnot a figure\n";
        let figures = figures(text).unwrap();
        assert_eq!(figures.len(), 2);
        assert_eq!(figures[0].flops, Some(320.5));
        assert_eq!((figures[1].n, figures[1].points), (65, Some(204.0)));
    }
}
