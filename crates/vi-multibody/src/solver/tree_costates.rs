//! [`CostateSweep`] of a tree of bodies, by the sweeps of its steps.
//!
//! Its formulas stand in `crate::sweep::costate`. Efforts along unknowns do the work `σ τ m_j` on
//! tangents, whatever the configuration: their gradients enter neither `w` nor, by their change,
//! `B` and `D`. The momentum that is held is therefore the one without them,
//! ```text
//! p̃_{n+1} = D_2 L_d + f_d^+ − Σ (h/2) τ ∇θ(q_{n+1}),   ∂((h/2) τ)/∂θ = κ_1 at q_n, κ_2 at q_{n+1}
//! c ∋ κ_2 β ∇θ(q_{n+1}),   a ∋ κ_1 (β − σ m_j) ∇θ(q_n)         β = ∇θ(q_{n+1})·b'
//! ```
//! and `β = −σ m_j'` of the step after it. Where loops are closed ([`LoopCostates`]), or costates
//! of joints are wanted ([`JointCostates`]), multipliers need the whole balance: `p̄` is held, and
//! the change of the gradients at `q_{n+1}` is a part of `c`. Along mechanisms next to this one the
//! curvature is that of `P` as well, and `crate::sweep::moved_joints` has what the joints give by
//! their geometry: `w` takes these efforts where `p̄` is held, and none of their gradients changes
//! where `p̃` is.
//!
//! Where impulses of constraints cost, `G μ = r` with `r = −∂J/∂(h λ)`:
//! ```text
//! μ = μ_J + P m,   G_J μ_J = r_J           K ᵀ m = P(q_{n+1})ᵀ (c − Aᵀ μ_J),   J m = r_c − G_c μ_J
//! ```
//! with any motion `μ_J` of rigid bodies; `m` and all that follows from `μ` are otherwise the same.

use super::along_unknowns::{EffortAlong, transposed};
use super::joint_costates::JointCostates;
use super::loop_costates::{LoopCostates, MOST_ROWS};
use super::tree_step::body_forces::BodyForces;
use super::tree_step::emitted::Emitted;
use super::tree_step::workspace::Workspace;
use crate::mechanism::Mechanism;
use crate::sweep::moved_joints::NUMBERS;
use crate::tree::Tree;
use vi_constraints::Constraints;
use vi_constraints::costate_sweep::{CostateSweep, CostateTangents, ImpulseCost, PartVisitor};
use vi_constraints::design::{Costates, Place};
use vi_constraints::linearization::{Costate, LinearizationError};
use vi_constraints::saddle_point::IndependentRows;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::{Interval, Slot};
use vi_core::linear::Singular;
use vi_core::sparse::{Block, Entries};
use vi_core::{DiscreteLagrangian, SeparableSystem};

/// The costates of trees that [`super::tree_step::TreeStep`] applies to, `O(N)`; of closed loops on
/// top of them with few independent rows.
#[derive(Debug)]
pub(in crate::solver) struct TreeCostates {
    tree: Tree,
    at: Workspace,
    along: Vec<EffortAlong>,
    loops: Option<LoopCostates>,
    joints: Option<JointCostates>,
    changes: Option<[Vec<f64>; 2]>, // of all links  Costates::moved
    by_rows: bool,                  // whether the last step has the multipliers of all joints
    ends: [bool; 2],                // whether the next step, and the last one, is that of the end
    other: Option<Emitted>,         // −h times the blocks of what else acts, transposed
    weight: Vec<f64>,               // n  constant forces
    w: Vec<f64>,                    // n
    mu: Vec<f64>,                   // n
    momentum: Vec<f64>,             // n  b'
    rest: Vec<f64>,                 // d  u = 0
    m: Vec<f64>,                    // d
    moved: Vec<f64>,                // n  μ_J
    wanted: Vec<f64>,               // of the constraints  r
    none: Vec<f64>,                 // of the constraints
}

impl TreeCostates {
    /// `None` where the sweeps do not apply: beside point masses, constraints on velocities, many
    /// rows of loops or nearly redundant ones, internal variables, and potentials and forces that
    /// couple bodies; `rows`: the independent ones.
    pub(in crate::solver) fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        rows: &IndependentRows,
        along: CostateTangents,
    ) -> Option<Self> {
        let closures = mechanism.loop_constraints();
        let rank = (rows.len() + closures.len()).checked_sub(mechanism.len())?;
        let applies = mechanism.description().particles.is_empty()
            && !mechanism.has_velocity_constraints()
            && rank <= MOST_ROWS
            && mechanism.nearly_redundant().is_none()
            && system.internal_variables() == 0
            && BodyForces::apply(mechanism, system, &[]);
        let at = applies.then(|| Workspace::new(mechanism, system)).flatten()?;
        let (tree, weight) = (mechanism.tree().clone(), system.constant_force());
        let (n, d) = (weight.len(), tree.dof());
        let other = system.has_other_forces(&[]).then(|| Emitted::new(tree.links().len(), 0));
        let closed = !closures.is_empty();
        let joints = (along != CostateTangents::OfMechanism).then(|| JointCostates::new(mechanism));
        let changes = (along == CostateTangents::OfMovedMechanism)
            .then(|| [(); 2].map(|()| vec![0.0; NUMBERS * tree.links().len()]));
        let along = system.along_unknowns().map(|own| EffortAlong::of(own, &at));
        Some(Self {
            joints,
            changes,
            by_rows: false,
            ends: [false; 2],
            loops: closed.then(|| LoopCostates::new(closures, rank, n, d)),
            along: along.collect(),
            other,
            at,
            tree,
            weight,
            w: vec![0.0; n],
            mu: vec![0.0; n],
            momentum: vec![0.0; n],
            rest: vec![0.0; d],
            m: vec![0.0; d],
            moved: vec![0.0; n],
            wanted: vec![0.0; mechanism.len()],
            none: vec![0.0; mechanism.len()],
        })
    }

    /// Whether `p̄` is held, not `p̃`.
    fn holds_efforts(&self) -> bool {
        self.loops.is_some() || self.joints.is_some() && self.changes.is_none()
    }

    /// Whether `w` takes efforts along unknowns, as multipliers do.
    fn balances_efforts(&self) -> bool {
        self.by_rows || self.holds_efforts()
    }

    /// Finds `(h/2) τ`.
    fn find_impulses(&mut self, system: &SeparableSystem, s: &Interval) {
        for (along, own) in self.along.iter_mut().zip(system.along_unknowns()) {
            let [mean, difference] = own.force.change(s);
            along.impulse = 0.5 * s.h * own.force.effort(s.t_mid(), mean, difference / s.h);
        }
    }

    /// Makes `a`, the derivative by `q_{n+1}` with `p̄_{n+1}` held, one with `p̃_{n+1}` held.
    fn hold_efforts(&mut self, system: &SeparableSystem, s: &Interval, [a, b]: [&mut [f64]; 2]) {
        self.find_impulses(system, s);
        for (along, own) in self.along.iter_mut().zip(system.along_unknowns()) {
            along.beta = own.force.rate(&s.q1, b);
            own.force.add_bend(&s.q1, b, along.impulse, a);
        }
    }

    /// Takes the slopes of efforts along unknowns, and adds their part of `P(q_{n+1})ᵀ c` to `m`.
    fn take_efforts(&mut self, system: &SeparableSystem, s: &Interval) {
        let Self { at, along, m, .. } = self;
        at.release_unknowns();
        for (along, own) in along.iter_mut().zip(system.along_unknowns()) {
            if own.force.is_given() {
                continue;
            }
            let [mean, difference] = own.force.change(s);
            let slopes = own.force.slopes(s.t_mid(), mean, difference / s.h);
            along.slope = Slot::BOTH.map(|node| slopes.by_node(s.h, node));
            let SignedUnknown { index, sign } = along.unknown;
            m[index] += sign * along.slope[1] * (along.beta - along.moved);
            at.column_mut(along.link, index).slope -= s.h * along.slope[1];
        }
    }

    /// Their part of `a`, and `β` for the step before.
    fn give_efforts(&mut self, system: &SeparableSystem, s: &Interval, a: &mut [f64]) {
        for (along, own) in self.along.iter_mut().zip(system.along_unknowns()) {
            let work = along.work(&self.m);
            if along.slope[0] != 0.0 {
                own.force.add_gradient(&s.q0, along.slope[0] * (along.beta - work), a);
            }
            along.beta = -work;
        }
    }

    /// Whether the joints have multipliers in this step, or what follows from `P`.
    fn choose(&mut self, rows: bool) {
        let Self { joints: Some(joints), by_rows, changes, .. } = self else { return };
        let were = std::mem::replace(by_rows, rows || changes.is_none());
        if were && !*by_rows {
            joints.impulse.fill(0.0);
            joints.rows.fill(0.0);
        }
    }

    /// `w` without what acts along unknowns and the rows of loops; the links are then open at
    /// `q_{n+1}`.
    fn take_balance(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        p: &[f64],
    ) -> Result<(), Singular> {
        let mut w = std::mem::take(&mut self.w);
        system.beside_unknowns(s, Slot::First, &mut w);
        self.add_free(system, s, Slot::First, &mut w);
        w.iter_mut().zip(p).for_each(|(w, p)| *w += p);
        self.w = w;
        let Self { at, along, loops, w, .. } = self;
        if let Some(loops) = loops {
            let balance = loops.stand(at, &s.q0, w);
            for EffortAlong { unknown, impulse, .. } in along {
                balance[unknown.index] += unknown.sign * *impulse;
            }
        }
        at.open_back([&s.q0, &s.q1]);
        loops.as_mut().map_or(Ok(()), |loops| loops.balance(at, s, w))
    }

    /// Finds `h λ` of the joints: they balance `w` with what acts along unknowns, which `w` takes
    /// where they are not looked for.
    fn take_joints(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        s: &Interval,
    ) -> Result<(), Singular> {
        let balances = self.balances_efforts();
        let Self { joints: Some(joints), w, along, .. } = self else { return Ok(()) };
        if !balances {
            return Ok(());
        }
        for (along, own) in along.iter().zip(system.along_unknowns()) {
            own.force.add_gradient(&s.q0, along.impulse, w);
        }
        if let Some(loops) = &self.loops {
            loops.give_impulses(&joints.closures, &mut joints.impulse);
        }
        if !self.by_rows {
            return Ok(());
        }
        joints.start.copy_from_slice(w);
        joints.balance(mechanism, s)
    }

    /// `μ_J` of what impulses cost; 0 where they do not. `a` takes what `q_{n+1}` costs with them.
    fn take_costs(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        cost: Option<&mut ImpulseCost<'_>>,
        a: &mut [f64],
    ) {
        let Self { joints, loops, along, moved, wanted, tree, .. } = self;
        along.iter_mut().for_each(|along| along.moved = 0.0);
        if let Some(loops) = loops {
            loops.want_nothing();
        }
        let (Some(joints), Some(cost)) = (joints, cost) else { return };
        wanted.fill(0.0);
        cost(&joints.impulse, [wanted, a]);
        wanted.iter_mut().for_each(|r| *r = -*r);
        joints.spread(tree, wanted, moved);
        for (along, own) in along.iter_mut().zip(system.along_unknowns()) {
            along.moved = own.force.rate(&s.q0, moved);
        }
        if let Some(loops) = loops {
            loops.want(&s.q0, &joints.closures, wanted, moved);
        }
    }

    /// The curvature of joints and of what acts along unknowns in `a`; `σ` of all rows.
    fn give_joints(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        s: &Interval,
        [a, b]: [&mut [f64]; 2],
    ) -> Result<(), Singular> {
        let balances = self.balances_efforts();
        let Self { joints: Some(joints), loops, along, m, mu, other, by_rows, .. } = self else {
            return Ok(());
        };
        if *by_rows {
            joints.bend(s, mu, a);
        }
        // c − Aᵀ μ
        let r = &mut joints.end;
        if other.is_some() {
            transposed(system, s, Slot::BOTH, b, r);
        }
        for (along, own) in along.iter().zip(system.along_unknowns()) {
            let change = along.slope[1] * (along.beta - along.work(m));
            if balances {
                own.force.add_bend(&s.q0, b, along.impulse, a);
            }
            if change != 0.0 {
                own.force.add_gradient(&s.q1, change, r);
            }
        }
        if let Some(loops) = loops {
            let JointCostates { closures, end, rows, .. } = joints;
            loops.give(s, closures, end, rows);
        }
        if let Some([_, end]) = self.changes.as_mut().filter(|_| !*by_rows) {
            let known = [&joints.end[..], &self.momentum, mu];
            self.at.moved_at_end(&s.q1, 1.0 / s.h, known, end);
            return Ok(());
        }
        joints.press(mechanism, s)
    }

    /// `out ← out ± M Δq/h + (h/2) w` of inertia and constant forces in `D_1 L_d` or `D_2 L_d`.
    fn add_free(&self, system: &SeparableSystem, s: &Interval, of: Slot, out: &mut [f64]) {
        system.inertia().mul_add(of.sign() / s.h, &s.dq, out);
        out.iter_mut().zip(&self.weight).for_each(|(out, w)| *out += 0.5 * s.h * w);
    }

    /// `c − Aᵀ μ_J`, but for what acts along unknowns; `b` takes `μ_J` for the inertia.
    fn add_moved(&mut self, system: &SeparableSystem, s: &Interval, [a, b]: [&mut [f64]; 2]) {
        let Self { moved, mu, other, .. } = self;
        if other.is_some() {
            mu.iter_mut().zip(&*moved).for_each(|(mu, moved)| *mu = -moved);
            transposed(system, s, Slot::BOTH, mu, a);
        }
        b.iter_mut().zip(moved).for_each(|(b, moved)| *b += *moved);
    }

    /// [`CostateSweep::pull`], or [`CostateSweep::pull_with`] where impulses cost.
    fn pull_costing(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        Costate { q: a, p: b, .. }: &mut Costate,
        cost: Option<&mut ImpulseCost<'_>>,
    ) -> Result<(), LinearizationError> {
        let ([s], costs) = (points, cost.is_some()) else { return Err(Singular.into()) };
        self.momentum.copy_from_slice(b);
        if self.holds_efforts() {
            self.hold_efforts(system, s, [a, b]);
        } else if self.by_rows {
            self.find_impulses(system, s);
        }
        self.ends = [false, self.ends[0]];
        self.take_balance(system, s, p)?;
        self.take_joints(system, mechanism, s)?;
        self.take_costs(system, s, cost, a);
        if let Some(other) = &mut self.other {
            transposed(system, s, [Slot::Second; 2], b, a);
            let emit = |into: &mut dyn Entries| {
                let (row, column, scale) = (0, 0, 1.0);
                let mut into = Block { into, row, column, scale, transposed: true };
                system.beside_unknowns_slope(s, Slot::First, Slot::Second, &mut into);
            };
            other.assemble(&emit, &self.tree, &self.at.links, [&s.q1, &s.q0], -s.h);
        }
        if let Some(joints) = &mut self.joints {
            joints.end.copy_from_slice(a);
        }
        if costs {
            self.add_moved(system, s, [a, b]);
        }
        self.at.weigh(s, a, b, &mut self.m); // P(q_{n+1})ᵀ c
        self.take_efforts(system, s);
        let Self { at, loops, joints, changes, other, w, m, mu, rest, moved, by_rows, .. } = self;
        m.iter_mut().for_each(|m| *m *= -s.h);
        let blocks = other.as_ref().map_or(&[][..], |other| &other.blocks);
        if let Some(loops) = loops {
            loops.constrain(at, blocks, m)?;
        }
        at.solve(blocks, rest, m).map_err(|_| Singular)?;
        if !m.iter().all(|m| m.is_finite()) {
            return Err(Singular.into());
        }
        if *by_rows {
            w.fill(0.0); // the curvature is that of their rows, not of P
        }
        at.pull(&s.q0, 1.0 / s.h, w, m, [a, b, mu]);
        if let Some([start, _]) = changes.as_mut().filter(|_| !*by_rows) {
            at.moved_at_start(&s.q0, m, start);
        }
        if costs {
            let all = b.iter_mut().zip(mu).zip(moved);
            all.for_each(|((b, mu), moved)| (*b, *mu) = (*b - *moved, *mu + *moved));
        }
        if let Some(joints) = joints.as_mut().filter(|_| *by_rows) {
            joints.end.iter_mut().zip(&*a).for_each(|(r, a)| *r -= a); // + (M/h)(b' + μ)
        }
        if let Some(loops) = loops {
            if let Some(joints) = joints.as_ref().filter(|_| costs) {
                loops.check(&joints.closures, m)?;
            }
            loops.bend(&s.q0, b, a);
        }
        if self.other.is_some() {
            transposed(system, s, [Slot::Second, Slot::First], &self.momentum, a);
            transposed(system, s, [Slot::First; 2], b, a);
        }
        self.give_joints(system, mechanism, s, [a, b])?;
        self.give_efforts(system, s, a);
        Ok(())
    }
}

impl CostateSweep<SeparableSystem, Mechanism> for TreeCostates {
    fn momentum(&mut self, system: &SeparableSystem, s: &Interval, out: &mut [f64]) {
        if self.holds_efforts() {
            return system.forced_d2(s, out);
        }
        system.beside_unknowns(s, Slot::Second, out);
        self.add_free(system, s, Slot::Second, out);
    }

    fn hold(&mut self, system: &SeparableSystem, points: &[Interval], costate: &mut Costate) {
        let [s] = points else { return };
        let Costate { q: a, p: b, .. } = costate;
        self.ends[0] = true;
        if !self.holds_efforts() && b.iter().any(|b| *b != 0.0) {
            self.hold_efforts(system, s, [a, b]);
        } else {
            self.along.iter_mut().for_each(|along| along.beta = 0.0);
        }
    }

    fn pull(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.choose(false);
        let pulled = self.pull_costing(system, mechanism, points, p, costate, None);
        pulled.map_err(|_| Singular) // no multipliers are asked for
    }

    fn pull_by_rows(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.choose(true);
        let pulled = self.pull_costing(system, mechanism, points, p, costate, None);
        pulled.map_err(|_| Singular)
    }

    fn takes_impulses(&self) -> bool {
        self.joints.is_some()
    }

    fn pull_with(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
        cost: &mut ImpulseCost<'_>,
    ) -> Result<(), LinearizationError> {
        self.choose(true);
        self.pull_costing(system, mechanism, points, p, costate, Some(cost))
    }

    fn for_each_part(&self, points: &[Interval], visit: &mut PartVisitor<'_>) {
        let [s] = points else { return };
        let none = [&self.none, &self.none];
        let [impulse, rows] =
            self.joints.as_ref().map_or(none, |joints| [&joints.impulse, &joints.rows]);
        let moved = match self.changes.as_ref().filter(|_| !self.by_rows) {
            Some([start, end]) => [&start[..], end],
            None => [&[][..]; 2],
        };
        let (step, momentum) = (&self.mu[..], &self.momentum[..]);
        let apart = [!self.balances_efforts(), !self.holds_efforts() && !self.ends[1]];
        let costates = Costates { step, momentum, rows, moved, apart, rates: &[] };
        visit(Place::Step(s), impulse, costates);
    }
}
