//! The discrete null space `P̄(q_n, q_{n+1})` with `Ḡ P̄ = 0`, `Ḡ` of [`crate::constraint`].
//!
//! Four ways to it:
//! ```text
//! pivoted QR of Ḡᵀ                 any system                       DiscreteQr
//! P(q_{n+1/2})                     bodies, S and R pairs, bars      MidpointNullSpace(MapSource)
//! averaged velocity maps           every pair of a tree but screws  AveragedTree
//! P̄_tree null(Ḡ_c P̄_tree)          closed loops on such a tree      TreeComplement
//! ```
//! `P̄` depends on the unknown, but its derivative is not needed. With `P̄_k` and the multipliers
//! `μ_k = −(Ḡ Ḡᵀ)⁻¹ Ḡ h B` (least squares; `h²λ` at the root) of the iterate `q_k` kept, Newton's
//! method takes its step on
//! ```text
//! r_k(q_{n+1}) = P̄_kᵀ (h B + Ḡᵀ μ_k),    ∂r_k/∂q_{n+1} = P̄_kᵀ (h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1})   exactly
//! ```
//! At `q_k` its value is `P̄ᵀ h B`, the residual of the scheme; at the root `q*` it is
//! `(G* P̄_k)ᵀ (μ_k − μ*)`, of second order in `q_k − q*`, so convergence stays quadratic. (The
//! same follows from `δḠ P̄ + Ḡ δP̄ = 0` and `h B = −Ḡᵀμ` at the root: `δP̄ᵀ h B = P̄ᵀ δḠᵀ μ`,
//! `δḠ = ½ D²g[δq]` for quadratic `g`.)
//! Any `μ_k` that tends to `μ*` will do; on trees they are found frame by frame
//! ([`vi_multibody::tree_multipliers`]). This is the additional term of an energy–momentum scheme,
//! and the multipliers are a by-product. The derivative itself is offered beside it
//! ([`EmLinearization`]). Averaged formulas annihilate `Ḡ` when `g(q_{n+1}) = 0`; on the way there,
//! in the d'Alembert form, the residual keeps the term `Ḡᵀμ_k`.
//!
//! Letters: `G` constraint Jacobian, bars: at the averaged configuration; `B`, `K` as in
//! [`crate::em_system`]. Source: Betsch & Leyendecker 2006 for `P̄`; the Newton matrix is ours.

use crate::constraint::DiscreteConstraints;
use crate::loop_nodal::LoopRows;
use nalgebra::{DMatrix, Vector3};
use vi_constraints::Constraints;
use vi_constraints::dalembert::NullSpaceSource;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_core::dense::set_product;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_multibody::PairKind;
use vi_multibody::joint::JointConfiguration;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::pair::columns::{Act, Axis};
use vi_multibody::pair::constraints::PairConstraint;
use vi_multibody::pair::{MAX_DOF, Twist, TwistTransfer, VelocityMap};
use vi_multibody::particle::ParticleTree;
use vi_multibody::tree::{Tree, TreeLink};

/// How the Newton matrix of the nodal form takes the derivative of `P̄` into account; the roots are
/// the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmLinearization {
    /// By the multipliers, `P̄ᵀ Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}`: for every system.
    #[default]
    Multipliers,
    /// By the derivative itself, `δP̄ᵀ h B`, as published (Betsch & Leyendecker 2006): for trees of
    /// bodies without screws, in dense matrices.
    NullSpaceDerivative,
}

/// Where `P̄` comes from.
pub trait DiscreteNullSpace<C>: Send {
    /// `out ← P̄(q_n, q_{n+1})`, shape `n × d`; `out` may hold anything on entry.
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>);
    /// Whether [`DiscreteNullSpace::add_derivative`] is there.
    fn is_differentiable(&self) -> bool {
        false
    }
    /// `out ← out + ∂(P̄ᵀ w)/∂q_{n+1} X` for a constant `w` of shape `n` and `X` of shape `n × d`.
    fn add_derivative(
        &mut self,
        _s: &Interval,
        _w: &[f64],
        _x: &DMatrix<f64>,
        _out: &mut DMatrix<f64>,
    ) {
        debug_assert!(false, "only of sources that are differentiable");
    }
}

/// `P̄ = P(q_{n+1/2})` with the `P` of a source that is exact off the constraint manifold too.
#[derive(Debug)]
pub struct MidpointNullSpace<N>(pub N);

impl<C: Constraints, N: NullSpaceSource<C>> DiscreteNullSpace<C> for MidpointNullSpace<N> {
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        self.0.null_space(constraints, s.t_mid(), &s.q_mid, out);
    }
}

impl<C> DiscreteNullSpace<C> for Box<dyn DiscreteNullSpace<C>> {
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        (**self).null_space(constraints, s, out);
    }
}

/// `P̄` by pivoted QR of `Ḡᵀ`, always of the generic rank.
#[derive(Debug)]
pub struct DiscreteQr {
    qr: NullSpaceQr,
    jacobian: DMatrix<f64>, // m × n
    rank: usize,
}

impl DiscreteQr {
    /// For `m` constraints of generic rank `rank` on `n` coordinates.
    #[must_use]
    pub fn new(n: usize, m: usize, rank: usize) -> Self {
        Self { qr: NullSpaceQr::new(n, m), jacobian: DMatrix::zeros(m, n), rank }
    }
}

impl<C: DiscreteConstraints> DiscreteNullSpace<C> for DiscreteQr {
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        self.jacobian.fill(0.0);
        constraints.discrete_jacobian(s, &mut self.jacobian);
        self.qr.factorize_preferring(&self.jacobian, constraints.allowances());
        self.qr.null_space(self.rank, out);
    }
}

/// `P̄ = P̄_tree Z̄`, `Z̄ = null(Ḡ_c P̄_tree)`: closed loops on a spanning tree.
#[derive(Debug)]
pub struct TreeComplement {
    tree: AveragedTree,
    loops: LoopRows,
    cut: IndependentRows,
    qr: NullSpaceQr,
    jacobian: DMatrix<f64>,   // m_c × n  Ḡ_c
    null_space: DMatrix<f64>, // n × d_tree  P̄_tree
    reduced: DMatrix<f64>,    // m_c × d_tree  Ḡ_c P̄_tree
    z: DMatrix<f64>,          // d_tree × d
}

impl TreeComplement {
    /// For a mechanism and its loops; `None` when its tree has a pair without averaged formulas.
    #[must_use]
    pub fn new(mechanism: &Mechanism, loops: LoopRows) -> Option<Self> {
        let tree = AveragedTree::new(mechanism)?;
        let (n, m, d) = (mechanism.dim(), mechanism.len(), tree.dof());
        let cut = loops.rows.len();
        Some(Self {
            cut: IndependentRows::choose(m, &loops.rows),
            qr: NullSpaceQr::new(d, cut),
            jacobian: DMatrix::zeros(cut, n),
            null_space: DMatrix::zeros(n, d),
            reduced: DMatrix::zeros(cut, d),
            z: DMatrix::zeros(d, d - loops.rank),
            tree,
            loops,
        })
    }
}

impl<C: DiscreteConstraints> DiscreteNullSpace<C> for TreeComplement {
    fn null_space(&mut self, constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        self.tree.null_space(constraints, s, &mut self.null_space);
        self.jacobian.fill(0.0);
        let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        self.cut.emit_selected(&emit, place, &mut self.jacobian);
        let (jacobian, null_space) = (self.jacobian.as_view(), self.null_space.as_view());
        set_product(self.reduced.as_view_mut(), jacobian, null_space);
        let scale = &self.loops.scale;
        self.qr.factorize_scaled(&self.reduced, |i| scale[i]);
        self.qr.null_space(self.loops.rank, &mut self.z);
        set_product(out.as_view_mut(), self.null_space.as_view(), self.z.as_view());
    }
}

/// `P̄` of a mechanism's spanning tree, from averaged vectors: `P̄ = P_in(q_{n+1/2}) P̄_ex`.
///
/// With bars for averages over the step, `ϱ̄`, `c̄`, `n̄`, `m̄_i`, parent to child:
/// ```text
/// S, R, universal   as at a node, with averaged vectors
/// C                 slide m̄_1×m̄_2,            turn (ϱ̄²×n̄, n̄)
/// P                 slide m̄_1×m̄_2
/// E                 slides m̄_2×n̄, n̄×m̄_1,     turn (ϱ̄²×n̄, n̄)
/// ```
/// The averaged `m̄_1, m̄_2, n̄` are no longer orthogonal: the vectors of a node would miss
/// `Ḡ P̄ = 0` by `O(h²)` in C, P and E. The gap of a C pair that the tree walks from child to
/// parent adds `r̄×n̄` to its turn.
#[derive(Debug)]
pub struct AveragedTree {
    tree: Tree,
    particles: ParticleTree,
    reversed: Vec<bool>, // links walked against the order of their joint
    maps: Vec<VelocityMap>,
    twists: Vec<Twist>,
    nu: Vec<f64>,
    shifted: Vec<f64>, // n
    pulled: Vec<f64>,  // d
}

impl AveragedTree {
    /// For a mechanism; `None` when its tree has a pair without averaged formulas (screws).
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Option<Self> {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let known = tree.links().iter().all(|link| is_averaged(link.joint.kind));
        if !known {
            return None;
        }
        let joints = &mechanism.description().joints;
        let links = tree.links().len();
        Some(Self {
            reversed: tree.links().iter().map(|link| !joints.contains(&link.joint)).collect(),
            maps: vec![VelocityMap::new(TwistTransfer::None, &[]); links],
            twists: vec![Twist::zero(); links],
            nu: vec![0.0; tree.dof()],
            shifted: Vec::new(),
            pulled: Vec::new(),
            tree,
            particles,
        })
    }

    /// Freedoms of the tree.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.tree.dof() + self.particles.dof()
    }

    /// The velocity maps of the links at the averaged configuration.
    pub(crate) fn maps_at(&mut self, q_mid: &[f64]) -> &[VelocityMap] {
        self.velocity_maps(q_mid);
        &self.maps
    }

    /// `out ← P̄(q_{n+1/2})ᵀ w` by a sweep; frames only.
    fn pull_back(&mut self, q_mid: &[f64], w: &[f64], out: &mut [f64]) {
        self.velocity_maps(q_mid);
        let Self { tree, maps, twists, .. } = self;
        tree.pull_back(|k| &maps[k], q_mid, w, twists, out);
    }

    fn velocity_maps(&mut self, q_mid: &[f64]) {
        for (k, link) in self.tree.links().iter().enumerate() {
            self.maps[k] =
                averaged_map(link, self.reversed[k], &self.tree.configuration(link, q_mid));
        }
    }
}

fn is_averaged(kind: PairKind) -> bool {
    kind.properties().motion.columns().iter().all(|column| column.act != Act::Screw)
}

/// `X̄`, `S̄` at the averaged configuration.
fn averaged_map(link: &TreeLink, reversed: bool, at: &JointConfiguration) -> VelocityMap {
    let properties = link.joint.kind.properties();
    let columns = properties.motion.columns();
    if columns.iter().all(|column| column.act != Act::Slide) {
        return link.joint.kind.velocity_map(at);
    }
    let axis = |i: usize| if reversed { at.axis_child(i) } else { at.axis(i) };
    let carries_gap = reversed && properties.constraints.contains(&PairConstraint::GapAlongAxis);
    let arm = if carries_gap { at.rho_child() - at.gap() } else { at.rho_child() };
    let mut twists = [Twist::zero(); MAX_DOF];
    for (twist, column) in twists.iter_mut().zip(columns) {
        let (Axis::Parent(i) | Axis::Child(i)) = column.axis;
        *twist = match column.act {
            Act::Slide => Twist::new(axis((i + 1) % 3).cross(&axis((i + 2) % 3)), Vector3::zeros()),
            _ => Twist::new(arm.cross(&axis(i)), axis(i)),
        };
    }
    VelocityMap::new(TwistTransfer::Rigid(at.c()), &twists[..columns.len()])
}

impl<C> DiscreteNullSpace<C> for AveragedTree {
    fn null_space(&mut self, _constraints: &C, s: &Interval, out: &mut DMatrix<f64>) {
        self.velocity_maps(&s.q_mid);
        out.fill(0.0);
        let Self { tree, maps, twists, nu, .. } = self;
        tree.write_null_space(maps, &s.q_mid, nu, twists, out);
        self.particles.null_space(&s.q_mid, out);
    }

    /// Of bodies: the axes of bars are not polynomial in `q`.
    fn is_differentiable(&self) -> bool {
        self.particles.dof() == 0
    }

    /// `P̄` is a polynomial of degree two in `q_{n+1/2}`, for which a central difference of any
    /// width is exact: `∂(P̄ᵀ w) δ = ½ [P̄(q + δ)ᵀ w − P̄(q − δ)ᵀ w]`, with
    /// `δq_{n+1/2} = ½ δq_{n+1}`. `O(N)` for each column.
    fn add_derivative(
        &mut self,
        s: &Interval,
        w: &[f64],
        x: &DMatrix<f64>,
        out: &mut DMatrix<f64>,
    ) {
        let d = self.tree.dof();
        self.shifted.resize(s.dim(), 0.0);
        self.pulled.resize(d, 0.0);
        let (mut shifted, mut pulled) =
            (std::mem::take(&mut self.shifted), std::mem::take(&mut self.pulled));
        for k in 0..x.ncols() {
            for by in [0.5, -0.5] {
                for (i, shifted) in shifted.iter_mut().enumerate() {
                    *shifted = s.q_mid[i] + by * x[(i, k)];
                }
                self.pull_back(&shifted, w, &mut pulled);
                for (i, pulled) in pulled.iter().enumerate() {
                    out[(i, k)] += by * pulled;
                }
            }
        }
        (self.shifted, self.pulled) = (shifted, pulled);
    }
}
