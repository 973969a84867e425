//! All mutants.

use super::{Base, Defect, EmDefect, IntegratorDefect, Mutant, OutputDefect, PAIRS, em};
use holonom::verification::certificate::Criterion;
use holonom::verification::subject::{GalerkinForm, SteppingMethod};
use holonom::vi_constraints::SchemeKind;
use holonom::vi_emscheme::EmForm;

const ORDER_2: (SteppingMethod, u32) = (SteppingMethod::NODAL, 2);
const SCREW: usize = PAIRS.len() - 1;
const REVOLUTE: usize = 1;

/// Five systems on which outputs are falsified: exact motion or not, redundant constraints, one
/// without joints.
const REPORTING: [Base; 5] =
    [Base::Top, Base::Pendulum, Base::FreeBody, Base::FourBar, Base::Pair(REVOLUTE)];

/// Every mutant with the criterion and the quantity that must find it.
#[must_use]
pub fn all() -> Vec<Mutant> {
    let mut all = outputs();
    all.extend(reactions());
    all.extend(structure());
    all.extend(integrators());
    all.extend(energy_momentum());
    all.extend(wiring());
    all
}

fn mutant(
    name: &'static str,
    base: Base,
    defect: Defect,
    method: (SteppingMethod, u32),
    (criterion, quantity): (Criterion, &'static str),
) -> Mutant {
    Mutant { name, base, defect, method, criterion, quantity }
}

/// Multipliers and momenta, on five systems each and on a beam where they are defined.
fn outputs() -> Vec<Mutant> {
    use OutputDefect as D;
    let falsified: [(&str, D, &str); 9] = [
        ("λ of (36) with the wrong sign", D::Multiplier(-1.0), "λ (36)"),
        ("λ of (36) doubled", D::Multiplier(2.0), "λ (36)"),
        ("λ_0 of (47) doubled", D::StartMultiplier(2.0), "λ_0 (47)"),
        ("λ_0 of (47) halved", D::StartMultiplier(0.5), "λ_0 (47)"),
        ("λ_0 of (47) negated", D::StartMultiplier(-1.0), "λ_0 (47)"),
        ("p of (34) negated", D::ConstrainedMomentum(-1.0), "p (constrained, 34)"),
        ("projected p doubled", D::Momentum(2.0), "p (projected, 40)"),
        ("λ of the acceleration level negated", D::OtherMultiplier(-1.0), "λ (acceleration level)"),
        (
            "λ of the acceleration level 1 % too large",
            D::OtherMultiplier(1.01),
            "λ (acceleration level)",
        ),
    ];
    let mut all = Vec::new();
    for (name, defect, quantity) in falsified {
        let in_the_reference = matches!(defect, D::Momentum(_) | D::OtherMultiplier(_));
        for base in REPORTING {
            // the mass matrix of the free body is singular: it has no p of (34)
            let of_step = matches!(defect, D::ConstrainedMomentum(_));
            let base = if of_step && base == Base::FreeBody { Base::Pair(SCREW) } else { base };
            // without an exact motion the reference has the same defect: the equations of motion do
            // not
            let exact = matches!(base, Base::Top | Base::Pendulum);
            let found = match (in_the_reference && !exact, defect) {
                (false, _) => (Criterion::Order, quantity),
                (true, D::Momentum(_)) => {
                    (Criterion::Output, "p against M v of the configurations")
                }
                (true, _) => {
                    (Criterion::Output, "equations of motion with λ of the acceleration level")
                }
            };
            all.push(mutant(name, base, Defect::Output(defect), ORDER_2, found));
        }
    }
    let beam = [
        ("λ of (36) with the wrong sign", D::Multiplier(-1.0), "equations of motion with λ"),
        ("projected p doubled", D::Momentum(2.0), "p against M v of the configurations"),
        (
            "λ of the acceleration level negated",
            D::OtherMultiplier(-1.0),
            "equations of motion with λ of the acceleration level",
        ),
    ];
    for (name, defect, quantity) in beam {
        let found = (Criterion::Output, quantity);
        all.push(mutant(name, Base::Beam, Defect::Output(defect), ORDER_2, found));
    }
    let p = (Criterion::Output, "p of (34) against M v of the configurations");
    let defect = Defect::Output(D::ConstrainedMomentum(1.1));
    all.push(mutant("p of (34) 10 % too large", Base::FourBar, defect, ORDER_2, p));
    all
}

/// Every joint reports a moment or a force that is not in equilibrium with its bodies.
fn reactions() -> Vec<Mutant> {
    let found = (Criterion::Output, "equilibrium of each body with the joint reactions");
    (0..PAIRS.len())
        .map(|k| {
            // a spherical pair has no moment
            let (name, defect) = match PAIRS[k].1 {
                "spherical" => ("joint force doubled", OutputDefect::Forces(2.0)),
                _ => ("joint moment negated", OutputDefect::Moments(-1.0)),
            };
            mutant(name, Base::Pair(k), Defect::Output(defect), ORDER_2, found)
        })
        .collect()
}

/// Energies, momentum maps, residuals, the symplectic form, condition numbers.
fn structure() -> Vec<Mutant> {
    use Criterion as C;
    use OutputDefect as D;
    let top = |name, defect, found| mutant(name, Base::Top, Defect::Output(defect), ORDER_2, found);
    let mut all = vec![
        top("energy drifts", D::EnergyRate(1e-2), (C::Energy, "H_d")),
        top("H_d 1 % short", D::Energy(0.01), (C::Output, "H against T + V")),
        top("E_d 1 % short", D::DiscreteEnergy(0.01), (C::Output, "E_d against T + V of the step")),
        top(
            "momentum maps 10 % too large",
            D::MomentumMaps(1.1),
            (C::Output, "momentum maps against J(q, M v)"),
        ),
        top(
            "|g| reported too large",
            D::Residual(1e-14),
            (C::Output, "reported |g| against |g(q)|"),
        ),
        top(
            "(46) of first order",
            D::MomentumLevel(1e3),
            (C::Residual, "hidden constraint at momenta (46)"),
        ),
        top(
            "p grows by 1e-6 of itself in a step",
            D::PhaseSpace(1e-6),
            (C::Symplecticity, "change of Ω"),
        ),
        top(
            "κ grows like 1/h",
            D::Condition(-1),
            (C::Conditioning, "κ ~ h^a, as written; as factorized"),
        ),
    ];
    for (k, name) in ["Px", "Py", "Pz", "Lx", "Ly", "Lz"].into_iter().enumerate() {
        let defect = Defect::Output(D::MomentumRate(k, 1e-12));
        let found = (C::Momentum, name);
        all.push(mutant("a momentum map drifts", Base::FreeBody, defect, ORDER_2, found));
    }
    let chord = (C::ClosedForm, "end rotation of a bent quarter ring");
    all.push(mutant("chord for arc length", Base::Beam, Defect::Chord, ORDER_2, chord));
    all
}

fn integrators() -> Vec<Mutant> {
    use Criterion as C;
    use IntegratorDefect as D;
    let order_4 = (SteppingMethod::NODAL, 4);
    let of = |name, base, defect, method, found| {
        mutant(name, base, Defect::Integrator(defect), method, found)
    };
    let omega = (C::Symplecticity, "change of Ω");
    let back = (C::Reversal, "q after N steps and back");
    let q = (C::Order, "q");
    let pair = Base::Pair(REVOLUTE);
    vec![
        of("wrong sign in D_2 L_d", Base::Top, D::SignInD2, ORDER_2, q),
        of(
            "wrong sign in D_2 L_d",
            pair,
            D::SignInD2,
            ORDER_2,
            (C::Output, "equations of motion with λ of the acceleration level"),
        ),
        of("P of the node before", Base::Top, D::NullSpaceOfTheNodeBefore, ORDER_2, q),
        of(
            "force of first order",
            Base::Top,
            D::FirstOrderForce,
            ORDER_2,
            (C::Order, "p (projected, 40)"),
        ),
        of(
            "Newton's method stops early",
            Base::Top,
            D::LooseTolerance,
            ORDER_2,
            (C::Momentum, "Lz"),
        ),
        of(
            "Newton's method stops early",
            Base::Top,
            D::LooseTolerance,
            ORDER_2,
            (C::Agreement, "distance in q"),
        ),
        of("undeclared damper", Base::Top, D::HiddenDamper(0.1), ORDER_2, omega),
        of("undeclared damper", Base::FreeBody, D::HiddenDamper(0.1), ORDER_2, omega),
        of("undeclared damper", pair, D::HiddenDamper(0.1), ORDER_2, omega),
        of("undeclared damper", Base::Pair(0), D::HiddenDamper(0.1), ORDER_2, (C::Energy, "H_d")),
        of("undeclared damper", Base::FreeBody, D::HiddenDamper(0.1), ORDER_2, back),
        of("undeclared force", Base::FreeBody, D::HiddenForce(1e-9), ORDER_2, (C::Momentum, "Lz")),
        of("undeclared force", Base::FreeBody, D::HiddenForce(1e-9), ORDER_2, (C::Momentum, "Px")),
        of("one γ off by 1e-3", Base::Top, D::WrongGamma(1e-3), order_4, q),
        of("one γ off by 1e-3", Base::FreeBody, D::WrongGamma(1e-3), order_4, q),
        of("asymmetric composition", pair, D::AsymmetricGamma, ORDER_2, back),
        of(
            "F_d leaves the constraints",
            Base::Top,
            D::Slip(1e-12),
            ORDER_2,
            (C::Residual, "constraints g"),
        ),
        of(
            "first increment counted in steps",
            Base::Top,
            D::ScaledIncrement,
            ORDER_2,
            (C::Conditioning, "κ ~ h^a, as written; as factorized"),
        ),
        mutant(
            "force of first order",
            Base::Top,
            Defect::Integrator(D::FirstOrderForce),
            (SteppingMethod::Variational(SchemeKind::Dalembert), 2),
            (C::Order, "p (projected, 40)"),
        ),
    ]
}

fn energy_momentum() -> Vec<Mutant> {
    use Criterion as C;
    use OutputDefect as D;
    let energy = (C::Energy, "H_d");
    let mut all: Vec<Mutant> = EmForm::ALL
        .into_iter()
        .map(|form| {
            let defect = Defect::EnergyMomentum(EmDefect::MidpointGradient);
            mutant(
                "midpoint gradient, not a discrete derivative",
                Base::Quartic,
                defect,
                em(form),
                energy,
            )
        })
        .collect();
    // the d'Alembert form projects with Ḡ, too: there the same defect changes nothing
    let defect = Defect::EnergyMomentum(EmDefect::NullSpaceAtTheStart);
    let run = (C::Energy, "run");
    all.push(mutant(
        "P(q_n) for the discrete null space",
        Base::Quartic,
        defect,
        em(EmForm::Nodal),
        run,
    ));
    let reported: [(&str, D, (Criterion, &str)); 5] = [
        ("p = M v doubled", D::Momentum(2.0), (C::Order, "p = M v")),
        ("mean λ negated", D::Multiplier(-1.0), (C::Order, "λ, mean of two steps")),
        ("λ of a single step doubled", D::OtherMultiplier(2.0), (C::Order, "λ of a single step")),
        ("initial λ doubled", D::StartMultiplier(2.0), (C::Order, "initial λ")),
        ("mean λ 10 % too large", D::Multiplier(1.1), (C::Output, "equations of motion with λ")),
    ];
    for (name, defect, found) in reported {
        all.push(mutant(name, Base::Top, Defect::Output(defect), em(EmForm::Nodal), found));
    }
    all
}

/// Kernels of trees, loops, beams and Galerkin steps that read a key of a neighbour, or not at all.
fn wiring() -> Vec<Mutant> {
    let agreement = (Criterion::Agreement, "distance in q");
    let galerkin = (SteppingMethod::Galerkin(GalerkinForm::Nodal), 4);
    let nodal: [(&str, Base, &str, &str); 9] = [
        (
            "tree: a spring on the neighbour",
            Base::Pair(REVOLUTE),
            "name = \"hold_b\"\nfrom = \"b\"",
            "name = \"hold_b\"\nfrom = \"a\"",
        ),
        (
            "tree: components of a point exchanged",
            Base::Pair(REVOLUTE),
            "point_from = [0.1, 0.2, 0.3]",
            "point_from = [0.2, 0.1, 0.3]",
        ),
        ("damping: that of the other hinge", Base::Arm, "damping = 0.3", "damping = 0.05"),
        ("damping: left out", Base::Arm, "damping = 0.3", "damping = 0.0"),
        ("motor: without its phase", Base::Arm, "phase = 0.7", "phase = 0.0"),
        ("joint spring: without its angle at rest", Base::Arm, "rest = 0.4", "rest = 0.0"),
        ("loop: the mass of the neighbour", Base::FourBar, "mass = 2.7", "mass = 1.9"),
        ("loop: gravity on one of three axes less", Base::FourBar, "-9.81", "-9.80"),
        ("beam: the bending stiffness of the other axis", Base::Beam, "EI1 = 8.0", "EI1 = 6.0"),
    ];
    let nodal = nodal.into_iter().map(|(name, base, from, to)| {
        mutant(name, base, Defect::Wiring(from, to), ORDER_2, agreement)
    });
    let against_exact = [
        ("Galerkin: gravity of a neighbour", "-9.81", "-9.80"),
        ("Galerkin: radius and height of a cone exchanged", "[0.05, 0.1]", "[0.1, 0.05]"),
    ];
    let galerkin = against_exact.into_iter().map(|(name, from, to)| {
        let found = (Criterion::Order, "q");
        mutant(name, Base::Top, Defect::Wiring(from, to), galerkin, found)
    });
    nodal.chain(galerkin).collect()
}
