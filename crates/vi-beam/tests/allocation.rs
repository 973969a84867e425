//! A step of a beam with loads and joints allocates nothing, by neither discrete potential; the memory of a run, factors
//! of the Newton matrix included, is proportional to the number of elements.
#![allow(unsafe_code)] // a counting allocator cannot be written without
#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{flying_section, load, straight, vector};
use nalgebra::Vector3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use vi_beam::model::{BeamModel, StrainRule};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_multibody::pair::PairKind;
use vi_multibody::run::{Solver, integrator};
use vi_rigid::load::LoadKind;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
    static HELD: Cell<isize> = const { Cell::new(0) };
}

// SAFETY: every call is handed on to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        HELD.with(|held| held.set(held.get() + layout.size().cast_signed()));
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.with(|held| held.set(held.get() - layout.size().cast_signed()));
        // SAFETY: the pointer came from the system allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_thousand_steps_allocate_nothing() {
    for rule in [StrainRule::Midpoint, StrainRule::Averaged] {
        for kind in [SchemeKind::Nodal, SchemeKind::Reduced] {
            let mut model = BeamModel::new(vector(0.0, 0.0, -9.81));
            model.add_beam("beam", &straight(2.0, 4), flying_section()).unwrap();
            model.join(PairKind::Spherical, None, 0, &Vector3::zeros(), &Vector3::z());
            let mechanism = model.mechanism();
            let (q, v) = mechanism.start();
            let follower =
                load(4, LoadKind::Follower, vector(0.1, 0.2, 0.3), vector(0.2, 0.1, 0.0));
            let system = model.system(&mechanism, rule).force(Box::new(follower));
            let options = Options::new(kind, 0.01);
            let mut run = integrator(
                mechanism,
                system,
                options,
                Solver::Auto,
                InitialValues::new(0.0, &q, &v),
            )
            .unwrap();
            for _ in 0..3 {
                run.step().unwrap();
            }
            let before = ALLOCATIONS.get();
            for _ in 0..1000 {
                run.step().unwrap();
            }
            let count = ALLOCATIONS.get() - before;
            println!("{rule:?}, {}: {count} allocations in 1000 steps", kind.name());
            assert_eq!(count, 0);
        }
    }
}

/// Work and memory of a factorization are proportional to its fill-in; a dense matrix would hold four times as much for
/// twice the elements.
#[test]
fn memory_is_linear_in_the_number_of_elements() {
    let held = |elements: usize| {
        let mut model = BeamModel::new(Vector3::zeros());
        model.add_beam("beam", &straight(10.0, elements), flying_section()).unwrap();
        let mechanism = model.mechanism();
        let (q, v) = mechanism.start();
        let system = model.system(&mechanism, StrainRule::Averaged);
        let (before, options) = (HELD.get(), Options::new(SchemeKind::Nodal, 0.002));
        let mut run =
            integrator(mechanism, system, options, Solver::Auto, InitialValues::new(0.0, &q, &v))
                .unwrap();
        (0..2).for_each(|_| assert!(run.step().is_ok()));
        (HELD.get() - before) as f64 / elements as f64
    };
    let each = [64, 128, 256, 512].map(held);
    println!("bytes per element: {each:.0?}");
    for pair in each.windows(2) {
        assert!((pair[1] / pair[0] - 1.0).abs() < 0.1, "{each:?}");
    }
}
