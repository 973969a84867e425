//! What an integrator reports at a node, against the equations of motion along its own configurations.
//!
//! ```text
//! v_n = (q_{n+1} − q_{n−1})/2h,    a_n = (q_{n+1} − 2 q_n + q_{n−1})/h²          of second order in h
//! p, p_n         against M v_n
//! λ_n            |M a_n + ∇V(q_n) − f(t_n, q_n, v_n) + G(q_n)ᵀ λ_n|
//! reactions      Newton and Euler of each body, [`super::equations`]
//! H_d            against ½ v_nᵀ M v_n + V(q_n)
//! E_d            against ½ Δqᵀ M Δq/h² + ½ (V(q_n) + V(q_{n+1}))
//! J              against J(q_n, M v_n)
//! |g|            against |g(q_n)|
//! ```
//! All differences but the last go to zero like `h²` at every order of the scheme, since the differences of `q` do. Something
//! that is reported wrongly by a factor or a sign does not go to zero. The check needs no reference, so an integrator that is
//! wrong in the reference as well is found, and so is one that solves other equations.

use super::fit::power_law;
use super::order::{ErrorAt, NoOrder};
use super::subject::{Invariants, Method, Motion, Setting, Subject, Values};
use vi_core::Configuration;
use vi_core::linear::norm_inf;
use vi_core::momentum_map::Momentum;

/// Steps sizes, each half of the one before.
const LEVELS: u32 = 5;
/// Nodes at which outputs are compared, for each size.
const NODES: u64 = 4;
/// Steps from one of them to the next with the largest size.
const APART: u64 = 3;
/// Orders above this count as second: roughness of the fit is allowed for.
pub const LEAST_ORDER: f64 = 1.6;
/// Below this a difference is round-off of second differences.
const ROUND_OFF: f64 = 1e-9;

/// What is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Output {
    /// The projected momentum (40), or `M v_n`.
    Momentum,
    /// The constrained Legendre transform `p_n` (34).
    ConstrainedMomentum,
    /// `λ_n` (36), or the mean of two energy–momentum steps.
    Multiplier,
    /// `λ` of the acceleration level.
    OtherMultiplier,
    /// Forces and moments in joints.
    Reactions,
    /// `H_d` (53).
    Energy,
    /// `E_d` (52).
    DiscreteEnergy,
    /// Linear and angular momentum.
    MomentumMaps,
    /// The residual of `g`.
    Residual,
}

impl Output {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Momentum,
        Self::ConstrainedMomentum,
        Self::Multiplier,
        Self::OtherMultiplier,
        Self::Reactions,
        Self::Energy,
        Self::DiscreteEnergy,
        Self::MomentumMaps,
        Self::Residual,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Momentum => "p against M (q_{n+1} − q_{n−1})/2h",
            Self::ConstrainedMomentum => "p of (34) against M (q_{n+1} − q_{n−1})/2h",
            Self::Multiplier => "equations of motion with λ",
            Self::OtherMultiplier => "equations of motion with λ of the acceleration level",
            Self::Reactions => "equilibrium of each body with the joint reactions",
            Self::Energy => "H against T + V",
            Self::DiscreteEnergy => "E_d against T + V of the step",
            Self::MomentumMaps => "momentum maps against J(q, M v)",
            Self::Residual => "reported |g| against |g(q)|",
        }
    }
}

impl Output {
    /// Differences below this are round-off.
    fn floor(self) -> f64 {
        if self.may_converge() { ROUND_OFF } else { 1e-15 }
    }

    /// Whether the difference is that of the quotients of `q`; else the same number is evaluated twice.
    pub(super) fn may_converge(self) -> bool {
        self != Self::Residual
    }

    /// What is asked of the difference.
    pub(super) fn expected(self) -> &'static str {
        if self.may_converge() { "order 2 in h, or round-off" } else { "≤ 1e-15" }
    }
}

/// Relative differences of an output at decreasing steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Which.
    pub output: Output,
    /// The differences.
    pub errors: Vec<ErrorAt>,
}

impl Compared {
    /// The order with which the differences vanish.
    ///
    /// # Errors
    /// [`NoOrder::Exact`] where they are round-off throughout, [`NoOrder::NotNumbers`].
    pub fn order(&self) -> Result<f64, NoOrder> {
        let largest = norm_inf(&self.errors.iter().map(|e| e.error).collect::<Vec<f64>>());
        if !largest.is_finite() {
            return Err(NoOrder::NotNumbers);
        }
        if largest <= self.output.floor() {
            return Err(NoOrder::Exact { largest });
        }
        if !self.output.may_converge() {
            return Ok(0.0);
        }
        // round-off of second differences grows as the step shrinks: what has stopped falling near it is left out
        let clear = |e: &&ErrorAt| e.error > 10.0 * self.output.floor();
        let points: Vec<[f64; 2]> =
            self.errors.iter().take_while(clear).map(|e| [e.step, e.error]).collect();
        match power_law(points.iter().copied()) {
            Some(law) if points.len() >= 2 => Ok(law.exponent),
            _ => Err(NoOrder::Exact { largest: self.errors[self.errors.len() - 1].error }),
        }
    }
}

/// Three configurations at equal distances with what is reported at the middle one.
struct Window {
    q: [Vec<f64>; 3],
    t: f64,
    h: f64,
    values: Values,
    invariants: Invariants,
}

/// Compares every output at steps `h`, `h/2`, … of a method.
///
/// # Errors
/// Why the method does not apply or a step failed, in words.
pub fn outputs(subject: &dyn Subject, setting: Setting) -> Result<Vec<Compared>, String> {
    let mut found: Vec<Compared> =
        Output::ALL.map(|output| Compared { output, errors: Vec::new() }).into();
    for level in 0..LEVELS {
        let parts = 1_u64 << level;
        let step = setting.step / parts as f64;
        let mut motion = subject.start(Setting { step, ..setting })?;
        let (mut off, mut size) = (vec![0.0; found.len()], vec![0.0; found.len()]);
        for _ in 0..NODES {
            let window = window(&mut *motion, APART * parts, step)?;
            let differences = differences(&*motion, &window);
            for (k, (error, of)) in differences.into_iter().enumerate() {
                (off[k], size[k]) = (norm_inf(&[off[k], error]), norm_inf(&[size[k], of]));
            }
        }
        for ((compared, error), size) in found.iter_mut().zip(off).zip(size) {
            // an output that is not there, or zero throughout, has no size
            if size > 1e-12 {
                compared.errors.push(ErrorAt { step, error: error / size });
            } else if !error.is_finite() {
                compared.errors.push(ErrorAt { step, error });
            }
        }
    }
    found.retain(|compared| compared.errors.len() as u32 == LEVELS);
    if matches!(setting.method, Method::EnergyMomentum(_)) {
        // there is only one energy, and the multiplier of a single step is of first order
        found.retain(|c| !matches!(c.output, Output::DiscreteEnergy | Output::OtherMultiplier));
    }
    Ok(found)
}

/// Goes on by `steps` steps and looks at the last node but one.
fn window(motion: &mut dyn Motion, steps: u64, h: f64) -> Result<Window, String> {
    for _ in 1..steps {
        motion.step()?;
    }
    let first = motion.q().to_vec();
    motion.step()?;
    let values = motion.values()?;
    let (t, middle) = (motion.time(), motion.q().to_vec());
    motion.step()?;
    Ok(Window {
        q: [first, middle, motion.q().to_vec()],
        t,
        h,
        values,
        invariants: motion.invariants()?,
    })
}

/// Difference and size of each output, in the order of [`Output::ALL`]; `(0, 0)` where there is none.
fn differences(motion: &dyn Motion, at: &Window) -> [(f64, f64); 9] {
    let equations = motion.equations();
    let ([before, q, after], h) = (&at.q, at.h);
    let each = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..q.len()).map(of).collect() };
    let v = each(&|i| (after[i] - before[i]) / (2.0 * h));
    let a = each(&|i| ((after[i] - q[i]) - (q[i] - before[i])) / (h * h));
    let (values, reported, here) = (&at.values, &at.invariants, Configuration::new(at.t, q));
    let momentum = equations.momentum(&v);
    let demand = equations.demand(here, &v, &a);
    let against = |found: &[f64], expected: &[f64]| {
        let off: Vec<f64> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
        (norm_inf(&off), norm_inf(expected))
    };
    let optional = |found: &Option<Vec<f64>>, expected: &[f64]| {
        found.as_ref().map_or((0.0, 0.0), |found| against(found, expected))
    };
    let balance = |lambda: &Option<Vec<f64>>| {
        let lambda = lambda.as_ref()?;
        let force = equations.constraint_force(here, lambda);
        let rest: Vec<f64> = demand.iter().zip(&force).map(|(d, f)| d + f).collect();
        Some((norm_inf(&rest), norm_inf(&demand).max(norm_inf(&equations.momentum(&a)))))
    };
    let reactions = values.reactions.as_ref().map(|r| {
        let missing = equations.unsupported(here, &demand, &r.lambda, &r.joints);
        let size = norm_inf(r.joints.as_flattened());
        (norm_inf(missing.as_flattened()), size.max(norm_inf(&demand)))
    });
    let step: Vec<f64> = each(&|i| (after[i] - q[i]) / h);
    let zero = vec![0.0; q.len()];
    let potential = |q: &[f64]| equations.energy(q, &zero);
    let kinetic = equations.energy(q, &step) - potential(q);
    let of_step = kinetic + 0.5 * (potential(q) + potential(after));
    let residual = equations.residual(here);
    [
        against(&values.p, &momentum),
        optional(&values.p_constrained, &momentum),
        balance(&values.lambda).unwrap_or_default(),
        balance(&values.lambda_other).unwrap_or_default(),
        reactions.unwrap_or_default(),
        (reported.energy - equations.energy(q, &v), reported.energy_size),
        (reported.discrete_energy - of_step, reported.energy_size),
        maps(&reported.momentum, &equations.momentum_map(q, &momentum), &reported.momentum_size),
        (reported.position - residual, 1.0 + norm_inf(q).powi(2)),
    ]
    .map(|(off, size): (f64, f64)| (off.abs(), size))
}

fn maps(found: &Momentum, expected: &Momentum, size: &Momentum) -> (f64, f64) {
    let of = |m: &Momentum| [m.linear, m.angular].concat();
    let off: Vec<f64> = of(found).iter().zip(of(expected)).map(|(a, b)| a - b).collect();
    (norm_inf(&off), norm_inf(&of(size)))
}
