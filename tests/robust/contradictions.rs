//! Random mechanisms whose constraints need not be compatible: stretched chains of every kind of
//! joint, drives that disagree. Each is refused, or stopped, or ends with every constraint
//! satisfied, those among them that depend on others and are not enforced.

#![allow(clippy::unwrap_used)] // a test

use std::collections::BTreeMap;

use holonom::vi_constraints::Constraints;
use holonom::vi_core::Configuration;
use holonom::{Model, Simulation};
use vi_testkit::model::{AXES, between, body_at, hinge, joint};

/// Numbers in [−1, 1), the same in every run.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, count: usize) -> usize {
        ((0.5 * (self.next() + 1.0)) * count as f64) as usize % count
    }

    fn vector(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.next())
    }
}

type Vector = [f64; 3];

fn sum(a: &Vector, s: f64, b: &Vector) -> Vector {
    std::array::from_fn(|i| a[i] + s * b[i])
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(a: &Vector) -> Vector {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

/// What becomes of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Answer {
    Satisfied,
    Refused,
    Stopped,
}

/// Largest residual of a constraint relative to the sizes of what it sums.
fn violation(simulation: &Simulation, t: f64) -> f64 {
    let (mechanism, q) = (simulation.mechanism(), simulation.configuration());
    let m = mechanism.len();
    let (mut g, mut sizes) = (vec![0.0; m], vec![0.0; m]);
    // few steps of a small angle: no joint makes a revolution
    let angles = mechanism.principal_angles(q);
    let at = Configuration { t, q, angles: &angles, internal: &[] };
    mechanism.value(at, &mut g);
    mechanism.row_sizes(at, &mut sizes);
    let ratio = |(g, size): (&f64, &f64)| g.abs() / size;
    g.iter().zip(&sizes).map(ratio).fold(0.0, f64::max)
}

/// Runs a model for some steps; what becomes of it, in words. No answer may leave a constraint
/// violated.
fn answer(text: &str, step: f64, steps: u32) -> (Answer, String) {
    let refused = |error: holonom::ModelError| {
        let words = error.problems(text).iter().map(ToString::to_string).collect::<Vec<_>>();
        (Answer::Refused, words.join("; "))
    };
    let model = match Model::from_toml(text) {
        Ok(model) => model,
        Err(error) => return refused(error),
    };
    let mut simulation = match Simulation::new(&model) {
        Ok(simulation) => simulation,
        Err(error) => return refused(error),
    };
    for k in 1..=steps {
        if let Err(error) = simulation.step() {
            return (Answer::Stopped, format!("step {k}: {error}"));
        }
        let found = violation(&simulation, f64::from(k) * step);
        assert!(found < 1e-9, "step {k}: a constraint is violated by {found:e}\n{text}");
        assert!(simulation.configuration().iter().all(|q| q.is_finite()), "{text}");
    }
    (Answer::Satisfied, String::new())
}

const STEP: f64 = 0.01;

fn header(scheme: &str, gravity: f64, project: bool) -> String {
    format!(
        "[model]\nname = \"random\"\ngravity = [0.0, {gravity:?}, {gravity:?}]\n[simulation]\nstep = {STEP}\nend = 0.5\n\
         scheme = \"{scheme}\"\nproject_start = {project}\n"
    )
}

const SCHEMES: [&str; 7] =
    ["nodal", "reduced", "nodal", "constrained", "dalembert", "em-nodal", "em-constrained"];

/// A chain of links between two supports. `sag`: how far its joints are off the straight line.
fn chain(random: &mut Random, links: usize, sag: f64, scheme: &str) -> (String, &'static str) {
    let kind = ["revolute", "spherical", "universal", "distance", "bar", "mixed", "cylindrical"]
        [random.below(7)];
    let along = unit(&random.vector());
    let normal = unit(&cross(&along, &random.vector()));
    let across = cross(&normal, &along);
    let scale = [1.0, 1.0, 1e-3, 1e3][random.below(4)];
    let speed = [0.0, 1.0, 1e-4, 1e2][random.below(4)] * scale;
    let mut points = Vec::new(); // with their velocities
    let mut x = 0.0;
    for k in 0..=links {
        let ends = k == 0 || k == links;
        let off = if ends { 0.0 } else { sag * scale * random.next() };
        let v = if ends { 0.0 } else { speed * random.next() };
        points.push((sum(&along.map(|a| x * a), off, &across), across.map(|a| v * a)));
        x += scale * (0.6 + 0.4 * random.next());
    }
    let gravity = if random.below(2) == 0 { 0.0 } else { -9.81 };
    let mut text = header(scheme, gravity, sag > 0.0);
    if kind == "bar" {
        for (k, (x, v)) in points.iter().enumerate().take(links).skip(1) {
            text += &format!(
                "[[particle]]\nname = \"p{k}\"\nmass = 1.0\nposition = {x:?}\nvelocity = {v:?}\n"
            );
        }
        for k in 0..links {
            let name = |k: usize| format!("p{k}");
            let (from, to) = (name(k), name(k + 1));
            text += &match (k == 0, k + 1 == links) {
                (true, true) => String::new(),
                (true, _) => format!(
                    "[[bar]]\nname = \"s{k}\"\nfrom = \"ground\"\nto = \"{to}\"\npoint = {:?}\n",
                    points[0].0
                ),
                (_, true) => format!(
                    "[[bar]]\nname = \"s{k}\"\nfrom = \"{from}\"\nto = \"ground\"\npoint = {:?}\n",
                    points[links].0
                ),
                _ => format!("[[bar]]\nname = \"s{k}\"\nfrom = \"{from}\"\nto = \"{to}\"\n"),
            };
        }
        return (text, kind);
    }
    let half = if kind == "distance" { 0.25 } else { 0.0 }; // rods take the place of joints
    for k in 0..links {
        let (a, b) = (&points[k], &points[k + 1]);
        let (x, v) = (sum(&a.0, 1.0, &b.0), sum(&a.1, 1.0, &b.1));
        let d = sum(&b.0, -1.0, &a.0);
        let spin = cross(&d, &sum(&b.1, -1.0, &a.1)).map(|s| s / dot(&d, &d));
        let moment = 0.1 * scale * scale;
        text += &(body_at(x.map(|x| 0.5 * x), &format!("b{k}"), 1.0, [moment; 3])
            + &format!("velocity = {:?}\nangular_velocity = {spin:?}\n", v.map(|v| 0.5 * v)));
    }
    for k in 0..=links {
        let parent: String = if k == 0 { "ground".into() } else { format!("b{}", k - 1) };
        let child: String = if k == links { "ground".into() } else { format!("b{k}") };
        let (x, n) = (&points[k].0, &normal);
        let one = match kind {
            "mixed" => ["revolute", "spherical", "universal"][random.below(3)],
            "cylindrical" => ["revolute", "cylindrical"][usize::from(k == 1)],
            other => other,
        };
        text += &match one {
            "distance" => {
                let end = |k: usize, s: f64| {
                    let d = sum(&points[k + 1].0, -1.0, &points[k].0);
                    d.map(|d| s * half * d)
                };
                let from = if k == 0 { *x } else { end(k - 1, 1.0) };
                let to = if k == links { *x } else { end(k, -1.0) };
                between("constraint", &format!("j{k}"), [&parent, &child])
                    + &format!("type = \"distance\"\npoint_from = {from:?}\npoint_to = {to:?}\n")
            }
            other => {
                let axes = match other {
                    "spherical" => String::new(),
                    "universal" => format!("axis = {n:?}\naxis2 = {across:?}\n"),
                    _ => format!("axis = {n:?}\n"),
                };
                joint(other, &format!("j{k}"), [&parent, &child], *x) + &axes
            }
        };
    }
    (text, kind)
}

/// Counts the answers; the first words of each kind are printed.
#[derive(Default)]
struct Counts(BTreeMap<(String, Answer), (usize, String)>);

impl Counts {
    fn add(&mut self, kind: &str, (answer, words): (Answer, String)) {
        let entry = self.0.entry((kind.to_owned(), answer)).or_insert((0, words));
        entry.0 += 1;
    }

    fn of(&self, answer: Answer) -> usize {
        self.0.iter().filter(|(key, _)| key.1 == answer).map(|(_, found)| found.0).sum()
    }

    fn print(&self) {
        for ((kind, answer), (count, words)) in &self.0 {
            println!("{kind:12} {answer:?}: {count}  {words}");
        }
        let [satisfied, refused, stopped] =
            [Answer::Satisfied, Answer::Refused, Answer::Stopped].map(|answer| self.of(answer));
        println!(
            "{satisfied} with all constraints satisfied, {refused} refused, {stopped} stopped"
        );
    }
}

#[test]
fn stretched_chains_are_refused_or_stopped_or_satisfy_every_constraint() {
    let mut counts = Counts::default();
    for seed in 0..500 {
        let mut random = Random::new(seed + 1);
        let links = 2 + random.below(11);
        let sag = [0.0, 0.0, 0.0, 1e-9, 1e-5, 0.2][random.below(6)];
        let scheme = SCHEMES[random.below(SCHEMES.len())];
        let (text, kind) = chain(&mut random, links, sag, scheme);
        counts.add(kind, answer(&text, STEP, 10));
    }
    counts.print();
    assert!(counts.of(Answer::Refused) > 100);
}

/// A path that begins at zero: at rest or not, with jerk alone or without.
fn path(random: &mut Random) -> String {
    let (a, f) = (0.3 * random.next(), 0.5 + 2.0 * random.next().abs());
    let late = -a * std::f64::consts::TAU * f;
    match random.below(5) {
        0 => "{}".into(),
        1 => format!("{{ rate = {a:?} }}"),
        2 => format!("{{ acceleration = {a:?} }}"),
        3 => format!("{{ amplitude = {a:?}, frequency = {f:?} }}"),
        _ => format!("{{ amplitude = {a:?}, frequency = {f:?}, rate = {late:?} }}"),
    }
}

/// A loop of two links (locked), three or four, with drives and gears that need not agree.
fn driven(random: &mut Random, scheme: &str) -> (String, String) {
    let links = 1 + random.below(4);
    let mut text = header(scheme, -9.81, true);
    let mut points = vec![[0.0, 0.0]];
    for k in 1..=links {
        let turn = 1.2 - 2.4 * (k as f64 - 0.5) / links as f64 + 0.2 * random.next();
        let length = 0.8 + 0.2 * random.next();
        let last = points[k - 1];
        points.push([last[0] + length * turn.cos(), last[1] + length * turn.sin()]);
    }
    for k in 0..links {
        let (a, b) = (points[k], points[k + 1]);
        let (x, y) = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]));
        text += &body_at([x, y, 0.0], &format!("b{k}"), 1.0, [0.1; 3]);
    }
    let loose = usize::from(random.below(4) == 0); // an open chain
    let joints = links + 1 - loose;
    for k in 0..joints {
        let parent: String = if k == 0 { "ground".into() } else { format!("b{}", k - 1) };
        let child: String = if k == links { "ground".into() } else { format!("b{k}") };
        let [x, y] = points[k];
        text += &hinge(&format!("j{k}"), [&parent, &child], [x, y, 0.0], AXES[2]);
    }
    let drives = 1 + random.below(3);
    let mut kinds = Vec::new();
    for k in 0..drives {
        let joint = random.below(joints);
        text += &format!("[[constraint]]\nname = \"c{k}\"\n");
        match random.below(4) {
            0 if joints > 1 => {
                let other = (joint + 1 + random.below(joints - 1)) % joints;
                let ratio = [1.0, -1.0, -0.5, 2.0][random.below(4)];
                kinds.push("gear");
                text += &format!(
                    "type = \"gear\"\njoints = [\"j{joint}\", \"j{other}\"]\nratio = {ratio:?}\n"
                );
            }
            1 if links > 1 => {
                kinds.push("rod");
                text += "type = \"distance\"\nfrom = \"ground\"\nto = \"b1\"\npoint_from = [0.5, -1.0, 0.0]\n";
            }
            _ => {
                kinds.push("motion");
                text +=
                    &format!("type = \"motion\"\njoint = \"j{joint}\"\npath = {}\n", path(random));
            }
        }
    }
    kinds.sort_unstable();
    let shape = if loose == 1 { "open" } else { "loop" };
    (text, format!("{shape} of {links}, {}", kinds.join(" ")))
}

#[test]
fn drives_that_disagree_are_refused_or_stopped_or_satisfy_every_constraint() {
    let mut counts = Counts::default();
    for seed in 0..500 {
        let mut random = Random::new(1_000_000 + seed);
        let scheme = SCHEMES[random.below(SCHEMES.len())];
        let (text, kind) = driven(&mut random, scheme);
        counts.add(&kind, answer(&text, STEP, 10));
    }
    counts.print();
    assert!(counts.of(Answer::Refused) > 100 && counts.of(Answer::Satisfied) > 20);
}
