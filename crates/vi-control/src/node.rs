//! Numbers of a node: of its configuration, its velocity, its multipliers, its acceleration.
//!
//! ```text
//! y(t, q, v̂, λ, a)        ∂y/∂q, ∂y/∂v̂, ∂y/∂λ, ∂y/∂a, y_θ
//! y(t, q, v̂)              D²y [`Curved`]
//! ```

use crate::objective::{NotedNode, Quantity};
pub use crate::reads::NodeReads;
use vi_core::{Configuration, Motion};
use vi_multibody::law::Input;

/// A node as numbers read it; what none of them reads may be empty.
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    /// `(t, q)`, angles and internal variables.
    pub at: Configuration<'a>,
    /// `v̂`, shape `n`.
    pub v: &'a [f64],
    /// `λ` of all constraints, shape `m`.
    pub lambda: &'a [f64],
    /// `a`, shape `n`.
    pub a: &'a [f64],
}

impl<'a> Node<'a> {
    /// With its velocity alone.
    #[must_use]
    pub fn moving(at: Motion<'a>) -> Self {
        Self { at: at.configuration(), v: at.v, lambda: &[], a: &[] }
    }
}

/// Derivatives by what a node is.
#[derive(Debug)]
pub struct NodeSlopes<'a> {
    /// By `q`, shape `n`.
    pub q: &'a mut [f64],
    /// By `v̂`, shape `n`.
    pub v: &'a mut [f64],
    /// By `λ`, shape `m`, or empty as that of the node.
    pub lambda: &'a mut [f64],
    /// By `a`, shape `n`, or empty as that of the node.
    pub a: &'a mut [f64],
    /// By the internal variables, shape of those of the node.
    pub z: &'a mut [f64],
}

impl NodeSlopes<'_> {
    /// The same for a while.
    pub fn again(&mut self) -> NodeSlopes<'_> {
        let Self { q, v, lambda, a, z } = self;
        NodeSlopes { q, v, lambda, a, z }
    }
}

/// A number that a node has.
pub trait NodeQuantity: Send + Sync {
    /// The number.
    fn value(&self, node: Node<'_>) -> f64;
    /// Adds `scale` times its derivatives.
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>);
    /// `∂y/∂θ` with all that the node is held.
    fn by_parameter(&self, _parameter: usize, _node: Node<'_>) -> f64 {
        0.0
    }
    /// What it reads beside `q` and `v̂`.
    fn reads(&self) -> NodeReads {
        NodeReads::default()
    }
    /// Whether it reads `v̂`.
    fn reads_velocity(&self) -> bool {
        true
    }
    /// Whether it changes with the time by itself, or may.
    fn reads_time(&self) -> bool {
        false
    }
    /// `∂y/∂q` and `∂y/∂v̂` of a number of configuration and velocity.
    fn slopes_at(&self, node: Node<'_>) -> [Vec<f64>; 2] {
        let [mut q, mut v] = [(); 2].map(|()| vec![0.0; node.at.q.len()]);
        let [lambda, a, z] = [(); 3].map(|()| &mut [][..]);
        self.add_slopes(node, 1.0, NodeSlopes { q: &mut q, v: &mut v, lambda, a, z });
        [q, v]
    }
    /// Its second derivatives, which optimal control needs; `None`, unless said otherwise, where
    /// they are not known.
    fn curved(&self) -> Option<&dyn Curved> {
        None
    }
    /// Takes note of a node, one after the other, where the number is continued along the motion.
    fn follow(&self, _node: Configuration<'_>, _seen: NotedNode) {}
}

/// A number of configuration and velocity with second derivatives.
pub trait Curved {
    /// `q ← q + scale ∂²y/∂q∂(q, v̂) (δq, δv̂)`, `v ← v + scale ∂²y/∂v̂∂(q, v̂) (δq, δv̂)`, all of
    /// shape `n`; what the node has beside `q` and `v̂` is held.
    fn add_bend(&self, node: Node<'_>, changes: [&[f64]; 2], scale: f64, out: [&mut [f64]; 2]);
}

impl<Y: NodeQuantity + ?Sized> NodeQuantity for Box<Y> {
    fn value(&self, node: Node<'_>) -> f64 {
        (**self).value(node)
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        (**self).add_slopes(node, scale, out);
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        (**self).by_parameter(parameter, node)
    }
    fn reads(&self) -> NodeReads {
        (**self).reads()
    }
    fn reads_velocity(&self) -> bool {
        (**self).reads_velocity()
    }
    fn reads_time(&self) -> bool {
        (**self).reads_time()
    }
    fn curved(&self) -> Option<&dyn Curved> {
        (**self).curved()
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        (**self).follow(node, seen);
    }
}

/// The rate `ẏ = ∇y·v` of a quantity.
#[derive(Clone, Debug)]
pub struct RateOf<Q>(
    /// Of what.
    pub Q,
);

impl<Q: Quantity> NodeQuantity for RateOf<Q> {
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        let mut slope = vec![0.0; v.len()];
        self.0.add_slope(at, 1.0, &mut slope);
        vi_core::linear::dot(&slope, v)
    }
    fn add_slopes(&self, Node { at, v, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        self.0.add_slope(at, scale, out.v);
        self.0.add_bend(at.moving(v), scale, out.q);
    }
    fn by_parameter(&self, parameter: usize, Node { at, v, .. }: Node<'_>) -> f64 {
        self.0.rate_by_parameter(parameter, at.moving(v))
    }
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.0.follow(node, seen);
    }
}

impl<Q: Quantity> Curved for RateOf<Q> {
    fn add_bend(
        &self,
        Node { at, v, .. }: Node<'_>,
        [dq, dv]: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        self.0.add_third(at, [v, dq], scale, q);
        self.0.add_bend(at.moving(dv), scale, q);
        self.0.add_bend(at.moving(dq), scale, of_v);
    }
}

/// What a law reads of a node, but what is held or past.
impl NodeQuantity for Input {
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        self.at_node(at.moving(v), &[])
    }
    fn add_slopes(
        &self,
        Node { at, v, .. }: Node<'_>,
        scale: f64,
        NodeSlopes { q, v: of_v, .. }: NodeSlopes<'_>,
    ) {
        self.for_each_slope_by_position(at.q, v, &mut |i, slope| q[i] += scale * slope);
        self.for_each_slope_by_velocity(at.q, v, &mut |i, slope| of_v[i] += scale * slope);
    }
    fn reads_time(&self) -> bool {
        matches!(self, Self::Time)
    }
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
}

impl Curved for Input {
    fn add_bend(
        &self,
        Node { at, v, .. }: Node<'_>,
        changes: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        self.add_bends_at_node([at.q, v], changes, scale, [q, of_v]);
    }
}
