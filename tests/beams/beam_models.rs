//! Beams in model files: what is read is what is written, everything that acts on bodies acts on
//! nodes, and the four schemes give the same motion.
#![allow(clippy::unwrap_used)] // a test

use holonom::model::{Model, Scheme};
use holonom::{MemberKind, Override, RunFolder, Simulation};
use vi_testkit::model::{beam, body_at, heavy, joint, section};

const EVERYTHING: &str = include_str!("../models/beams_of_every_kind.toml");

#[test]
fn what_is_read_is_what_is_written() {
    let model = Model::from_toml(EVERYTHING).unwrap();
    let again = Model::from_toml(&model.to_toml()).unwrap();
    assert_eq!(model, again, "{}", model.to_toml());
    assert_eq!(model.to_toml(), again.to_toml());
    let section = &model.beam("strip").unwrap().section;
    let ea = section.ea.unwrap();
    assert!((ea / (2e8 * 0.04 * 0.02) - 1.0).abs() < 1e-14, "EA is filled in: {ea}");
    let spring = &model.beam("spring").unwrap().section;
    assert!((spring.ea.unwrap() - 2e5).abs() < 1e-9, "what is stated is used");
    assert!((spring.gj.unwrap() - 4.0).abs() < 1e-12, "with the stated torsion constant");
}

#[test]
fn nodes_are_members_with_names() {
    let model = Model::from_toml(EVERYTHING).unwrap();
    let simulation = Simulation::new(&model).unwrap();
    let members = simulation.members();
    assert_eq!(members.len(), 1 + (5 + 4) + 17 + 25);
    assert!(members.iter().all(|member| member.kind == MemberKind::Frame));
    for (name, member) in
        [("strip.start", "strip.0"), ("strip.end", "strip.8"), ("ring.end", "ring.16")]
    {
        assert_eq!(members[model.frame(name).unwrap()].name, member);
    }
    for nothing in ["strip.9", "strip.04", "strip.+1", "strip.middle", "strip", "strip.", ".start"]
    {
        assert_eq!(model.frame(nothing), None, "{nothing}");
    }
}

#[test]
fn section_forces_are_written() {
    let model = Model::from_toml(EVERYTHING).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("beam_models");
    let folder = RunFolder::create(folder, true).unwrap();
    holonom::run::run(&model, &mut simulation, &folder, &mut |_, _| {}).unwrap();
    let text = std::fs::read_to_string(folder.path().join("beams.csv")).unwrap();
    let header = "step,t,beam,element,s,Gamma1,Gamma2,Gamma3,K1,K2,K3,N1,N2,N3,M1,M2,M3";
    assert_eq!(text.lines().next(), Some(header));
    assert_eq!(text.lines().count(), 1 + 21 * (7 + 16 + 24));
    let sensors = folder.read_sensors().unwrap().unwrap();
    let column = |name: &str| {
        let k = sensors.columns.iter().position(|column| column == name).unwrap();
        *sensors.values[k].last().unwrap()
    };
    let row = |beam: &str, element: &str| -> Vec<Vec<f64>> {
        let rows = text.lines().filter(|row| row.starts_with("20,"));
        let rows = rows.map(|row| row.split(',').collect::<Vec<_>>());
        let own = rows.filter(|row| row[2] == beam && row[3] == element);
        own.map(|row| row[4..].iter().map(|x| x.parse().unwrap()).collect()).collect()
    };
    let root = &row("strip", "0")[0];
    assert!((root[0] - 0.125).abs() < 1e-15, "s = {}", root[0]);
    for (k, name) in [(7, "root.N1"), (9, "root.N3"), (12, "root.M3")] {
        assert!((root[k] - column(name)).abs() <= 1e-15 * root[k].abs(), "{name}: {}", root[k]);
    }
    assert!(root[12] != 0.0);
    let bend = &row("ring", "3")[0];
    assert!((bend[4] - column("bend.K1")).abs() <= 1e-15 * bend[4].abs());
}

/// The four schemes, by the same steps.
#[test]
fn the_four_schemes_agree() {
    let mut ends: Vec<(Scheme, Vec<f64>)> = Vec::new();
    for scheme in Scheme::ALL.into_iter().filter(|scheme| !scheme.is_energy_momentum()) {
        let own = Override::new("simulation.scheme", scheme.name());
        let model = Model::from_toml_with(EVERYTHING, &[own]).unwrap();
        let mut simulation = Simulation::new(&model).unwrap();
        for _ in 0..20 {
            simulation.integrator().step().unwrap();
        }
        ends.push((scheme, simulation.integrator().state().q.clone()));
    }
    for (scheme, q) in &ends[1..] {
        let apart = q.iter().zip(&ends[0].1).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{} is {apart:.1e} from nodal", scheme.name());
        assert!(apart < 1e-9, "{}: {apart:e}", scheme.name());
    }
}

/// A rod and a strip, a body, and one joint of a kind between two of them or to the ground.
fn joined(kind: &str, parent: &str, child: &str) -> String {
    let axes = match kind {
        "spherical" | "fixed" => "",
        "universal" => "axis = [0, 0.6, 0.8]\naxis2 = [1, 0, 0]",
        "screw" => "axis = [0, 0.6, 0.8]\npitch = 0.2",
        _ => "axis = [0, 0.6, 0.8]",
    };
    let section = section([1e3, 1e3, 1e3, 10.0, 10.0, 10.0], [1.0, 0.1, 0.1]);
    [
        heavy("pair", [0.5, -1.0, -9.81], "step = 2e-3, end = 1.0"),
        body_at([1.3, 0.1, 0.2], "block", 1.5, [0.1, 0.2, 0.15]),
        "angular_velocity = [0, 0, 0]\n".into(),
        beam("rod", &[[0.0; 3], [1.0, 0.0, 0.0]], 3) + &section,
        beam("strip", &[[1.1, 0.0, 0.0], [1.1, 0.8, 0.3]], 4) + &section,
        joint(kind, "pair", [parent, child], [1.0, 0.1, 0.0]) + axes + "\n",
    ]
    .concat()
}

#[test]
fn every_pair_joins_nodes_bodies_and_the_ground() {
    let kinds = [
        ("spherical", 3),
        ("revolute", 1),
        ("cylindrical", 2),
        ("prismatic", 1),
        ("planar", 3),
        ("fixed", 0),
        ("universal", 2),
        ("screw", 1),
    ];
    let sides = [
        ("ground", "rod.end"),
        ("rod.2", "block"),
        ("block", "strip.start"),
        ("rod.end", "strip.start"),
        ("strip.2", "rod.start"),
    ];
    let mut worst = (0.0_f64, 0.0_f64);
    for (kind, dof) in kinds {
        for (parent, child) in sides {
            let run = |scheme: &str| {
                let own = [Override::new("simulation.scheme", scheme)];
                let model = Model::from_toml_with(&joined(kind, parent, child), &own).unwrap();
                let mut simulation = Simulation::new(&model).unwrap();
                assert_eq!(simulation.assembly().counts.dof, 6 * (1 + 4 + 5) - 6 + dof, "{kind}");
                for _ in 0..25 {
                    simulation.step().unwrap();
                }
                let residual = simulation.integrator().observe_state().unwrap().position_residual;
                (simulation.configuration().to_vec(), residual)
            };
            let ((q, g), (other, _)) = (run("nodal"), run("constrained"));
            let apart = q.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            worst = (worst.0.max(apart), worst.1.max(g));
            assert!(apart < 1e-9 && g < 1e-12, "{kind}, {parent} – {child}: {apart:e}, {g:e}");
        }
    }
    println!("nodal and constrained at most {:.1e} apart, |g| at most {:.1e}", worst.0, worst.1);
}

/// Elements that bend too far give a warning beyond 45° and end the run beyond 90°.
#[test]
fn the_limit_of_the_elements_ends_a_run() {
    let text = include_str!("../../examples/models/flying_beam.toml");
    let own = [Override::new("beam.beam.elements", "4")];
    let model = Model::from_toml_with(text, &own).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    assert!(simulation.warnings().is_empty(), "a straight beam is not bent");
    let mut observe = |_: &holonom::Sample| -> Result<(), std::convert::Infallible> { Ok(()) };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    let holonom::RunOutcome::Failed(failure) = outcome else { panic!("{outcome:?}") };
    let warnings = simulation.warnings();
    println!("t = {}: {}\n{}", failure.t, failure.message, warnings.join("\n"));
    assert!(failure.message.contains("of beam `beam`") && failure.message.contains("folds"));
    assert!(warnings.len() == 1 && warnings[0].contains("more than 45°"), "{warnings:?}");
}

#[test]
fn section_forces_at_any_point_converge_with_order_2() {
    // a cantilever under its weight in statics: N1 = −w (L − s), |M2| = w (L − s)²/2, small
    // deflection
    let text = |order: u32, elements: u32| {
        let sensors: String = [0.0, 0.237, 0.5, 0.981, 1.0]
            .iter()
            .enumerate()
            .map(|(k, s)| {
                format!(
                    "[[sensor]]\nname = \"s{k}\"\ntype = \"section_force\"\nof = \"beam\"\nat = {s}\n"
                )
            })
            .collect();
        format!(
            "model = {{ name = \"b\", gravity = [0, 0, -1e-4] }}\n[[beam]]\nname = \"beam\"\n\
             points = [[0, 0, 0], [1, 0, 0]]\nelements = {elements}\norder = {order}\nnormal = [0, 0, 1]\nstart = \"clamped\"\n\
             section = {{ EA = 1e3, GA1 = 1e3, GA2 = 1e3, EI1 = 1, EI2 = 1, GJ = 1, rhoA = 1, rhoI1 = 1e-3, rhoI2 = 1e-3 }}\n\
             {sensors}[simulation]\nscheme = \"static\"\nstep = 1\nend = 1\n"
        )
    };
    let errors = |order: u32, elements: u32| -> f64 {
        let model = Model::from_toml(&text(order, elements)).unwrap();
        let mut statics = holonom::Statics::new(&model).unwrap();
        let mut last = Vec::new();
        let mut observe = |sample: &holonom::Sample| {
            last.clone_from(&sample.sensors);
            Ok(())
        };
        holonom::experiment::RunnableModel::run(&mut statics, &mut observe, &mut |_, _| {})
            .unwrap();
        let place = [0.0, 0.237, 0.5, 0.981, 1.0];
        let error = |(k, s): (usize, &f64)| {
            let own = &last[6 * k..6 * k + 6];
            let (shear, moment) = (1e-4 * (1.0 - s), 0.5e-4 * (1.0 - s) * (1.0 - s));
            let found = (own[0].hypot(own[1]), own[3].hypot(own[4]));
            ((found.0 - shear) / 1e-4).abs().max(((found.1 - moment) / 1e-4).abs())
        };
        place.iter().enumerate().map(error).fold(0.0, f64::max)
    };
    for order in [1, 2, 3] {
        let found = [8, 16, 32].map(|elements| errors(order, elements));
        let rate = (found[1] / found[2]).log2();
        println!("order {order}: errors {found:?}, order {rate:.2}");
        assert!(found[2] < 1e-3 && (rate > 1.8 || found[2] < 1e-6), "{found:?}");
    }
}
