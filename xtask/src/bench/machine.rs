//! The machine of the measurements.

use std::fmt;

use serde::Serialize;

/// Processor, cores and compiler.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// The processor's name.
    pub processor: String,
    /// Number of threads that can run at the same time.
    pub threads: usize,
    /// The widest vectors that the kernels use.
    pub vectors: String,
    /// The compiler.
    pub compiler: String,
}

impl Machine {
    /// Describes this machine.
    pub fn this() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        Self {
            processor: processor(&info).unwrap_or("unknown").into(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            vectors: vectors(),
            compiler: compiler(),
        }
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}, {} threads, {}, {}",
            self.processor, self.threads, self.vectors, self.compiler
        )
    }
}

fn processor(info: &str) -> Option<&str> {
    let line = info.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim())
}

/// The vectors that the kernels get here, by the number of `f64` in a lane.
fn vectors() -> String {
    use fe_grid::{Element, Lane, LaneKernel};
    struct Width;
    impl LaneKernel<f64> for Width {
        type Output = usize;
        #[inline(always)]
        fn run<L: Lane<Element = f64>>(self) -> usize {
            L::COUNT
        }
    }
    match f64::run_kernel(Width) {
        1 => "scalars".into(),
        n => format!("vectors of {} bits", 64 * n),
    }
}

/// The compiler in use, which cargo passes to the programs that it runs.
pub fn compiler() -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = std::process::Command::new(rustc).arg("--version").output();
    let said = output.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    said.unwrap_or_else(|_| "unknown compiler".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_named() {
        let info = "processor : 0\nmodel name\t: Some Processor 9\nflags : fpu\n";
        assert_eq!(processor(info), Some("Some Processor 9"));
        assert_eq!(processor(""), None);
    }
}
