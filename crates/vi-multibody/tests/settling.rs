//! A bed of spheres settles in a box: steps go on without end, gaps are not passed.

use crate::bed::bed;
use crate::contact_runs::run_by;
use vi_constraints::nonsmooth::Method;

#[test]
fn a_bed_of_spheres_settles() {
    let mut run = run_by(&bed(3), 0.005, Method::Stepping);
    for step in 0..300 {
        run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
    }
    let counts = run.state().contacts.counts;
    let contacts = run.nonsmooth().unwrap().nodes().last().map_or(0, |node| node.1.len());
    println!("{contacts} contacts, {counts:?}");
    assert!(contacts > 100, "{contacts}");
    // what a velocity deviates from the laws by bounds what a gap is passed by
    let gap = counts.smallest_gap.unwrap();
    assert!(gap > -1e-9 - 0.005 * counts.largest_deviation, "{gap:e}");
    assert!(counts.largest_deviation < 1e-5, "{counts:?}");
    assert!(counts.largest_work < 1e-9, "{counts:?}");
}
