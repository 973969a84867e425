//! Nothing that is called in a step allocates.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use common::Stepper;
use nalgebra::Vector3;
use vi_rigid::{
    EulerMoments, Load, LoadKind, RigidBody, SingleBody, Support, TimeHistory, rotation,
};
use vi_testkit::CountingAllocator;
use vi_testkit::allocator::allocations;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn a_thousand_steps_allocate_nothing() {
    let anchor = Vector3::new(0.1, 0.0, -0.5);
    for support in [Support::Free, Support::FixedPoint { anchor, point: Vector3::zeros() }] {
        let body = RigidBody::new(1.0, EulerMoments([0.3, 0.7, 0.2])).unwrap();
        let body = SingleBody::new(body, support);
        let points = vec![[0.0, 0.0], [1.0, 0.5], [3.0, -0.5]];
        let history = TimeHistory::Table { points };
        let (force, torque) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.3, -0.1, 0.2));
        let load = Load::new(0, LoadKind::Follower, force, torque, history).unwrap();
        let system = body.system(&Vector3::new(0.0, 0.0, -9.81)).force(Box::new(load));
        let q = body.configuration(&Vector3::zeros(), &rotation::exp(&Vector3::x()));
        let nu = [0.5, -1.0, 2.0, 1.0, 0.3, -0.7];
        let mut state = body.start(0.0, &q, &nu[..if support == Support::Free { 6 } else { 3 }]);
        let mut stepper = Stepper::new(body, system);
        stepper.step(0.005, &mut state);
        let before = allocations();
        for _ in 0..1000 {
            stepper.step(0.005, &mut state);
        }
        let count = allocations() - before;
        assert_eq!(count, 0, "{support:?}: {count} allocations in 1000 steps");
    }
}
