//! What an integrator reports at a node, against the equations of motion along its own
//! configurations.
//!
//! ```text
//! v_n            first central difference of q_{n−w} … q_{n+w} over h              of order 2w in h
//! a_n            second central difference over h²                                of order 2w
//! p, p_n         against M v_n
//! λ_n            |M a_n + ∇V(q_n) − f(t_n, q_n, v_n) + G(q_n)ᵀ λ_n|
//! reactions      Newton and Euler of each body, [`super::equations`]
//! H_d            against ½ v_nᵀ M v_n + V(q_n)
//! E_d            the same; at order 2, and where forces or motions do work, ½ Δqᵀ M Δq/h² + ½ (V(q_n) + V(q_{n+1}))
//! J              against J(q_n, M v_n)
//! |g|            against |g(q_n)|
//! ```
//! The differences have the order of the scheme, `p = 2w`, so that all but the last go to zero like
//! `h^p` (`E_d` where work is done like `h²`). Something that is reported wrongly by a factor or a
//! sign does not go to zero, and something of a lower order does so too slowly. The check needs no
//! reference, so an integrator that is wrong in the reference as well is found, and so is one that
//! solves other equations.
//!
//! Forces are compared with the largest of those that act, inertia, potential and loads: reactions
//! may be zero.
//!
//! Coordinates are rounded, so the quotients are known to `|δv| ≤ ε|q| Σ|c_k|/kh` and
//! `|δa| ≤ 4ε|q| Σ|c_k|/k²h²` ([`Stencil`]): differences that are not clearly above `M δv` and
//! `M δa` say nothing, and an output that is not clearly above them is zero.

use super::fit::power_law;
use super::order::{AMPLIFIED, CLEAR, ErrorAt, NoOrder};
use super::subject::{
    Invariants, NodeValues, RunningMotion, SchemeSetting, SteppingMethod, Subject,
};
use vi_core::Configuration;
use vi_core::linear::norm_inf;
use vi_core::momentum_map::Momentum;

/// Steps sizes, each half of the one before.
const LEVELS: u32 = 5;
/// Nodes at which outputs are compared, for each size.
const NODES: u64 = 4;
/// Steps from one of them to the next with the largest size, at least.
const APART: u64 = 3;
/// Orders of at least this part of the nominal one count: roughness of the fit is allowed for.
pub const LEAST_ORDER: f64 = 0.8;
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
            Self::Momentum => "p against M v of the configurations",
            Self::ConstrainedMomentum => "p of (34) against M v of the configurations",
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

    /// Whether the difference is that of the quotients of `q`; else the same number is evaluated
    /// twice.
    pub(super) fn may_converge(self) -> bool {
        self != Self::Residual
    }
}

/// Weights of central differences over `2w + 1` nodes.
///
/// ```text
/// c_k = (−1)^{k+1} (w!)² / ((w − k)! (w + k)!)
/// v_n = Σ_k c_k/k (q_{n+k} − q_{n−k}) / h
/// a_n = Σ_k 2c_k/k² ((q_{n+k} − q_n) − (q_n − q_{n−k})) / h²         both of order 2w
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Stencil {
    first: Vec<f64>,  // c_k/k
    second: Vec<f64>, // 2c_k/k²
}

impl Stencil {
    /// Of an even order.
    #[must_use]
    pub fn of_order(order: u32) -> Self {
        let w = (order / 2).max(1);
        let mut c = -1.0; // c_0 with its sign
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for k in 1..=w {
            c *= -f64::from(w + 1 - k) / f64::from(w + k);
            first.push(c / f64::from(k));
            second.push(2.0 * c / f64::from(k * k));
        }
        Self { first, second }
    }

    /// `w`.
    fn width(&self) -> usize {
        self.first.len()
    }

    /// `v_n` and `a_n` at the middle of `2w + 1` configurations.
    fn rates(&self, q: &[Vec<f64>], h: f64) -> (Vec<f64>, Vec<f64>) {
        let (w, n) = (self.width(), q[0].len());
        let (mut v, mut a) = (vec![0.0; n], vec![0.0; n]);
        for k in 1..=w {
            let (before, here, after) = (&q[w - k], &q[w], &q[w + k]);
            for i in 0..n {
                v[i] += self.first[k - 1] * (after[i] - before[i]) / h;
                let bend = (after[i] - here[i]) - (here[i] - before[i]);
                a[i] += self.second[k - 1] * bend / (h * h);
            }
        }
        (v, a)
    }

    /// What rounding of coordinates by `1` makes of `v_n` and `a_n`.
    fn rounding(&self, h: f64) -> (f64, f64) {
        let sum = |weights: &[f64]| weights.iter().map(|c| c.abs()).sum::<f64>();
        (sum(&self.first) / h, 2.0 * sum(&self.second) / (h * h))
    }
}

/// Relative differences of an output at decreasing steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Which.
    pub output: Output,
    /// The order with which they should vanish.
    pub nominal: u32,
    /// The differences.
    pub errors: Vec<ErrorAt>,
    /// What rounding of the coordinates makes of each, relative as well.
    pub rounding: Vec<f64>,
}

impl Compared {
    /// What is asked of the differences.
    pub(super) fn expected(&self) -> String {
        match self.output.may_converge() {
            true => format!("order {} in h, or round-off", self.nominal),
            false => "≤ 1e-15".into(),
        }
    }

    /// The order with which the differences vanish.
    ///
    /// # Errors
    /// [`NoOrder::Exact`] where they are round-off throughout, [`NoOrder::RoundOff`] where
    /// round-off is too large for that to say something, [`NoOrder::NotNumbers`].
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

/// Configurations at equal distances with what is reported at the middle one.
struct Window {
    q: Vec<Vec<f64>>,
    t: f64,
    h: f64,
    values: NodeValues,
    invariants: Invariants,
}

/// Compares every output at steps `h`, `h/2`, … of a method.
///
/// # Errors
/// Why the method does not apply or a step failed, in words.
pub fn outputs(subject: &dyn Subject, setting: SchemeSetting) -> Result<Vec<Compared>, String> {
    let stencil = Stencil::of_order(setting.order);
    let apart = APART.max(2 * stencil.width() as u64);
    let of_node = setting.order > 2 && is_conservative(subject, setting, apart)?;
    let nominal = |output| match output {
        Output::DiscreteEnergy if !of_node => 2,
        _ => setting.order,
    };
    let empty =
        |output| Compared { output, nominal: nominal(output), errors: vec![], rounding: vec![] };
    let mut found: Vec<Compared> = Output::ALL.map(empty).into();
    for level in 0..LEVELS {
        let parts = 1_u64 << level;
        let step = setting.step / parts as f64;
        let mut motion = subject.start(SchemeSetting { step, ..setting })?;
        let mut largest = [Difference::default(); 9];
        for _ in 0..NODES {
            let window = window(&mut *motion, apart * parts, stencil.width(), step)?;
            let here = differences(&*motion, &window, &stencil, of_node);
            largest.iter_mut().zip(here).for_each(|(most, here)| *most = most.larger(here));
        }
        for (compared, Difference { off, size, rounding }) in found.iter_mut().zip(largest) {
            // an output that is not there, or zero throughout, has no size
            if compared.errors.len() as u32 == level && (level > 0 || size > CLEAR * rounding) {
                compared.errors.push(ErrorAt { step, error: off / size });
                compared.rounding.push(rounding / size);
            } else if !off.is_finite() {
                compared.errors.push(ErrorAt { step, error: off });
                compared.rounding.push(0.0);
            }
        }
    }
    found.retain(|compared| compared.errors.len() as u32 == LEVELS);
    if matches!(setting.method, SteppingMethod::EnergyMomentum(_)) {
        // there is only one energy, and the multiplier of a single step is of first order
        found.retain(|c| !matches!(c.output, Output::DiscreteEnergy | Output::OtherMultiplier));
    }
    Ok(found)
}

/// Whether no work is done at any of the nodes that are looked at.
fn is_conservative(
    subject: &dyn Subject,
    setting: SchemeSetting,
    apart: u64,
) -> Result<bool, String> {
    let mut motion = subject.start(setting)?;
    let mut conservative = motion.nature()?.conservative;
    for _ in 0..NODES {
        (0..apart).try_for_each(|_| motion.step())?;
        conservative &= motion.nature()?.conservative;
    }
    Ok(conservative)
}

/// Goes on by `steps` steps and looks at the node `width` steps before the last.
fn window(
    motion: &mut dyn RunningMotion,
    steps: u64,
    width: usize,
    h: f64,
) -> Result<Window, String> {
    let apart = steps - 2 * width as u64;
    (0..apart).try_for_each(|_| motion.step())?;
    let mut q = vec![motion.q().to_vec()];
    let mut go_on = |motion: &mut dyn RunningMotion, count: usize| -> Result<(), String> {
        for _ in 0..count {
            motion.step()?;
            q.push(motion.q().to_vec());
        }
        Ok(())
    };
    go_on(motion, width)?;
    let (values, t) = (motion.values()?, motion.time());
    go_on(motion, 1)?;
    let invariants = motion.invariants()?;
    go_on(motion, width - 1)?;
    Ok(Window { q, t, h, values, invariants })
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

/// The difference of each output, in the order of [`Output::ALL`]; `of_node`: `E_d` against the
/// energy of the node.
fn differences(
    motion: &dyn RunningMotion,
    at: &Window,
    stencil: &Stencil,
    of_node: bool,
) -> [Difference; 9] {
    let equations = motion.equations();
    let (w, h) = (stencil.width(), at.h);
    let (q, after) = (&at.q[w], &at.q[w + 1]);
    let (v, a) = stencil.rates(&at.q, h);
    let (values, reported, here) = (&at.values, &at.invariants, Configuration::new(at.t, q));
    let momentum = equations.momentum(&v);
    let demand = equations.demand(here.moving(&v), &a);
    let acting = equations.acting(here.moving(&v), &a);
    let mass = norm_inf(&equations.momentum(&vec![1.0; q.len()]));
    let rounding = f64::EPSILON * norm_inf(q) * mass;
    let (of_v, of_a) = stencil.rounding(h);
    let (of_v, of_a) = (rounding * of_v, rounding * of_a);
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
        Some((norm_inf(&rest), acting.max(norm_inf(&force))))
    };
    let reactions = values.reactions.as_ref().map(|r| {
        let missing = equations.unsupported(here, &demand, &r.lambda, &r.joints);
        let size = norm_inf(r.joints.as_flattened());
        (norm_inf(missing.as_flattened()), size.max(acting))
    });
    let energy = equations.energy(q, &v);
    let of_step = || {
        let step: Vec<f64> = after.iter().zip(q).map(|(after, q)| (after - q) / h).collect();
        let zero = vec![0.0; q.len()];
        let potential = |q: &[f64]| equations.energy(q, &zero);
        let kinetic = equations.energy(q, &step) - potential(q);
        kinetic + 0.5 * (potential(q) + potential(after))
    };
    let residual = equations.residual(here);
    let found = [
        against(&values.p, &momentum),
        optional(&values.p_constrained, &momentum),
        balance(&values.lambda).unwrap_or_default(),
        balance(&values.lambda_other).unwrap_or_default(),
        reactions.unwrap_or_default(),
        (reported.energy - energy, reported.energy_size),
        (reported.discrete_energy - if of_node { energy } else { of_step() }, reported.energy_size),
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

    /// Differences `error(h)` at `h = 2^-k/1000`, with rounding of coordinates of 8 m in second
    /// differences.
    fn compared(error: impl Fn(f64) -> f64) -> Compared {
        let steps = (0..5).map(|k| 1e-3 * 0.5_f64.powi(k));
        let rounding = |h: f64| 16.0 * f64::EPSILON / (h * h) / 50.0;
        Compared {
            output: Output::Multiplier,
            nominal: 2,
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
