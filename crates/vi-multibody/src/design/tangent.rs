//! How the numbers of a mechanism change with a parameter.

use super::signals::SignalTangent;
use crate::builder::ForceElements;
use crate::constraint::rolling::Rolling;
use crate::constraint::velocity_constraint::VelocityConstraint;
use crate::force::spring::Damper;
use crate::geometry::form::Form;
use crate::pair::joint::{Joint, Side};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_core::force::DiscreteForce;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::{Interval, Slot};
use vi_core::num_dual::Dual64;
use vi_core::potential::DiscretePotential;
use vi_core::{Configuration, Motion};
use vi_rigid::load::LoadChange;

/// The derivatives of all numbers by one parameter; what is not listed does not change. Keys are
/// the numbers of the elements in the [`crate::Description`] and the [`crate::ForceElements`].
#[derive(Clone, Default)]
pub struct MechanismTangent {
    /// Of the acceleration of gravity, m/s².
    pub gravity: Vector3<f64>,
    /// Of bodies.
    pub bodies: BTreeMap<usize, BodyTangent>,
    /// Of point masses, kg.
    pub particles: BTreeMap<usize, f64>,
    /// Of joints.
    pub joints: BTreeMap<usize, JointTangent>,
    /// Of bars.
    pub bars: BTreeMap<usize, BarTangent>,
    /// Of scalar constraints.
    pub scalars: BTreeMap<usize, ScalarTangent>,
    /// Of springs between points.
    pub springs: BTreeMap<usize, SpringTangent>,
    /// Dampers between points that change, with their numbers, by the names of their forces.
    pub dampers: Vec<(String, Damper<Dual64>)>,
    /// Of efforts along joint coordinates: springs, dampers, motors, laws of one's own.
    pub efforts: Vec<EffortChange>,
    /// Of loads on bodies, by their numbers among the forces.
    pub loads: BTreeMap<usize, LoadChange>,
    /// Forces that come to the others as the parameter grows, by the names of those.
    pub forces: Vec<(String, Arc<dyn ForceChange>)>,
    /// What energies exert whose derivative by the parameter is no energy of the same kind.
    pub energies: Vec<Arc<dyn ForceChange>>,
    /// Energies that do.
    pub potentials: Vec<Arc<dyn DiscretePotential>>,
    /// Of the mass between `φ, d_1, d_2, d_3` of a frame and of the next one, by the first, kg,
    /// kg·m, kg·m².
    pub masses: BTreeMap<usize, SMatrix<f64, 8, 8>>,
    /// Of elements that this crate does not know.
    pub elements: Option<Arc<dyn StepTangent>>,
    /// Of the states of signals.
    pub signals: Option<SignalTangent>,
}

/// A force that comes to another one as a parameter grows.
pub trait ForceChange: Send + Sync {
    /// `out ← out + f_d^-`, or `f_d^+`, N·s.
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]);
    /// `out ← out + f(t, q, v)`, N: the continuous force.
    fn add_at_node(&self, at: Motion<'_>, out: &mut [f64]);
}

/// The change that is a force by itself.
pub struct WholeForce(
    /// The force.
    pub Box<dyn DiscreteForce>,
);

impl std::fmt::Debug for WholeForce {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WholeForce").finish_non_exhaustive()
    }
}

impl ForceChange for WholeForce {
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        match of {
            Slot::First => self.0.add_minus(s, out),
            Slot::Second => self.0.add_plus(s, out),
        }
    }
    fn add_at_node(&self, at: Motion<'_>, out: &mut [f64]) {
        self.0.add_continuous(at, out);
    }
}

/// How elements change the equations of a step with a parameter, at fixed `(q_n, q_{n+1}, z_n)`.
pub trait StepTangent: Send + Sync {
    /// `out ← out + (D_1 L_d + f_d^-)_θ`, or `(D_2 L_d + f_d^+)_θ`, without masses; shape `n`.
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]);
    /// `out ← out + (f − ∇V)_θ` at a node with a velocity, N, shape `n`.
    fn add_at_node(&self, q: &[f64], v: &[f64], out: &mut [f64]);
    /// The same of what a Galerkin step evaluates at its Gauss nodes.
    fn add_at_gauss(&self, q: &[f64], v: &[f64], out: &mut [f64]);
    /// `out ← out +` the derivative of the impulse of interpolated strains on control point `i` of
    /// a Galerkin step, N·s.
    fn add_at_point(&self, step: &StepPolynomial<'_>, i: usize, out: &mut [f64]);
    /// `out ← out + (A v)_θ` of the mass `A` that steps `h` add there, shape `n`.
    fn add_added_momentum(&self, at: Configuration<'_>, h: f64, v: &[f64], out: &mut [f64]);
    /// `out ← out + ζ_θ` of the internal variables `z_{n+1} = ζ`; shape of all of the system.
    fn add_internal(&self, s: &Interval, out: &mut [f64]);
    /// `out ← out +` their change at the start of a motion from `q`.
    fn add_begin(&self, q: &[f64], out: &mut [f64]);
    /// Whether all derivatives are numbers.
    fn is_finite(&self) -> bool;
}

impl MechanismTangent {
    /// What of it changes the force of a name, one of these, which stands alone then.
    #[must_use]
    pub(super) fn of_force(&self, name: &str, forces: &ForceElements) -> Self {
        let own = |k: &usize| forces.forces.get(*k).is_some_and(|own| own.name == name);
        let place = |k: usize| (0..k).filter(|k| own(k)).count();
        let loads = self.loads.iter().filter(|(k, _)| own(k));
        Self {
            joints: self.joints.clone(),
            dampers: self.dampers.iter().filter(|own| own.0 == name).cloned().collect(),
            efforts: self.efforts.iter().filter(|own| own.force == name).cloned().collect(),
            loads: loads.map(|(k, change)| (place(*k), *change)).collect(),
            forces: self.forces.iter().filter(|own| own.0 == name).cloned().collect(),
            signals: self.signals.clone(),
            ..Self::default()
        }
    }
}

impl std::fmt::Debug for MechanismTangent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MechanismTangent")
            .field("bodies", &self.bodies)
            .field("joints", &self.joints)
            .finish_non_exhaustive()
    }
}

/// Of the mass of a body, in a frame that is fixed in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyTangent {
    /// Of `M_φ`, kg.
    pub mass: f64,
    /// Of the static moment `∫ X_I dm` along the directors, kg·m.
    pub moment: Vector3<f64>,
    /// Of `∫ X_I X_J dm`, kg·m²: on the diagonal the Euler moments (57).
    pub euler: Matrix3<f64>,
}

impl BodyTangent {
    /// Of the mass (kg) and the inertia tensor about the centre along the directors (kg·m²), for a
    /// centre that moves by `center` (m) in the frame, of a body of mass `M_φ`.
    #[must_use]
    pub fn of_inertia(mass: f64, inertia: &Matrix3<f64>) -> Self {
        // E = ½ tr(J) I − J (57)
        let euler = Matrix3::identity() * (0.5 * inertia.trace()) - inertia;
        Self { mass, moment: Vector3::zeros(), euler }
    }
}

/// Of one side of a joint: components in the directors of its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SideTangent {
    /// Of `ϱ`, m.
    pub anchor: Vector3<f64>,
    /// Of the columns `m_1, m_2, n`.
    pub axes: Matrix3<f64>,
}

/// Of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointTangent {
    /// Of the side of the parent.
    pub parent: SideTangent,
    /// Of the side of the child.
    pub child: SideTangent,
    /// Of the advance per radian of a screw, m.
    pub pitch: f64,
}

impl JointTangent {
    /// The joint with its derivative.
    pub(super) fn dual(&self, joint: &Joint) -> Joint<Dual64> {
        let side = |own: &Side, change: &SideTangent| Side {
            frame: own.frame,
            anchor: own.anchor.zip_map(&change.anchor, Dual64::new),
            axes: own.axes.zip_map(&change.axes, Dual64::new),
        };
        let (parent, child) = (side(&joint.parent, &self.parent), side(&joint.child, &self.child));
        Joint { name: joint.name.clone(), kind: joint.kind, parent, child }
    }
}

/// Of a bar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BarTangent {
    /// Of its length, m.
    pub length: f64,
    /// Of the point of the ground that holds it, m.
    pub ground: Vector3<f64>,
}

/// `θ_ref` as a parameter changes it, with two derivatives in time.
pub type ReferenceTangent = Arc<dyn Fn(f64) -> [f64; 3] + Send + Sync>;

/// Of a scalar constraint.
#[derive(Clone)]
pub enum ScalarTangent {
    /// Of a distance: of `D` (coefficients and constant) and of its length, m.
    Distance {
        /// Of `D`.
        between: Form,
        /// Of `l`.
        length: f64,
    },
    /// Of a point on a line or on a plane: of the sides of its joint.
    Guide {
        /// The joint that the guide is made of.
        joint: Box<Joint>,
        /// How it changes.
        change: JointTangent,
    },
    /// Of a gear, a held coordinate: of `ρ` and `c`.
    Gear {
        /// Of `ρ`.
        ratio: f64,
        /// Of `c`.
        target: f64,
    },
    /// Of a prescribed motion: of `θ_ref`.
    Motion(ReferenceTangent),
    /// Of what rolls: all of its numbers, each with its derivative.
    Rolling(Arc<Rolling<Dual64>>),
    /// Of a blade: of its direction and of its point, with their derivatives.
    Blade(Box<[Form<Dual64>; 2]>),
    /// Of another constraint on velocities: its change, which is one by itself.
    Velocity(Arc<dyn VelocityConstraint>),
}

impl std::fmt::Debug for ScalarTangent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Distance { .. } => "distance",
            Self::Guide { .. } => "guide",
            Self::Gear { .. } => "gear",
            Self::Motion(_) => "motion",
            Self::Rolling(_) => "rolling",
            Self::Blade(_) => "blade",
            Self::Velocity(_) => "velocity",
        })
    }
}

/// Of a spring between two points.
#[derive(Clone, Debug)]
pub struct SpringTangent {
    /// Of `D = X_b − X_a`: coefficients and constant.
    pub between: Form,
    /// Of `k`.
    pub stiffness: f64,
    /// Of `l_0`, m.
    pub natural_length: f64,
    /// Of `c` of the damper beside it, N·s/m, which [`MechanismTangent::dampers`] lists.
    pub damping: f64,
}

/// `∂τ/∂θ` of an effort at a time, a coordinate and a rate.
pub type EffortTangent = Arc<dyn Fn(f64, f64, f64) -> f64 + Send + Sync>;

/// Of an effort along a joint coordinate.
#[derive(Clone)]
pub struct EffortChange {
    /// The name of the force, or of what stores energy.
    pub force: String,
    /// The joint.
    pub joint: usize,
    /// Which of its degrees of freedom.
    pub freedom: usize,
    /// How the effort changes.
    pub by: EffortTangent,
}

impl std::fmt::Debug for EffortChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { joint, freedom, .. } = self;
        write!(f, "effort along coordinate {freedom} of joint {joint}")
    }
}

impl EffortChange {
    /// Of a spring `τ = −k (θ − θ_0)` of a name.
    #[must_use]
    pub fn of_spring(
        force: &str,
        (joint, freedom): (usize, usize),
        [stiffness, rest]: [f64; 2],
        [by_stiffness, by_rest]: [f64; 2],
    ) -> Self {
        let by =
            move |_, coordinate: f64, _| stiffness * by_rest - by_stiffness * (coordinate - rest);
        Self { force: force.to_owned(), joint, freedom, by: Arc::new(by) }
    }
}
