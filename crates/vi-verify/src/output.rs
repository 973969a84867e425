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
//!
//! Coordinates are rounded, so the quotients are known to `|δv| ≤ ε|q|/2h` and `|δa| ≤ 2ε|q|/h²`: differences that are not
//! clearly above `M δv` and `M δa` say nothing.

use super::fit::power_law;
use super::order::{AMPLIFIED, CLEAR, ErrorAt, NoOrder};
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
/// Below this a difference is round-off, whatever the coordinates.
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
    /// What rounding of the coordinates makes of each, relative as well.
    pub rounding: Vec<f64>,
}

impl Compared {
    /// The order with which the differences vanish.
    ///
    /// # Errors
    /// [`NoOrder::Exact`] where they are round-off throughout, [`NoOrder::RoundOff`] where round-off is too large for
    /// that to say something, [`NoOrder::NotNumbers`].
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
        // round-off grows as the step shrinks: what has stopped falling near it is left out
        let floors = self.rounding.iter().map(|rounding| rounding.max(self.output.floor()));
        let points: Vec<[f64; 2]> = self
            .errors
            .iter()
            .zip(floors)
            .take_while(|(e, floor)| e.error > CLEAR * floor)
            .map(|(e, _)| [e.step, e.error])
            .collect();
        match power_law(points.iter().copied()) {
            Some(law) if points.len() >= 2 => Ok(law.exponent),
            _ if largest > AMPLIFIED => Err(NoOrder::RoundOff { largest }),
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
        Output::ALL.map(|output| Compared { output, errors: vec![], rounding: vec![] }).into();
    for level in 0..LEVELS {
        let parts = 1_u64 << level;
        let step = setting.step / parts as f64;
        let mut motion = subject.start(Setting { step, ..setting })?;
        let mut largest = [Difference::default(); 9];
        for _ in 0..NODES {
            let window = window(&mut *motion, APART * parts, step)?;
            for (largest, here) in largest.iter_mut().zip(differences(&*motion, &window)) {
                *largest = largest.larger(here);
            }
        }
        for (compared, Difference { off, size, rounding }) in found.iter_mut().zip(largest) {
            // an output that is not there, or zero throughout, has no size
            if size > 1e-12 {
                compared.errors.push(ErrorAt { step, error: off / size });
                compared.rounding.push(rounding / size);
            } else if !off.is_finite() {
                compared.errors.push(ErrorAt { step, error: off });
                compared.rounding.push(0.0);
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

/// Of an output from what is expected; all zero where there is no output.
#[derive(Clone, Copy, Debug, Default)]
struct Difference {
    off: f64,
    size: f64,     // of the output
    rounding: f64, // of the coordinates, what it makes
}

impl Difference {
    /// The larger of each number; not a number where one of both is none.
    fn larger(self, other: Self) -> Self {
        let larger = |a: f64, b: f64| norm_inf(&[a, b]);
        Self {
            off: larger(self.off, other.off),
            size: larger(self.size, other.size),
            rounding: larger(self.rounding, other.rounding),
        }
    }
}

/// The difference of each output, in the order of [`Output::ALL`].
fn differences(motion: &dyn Motion, at: &Window) -> [Difference; 9] {
    let equations = motion.equations();
    let ([before, q, after], h) = (&at.q, at.h);
    let each = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..q.len()).map(of).collect() };
    let v = each(&|i| (after[i] - before[i]) / (2.0 * h));
    let a = each(&|i| ((after[i] - q[i]) - (q[i] - before[i])) / (h * h));
    let (values, reported, here) = (&at.values, &at.invariants, Configuration::new(at.t, q));
    let momentum = equations.momentum(&v);
    let demand = equations.demand(here, &v, &a);
    let mass = norm_inf(&equations.momentum(&vec![1.0; q.len()]));
    let rounding = f64::EPSILON * norm_inf(q) * mass;
    let (of_v, of_a) = (rounding / (2.0 * h), 2.0 * rounding / (h * h));
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
    let found = [
        against(&values.p, &momentum),
        optional(&values.p_constrained, &momentum),
        balance(&values.lambda).unwrap_or_default(),
        balance(&values.lambda_other).unwrap_or_default(),
        reactions.unwrap_or_default(),
        (reported.energy - equations.energy(q, &v), reported.energy_size),
        (reported.discrete_energy - of_step, reported.energy_size),
        maps(&reported.momentum, &equations.momentum_map(q, &momentum), &reported.momentum_size),
        (reported.position - residual, 1.0 + norm_inf(q).powi(2)),
    ];
    let rounding = [of_v, of_v, of_a, of_a, of_a, 0.0, 0.0, 0.0, 0.0];
    std::array::from_fn(|k| {
        let (off, size): (f64, f64) = found[k];
        Difference { off: off.abs(), size, rounding: rounding[k] }
    })
}

fn maps(found: &Momentum, expected: &Momentum, size: &Momentum) -> (f64, f64) {
    let of = |m: &Momentum| [m.linear, m.angular].concat();
    let off: Vec<f64> = of(found).iter().zip(of(expected)).map(|(a, b)| a - b).collect();
    (norm_inf(&off), norm_inf(&of(size)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Differences `error(h)` at `h = 2^-k/1000`, with rounding of coordinates of 8 m in second differences.
    fn compared(error: impl Fn(f64) -> f64) -> Compared {
        let steps = (0..5).map(|k| 1e-3 * 0.5_f64.powi(k));
        let rounding = |h: f64| 16.0 * f64::EPSILON / (h * h) / 50.0;
        Compared {
            output: Output::Multiplier,
            errors: steps.clone().map(|step| ErrorAt { step, error: error(step) }).collect(),
            rounding: steps.map(rounding).collect(),
        }
    }

    #[test]
    fn rounding_of_coordinates_is_not_taken_for_an_order() {
        let found = compared(|h| 2.0 * h * h + 16.0 * f64::EPSILON / (h * h) / 50.0);
        let order = found.order().unwrap();
        let unaware = Compared { rounding: vec![0.0; 5], ..found }.order().unwrap();
        println!("order {order:.3}, {unaware:.3} with all differences");
        assert!((order - 2.0).abs() < 0.02 && unaware < order - 0.3);
    }

    #[test]
    fn a_wrong_factor_has_no_order() {
        let order = compared(|_| 1e-2).order().unwrap();
        assert!(order.abs() < 1e-12, "{order}");
    }

    #[test]
    fn differences_below_rounding_say_nothing() {
        let far = Compared { rounding: vec![1e-2; 5], ..compared(|h| h) };
        assert_eq!(far.order(), Err(NoOrder::RoundOff { largest: 1e-3 }));
        let exact = compared(|_| 1e-12);
        assert_eq!(exact.order(), Err(NoOrder::Exact { largest: 1e-12 }));
    }
}
