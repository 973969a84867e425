//! A body held at one point: the point stays in its place over long runs, and small increments keep
//! their own precision although the place may be far from the origin.
#![allow(clippy::unwrap_used)] // helpers of tests

use nalgebra::Vector3;
use vi_constraints::{Constraints, Reparametrization};
use vi_core::Configuration;
use vi_core::Interval;
use vi_core::linear::norm_inf;
use vi_rigid::{EulerMoments, RigidBody, SingleBody, Support, rotation};

fn body(point: Vector3<f64>) -> SingleBody {
    let body = RigidBody::new(1.7, EulerMoments([0.3, 0.7, 0.2])).unwrap();
    let anchor = Vector3::new(0.4, -0.9, 0.3);
    SingleBody::new(body, Support::FixedPoint { anchor, point })
}

fn configuration(body: &SingleBody) -> [f64; 12] {
    body.configuration(&Vector3::zeros(), &rotation::exp(&Vector3::new(0.7, -1.1, 0.4)))
}

#[test]
fn the_point_is_kept_for_a_million_steps() {
    let body = body(Vector3::new(0.2, 0.8, -0.5));
    let mut q = configuration(&body).to_vec();
    let u = [0.02, 0.07, -0.03];
    let (mut s, mut worst, mut g) = (Interval::new(12), 0.0_f64, [0.0; 9]);
    for _ in 0..1_000_000 {
        s.open(0.0, 0.1, &q);
        body.reparametrize(&u, &mut s).unwrap();
        q.copy_from_slice(&s.q1);
        body.clean(0.0, &mut q);
        body.value(Configuration::new(0.0, &q), &mut g);
        worst = worst.max(norm_inf(&g));
    }
    println!("constraints at most {worst:.1e}");
    assert!(worst < 2e-15, "g = {worst:e}");
}

#[test]
fn small_increments_keep_their_precision_far_from_the_origin() {
    let body = body(Vector3::new(1e4, -2e4, 5e3));
    let q0 = configuration(&body);
    let u = [3e-13, -7e-13, 5e-13];
    let mut s = Interval::new(12);
    s.open(0.0, 0.1, &q0);
    body.reparametrize(&u, &mut s).unwrap();
    let exact = body.velocity(&q0, &u); // to first order in u, the rest is 1e-24
    let error = norm_inf(&std::array::from_fn::<f64, 12, _>(|i| s.dq[i] - exact[i]));
    assert!(error < 2e-24, "Δq off by {error:e}");
}
