//! The discrete null space `P̄(q_n, q_{n+1})` with `Ḡ P̄ = 0`, `Ḡ = G(q_{n+1/2})`.
//!
//! Three ways to it:
//! ```text
//! pivoted QR of Ḡᵀ                 any system                       AtMidpoint(QrSource)
//! P(q_{n+1/2})                     bodies, S and R pairs, bars      AtMidpoint(MapSource)
//! averaged velocity maps           every pair of a tree             AveragedTree
//! ```
//! `P̄` depends on the unknown, but its derivative is not needed. With `P̄_k` and the multipliers
//! `μ_k = −(Ḡ Ḡᵀ)⁻¹ Ḡ h B` (least squares; `h²λ` at the root) of the iterate `q_k` kept, Newton's method
//! takes its step on
//! ```text
//! r_k(q_{n+1}) = P̄_kᵀ (h B + Ḡᵀ μ_k),    ∂r_k/∂q_{n+1} = P̄_kᵀ (h K + ½ Σ_i μ_i D²g_i)        exactly
//! ```
//! At `q_k` its value is `P̄ᵀ h B`, the residual of the scheme; at the root `q*` it is
//! `(G* P̄_k)ᵀ (μ_k − μ*)`, of second order in `q_k − q*`, so convergence stays quadratic. (The same
//! follows from `δḠ P̄ + Ḡ δP̄ = 0` and `h B = −Ḡᵀμ` at the root: `δP̄ᵀ h B = P̄ᵀ δḠᵀ μ`, `δḠ = ½ D²g[δq]`.)
//! This is the additional term of an energy–momentum scheme, and the multipliers are a by-product.
//! Averaged formulas annihilate `Ḡ` when `g(q_{n+1}) = 0`; on the way there, in the d'Alembert form, the
//! residual keeps the term `Ḡᵀμ_k`.
//!
//! Letters: `G` constraint Jacobian, bars: at the averaged configuration; `B`, `K` as in
//! [`crate::em_system`]. Source: Betsch & Leyendecker 2006 for `P̄`; the Newton matrix is ours.

use nalgebra::{DMatrix, SVector, Vector3};
use vi_constraints::Constraints;
use vi_constraints::dalembert::NullSpaceSource;
use vi_core::interval::Interval;
use vi_multibody::PairKind;
use vi_multibody::joint::Placement;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::pair::{Transfer, Twist, VelocityMap};
use vi_multibody::particle::ParticleTree;
use vi_multibody::tree::{Link, Tree};

/// Where `P̄` comes from.
pub trait DiscreteNullSpace<C> {
    /// `out ← P̄(q_n, q_{n+1})`, shape `n × d`; `out` may hold anything on entry.
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>);
}

/// `P̄ = P(q_{n+1/2})` with the `P` of a source that is exact off the constraint manifold too.
pub struct AtMidpoint<N>(pub N);

impl<C: Constraints, N: NullSpaceSource<C>> DiscreteNullSpace<C> for AtMidpoint<N> {
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        self.0.null_space(constraints, s.t_mid(), &s.q_mid, out);
    }
}

impl<C> DiscreteNullSpace<C> for Box<dyn DiscreteNullSpace<C>> {
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        (**self).null_space(constraints, s, out);
    }
}

/// `P̄` of a mechanism without loops, from averaged vectors: `P̄ = P_in(q_{n+1/2}) P̄_ex`.
///
/// With bars for averages over the step, `ϱ̄`, `c̄`, `n̄`, `m̄_i`, parent to child:
/// ```text
/// S, R, universal   as at a node, with averaged vectors
/// C                 slide m̄_1×m̄_2,            turn (ϱ̄²×n̄, n̄)
/// P                 slide m̄_1×m̄_2
/// E                 slides m̄_2×n̄, n̄×m̄_1,     turn (ϱ̄²×n̄, n̄)
/// ```
/// The averaged `m̄_1, m̄_2, n̄` are no longer orthogonal: the vectors of a node would miss `Ḡ P̄ = 0` by
/// `O(h²)` in C, P and E. The gap of a C pair that the tree walks from child to parent adds
/// `r̄×n̄` to its turn.
pub struct AveragedTree {
    tree: Tree,
    particles: ParticleTree,
    reversed: Vec<bool>, // links walked against the order of their joint
    maps: Vec<VelocityMap>,
    twists: Vec<Twist>,
    nu: Vec<f64>,
}

impl AveragedTree {
    /// For a mechanism; `None` when it has loops, or a pair without averaged formulas.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let known = tree.links().iter().all(|link| is_averaged(link.joint.kind));
        if mechanism.has_loops() || !known {
            return None;
        }
        let joints = &mechanism.description().joints;
        let links = tree.links().len();
        Some(Self {
            reversed: tree.links().iter().map(|link| !joints.contains(&link.joint)).collect(),
            maps: vec![VelocityMap::new(Transfer::None, &[]); links],
            twists: vec![Twist::zero(); links],
            nu: vec![0.0; tree.dof()],
            tree,
            particles,
        })
    }

    fn velocity_maps(&mut self, q_mid: &[f64]) {
        for (k, link) in self.tree.links().iter().enumerate() {
            self.maps[k] = averaged_map(link, self.reversed[k], &self.tree.placement(link, q_mid));
        }
    }
}

fn is_averaged(kind: PairKind) -> bool {
    use PairKind::{Cylindrical, Fixed, Free, Planar, Prismatic, Revolute, Spherical, Universal};
    matches!(
        kind,
        Spherical | Revolute | Cylindrical | Prismatic | Planar | Fixed | Universal | Free
    )
}

/// `X̄`, `S̄` at the averaged placement.
fn averaged_map(link: &Link, reversed: bool, at: &Placement) -> VelocityMap {
    let axis = |i: usize| if reversed { at.axis_child(i) } else { at.axis(i) };
    let slide = |along: Vector3<f64>| Twist::new(along, Vector3::zeros());
    let n = axis(2);
    let rigid = Transfer::Rigid(at.c);
    match link.joint.kind {
        PairKind::Cylindrical => {
            let arm = if reversed { at.rho_child - at.gap } else { at.rho_child };
            let turn = Twist::new(arm.cross(&n), n);
            VelocityMap::new(rigid, &[slide(axis(0).cross(&axis(1))), turn])
        }
        PairKind::Prismatic => VelocityMap::new(rigid, &[slide(axis(0).cross(&axis(1)))]),
        PairKind::Planar => {
            let slides = [slide(axis(1).cross(&n)), slide(n.cross(&axis(0)))];
            let turn = Twist::new(at.rho_child.cross(&n), n);
            VelocityMap::new(rigid, &[slides[0], slides[1], turn])
        }
        kind => kind.velocity_map(at),
    }
}

impl<C> DiscreteNullSpace<C> for AveragedTree {
    fn null_space(&mut self, _constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        self.velocity_maps(&s.q_mid);
        out.fill(0.0);
        let n = out.nrows();
        for k in 0..self.tree.dof() {
            self.nu.fill(0.0);
            self.nu[k] = 1.0;
            self.tree.push_forward(&self.maps, &self.nu, &mut self.twists);
            let column = &mut out.as_mut_slice()[k * n..(k + 1) * n];
            for (link, twist) in self.tree.links().iter().zip(&self.twists) {
                let own = 12 * link.frame..12 * link.frame + 12;
                let (v, w) = (twist.linear, twist.angular);
                let twist = SVector::from([v[0], v[1], v[2], w[0], w[1], w[2]]);
                vi_rigid::null_space::push_forward(&s.q_mid[own.clone()], &twist, &mut column[own]);
            }
        }
        self.particles.null_space(&s.q_mid, out);
    }
}
