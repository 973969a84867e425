//! Model files whose equilibria lose their stability, and modes beside circulatory forces, against
//! closed forms.
#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::hostile;
use holonom::model::Model;
use holonom::modes::{About, ModalAnalysis, ModeKind, Report};
use holonom::run::prepare;
use holonom::{RunOutcome, Sample};

/// The rows of a run, and what it warns of.
fn rows(text: &str) -> (Vec<Sample>, Vec<String>) {
    let model = Model::from_toml(text).unwrap();
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| {
        samples.push(sample.clone());
        Ok(())
    };
    let mut run = prepare(&model).unwrap();
    let outcome = run.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, RunOutcome::Done);
    (samples, run.warnings())
}

fn report(text: &str, about: About, count: usize) -> Report {
    ModalAnalysis::new(&Model::from_toml(text).unwrap(), about).unwrap().modes(count).unwrap()
}

fn off(sample: &Sample, exact: [f64; 3]) -> f64 {
    sample.sensors.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_column_bends_by_arc_length_as_by_steps_of_the_load() {
    let by_arc = hostile("column_arc_length");
    for text in [by_arc.replace("arc_length = true", ""), by_arc] {
        let (samples, warnings) = rows(&text);
        let last = samples.last().unwrap();
        println!("tip {:.4?}, {} equilibria", last.sensors, samples.len());
        assert!(off(last, [0.3635, 0.0, 0.789]) < 1e-3);
        assert!(samples.iter().all(|sample| sample.unstable == Some(0)));
        assert!(warnings.iter().all(|warning| !warning.contains("unstable")), "{warnings:?}");
    }
}

#[test]
fn a_perfect_column_warns_where_it_turns_unstable() {
    let (samples, warnings) = rows(&hostile("column_perfect"));
    let critical = 863.55 / 1295.4;
    for sample in &samples {
        if (sample.t - critical).abs() > 1e-3 {
            assert_eq!(sample.unstable, Some(usize::from(sample.t > critical)), "t = {}", sample.t);
        }
    }
    println!("{warnings:?}");
    let warning = warnings.iter().find(|warning| warning.contains("turns unstable")).unwrap();
    assert!(warning.contains("0.66"), "it names the place: {warning}");
    assert_eq!(warnings.len(), 1);
}

#[test]
fn a_relaxed_start_is_stable_or_says_that_it_is_not() {
    let text = hostile("column_relaxed").replace("end = 10.0", "end = 0.02");
    let (samples, warnings) = rows(&text);
    println!("tip {:.4?}, {warnings:?}", samples[0].sensors);
    assert!(off(&samples[0], [0.060, 0.795, 0.0]) < 2e-3);
    assert!(warnings.iter().all(|warning| !warning.contains("unstable")));
    let (samples, warnings) = rows(&text.replace("0.001", "0.0"));
    println!("tip {:.4?}, {warnings:?}", samples[0].sensors);
    assert!(warnings.iter().any(|warning| warning.contains("is unstable, in one direction")));
}

#[test]
fn a_slender_wire_bends_as_the_elastica() {
    let text = hostile("slender_wire");
    let (samples, _) = rows(&text);
    let own = samples.last().unwrap().sensors[2];
    let thinner = text
        .replace("[2e-05, 2e-05]", "[1e-05, 1e-05]")
        .replace("2.8000000000000015e-09", "1.75e-10");
    let half = rows(&thinner).0.last().unwrap().sensors[2];
    println!("tip.z = {own:.6}, {half:.6}");
    assert!((own - 0.30172).abs() < 1e-4 && (half - 0.30172).abs() < 1e-4);
}

#[test]
fn a_constant_load_is_there_from_the_beginning() {
    let text = hostile("constant_preload");
    let (samples, _) = rows(&text);
    let all: Vec<f64> = samples.iter().map(|sample| sample.sensors[1]).collect();
    let ones =
        text.replace("type = \"constant\"", "type = \"table\", times = [0, 1], values = [1, 1]");
    let same: Vec<f64> = rows(&ones).0.iter().map(|sample| sample.sensors[1]).collect();
    println!("tip.y = {all:?}");
    assert!((all[0] - 0.0333).abs() < 1e-4 && all == same);
    // nothing stated: it grows, as before
    let grows = rows(&text.replace("history = { type = \"constant\" }", "")).0;
    assert!(grows[0].sensors[1] == 0.0 && (grows[4].sensors[1] / all[4] - 1.0).abs() < 1e-12);
}

#[test]
fn written_models_keep_whether_a_history_is_stated() {
    for text in [
        hostile("constant_preload"),
        hostile("constant_preload").replace("history = { type = \"constant\" }", ""),
    ] {
        let model = Model::from_toml(&text).unwrap();
        let again = Model::from_toml(&model.to_toml()).unwrap();
        assert_eq!(model.loads, again.loads);
    }
}

#[test]
fn dampers_to_the_ground_damp_both_whirls() {
    let report = report(&hostile("damped_whirl"), About::Rotation, 4);
    let found: Vec<[f64; 2]> = report
        .modes
        .iter()
        .filter(|mode| mode.kind == ModeKind::Vibration)
        .map(|mode| [mode.omega, mode.decay])
        .collect();
    println!("{found:?}");
    let exact = [[10.0125, 0.5], [29.9875, 0.5]];
    assert_eq!((report.unstable, report.zero, found.len()), (0, 1, 2));
    for (found, exact) in found.iter().zip(exact) {
        assert!((found[0] - exact[0]).abs() < 1e-3 && (found[1] - exact[1]).abs() < 1e-5);
    }
}

#[test]
fn a_follower_column_is_stable_below_its_flutter_load() {
    let text = hostile("follower_column");
    let found = report(&text, About::Static, 3);
    let omega: Vec<f64> = found
        .modes
        .iter()
        .filter(|mode| mode.kind == ModeKind::Vibration)
        .map(|mode| mode.omega)
        .collect();
    println!("{omega:?}");
    assert_eq!(found.unstable, 0);
    assert!((omega[0] - 5.1758).abs() < 2e-3 && (omega[1] - 18.587).abs() < 1e-2);
    let beyond = report(&text.replace("-10.0", "-20.3"), About::Static, 3);
    assert!(beyond.unstable == 1 && beyond.modes[0].omega > 0.0, "flutter");
}

/// Two rods of 1 m with springs of 1 N m, masses 2 and 1 at their ends (Ziegler 1952).
fn ziegler(load: &str) -> String {
    let rod = |name: &str, mass: f64, at: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass}\ninertia = [1e-6, 1e-6, 1e-6]\nposition = [0, 0, {at}]\n"
        )
    };
    let hinge = |name: &str, parent: &str, child: &str, at: f64| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\n\
             position = [0, 0, {at}]\naxis = [0, 1, 0]\nspring = {{ stiffness = 1.0 }}\n"
        )
    };
    "[model]\nname = \"ziegler\"\n[simulation]\nscheme = \"static\"\nstep = 0.1\nend = 1.0\n"
        .to_owned()
        + &rod("lower", 2.0, 1.0)
        + &rod("upper", 1.0, 2.0)
        + &hinge("foot", "ground", "lower", 0.0)
        + &hinge("knee", "lower", "upper", 1.0)
        + &format!("[[load]]\nname = \"press\"\nbody = \"upper\"\n{load}\n")
}

/// Flutter: Beck `20.05 EI/L²`, Ziegler `(7 − 2√2)/2 k/l`. Divergence: Ziegler under a dead load
/// `(3 − √5)/2 k/l`, a column whose load follows by three tenths `acos²(−3/7) EI/L²`.
#[test]
fn flutter_is_told_from_divergence() {
    let beck = hostile("follower_column").replace("elements = 16\norder = 2", "elements = 8");
    let part = beck.replace("[0.0, 0.0, -10.0]", "[0.0, 0.0, -1.8]")
        + "[[load]]\nname = \"dead\"\nbody = \"b.end\"\nforce = [-4.2, 0.0, 0.0]\n";
    let cases = [
        ("Beck", beck.replace("-10.0", "-25.0"), 25.0, 20.05, true),
        ("Ziegler", ziegler("force = [0, 0, -3]\nframe = \"body\""), 3.0, 2.0858, true),
        ("dead", ziegler("force = [0, 0, -0.6]"), 0.6, 0.381_966, false),
        ("part", part, 6.0, 4.0471, false),
    ];
    for (name, text, largest, exact, flutters) in cases {
        let (samples, warnings) = rows(&text);
        let last = samples.iter().rfind(|sample| sample.unstable == Some(0)).unwrap();
        println!("{name}: stable up to {:.4} of {exact}, {warnings:?}", largest * last.t);
        assert!((largest * last.t / exact - 1.0).abs() < 1e-2, "{name}: {}", largest * last.t);
        let says = |words: &str| warnings.iter().any(|warning| warning.contains(words));
        assert!(says("by flutter") == flutters && says("bifurcation point") != flutters, "{name}");
    }
}

#[test]
fn whirls_and_unstable_modes_are_all_counted() {
    let shaft = report(&hostile("shaft_between_critical_speeds"), About::Rotation, 4);
    println!("growth {:.4} 1/s", shaft.modes[0].growth);
    assert!(shaft.unstable == 1 && (shaft.modes[0].growth - 0.511).abs() < 2e-3);
    let column = hostile("column_eight_unstable");
    for (elements, count) in [("60", 3), ("60", 4), ("20", 3)] {
        let text = column.replace("elements = 60", &format!("elements = {elements}"));
        let found = report(&text, About::Static, count);
        let vibrations = found.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration).count();
        println!("{elements} elements, {count}: {} unstable", found.unstable);
        assert_eq!((found.unstable, vibrations), (8, count));
        assert_eq!(found.unstable_by_inertia, Some(8));
    }
}

#[test]
fn nothing_that_can_move_is_said() {
    let locked = "[model]\nname = \"locked\"\n[simulation]\nstep = 0.01\nend = 1.0\n[[body]]\nname = \"a\"\nmass = 1.0\n\
                  inertia = [1, 1, 1]\n[[joint]]\nname = \"weld\"\ntype = \"fixed\"\nparent = \"ground\"\nchild = \"a\"\n\
                  position = [0, 0, 0]\n";
    let found = report(locked, About::Start, 4);
    println!("{:?}", found.warnings);
    assert_eq!((found.dof, found.modes.len()), (0, 0));
    assert!(found.warnings.iter().any(|warning| warning.contains("nothing can move")));
}

/// `k (1 − l₀/l) · 2y = F` of the mass between two springs, every scheme; the work of the load in
/// the balance.
#[test]
fn a_load_acts_on_a_point_mass() {
    let text = hostile("particle_load");
    let still = text.replace("step = 0.01", "step = 0.5\nscheme = \"static\"");
    let (samples, _) = rows(&still);
    let y = samples.last().unwrap().q[1];
    let l0 = 1.04_f64.sqrt();
    let force = 2.0 * 1000.0 * (1.0 - l0 / (1.0 + y * y).sqrt()) * y;
    println!("y = {y:.6}, springs carry {force:.6} N");
    assert!((force + 1.0).abs() < 1e-9);
    // free fall of a particle under its load, and the energy column of it
    let free = "[model]\nname = \"free\"\n[simulation]\nstep = 0.01\nend = 0.5\n[[particle]]\nname = \"p\"\nmass = 2.0\n\
                position = [0, 0, 0]\n[[load]]\nname = \"push\"\nbody = \"p\"\nforce = [0, 3, 1]\n";
    for scheme in ["nodal", "reduced", "constrained", "em-nodal", "em-constrained"] {
        let model = free.replace("end = 0.5", &format!("end = 0.5\nscheme = \"{scheme}\""));
        let parsed = Model::from_toml(&model).unwrap();
        let mut run = prepare(&parsed).unwrap();
        let columns = run.energy_columns().to_vec();
        let mut last = None;
        let mut observe = |sample: &Sample| {
            last = Some(sample.clone());
            Ok(())
        };
        run.run(&mut observe, &mut |_, _| {}).unwrap();
        let last = last.unwrap();
        let at = columns.iter().position(|name| name == "work.push").unwrap();
        let (t, work) = (last.t, last.energies[at]);
        let exact = 0.5 * t * t / 2.0; // times F
        let off = (last.q[1] - 3.0 * exact).abs() + (last.q[2] - exact).abs();
        println!("{scheme}: off by {off:.1e} m, work {work:.6} J, {:.6}", 10.0 * exact);
        assert!(off < 1e-12 && (work - 10.0 * exact).abs() < 1e-12);
    }
    for (change, word) in [
        ("torque = [0.0, 0.0, 1.0]", "has no rotation"),
        ("point = [0.0, 0.0, 1.0]", "has no other points"),
        ("frame = \"body\"", "has no axes"),
    ] {
        let words = crate::harness::hostile::refusal(&format!("{text}\n{change}\n")).unwrap();
        assert!(words.contains(word), "{words}");
    }
}

/// A large system with a stiffness that is not symmetric: where the column is empty, a warning says
/// so and counts the equilibria.
#[test]
fn what_is_not_judged_is_said() {
    let own = [holonom::Override::new("simulation.end", "0.4")];
    let model = Model::from_toml_with(&crate::harness::models::shipped("roll_up"), &own).unwrap();
    let (samples, warnings) = rows(&model.to_toml());
    let unknown = samples.iter().filter(|sample| sample.unstable.is_none()).count();
    println!("{unknown} of {} are not judged: {warnings:?}", samples.len());
    assert!(unknown > 0);
    let words =
        format!("whether {unknown} of {} equilibria are stable is not known", samples.len());
    assert!(warnings.iter().any(|warning| warning.starts_with(&words)), "{warnings:?}");
    // of a small one all are judged
    let (samples, warnings) = rows(&hostile("column_perfect"));
    assert!(samples.iter().all(|sample| sample.unstable.is_some()));
    assert!(warnings.iter().all(|warning| !warning.contains("not known")));
}

/// A strip on two supports that hold its twist, between moments: `π √(EI GJ)/L`. From no load it is
/// too high by `M²ℓ²/(12 EI GJ)`, of a loaded state right to the fourth order.
#[test]
fn moments_that_buckle_are_too_high_by_what_bends_within_elements() {
    let strip = |[bending, twist]: [f64; 2], elements: usize, moment: f64| {
        let universal = |name: &str, parent: &str, child: &str, x: f64| {
            format!(
                "[[joint]]\nname = \"{name}\"\ntype = \"universal\"\nparent = \"{parent}\"\nchild = \"{child}\"\n\
                 position = [{x}, 0, 0]\naxis = [0, 0, 1]\naxis2 = [0, 1, 0]\n"
            )
        };
        let load = |node: &str, moment: f64| {
            format!(
                "[[load]]\nname = \"at {node}\"\nbody = \"b.{node}\"\ntorque = [0, 0, {moment:e}]\n"
            )
        };
        format!(
            "[model]\nname = \"strip\"\n[simulation]\nscheme = \"static\"\nstep = 1.0\nend = 1.0\n[[beam]]\n\
             name = \"b\"\npoints = [[0, 0, 0], [1, 0, 0]]\nelements = {elements}\nnormal = [0, 0, 1]\n\
             section = {{ EA = 1e8, GA1 = 1e8, GA2 = 1e8, EI1 = 1e3, EI2 = {bending:e}, GJ = {twist:e}, rhoA = 1.0, \
             rhoI1 = 1e-6, rhoI2 = 1e-6 }}\n[[body]]\nname = \"shoe\"\nmass = 1.0\ninertia = [1, 1, 1]\n\
             position = [1, 0, 0]\n[[joint]]\nname = \"slide\"\ntype = \"prismatic\"\nparent = \"ground\"\n\
             child = \"shoe\"\nposition = [1, 0, 0]\naxis = [1, 0, 0]\n"
        ) + &universal("left", "ground", "b.start", 0.0)
            + &universal("right", "shoe", "b.end", 1.0)
            + &load("start", -moment)
            + &load("end", moment)
    };
    let lowest = |text: &str, about: About| {
        let model = Model::from_toml(text).unwrap();
        let report = ModalAnalysis::of_loads(&model, about).unwrap().buckling(1).unwrap();
        report.modes[0].load_factor.unwrap()
    };
    for stiffness in [[1.0_f64, 1.0], [1.0, 0.2], [2.0, 0.7]] {
        let exact = std::f64::consts::PI * (stiffness[0] * stiffness[1]).sqrt();
        for elements in [4, 8, 16] {
            let off = lowest(&strip(stiffness, elements, exact), About::Start) - 1.0;
            let part = std::f64::consts::PI.powi(2) / (12.0 * (elements * elements) as f64);
            // of a state that is bent across its stiff axis (Trahair 1993)
            let bent = stiffness.map(|own| 1.0 - own * 1e-3).iter().product::<f64>().sqrt();
            let near = lowest(&strip(stiffness, elements, 0.99 * exact), About::Static);
            let near = 0.99 * near * bent - 1.0;
            println!("{stiffness:?}, {elements}: off by {off:.2e}, {part:.2e}; near {near:.1e}");
            assert!((off / part - 1.0).abs() < 0.1, "{off:e} and {part:e}");
            assert!(near.abs() < 0.25 * part, "{near:e}");
        }
    }
}
