//! Bushings whose coefficients read other members and signals.

#![allow(clippy::unwrap_used)] // a test

use super::laws::{apart, links, run};
use super::signals::{ALL, iterations, restarts};
use holonom::Sample;
use vi_testkit::model::{between, body, head, part};

const SCHEMES: [&str; 5] = [
    "scheme = \"nodal\"",
    "scheme = \"constrained\"",
    "scheme = \"dalembert\"",
    "scheme = \"reduced\"",
    "method = \"galerkin\", order = 4",
];

/// A body on a bushing beside two links.
fn pod(settings: &str, bushing: &str) -> String {
    let own = body("pod", 1.5, [0.05, 0.06, 0.08])
        + "position = [0.2, -0.4, 0.3]\nvelocity = [0.3, 0.1, -0.2]\nangular_velocity = [0.5, 1.0, -0.7]\n";
    let rubber = between("bushing", "rubber", ["ground", "pod"]) + "position = [0.2, -0.4, 0.3]\n";
    links(settings, &(own + &rubber + bushing))
}

/// The centre of the body by its name is the coordinate of a bushing there.
#[test]
fn what_is_read_by_name_is_the_coordinate() {
    let of = |x: &str, v: &str| {
        format!(
            "stiffness = [\"100*(1 + 3*{x}^2)\", 80.0, 90.0, 5.0, 4.0, 6.0]\n\
             damping = [\"2 + abs({v})\", 1.0, 1.0, 0.1, 0.1, 0.1]\npreload = [0.5, 0.0, 0.0, 0.0, 0.1, 0.0]\n"
        )
    };
    for scheme in SCHEMES {
        let [a, b] = [of("x1", "v1"), of("(pod.x - 0.2)", "pod.vx")]
            .map(|bushing| run(&pod(scheme, &bushing)).unwrap());
        let distance = apart(&a, &b);
        println!(
            "{scheme}: {distance:.1e}, iterations {:.2} {:.2}",
            iterations(&a),
            iterations(&b)
        );
        assert!(distance < 1e-10, "{scheme}: {distance:e}");
        assert!(iterations(&b) < iterations(&a) + 0.5, "slopes of what is read are missing");
    }
}

const FAR: &str = "stiffness = [[\"300*(1 + 0.5*shoulder^2)\", \"20*elbow.rate\", 0, 0, 0, 0], [0, 250.0, 0, 0, 0, \"40*lower.x\"], \
    [0, 0, 200.0, 0, 0, 0], [0, 0, 0, 8.0, 0, 0], [0, 0, 0, 0, 9.0, \"upper.wy\"], [0, 0, 0, 0, 0, 7.0]]\n\
    damping = [\"3 + lower.vz^2\", 2.0, 2.0, 0.2, 0.1, 0.3]\n";

/// All variational schemes take the same step, with exact slopes; the order is 2.
#[test]
fn schemes_agree_on_other_members() {
    let of = |scheme: &str| run(&pod(scheme, FAR)).unwrap();
    let nodal = of(SCHEMES[0]);
    for scheme in &SCHEMES[1..4] {
        let other = of(scheme);
        let (distance, count) = (apart(&nodal, &other), iterations(&other));
        println!("{scheme}: {distance:.1e}, {count:.2} iterations");
        assert!(distance < 1e-10 && count < 3.5, "{scheme}: {distance:e}, {count}");
    }
    let ends = [1u32, 2, 4, 8].map(|parts| {
        let step = 0.025 / f64::from(parts);
        let text = pod("", FAR).replace("step = 5e-3", &format!("step = {step:?}"));
        let last = run(&text).unwrap().pop().unwrap();
        (last.q.clone(), last.energies.last().unwrap().abs())
    });
    let apart = |k: usize| {
        let pairs = ends[k].0.iter().zip(&ends[k + 1].0);
        pairs.map(|(a, b)| f64::abs(a - b)).fold(0.0, f64::max)
    };
    let (order, balance) = ((apart(1) / apart(2)).log2(), (ends[2].1 / ends[3].1).log2());
    println!("order {order:.2}, balance {balance:.2}");
    assert!((1.8..2.3).contains(&order) && (1.6..2.5).contains(&balance));
}

/// Between free bodies momenta are exact, whatever the coefficients read.
#[test]
fn momenta_are_exact_whatever_is_read() {
    let text = [
        head("free", "step = 0.01, end = 0.5"),
        body("a", 2.0, [0.1, 0.2, 0.25]) + "angular_velocity = [0.5, -1.0, 2.0]\n",
        body("b", 1.0, [0.03, 0.02, 0.04]) + "position = [0.4, 0.3, 0.2]\nvelocity = [0.0, 1.0, 0.4]\n",
        body("c", 0.5, [0.03, 0.02, 0.04]) + "position = [0.0, 1.3, 0.2]\nvelocity = [1.0, 0.0, 0.4]\n",
        part("signal", "lag") + "filter = { of = \"c.wx + b.vz\", time_constant = 0.05 }\n",
        between("bushing", "odd", ["a", "b"])
            + "position = [0.2, 0.1, 0.1]\nforce = [\"-30*x1 + lag\", \"-20*x2*c.x\", \"-9*x3 + a.vy\", \
               \"-2*x4 + 0.1*c.wz\", \"-3*x5 - 0.1*lag*v5\", \"-x6\"]\n",
    ]
    .concat();
    let nodes = run(&text).unwrap();
    let (first, last) = (&nodes[0], nodes.last().unwrap());
    for of in [|node: &Sample| node.momentum.linear, |node: &Sample| node.momentum.angular] {
        let drift = (0..3).map(|i| (of(last)[i] - of(first)[i]).abs()).fold(0.0, f64::max);
        println!("momentum changes by {drift:.1e}");
        assert!(drift < 1e-12, "{drift:e}");
    }
}

#[test]
fn a_bushing_of_signals_restarts_to_the_bit() {
    let reads = "stiffness = [\"90 + 5*lag\", 80.0, 70.0, \"4 + held\", 5.0, 6.0]\n\
                 damping = [\"2 + 0.1*past\", 1.0, 1.0, 0.1, 0.1, 0.1]\n";
    for scheme in &SCHEMES[..2] {
        restarts(&(pod(scheme, reads) + ALL));
    }
}

#[test]
fn faults_of_a_bushing_name_it() {
    let force = |entry: &str| format!("force = [\"{entry}\", \"0\", \"0\", \"0\", \"0\", \"0\"]\n");
    let refused = run(&pod("", &force("-shoulde"))).unwrap_err();
    assert!(
        refused.contains("bushing.rubber.force[0]") && refused.contains("shoulder"),
        "{refused}"
    );
    let error = run(&pod("", &force("sqrt(0.1 - shoulder)"))).unwrap_err();
    println!("{error}");
    let found = "bushing `rubber`: `sqrt(0.1 - shoulder)` is not defined, shoulder = 0.1";
    assert!(error.contains(found), "{error}");
    let turned = "force = [\"0\", \"0\", \"0\", \"0\", \"0\", \"60 + 0*elbow\"]\n";
    let error = run(&pod("", turned)).unwrap_err();
    println!("{error}");
    assert!(
        error.contains("bushing `rubber`: its frames are turned by more than 3 rad"),
        "{error}"
    );
}
