//! Memory of this process: what is free, and what the inputs may take.

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};

/// The limit that the user has set, 0 for none. A process has a single memory, hence a single limit.
static LIMIT: AtomicU64 = AtomicU64::new(0);
/// Memory of the inputs that have been read, which is counted where there is a limit.
static HELD: AtomicU64 = AtomicU64::new(0);

/// Sets a limit of the memory for the inputs of the command that begins.
pub fn set_limit(limit: Option<u64>) {
    LIMIT.store(limit.unwrap_or(0), Ordering::SeqCst);
    HELD.store(0, Ordering::SeqCst);
}

/// Memory that is needed and not allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortage {
    /// Bytes that are needed.
    pub needed: u64,
    /// Bytes that are allowed.
    pub limit: u64,
}

/// Asks for memory before it is allocated: so many bytes, of which some are kept afterwards. The
/// limit is that of the user, or else the free memory.
///
/// # Errors
/// [`Shortage`] beyond the limit.
pub fn reserve(needed: u64, kept: u64) -> Result<(), Shortage> {
    let limit = LIMIT.load(Ordering::SeqCst);
    if limit == 0 {
        return match free() {
            Some(free) if needed > free => Err(Shortage {
                needed,
                limit: free,
            }),
            _ => Ok(()),
        };
    }
    let held = HELD.load(Ordering::SeqCst);
    if held.saturating_add(needed) > limit {
        let needed = held.saturating_add(needed);
        return Err(Shortage { needed, limit });
    }
    HELD.fetch_add(kept, Ordering::SeqCst);
    Ok(())
}

/// Memory that this process can still get, if the system states it (Linux): what the machine has
/// free, within the limits of its control group and of its address space.
pub fn free() -> Option<u64> {
    let machine = kib("/proc/meminfo", "MemAvailable:");
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(limit, used)| limit.saturating_sub(used));
    let space = address_space()
        .zip(kib("/proc/self/status", "VmSize:"))
        .map(|(limit, used)| limit.saturating_sub(used));
    [machine, group, space].into_iter().flatten().min()
}

/// Peak memory of this process, if the system states it (Linux).
pub fn peak() -> Option<u64> {
    kib("/proc/self/status", "VmHWM:")
}

/// A number of KiB in a file of the system, in bytes.
fn kib(file: &str, key: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1024 * kib)
}

/// The number that a file of the system holds.
fn number(file: &str) -> Option<u64> {
    fs::read_to_string(file).ok()?.trim().parse().ok()
}

/// The limit of the address space (`ulimit -v`).
fn address_space() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/limits").ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_states_its_memory() {
        let free = free().unwrap();
        assert!(free > 1 << 20);
        assert!(peak().unwrap() > 1 << 20);
        assert!(reserve(1 << 20, 1 << 20).is_ok());
        let shortage = reserve(u64::MAX, 0).unwrap_err();
        assert_eq!(shortage.needed, u64::MAX);
    }
}
