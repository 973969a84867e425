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

use crate::objective::Term;
use nalgebra::Vector3;
use vi_constraints::linearization::Costate;
use vi_core::State;
use vi_multibody::design::MechanismTangent;
use vi_multibody::joint::Side;
use vi_multibody::mechanism::Mechanism;
use vi_rigid::directors::{FRAME, center, director};

/// A link of the tree.
#[derive(Clone, Debug)]
struct Link {
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
    links: Vec<Link>,             // parents first
    rates: Option<Vec<[f64; 2]>>, // η of each link: of its slide and of its turn
    moved: Vec<Vec<Moved>>,       // by parameters
}

/// How a parameter changes the columns of a joint: `r` and `n`, in the directors of their bodies.
#[derive(Clone, Copy, Debug)]
struct Moved {
    link: usize,
    arm: Vector3<f64>,
    axis: Vector3<f64>,
}

/// The motion of a link, and what it carries.
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    velocity: Vector3<f64>, // φ̇
    spin: Vector3<f64>,
    force: Vector3<f64>,
    torque: Vector3<f64>,
    slide: f64, // rate of the joint: ᴾp, or η
    turn: f64,
    power: f64, // ᴾp times the rate
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
            Some(Link {
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
                Some(Moved { link, arm: change.child.anchor, axis })
            });
            let own = own.collect::<Option<_>>()?;
            self.moved.push(own);
        }
        Some(self)
    }

    /// Leaf → root: momenta along the joints. Root → leaf: the motion with rates of their values.
    fn motions(&self, q: &[f64], p: &[f64]) -> Vec<Motion> {
        let mut all = vec![Motion::default(); self.links.len()];
        for (k, link) in self.links.iter().enumerate().rev() {
            let (own, momentum) = (frame(q, link), frame(p, link));
            let (arm, axis) = (link.arm_at(own), link.axis(q));
            let Motion { force, torque, .. } = &mut all[k];
            *force += center(momentum);
            *torque -= arm.cross(force);
            for i in 0..3 {
                *torque += director(own, i).cross(&director(momentum, i));
            }
            let (force, torque) = (*force, *torque);
            let slide = if link.slides { axis.dot(&force) } else { 0.0 };
            let turn = if link.turns { axis.dot(&torque) } else { 0.0 };
            let [u, w] = self.rates.as_ref().map_or([slide, turn], |rates| rates[k]);
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
            let arm = link.arm_at(own);
            let mut velocity = all[k].slide * axis; // of the anchor
            let mut spin = all[k].turn * axis;
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
}

fn frame<'a>(q: &'a [f64], link: &Link) -> &'a [f64] {
    &q[link.frame..link.frame + FRAME]
}

impl Link {
    /// `r`.
    fn arm_at(&self, own: &[f64]) -> Vector3<f64> {
        (0..3).map(|i| self.arm[i] * director(own, i)).sum()
    }

    /// `n`.
    fn axis(&self, q: &[f64]) -> Vector3<f64> {
        let carrier = self.parent_side.coordinates(q);
        (0..3).map(|i| self.parent_side.axes[(i, 2)] * director(carrier, i)).sum()
    }
}

fn add(x: Vector3<f64>, scale: f64, first: usize, out: &mut [f64]) {
    (0..3).for_each(|k| out[first + k] += scale * x[k]);
}

impl Term for TerminalMomentum {
    fn of_end(&self, end: &State) -> f64 {
        let power: f64 = self.motions(&end.q, &end.p).iter().map(|own| own.power).sum();
        if self.rates.is_some() { power } else { 0.5 * power }
    }

    fn add_of_end(&self, end: &State, scale: f64, out: &mut Costate) {
        let (q, p) = (&end.q, &end.p);
        let Costate { q: out, p: by_p, .. } = out;
        let all = self.motions(q, p);
        for (k, link) in self.links.iter().enumerate() {
            let Motion { velocity, spin, force, torque, slide, turn, .. } = all[k];
            let (own, first) = (frame(q, link), link.frame);
            // ∂Φ/∂p̄ = (φ̇, ω × d_I)
            add(velocity, scale, first, by_p);
            for i in 0..3 {
                add(spin.cross(&director(own, i)), scale, first + 3 + 3 * i, by_p);
                // ω·(δd_I × p_I) − ω·(ρ_I δd_I × f)
                let p_i = director(frame(p, link), i);
                let by = p_i.cross(&spin) - link.arm[i] * force.cross(&spin);
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
                let by = slide * force + turn * torque;
                let axes = link.parent_side.axes;
                (0..3).for_each(|i| add(by, scale * axes[(i, 2)], carrier + 3 + 3 * i, out));
            }
        }
    }

    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        if self.moved.is_empty() {
            return;
        }
        let all = self.motions(&end.q, &end.p);
        for (out, moved) in out.iter_mut().zip(&self.moved) {
            for own in moved {
                let link = &self.links[own.link];
                let Motion { spin, force, torque, slide, turn, .. } = all[own.link];
                let carried = link.parent.map_or_else(Vector3::zeros, |parent| all[parent].spin);
                let [child, parent] = [frame(&end.q, link), link.parent_side.coordinates(&end.q)];
                let along = |x: &Vector3<f64>, of: &[f64]| -> Vector3<f64> {
                    (0..3).map(|i| x[i] * director(of, i)).sum()
                };
                // f·(ω_parent × δr) − ω·(δr × f) + δn·(f u̇ + τ θ̇)
                let by_arm = force.cross(&(carried - spin)).dot(&along(&own.arm, child));
                let by_axis = (slide * force + turn * torque).dot(&along(&own.axis, parent));
                *out += scale * (by_arm + by_axis);
            }
        }
    }
}
