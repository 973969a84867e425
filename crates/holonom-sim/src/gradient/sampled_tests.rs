//! Gradients of runs whose signals are sampled at nodes and held, or delayed.

use super::comparison::{PATH, SeenNumber, Worst, seen, sensing};
use super::force_models::{held, without_controls, without_objectives};
use super::force_tests::{AT_REST, by, refusal, same_bits_with_checkpoints};
use super::tests::LINKAGE;

/// Of derivatives and differences, and of forward and backward.
const WITHIN: [f64; 2] = [1e-9, 1e-11];

/// Controllers of several rates that read one another, what is kept, what lags behind both; laws
/// along a joint and on a body, and a bushing that read them. At its limits, and off them.
const SAMPLED: &str = r#"
[[signal]]
name = "digital"
every = 0.02
pid = { of = "0.3*c - slide - 0.1*late", proportional = "= 4*c", integral = "= 6*c", derivative = "= 0.3*c", filter = "= 0.1*c", feedforward = "0.2*c*slide.rate" }
[[signal]]
name = "bounded"
every = 0.03
pid = { of = "0.3*c - shoulder", proportional = "= 0.3*k", integral = "= 10*k", limits = ["= -0.1*k", "= 0.3*c"], tracking = "= 0.1*c" }
[[signal]]
name = "saturated"
every = 0.01
pid = { of = "k - shoulder.rate", proportional = "= 9*k", integral = "= k", limits = ["= -0.2*c", "= 0.1*c"] }
[[signal]]
name = "sum"
every = 0.01
value = "0.7*last + c*slide.rate + 0.1*digital*k"
start = "= 0.2*c"
[[signal]]
name = "late"
delay = { of = "c*slide + 0.2*sum + 0.1*shoulder", time = 0.017 }
[[signal]]
name = "slow"
filter = { of = "digital + sum*late + bounded", time_constant = "= 0.1*c" }
[[signal]]
name = "echo"
every = 0.02
value = "k*slow - c*last + sin(k*shoulder)"
[[law]]
name = "lags"
joint = "slide"
effort = "slow + 0.5*late + c*sum - x*echo"
[[law]]
name = "swims"
on = "box"
force = ["-c*vx*(1 + digital)", "bounded + saturated + k*late", "echo - k*z"]
[[bushing]]
name = "slack"
from = "ground"
to = "box"
position = [0.1, 3.0, 0.2]
stiffness = ["100*k*(1 + 0.1*digital)", 900.0, 700.0, 5.0, "= k", 7.0]
damping = [3.0, "9*c*(1 + 0.1*late)", 2.0, 0.1, 0.1, 0.2]
"#;

fn sampled() -> String {
    held() + SAMPLED
}

/// What sensors show of it.
fn shown(at: &'static str) -> Vec<SeenNumber<'static>> {
    let mut all = seen(
        &[
            ("effort", "lags", "", &[""]),
            ("effort", "swims", "", &["fx", "fy"]),
            ("effort", "slack", "", &["fx", "fy"]),
            ("work", "lags", "", &[""]),
            ("joint_rate", "slide", "", &[""]),
        ],
        at,
    );
    let value =
        "type = \"expression\"\nvalue = \"k*digital + bounded*slide.rate - late + c*echo*sum\"\n";
    all.push(SeenNumber::new(value, "", at));
    all
}

#[test]
fn sampled_signals_agree_with_differences() {
    for at in ["", PATH] {
        Worst::default().compare_all(&sampled(), &shown(at), WITHIN);
    }
}

/// A sensor of the acceleration level, and one of multipliers: the step from the node.
#[test]
fn forces_beside_sampled_signals_agree_with_differences() {
    let all = seen(
        &[("joint_acceleration", "slide", "", &[""]), ("reaction", "shoulder", "", &["fz"])],
        "",
    );
    Worst::default().compare_all(&sampled(), &all, WITHIN);
}

/// A closed loop whose crank has a controller of another computer, by its geometry as well where
/// it reads angles.
#[test]
fn a_sampled_controller_of_a_loop_agrees_with_differences() {
    let steers = "[[signal]]\nname = \"s\"\nevery = 0.02\npid = { of = \"0.5 - shaft\", proportional = \"= 3*gain\", integral = \"= gain\", derivative = \"= 0.2*gain\", filter = \"= 0.1*gain\" }\n\
                  [[signal]]\nname = \"late\"\ndelay = { of = \"s + gain*pin\", time = 0.025 }\n\
                  [[law]]\nname = \"steers\"\njoint = \"shaft\"\neffort = \"late\"\n";
    let linkage =
        without_objectives(LINKAGE).replace("[parameters]\n", "[parameters]\ngain = 0.7\n");
    let linkage = linkage + steers;
    let all = [("effort", "steers", "", &[""][..]), ("joint_rate", "pin", "", &[""])];
    for at in ["", PATH] {
        Worst::default().compare_all(&linkage, &seen(&all, at), WITHIN);
    }
}

/// Sub-steps of a composition hold what is sampled at nodes of whole steps.
#[test]
fn sampled_signals_in_compositions_agree_with_differences() {
    let (pid, law) = (AT_REST.find("pid").unwrap(), AT_REST.find("\n[[law]]").unwrap());
    let value = "every = 0.02\nvalue = \"0.5*last + 4*c*slide - slide.rate\"";
    let text = by(&format!("{}{value}{}", &AT_REST[..pid], &AT_REST[law..]), "order = 4\n");
    let text = text.replace("mass = 1.0", "mass = \"= 1 + c\"");
    let text = text.replace("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 1.0, 0.0]\nrate = 0.7");
    let text = text.replace("effort = \"s\"", "effort = \"s - c*x\"");
    let place = |at| SeenNumber::new("type = \"position\"\nof = \"lower\"\n", "x", at);
    let rate = |at| SeenNumber::new("type = \"joint_rate\"\nof = \"slide\"\n", "", at);
    Worst::default().compare_all(&text, &[place(""), rate(""), rate(PATH)], WITHIN);
}

/// At a start that is relaxed, what is sampled begins with what is read there.
#[test]
fn sampled_signals_at_a_relaxed_start_agree_with_differences() {
    let spring = "axis = [0.0, 1.0, 0.0]\nspring = { stiffness = \"= 3*c\", rest = 0.4 }";
    let late = "[[signal]]\nname = \"late\"\ndelay = { of = \"c*slide\", time = 0.025 }\n[[law]]";
    let text = by(AT_REST, "start = \"relaxed\"\n").replace("axis = [0.0, 1.0, 0.0]", spring);
    let text = text.replace("pid = {", "every = 0.02\npid = {").replace("[[law]]", late);
    let text = text.replace("effort = \"s\"", "effort = \"s + late\"");
    for at in ["", PATH] {
        let place = SeenNumber::new("type = \"position\"\nof = \"lower\"\n", "x", at);
        let effort = SeenNumber::new("type = \"effort\"\nof = \"pushes\"\n", "", at);
        Worst::default().compare_all(&text, &[place, effort], WITHIN);
    }
}

#[test]
fn gradients_of_sampled_runs_have_the_same_bits_with_checkpoints() {
    let text = sensing(&sampled(), "type = \"effort\"\nof = \"lags\"\n", "", PATH);
    same_bits_with_checkpoints(&text, false);
}

/// What is known with the step after a node has no derivative at it; a time that is kept has none.
#[test]
fn samples_without_derivatives_are_refused() {
    let text = without_controls(&held());
    let law = "[[law]]\nname = \"pushes\"\njoint = \"slide\"\neffort = \"s\"\n";
    let reaction = "[[sensor]]\nname = \"felt\"\ntype = \"reaction\"\nof = \"shoulder\"\n";
    let cases = [
        (
            format!("{reaction}[[signal]]\nname = \"s\"\nevery = 0.02\nvalue = \"felt.fz\"\n"),
            "felt.fz",
        ),
        (
            "[[signal]]\nname = \"s\"\ndelay = { of = \"slide\", time = \"= 0.1*c\" }\n".into(),
            "signal.s.delay.time",
        ),
        ("[[signal]]\nname = \"s\"\nevery = 0.02\nvalue = \"floor(30*c*slide)\"\n".into(), "floor"),
    ];
    let galerkin = by(&held(), "method = \"galerkin\"\norder = 4\n");
    let every = "[[signal]]\nname = \"s\"\nevery = 0.02\nvalue = \"slide\"\n";
    let found = refusal(&sensing(
        &format!("{galerkin}{every}{law}"),
        "type = \"position\"\nof = \"lower\"\n",
        "x",
        "",
    ));
    assert!(found.starts_with("simulation.method"), "{found}");
    for (signal, key) in cases {
        let text = format!("{text}{signal}{law}");
        let found = refusal(&sensing(&text, "type = \"position\"\nof = \"lower\"\n", "x", ""));
        println!("{found}");
        assert!(found.contains(key), "{key}: {found}");
    }
}
