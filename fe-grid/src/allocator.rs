//! An allocator for programs that end with a report, and not by an abort, where there is no more memory.
//!
//! **Invariant:** all requests go to the allocator of the system as they are, and its answers come back as they
//! are, unless it refuses: then nothing comes back.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// The allocator of the system, which ends the program where the system gives no more memory.
///
/// Rust's own answer is to abort the process (`SIGABRT`), after a line that helps no user. A program chooses
/// another one by
///
/// ```
/// use fe_grid::ExitWithoutMemory;
///
/// #[global_allocator]
/// static ALLOCATOR: ExitWithoutMemory = ExitWithoutMemory {
///     report: ["error: the system refuses ", " bytes of memory\n"],
///     code: 2,
/// };
///
/// fn main() {
///     assert_eq!(vec![1; 3].len(), 3);
/// }
/// ```
///
/// Code that asks with `try_reserve` hears of no refusal either: the program has ended.
#[derive(Debug)]
pub struct ExitWithoutMemory {
    /// What is written to the standard error before and after the number of bytes that were refused.
    pub report: [&'static str; 2],
    /// The exit code of the program.
    pub code: i32,
}

impl ExitWithoutMemory {
    /// The memory, if there is any.
    fn checked(&self, memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() {
            self.exit(bytes);
        }
        memory
    }

    /// Writes the report and ends the program. Nothing is allocated: standard error has no buffer, and
    /// numbers are formatted on the stack. A stream that is closed ends the program as well.
    #[cold]
    fn exit(&self, bytes: usize) -> ! {
        let [before, after] = self.report;
        let _ = write!(std::io::stderr(), "{before}{bytes}{after}");
        std::process::exit(self.code)
    }
}

// SAFETY: the answers are those of the system's allocator, which keeps the contract.
unsafe impl GlobalAlloc for ExitWithoutMemory {
    #[inline]
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract, which is that of the system's allocator.
        let memory = unsafe { System.alloc(layout) };
        self.checked(memory, layout.size())
    }

    #[inline]
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        let memory = unsafe { System.alloc_zeroed(layout) };
        self.checked(memory, layout.size())
    }

    #[inline]
    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: as above; the memory comes from the system's allocator.
        let memory = unsafe { System.realloc(memory, layout, bytes) };
        self.checked(memory, bytes)
    }

    #[inline]
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above; the memory comes from the system's allocator.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALLOCATOR: ExitWithoutMemory = ExitWithoutMemory {
        report: ["", ""],
        code: 2,
    };

    /// What is written stays where it is, also when there is more of it.
    #[test]
    fn memory_is_that_of_the_system() {
        let layout = Layout::from_size_align(24, 8).unwrap();
        // SAFETY: sizes are not zero, the layouts are those that the memory was asked for with, and nothing
        // is read that was not written or zeroed.
        unsafe {
            let memory = ALLOCATOR.alloc_zeroed(layout);
            assert!(!memory.is_null());
            assert!((0..24).all(|i| *memory.add(i) == 0));
            memory.write_bytes(7, 24);
            let memory = ALLOCATOR.realloc(memory, layout, 4096);
            assert!((0..24).all(|i| *memory.add(i) == 7));
            let longer = Layout::from_size_align(4096, 8).unwrap();
            ALLOCATOR.dealloc(memory, longer);
            let memory = ALLOCATOR.alloc(layout);
            assert_eq!(memory.align_offset(8), 0);
            ALLOCATOR.dealloc(memory, layout);
        }
    }
}
