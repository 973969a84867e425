//! Sections of beams: stresses over strains, elastic energy, momenta of a rigid motion, the work of
//! the damping.

use super::{Case, Checks, Run};
use holonom::nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use vi_testkit::model::{beam, head, load, sensor};

type Vector = Vector3<f64>;

const STRESSES: [&str; 6] = ["N1", "N2", "N3", "M1", "M2", "M3"];
const STRAINS: [&str; 6] = ["Gamma1", "Gamma2", "Gamma3", "K1", "K2", "K3"];
const ELEMENTS: usize = 4;

/// Stiffnesses along `Γ_1, Γ_2, Γ_3, K_1, K_2, K_3`, relaxation times, and
/// `rhoA, rhoI1, rhoI2, rhoJ`.
#[derive(Clone, Copy)]
struct Expected {
    stiffness: [f64; 6],
    times: [f64; 6],
    inertia: [f64; 4],
}

/// The same section of a beam that is held and of one that moves as it is.
fn case(name: &str, section: &str, expected: Expected) -> [Case; 2] {
    [held(name, section, expected), free(name, section, expected)]
}

/// A free beam in rigid motion: what its mass is.
fn free(name: &str, section: &str, expected: Expected) -> Case {
    let text = [
        head("section", "step = 1e-6, end = 1e-6"),
        beam("free", &[[0.0, 2.0, 0.0], [0.0, 2.0, 0.8]], 3),
        "normal = [1.0, 0.0, 0.0]\nvelocity = [0.4, -0.2, 0.9]\n".into(),
        format!("angular_velocity = [0.7, 1.3, -0.5]\n{section}"),
    ]
    .concat();
    let stiffnesses = [
        "beam.section.E*",
        "beam.section.G*",
        "beam.section.damping",
        "beam.section.material.E",
        "beam.section.material.G",
        "beam.section.material.nu",
        "beam.section.shear_factors",
        "beam.section.torsion_constant",
    ];
    let case = Case::new(format!("mass of a section, {name}"), text, move |run| {
        let mut checks = Checks::default();
        momenta(run, &expected, &mut checks);
        checks
    });
    let only = case.only("beam.section");
    stiffnesses.into_iter().fold(only, |case, key| case.blind(key, "it does not deform"))
}

/// A cantilever under a force and a moment at its end that move all strains.
fn held(name: &str, section: &str, expected: Expected) -> Case {
    let sensors = (0..ELEMENTS).map(|k| {
        let one = |kind: &str, name: &str| {
            sensor(&format!("{name}{k}"), kind, "held") + &format!("element = {k}\n")
        };
        one("strain", "e") + &one("section_force", "s")
    });
    let bending = expected.stiffness[3].min(expected.stiffness[4]).min(expected.stiffness[5]);
    let force = [60.0 * bending, 60.0 * bending, -40.0 * bending];
    let torque = [3.0 * bending, -2.0 * bending, 1.5 * bending];
    // s, a tenth of the time of the bending of 1 m
    let time = 0.1 * (expected.inertia[0] / bending).sqrt();
    let (step, end) = (time / 400.0, time / 13.0);
    let text = [
        head("section", &format!("step = {step:e}, end = {end:e}")),
        beam("held", &[[0.0, 0.0, 0.0], [0.6, 0.0, 0.0]], ELEMENTS),
        "element = \"mean_directors\"\n".into(),
        format!("normal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\n{section}\n"),
        load("pull", "held.end", [force, torque]),
        format!("history = {{ type = \"ramp\", start = 0.0, end = {end:e} }}\n"),
        sensors.collect(),
    ]
    .concat();
    Case::new(format!("section, {name}"), text, move |run| {
        let mut checks = Checks::default();
        let length = 0.6 / ELEMENTS as f64;
        let columns = |prefix: &str, names: [&str; 6]| -> Vec<Vec<Vec<f64>>> {
            let of =
                |k: usize| names.map(|name| run.column(&format!("{prefix}{k}.{name}"))).to_vec();
            (0..ELEMENTS).map(of).collect()
        };
        let (strains, stresses) = (columns("e", STRAINS), columns("s", STRESSES));
        let elastic = run.energy("elastic");
        let work = run.energy("work_of_material_damping");
        let (mut done, last) = ([0.0; 6], run.last());
        let mut stored = 0.0;
        for e in 0..ELEMENTS {
            for i in 0..6 {
                let strain = &strains[e][i];
                let ratio = stresses[e][i][last] / strain[last] / expected.stiffness[i];
                checks.near(STRESSES[i], ratio, 1.0, 1e-9);
                stored += 0.5 * length * expected.stiffness[i] * strain[last].powi(2);
                for pair in strain.windows(2) {
                    let rate = (pair[1] - pair[0]) / step;
                    done[i] -=
                        length * expected.times[i] * expected.stiffness[i] * rate * rate * step;
                }
            }
        }
        checks.near("elastic energy", elastic[last] / stored, 1.0, 1e-8);
        if expected.times.iter().any(|time| *time > 0.0) {
            let total: f64 = done.iter().sum();
            checks.near("work of the damping", work[last] / total, 1.0, 2e-3);
        }
        checks
    })
    .only("beam.section")
    .blind("beam.section.rho*", "stresses alone are judged")
    .blind("beam.section.material.density", "stresses alone are judged")
}

/// Of the rigid motion of the free beam, by Simpson's rule, which is exact.
fn momenta(run: &Run, expected: &Expected, checks: &mut Checks) {
    let (length, start) = (0.8, Vector::new(0.0, 2.0, 0.0));
    let (v, w) = (Vector::new(0.4, -0.2, 0.9), Vector::new(0.7, 1.3, -0.5));
    let [mass, i1, i2, i3] = expected.inertia;
    // d_1 = x, d_2 = y, d_3 = z
    let own = Vector::new(i1 * w.x, i2 * w.y, i3 * w.z) * length;
    let (mut linear, mut angular) = (Vector::zeros(), own);
    for (s, weight) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)] {
        let arm = Vector::new(0.0, 0.0, s * length);
        let p = mass * length * weight / 6.0 * (v + w.cross(&arm));
        linear += p;
        angular += (start + arm).cross(&p);
    }
    checks.vector("momentum", run.linear_momentum(0), linear, 1e-10 * linear.norm());
    let tolerance = 1e-6 * own.norm(); // of what turns in itself
    checks.vector("angular momentum", run.angular_momentum(0), angular, tolerance);
}

const STATED: &str = "EA = 90.0\nGA1 = 25.0\nGA2 = 40.0\nEI1 = 0.4\nEI2 = 0.7\nGJ = 0.3\nrhoA = 0.1\nrhoI1 = 1e-3\nrhoI2 = 2e-3\n";

fn stated() -> Expected {
    Expected {
        stiffness: [25.0, 40.0, 90.0, 0.4, 0.7, 0.3],
        times: [0.0; 6],
        inertia: [0.1, 1e-3, 2e-3, 3e-3],
    }
}

pub(crate) fn cases() -> Vec<Case> {
    let table = |keys: &str| format!("[beam.section]\n{STATED}{keys}");
    let each = "damping = { EA = 6e-4, GA1 = 1e-4, GA2 = 1e-3, EI1 = 5e-4, EI2 = 4e-4, GJ = 3e-3 }";
    let times = [1e-4, 1e-3, 6e-4, 5e-4, 4e-4, 3e-3];
    let factor = 0.02 / (TAU * 12.0);
    let damped = |times: [f64; 6]| Expected { times, ..stated() };

    // Young's modulus 2 MPa, Poisson's ratio 0.3
    let (young, nu, density) = (2e6, 0.3, 900.0);
    let shear = young / (2.0 * (1.0 + nu));
    let (b, h) = (0.03_f64, 0.05_f64);
    let (area, i1, i2) = (b * h, b * h.powi(3) / 12.0, h * b.powi(3) / 12.0);
    let rectangle = Expected {
        stiffness: [
            0.8 * shear * area,
            0.7 * shear * area,
            young * area,
            young * i1,
            young * i2,
            shear * 3e-7,
        ],
        times: [0.0; 6],
        inertia: [density * area, density * i1, density * i2, density * (i1 + i2)],
    };
    let round = |outer: f64, inner: f64, g: f64, k: f64| {
        let (area, i) =
            (PI * (outer.powi(2) - inner.powi(2)), PI / 4.0 * (outer.powi(4) - inner.powi(4)));
        Expected {
            stiffness: [
                k * g * area,
                k * g * area,
                young * area,
                young * i,
                young * i,
                2.0 * g * i,
            ],
            times: [0.0; 6],
            inertia: [density * area, density * i, density * i, 2.0 * density * i],
        }
    };
    let own = |shape: &str, modulus: &str, more: &str| {
        format!(
            "[beam.section]\nshape = {{ {shape} }}\nmaterial = {{ E = 2e6, {modulus}, density = 900.0 }}\n{more}\n"
        )
    };
    let cases = [
        case(
            "stated",
            &table("rhoJ = 2.5e-3\n"),
            Expected { inertia: [0.1, 1e-3, 2e-3, 2.5e-3], ..stated() },
        ),
        case("relaxation times", &table(each), damped(times)),
        case("relaxation time", &table("damping = 2e-4"), damped([2e-4; 6])),
        case(
            "loss factor",
            &table("damping = { loss_factor = 0.02, frequency = 12.0 }"),
            damped([factor; 6]),
        ),
        case(
            "rectangle",
            &own(
                "type = \"rectangle\", dimensions = [0.03, 0.05]",
                "nu = 0.3",
                "shear_factors = [0.8, 0.7]\ntorsion_constant = 3e-7",
            ),
            rectangle,
        ),
        case(
            "circle",
            &own(
                "type = \"circle\", dimensions = [0.02]",
                "G = 6e5",
                "shear_factors = [0.85, 0.85]",
            ),
            round(0.02, 0.0, 6e5, 0.85),
        ),
        case(
            "tube",
            &own(
                "type = \"tube\", dimensions = [0.025, 0.02]",
                "G = 6e5",
                "shear_factors = [0.5, 0.5]",
            ),
            round(0.025, 0.02, 6e5, 0.5),
        ),
    ];
    cases.into_iter().flatten().collect()
}
