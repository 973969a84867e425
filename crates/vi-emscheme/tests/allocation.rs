//! Nothing that is called in a step allocates, but for the factors of the sparse LU when they grow.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use vi_emscheme::EmForm;

use vi_emscheme::EmOptions;
use vi_multibody::PairKind;
use vi_testkit::CountingAllocator;
use vi_testkit::allocator::allocations;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

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
            let before = allocations();
            for _ in 0..1000 {
                run.step().unwrap();
                let _ = run.node_before();
            }
            let count = allocations() - before;
            println!("{name} by {}: {count} allocations in 1000 steps", form.name());
            assert!(count <= LU_GROWTH, "{name} by {}: {count} allocations", form.name());
        }
    }
}
