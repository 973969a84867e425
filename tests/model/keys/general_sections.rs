//! Sections with full matrices, centres off the line of the nodes, axes of their own, without
//! shear; shapes with walls: stresses over strains, momenta of a rigid motion, the work of the
//! damping.

#![allow(non_snake_case)] // A, C, K, M, R, T: matrices

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};
use vi_testkit::model::{beam, head, load, sensor};

type Vector = Vector3<f64>;

const STRESSES: [&str; 6] = ["N1", "N2", "N3", "M1", "M2", "M3"];
const STRAINS: [&str; 6] = ["Gamma1", "Gamma2", "Gamma3", "K1", "K2", "K3"];
const ELEMENTS: usize = 4;
const PAIRS: [(usize, usize); 36] = {
    let (mut all, mut k) = ([(0, 0); 36], 0);
    while k < 36 {
        all[k] = (k / 6, k % 6);
        k += 1;
    }
    all
};

/// What the section is about the line of the nodes.
#[derive(Clone, Copy)]
struct Expected {
    stiffness: Matrix6<f64>,
    damping: Matrix6<f64>,
    line: f64,
    center: [f64; 2],
    inertia: Matrix3<f64>,
}

impl Expected {
    fn new(stiffness: [f64; 6], line: f64, inertia: [f64; 3]) -> Self {
        let inertia = Matrix3::from_diagonal(&inertia.into());
        let stiffness = Matrix6::from_diagonal(&stiffness.into());
        Self { stiffness, damping: Matrix6::zeros(), line, center: [0.0; 2], inertia }
    }

    /// Turned about `d_3`.
    fn turned(self, angle: f64) -> Self {
        let R = Rotation3::from_axis_angle(&Vector::z_axis(), angle).into_inner();
        let mut T = Matrix6::zeros();
        T.fixed_view_mut::<3, 3>(0, 0).copy_from(&R);
        T.fixed_view_mut::<3, 3>(3, 3).copy_from(&R);
        let of = |C: Matrix6<f64>| T * C * T.transpose();
        let center = R * Vector::new(self.center[0], self.center[1], 0.0);
        Self {
            stiffness: of(self.stiffness),
            damping: of(self.damping),
            center: [center.x, center.y],
            inertia: R * self.inertia * R.transpose(),
            ..self
        }
    }

    /// Moved by its three centres, each as a wrench of forces at another place.
    fn moved(self, tension: [f64; 2], shear: [f64; 2], mass: [f64; 2]) -> Self {
        // strains of own fibres: those of a point (x, y) that a curvature K moves by K × (x, y, 0)
        let by = |e: Vector6<f64>| {
            let K = Vector::new(e[3], e[4], e[5]);
            let [t, s] = [tension, shear].map(|c| K.cross(&Vector::new(c[0], c[1], 0.0)));
            Vector6::new(e[0] + s.x, e[1] + s.y, e[2] + t.z, e[3], e[4], e[5])
        };
        let mut A = Matrix6::zeros();
        (0..6).for_each(|k| A.set_column(k, &by(Vector6::ith(k, 1.0))));
        let arm = Vector::new(mass[0], mass[1], 0.0).cross_matrix();
        Self {
            stiffness: A.transpose() * self.stiffness * A,
            damping: A.transpose() * self.damping * A,
            center: mass,
            inertia: self.inertia + self.line * arm.transpose() * arm,
            ..self
        }
    }
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
        "beam.section.stiffness",
        "beam.section.shear_*",
        "beam.section.material.E",
        "beam.section.material.G",
    ];
    let case = Case::new(format!("mass of a section, {name}"), text, move |run| {
        let mut checks = Checks::default();
        momenta(run, &expected, &mut checks);
        checks
    });
    let only = case.only("beam.section");
    let only = only.blind("beam.section.tension_center", "the centre of mass is stated");
    stiffnesses.into_iter().fold(only, |case, key| case.blind(key, "it does not deform"))
}

/// Of the rigid motion of the free beam, by Simpson's rule, which is exact.
fn momenta(run: &Run, expected: &Expected, checks: &mut Checks) {
    let (length, start) = (0.8, Vector::new(0.0, 2.0, 0.0));
    let (v, w) = (Vector::new(0.4, -0.2, 0.9), Vector::new(0.7, 1.3, -0.5));
    let Expected { line, center, inertia, .. } = *expected;
    let c = Vector::new(center[0], center[1], 0.0); // d_1 = x, d_2 = y, d_3 = z
    let own = inertia * w * length;
    let (mut linear, mut angular) = (Vector::zeros(), own);
    for (s, weight) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)] {
        let (arm, part) = (Vector::new(0.0, 0.0, s * length), length * weight / 6.0);
        let at_line = v + w.cross(&arm);
        linear += line * part * (at_line + w.cross(&c));
        angular +=
            line * part * ((start + arm).cross(&(at_line + w.cross(&c))) + c.cross(&at_line));
    }
    checks.vector("momentum", run.linear_momentum(0), linear, 1e-9 * linear.norm());
    checks.vector("angular momentum", run.angular_momentum(0), angular, 1e-6 * own.norm());
}

/// A cantilever under a force and a moment at its end that move all strains.
fn held(name: &str, section: &str, expected: Expected) -> Case {
    let sensors = (0..ELEMENTS).map(|k| {
        let one = |kind: &str, name: &str| {
            sensor(&format!("{name}{k}"), kind, "held") + &format!("element = {k}\n")
        };
        one("strain", "e") + &one("section_force", "s")
    });
    let own = expected.stiffness.diagonal();
    let bending = own[3].min(own[4]).min(own[5]);
    let force = [60.0 * bending, 60.0 * bending, -40.0 * bending];
    let torque = [3.0 * bending, -2.0 * bending, 1.5 * bending];
    let time = 0.1 * (expected.line / bending).sqrt();
    let (step, end) = (time / 400.0, time / 13.0);
    let text = [
        head("section", &format!("step = {step:e}, end = {end:e}")),
        beam("held", &[[0.0, 0.0, 0.0], [0.6, 0.0, 0.0]], ELEMENTS),
        format!("element = \"mean_directors\"\nnormal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\n{section}\n"),
        load("pull", "held.end", [force, torque]),
        format!("history = {{ type = \"ramp\", start = 0.0, end = {end:e} }}\n"),
        sensors.collect(),
    ]
    .concat();
    let case = Case::new(format!("section, {name}"), text, move |run| {
        let mut checks = Checks::default();
        let last = run.last();
        let column = |name: String| run.column(&name);
        let (mut stored, mut done) = (0.0, 0.0);
        let length = 0.6 / ELEMENTS as f64;
        for e in 0..ELEMENTS {
            let strains = STRAINS.map(|name| column(format!("e{e}.{name}")));
            let at = |n: usize| Vector6::from_fn(|i, _| strains[i][n]);
            let stress = expected.stiffness * at(last);
            for i in 0..6 {
                let found = column(format!("s{e}.{}", STRESSES[i]))[last];
                checks.near(STRESSES[i], found / stress[i], 1.0, 1e-7);
            }
            stored += 0.5 * length * stress.dot(&at(last));
            for n in 0..last {
                let rate = (at(n + 1) - at(n)) / step;
                done -= length * (expected.damping * rate).dot(&rate) * step;
            }
        }
        checks.near("elastic energy", run.energy("elastic")[last] / stored, 1.0, 1e-8);
        if expected.damping != Matrix6::zeros() {
            let work = run.energy("work_of_material_damping")[last];
            checks.near("work of the damping", work / done, 1.0, 2e-3);
        }
        checks
    });
    case.only("beam.section")
        .blind("beam.section.rho*", "stresses alone are judged")
        .blind("beam.section.mass*", "stresses alone are judged")
        .blind("beam.section.material.density", "stresses alone are judged")
}

const STATED: &str = "EA = 90.0\nGA1 = 25.0\nGA2 = 40.0\nEI1 = 0.4\nEI2 = 0.7\nGJ = 0.3\nrhoA = 0.1\nrhoI1 = 1e-3\nrhoI2 = 2e-3\n";

fn stated() -> Expected {
    Expected::new([25.0, 40.0, 90.0, 0.4, 0.7, 0.3], 0.1, [1e-3, 2e-3, 3e-3])
}

/// As a model file writes it.
fn rows(m: &Matrix6<f64>) -> String {
    let row = |i: usize| {
        let row: Vec<String> = (0..6).map(|j| format!("{:?}", m[(i, j)])).collect();
        format!("[{}]", row.join(", "))
    };
    format!("[{}]", (0..6).map(row).collect::<Vec<_>>().join(", "))
}

/// 6×6 between velocities and angular velocities about the line of the nodes.
fn mass(of: &Expected) -> Matrix6<f64> {
    let arm = Vector::new(of.center[0], of.center[1], 0.0).cross_matrix();
    let mut M = Matrix6::identity() * of.line;
    M.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-of.line * arm));
    M.fixed_view_mut::<3, 3>(3, 0).copy_from(&(of.line * arm));
    M.fixed_view_mut::<3, 3>(3, 3).copy_from(&of.inertia);
    M
}

/// All entries of a stiffness that stays positive definite when one of them changes a little.
fn full() -> Matrix6<f64> {
    let mut C = stated().stiffness;
    for (k, (i, j)) in PAIRS.into_iter().filter(|(i, j)| i < j).enumerate() {
        let size = 0.04 * (C[(i, i)] * C[(j, j)]).sqrt();
        let value = size * (1.0 + 0.13 * k as f64) * if k % 2 == 0 { 1.0 } else { -1.0 };
        (C[(i, j)], C[(j, i)]) = (value, value);
    }
    C
}

/// Elements of a beam of 0.8 m with stations at 0, 0.3 (a jump) and 0.8 m.
const PARTS: usize = 2;

/// Twist of the nodes and momentum of a rigid motion: `rhoA` is linear between stations.
fn stations() -> Case {
    let text = [
        head("stations", "step = 1e-6, end = 1e-6"),
        beam("free", &[[0.0, 2.0, 0.0], [0.0, 2.0, 0.8]], PARTS),
        "normal = [1.0, 0.0, 0.0]\nvelocity = [0.4, -0.2, 0.9]\n".into(),
        format!("section = {{ {} }}\n", STATED.trim().replace('\n', ", ")),
        "stations = [ { at = 0.0, twist = 0.2 }, { at = 0.3, twist = 0.8, section = { rhoA = 0.3 } },\n".into(),
        "{ at = 0.3, twist = 0.8, section = { rhoA = 0.7 } }, { at = 0.8, twist = -0.1, section = { rhoA = 0.2 } } ]\n".into(),
    ]
    .concat();
    let case = Case::new("stations of a beam", text, |run| {
        let mut checks = Checks::default();
        let mass = 0.3 * 0.5 * (0.1 + 0.3) + 0.5 * 0.5 * (0.7 + 0.2);
        let momentum = mass * Vector::new(0.4, -0.2, 0.9);
        checks.vector("momentum", run.linear_momentum(0), momentum, 1e-12);
        let between = 0.8 - 0.9 * 0.1 / 0.5;
        for (k, twist) in [0.2, between, -0.1].into_iter().enumerate() {
            let turned = Rotation3::from_axis_angle(&Vector::z_axis(), twist).into_inner();
            checks.matrix("directors", run.directors(&format!("free.{k}"), 0), turned, 1e-12);
        }
        checks
    });
    case.only("beam.stations")
}

/// Extension of an element whose stiffness is linear along it: compliances add.
fn tapered() -> Case {
    let of = |kind: &str| sensor(kind, kind, "held") + "element = 0\n";
    let text = [
        head("taper", "step = 1e-3, end = 0.02"),
        beam("held", &[[0.0, 0.0, 0.0], [0.6, 0.0, 0.0]], 1),
        format!(
            "normal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\nsection = {{ {} }}\n",
            STATED.trim().replace('\n', ", ")
        ),
        "stations = [ { at = 0.0 }, { at = 0.6, section = { EA = 130.0 } } ]\n".into(),
        load("pull", "held.end", [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
            .replace("force = [0.0, 0.0, 0.0]", "force = [5.0, 0.0, 0.0]"),
        of("strain") + &of("section_force"),
    ]
    .concat();
    let case = Case::new("tapered beam", text, |run| {
        let mut checks = Checks::default();
        let (strain, force) = (run.column("strain.Gamma3"), run.column("section_force.N3"));
        let last = run.last();
        let mean = (130.0 - 90.0) / (130.0_f64 / 90.0).ln();
        checks.near("tension", force[last] / strain[last] / mean, 1.0, 1e-5);
        checks
    });
    case.only("beam.stations")
}

/// A force at a place of a beam of two legs: its angular momentum after a short time.
fn load_at_place() -> Case {
    let text = [
        head("place", "step = 1e-6, end = 1e-6"),
        beam("free", &[[0.0; 3], [0.6, 0.0, 0.0], [0.6, 0.5, 0.0]], 2),
        format!("normal = [0.0, 0.0, 1.0]\nsection = {{ {} }}\n", STATED.trim().replace('\n', ", ")),
        "[[load]]\nname = \"push\"\nbeam = \"free\"\nat = 0.73\nforce = [3.0, -2.0, 5.0]\ntorque = [0.3, 0.2, -0.1]\n".into(),
    ]
    .concat();
    let case = Case::new("load at a place", text, |run| {
        let mut checks = Checks::default();
        let (force, torque) = (Vector::new(3.0, -2.0, 5.0), Vector::new(0.3, 0.2, -0.1));
        let (last, time) = (run.last(), 1e-6);
        checks.vector("momentum", run.linear_momentum(last) / time, force, 1e-6);
        let moment = Vector::new(0.6, 0.13, 0.0).cross(&force) + torque;
        checks.vector("angular momentum", run.angular_momentum(last) / time, moment, 1e-6);
        checks
    });
    case.only("load.at")
}

pub(crate) fn cases() -> Vec<Case> {
    let table = |keys: &str| format!("[beam.section]\n{STATED}{keys}");
    let centers = "tension_center = [0.03, -0.02]\nshear_center = [-0.04, 0.05]\nmass_center = [0.02, 0.06]\n";
    let moved = |own: Expected| own.moved([0.03, -0.02], [-0.04, 0.05], [0.02, 0.06]);
    let beside = |own: Expected| own.moved([0.03, -0.02], [0.03, -0.02], [0.03, -0.02]);
    let damped = Expected { damping: 3e-4 * full(), ..stated() };
    let general = moved(stated());
    let matrices = format!(
        "[beam.section]\nstiffness = {}\nmass = {}\nangle = 0.5\n",
        rows(&full()),
        rows(&mass(&general))
    );
    let general = Expected { stiffness: full(), ..general }.turned(0.5);
    let (young, shear, density) = (2e6, 8e5, 900.0);
    let own = |shape: &str, more: &str| {
        format!(
            "[beam.section]\nshape = {{ {shape} }}\nmaterial = {{ E = 2e6, G = 8e5, density = 900.0 }}\nshear_factors = [0.4, 0.5]\n{more}\n"
        )
    };
    // outer 40 × 60 mm, flanges 4 mm, webs 3 mm
    let (b, h, tf, tw) = (0.04_f64, 0.06_f64, 4e-3_f64, 3e-3_f64);
    let walls = |kind: &str| format!("type = \"{kind}\", dimensions = [0.04, 0.06, 0.004, 0.003]");
    let of = |webs: f64, i2: f64, torsion: f64| {
        let area = 2.0 * b * tf + webs * (h - 2.0 * tf) * tw;
        let i1 = (b * h.powi(3) - (b - webs * tw) * (h - 2.0 * tf).powi(3)) / 12.0;
        let stiffness = [
            0.4 * shear * area,
            0.5 * shear * area,
            young * area,
            young * i1,
            young * i2,
            shear * torsion,
        ];
        Expected::new(stiffness, density * area, [i1, i2, i1 + i2].map(|i| density * i))
    };
    let (mid_b, mid_h) = (b - tw, h - tf);
    let clear = h - 2.0 * tf;
    let box_2 = (h * b.powi(3) - clear * (b - 2.0 * tw).powi(3)) / 12.0;
    let bredt = 4.0 * (mid_b * mid_h).powi(2) / (2.0 * mid_b / tf + 2.0 * mid_h / tw);
    let i_2 = (2.0 * tf * b.powi(3) + clear * tw.powi(3)) / 12.0;
    let open = |flange: f64| (2.0 * flange * tf.powi(3) + mid_h * tw.powi(3)) / 3.0;
    let area = 2.0 * b * tf + clear * tw;
    let x_c = (b * tf * b + 0.5 * clear * tw * tw) / area;
    let c_2 = (2.0 * tf * b.powi(3) + clear * tw.powi(3)) / 3.0 - area * x_c * x_c;
    let flange = b - 0.5 * tw;
    let behind = 3.0 * flange * flange * tf / (mid_h * tw + 6.0 * flange * tf);
    let channel = of(1.0, c_2, open(flange));
    let channel = channel.moved([0.0; 2], [0.5 * tw - behind - x_c, 0.0], [0.0; 2]);
    let cases = [
        case("centers", &table(centers), moved(stated())),
        case(
            "one centre, turned",
            &table("tension_center = [0.03, -0.02]\nangle = 0.3\n"),
            beside(stated().turned(0.3)),
        ),
        case("matrices", &matrices, general),
        case("viscosity", &table(&format!("damping = {}\n", rows(&damped.damping))), damped),
        case("box", &own(&walls("box"), ""), of(2.0, box_2, bredt)),
        case("i", &own(&walls("i"), ""), of(1.0, i_2, open(b))),
        case("channel", &own(&walls("channel"), ""), channel),
    ];
    cases.into_iter().flatten().chain([stations(), tapered(), load_at_place()]).collect()
}
