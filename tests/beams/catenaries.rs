//! Ropes that start straight: slack, taut, between unequal heights, with a load; beams that are
//! stressed as drawn.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use holonom::modes::{About, ModalAnalysis, ModeKind};
use holonom::run::prepare;
use holonom::{RunOutcome, Sample, Simulation};
use std::f64::consts::{PI, TAU};

/// A rope of the length `L` under the weight `w` per length from the origin to `(x, z)`, with a
/// force down in its middle.
#[derive(Clone, Copy, Debug)]
struct Rope {
    length: f64,    // m
    weight: f64,    // N/m
    stiffness: f64, // EA, N
    end: [f64; 2],  // m
    load: f64,      // N
}

impl Rope {
    /// `(x, z)` at the arc length `s` of a rope that begins with the forces `(H, V)`:
    ///
    /// ```text
    /// x = H s/EA + (H/w) [asinh(V/H)],   z = (V s + ½ w s²)/EA + (1/w) [√(H² + V²)],   V ↦ V + w s
    /// ```
    ///
    /// Source: H. M. Irvine, Cable Structures, MIT Press 1981, section 1.3.
    fn at(&self, [h, v]: [f64; 2], s: f64) -> [f64; 2] {
        let Self { weight: w, stiffness, .. } = *self;
        let part = |v: f64, l: f64| {
            let end = v + w * l;
            let x = h * l / stiffness + h / w * ((end / h).asinh() - (v / h).asinh());
            let z = (v * l + 0.5 * w * l * l) / stiffness + (h.hypot(end) - h.hypot(v)) / w;
            ([x, z], end)
        };
        let half = 0.5 * self.length;
        if s <= half {
            return part(v, s).0;
        }
        let ([x, z], v) = part(v, half);
        let ([dx, dz], _) = part(v + self.load, s - half);
        [x + dx, z + dz]
    }

    /// The forces `(H, V)` at the start with which it ends where it should: `z` rises with `V`, and
    /// with that `x` with `H`.
    fn forces(&self) -> [f64; 2] {
        let halved = |mut low: f64, mut high: f64, too_low: &dyn Fn(f64) -> bool| {
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if too_low(middle) { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let most = 1e3 * (self.weight * self.length + self.load);
        let vertical =
            |h: f64| halved(-most, most, &|v| self.at([h, v], self.length)[1] < self.end[1]);
        let h =
            halved(1e-9 * most, most, &|h| self.at([h, vertical(h)], self.length)[0] < self.end[0]);
        [h, vertical(h)]
    }

    /// Ropes from the origin to its end, one, or two that a load joins, drawn straight.
    fn text(&self, elements: usize) -> String {
        let Self { length, weight, stiffness, end: [x, z], load } = self;
        let beam = |name: &str, ends: [[f64; 2]; 2], part: f64, held: &str| {
            let [[a, b], [c, d]] = ends;
            format!(
                "[[beam]]\nname = \"{name}\"\npoints = [[{a:?}, 0.0, {b:?}], [{c:?}, 0.0, {d:?}]]\n\
                 length = {:?}\nelements = {}\nelement = \"rope\"\n{held}\
                 section = {{ EA = {stiffness:?}, EI1 = 1e-3, EI2 = 1e-3, GJ = 1e-3, \
                 rhoA = {:?}, rhoI1 = 1e-6, rhoI2 = 1e-6 }}\n",
                part * length,
                (part * elements as f64) as usize,
                weight / 9.81,
            )
        };
        let head = "[model]\nname = \"rope\"\ngravity = [0.0, 0.0, -9.81]\n[simulation]\n\
                    step = 0.01\nend = 0.05\nstart = \"relaxed\"\n";
        let (whole, middle) = ([[0.0, 0.0], [*x, *z]], [0.5 * x, 0.5 * z]);
        if *load == 0.0 {
            let held = "start = \"pinned\"\nend = \"pinned\"\n";
            return [head, &beam("a", whole, 1.0, held)].concat();
        }
        let [x, z] = middle;
        let joint = |rope: &str| {
            format!(
                "[[joint]]\nname = \"on_{}\"\ntype = \"spherical\"\nparent = \"{rope}\"\n\
                 child = \"load\"\nposition = [{x:?}, 0.0, {z:?}]\n",
                rope.replace('.', "_"),
            )
        };
        [
            head,
            &beam("a", [whole[0], middle], 0.5, "start = \"pinned\"\n"),
            &beam("b", [middle, whole[1]], 0.5, "end = \"pinned\"\n"),
            &format!("[[body]]\nname = \"load\"\nmass = {:?}\n", load / 9.81),
            &format!("inertia = [0.01, 0.01, 0.01]\nposition = [{x:?}, 0.0, {z:?}]\n"),
            &joint("a.end"),
            &joint("b.start"),
        ]
        .concat()
    }

    /// The largest distance of its nodes from the closed form at the start, and from where they
    /// started in a run, m.
    fn missed(&self, elements: usize) -> [f64; 2] {
        let mut simulation = Simulation::new(&model(&self.text(elements), &[])).unwrap();
        let names: Vec<_> = simulation.members().iter().map(|member| member.name.clone()).collect();
        let found = samples(&mut simulation);
        let (forces, mut off) = (self.forces(), [0.0_f64; 2]);
        let mut nodes = 0;
        for (k, name) in names.iter().enumerate() {
            let Some((rope, node)) = name.split_once('.') else { continue };
            nodes += 1;
            let half = if rope == "b" { elements / 2 } else { 0 };
            let s = self.length * (half + node.parse::<usize>().unwrap()) as f64 / elements as f64;
            let right = self.at(forces, s);
            let place = |q: &[f64]| [q[12 * k], q[12 * k + 2], q[12 * k + 1]];
            let [x, z, y] = place(&found[0].q);
            off[0] = off[0].max((x - right[0]).hypot(z - right[1]).hypot(y));
            let last = place(&found.last().unwrap().q);
            off[1] = off[1].max((x - last[0]).hypot(z - last[1]));
        }
        assert!(nodes > elements, "{nodes}");
        off
    }
}

/// The elastic catenary, to a part of the length, with 20 elements and with half of them; what is
/// relaxed stays.
#[test]
fn a_straight_rope_relaxes_to_its_catenary() {
    let rope = Rope { length: 11.0, weight: 9.81, stiffness: 1e5, end: [10.0, 0.0], load: 0.0 };
    let all = [
        ("slack", rope, 1e-5),
        ("twice as long", Rope { length: 20.0, ..rope }, 2e-3),
        ("taut", Rope { length: 9.99, ..rope }, 1e-5),
        ("stiff", Rope { stiffness: 1e9, ..rope }, 1e-5),
        ("soft", Rope { stiffness: 1e3, ..rope }, 4e-4),
        ("to a height", Rope { length: 13.0, end: [10.0, 4.0], ..rope }, 1e-4),
        ("down", Rope { length: 12.0, end: [6.0, -7.0], ..rope }, 4e-4),
        ("loaded", Rope { length: 10.5, load: 500.0, ..rope }, 1e-5),
        ("loaded, to a height", Rope { length: 12.0, end: [9.0, 4.0], load: 50.0, ..rope }, 3e-4),
    ];
    for (name, rope, bound) in all {
        let [coarse, fine] = [10, 20].map(|count| rope.missed(count));
        let [h, v] = rope.forces();
        println!(
            "{name}: H = {h:.2} N, V = {v:.2} N; 10 elements {:.1e} m, 20 {:.1e} m; moves {:.1e} m",
            coarse[0], fine[0], fine[1]
        );
        assert!(fine[0] < bound && fine[0] < coarse[0], "{name}: {coarse:?}, {fine:?}");
        // the rounding error of forces is that of EA
        assert!(fine[1] < 1e-14 * rope.stiffness.max(1e5) * rope.length, "{name}: {fine:?}");
    }
}

/// A straight strip whose ends are clamped in each other: the moment `EI/R` everywhere, and without
/// it where the strip is free of stress as a ring.
#[test]
fn a_ring_of_a_straight_strip_has_its_moment() {
    let radius = 0.5;
    let ring = |extra: &str| {
        let text = format!(
            "[model]\nname = \"ring\"\n[simulation]\nscheme = \"static\"\nstep = 1.0\nend = 1.0\n\
             [[beam]]\nname = \"ring\"\nelements = 12\nnormal = [0.0, 0.0, 1.0]\n{extra}\
             section = {{ EA = 1e5, GA1 = 4e4, GA2 = 4e4, EI1 = 3.0, EI2 = 2.0, GJ = 1.5, rhoA = 0.1, rhoI1 = 1e-6, rhoI2 = 1e-6 }}\n\
             start = \"clamped\"\nend = \"clamped\"\n\
             [beam.curve]\ntype = \"arc\"\nfrom = [{radius}, 0.0, 0.0]\ncenter = [0.0, 0.0, 0.0]\n\
             axis = [0.0, 0.0, 1.0]\nangle = {TAU}\n\
             [[sensor]]\nname = \"m\"\ntype = \"section_force\"\nof = \"ring\"\nelement = 5\n"
        );
        let mut last = Vec::new();
        let mut keep = |sample: &Sample| {
            last.clone_from(&sample.sensors);
            Ok(())
        };
        let mut run = prepare(&model(&text, &[])).unwrap();
        assert_eq!(run.run(&mut keep, &mut |_, _| {}).unwrap(), RunOutcome::Done);
        last
    };
    let drawn = ring("");
    let straight = ring("curvature = [0.0, 0.0, 0.0]\n");
    let tighter = ring("curvature = [3.0, 0.0, 0.0]\n");
    println!("drawn {drawn:?}\nstraight {straight:?}\ntighter {tighter:?}");
    let [m1, m2] = [3, 4].map(|k| straight[k]);
    assert!(drawn.iter().all(|x| x.abs() < 1e-9), "{drawn:?}");
    // d_1 along z: the ring is bent about d_1
    assert!((m1 - 3.0 / radius).abs() < 1e-9 && m2.abs() < 1e-9, "{straight:?}");
    assert!((tighter[3] - 3.0 * (1.0 / radius - 3.0)).abs() < 1e-9, "{tighter:?}");
}

/// `ω_n = (nπ/L) √(N/ρA) √(1 + EI (nπ/L)²/N)` of a pinned string whose tension is stated, or that
/// of its stress-free length.
#[test]
fn a_prestressed_string_has_its_frequencies() {
    let (tension, line, bending, length) = (80.0, 0.004, 1e-3, 0.65);
    for stated in ["prestress = 80.0", "length = 0.6494804156674661"] {
        let text = format!(
            "[model]\nname = \"string\"\n[simulation]\nstep = 1e-4\nend = 1e-3\n\
             [[beam]]\nname = \"string\"\npoints = [[0.0, 0.0, 0.0], [{length}, 0.0, 0.0]]\n\
             elements = 16\nstart = \"pinned\"\nend = \"pinned\"\n{stated}\n\
             section = {{ EA = 1e5, EI1 = {bending}, EI2 = {bending}, GJ = 1e-3, rhoA = {line}, \
             rhoI1 = 1e-11, rhoI2 = 1e-11 }}\n"
        );
        let mut report = ModalAnalysis::new(&model(&text, &[]), About::Static).unwrap();
        let report = report.modes(10).unwrap();
        let found = report.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
        let found: Vec<f64> = found.map(|mode| mode.omega).collect();
        assert!(report.unstable == 0 && found.len() >= 8, "{found:?}");
        for (n, pair) in (1..).zip(found.chunks_exact(2)).take(4) {
            let k = PI * f64::from(n) / length;
            let right = k * ((tension + bending * k * k) / line).sqrt();
            println!("{stated}: {:.4} and {right:.4} rad/s", pair[0]);
            for omega in pair {
                assert!((omega / right - 1.0).abs() < 2e-3, "{omega} and {right}");
            }
        }
    }
}
