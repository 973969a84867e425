//! A step of a beam with loads and joints allocates nothing, by neither discrete potential; the
//! memory of a run, factors of the Newton matrix included, is proportional to the number of
//! elements.
#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{flying_section, load, straight, vector};
use nalgebra::Vector3;
use vi_beam::ElementKind;
use vi_beam::model::{BeamModel, StrainRule};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_multibody::pair::PairKind;
use vi_multibody::run::{Solver, integrator};
use vi_rigid::load::LoadKind;
use vi_testkit::CountingAllocator;
use vi_testkit::allocator::{allocations, bytes_in_use};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn a_thousand_steps_allocate_nothing() {
    let rules = [
        (StrainRule::Midpoint, ElementKind::MeanDirectors),
        (StrainRule::Averaged, ElementKind::MeanDirectors),
        (StrainRule::MassScaled, ElementKind::MeanDirectors),
        (StrainRule::Dissipative, ElementKind::MeanDirectors),
        (StrainRule::MassScaled, ElementKind::Helicoidal),
        (StrainRule::Dissipative, ElementKind::Helicoidal),
    ];
    for (rule, element) in rules {
        for kind in [SchemeKind::Nodal, SchemeKind::Reduced] {
            let mut model = BeamModel::new(vector(0.0, 0.0, -9.81));
            let beam = model.add_beam("beam", &straight(2.0, 4), flying_section()).unwrap();
            let q = model.configuration();
            model.beams.elements.set_strains(beam.elements, element, &q).unwrap();
            model.join(PairKind::Spherical, None, 0, &Vector3::zeros(), &Vector3::z());
            let mechanism = model.mechanism();
            let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
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
            let before = allocations();
            for _ in 0..1000 {
                run.step().unwrap();
            }
            let count = allocations() - before;
            println!("{rule:?}, {element:?}, {}: {count} allocations in 1000 steps", kind.name());
            assert_eq!(count, 0);
        }
    }
}

/// Work and memory of a factorization are proportional to its fill-in; a dense matrix would hold
/// four times as much for twice the elements.
#[test]
fn memory_is_linear_in_the_number_of_elements() {
    let held = |elements: usize| {
        let mut model = BeamModel::new(Vector3::zeros());
        model.add_beam("beam", &straight(10.0, elements), flying_section()).unwrap();
        let mechanism = model.mechanism();
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let system = model.system(&mechanism, StrainRule::Averaged);
        let (before, options) = (bytes_in_use(), Options::new(SchemeKind::Nodal, 0.002));
        let mut run =
            integrator(mechanism, system, options, Solver::Auto, InitialValues::new(0.0, &q, &v))
                .unwrap();
        (0..2).for_each(|_| assert!(run.step().is_ok()));
        (bytes_in_use() - before) as f64 / elements as f64
    };
    let each = [64, 128, 256, 512].map(held);
    println!("bytes per element: {each:.0?}");
    for pair in each.windows(2) {
        assert!((pair[1] / pair[0] - 1.0).abs() < 0.1, "{each:?}");
    }
}
