//! Schemes, orders, quadratures and strains: linear vibrations in closed form, energies that are
//! exact, condition numbers.

use super::{Case, Checks, Run};
use crate::statics::static_models::ARCH;
use holonom::Simulation;
use holonom::nalgebra::Vector3;
use holonom::vi_multibody::run::Solver;
use vi_testkit::model::{
    beam, between, body_at, head, heavy, joint, section, sensor, soft_section,
};

type Vector = Vector3<f64>;

const STIFFNESS: f64 = 50.0;
const MASS: f64 = 2.0; // ω = 5 rad/s

/// A point mass on a spring without length: a linear vibration about the origin.
fn vibration(settings: &str, step: f64) -> String {
    format!(
        r#"
model = {{ name = "vibration" }}
simulation = {{ step = {step:?}, end = 1.0, {settings} }}
particle = [{{ name = "ball", mass = {MASS:?}, position = [0.3, -0.2, 0.5] }}]
spring = [{{ name = "cord", from = "ground", to = "ball", stiffness = {STIFFNESS:?}, natural_length = 0.0 }}]
"#
    )
}

/// The vibration advances by `angle` in each step.
fn turning(name: &str, settings: &str, step: f64, angle: f64) -> Case {
    Case::new(name, vibration(settings, step), move |run: &Run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let x = Vector::new(0.3, -0.2, 0.5) * (angle * run.nodes[node].step as f64).cos();
            checks.vector("place", run.place("ball", node), x, 1e-11);
        }
        checks.near("nodes", run.steps() as f64, 1.0 + (1.0 / step).round(), 0.1);
        checks
    })
    .settings()
    .only("simulation")
}

/// Of the rule of the midpoint on a step `x = h ω`.
fn midpoint(x: f64) -> f64 {
    2.0 * (0.5 * x).atan()
}

fn orders() -> Vec<Case> {
    let x = 5.0 * 0.1;
    let suzuki = 1.0 / (4.0 - 4.0_f64.cbrt());
    let others = "simulation.scheme";
    let same = "the same motion by every variational scheme, and by energy–momentum schemes of a linear system";
    let strain = "no beams";
    let quiet = |case: Case| {
        let keys = ["simulation.solver", "simulation.strain"];
        keys.into_iter().fold(case.blind(others, same), |case, key| case.blind(key, strain))
    };
    vec![
        quiet(
            turning("midpoint", "order = 2", 0.1, midpoint(x))
                .blind("simulation.order", "dropped: its default"),
        ),
        quiet(turning(
            "trapezoidal",
            "quadrature = \"trapezoidal\"",
            0.1,
            (1.0 - 0.5 * x * x).acos(),
        )),
        quiet(turning(
            "composition",
            "order = 4",
            0.1,
            4.0 * midpoint(suzuki * x) + midpoint((1.0 - 4.0 * suzuki) * x),
        )),
        // the diagonal Padé approximation of e^{ix}
        quiet(turning(
            "polynomials",
            "order = 4, method = \"galerkin\"",
            0.1,
            2.0 * (0.5 * x / (1.0 - x * x / 12.0)).atan(),
        )),
    ]
}

fn pendulum() -> String {
    body_at([0.5, 0.0, 0.0], "bar", 2.0, [0.1, 0.2, 0.25])
        + &joint("spherical", "hinge", ["ground", "bar"], [0.0; 3])
        + &between("spring", "cord", ["ground", "bar"])
        + "point_from = [0.0, 0.0, 1.0]\nstiffness = 50.0\nnatural_length = 0.0\n"
}

/// `log₂` of what half the step makes of the condition number of the Newton matrix as written.
fn exponent(run: &Run) -> Option<f64> {
    let condition = |step: f64| {
        let mut model = run.model.clone();
        model.settings.step = step;
        let mut simulation = Simulation::new(&model).ok()?;
        simulation.step().ok()?;
        simulation.condition().map(|condition| condition.as_written)
    };
    Some((condition(5e-5)? / condition(1e-4)?).log2())
}

/// A scheme by the growth of its condition number with the step, (22), (25), (28), (30), and by
/// what it does with the energy.
fn scheme(name: &str, growth: f64) -> Case {
    let text = heavy(
        "pendulum",
        [0.0, -3.0, -9.81],
        &format!("step = 0.02, end = 0.4, scheme = \"{name}\", solver = \"dense\""),
    ) + &pendulum();
    let exact = name.starts_with("em-");
    let case = Case::new(format!("scheme {name}"), text, move |run: &Run| {
        let mut checks = Checks::default();
        let first = run.nodes[0].hamiltonian;
        let off = run.nodes.iter().map(|node| (node.hamiltonian - first).abs()).fold(0.0, f64::max);
        if exact {
            checks.near("energy", off, 0.0, 1e-11);
        } else {
            checks.near("energy", off.log10(), -3.0, 2.5);
        }
        match exponent(run) {
            Some(found) => checks.near("growth of the condition number", found, growth, 0.2),
            None => checks.holds("a matrix", false),
        }
        checks
    });
    case.settings()
        .only("simulation.s")
        .blind("simulation.step", "of any step")
        .blind("simulation.strain", "no beams")
        .blind("simulation.solver", "of dense matrices or sparse ones")
        .blind_if(
            growth == 0.0 && !exact,
            "simulation.scheme",
            "`reduced` and `nodal` have one motion and one growth",
        )
}

/// Solvers give one motion to round-off: the one that is named is known by its bits.
fn solver(name: &str, named: Solver) -> Case {
    let link = |k: usize, parent: &str| {
        let (name, pivot, x) = (format!("b{k}"), format!("j{k}"), k as f64);
        body_at([x + 0.5, 0.3, 0.0], &name, 1.3, [0.1, 0.2, 0.25])
            + &joint("spherical", &pivot, [parent, &name], [x, 0.0, 0.0])
    };
    let text = [
        heavy(
            "chain",
            [0.0, -3.0, -9.81],
            &format!(
                "step = 0.02, end = 0.6, method = \"galerkin\", order = 4, solver = \"{name}\""
            ),
        ),
        link(0, "ground"),
        link(1, "b0"),
        link(2, "b1"),
    ]
    .concat();
    Case::new(format!("solver {name}"), text, move |run: &Run| {
        let mut checks = Checks::default();
        let mut simulation = Simulation::with_solver(&run.model, named).unwrap();
        let last = simulation.samples().last().unwrap().unwrap();
        checks.all("motion", &run.nodes[run.last()].q, &last.q, 1e-9);
        checks.holds("its bits", run.nodes[run.last()].q == last.q);
        checks
    })
    .settings()
    .only("simulation.solver")
}

/// Equilibria of a hanging weight along the load.
fn statics() -> Case {
    let text = include_str!("../../models/static_weight.toml");
    Case::new("statics", text, |run: &Run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let t = run.t(node);
            let z = -(20.0 + 15.0 * t) / 50.0;
            checks.vector("place", run.place("ball", node), Vector::new(0.1, 0.0, z), 1e-9);
            checks.near("car", run.place("car", node).x, 0.3, 1e-9);
        }
        checks.near("last", run.t(run.last()), 1.0, 1e-12);
        checks.near("rows", run.steps() as f64, 5.0, 0.1);
        checks
    })
    .settings()
    .only("simulation")
}

/// A shallow arch of two bars, beyond its limit point.
fn arc_length() -> Case {
    let text = ARCH.replace("scheme = \"static\"", "scheme = \"static\"\narc_length = true");
    Case::new("arc length", text, |run: &Run| {
        let mut checks = Checks::default();
        let rest = (1.0_f64 + 0.0625).sqrt();
        let exact = |y: f64| 2e4 / rest * (rest / (1.0 + y * y).sqrt() - 1.0) * y;
        let height = run.column("height.y");
        for node in 0..run.steps() {
            checks.near("load", 100.0 * run.t(node), exact(height[node]), 1e-5);
        }
        let least = (0..run.steps()).map(|node| run.t(node)).fold(0.0, f64::min);
        checks.holds("the load falls", least < -0.1);
        checks
    })
    .settings()
    .only("simulation.arc_length")
}

/// One element that vibrates along its axis, in steps that hardly resolve it.
fn averaged() -> Case {
    let text = heavy("rod", [10.0, 0.0, 0.0], "step = 0.02, end = 0.4, strain = \"averaged\"")
        + &beam("rod", &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 1)
        + "normal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\n"
        + &soft_section();
    Case::new("averaged strains", text, |run: &Run| {
        let mut checks = Checks::default();
        let (still, omega) = (0.05 * 10.0 / 90.0, (90.0 / (0.1 / 3.0_f64)).sqrt());
        let angle = midpoint(0.02 * omega);
        for node in 0..run.steps() {
            let x = 1.0 + still * (1.0 - (angle * node as f64).cos());
            checks.near("tip", run.place("rod.1", node).x, x, 1e-11);
        }
        checks
    })
    .settings()
    .only("simulation.strain")
    .blind(
        "simulation.strain",
        "along the axis the strain of the mean is the mean of the strains: see the rotating rod",
    )
}

/// A rigid rotation in large steps: the strain of the mean of two configurations is not zero there.
fn rotating(strain: &str) -> Case {
    let text = [
        head("rod", &format!("step = 0.02, end = 0.2, strain = \"{strain}\"")),
        beam("rod", &[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], 1),
        "normal = [0.0, 0.0, 1.0]\nvelocity = [0.0, -1.5, 0.0]\n".into(),
        "angular_velocity = [0.0, 0.0, 3.0]\n".into(),
        section([1e4, 1e4, 1e4, 1e2, 1e2, 1e2], [0.1, 1e-3, 1e-3]),
    ]
    .concat();
    let midpoint = strain == "midpoint";
    let dissipative = strain == "dissipative";
    Case::new(format!("strains of a rotation, {strain}"), text, move |run: &Run| {
        let mut checks = Checks::default();
        let length = |node| (run.place("rod.1", node) - run.place("rod.0", node)).norm();
        let stretch = (0..run.steps()).map(|node| (length(node) - 1.0).abs()).fold(0.0, f64::max);
        // h ω / 2 = 0.03: the mean is shorter by 4.5e-4
        if midpoint {
            checks.near("stretch", stretch.log10(), -3.2, 0.5);
        } else {
            checks.near("stretch", stretch, 0.0, 5e-5);
        }
        let lost = run.energy("work_of_algorithmic_dissipation");
        checks.holds("dissipation", lost[run.last()].is_nan() != dissipative);
        checks
    })
    .settings()
    .only("simulation.strain")
    .blind_if(!midpoint, "simulation.strain", "a rigid rotation is free of strain")
}

/// A weight that begins in its equilibrium.
fn relaxed() -> Case {
    let text = format!(
        r#"
model = {{ name = "hanging", gravity = [0.0, 0.0, -10.0] }}
simulation = {{ step = 0.01, end = 0.1, start = "relaxed" }}
particle = [{{ name = "ball", mass = 2.0, position = [0.0, 0.0, -0.4] }}]
spring = [{{ name = "cord", from = "ground", to = "ball", stiffness = 50.0, natural_length = 0.1 }}]
{}"#,
        sensor("cord_length", "length", "cord")
    );
    Case::new("relaxed start", text, |run: &Run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            checks.near("length", run.sensor("cord_length", node), 0.1 + 20.0 / 50.0, 1e-9);
        }
        checks
    })
    .settings()
    .only("simulation.start")
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = orders();
    let growths = [("constrained", 3.0), ("dalembert", 1.0), ("reduced", 0.0), ("nodal", 0.0)];
    cases.extend(growths.map(|(name, growth)| scheme(name, growth)));
    let em = [("em-constrained", 3.0), ("em-dalembert", 1.0), ("em-nodal", 0.0)];
    cases.extend(em.map(|(name, growth)| scheme(name, growth)));
    cases.extend([
        solver("dense", Solver::Dense),
        solver("articulated", Solver::Articulated)
            .blind("simulation.solver", "what is fastest for a tree of bodies"),
        solver("sparse", Solver::Sparse),
    ]);
    cases.extend([statics(), arc_length(), averaged(), relaxed()]);
    cases.extend(["midpoint", "averaged", "dissipative"].map(rotating));
    cases
}
