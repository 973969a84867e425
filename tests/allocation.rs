//! Nothing is allocated per step in the nodal, reduced and d'Alembert schemes; the constrained one
//! allocates a few times in a run, when pivoting enlarges the fill of its sparse factors.

#![allow(clippy::unwrap_used)] // a test
#![allow(unsafe_code)] // a counting allocator has to be one

mod harness;

use harness::models::simulation;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn no_step_allocates() {
    let names = ["pendulum", "free_body", "heavy_top_steady", "four_particles"];
    let loops = ["four_bar_windows", "six_hinge_cube", "bricard", "andrews_squeezer"];
    for name in names.into_iter().chain(loops) {
        for scheme in ["nodal", "reduced", "constrained", "dalembert"] {
            if loops.contains(&name) && scheme == "constrained" {
                continue; // large sparse factors
            }
            for order in [2, 4] {
                let overrides = [
                    ("simulation.scheme", scheme.to_owned()),
                    ("simulation.order", order.to_string()),
                ];
                let mut simulation = simulation(name, &overrides);
                let run = simulation.integrator();
                for _ in 0..10 {
                    run.step().unwrap(); // warm-up: patterns, symbolic factorizations
                }
                let before = COUNT.with(Cell::get);
                for _ in 0..1000 {
                    run.step().unwrap();
                }
                let allocations = COUNT.with(Cell::get) - before;
                println!("{name}, {scheme}, order {order}: {allocations} in 1000 steps");
                // partial pivoting changes the fill of the sparse LU: its buffers may grow a few times
                let allowed = if scheme == "constrained" { 16 } else { 0 };
                assert!(allocations <= allowed, "{name}, {scheme}, order {order}: {allocations}");
            }
        }
    }
}
