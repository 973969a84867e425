//! What couples neighbouring nodes: a sub-step its two ends, a Galerkin step its control points.
//!
//! ```text
//! w_0 = D_1L_d + f_d^-,   w_1 = D_2L_d + f_d^+                                        a sub-step
//! w_i = (1/h) M Σ_j K_ij Δ_j + h Σ_k b_k E_ki F(Q_k, V_k),   F = f − ∇V                a Galerkin step [2.26]
//! ∂w_i/∂q_j = (1/h) K_ij M + Σ_k b_k E_ki (h E_kj F_q + D_kj F_v)                                      [2.49]
//! ∂²(Σ Y·w)/∂q_i∂q_j = Σ_k h b_k [ E_ki E_kj ∂_q∂_q + (E_ki D_kj ∂_q∂_v + D_ki E_kj ∂_v∂_q)/h
//!                       + D_ki D_kj ∂_v∂_v/h² ] Z_k·F,     Z_k = Σ_i E_ki Y_i
//! ```
//! The controls of a step act in all its pieces. Efforts along unknowns act in a sub-step by
//! `σ (h/2) τ e_j` at both ends and are no part of `w`; in a Galerkin step they are part of `F`, by
//! `τ ∇θ(Q_k)`, with the second derivatives [2.52].
#![allow(non_snake_case)] // D, E, K, Q, V, X, Y, Z

use super::Transcription;
use nalgebra::DMatrix;
use std::sync::OnceLock;
use vi_constraints::galerkin::GaussSlopes;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_core::coordinate_force::{SignedUnknown, StepEffort};
use vi_core::discrete_lagrangian::DiscreteLagrangian as _;
use vi_core::force::{DiscreteForce as _, LengthBends as _};
use vi_core::galerkin::{GaussPoint, Stages};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::linear::dot;
use vi_core::sparse::{Block, Entries, Product, SparseMatrix};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_rigid::load::Load;

/// A piece with what acts in it.
#[derive(Debug)]
pub(super) struct Piece {
    /// Its first node.
    pub(super) first: usize,
    /// From its first node to its last one.
    pub(super) s: Interval,
    /// The wrenches of controls in it, with their values.
    pub(super) wrenches: Vec<Load>,
    pub(super) kind: PieceKind,
}

/// An effort of the model along an unknown in a sub-step.
#[derive(Clone, Copy, Debug)]
pub(super) struct ModelEffort {
    /// `j`.
    pub(super) index: usize,
    /// `σ`.
    pub(super) sign: f64,
    /// `τ`.
    pub(super) effort: StepEffort,
}

/// What is of one kind of piece alone.
#[derive(Debug)]
pub(super) enum PieceKind {
    /// Efforts of the model along unknowns.
    SubStep(Vec<ModelEffort>),
    Galerkin(Box<Action>),
}

/// The action of a Galerkin step.
#[derive(Debug)]
pub(super) struct Action {
    /// With `F` of all that acts.
    points: ControlPoints,
    /// Of each control along an unknown: the control, its value, its coordinate.
    efforts: Vec<(usize, f64, JointCoordinate)>,
    /// `h ∂w_i/∂q_j` without inertia, row after row.
    blocks: OnceLock<Vec<SparseMatrix>>,
}

/// How a control acts at a node.
pub(super) enum ControlEffect {
    /// Along an unknown, by the derivative of the balance of this one.
    Unknown(usize, f64),
    /// By the derivative of `w`, shape `n`.
    Force(Vec<f64>),
}

/// `X ↦ (inertial part, other part)`.
pub(super) struct SplitResidual {
    inertial: DMatrix<f64>,
    other: Option<DMatrix<f64>>,
}

impl SplitResidual {
    pub(super) fn zero(n: usize, columns: usize) -> Self {
        Self { inertial: DMatrix::zeros(n, columns), other: None }
    }

    pub(super) fn sum(self) -> DMatrix<f64> {
        match self.other {
            Some(other) => self.inertial + other,
            None => self.inertial,
        }
    }

    pub(super) fn add(&mut self, part: Self) {
        self.inertial += part.inertial;
        self.other = match (self.other.take(), part.other) {
            (Some(a), Some(b)) => Some(a + b),
            (a, b) => a.or(b),
        };
    }
}

/// `out ← out + scale A X`, or with `Aᵀ`.
pub(super) fn add_product(
    scale: f64,
    matrix: &SparseMatrix,
    X: &DMatrix<f64>,
    transposed: bool,
    out: &mut DMatrix<f64>,
) {
    if !transposed {
        return matrix.mul_dense_add(scale, X, out);
    }
    let n = X.nrows();
    for (x, o) in X.as_slice().chunks_exact(n).zip(out.as_mut_slice().chunks_exact_mut(n)) {
        matrix.tr_mul_add(scale, x, o);
    }
}

/// `K_iᵀ B_ij K_j` of matrices between the nodes of a piece, `i ≤ j`; zero for others.
pub(super) fn products(
    K: &[&DMatrix<f64>],
    emit: impl Fn(usize, usize, &mut dyn Entries),
) -> Vec<Vec<DMatrix<f64>>> {
    let (n, d) = K[0].shape();
    let mut all = vec![vec![DMatrix::zeros(d, d); K.len()]; K.len()];
    for (i, j) in (0..K.len()).flat_map(|j| (0..=j).map(move |i| (i, j))) {
        let mut product = DMatrix::zeros(n, d);
        let matrix = SparseMatrix::assemble(n, n, |out| emit(i, j, out));
        matrix.mul_dense_add(1.0, K[j], &mut product);
        all[i][j] = K[i].tr_mul(&product);
    }
    all
}

impl Piece {
    /// Between these nodes, the first of which has this number, from these angles and this time on;
    /// `value`: of each control in it.
    pub(super) fn new(
        of: &Transcription,
        (first, nodes): (usize, &[&[f64]]),
        (angles, t, h): (&[f64], f64, f64),
        value: &dyn Fn(usize) -> f64,
    ) -> Self {
        let last = nodes.len() - 1;
        let mut s = Interval::between(t, h, nodes[0], nodes[last]);
        s.angles.extend_from_slice(angles);
        let wrenches: Vec<Load> = of.wrenches().map(|(k, load)| load.scaled(value(k))).collect();
        let stages = of.division.constants.as_ref().and_then(|own| Stages::new(own.stages()));
        let Some(stages) = stages else {
            return Self { first, s, wrenches, kind: PieceKind::SubStep(Vec::new()) };
        };
        let mut intervals: Vec<Interval> =
            nodes[1..last].iter().map(|q| Interval::between(t, h, nodes[0], q)).collect();
        intervals.push(s.clone());
        let mut points = ControlPoints::new(of.n, stages);
        points.take(&intervals, &vec![0.0; of.n]);
        points.evaluate(&*of.system);
        let efforts =
            of.efforts().filter_map(|(k, _)| Some((k, value(k), of.coordinates[k].clone()?)));
        let efforts: Vec<_> = efforts.collect();
        for k in 0..stages.count() {
            let (node, force) = points.force_mut(k);
            efforts.iter().for_each(|(_, tau, own)| own.add_gradient(&node.q, *tau, force));
            let at = node.place(&s);
            wrenches.iter().for_each(|load| load.add_continuous(at.moving(&node.v), force));
        }
        let action = Action { points, efforts, blocks: OnceLock::new() };
        Self { first, s, wrenches, kind: PieceKind::Galerkin(Box::new(action)) }
    }

    /// The inertial part of `w_i`, and the rest.
    pub(super) fn momentum(&self, of: &Transcription, i: usize) -> [Vec<f64>; 2] {
        let [mut inertial, mut other] = [(); 2].map(|()| vec![0.0; of.n]);
        let h = self.s.h;
        match &self.kind {
            PieceKind::SubStep(_) => {
                let slot = Slot::BOTH[i];
                if of.has_other {
                    of.system.beside_unknowns(&self.s, slot, &mut other);
                }
                of.system.inertia().mul_add(slot.sign() / h, &self.s.dq, &mut inertial);
                other.iter_mut().zip(&of.weight).for_each(|(o, w)| *o += 0.5 * h * w);
                for load in &self.wrenches {
                    match slot {
                        Slot::First => load.add_minus(&self.s, &mut other),
                        Slot::Second => load.add_plus(&self.s, &mut other),
                    }
                }
            }
            PieceKind::Galerkin(action) => {
                let mut mixed = vec![0.0; of.n];
                action.points.mix(i, &mut mixed);
                of.system.inertia().mul_add(1.0 / h, &mixed, &mut inertial);
                action.points.add_impulse(i, &mut other); // [2.26]
            }
        }
        [inertial, other]
    }

    /// The derivative of the part of `w_i` that is not inertial by the length of the piece.
    pub(super) fn by_length(&self, of: &Transcription, i: usize) -> Vec<f64> {
        let h = self.s.h;
        let PieceKind::Galerkin(action) = &self.kind else {
            return self.by_sub_step(of, Slot::BOTH[i]);
        };
        let constants = action.points.constants();
        let (mut sum, mut force) = (vec![0.0; of.n], vec![0.0; of.n]);
        let by = StepChange { length: 1.0, middle: 0.0 }; // nothing depends on the time itself
        for (k, node) in action.points.gauss().iter().enumerate() {
            let at = node.place(&self.s);
            if of.system.gauss_step_slope(at.moving(&node.v), h, by, &mut force).is_err() {
                force.fill(f64::NAN);
            }
            for (_, tau, own) in &action.efforts {
                own.add_gradient(at.q, *tau, &mut force);
            }
            self.wrenches
                .iter()
                .for_each(|load| load.add_continuous(at.moving(&node.v), &mut force));
            let part = constants.gauss_weights[k] * constants.E[(k, i)];
            sum.iter_mut().zip(&force).for_each(|(sum, f)| *sum += part * f);
        }
        sum
    }

    /// The same in a sub-step.
    fn by_sub_step(&self, of: &Transcription, slot: Slot) -> Vec<f64> {
        let mut slope = vec![0.0; of.n];
        if of.has_other && of.system.beside_unknowns_by_length(&self.s, slot, &mut slope).is_err() {
            slope.fill(f64::NAN);
        }
        slope.iter_mut().zip(&of.weight).for_each(|(slope, w)| *slope += 0.5 * w);
        for load in &self.wrenches {
            let own = load.half_impulse(&self.s, self.s.node(slot));
            let slope = slope[load.offset()..].iter_mut().zip(own);
            slope.for_each(|(slope, own)| *slope += own / self.s.h);
        }
        slope
    }

    /// `∂w_i/∂q_j X`, or its transpose times `X`.
    pub(super) fn times(
        &self,
        of: &Transcription,
        i: usize,
        j: usize,
        X: &DMatrix<f64>,
        transposed: bool,
    ) -> SplitResidual {
        let (h, mut parts) = (self.s.h, SplitResidual::zero(of.n, X.ncols()));
        match &self.kind {
            PieceKind::SubStep(_) => {
                let [of_end, by] = [i, j].map(|end| Slot::BOTH[end]);
                let scale = of_end.sign() * by.sign() / h;
                of.mass.mul_dense_add(scale, X, &mut parts.inertial);
                if of.has_other || !self.wrenches.is_empty() {
                    let matrix = SparseMatrix::assemble(of.n, of.n, |out| {
                        if of.has_other {
                            of.system.beside_unknowns_slope(&self.s, of_end, by, out);
                        }
                        for load in &self.wrenches {
                            load.add_slope(&self.s, of_end, by, out);
                        }
                    });
                    let other = parts.other.insert(DMatrix::zeros(of.n, X.ncols()));
                    add_product(1.0, &matrix, X, transposed, other);
                }
            }
            PieceKind::Galerkin(action) => {
                let constants = action.points.constants();
                of.mass.mul_dense_add(constants.K[(i, j)] / h, X, &mut parts.inertial);
                let block = &self.blocks(of, action)[i * (constants.stages() + 1) + j];
                let other = parts.other.insert(DMatrix::zeros(of.n, X.ncols()));
                add_product(1.0 / h, block, X, transposed, other); // [2.49]
            }
        }
        parts
    }

    /// The derivative of `Σ_j (∂w_j/∂q_i)ᵀ Y_j` by the length of the piece, shape `n`.
    pub(super) fn slope_by_length(&self, of: &Transcription, i: usize, Y: &[&[f64]]) -> Vec<f64> {
        let (h, mut slope) = (self.s.h, vec![0.0; of.n]);
        let PieceKind::Galerkin(action) = &self.kind else {
            let (by, Y) = (Slot::BOTH[i], [Y[0], Y[1]]);
            for (end, Y) in Slot::BOTH.into_iter().zip(Y) {
                of.mass.mul_add(-end.sign() * by.sign() / (h * h), Y, &mut slope);
            }
            if of.has_other {
                of.system.add_beside_unknowns_slope_by_length(&self.s, Y, by, &mut slope);
            }
            for load in &self.wrenches {
                load.add_slope_by_length(&self.s, Y, by, &mut slope);
            }
            return slope;
        };
        let constants = action.points.constants();
        for (j, Y) in Y.iter().enumerate() {
            of.mass.mul_add(-constants.K[(j, i)] / (h * h), Y, &mut slope);
        }
        for (k, node) in action.points.gauss().iter().enumerate() {
            let (at, Z) = (node.place(&self.s), self.at_gauss(of, action, k, Y));
            let [mut still, mut moving] = [(); 2].map(|()| vec![0.0; of.n]);
            {
                // F_qᵀ Z − ∂_q∂_v(Z·F) V
                let into = &mut Product { v: &Z, out: &mut still };
                let out = &mut Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
                of.system.gauss_slopes(at.moving(&node.v), [1.0, 0.0], out);
                self.emit_controls(action, node, [1.0, 0.0], out);
            }
            let by = [0.0, -1.0, 0.0, 0.0];
            let out = &mut Product { v: &node.v, out: &mut still };
            of.system.gauss_bend(at.moving(&node.v), &Z, by, out);
            let by = [0.0, 0.0, 0.0, -1.0 / h];
            let out = &mut Product { v: &node.v, out: &mut moving };
            of.system.gauss_bend(at.moving(&node.v), &Z, by, out);
            let b = constants.gauss_weights[k];
            let [E, D] = [constants.E[(k, i)], constants.D[(k, i)]].map(|part| b * part);
            for ((slope, still), moving) in slope.iter_mut().zip(&still).zip(&moving) {
                *slope += E * still + D * moving;
            }
        }
        slope
    }

    /// The second derivative of `Σ Y·w` without inertia by the length of the piece.
    pub(super) fn second_by_length(&self, of: &Transcription, Y: &[&[f64]]) -> f64 {
        let PieceKind::Galerkin(action) = &self.kind else {
            return of.system.beside_unknowns_second_by_length(&self.s, [Y[0], Y[1]]);
        };
        let mut sum = 0.0;
        for (k, node) in action.points.gauss().iter().enumerate() {
            let (at, Z) = (node.place(&self.s), self.at_gauss(of, action, k, Y));
            let mut turned = vec![0.0; of.n];
            let out = &mut Product { v: &node.v, out: &mut turned };
            of.system.gauss_bend(at.moving(&node.v), &Z, [0.0, 0.0, 0.0, 1.0], out);
            sum += action.points.constants().gauss_weights[k] * dot(&turned, &node.v) / self.s.h;
        }
        sum
    }

    /// `h ∂w_i/∂q_j` without inertia, row after row.
    fn blocks<'a>(&self, of: &Transcription, action: &'a Action) -> &'a [SparseMatrix] {
        action.blocks.get_or_init(|| {
            let (points, count) = (&action.points, action.points.stages() + 1);
            let stages = Stages::new(points.stages()).expect("those of the points");
            let mut slopes = GaussSlopes::new(stages);
            slopes.differentiate_with(&*of.system, points, &mut |node, by, out| {
                self.emit_controls(action, node, by, out);
            });
            let block = |k: usize| {
                SparseMatrix::assemble(of.n, of.n, |out| {
                    slopes.emit(&*of.system, points, k / count, k % count, out);
                })
            };
            (0..count * count).map(block).collect()
        })
    }

    /// Emits `by_q F_q + by_v F_v` of the controls at a Gauss node.
    fn emit_controls(
        &self,
        action: &Action,
        node: &GaussPoint,
        by: [f64; 2],
        out: &mut dyn Entries,
    ) {
        for (_, tau, own) in action.efforts.iter().filter(|_| by[0] != 0.0) {
            own.emit_second(&node.q, by[0] * tau, out);
        }
        let at = node.place(&self.s);
        self.wrenches.iter().for_each(|load| load.add_gauss_slopes(at.moving(&node.v), by, out));
    }

    /// How a control acts at node `i` of the piece.
    pub(super) fn effect(&self, of: &Transcription, control: usize, i: usize) -> ControlEffect {
        let h = self.s.h;
        if let (PieceKind::SubStep(_), Some(SignedUnknown { index, sign })) =
            (&self.kind, of.along(control))
        {
            return ControlEffect::Unknown(index, 0.5 * h * sign);
        }
        let mut force = vec![0.0; of.n];
        match &self.kind {
            PieceKind::SubStep(_) => {
                if let Some(load) = of.wrench(control) {
                    let own = load.half_impulse(&self.s, self.s.node(Slot::BOTH[i]));
                    let out = force[load.offset()..].iter_mut().zip(own);
                    out.for_each(|(out, own)| *out = own);
                }
            }
            PieceKind::Galerkin(action) => {
                let constants = action.points.constants();
                for (k, node) in action.points.gauss().iter().enumerate() {
                    let part = h * constants.gauss_weights[k] * constants.E[(k, i)];
                    let at = node.place(&self.s);
                    match (of.wrench(control), &of.coordinates[control]) {
                        (Some(load), _) => {
                            load.scaled(part).add_continuous(at.moving(&node.v), &mut force);
                        }
                        (None, Some(own)) => own.add_gradient(at.q, part, &mut force),
                        (None, None) => {}
                    }
                }
            }
        }
        ControlEffect::Force(force)
    }

    /// `Σ_i (∂/∂q_j of how a control acts at node i)ᵀ Y_i` of each node `j` of the piece, shape
    /// `n`.
    pub(super) fn effect_slopes(
        &self,
        of: &Transcription,
        control: usize,
        Y: &[&[f64]],
    ) -> Vec<Vec<f64>> {
        let h = self.s.h;
        let mut slopes = vec![vec![0.0; of.n]; Y.len()];
        match &self.kind {
            PieceKind::SubStep(_) => {
                let Some(load) = of.wrench(control) else { return slopes };
                for (by, out) in Slot::BOTH.into_iter().zip(&mut slopes) {
                    for (of_end, Y) in Slot::BOTH.into_iter().zip(Y) {
                        let into = &mut Product { v: Y, out };
                        let (row, column, scale, transposed) = (0, 0, 1.0, true);
                        let out = &mut Block { into, row, column, scale, transposed };
                        load.add_slope(&self.s, of_end, by, out);
                    }
                }
            }
            PieceKind::Galerkin(action) => {
                let constants = action.points.constants();
                for (k, node) in action.points.gauss().iter().enumerate() {
                    let (at, Z) = (node.place(&self.s), self.at_gauss(of, action, k, Y));
                    let mut slope = vec![0.0; of.n];
                    match (of.wrench(control), &of.coordinates[control]) {
                        (Some(load), _) => {
                            let into = &mut Product { v: &Z, out: &mut slope };
                            let (row, column, scale, transposed) = (0, 0, 1.0, true);
                            let out = &mut Block { into, row, column, scale, transposed };
                            load.add_gauss_slopes(at.moving(&node.v), [1.0, 0.0], out);
                        }
                        (None, Some(own)) => own.add_bend(at.q, &Z, 1.0, &mut slope),
                        (None, None) => {}
                    }
                    for (j, out) in slopes.iter_mut().enumerate() {
                        let part = h * constants.gauss_weights[k] * constants.E[(k, j)];
                        out.iter_mut().zip(&slope).for_each(|(out, x)| *out += part * x);
                    }
                }
            }
        }
        slopes
    }

    /// `Z_k`.
    fn at_gauss(&self, of: &Transcription, action: &Action, k: usize, Y: &[&[f64]]) -> Vec<f64> {
        let mut Z = vec![0.0; of.n];
        for (i, Y) in Y.iter().enumerate() {
            let E = action.points.constants().E[(k, i)];
            Z.iter_mut().zip(*Y).for_each(|(z, y)| *z += E * y);
        }
        Z
    }

    /// What forces add to `∇²𝓛 (ξ_i, ξ_j)`, `i ≤ j`, by their second derivatives, with the columns
    /// `K` and the `Y` of all nodes of the piece; `None` where nothing does.
    pub(super) fn curvature(
        &self,
        of: &Transcription,
        K: &[&DMatrix<f64>],
        Y: &[&[f64]],
    ) -> Option<Vec<Vec<DMatrix<f64>>>> {
        let acts = match &self.kind {
            PieceKind::SubStep(_) => of.has_other,
            PieceKind::Galerkin(action) => of.acts || !action.efforts.is_empty(),
        };
        if !acts && self.wrenches.is_empty() {
            return None;
        }
        Some(products(K, |i, j, out| self.emit_bend(of, Y, i, j, out)))
    }

    /// Emits `∂²(Σ Y·w)/∂q_i∂q_j` of what is not inertial.
    pub(super) fn emit_bend(
        &self,
        of: &Transcription,
        Y: &[&[f64]],
        i: usize,
        j: usize,
        out: &mut dyn Entries,
    ) {
        match &self.kind {
            PieceKind::SubStep(_) => {
                let (Y, slots) = ([Y[0], Y[1]], [i, j].map(|end| Slot::BOTH[end]));
                if of.has_other {
                    of.system.beside_unknowns_bend(&self.s, Y, slots, out);
                }
                self.wrenches.iter().for_each(|load| load.add_bend(&self.s, Y, slots, out));
            }
            PieceKind::Galerkin(action) => {
                let (h, constants) = (self.s.h, action.points.constants());
                for (k, node) in action.points.gauss().iter().enumerate() {
                    let (at, Z) = (node.place(&self.s), self.at_gauss(of, action, k, Y));
                    let b = constants.gauss_weights[k];
                    let [E_i, E_j] = [i, j].map(|i| constants.E[(k, i)]);
                    let [D_i, D_j] = [i, j].map(|i| constants.D[(k, i)] / h);
                    let by = [E_i * E_j, E_i * D_j, D_i * E_j, D_i * D_j].map(|by| h * b * by);
                    of.system.gauss_bend(at.moving(&node.v), &Z, by, out);
                    for (_, tau, own) in &action.efforts {
                        own.emit_third(at.q, &Z, by[0] * tau, out);
                    }
                    for load in &self.wrenches {
                        load.add_gauss_bend(at.moving(&node.v), &Z, by, out);
                    }
                }
            }
        }
    }
}
