//! A counting allocator. A test binary installs it by
//! ```
//! #[global_allocator]
//! static ALLOCATOR: vi_testkit::CountingAllocator = vi_testkit::CountingAllocator;
//! ```
#![allow(unsafe_code)] // an allocator cannot be written without

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system allocator with counts for each thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct CountingAllocator;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
    static BYTES: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
    static BEGIN: Cell<isize> = const { Cell::new(0) };
}

/// Allocations and reallocations of this thread so far.
#[must_use]
pub fn allocations() -> usize {
    COUNT.get()
}

/// Memory that this thread has allocated and not returned, bytes.
#[must_use]
pub fn bytes_in_use() -> isize {
    BYTES.get()
}

/// From now on [`peak`] is measured anew.
pub fn begin_peak() {
    BEGIN.set(BYTES.get());
    PEAK.set(BYTES.get());
}

/// The largest memory in use by this thread since [`begin_peak`], beyond what was in use then,
/// bytes.
#[must_use]
pub fn peak() -> isize {
    PEAK.get() - BEGIN.get()
}

fn count(bytes: isize) {
    COUNT.set(COUNT.get() + 1);
    let now = BYTES.get() + bytes;
    BYTES.set(now);
    if now > PEAK.get() {
        PEAK.set(now);
    }
}

// SAFETY: every call is passed on to the system allocator unchanged.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size().cast_signed());
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        BYTES.set(BYTES.get() - layout.size().cast_signed());
        // SAFETY: the pointer came from the system allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size.cast_signed() - layout.size().cast_signed());
        // SAFETY: the pointer came from the system allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
