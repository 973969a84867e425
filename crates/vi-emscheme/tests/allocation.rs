//! Nothing that is called in a step allocates, but for the factors of the sparse LU when they grow.
#![allow(unsafe_code)] // a counting allocator cannot be written without
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use vi_emscheme::EmForm;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use vi_emscheme::EmOptions;
use vi_multibody::PairKind;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is handed on to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from the system allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// The factors of a pivoted sparse LU grow when the pivots change: a few times at the beginning.
const LU_GROWTH: usize = 16;

#[test]
fn a_thousand_steps_allocate_nothing() {
    let pair = common::pair(PairKind::Cylindrical, true);
    let four = common::four_particles(vi_multibody::spring::SpringLaw::Linear);
    for (name, model) in [("pair with loads", pair), ("4 particles", four)] {
        for form in EmForm::ALL {
            let pair = name == "pair with loads";
            let system = if pair { common::loaded(&model) } else { model.system() };
            let options = EmOptions::new(form, 0.005);
            let mut run =
                vi_emscheme::run::integrator(system, model.mechanism.clone(), options).unwrap();
            run.step().unwrap();
            let _ = run.node_before();
            let before = ALLOCATIONS.get();
            for _ in 0..1000 {
                run.step().unwrap();
                let _ = run.node_before();
            }
            let count = ALLOCATIONS.get() - before;
            println!("{name} by {}: {count} allocations in 1000 steps", form.name());
            assert!(count <= LU_GROWTH, "{name} by {}: {count} allocations", form.name());
        }
    }
}
