//! Momenta along the joints of a tree at the end of a run.
//!
//! ```text
//! ᴾp_j = P(q_N)ᵀ p̄_N along column j          Φ = ½ Σ_j ᴾp_j²
//! f_c = p_φ + Σ f_child,   τ_c = Σ d_I × p_I − r_c × f_c + Σ [(x_child − φ_c) × f_child + τ_child]
//! ᴾp = n·f_c of a slide, n·τ_c of a turn about the anchor x_c = φ_c + r_c of the link c
//! ∂Φ/∂p̄ = P ᴾp: the velocity of the rates ᴾp.   ∂Φ/∂q: its rate of working, differentiated
//! Φ = Σ_j η_j ᴾp_j                                    the same with the rates η
//! ```
//! The momentum at rest is zero, so a weight on this term brings a tree to rest.

use crate::node::{Curved, Node, NodeQuantity, NodeSlopes};
use crate::objective::CostTerm;
use nalgebra::Vector3;
use vi_constraints::linearization::Costate;
use vi_core::num_dual::Dual64;
use vi_core::number::Number;
use vi_core::{SparseMatrix, State};
use vi_multibody::design::MechanismTangent;
use vi_multibody::joint::{FrameId, Side};
use vi_multibody::mechanism::Mechanism;
use vi_rigid::directors::{FRAME, center, director};

/// A link of the tree.
#[derive(Clone, Debug)]
struct MomentumLink {
    frame: usize, // first coordinate
    parent: Option<usize>,
    parent_side: Side,
    arm: Vector3<f64>,    // r in its own directors
    joint: Option<usize>, // of the description
    turns: bool,
    slides: bool,
}

/// `½ Σ ᴾp_j²` of all joints, or `Σ η_j ᴾp_j`.
#[derive(Clone, Debug)]
pub struct TerminalMomentum {
    links: Vec<MomentumLink>,      // parents first
    rates: Option<Vec<[f64; 2]>>,  // η of each link: of its slide and of its turn
    moved: Vec<Vec<MovedColumns>>, // by parameters
}

/// How a parameter changes the columns of a joint: `r` and `n`, in the directors of their bodies.
#[derive(Clone, Copy, Debug)]
struct MovedColumns {
    link: usize,
    arm: Vector3<f64>,
    axis: Vector3<f64>,
}

/// The motion of a link, and what it carries.
#[derive(Clone, Copy, Debug)]
struct LinkMotion<T> {
    velocity: Vector3<T>, // φ̇
    spin: Vector3<T>,
    force: Vector3<T>,
    torque: Vector3<T>,
    slide: T, // rate of the joint: ᴾp, or η
    turn: T,
    power: T, // ᴾp times the rate
}

impl<T: Number> LinkMotion<T> {
    fn still() -> Self {
        let ([velocity, spin, force, torque], zero) = ([Vector3::zeros(); 4], T::of(0.0));
        Self { velocity, spin, force, torque, slide: zero, turn: zero, power: zero }
    }
}

impl TerminalMomentum {
    /// For trees of revolute, prismatic, cylindrical and fixed joints; `None` for others.
    #[must_use]
    pub fn of(mechanism: &Mechanism) -> Option<Self> {
        if mechanism.has_loops() || !mechanism.description().particles.is_empty() {
            return None;
        }
        let joints = &mechanism.description().joints;
        let links = mechanism.tree().links().iter().map(|link| {
            let kind = link.joint.kind;
            let (turns, slides) = (!kind.transmits(5), !kind.transmits(2)); // about n, along n
            if kind.dof() != usize::from(turns) + usize::from(slides) {
                return None;
            }
            Some(MomentumLink {
                frame: FRAME * link.frame,
                parent: link.parent,
                parent_side: link.joint.parent,
                arm: link.joint.child.anchor,
                joint: joints.iter().position(|joint| *joint == link.joint),
                turns,
                slides,
            })
        });
        Some(Self { links: links.collect::<Option<_>>()?, rates: None, moved: Vec::new() })
    }

    /// `Σ η_j ᴾp_j` of these unknowns of the tree.
    #[must_use]
    pub fn along(mut self, mechanism: &Mechanism, eta: &[(usize, f64)]) -> Self {
        let of = |unknown: usize| eta.iter().filter(|own| own.0 == unknown).map(|own| own.1).sum();
        let rates = mechanism.tree().links().iter().map(|link| {
            let mut unknowns = link.offset..link.offset + link.dof();
            let kind = link.joint.kind;
            // along n first, then about n
            let mut next = |moves: bool| if moves { unknowns.next().map_or(0.0, of) } else { 0.0 };
            [next(!kind.transmits(2)), next(!kind.transmits(5))]
        });
        self.rates = Some(rates.collect());
        self
    }

    /// The same where parameters change the mechanism so; `None` where one moves a joint that the
    /// tree has the other way round.
    #[must_use]
    pub fn by_parameters(mut self, tangents: &[MechanismTangent]) -> Option<Self> {
        for tangent in tangents {
            let own = tangent.joints.iter().map(|(joint, change)| {
                let link = self.links.iter().position(|link| link.joint == Some(*joint))?;
                let axis = change.parent.axes.column(2).into_owned();
                Some(MovedColumns { link, arm: change.child.anchor, axis })
            });
            let own = own.collect::<Option<_>>()?;
            self.moved.push(own);
        }
        Some(self)
    }

    /// Leaf → root: momenta along the joints. Root → leaf: the motion with rates of their values.
    fn motions<T: Number>(&self, q: &[T], p: &[T]) -> Vec<LinkMotion<T>> {
        let mut all = vec![LinkMotion::still(); self.links.len()];
        for (k, link) in self.links.iter().enumerate().rev() {
            let (own, momentum) = (frame(q, link), frame(p, link));
            let (arm, axis) = (along(&link.arm, own), link.axis(q));
            let LinkMotion { force, torque, .. } = &mut all[k];
            *force += center(momentum);
            *torque -= arm.cross(force);
            for i in 0..3 {
                *torque += director(own, i).cross(&director(momentum, i));
            }
            let (force, torque) = (*force, *torque);
            let slide = if link.slides { axis.dot(&force) } else { T::of(0.0) };
            let turn = if link.turns { axis.dot(&torque) } else { T::of(0.0) };
            let [u, w] = self.rates.as_ref().map_or([slide, turn], |rates| rates[k].map(T::of));
            (all[k].slide, all[k].turn) = (u, w);
            all[k].power = slide * u + turn * w;
            if let Some(parent) = link.parent {
                let lever = center(own) + arm - center(frame(q, &self.links[parent]));
                all[parent].force += force;
                all[parent].torque += lever.cross(&force) + torque;
            }
        }
        for (k, link) in self.links.iter().enumerate() {
            let (own, axis) = (frame(q, link), link.axis(q));
            let arm = along(&link.arm, own);
            let mut velocity = axis * all[k].slide; // of the anchor
            let mut spin = axis * all[k].turn;
            if let Some(parent) = link.parent {
                let lever = center(own) + arm - center(frame(q, &self.links[parent]));
                velocity += all[parent].velocity + all[parent].spin.cross(&lever);
                spin += all[parent].spin;
            }
            all[k].spin = spin;
            all[k].velocity = velocity - spin.cross(&arm);
        }
        all
    }

    /// `Φ` at a configuration with its momentum.
    fn value(&self, [q, p]: [&[f64]; 2]) -> f64 {
        let power: f64 = self.motions(q, p).iter().map(|own| own.power).sum();
        if self.rates.is_some() { power } else { 0.5 * power }
    }

    /// Adds `scale` times its derivatives by both.
    fn add_slopes<T: Number>(&self, [q, p]: [&[T]; 2], scale: f64, [out, by_p]: [&mut [T]; 2]) {
        let all = self.motions(q, p);
        for (k, link) in self.links.iter().enumerate() {
            let LinkMotion { velocity, spin, force, torque, slide, turn, .. } = all[k];
            let (own, first) = (frame(q, link), link.frame);
            // ∂Φ/∂p̄ = (φ̇, ω × d_I)
            add(velocity, scale, first, by_p);
            for i in 0..3 {
                add(spin.cross(&director(own, i)), scale, first + 3 + 3 * i, by_p);
                // ω·(δd_I × p_I) − ω·(ρ_I δd_I × f)
                let p_i = director(frame(p, link), i);
                let by = p_i.cross(&spin) - force.cross(&spin) * T::of(link.arm[i]);
                add(by, scale, first + 3 + 3 * i, out);
            }
            if let Some(parent) = link.parent {
                // f·(ω_parent × δ(x − φ_parent))
                let by = force.cross(&all[parent].spin);
                let carrier = self.links[parent].frame;
                add(by, scale, first, out);
                (0..3).for_each(|i| add(by, scale * link.arm[i], first + 3 + 3 * i, out));
                add(by, -scale, carrier, out);
                // δn·(f u̇ + τ θ̇)
                let by = force * slide + torque * turn;
                let axes = link.parent_side.axes;
                (0..3).for_each(|i| add(by, scale * axes[(i, 2)], carrier + 3 + 3 * i, out));
            }
        }
    }
}

fn frame<'a, T>(q: &'a [T], link: &MomentumLink) -> &'a [T] {
    &q[link.frame..link.frame + FRAME]
}

/// A vector by its components along directors.
fn along<T: Number>(x: &Vector3<f64>, of: &[T]) -> Vector3<T> {
    (0..3).fold(Vector3::zeros(), |sum, i| sum + director(of, i) * T::of(x[i]))
}

impl MomentumLink {
    /// `n`.
    fn axis<T: Number>(&self, q: &[T]) -> Vector3<T> {
        let own: Vector3<f64> = self.parent_side.axes.column(2).into();
        match self.parent_side.frame {
            FrameId::Ground => own.map(T::of),
            FrameId::Frame(k) => along(&own, &q[FRAME * k..FRAME * (k + 1)]),
        }
    }
}

fn add<T: Number>(x: Vector3<T>, scale: f64, first: usize, out: &mut [T]) {
    (0..3).for_each(|k| out[first + k] += x[k] * T::of(scale));
}

impl CostTerm for TerminalMomentum {
    fn of_end(&self, end: &State) -> f64 {
        self.value([&end.q, &end.p])
    }

    fn add_of_end(&self, end: &State, scale: f64, out: &mut Costate) {
        self.add_slopes([&end.q, &end.p], scale, [&mut out.q, &mut out.p]);
    }

    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        if self.moved.is_empty() {
            return;
        }
        let all = self.motions(&end.q, &end.p);
        for (out, moved) in out.iter_mut().zip(&self.moved) {
            for own in moved {
                let link = &self.links[own.link];
                let LinkMotion { spin, force, torque, slide, turn, .. } = all[own.link];
                let carried = link.parent.map_or_else(Vector3::zeros, |parent| all[parent].spin);
                let [child, parent] = [frame(&end.q, link), link.parent_side.coordinates(&end.q)];
                // f·(ω_parent × δr) − ω·(δr × f) + δn·(f u̇ + τ θ̇)
                let by_arm = force.cross(&(carried - spin)).dot(&along(&own.arm, child));
                let by_axis = (slide * force + turn * torque).dot(&along(&own.axis, parent));
                *out += scale * (by_arm + by_axis);
            }
        }
    }
}

/// A momentum of a node with its velocity, `p̄ = M v̂`: `M` as it is, in runs whose steps add
/// nothing to it, and without parameters.
#[derive(Clone, Debug)]
pub struct NodeMomentum {
    /// `Φ`.
    pub momentum: TerminalMomentum,
    /// `M`.
    pub mass: SparseMatrix,
}

impl NodeMomentum {
    fn of(&self, v: &[f64]) -> Vec<f64> {
        let mut p = vec![0.0; v.len()];
        self.mass.mul_add(1.0, v, &mut p);
        p
    }
}

impl NodeQuantity for NodeMomentum {
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        self.momentum.value([at.q, &self.of(v)])
    }
    fn add_slopes(&self, Node { at, v, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let mut by_p = vec![0.0; v.len()];
        self.momentum.add_slopes([at.q, &self.of(v)], scale, [out.q, &mut by_p]);
        self.mass.mul_add(1.0, &by_p, out.v); // M is symmetric
    }
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
}

impl Curved for NodeMomentum {
    fn add_bend(
        &self,
        Node { at, v, .. }: Node<'_>,
        [dq, dv]: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let dual = |x: &[f64], dx: &[f64]| -> Vec<Dual64> {
            x.iter().zip(dx).map(|(x, dx)| Dual64::new(*x, *dx)).collect()
        };
        let (at, p) = (dual(at.q, dq), dual(&self.of(v), &self.of(dv)));
        let [mut by_q, mut by_p] = [(); 2].map(|()| vec![Dual64::of(0.0); v.len()]);
        self.momentum.add_slopes([&at, &p], scale, [&mut by_q, &mut by_p]);
        q.iter_mut().zip(&by_q).for_each(|(q, by)| *q += by.eps);
        let by_p: Vec<f64> = by_p.iter().map(|by| by.eps).collect();
        self.mass.mul_add(1.0, &by_p, of_v);
    }
}
