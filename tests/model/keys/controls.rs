//! Controls and objectives: masses that slide, whose motion under efforts is a sum, so that costs
//! are quadratic functions of the efforts and their gradients are exact differences.

use super::{Case, Checks, Run};
use holonom::gradient::{ModelGradient, Wanted, gradient};
use holonom::model::ModelText;
use holonom::optimize::{SearchProgress, SearchStatus, SearchWatch, optimize};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use vi_testkit::model::{body, head, part, sensor};

const STEP: f64 = 0.1;
const STEPS: usize = 12;
/// Steps for each value of the first and the second control.
const HOLD: [usize; 2] = [3, 4];
/// Values of both.
const VALUES: [&[f64]; 2] = [&[1.0, -0.4, 0.7, 0.2], &[0.3, -0.8, 0.5, 0.9]];

/// Places of a mass, kg, that begins with a speed, m/s, under an effort in each step, and its speed
/// at the end.
fn places(mass: f64, speed: f64, efforts: &[f64]) -> (Vec<f64>, f64) {
    let (mut x, mut v) = (vec![0.0], speed);
    for effort in efforts {
        let before = v;
        v += STEP * effort / mass;
        x.push(x[x.len() - 1] + 0.5 * STEP * (before + v));
    }
    (x, v)
}

/// The efforts of each step.
fn efforts(values: &[Vec<f64>]) -> [Vec<f64>; 2] {
    let linear = |n: usize| {
        let at = (n as f64 + 0.5) / HOLD[1] as f64;
        let k = at as usize;
        values[1][k] + (values[1][k + 1] - values[1][k]) * (at - k as f64)
    };
    let constant = |n: usize| values[0][n / HOLD[0]];
    [(0..STEPS).map(constant).collect(), (0..STEPS).map(linear).collect()]
}

/// The terms by their names.
fn terms(values: &[Vec<f64>]) -> [(&'static str, f64); 7] {
    let [push, pull] = efforts(values);
    let ((x, _), (y, _)) = (places(2.0, 0.3, &push), places(1.5, -0.2, &pull));
    let sum: f64 = x.windows(2).map(|x| x[0] + x[1]).sum();
    let path: f64 = y.windows(2).map(|e| (e[0] - 0.2).powi(2) + (e[1] - 0.2).powi(2)).sum();
    let work = |efforts: &[f64], x: &[f64]| -> f64 {
        efforts.iter().zip(x.windows(2)).map(|(w, x)| w * (x[1] - x[0])).sum()
    };
    let squares = |efforts: &[f64]| -> f64 { efforts.iter().map(|w| w * w).sum() };
    let rate: f64 = pull.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
    [
        ("arrival", 3.0 * 0.5 * (x[STEPS] - 0.7).powi(2)),
        ("course", 2.0 * 0.25 * STEP * path),
        ("cheap", 0.4 * 0.5 * STEP * squares(&push)),
        ("worked", 0.7 * (work(&push, &x) + work(&pull, &y))),
        ("smooth", 0.01 * 0.5 / STEP * rate),
        ("short", 1.3 * STEPS as f64 * STEP),
        ("mean", 0.6 * 0.5 * STEP * sum),
    ]
}

fn cost(values: &[Vec<f64>]) -> f64 {
    terms(values).iter().map(|own| own.1).sum()
}

/// Half the sum of squares of both momenta at the end, weighted.
fn cost_of_momenta(values: &[Vec<f64>]) -> f64 {
    let [push, pull] = efforts(values);
    let [a, b] = [2.0 * places(2.0, 0.3, &push).1, 1.5 * places(1.5, -0.2, &pull).1];
    0.2 * 0.5 * (a * a + b * b)
}

fn at_rest(run: &Run) -> Checks {
    of_cost(run, ["push", "pull"], (1.0, 1e-11), &cost_of_momenta).0
}

/// The cost and its derivatives by the values of both controls; the gradient, where there is one.
fn of_cost(
    run: &Run,
    names: [&str; 2],
    within: (f64, f64),
    cost: &dyn Fn(&[Vec<f64>]) -> f64,
) -> (Checks, Option<ModelGradient>) {
    let mut checks = Checks::default();
    let Some(found) = found(&run.document.to_string()) else {
        checks.near("there is a gradient", 0.0, 1.0, 1e-3);
        return (checks, None);
    };
    let values: Vec<Vec<f64>> = VALUES.iter().map(|own| own.to_vec()).collect();
    checks.near("cost", found.value, cost(&values), 1e-11);
    compare(&mut checks, &found, names, within, cost);
    (checks, Some(found))
}

fn found(document: &str) -> Option<ModelGradient> {
    let text = ModelText::from_text(Path::new("model.toml"), document);
    let wanted =
        Wanted { values: VALUES.iter().map(|own| own.to_vec()).collect(), ..Wanted::everything() };
    gradient(&text, &[], &text.model(&[]).ok()?, &wanted).ok()
}

pub(super) fn cases() -> Vec<Case> {
    let slider = |name: &str, mass: f64, keys: &str| {
        body(name, mass, [0.1, 0.2, 0.3])
            + &part("joint", &format!("{name}_rail"))
            + &format!(
                "parent = \"ground\"\nchild = \"{name}\"\nposition = [0.0, 0.0, 0.0]\n{keys}"
            )
    };
    let objective = |name: &str, keys: &str| part("objective", name) + keys;
    let text = [
        head("controls", &format!("step = {STEP}, end = {:?}", STEP * STEPS as f64)),
        slider("a", 2.0, "type = \"prismatic\"\naxis = [1.0, 0.0, 0.0]\nrate = 0.3\n"),
        slider(
            "b",
            1.5,
            "type = \"planar\"\naxis = [0.0, 0.0, 1.0]\nfirst_axis = [1.0, 0.0, 0.0]\n\
             rate = [0.1, -0.2, 0.0]\n",
        ),
        sensor("place", "position", "a"),
        sensor("slide", "joint_coordinate", "b_rail"),
        part("control", "push") + "joint = \"a_rail\"\nhold = 3\nmin = -3.0\nmax = 4.0\n",
        part("control", "pull") + "joint = \"b_rail\"\nfreedom = 1\nhold = 4\nshape = \"linear\"\n",
        objective(
            "arrival",
            "type = \"sensor\"\nsensor = \"place.x\"\ntarget = 0.7\nweight = 3.0\n",
        ),
        objective(
            "course",
            "type = \"sensor\"\nsensor = \"slide.1\"\nat = \"path\"\ntarget = 0.2\nweight = 2.0\n",
        ),
        objective("cheap", "type = \"effort\"\ncontrols = [\"push\"]\nweight = 0.4\n"),
        objective("worked", "type = \"work\"\nweight = 0.7\n"),
        objective("smooth", "type = \"rate\"\ncontrols = [\"pull\"]\nweight = 0.01\n"),
        objective("short", "type = \"time\"\nweight = 1.3\n"),
        objective("mean", "type = \"value\"\nsensor = \"place.x\"\nat = \"path\"\nweight = 0.6\n"),
    ]
    .concat();
    let momenta = [
        head("momenta", &format!("step = {STEP}, end = {:?}", STEP * STEPS as f64)),
        slider("a", 2.0, "type = \"prismatic\"\naxis = [1.0, 0.0, 0.0]\nrate = 0.3\n"),
        slider("b", 1.5, "type = \"prismatic\"\naxis = [0.0, 1.0, 0.0]\nrate = -0.2\n"),
        part("control", "push") + "joint = \"a_rail\"\nhold = 3\n",
        part("control", "pull") + "joint = \"b_rail\"\nhold = 4\nshape = \"linear\"\n",
        objective("still", "type = \"momentum\"\nweight = 0.2\n"),
    ]
    .concat();
    let bound = "bounds are those of an optimum";
    let controls = Case::new("controls", text.clone(), judged).only("control");
    let controls = controls.blind("control.min", bound).blind("control.max", bound);
    vec![
        controls,
        Case::new("objectives", text, judged).only("objective"),
        Case::new("momenta", momenta, at_rest).only("objective"),
        wrenches(),
        design("condition"),
        design("optimize"),
    ]
}

/// The start of a free body with wrenches, without them.
fn tug() -> String {
    let turned = "[[frame]]\nname = \"tower\"\nrotation_vector = [0.2, -0.5, 0.4]\n";
    head("wrenches", &format!("step = {STEP}, end = {:?}", STEP * STEPS as f64))
        + turned
        + &body("tug", 2.0, [0.1, 0.2, 0.25])
        + "rotation_vector = [0.3, 0.2, -0.4]\nangular_velocity = [0.5, -0.3, 0.8]\n"
        + &body("other", 1.0, [0.1, 0.1, 0.1])
        + &sensor("place", "position", "tug")
        + "point = [0.3, 0.1, 0.2]\n"
}

/// What the wrenches of the value 1 are.
const WRENCHES: [&str; 2] = [
    "body = \"tug\"\nforce = [0.3, 0.0, 0.1]\ntorque = [0.0, 0.1, 0.2]\npoint = [0.1, 0.2, -0.1]\n\
     frame = \"body\"\n",
    "body = \"tug\"\nforce = [0.0, 0.5, 0.2]\ntorque = [0.05, 0.0, 0.1]\nrelative_to = \"tower\"\n",
];

/// A free body with a wrench that turns with it and one that does not.
fn wrenches() -> Case {
    let mut text = tug();
    for (name, (keys, hold)) in ["jet", "wind"].into_iter().zip(WRENCHES.into_iter().zip([3, 4])) {
        text += &format!("{}{keys}hold = {hold}\n", part("control", name));
    }
    text += "shape = \"linear\"\n";
    for (part_of, target) in [("x", 0.7), ("y", -0.4), ("z", 0.2)] {
        text += &part("objective", &format!("to_{part_of}"));
        text += &format!("type = \"sensor\"\nsensor = \"place.{part_of}\"\ntarget = {target}\n");
    }
    Case::new("wrenches", text, wrenched).only("control")
}

/// The cost with loads in the place of the controls, whose histories are these values.
fn cost_of_loads(values: &[Vec<f64>]) -> f64 {
    let mut text = tug();
    for (k, (keys, efforts)) in WRENCHES.into_iter().zip(efforts(values)).enumerate() {
        text += &part("load", &format!("load_{k}"));
        text += &format!("{keys}history = {{ type = \"steps\", values = {efforts:?} }}\n");
    }
    let model = holonom::Model::from_toml(&text).expect("a model");
    let mut simulation = holonom::Simulation::new(&model).expect("a system");
    let run = simulation.integrator();
    for _ in 0..STEPS {
        run.step().expect("a step");
    }
    let q = &run.state().q;
    let point = [0.3, 0.1, 0.2]; // along principal axes, which are those of the body
    let place = |i: usize| q[i] + (0..3).map(|k| point[k] * q[3 + 3 * k + i]).sum::<f64>();
    let squares = [0.7, -0.4, 0.2].iter().enumerate().map(|(i, x)| (place(i) - x).powi(2));
    0.5 * squares.sum::<f64>()
}

fn wrenched(run: &Run) -> Checks {
    of_cost(run, ["jet", "wind"], (1e-4, 1e-7), &cost_of_loads).0
}

/// Masses that slide at speeds that are free, one on a spring: each speed follows from a condition,
/// or from a bound.
fn design(only: &'static str) -> Case {
    let mut text = head("design", &format!("step = {STEP}, end = {:?}", STEP * STEPS as f64));
    text += "[parameters]\n";
    let speeds = speeds();
    for (name, _) in &speeds {
        text += &format!("{name} = 0.1\n");
    }
    for (name, _) in &speeds {
        text += &body(&format!("body_{name}"), 1.0, [0.1, 0.2, 0.3]);
        text += &part("joint", &format!("rail_{name}"));
        text += &format!(
            "type = \"prismatic\"\nparent = \"ground\"\nchild = \"body_{name}\"\nposition = [0.0, 0.0, 0.0]\n\
             axis = [1.0, 0.0, 0.0]\nrate = \"= {name}\"\n"
        );
        if *name == "b" {
            text += &format!("spring = {{ stiffness = {STIFFNESS:?} }}\n");
        }
        text += &sensor(&format!("place_{name}"), "joint_coordinate", &format!("rail_{name}"));
    }
    for (name, target, weight) in
        [("b", 2.0, 1.0), ("c", -1.0, 2.0), ("d", 5.0, 1.0), ("e", -5.0, 1.0)]
    {
        text += &part("objective", &format!("aim_{name}"));
        text += &format!(
            "type = \"sensor\"\nsensor = \"place_{name}\"\ntarget = {target:?}\nweight = {weight:?}\n"
        );
    }
    let condition = |name: &str, keys: &str| {
        part("condition", &format!("condition_{name}"))
            + &format!("sensor = \"place_{name}\"\n{keys}\n")
    };
    text += &condition("a", "at = 0.6\nequals = 0.5");
    text += &condition("b", "at = \"path\"\nmax = 0.4");
    text += &condition("c", "min = 0.9");
    text += "[optimize]\nstarts = 2\n";
    for (name, bounds) in [
        ("a", [-9.0, 9.0]),
        ("b", [-9.0, 9.0]),
        ("c", [-9.0, 9.0]),
        ("d", [-9.0, 1.5]),
        ("e", [-0.7, 9.0]),
    ] {
        text +=
            &format!("parameters.{name} = {{ min = {:?}, max = {:?} }}\n", bounds[0], bounds[1]);
    }
    let case = Case::new(format!("design, {only}"), text, designed).only(only);
    if only == "condition" {
        case
    } else {
        case.blind("optimize.parameters", "a bound that is not active")
    }
}

/// Of the spring of one mass, N/m: it turns back before the end.
const STIFFNESS: f64 = 4.0;

/// Speeds, m/s, of masses of 1 kg that move for 1.2 s. The one on the spring has
/// `q_n = A sin(n φ)`, `tan(φ/2) = h √k/2`, `(1/h + h k/4) q_1 = v`, and the largest `q_n` is 0.4.
fn speeds() -> [(&'static str, f64); 5] {
    let phase = 2.0 * (0.5 * STEP * STIFFNESS.sqrt()).atan();
    let largest = (0..=STEPS).map(|n| (n as f64 * phase).sin()).fold(0.0, f64::max);
    let b = (1.0 / STEP + 0.25 * STEP * STIFFNESS) * phase.sin() * 0.4 / largest;
    [("a", 0.5 / 0.6), ("b", b), ("c", 0.9 / 1.2), ("d", 1.5), ("e", -0.7)]
}

fn designed(run: &Run) -> Checks {
    let mut checks = Checks::default();
    let text = ModelText::from_text(Path::new("model.toml"), run.document.to_string());
    let watch: SearchWatch = Rc::new(RefCell::new(|_: &SearchProgress| true));
    let found = optimize((&text, &[], &run.model), None, None, &watch).ok();
    let report = found.map(|own| own.report).filter(|own| own.status == SearchStatus::Optimal);
    let Some(report) = report else {
        checks.near("there is an optimum", 0.0, 1.0, 1e-3);
        return checks;
    };
    let searches: usize = report.starts.iter().map(|own| own.count).sum();
    checks.near("searches", searches as f64, 2.0, 1e-3);
    for (name, speed) in speeds() {
        let own = report.parameters.iter().find(|own| own.name == name);
        checks.near(name, own.map_or(f64::INFINITY, |own| own.value), speed, 1e-8);
    }
    for (name, value) in [("condition_a", 0.5), ("condition_b", 0.4), ("condition_c", 0.9)] {
        let own = report.conditions.iter().find(|own| own.name == name);
        checks.near(name, own.map_or(f64::INFINITY, |own| own.value), value, 1e-8);
    }
    checks
}

/// Derivatives by the values of both controls against central differences of a cost, by so much and
/// to a tolerance.
fn compare(
    checks: &mut Checks,
    found: &ModelGradient,
    names: [&str; 2],
    (by, tolerance): (f64, f64),
    cost: &dyn Fn(&[Vec<f64>]) -> f64,
) {
    for (k, name) in names.into_iter().enumerate() {
        let own = found.controls.iter().find(|own| own.name == name);
        let own = own.map_or(&[][..], |own| &own.derivatives);
        checks.near("values", own.len() as f64, VALUES[k].len() as f64, 1e-3);
        for i in 0..VALUES[k].len() {
            let changed = |by: f64| {
                let mut values: Vec<Vec<f64>> = VALUES.iter().map(|own| own.to_vec()).collect();
                values[k][i] += by;
                cost(&values)
            };
            let slope = (changed(by) - changed(-by)) / (2.0 * by);
            let own = own.get(i).copied().unwrap_or(f64::INFINITY);
            checks.near(&format!("{name} {i}"), own, slope, tolerance);
        }
    }
}

fn judged(run: &Run) -> Checks {
    let (mut checks, found) = of_cost(run, ["push", "pull"], (1.0, 1e-11), &cost);
    let values: Vec<Vec<f64>> = VALUES.iter().map(|own| own.to_vec()).collect();
    for (name, value) in terms(&values) {
        let own = found.iter().flat_map(|found| &found.terms).find(|own| own.name == name);
        checks.near(name, own.map_or(f64::INFINITY, |own| own.value), value, 1e-11);
    }
    checks
}
