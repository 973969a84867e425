//! Bodies that touch at more points than they have freedoms and are hit: steps go on where no
//! impulses obey all laws, and what is approximate then is counted.

use super::shape_runs::{model, momenta_off, rule, solid};
use holonom::Simulation;
use holonom::experiment::RunnableModel;
use vi_testkit::model::heavy;

/// Eight cubes that touch one another, and a ball that spins, without gravity: each joins, slides
/// and parts from the others.
fn cubes_and_ball() -> String {
    let times = "step = 0.005, end = 0.1, contact = \"stepping\"";
    let mut text = heavy("cubes", [0.0; 3], times);
    for k in 0..8 {
        let at = [k % 2, k / 2 % 2, k / 4].map(|i| 0.1 * f64::from(i));
        let shape = "type = \"box\", dimensions = [0.1, 0.1, 0.1]";
        text += &solid(&format!("cube{k}"), 0.8, shape, &format!("position = {at:?}\n"));
    }
    let keys = "position = [-0.15, 0.02, 0.07]\nvelocity = [3.0, 0.4, 0.2]\nangular_velocity = [0.0, 5.0, 20.0]\n";
    text += &solid("ball", 2.7, "type = \"sphere\", dimensions = [0.06]", keys);
    text + &rule("pairs", "a = \"*\"\nb = \"*\"\nfriction = 0.5\n")
}

#[test]
fn cubes_that_are_hit_keep_their_momentum_and_gain_no_energy() {
    let text = cubes_and_ball();
    let mut run = Simulation::new(&model(&text)).unwrap();
    let all: Vec<_> =
        run.samples().map(|own| own.unwrap_or_else(|own| panic!("{}", own.message))).collect();
    let first = &all[0];
    let off = momenta_off(&all);
    let rise = all.windows(2).map(|pair| pair[1].energy - pair[0].energy).fold(f64::MIN, f64::max);
    let counts = run.contact_counts().unwrap();
    println!(
        "momenta off by {off:.1e}, energy rises by {rise:.1e} of {:.1} J at most, {counts:?}",
        first.energy
    );
    assert!(off < 1e-13, "{off:e}");
    assert!(rise < 1e-6 * first.energy, "{rise:e}");
    assert!(counts.relaxed > 0 && counts.divided == 0, "{counts:?}");
    assert!((1e-10..1e-4).contains(&counts.largest_deviation), "{counts:?}");
    // what closes beside its law does so by no more than that
    let gap = counts.smallest_gap.unwrap();
    assert!(gap < 0.0 && gap > -counts.largest_deviation * 0.005, "{gap:e}");
}
