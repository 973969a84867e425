//! [`CostateSweep`] of Galerkin steps on a tree of bodies: one elimination of the links for each
//! step, with the exact matrix of all its control points, transposed.
//!
//! Its formulas stand in `crate::sweep::point_costate`. The costate `a` at `q_n` is that of a step
//! of order 2 [2.47] with another velocity: `H_i0ᵀ x_i` of inertia is `(M/h) Σ_i K_i0 x_i`. Where
//! all motions of bodies count, impulses and costates of the joints follow at each control point
//! from the wrenches they transmit ([`JointNodes`]):
//! ```text
//! w_i = G(q_i)ᵀ Λ_i,   δ_js a' + Σ_i H_ijᵀ x_i = G(q_j)ᵀ σ_j                                 [2.50]
//! ```
//! Along mechanisms next to this one the curvature is that of `w_i·P(q_i) μ_i`, and
//! `crate::sweep::moved_joints` has what the joints give by their geometry at each control point.
#![allow(non_snake_case)] // K

use super::joint_costates::JointNodes;
use super::point_slopes::PointSlopes;
use super::tree_step::body_forces::initial_interval;
use super::tree_step::space::SPACE;
use super::tree_step::workspace::Workspace;
use crate::geometry::matrix::Spatial;
use crate::mechanism::Mechanism;
use crate::sweep::coupled::Couplings;
use crate::sweep::moved_joints::NUMBERS;
use crate::sweep::point_costate::{ActingTransposed, PointTree};
use vi_constraints::Constraints;
use vi_constraints::costate_sweep::{CostateSweep, CostateTangents, PartVisitor};
use vi_constraints::design::Costates;
use vi_constraints::galerkin::Parts;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::linearization::Costate;
use vi_core::galerkin::Stages;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::{DiscreteLagrangian, MechanicalSystem, SeparableSystem};

/// The costates of trees of bodies that are coupled at most with their parents, `O(N)`.
#[derive(Debug)]
pub(in crate::solver) struct PointCostates {
    points: ControlPoints,
    parts: Parts,
    at: Workspace, // at q_n
    all: PointTree,
    forces: Option<Forces>,
    w: [Vec<f64>; 2],  // n  w_0, w_i
    x: Vec<Vec<f64>>,  // (s + 1) × n
    scratch: Vec<f64>, // n
    joints: Option<Joints>,
    by_rows: bool, // whether the last step has the multipliers of all joints
    m: Vec<f64>,   // d
}

/// The joints during a step backward.
#[derive(Debug)]
struct Joints {
    all: JointNodes,
    balance: Vec<Vec<f64>>,              // s × n  w_i, then y_i
    impulses: Vec<Vec<f64>>,             // s × m  Λ_i
    sigma: Vec<Vec<f64>>,                // s × m  σ_1 … σ_s
    end: Vec<f64>,                       // n
    bend: [Vec<f64>; 3],                 // n
    changes: Option<Vec<[Vec<f64>; 2]>>, // s, of all links  Costates::moved at q_i, q_{i+1}
}

impl Joints {
    fn new(mechanism: &Mechanism, s: usize, along: CostateTangents) -> Self {
        let rows = || vec![vec![0.0; mechanism.len()]; s];
        let numbers = NUMBERS * mechanism.tree().links().len();
        let changes = || (0..s).map(|_| [(); 2].map(|()| vec![0.0; numbers])).collect();
        Self {
            all: JointNodes::new(mechanism, s + 1),
            balance: vec![vec![0.0; mechanism.dim()]; s],
            impulses: rows(),
            sigma: rows(),
            end: vec![0.0; mechanism.dim()],
            bend: [(); 3].map(|()| vec![0.0; mechanism.dim()]),
            changes: (along == CostateTangents::OfMovedMechanism).then(changes),
        }
    }

    /// `c + Σ_i H_ijᵀ x_i` at the control point `j` takes the curvature of `w_j·P(q_j) μ_j`; the
    /// links are open there then.
    fn bend(&mut self, at: &mut Workspace, all: &PointTree, j: usize, q: &[f64], m: &mut [f64]) {
        let Self { balance, bend: [a, b, mu], end, changes, .. } = self;
        stand_at(at, all, j, q, m);
        at.pull(q, 0.0, &balance[j], m, [a, b, mu]);
        if let Some(changes) = changes {
            at.moved_at_start(q, m, &mut changes[j][0]);
        }
        end.iter_mut().zip(a).for_each(|(end, a)| *end += *a);
    }
}

/// Opens the links at a control point with the twists and rates of `μ_i`.
fn stand_at(at: &mut Workspace, all: &PointTree, i: usize, q: &[f64], m: &mut [f64]) {
    at.open_back([q, q]);
    at.works.iter_mut().enumerate().for_each(|(k, work)| work.twist = all.twist(k, i));
    m.iter_mut().enumerate().for_each(|(unknown, m)| *m = all.rate(unknown, i));
}

/// What acts beside inertia and constant forces.
#[derive(Debug)]
struct Forces {
    slopes: PointSlopes,
    acting: ActingTransposed, // h H_ijᵀ
}

impl Forces {
    /// Whether bodies are coupled at most with their parents; `None` where nothing acts.
    fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        stages: Stages,
    ) -> Option<Option<Self>> {
        if !system.has_variable_forces() {
            return Some(None);
        }
        let (tree, start) = (mechanism.tree(), initial_interval(mechanism));
        let slopes = PointSlopes::new(tree, system, &start, stages.count())?;
        let (links, count) = (tree.links().len(), stages.count() * stages.count());
        let coupled = if slopes.couple_bodies() { count } else { 0 };
        let acting = ActingTransposed {
            blocks: vec![vec![Spatial::default(); links]; count],
            couplings: (0..coupled).map(|_| Couplings::new(SPACE, links, 0)).collect(),
        };
        Some(Some(Self { slopes, acting }))
    }
}

impl PointCostates {
    /// `None` where the sweeps do not apply: beside point masses, closed loops, constraints on
    /// velocities, internal variables, interpolated strains, and forces that couple other bodies
    /// than links with their parents.
    pub(in crate::solver) fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        stages: Stages,
        along: CostateTangents,
    ) -> Option<Self> {
        let applies = mechanism.description().particles.is_empty()
            && !mechanism.has_velocity_constraints()
            && mechanism.loop_constraints().is_empty()
            && system.internal_variables() == 0
            && system.interpolation().is_none();
        let at = applies.then(|| Workspace::new(mechanism, system)).flatten()?;
        let (n, d, s) = (system.dim(), mechanism.tree().dof(), stages.count());
        let forces = Forces::new(mechanism, system, stages)?;
        let points = ControlPoints::new(n, stages);
        let slots = at.links.iter().filter_map(|link| link.slot).max().map_or(0, |last| last + 1);
        let zeros = || vec![0.0; n];
        Some(Self {
            all: PointTree::new(&at.links, slots, d, &points.constants().K),
            parts: Parts::new(n, mechanism.len(), stages),
            at,
            forces,
            points,
            w: [zeros(), zeros()],
            x: vec![zeros(); s + 1],
            scratch: zeros(),
            joints: (along != CostateTangents::OfMechanism)
                .then(|| Joints::new(mechanism, s, along)),
            by_rows: false,
            m: vec![0.0; d],
        })
    }

    /// Stands at the control points of a step from `p̄_n`, with the wrenches that bend it.
    fn stand(&mut self, system: &SeparableSystem, points: &[Interval], p: &[f64]) {
        let Self { points: own, all, at, w: [first, w], forces, joints, parts, .. } = self;
        own.take(points, p);
        own.evaluate(system);
        parts.stand(own);
        let (s, h) = (own.stages(), own.h());
        for l in 0..=s {
            all.stand(&at.links, l, own.q(l));
        }
        own.balance(system, 0, first);
        for l in 1..s {
            let w = joints.as_mut().map_or(&mut *w, |joints| &mut joints.balance[l]);
            own.balance(system, l, w);
            all.bend(&at.links, l, h, w);
        }
        if let Some(forces) = forces {
            forces.slopes.differentiate(system, own);
            forces.slopes.project(own, &at.links, &mut forces.acting);
        }
    }

    /// Takes `h c_l = δ_ls h a' + (h H_sl)ᵀ b'`.
    fn load(&mut self, costate: &Costate) {
        let Self { points, all, at, forces, scratch, .. } = self;
        let (s, h) = (points.stages(), points.h());
        if let Some(forces) = forces {
            forces.slopes.take(points, std::iter::once((s, &costate.p[..])));
        }
        for l in 1..=s {
            let (mut scale, mut more) = (h, if l == s { &costate.q[..] } else { &[] });
            if let Some(forces) = forces {
                scratch.fill(0.0);
                more.iter().zip(&mut *scratch).for_each(|(a, more)| *more = h * a);
                forces.slopes.add(points, l, 1.0, scratch);
                (scale, more) = (1.0, &scratch[..]);
            }
            all.load(&at.links, l, &costate.p, scale, more);
        }
    }

    /// Whether the joints have multipliers in this step, or what follows from `P`.
    fn choose(&mut self, rows: bool) {
        let Self { joints: Some(joints), by_rows, .. } = self else { return };
        let were = std::mem::replace(by_rows, rows || joints.changes.is_none());
        if were && !*by_rows {
            joints.impulses.iter_mut().chain(&mut joints.sigma).for_each(|own| own.fill(0.0));
        }
    }

    /// Finds `Λ_i`, which balance `w_i`.
    fn take_joints(&mut self, mechanism: &Mechanism) -> Result<(), Singular> {
        let Self { points, joints, parts, w: [first, _], by_rows, .. } = self;
        let Some(Joints { all, balance, impulses, .. }) = joints else { return Ok(()) };
        parts.stand_between(points);
        all.go_back();
        if !*by_rows {
            return Ok(());
        }
        balance[0].copy_from_slice(first);
        for (i, (w, impulse)) in balance.iter_mut().zip(impulses).enumerate() {
            all.balance(mechanism, i, points.q(i), w, impulse)?;
        }
        first.fill(0.0); // the curvature is that of their rows, not of P
        Ok(())
    }

    /// Finds `σ_j`; `a`: `a'`.
    fn give_joints(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        a: &[f64],
    ) -> Result<(), Singular> {
        let Self { points, joints, forces, x, scratch, at, all, m, by_rows, .. } = self;
        let Some(joints) = joints else { return Ok(()) };
        let (s, h) = (points.stages(), points.h());
        for j in 1..=s {
            let (Joints { end, .. }, q) = (&mut *joints, points.q(j));
            match j == s {
                true => end.copy_from_slice(a),
                false => end.fill(0.0),
            }
            scratch.fill(0.0);
            for (i, x) in x.iter().enumerate() {
                let K = points.constants().K[(i, j)];
                scratch.iter_mut().zip(x).for_each(|(sum, x)| *sum += K * x);
            }
            if let Some(forces) = forces {
                forces.slopes.add(points, j, 1.0 / h, end);
            }
            if !*by_rows {
                match j == s {
                    true => at.open_back([q, q]),
                    false => joints.bend(at, all, j, q, m),
                }
                let Joints { end, bend: [none, ..], changes: Some(changes), .. } = &mut *joints
                else {
                    continue;
                };
                none.fill(0.0);
                at.moved_at_end(q, 1.0 / h, [end, scratch, none], &mut changes[j - 1][1]);
                continue;
            }
            system.inertia().mul_add(1.0 / h, scratch, end);
            let Joints { all, balance, impulses, sigma, end, .. } = &mut *joints;
            if j < s {
                scratch.iter_mut().zip(&x[j]).for_each(|(mu, x)| *mu = -x);
                all.bend(q, [&impulses[j], &balance[j]], scratch, end);
            }
            all.press(mechanism, j, q, end, &mut sigma[j - 1])?;
        }
        Ok(())
    }

    /// The costate at `q_n` from all `x_i`.
    fn give(&mut self, costate: &mut Costate) {
        let Self { points, all, at, forces, joints, w: [first, _], x, scratch, m, by_rows, .. } =
            self;
        let (step, K) = (points.step(), &points.constants().K);
        let Costate { q: a, p: b, .. } = costate;
        b.copy_from_slice(&x[0]);
        for (i, x) in x.iter().enumerate() {
            b.iter_mut().zip(x).for_each(|(b, x)| *b -= K[(i, 0)] * x);
        }
        stand_at(at, all, 0, &step.q0, m);
        at.pull(&step.q0, 1.0 / step.h, first, m, [a, b, scratch]);
        match joints {
            Some(Joints { all, balance, impulses, .. }) if *by_rows => {
                all.bend(&step.q0, [&impulses[0], &balance[0]], scratch, a);
            }
            Some(Joints { changes: Some(changes), .. }) => {
                at.moved_at_start(&step.q0, m, &mut changes[0][0]);
            }
            _ => {}
        }
        if let Some(forces) = forces {
            forces.slopes.add(points, 0, 1.0 / step.h, a);
        }
    }

    /// [`CostateSweep::pull`], as was chosen.
    fn pull_chosen(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.stand(system, points, p);
        self.take_joints(mechanism)?;
        self.load(costate);
        let solvable = self.all.solve(&self.at.links, self.forces.as_ref().map(|own| &own.acting));
        let s = self.points.stages();
        for (i, x) in self.x[..s].iter_mut().enumerate() {
            self.all.write(&self.at.links, i, x);
            x.iter_mut().for_each(|x| *x = -*x); // x_i = −μ_i
        }
        self.x[s].copy_from_slice(&costate.p);
        if let Some(Forces { slopes, .. }) = &mut self.forces {
            let x = self.x.iter().map(|x| &x[..]);
            slopes.take(&self.points, x.enumerate());
        }
        self.give_joints(system, mechanism, &costate.q)?;
        self.give(costate);
        if !solvable || !self.m.iter().all(|m| m.is_finite()) {
            return Err(Singular);
        }
        self.parts.spread(self.points.constants(), &self.x);
        Ok(())
    }
}

impl CostateSweep<SeparableSystem, Mechanism> for PointCostates {
    fn momentum(&mut self, _: &SeparableSystem, _: &Interval, _: &mut [f64]) {}

    fn hold(&mut self, _: &SeparableSystem, _: &[Interval], _: &mut Costate) {}

    fn pull(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.choose(false);
        self.pull_chosen(system, mechanism, points, p, costate)
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
        self.pull_chosen(system, mechanism, points, p, costate)
    }

    fn for_each_part(&self, _: &[Interval], visit: &mut PartVisitor<'_>) {
        let (s, joints) = (self.parts.stages(), self.joints.as_ref());
        let [impulses, sigma] =
            joints.map_or([&[][..]; 2], |joints| [&joints.impulses[..], &joints.sigma]);
        for k in 0..if joints.is_some() { 2 * s } else { s } {
            let (place, impulse) = self.parts.part(k, impulses);
            let changes = joints.and_then(|own| own.changes.as_ref()).filter(|_| !self.by_rows);
            let moved = match (changes, k.checked_sub(s)) {
                (Some(changes), Some(i)) => [&changes[i][0][..], &changes[i][1]],
                _ => [&[][..]; 2],
            };
            visit(place, impulse, Costates { moved, ..self.parts.costates(k, sigma) });
        }
    }
}
