//! How much a change grows, by a neighbouring run: beside the tangent of the same change.

use crate::runs::{Subject, conservative, four_bar, remembering, spatial};
use vi_constraints::linearization::Tangent;
use vi_constraints::{Options, SchemeKind};
use vi_control::growth::Neighbour;
use vi_control::sensitivities::{Beside, DerivativeGrowth, MEANINGLESS};
use vi_control::{Controls, Direction, Objective, Sensitivities};
use vi_core::galerkin::Stages;
use vi_core::linear::dot;
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{Inertia, MechanismBuilder};

const H: f64 = 0.01;

/// Two arms that turn over.
fn swinging() -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let rod = Inertia::principal(1.0, [0.01, 0.1, 0.1]);
    let one = builder.body("one", rod).at([0.5, 0.0, 0.0]).id();
    let two = builder.body("two", rod).at([1.5, 0.0, 0.0]).id();
    let top = builder.joint("top", PairKind::Revolute, Ground, one).at([0.0; 3]);
    let _ = top.axis([0.0, 1.0, 0.0]).rate(-4.0).id();
    let elbow = builder.joint("elbow", PairKind::Revolute, one, two).at([1.0, 0.0, 0.0]);
    let _ = elbow.axis([0.0, 1.0, 0.0]).id();
    Subject { name: "swinging", built: builder.build().unwrap(), controlled: Vec::new() }
}

/// By both, of a run of so many steps without controls.
fn grown(subject: fn() -> Subject, options: Options, steps: usize) -> [DerivativeGrowth; 2] {
    let [mut run, other] = [0, 1].map(|_| subject().built.integrator(options).unwrap());
    let (controls, objective) = (Controls::default(), Objective::new());
    let mut neighbour = Neighbour::new(other, run.state(), H);
    run.step().unwrap();
    neighbour.follow(run.state(), &controls, 0);
    let apart = |of: fn(&vi_core::State) -> &Vec<f64>| -> Vec<f64> {
        let pairs = of(neighbour.state()).iter().zip(of(run.state()));
        pairs.map(|(own, at)| own - at).collect()
    };
    let (mut q, mut z) = (apart(|own| &own.q), apart(|own| &own.internal));
    let size = dot(&q, &q).sqrt();
    q.iter_mut().chain(&mut z).for_each(|x| *x /= size);
    let p = vec![0.0; q.len()];
    let direction = Direction::from(Tangent { q, p, z });
    let mut beside = Sensitivities::new(&run, H, vec![direction]).unwrap();
    for step in 1..steps {
        let with = Beside { controls: &controls, design: None, objective: &objective };
        beside.advance(&mut run, with).unwrap();
        neighbour.follow(run.state(), &controls, step);
    }
    [neighbour.growth(), beside.growth()[0]]
}

#[test]
fn a_neighbour_grows_apart_as_the_tangent_does() {
    let nodal = Options::new(SchemeKind::Nodal, H);
    let galerkin = nodal.galerkin(Stages::new(2).unwrap());
    let null_space = Options::new(SchemeKind::Reduced, H);
    let all: [(&str, fn() -> Subject, &Options, usize); 7] = [
        ("a chaotic pendulum", swinging, &nodal, 4000),
        ("the same by other steps", swinging, &galerkin, 4000),
        ("the same reduced", swinging, &null_space, 4000),
        ("a pendulum, for a while", conservative, &nodal, 300),
        ("a tree with a free body", spatial, &nodal, 300),
        ("a linkage", four_bar, &nodal, 600),
        ("a signal with a state", remembering, &nodal, 300),
    ];
    let mut chaotic = 0;
    for (name, subject, options, steps) in all {
        let [own, tangent] = grown(subject, *options, steps);
        println!("{name}: {own:?} beside {tangent:?}");
        let ratio = own.largest / tangent.largest;
        let is_over = own.meaningless_from.is_some(); // no more is measured
        assert!((ratio - 1.0).abs() < 1e-3 || is_over, "{name}: {ratio}");
        let [own_from, from] = [own, tangent].map(|own| own.meaningless_from);
        assert_eq!(own_from, from, "{name}");
        assert_eq!(own_from.is_some(), own.largest > MEANINGLESS, "{name}");
        chaotic += usize::from(own_from.is_some());
    }
    assert!(chaotic >= 3, "none of these grows");
}
