//! Clocks, and the peak memory of a process.

use std::time::{Duration, Instant};

use nix::sys::resource::{UsageWho, getrusage};
use nix::time::{ClockId, clock_gettime};

/// Processor time of the calling thread, in seconds.
pub fn thread_seconds() -> f64 {
    seconds(ClockId::CLOCK_THREAD_CPUTIME_ID)
}

/// Processor time of this process, user and system, all threads, in seconds.
pub fn process_seconds() -> f64 {
    seconds(ClockId::CLOCK_PROCESS_CPUTIME_ID)
}

fn seconds(clock: ClockId) -> f64 {
    // These two clocks exist on every system that the crate is built for.
    clock_gettime(clock).map_or(f64::NAN, |time| Duration::from(time).as_secs_f64())
}

/// Processor time and wall time of a part of this process.
#[derive(Clone, Copy)]
pub struct Stopwatch {
    process: f64,
    start: Instant,
}

impl Stopwatch {
    /// Starts the clocks.
    pub fn start() -> Self {
        Self {
            process: process_seconds(),
            start: Instant::now(),
        }
    }

    /// Processor seconds since the start, user and system, all threads.
    pub fn cpu(&self) -> f64 {
        process_seconds() - self.process
    }

    /// Wall seconds since the start.
    pub fn wall(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}

/// Returns the peak memory of this process, in MiB.
///
/// On Linux this is `VmHWM`: the value of `getrusage` includes the memory of the parent when it
/// started this process.
pub fn peak_mebibytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    high_water_mark(&status).unwrap_or_else(|| {
        let usage = getrusage(UsageWho::RUSAGE_SELF);
        usage.map_or(f64::NAN, |usage| usage.max_rss() as f64 / 1024.0)
    })
}

fn high_water_mark(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_high_water_mark_is_found_among_other_lines() {
        let status = "VmPeak:\t  999 kB\nVmHWM:\t    2048 kB\nVmRSS:\t 1 kB\n";
        assert_eq!(high_water_mark(status), Some(2.0));
        assert_eq!(high_water_mark("VmRSS: 1 kB"), None);
    }

    #[test]
    fn work_takes_processor_time_and_sleep_takes_none() {
        let watch = Stopwatch::start();
        let start = thread_seconds();
        std::thread::sleep(Duration::from_millis(30));
        let asleep = thread_seconds() - start;
        let mut x = 1.0f64;
        while thread_seconds() - start < asleep + 0.01 {
            x = std::hint::black_box(x).sqrt();
        }
        assert!(asleep < watch.wall() && watch.wall() >= 0.03 && watch.cpu() >= 0.01);
    }
}
