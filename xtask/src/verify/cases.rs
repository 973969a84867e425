//! The systems, and what is measured on each.

use super::closed_forms;
use super::exact::{self, Exact};
use holonom::Model;
use holonom::certificate::subject::ModelSubject;
use holonom::verification::certificate::{Criterion, Finding};
use holonom::verification::certify::MeasurementPlan;
use holonom::verification::convergence::Horizon;
use holonom::verification::subject::{GalerkinForm, SchemeSetting, SteppingMethod, Subject};
use holonom::vi_constraints::SchemeKind;
use holonom::vi_emscheme::EmForm;

/// A system with its plan.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) subject: Box<dyn Subject>,
    pub(crate) plan: MeasurementPlan,
    /// How long it takes, roughly.
    pub(crate) weight: u32,
    /// Values that are known without a run.
    pub(crate) closed_forms: fn() -> Vec<Finding>,
}

macro_rules! shipped {
    ($name:literal) => {
        include_str!(concat!("../../../examples/models/", $name, ".toml"))
    };
}
macro_rules! own {
    ($name:literal) => {
        include_str!(concat!("../../models/", $name, ".toml"))
    };
}

/// Numbers of a case: end of the convergence study (s), its coarsest and finest number of steps,
/// the step of everything else (s), steps of the long runs in thousands (nodal; the other schemes),
/// weight.
struct Numbers(f64, u32, u32, f64, [u64; 2], u32);

/// A kinematic pair: its name and the lines that state its axes.
pub(crate) const PAIRS: [(&str, &str, &str); 8] = [
    ("pair_spherical", "spherical", ""),
    ("pair_revolute", "revolute", "axis = [0.3, 0.6, -0.6]\n"),
    ("pair_cylindrical", "cylindrical", "axis = [0.3, 0.6, -0.6]\n"),
    ("pair_prismatic", "prismatic", "axis = [0.3, 0.6, -0.6]\n"),
    ("pair_planar", "planar", "axis = [0.3, 0.6, -0.6]\n"),
    ("pair_fixed", "fixed", ""),
    ("pair_universal", "universal", "axis = [0.3, 0.6, -0.6]\naxis2 = [0.0, 1.0, 1.0]\n"),
    ("pair_screw", "screw", "axis = [0.3, 0.6, -0.6]\npitch = 0.4\n"),
];

/// All systems.
pub(crate) fn all(quick: bool) -> Result<Vec<Case>, String> {
    let model = |name: &str, text: &str| -> Result<ModelSubject, String> {
        let model = Model::from_toml(text).map_err(|e| format!("{name}: {e}"))?;
        Ok(ModelSubject::new(model))
    };
    let mut cases = Vec::new();
    let mut add = |name, about, subject: Box<dyn Subject>, numbers| {
        cases.push(case(name, about, subject, numbers, quick));
    };
    let exact = |name: &str, text: &str, motion| -> Result<Box<dyn Subject>, String> {
        Ok(Box::new(Exact::new(model(name, text)?, motion)?))
    };
    let plain = |name: &str, text: &str| -> Result<Box<dyn Subject>, String> {
        Ok(Box::new(model(name, text)?))
    };
    add(
        "pendulum",
        "planar pendulum released from the horizontal; Jacobi's elliptic functions",
        exact("pendulum", shipped!("pendulum"), exact::pendulum)?,
        Numbers(1.0, 8, 1 << 12, 0.02, [1000, 200], 3),
    );
    add(
        "pendulum_free",
        "planar pendulum without gravity; uniform rotation",
        exact("pendulum_free", shipped!("pendulum_free"), exact::uniform_rotation)?,
        Numbers(1.0, 8, 1 << 11, 0.02, [1000, 200], 3),
    );
    add(
        "heavy_top",
        "cone on its tip in steady precession; closed form",
        exact("heavy_top", shipped!("heavy_top_steady"), exact::steady_top)?,
        Numbers(0.05, 8, 1 << 12, 0.0005, [1000, 200], 5),
    );
    add(
        "free_body",
        "free rigid body spun about its middle axis",
        plain("free_body", shipped!("free_body"))?,
        Numbers(4.0, 8, 1 << 11, 0.05, [1000, 200], 5),
    );
    add(
        "four_particles",
        "four point masses on two bars and two stiffening springs",
        plain("four_particles", shipped!("four_particles"))?,
        Numbers(0.25, 8, 1 << 11, 0.005, [1000, 100], 5),
    );
    for (name, pair, axes) in PAIRS {
        let text = own!("pair").replace("PAIR", pair).replace("AXES\n", axes);
        let about = "two bodies joined by the pair, on springs to the vertical axis, gravity";
        add(name, about, plain(name, &text)?, Numbers(0.5, 8, 1 << 11, 0.01, [200, 40], 20));
    }
    add(
        "chain8",
        "chain of eight bodies on hinges with alternating axes",
        plain("chain8", shipped!("chain8"))?,
        Numbers(0.5, 8, 1 << 10, 0.005, [200, 10], 80),
    );
    add(
        "tree",
        "branched tree of seven bodies with six kinds of pairs",
        plain("tree", own!("tree"))?,
        Numbers(0.5, 8, 1 << 10, 0.005, [200, 10], 70),
    );
    add(
        "four_bar",
        "four-bar linkage, three redundant constraints",
        plain("four_bar", own!("four_bar"))?,
        Numbers(0.8, 16, 1 << 11, 0.004, [200, 20], 40),
    );
    add(
        "six_body_linkage",
        "free threefold-symmetric Bricard linkage, one redundant constraint",
        plain("six_body_linkage", shipped!("six_hinge_cube"))?,
        Numbers(4.0, 8, 1 << 10, 0.02, [400, 10], 100),
    );
    add(
        "soft_cantilever",
        "soft curved cantilever released under gravity",
        plain("soft_cantilever", own!("soft_cantilever"))?,
        Numbers(1.0, 16, 1 << 11, 0.02, [40, 10], 60),
    );
    add(
        "soft_flying_beam",
        "soft beam in free flight",
        plain("soft_flying_beam", own!("soft_flying_beam"))?,
        Numbers(1.0, 32, 1 << 11, 0.02, [40, 10], 70),
    );
    add(
        "soft_flexible_multibody",
        "body, ball, soft beam, hinge, body in free flight",
        plain("soft_flexible_multibody", own!("soft_flexible_multibody"))?,
        Numbers(1.0, 16, 1 << 11, 0.02, [40, 10], 80),
    );
    add(
        "forced",
        "arm with motor, spring, damper and a following force",
        plain("forced", own!("forced"))?,
        Numbers(0.5, 8, 1 << 11, 0.01, [100, 20], 10),
    );
    add(
        "rheonomic",
        "double pendulum with a driven hinge",
        plain("rheonomic", own!("rheonomic"))?,
        Numbers(0.5, 8, 1 << 11, 0.01, [100, 20], 20),
    );
    for case in &mut cases {
        if case.name == "soft_cantilever" {
            case.closed_forms = || vec![closed_forms::curved_cantilever(&|_| {})];
        }
    }
    Ok(cases)
}

fn case(
    name: &'static str,
    about: &'static str,
    subject: Box<dyn Subject>,
    Numbers(end, coarsest, finest, step, [long, short], weight): Numbers,
    quick: bool,
) -> Case {
    let nodal = SteppingMethod::NODAL;
    let methods = SchemeKind::ALL.map(SteppingMethod::Variational);
    let others = methods.into_iter().filter(|method| *method != nodal);
    let orders = |method| match (quick, method == nodal) {
        (false, _) => vec![2, 4, 6, 8],
        (true, true) if weight <= 10 => vec![2, 4, 6, 8], // the composition is the same everywhere
        (true, true) => vec![2, 4],
        (true, false) => vec![2],
    };
    let variational = std::iter::once(nodal).chain(others).map(|m| (m, orders(m)));
    let forms = if quick { &EmForm::ALL[2..] } else { &EmForm::ALL };
    let composed = |form: &EmForm| match (quick, *form == EmForm::Nodal) {
        (false, true) => vec![2, 4, 6],
        (false, false) => vec![2, 4],
        (true, _) => vec![2],
    };
    let comparator =
        forms.iter().map(|form| (SteppingMethod::EnergyMomentum(*form), composed(form)));
    let galerkin = galerkin(subject.as_ref(), step, quick, weight);
    let methods = variational.chain(galerkin).chain(comparator).collect();
    let (long, short) = if quick { (long * 10, 2048) } else { (long * 1000, short * 1000) };
    let finest = if quick { finest / 4 } else { finest };
    let horizon = Horizon { end, coarsest, finest };
    let few = if quick { 64 } else { 200 };
    let plan = MeasurementPlan {
        methods,
        horizon,
        step,
        long: long.max(4096),
        short,
        meant: u64::MAX,
        own: None,
        few,
        criteria: Criterion::ALL.to_vec(),
    };
    Case { name, about, subject, plan, weight, closed_forms: Vec::new }
}

/// The Galerkin scheme on the discrete null space, where a system can be integrated by it, with its
/// orders. Of order 16 invariants are measured; errors are at round-off from coarse steps on, so
/// that its order is rarely read.
fn galerkin(
    subject: &dyn Subject,
    step: f64,
    quick: bool,
    weight: u32,
) -> Option<(SteppingMethod, Vec<u32>)> {
    let method = SteppingMethod::Galerkin(GalerkinForm::Nodal);
    let orders = match quick {
        false => vec![4, 6, 8, 16],
        true if weight <= 10 => vec![4],
        true => return None,
    };
    subject.start(SchemeSetting::new(method, orders[0], step)).is_ok().then_some((method, orders))
}
