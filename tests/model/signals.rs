//! Laws that read other members, and signals: agreement of schemes, momenta, order, convergence of
//! Newton's method, restart, statics, modes, what is refused.

#![allow(clippy::unwrap_used)] // a test

use super::laws::{apart, links, run};
use holonom::{Model, RunState, Sample, Simulation};
use vi_testkit::model::{body, head, part};

/// Reads another joint, points, velocities and angular velocities of other members.
const FAR: &str = "[[law]]\nname = \"motor\"\njoint = \"shoulder\"\n\
                   effort = \"-8*sin(elbow) - 1.5*elbow.rate + 3*lower.x*lower.wy - 0.7*lower.vz + 0.2*x\"\n";

pub(super) fn iterations(nodes: &[Sample]) -> f64 {
    nodes.iter().map(|node| node.newton_iterations).sum::<f64>() / nodes.len() as f64
}

#[test]
fn a_law_reads_its_own_joint_by_its_name() {
    let own = "[[law]]\nname = \"both\"\njoint = \"elbow\"\neffort = \"-30*(x - 0.2) - 0.7*v\"\n";
    let named = "[[law]]\nname = \"both\"\njoint = \"elbow\"\neffort = \"-30*(elbow - 0.2) - 0.7*elbow.rate\"\n";
    for (scheme, bound) in [
        ("scheme = \"nodal\"", 1e-11),
        ("scheme = \"constrained\"", 1e-11),
        ("scheme = \"dalembert\"", 1e-11),
        ("scheme = \"reduced\"", 1e-11),
        ("method = \"galerkin\", order = 4", 1e-11),
        ("scheme = \"em-nodal\"", 1e-11),
    ] {
        let [a, b] = [own, named].map(|law| run(&links(scheme, law)).unwrap());
        let distance = apart(&a, &b);
        println!(
            "{scheme}: {distance:.1e}, iterations {:.2} {:.2}",
            iterations(&a),
            iterations(&b)
        );
        assert!(distance < bound, "{scheme}: {distance:e}");
    }
}

/// All variational schemes take the same step, on trees and in loops; Newton's method converges as
/// with springs: with the slopes of everything that is read.
#[test]
fn schemes_agree_and_slopes_are_exact() {
    let held = "[[body]]\nname = \"third\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\nposition = [2.5, 0.0, 0.0]\n\
                [[joint]]\nname = \"wrist\"\ntype = \"revolute\"\nparent = \"lower\"\nchild = \"third\"\n\
                position = [2.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\n\
                [[constraint]]\nname = \"rod\"\ntype = \"distance\"\nfrom = \"ground\"\nto = \"third\"\n\
                point_from = [3.3, 0.0, 1.0]\n";
    let stiff = "[[law]]\nname = \"stiff\"\njoint = \"shoulder\"\n\
                 effort = \"-300*x - 250*sin(elbow) - 20*elbow.rate + 5*lower.wy*lower.x\"\n";
    for (name, more) in [("tree", ""), ("loop", held)] {
        let text = |scheme: &str, law: &str| {
            let text = links(scheme, &(law.to_owned() + more));
            match more.is_empty() {
                true => text,
                false => text.replace("rate = 0.3\n", "").replace("rate = -2.0\n", ""),
            }
        };
        for law in [FAR, stiff] {
            let nodal = run(&text("scheme = \"nodal\"", law)).unwrap();
            let count = iterations(&nodal);
            println!("{name}: {count:.2} iterations");
            assert!(count < 4.0, "{name}: {count} iterations");
            for scheme in ["constrained", "dalembert", "reduced"] {
                let other = run(&text(&format!("scheme = \"{scheme}\""), law)).unwrap();
                let distance = apart(&nodal, &other);
                println!("{name}, {scheme}: {distance:.1e}");
                assert!(distance < 1e-9, "{name}, {scheme}: {distance:e}");
            }
        }
    }
}

/// A law that reads the node of a beam, and one on a node that reads a body.
#[test]
fn nodes_of_beams_are_read() {
    let text = |step: f64| {
        [
            head("arm", &format!("step = {step:?}, end = 0.1")),
            "[[beam]]\nname = \"rod\"\npoints = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]\nelements = 4\nstart = \"clamped\"\n\
             section = { shape = { type = \"circle\", dimensions = [0.01] }, material = { E = 2e7, nu = 0.3, density = 3000.0 } }\n".into(),
            body("ball", 0.2, [0.001; 3]) + "position = [1.0, 0.0, 0.3]\nvelocity = [0.0, 0.4, 0.0]\n",
            part("law", "follow") + "on = \"ball\"\nforce = [\"20*(rod.4.x - x)\", \"20*(rod.4.y - y) - 0.3*(vy - rod.4.vy)\", \"0\"]\n",
            part("law", "bend") + "on = \"rod.4\"\nforce = [\"0\", \"15*(ball.y - y)\", \"0\"]\ntorque = [\"0.1*(ball.wx - wx)\", \"0\", \"0\"]\n",
        ]
        .concat()
    };
    let ends = [2e-3, 1e-3, 5e-4, 2.5e-4].map(|step| {
        let nodes = run(&text(step)).unwrap();
        let count = iterations(&nodes);
        assert!(count < 6.0, "{count} iterations");
        nodes.last().unwrap().q.clone()
    });
    let apart = |k: usize| {
        let pairs = ends[k].iter().zip(&ends[k + 1]);
        pairs.map(|(a, b)| f64::abs(a - b)).fold(0.0, f64::max)
    };
    let order = (apart(1) / apart(2)).log2();
    println!("order {order:.2}, differences {:.1e} {:.1e}", apart(1), apart(2));
    assert!((1.7..2.4).contains(&order), "{order}");
}

/// Order 2, and 4 in Galerkin steps; the work of the law is what the energy changes by.
#[test]
fn laws_of_others_keep_the_order() {
    for (method, order) in [("", 2.0), ("method = \"galerkin\", order = 4", 4.0)] {
        let ends = [1u32, 2, 4, 8].map(|parts| {
            let step = 0.025 / f64::from(parts);
            let text = links(method, FAR).replace("step = 5e-3", &format!("step = {step:?}"));
            let nodes = run(&text).unwrap();
            let last = nodes.last().unwrap();
            (last.q.clone(), last.energies.last().unwrap().abs())
        });
        let apart = |k: usize| {
            let pairs = ends[k].0.iter().zip(&ends[k + 1].0);
            pairs.map(|(a, b)| f64::abs(a - b)).fold(0.0, f64::max)
        };
        let found = (apart(1) / apart(2)).log2();
        let balance = (ends[2].1 / ends[3].1).log2();
        println!("{method}: order {found:.2}, balance {balance:.2}");
        assert!((order - 0.25..order + 0.4).contains(&found), "{method}: {found}");
        assert!(order > 2.0 || (1.7..2.4).contains(&balance), "{balance}");
    }
}

#[test]
fn laws_between_bodies_that_read_others_keep_momenta() {
    let text = [
        head("free", "step = 0.01, end = 0.5"),
        body("a", 2.0, [0.1, 0.2, 0.25]) + "angular_velocity = [0.5, -1.0, 2.0]\n",
        body("b", 1.0, [0.03, 0.02, 0.04]) + "position = [1.0, 0.3, 0.2]\nvelocity = [0.0, 1.0, 0.4]\n",
        body("c", 0.5, [0.03, 0.02, 0.04]) + "position = [0.0, 1.3, 0.2]\nvelocity = [1.0, 0.0, 0.4]\n",
        part("signal", "lag") + "filter = { of = \"c.wx + b.vz\", time_constant = 0.05 }\n",
        part("law", "odd")
            + "from = \"a\"\nto = \"b\"\npoint_from = [0.2, 0.1, 0.0]\npoint_to = [0.0, -0.2, 0.1]\n\
               tension = \"3*lag + c.x*x - 0.8*c.wz + a.vy\"\n",
    ]
    .concat();
    let nodes = run(&text).unwrap();
    let (first, last) = (&nodes[0], nodes.last().unwrap());
    for of in [|node: &Sample| node.momentum.linear, |node: &Sample| node.momentum.angular] {
        let drift = (0..3).map(|i| (of(last)[i] - of(first)[i]).abs()).fold(0.0, f64::max);
        println!("momentum changes by {drift:.1e}");
        assert!(drift < 1e-12, "{drift:e}");
    }
    assert!((last.energies.last().unwrap()).abs() < 1e-2);
}

/// Every kind of signal.
pub(super) const ALL: &str = "[[signal]]\nname = \"sum\"\nrate = \"elbow - 2*sum\"\nstart = 0.1\n\
    [[signal]]\nname = \"lag\"\nfilter = { of = \"lower.vz + sum\", time_constant = 0.03 }\n\
    [[signal]]\nname = \"shape\"\ntransfer = { of = \"lag\", numerator = [0.2, 1.0], denominator = [0.01, 0.3, 1.0] }\n\
    [[signal]]\nname = \"control\"\npid = { of = \"0.3 - elbow\", proportional = 6.0, integral = 9.0, derivative = 0.5, \
    filter = 0.02, limits = [-1.0, 1.2] }\n\
    [[signal]]\nname = \"held\"\nevery = 0.015\nvalue = \"0.5*last + 0.2*elbow.rate\"\n\
    [[signal]]\nname = \"digital\"\nevery = 0.01\npid = { of = \"held - shoulder\", proportional = 2.0, integral = 3.0 }\n\
    [[signal]]\nname = \"past\"\ndelay = { of = \"shoulder + held\", time = 0.0125 }\n\
    [[law]]\nname = \"motor\"\njoint = \"shoulder\"\n\
    effort = \"control + 0.3*shape - 0.05*digital + 0.02*past*held\"\n";

/// A run that is stored at any node and goes on has the bits of one that was not.
#[test]
fn signals_restart_to_the_bit() {
    for scheme in ["scheme = \"nodal\"", "scheme = \"constrained\"", "scheme = \"reduced\""] {
        restarts(&links(scheme, ALL));
    }
}

pub(super) fn restarts(text: &str) {
    let model = Model::from_toml(text).unwrap();
    let whole = run(text).unwrap();
    for stop in [0, 1, 6, 7, 20] {
        let mut first = Simulation::new(&model).unwrap();
        let mut silent = |_: &Sample| Ok::<(), std::io::Error>(());
        first.run_while(&mut silent, &mut |step, _| step < stop).unwrap();
        let stored = serde_json::to_string(&first.state()).unwrap();
        let state: RunState = serde_json::from_str(&stored).unwrap();
        let mut next = Simulation::new(&model).unwrap();
        next.resume(state).unwrap();
        let mut rest = Vec::new();
        let mut observe = |sample: &Sample| {
            rest.push(sample.clone());
            Ok::<(), std::io::Error>(())
        };
        next.run(&mut observe, &mut |_, _| {}).unwrap();
        let (a, b) = (whole.last().unwrap(), rest.last().unwrap());
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
        assert_eq!(bits(&a.q), bits(&b.q), "{stop}");
        assert_eq!(bits(&a.sensors), bits(&b.sensors), "{stop}");
    }
}

/// The step with all signals has order 2 where nothing is sampled, and Newton's method has exact
/// slopes.
#[test]
fn continuous_signals_keep_order_two() {
    let continuous: String = ALL
        .replace(" - 0.2*digital + past*held", "")
        .replace("limits = [-1.0, 1.2]", "limits = [-90.0, 90.0]");
    let ends = [1u32, 2, 4, 8].map(|parts| {
        let step = 0.01 / f64::from(parts);
        let text = links("", &continuous)
            .replace("step = 5e-3", &format!("step = {step:?}"))
            .replace("every = 0.015", "every = 0.02");
        let nodes = run(&text).unwrap();
        let count = iterations(&nodes);
        println!("{count:.2} iterations");
        assert!(count < 4.0);
        nodes.last().unwrap().q.clone()
    });
    let apart = |k: usize| {
        let pairs = ends[k].iter().zip(&ends[k + 1]);
        pairs.map(|(a, b)| f64::abs(a - b)).fold(0.0, f64::max)
    };
    let order = (apart(1) / apart(2)).log2();
    println!("order {order:.2}");
    assert!((1.85..2.2).contains(&order), "{order}");
}

/// A controller with three states on two links: orders 2, 4, 6 of positions, of the states and of
/// the balance of energy; with the step of order 2 that of one Gauss node has the same roots.
#[test]
fn continuous_signals_keep_the_orders_of_galerkin_steps() {
    let control = "[[signal]]\nname = \"lag\"\nfilter = { of = \"elbow + 0.3*sin(shoulder)\", time_constant = 0.15 }\n\
                   [[signal]]\nname = \"sum\"\nrate = \"0.4 - lag\"\nstart = 0.1\n\
                   [[signal]]\nname = \"motor\"\nfilter = { of = \"9*(0.4 - lag) + 5*sum - 0.2*lag*sum\", time_constant = 0.2 }\n\
                   [[law]]\nname = \"drive\"\njoint = \"elbow\"\neffort = \"motor - 0.8*v + 0.3*shoulder.rate\"\n";
    let end = |method: &str, step: f64| {
        let text = links(method, control);
        let text = text.replace("step = 5e-3", &format!("step = {step:?}"));
        let nodes = run(&text).unwrap();
        let last = nodes.last().unwrap();
        assert_eq!(last.sensors.len(), 3, "the values of the signals");
        let motion = last.q.iter().chain(&last.sensors).copied().collect::<Vec<f64>>();
        (motion, last.energies.last().unwrap().abs())
    };
    let off =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    for (method, order, coarse) in [
        ("method = \"galerkin\", order = 2", 2.0, 0.0125),
        ("method = \"galerkin\", order = 4", 4.0, 0.025),
        ("method = \"galerkin\", order = 6", 6.0, 0.05),
        ("method = \"galerkin\", order = 4, scheme = \"constrained\"", 4.0, 0.025),
    ] {
        let ends = [1.0, 0.5, 0.25].map(|part| end(method, coarse * part));
        let apart = |k: usize| off(&ends[k].0, &ends[k + 1].0);
        let found = (apart(0) / apart(1)).log2();
        let balance = (ends[0].1 / ends[1].1).log2();
        println!(
            "{method}: order {found:.2}, {:.1e} {:.1e}, balance {balance:.2}",
            apart(0),
            apart(1)
        );
        assert!((order - 0.3..order + 0.4).contains(&found), "{method}: {found}");
        assert!((order - 0.5..order + 0.8).contains(&balance), "{method}: balance {balance}");
    }
    let [one, step] = ["method = \"galerkin\", order = 2", ""].map(|method| end(method, 0.0125).0);
    let distance = off(&one, &step);
    println!("one Gauss node: {distance:.1e}");
    assert!(distance < 1e-9, "{distance:e}");
}

/// A filter rests at what it filters: the equilibrium is that of the expression.
#[test]
fn statics_takes_slopes_and_filters() {
    let text = |effort: &str| {
        let base = links("scheme = \"static\"", "")
            .replace("step = 5e-3, end = 0.25, ", "step = 0.25, end = 1.0, ");
        let base = base.replace("rate = 0.3\n", "").replace("rate = -2.0\n", "");
        base + "[[signal]]\nname = \"lag\"\nfilter = { of = \"elbow + 0.1*shoulder\", time_constant = 0.1 }\n\
            [[signal]]\nname = \"own\"\nvalue = \"elbow + 0.1*shoulder\"\n"
            + &format!(
                "[[law]]\nname = \"a\"\njoint = \"shoulder\"\neffort = \"-90*x - 20*{effort}\"\n"
            )
            + &format!("[[law]]\nname = \"b\"\njoint = \"elbow\"\neffort = \"-40*{effort}\"\n")
    };
    let end = |text: &str| {
        let model = Model::from_toml(text).unwrap();
        let mut statics = holonom::Statics::new(&model).unwrap();
        statics.reach_end().unwrap();
        statics.problem().configuration().to_vec()
    };
    let [a, b] = ["lag", "own"].map(|effort| end(&text(effort)));
    let distance = a.iter().zip(&b).map(|(a, b)| f64::abs(a - b)).fold(0.0, f64::max);
    println!("equilibria apart by {distance:.1e}");
    assert!(distance < 1e-9, "{distance:e}");
    let measured = vi_testkit::model::sensor("effort", "effort", "a")
        + &vi_testkit::model::sensor("first", "joint_coordinate", "shoulder")
        + &vi_testkit::model::sensor("second", "joint_coordinate", "elbow");
    let nodes = run(&(text("lag") + &measured)).unwrap();
    let [lag, own, effort, first, second] = nodes.last().unwrap().sensors[..] else { panic!() };
    let read = second + 0.1 * first;
    println!("effort {effort} where it reads {read}");
    assert!((lag - read).abs() < 1e-12 && (own - read).abs() < 1e-12);
    assert!((effort - (-90.0 * first - 20.0 * read)).abs() < 1e-10 && effort.abs() > 1.0);
    let integral = text("lag") + "[[signal]]\nname = \"sum\"\nrate = \"elbow\"\n";
    let error = holonom::Statics::new(&Model::from_toml(&integral).unwrap()).unwrap_err();
    println!("{error:?}");
    assert!(format!("{error:?}").contains("the signal `sum` has no equilibrium of its own"));
}

#[test]
fn what_is_no_signal_is_refused_at_its_place() {
    let signal = |keys: &str| format!("[[signal]]\nname = \"u\"\n{keys}\n");
    let second = |keys: &str| format!("[[signal]]\nname = \"w\"\n{keys}\n");
    let law = |effort: &str| {
        format!("[[law]]\nname = \"motor\"\njoint = \"elbow\"\neffort = \"{effort}\"\n")
    };
    for (acting, key, why) in [
        (law("3*sholder"), "law.motor.effort", "did you mean `shoulder`?"),
        (law("3*elbow.1"), "law.motor.effort", "has one coordinate"),
        (law("lower.q"), "law.motor.effort", "`lower` has lower.x"),
        (
            signal("value = \"w\"") + &second("value = \"2*u\""),
            "signal.u",
            "`u` needs `w`, `w` needs `u`",
        ),
        (signal("value = \"u + 1\""), "signal.u", "`u` needs `u`"),
        (
            signal("pid = { of = \"w\", proportional = 1.0 }") + &second("value = \"u\""),
            "signal.u",
            "break the circle",
        ),
        (signal(""), "signal.u", "has no value"),
        (signal("value = \"1\"\nrate = \"2\""), "signal.u.rate", "value and rate"),
        (signal("value = \"1\"\nstart = 2.0"), "signal.u.start", "starts as it follows"),
        (signal("rate = \"1\"\nevery = 0.01"), "signal.u.every", "are sampled"),
        (signal("value = \"1\"\nevery = 0.007"), "signal.u.every", "is 1.4 steps"),
        (
            signal("pid = { of = \"1\", derivative = 1.0 }"),
            "signal.u.pid.derivative",
            "needs a filter",
        ),
        (
            signal("pid = { of = \"1\", proportional = 1.0, filter = 0.1 }"),
            "signal.u.pid.filter",
            "of which there is none",
        ),
        (
            signal("pid = { of = \"1\", proportional = 1.0, limits = [2.0, 1.0] }"),
            "signal.u.pid.limits",
            "the limits are 2 to 1",
        ),
        (
            signal("pid = { of = \"1\", integral = 1.0, limits = [1.0, 2.0] }"),
            "signal.u.pid.limits",
            "led back",
        ),
        (
            signal("pid = { of = \"1\", proportional = 1.0, tracking = 1.0 }"),
            "signal.u.pid.tracking",
            "leads an integral",
        ),
        (signal("pid = { of = \"1\" }"), "signal.u.pid", "no gain"),
        (
            signal("filter = { of = \"1\", time_constant = 0.0 }"),
            "signal.u.filter.time_constant",
            "positive",
        ),
        (signal("delay = { of = \"1\", time = 0.001 }"), "signal.u.delay.time", "less than a step"),
        (
            signal(
                "transfer = { of = \"1\", numerator = [1.0, 2.0, 3.0], denominator = [1.0, 2.0] }",
            ),
            "signal.u.transfer.numerator",
            "not proper",
        ),
        (
            signal("transfer = { of = \"1\", numerator = [1.0], denominator = [0.0, 2.0] }"),
            "signal.u.transfer.denominator",
            "no power of s",
        ),
        (signal("value = \"elbow*\""), "signal.u.value", "it ends"),
        (
            second("value = \"1\"").replace("\"w\"", "\"sin\""),
            "signal.sin.name",
            "cannot read a signal",
        ),
    ] {
        let error = run(&links("", &acting)).unwrap_err();
        assert!(error.contains(why) && error.contains(&format!("\"{key}\"")), "{acting}\n{error}");
    }
    let filter = signal("filter = { of = \"elbow\", time_constant = 0.1 }") + &law("-u");
    for (settings, why) in
        [("scheme = \"em-nodal\"", "em-nodal has no signals by `filter`"), ("order = 4", "dissip")]
    {
        let error = run(&links(settings, &filter)).unwrap_err();
        assert!(error.contains(why), "{settings}: {error}");
    }
    let late = signal("delay = { of = \"elbow\", time = 0.1 }") + &law("-u");
    let error = run(&links("method = \"galerkin\", order = 4", &late)).unwrap_err();
    assert!(error.contains("Galerkin's method has no signals by `delay`"), "{error}");
    // what is held has a place in both
    let held = signal("every = 0.01\nvalue = \"elbow\"") + &law("-u");
    for settings in ["method = \"galerkin\", order = 4", "order = 4"] {
        run(&links(settings, &held)).unwrap();
    }
    let error = run(&links("", &(signal("value = \"1/(t - t)\"") + &law("u")))).unwrap_err();
    println!("{error}");
    assert!(error.contains("signal `u`: `1/(t - t)` is not finite"), "{error}");
    for (effort, why) in [
        ("-4e6*x", Some("h² k/m")),
        ("-4e6*elbow", Some("h² k/m")),
        ("-2e4*v", Some("h c/m")),
        ("-400*x - 20*v", None),
    ] {
        let model = Model::from_toml(&links("", &law(effort))).unwrap();
        let warnings = Simulation::new(&model).unwrap().warnings();
        let found = warnings.iter().find(|own| own.contains("is stiff"));
        println!("{effort}: {found:?}");
        match why {
            Some(why) => {
                let found = found.unwrap();
                assert!(found.contains("law `motor`") && found.contains(why), "{found}");
            }
            None => assert!(found.is_none(), "{found:?}"),
        }
    }
    let model = Model::from_toml(&links("", &filter.replace("0.1 }", "0.004 }"))).unwrap();
    let warnings = Simulation::new(&model).unwrap().warnings();
    assert!(
        warnings.iter().any(|own| own.contains("step = 0.002 would resolve it")),
        "{warnings:?}"
    );
}
