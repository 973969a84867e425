//! The pendulum of LMO08 §3.1: snapshots, energies, hidden constraints, geometry of the discrete
//! Legendre transforms. Letters as there: `p_n^∓`, `λ_n`, `h`.

use holonom::Model;
use holonom::report::{ChartAxis, Item, LabelSide, LineChart, Paint, Picture, Series, Strokes};
use holonom::vi_core::Energies;

use super::orbit::{Point, orbit};
use super::{Figure, Result, Section, curve, largest, span, with};

const FORCE: usize = 1; // colours
const SECANT: usize = 0;
const MOMENTUM: usize = 2;
const PROJECTED: usize = 3;

/// Without gravity: everything is known in closed form.
pub(super) fn free(model: &Model) -> Result<Section> {
    let fine = orbit(&with(model, &[("simulation.step", "0.1")])?, 100)?;
    let coarse = orbit(&with(model, &[("simulation.step", "0.8")])?, 13)?;
    let exact = |h: f64| 2.0 * (1.0 - (1.0 - h * h).sqrt()) / (h * h);
    let level = |k: usize| largest(fine.iter().map(|p| p.residuals[k]));
    let off = |points: &[Point], h: f64| largest(points.iter().map(|p| p.lambda[0] - exact(h)));
    let figures = vec![
        Figure::picture(
            "fig1_free_snapshots.svg",
            &snapshots(
                "Without gravity, h = 0.1 s: configurations and constraint forces",
                &fine[..32],
            ),
            format!(
                "Configurations and constraint forces −Gᵀλ. They point to the pivot and have one size: \
                 λ_n = 2(1 − √(1 − h²))/h² at every node, the first included. Largest deviation \
                 from that in 100 steps of h = 0.1 s: {:.1e} N/m; in 13 steps of h = 0.8 s: {:.1e} N/m.",
                off(&fine, 0.1),
                off(&coarse, 0.8)
            ),
        )?,
        Figure::panels(
            "fig2_free_energies.svg",
            &free_energies(&fine, &coarse),
            format!(
                "Both energies are constant, and all kinetic: the potential parts are zero. H_d = ½ J \
                 (largest deviation at both steps {:.1e} J); E_d lies above it, (1 − √(1 − h²))/h² J: \
                 {:.6} J for h = 0.1 s, {:.6} J for h = 0.8 s, constant within {:.1e} J.",
                largest(fine.iter().chain(&coarse).map(|p| p.hamiltonian.total() - 0.5)),
                fine[0].discrete_energy.total(),
                coarse[0].discrete_energy.total(),
                largest(fine.iter().map(|p| p.discrete_energy.total() - 0.5 * exact(0.1)))
            ),
        )?,
        Figure::chart(
            "fig2_free_hidden_constraints.svg",
            &hidden("no gravity", &fine),
            format!(
                "Without gravity the momentum is tangential: constraints of positions ({:.1e} m²), of velocities (45) \
                 ({:.1e} m²/s) and of momenta (46) with p_n ({:.1e} m²/s) hold to round-off. Values of zero are not drawn.",
                level(0),
                level(1),
                level(2)
            ),
        )?,
        Figure::picture(
            "fig3_legendre_free.svg",
            &legendre("Discrete Legendre transforms, no gravity, h = 0.8 s", &coarse[..3], 0.5),
            "The two secants are D₂L_d(qₙ₋₁, qₙ) and −D₁L_d(qₙ, qₙ₊₁). Half of the \
             constraint impulse each, ∓½G_dᵀλ, brings both to the same momentum p_n; without \
             gravity it is tangential, so it is its own projection ᵠp_n = Q p_n."
                .into(),
        )?,
    ];
    let words = "A point mass of 1 kg on a massless rod of 1 m, started at (1, 0) m with 1 m/s \
                 (`examples/models/pendulum_free.toml`)."
        .into();
    Ok(Section { heading: "Pendulum without gravity (Figs. 1–3)", words, figures })
}

/// With gravity: energies oscillate, the momentum level is met to second order.
pub(super) fn gravity(model: &Model) -> Result<Section> {
    let coarse = orbit(&with(model, &[("simulation.step", "0.1")])?, 100)?;
    let fine = orbit(&with(model, &[("simulation.step", "0.05")])?, 200)?;
    let levels = |points: &[Point]| {
        let worst = |of: fn(&Point) -> f64| largest(points.iter().map(of));
        [worst(|p| p.residuals[0]), worst(|p| p.residuals[1]), worst(|p| p.residuals[2])]
    };
    let [position, velocity, momentum] = levels(&coarse);
    let spans = |points: &[Point]| {
        let of = |energy: fn(&Point) -> Energies| span(points.iter().map(|p| energy(p).total()));
        (of(|p| p.hamiltonian), of(|p| p.discrete_energy))
    };
    let ((h, e), (h_fine, e_fine)) = (spans(&coarse), spans(&fine));
    let figures = vec![
        Figure::picture(
            "fig4_gravity_snapshots.svg",
            &snapshots("With gravity, h = 0.1 s: configurations and constraint forces", &coarse[..13]),
            "Half a swing from rest. The constraint force −Gᵀλ points to the pivot and is largest at \
             the bottom."
                .into(),
        )?,
        Figure::panels(
            "fig5_gravity_energies.svg",
            &gravity_energies(&coarse, &fine),
            format!(
                "Kinetic and potential parts exchange up to {:.1} J. The totals of both \
                 energies oscillate with opposite signs and without a trend, at h = 0.1 s: H_d within \
                 [{:.3}, {:.3}] J, E_d within [{:.3}, {:.3}] J; at h = 0.05 s: H_d within \
                 [{:.3}, {:.3}] J, E_d within [{:.3}, {:.3}] J.",
                largest(coarse.iter().map(|p| p.discrete_energy.kinetic)),
                h.0, h.1, e.0, e.1, h_fine.0, h_fine.1, e_fine.0, e_fine.1
            ),
        )?,
        Figure::chart(
            "fig4_gravity_hidden_constraints.svg",
            &hidden("with gravity", &coarse),
            format!(
                "Constraints at three levels: of positions g(q_n) (largest {position:.1e} m²) and \
                 of velocities (45) ({velocity:.1e} m²/s) at round-off, of momenta (46) with p_n \
                 not: {momentum:.3} m²/s at h = 0.1 s, {:.3} m²/s at h = 0.05 s — second order in \
                 h. Values of zero are not drawn.",
                levels(&fine)[2]
            ),
        )?,
        Figure::picture(
            "fig6_legendre_gravity.svg",
            &legendre("Discrete Legendre transforms with gravity, h = 0.1 s", &coarse[4..7], 0.25),
            format!(
                "As in Fig. 3: p_n is tangential only to second order, its projection ᵠp_n = Q p_n \
                 always. At the node drawn |G M⁻¹ p_n| = {:.3} m²/s.",
                coarse[5].residuals[2]
            ),
        )?,
    ];
    let words = "The same pendulum released at rest from the horizontal, γ = (0, −9.81) m/s² \
                 (`examples/models/pendulum.toml` with `--step 0.1`)."
        .into();
    Ok(Section { heading: "Pendulum with gravity (Figs. 4–6)", words, figures })
}

/// The total and its parts, each in a panel of its own: without gravity curves of one energy
/// coincide.
fn free_energies(fine: &[Point], coarse: &[Point]) -> Vec<LineChart> {
    let parts: [(&str, fn(Energies) -> f64); 3] = [
        ("total", |e| e.total()),
        ("kinetic part", |e| e.kinetic),
        ("potential part", |e| e.potential),
    ];
    let panel = |(part, of): (&str, fn(Energies) -> f64)| {
        let discrete = move |p: &Point| (p.t, of(p.discrete_energy));
        energy_chart(
            format!("No gravity: {part}"),
            vec![
                curve("H_d, both steps", coarse.iter().map(|p| (p.t, of(p.hamiltonian)))),
                curve("E_d, h = 0.1 s", fine.iter().map(discrete)),
                curve("E_d, h = 0.8 s", coarse.iter().map(discrete)),
            ],
        )
    };
    parts.map(panel).into()
}

/// The totals, then each energy at each step in its parts.
fn gravity_energies(coarse: &[Point], fine: &[Point]) -> Vec<LineChart> {
    let energies: [(&str, fn(&Point) -> Energies); 2] =
        [("H_d", |p| p.hamiltonian), ("E_d", |p| p.discrete_energy)];
    let runs = [("0.1", coarse), ("0.05", fine)];
    let mut totals = Vec::new();
    let mut panels = Vec::new();
    for (h, points) in runs {
        for (name, energy) in energies {
            let of = |part: fn(Energies) -> f64| points.iter().map(move |p| (p.t, part(energy(p))));
            totals.push(curve(&format!("{name}, h = {h} s"), of(|e| e.total())));
            let curves = vec![
                curve("total", of(|e| e.total())),
                curve("kinetic part", of(|e| e.kinetic)),
                curve("potential part", of(|e| e.potential)),
            ];
            panels.push(energy_chart(format!("{name} with gravity, h = {h} s"), curves));
        }
    }
    panels.insert(0, energy_chart("Totals with gravity".into(), totals));
    panels
}

fn energy_chart(title: String, curves: Vec<Series>) -> LineChart {
    LineChart {
        title,
        x: ChartAxis::time(),
        y: ChartAxis::linear("energy", "J"),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves,
    }
}

/// Residuals at three levels at h = 0.1 s.
fn hidden(which: &str, points: &[Point]) -> LineChart {
    let level =
        |name: &str, of: fn(&Point) -> f64| curve(name, points.iter().map(|p| (p.t, of(p))));
    LineChart {
        title: format!("Constraints at three levels, {which}, h = 0.1 s"),
        x: ChartAxis::time(),
        y: ChartAxis::logarithmic("residual", "SI"),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves: vec![
            level("position", |p| p.residuals[0]),
            level("velocity", |p| p.residuals[1]),
            level("momentum", |p| p.residuals[2]),
        ],
    }
}

fn at(q: &[f64]) -> [f64; 2] {
    [q[0], q[1]]
}

/// `q + scale · x`.
fn beside(q: &[f64], x: &[f64], scale: f64) -> [f64; 2] {
    [q[0] + scale * x[0], q[1] + scale * x[1]]
}

fn circle(from: f64, to: f64) -> Item {
    let angle = |k: i32| from + (to - from) * f64::from(k) / 180.0;
    let points = (0..=180).map(|k| [angle(k).cos(), angle(k).sin()]).collect();
    Item::Line(points, Paint::Ink(0.35), 1.0)
}

/// Rods, bobs and constraint forces `−Gᵀλ`, the longest drawn as 0.6 m.
fn snapshots(title: &str, points: &[Point]) -> Picture {
    let size = |p: &Point| p.force[0].hypot(p.force[1]);
    let scale = 0.6 / largest(points.iter().map(size));
    let (low, high) = span(points.iter().map(|p| p.q[1]));
    let full = low < -0.5 && high > 0.5;
    let mut items = vec![if full {
        circle(0.0, std::f64::consts::TAU)
    } else {
        circle(-std::f64::consts::PI, 0.0)
    }];
    let rod = |p: &Point| Item::Line(vec![[0.0, 0.0], at(&p.q)], Paint::Ink(0.25), 1.0);
    items.extend(points.iter().map(rod));
    let force = |p: &Point| {
        let to = beside(&p.q, &p.force, -scale);
        Item::Arrow([at(&p.q), to], Paint::Curve(FORCE, 1.0))
    };
    items.extend(points.iter().map(force));
    items.extend(points.iter().map(|p| Item::Dot(at(&p.q), Paint::Curve(SECANT, 1.0), 4.0)));
    items.push(Item::Dot([0.0, 0.0], Paint::Ink(1.0), 4.0));
    Picture { title: title.to_owned(), width: 640.0, items }
}

/// At the middle one of three nodes: both unconstrained transforms, the constraint's halves, `p_n`
/// and its projection; `scale`: metres drawn for 1 kg·m/s.
fn legendre(title: &str, points: &[Point], scale: f64) -> Picture {
    let [before, n, next] = points else {
        return Picture { title: title.into(), width: 640.0, items: vec![] };
    };
    let mut items = Vec::new();
    let angles = points.iter().map(|p| p.q[1].atan2(p.q[0]));
    let (low, high) = span(angles);
    items.push(circle(low - 0.3, high + 0.3));
    for (p, name) in [(before, "qₙ₋₁"), (n, "qₙ"), (next, "qₙ₊₁")] {
        items.push(Item::Dot(at(&p.q), Paint::Ink(0.8), 5.0));
        items.push(Item::Words(at(&p.q), Paint::Ink(0.8), name.into(), LabelSide::Right));
    }
    let q = &n.q;
    let mut arrow = |x: &[f64], color: usize, name: &str| {
        let tip = beside(q, x, scale);
        let side = if x[0] > 0.0 { LabelSide::Right } else { LabelSide::Left };
        items.push(Item::Arrow([at(q), tip], Paint::Curve(color, 1.0)));
        items.push(Item::Words(tip, Paint::Curve(color, 1.0), name.into(), side));
        tip
    };
    let p = arrow(&n.p, MOMENTUM, "pₙ");
    let secants =
        [arrow(&n.d2, SECANT, "D₂L_d(qₙ₋₁, qₙ)"), arrow(&n.minus_d1, SECANT, "−D₁L_d(qₙ, qₙ₊₁)")];
    let skew = largest(n.p.iter().zip(&n.p_projected).map(|(a, b)| a - b));
    if skew > 1e-3 {
        arrow(&n.p_projected, PROJECTED, "");
    }
    items.extend(secants.map(|tip| Item::Arrow([tip, p], Paint::Curve(FORCE, 1.0))));
    Picture { title: title.to_owned(), width: 640.0, items }
}
