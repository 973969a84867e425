//! The work that loads, motors, dampers and prescribed motions do along a run, summed over all
//! steps.
//!
//! ```text
//! forces       Σ (f_d^- + f_d^+)·Δq/h                      over the (sub-)steps
//!              Σ h Σ_k b_k f(Q_k, V_k)·V_k                 over the steps of a Galerkin scheme
//! constraints  −Σ b_n·v_n,  b_n = p̄_n + BᵀΛ_n + D_1 L_d + f_d^-    over the nodes: b_n = h Gᵀλ, the force is −Gᵀλ
//!              −Σ_i w_i·V(c̃_i)                            over the control points of a Galerkin step [2.26]
//!              −(p̄_N − ᵠp_N)·v̂_N                           the first half of the impulse of the last node
//! contacts     Σ ½ Λ·(U⁺ + U⁻)                         over the nodes, those at touches too
//! ```
//! `v_n` is interpolated between the velocities `Δq/h` of the steps beside the node. Between the
//! sub-steps of a composition, whose lengths differ in size and sign, it is moved onto
//! `G v_n = −∂g/∂t`: the work is then `h λ_n·∂g/∂t`, as it is of the exact motion, and keeps the
//! order of the composition. Constraints that do not depend on time do no work, so the second line
//! is summed for prescribed motions alone. The energy changes by the sum to the order of the scheme
//! (theory: discrete Lagrange–d'Alembert principle).

use crate::run::run_state::{Impulse, same_length};
use vi_constraints::Constraints;
use vi_constraints::discretization::Step;
use vi_constraints::galerkin::GaussPoint;
use vi_constraints::integrator::ResumeError;
use vi_constraints::least_norm::LeastNorm;
use vi_constraints::node::Node;
use vi_constraints::nonsmooth::Nonsmooth;
use vi_core::interpolation::StepPolynomial;
use vi_core::linear::dot;
use vi_core::{
    Configuration, DiscreteLagrangian, Entries, MechanicalSystem, SeparableSystem, SparseMatrix,
};
use vi_emscheme::EmSystem;
use vi_multibody::mechanism::Mechanism;

/// The work up to the present node and up to the one before.
#[derive(Clone, Debug)]
pub(crate) struct StepperWork {
    force: Vec<f64>,            // n  scratch
    rates: Vec<f64>,            // m  ∂g/∂t, scratch
    pub(super) parts: Vec<f64>, // J  of each force, of each contact, of all prescribed motions
    balances: Vec<Vec<f64>>,    // (s + 1) × n  w_i of a Galerkin step, scratch
    before: Vec<f64>,           // J  the same up to the node before
    // of the present node and the one before; None without prescribed motions
    node: Option<[Impulse; 2]>,
    velocity: Option<Box<DrivenVelocity>>, // of composed steps with prescribed motions
}

/// Moves a velocity onto `G v = −∂g/∂t` by a change that is not much larger than the least one.
#[derive(Debug, Default)]
struct DrivenVelocity {
    rates: Vec<f64>,  // m
    v: Vec<f64>,      // n
    change: Vec<f64>, // n
    jacobian: Option<SparseMatrix>,
    least: LeastNorm,
}

/// All of it is scratch.
impl Clone for DrivenVelocity {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl DrivenVelocity {
    /// At the start of a step, from the velocity in `self.v`. What cannot be moved stays:
    /// constraints that are about to lose rank.
    fn correct(&mut self, mechanism: &Mechanism, at: Configuration<'_>) {
        let Self { rates, v, change, jacobian, least } = self;
        rates.resize(mechanism.len(), 0.0);
        change.resize(v.len(), 0.0);
        mechanism.time_derivative(at.t, at.q, rates);
        let shape = (mechanism.len(), mechanism.dim());
        let emit = |out: &mut dyn Entries| mechanism.jacobian(at.t, at.q, out);
        let jacobian = SparseMatrix::update(jacobian, shape, emit);
        jacobian.mul_add(1.0, v, rates);
        if least.particular(jacobian, rates, change).is_ok() {
            v.iter_mut().zip(&*change).for_each(|(v, change)| *v -= change);
        }
    }
}

impl StepperWork {
    /// From the start with momentum `p` and velocity `v`, of so many `forces` and contacts;
    /// `driven`: some motion is prescribed, and by whose steps it is followed: `composed` ones.
    pub(crate) fn new(p: &[f64], v: &[f64], forces: usize, driven: bool, composed: bool) -> Self {
        let start = Impulse { p: p.to_vec(), v: v.to_vec(), h: 0.0 };
        let node = driven.then(|| [start.clone(), start]);
        let parts = vec![0.0; forces + 1];
        let (force, before) = (vec![0.0; p.len()], parts.clone());
        let velocity = (driven && composed).then(Box::default);
        Self { force, rates: Vec::new(), balances: Vec::new(), before, parts, node, velocity }
    }

    /// A macro step begins.
    pub(crate) fn begin(&mut self) {
        self.before.copy_from_slice(&self.parts);
        if let Some([now, stored]) = &mut self.node {
            stored.copy_from(now);
        }
    }

    /// It was refused.
    pub(crate) fn take_back(&mut self) {
        self.parts.copy_from_slice(&self.before);
        if let Some([now, stored]) = &mut self.node {
            now.copy_from(stored);
        }
    }

    /// The impulse of the present node, with prescribed motions.
    pub(crate) fn impulse(&self) -> Option<&Impulse> {
        self.node.as_ref().map(|[now, _]| now)
    }

    /// Continues from the work up to a node and the impulse there.
    ///
    /// # Errors
    /// [`ResumeError::Shape`].
    pub(crate) fn resume(
        &mut self,
        parts: Vec<f64>,
        impulse: Option<Impulse>,
    ) -> Result<(), ResumeError> {
        let size =
            |node: Option<&Impulse>| node.map_or([0, 0], |node| [node.p.len(), node.v.len()]);
        let [given, own] = [size(impulse.as_ref()), size(self.impulse())];
        same_length("the impulse", given[0], own[0])?;
        same_length("the velocity of the impulse", given[1], own[1])?;
        same_length("the list of works", parts.len(), self.parts.len())?;
        (self.before, self.parts) = (parts.clone(), parts);
        self.node = impulse.map(|now| [now.clone(), now]);
        Ok(())
    }

    /// Adds a (sub-)step of an energy–momentum scheme.
    pub(super) fn add_em(&mut self, system: &EmSystem, mechanism: &Mechanism, step: Step<'_>) {
        let Step { s, multipliers, .. } = step;
        system.add_work(s, &mut self.force, &mut self.parts);
        if mechanism.is_rheonomic() {
            // prescribed motions do h λ·∂g/∂t, with μ = h²λ
            self.rates.resize(multipliers.len(), 0.0);
            mechanism.time_derivative(s.t_mid(), &s.q_mid, &mut self.rates);
            let power: f64 = multipliers.iter().zip(&self.rates).map(|(mu, rate)| mu * rate).sum();
            self.add_motions(power / s.h);
        }
    }

    /// Adds a (sub-)step of a variational scheme.
    pub(crate) fn add(&mut self, system: &SeparableSystem, mechanism: &Mechanism, step: Step<'_>) {
        let Step { s, gauss, polynomial, impulse, .. } = step;
        if let Some(polynomial) = polynomial {
            system.add_interpolated_work(&polynomial, &mut self.parts);
            for node in gauss {
                let scale = s.h * node.weight;
                system.add_power(
                    node.place(s).moving(&node.v),
                    scale,
                    &mut self.force,
                    &mut self.parts,
                );
            }
            self.add_motions_of_polynomial(system, &polynomial, gauss);
            return;
        }
        system.add_work(s, &mut self.force, &mut self.parts);
        let Some([node, _]) = &mut self.node else { return };
        system.forced_d1(s, &mut self.force);
        self.force.iter_mut().zip(impulse).for_each(|(b, impulse)| *b += impulse);
        let weight = if node.h == 0.0 { 0.0 } else { node.h / (node.h + s.h) };
        let between = |i: usize| node.v[i] + weight * (s.v_mid[i] - node.v[i]);
        let mut constraints = 0.0;
        if let Some(velocity) = &mut self.velocity {
            velocity.v.clear();
            velocity.v.extend((0..node.v.len()).map(between));
            velocity.correct(mechanism, s.start());
            for ((p, b), v) in node.p.iter().zip(&self.force).zip(&velocity.v) {
                constraints -= (p + b) * v;
            }
        } else {
            for (i, b) in self.force.iter().enumerate() {
                constraints -= (node.p[i] + b) * between(i);
            }
        }
        system.forced_d2(s, &mut node.p);
        node.v.copy_from_slice(&s.v_mid);
        node.h = s.h;
        self.add_motions(constraints);
    }

    /// Adds the work of contacts in a macro step.
    pub(crate) fn add_contacts(&mut self, contacts: &Nonsmooth) {
        let first = self.parts.len() - 1 - contacts.elements().len();
        for contact in contacts.nodes().flat_map(|(_, contacts)| contacts) {
            self.parts[first + contact.id.element as usize] += contact.work;
        }
    }

    /// Adds the work of prescribed motions in a Galerkin step: `−Σ_i w_i·V(c̃_i)`, `w_i` [2.26].
    fn add_motions_of_polynomial(
        &mut self,
        system: &SeparableSystem,
        polynomial: &StepPolynomial<'_>,
        gauss: &[GaussPoint],
    ) {
        let Self { force, balances, node, .. } = self;
        let Some([node, _]) = node else { return };
        let (s, h, constants) = (polynomial.stages(), polynomial.h(), polynomial.constants);
        balances.resize_with(s + 1, || vec![0.0; force.len()]);
        balances.iter_mut().for_each(|w| w.fill(0.0));
        balances[0].copy_from_slice(&node.p);
        for (k, at) in gauss.iter().enumerate() {
            force.fill(0.0);
            system.add_gauss_force(at.place(polynomial.step()).moving(&at.v), force);
            for (i, w) in balances.iter_mut().enumerate() {
                let impulse = h * at.weight * constants.E[(k, i)];
                w.iter_mut().zip(&*force).for_each(|(w, f)| *w += impulse * f);
            }
        }
        if let Some(strains) = system.interpolation() {
            strains.add_impulses(polynomial, balances);
        }
        let mut constraints = 0.0;
        for (i, w) in balances.iter_mut().enumerate() {
            for (j, point) in (1..).zip(polynomial.points) {
                system.mass().mul_add(constants.K[(i, j)] / h, &point.dq, w);
            }
            force.fill(0.0); // V(c̃_i)
            for (j, point) in (1..).zip(polynomial.points) {
                let rate = constants.lagrange_rate(j, constants.nodes[i]) / h;
                force.iter_mut().zip(&point.dq).for_each(|(v, dq)| *v += rate * dq);
            }
            if i == s {
                break; // with the next step
            }
            let before = match i {
                0 if node.h == 0.0 => 1.0, // the initial velocity is that of the node
                0 => 0.5,
                _ => 0.0,
            };
            for ((w, v), last) in w.iter().zip(&*force).zip(&node.v) {
                constraints -= w * (v + before * (last - v));
            }
        }
        node.p.copy_from_slice(&balances[s]);
        node.v.copy_from_slice(force);
        node.h = h;
        self.add_motions(constraints);
    }

    /// Adds the work of prescribed motions.
    fn add_motions(&mut self, work: f64) {
        self.parts.last_mut().into_iter().for_each(|motions| *motions += work);
    }

    /// `work ←` that of each force, and of all prescribed motions, up to the present node, J, or up
    /// to the one `before`; `node`: that node, read.
    pub(crate) fn at(&self, before: bool, node: &Node, work: &mut Vec<f64>) {
        work.clone_from(if before { &self.before } else { &self.parts });
        if let (Some(motions), Some(_)) = (work.last_mut(), &self.node) {
            *motions += dot(&node.p_projected, &node.v) - dot(&node.p_bar, &node.v);
        }
    }
}

impl Impulse {
    fn copy_from(&mut self, other: &Self) {
        self.p.copy_from_slice(&other.p);
        self.v.copy_from_slice(&other.v);
        self.h = other.h;
    }
}
