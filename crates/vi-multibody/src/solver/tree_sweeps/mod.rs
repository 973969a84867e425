//! The sweeps of the Galerkin scheme on a tree, at all control points at once.
//!
//! Numbers of control points stand side by side ([`vi_core::lanes`]): place 0 holds control point
//! `s`, places `1 … s−1` the points between. The rows `i = 0 … s−1` of [2.28] have the same places;
//! only at place 0 they belong to another configuration, `q_n`.
//! ```text
//! root → leaf   q_j = F_d(u_j, q_n)                                                     [`motion`]
//! leaf → root   w_i [2.26] of each body, b = P_inᵀ w_i + Σ Xᵀ b,  r_i = Sᵀ b,  ρ_j = h Σ_i (K̂⁻¹)_ji r_i,
//!               e_j of ρ_j with the factors of A_j                                      [`factor`]
//! root → leaf   ν_j of e_j,  δu_j = T_j⁻¹ ν_j
//! ```
//! `X, S` of the rows are those of the present configurations, the factors keep their own.
#![allow(non_snake_case)] // A, K

mod factor;
mod link;
mod motion;
mod step;
mod weights;

use crate::geometry::lane_vectors::{Screw, Vector, three};
use crate::geometry::space::Vector as _;
use crate::pair::MAX_DOF;
use crate::sweep::advance::check_rotations;
use crate::tree::Tree;
use factor::{Column, Inertia};
use link::{Link, Start};
use motion::Pose;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_core::galerkin::{GaussLobatto, Stages};
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::{Block, Fault};
use vi_core::sparse::SparseMatrix;
use vi_rigid::rotation_lanes;
use weights::{Weights, control_point};

/// A link at the configurations of the rows.
#[derive(Clone, Copy, Debug)]
struct Row<L> {
    d: [Vector<L>; 3],
    arm: Vector<L>,
}

/// [`vi_constraints::galerkin::Sweeps`] of a tree of bodies, `O(N)`.
#[derive(Debug)]
pub struct TreeSweeps<T: Register> {
    lanes: T,
    stages: usize,
    tree: Tree,
    blocks: Vec<Block>,
    links: Vec<Link>,
    weights: Weights<T::Lanes>,
    constant: bool,                   // the force
    force: Vec<f64>,                  // n  the constant one
    starts: Vec<Start>,               // links and ground, as all that follows
    poses: Vec<Pose<T::Lanes>>,       //
    rows: Vec<Row<T::Lanes>>,         //
    base: Vec<[Vector<T::Lanes>; 4]>, // w_i without the momenta of the increments
    wrenches: Vec<Screw<T::Lanes>>,   // b
    solution: Vec<Screw<T::Lanes>>,   // p, then t
    inertias: Vec<Inertia<T::Lanes>>, // Â
    arms: Vec<Vector<T::Lanes>>,      // of the factors
    columns: Vec<Screw<T::Lanes>>,    // d  S of the rows
    factors: Vec<Column<T::Lanes>>,   // d
    inverses: Vec<T::Lanes>,          // D⁻¹ of all links
    u: Vec<T::Lanes>,                 // d
    r: Vec<T::Lanes>,                 // d
    x: Vec<T::Lanes>,                 // d  D⁻¹ e
    nu: Vec<T::Lanes>,                // d  corrections
}

impl<T: Register> TreeSweeps<T> {
    /// For a tree of frames; `None` where its mass matrix is not one of bodies, or `lanes` are too
    /// few.
    #[must_use]
    pub fn new(lanes: T, tree: &Tree, mass: &SparseMatrix, stages: Stages) -> Option<Self> {
        let (s, d, count) = (stages.count(), tree.dof(), tree.links().len());
        if s > T::Lanes::COUNT {
            return None;
        }
        let links = link::links(tree, mass)?;
        let inverses = links.iter().map(|link| link.dof * link.dof).sum();
        let (zero, screw) = (lanes.splat(0.0), Screw::zero(lanes));
        let (vector, rest) = (Vector([zero; 3]), Pose::rest(lanes));
        let frame = [0, 1, 2].map(|k| {
            Vector::splat(lanes, &[f64::from(k == 0), f64::from(k == 1), f64::from(k == 2)])
        });
        Some(Self {
            lanes,
            stages: s,
            tree: tree.clone(),
            blocks: tree.blocks(),
            links,
            weights: Weights::new(lanes, &GaussLobatto::new(stages), &[], 0.0),
            constant: false,
            force: vec![0.0; 12 * count],
            starts: vec![Start::ground(); count + 1],
            poses: vec![rest; count + 1],
            rows: vec![Row { d: frame, arm: vector }; count + 1],
            base: vec![[vector; 4]; count + 1],
            wrenches: vec![screw; count + 1],
            solution: vec![screw; count + 1],
            inertias: vec![Inertia::zero(lanes); count + 1],
            arms: vec![vector; count + 1],
            columns: vec![screw; d],
            factors: vec![Column { s: screw, u: screw }; d],
            inverses: vec![zero; inverses],
            u: vec![zero; d],
            r: vec![zero; d],
            x: vec![zero; d],
            nu: vec![zero; d],
        })
    }

    /// Reads the unknowns of all control points.
    ///
    /// # Errors
    /// [`Fault::NotFinite`], [`Fault::OutsideChart`].
    fn read(&mut self, u: &[f64]) -> Result<(), Fault> {
        const SMALL: f64 = 1.8; // a rotation vector of such components is shorter than π
        let (d, s) = (self.u.len(), self.stages);
        for (k, own) in self.u.iter_mut().enumerate() {
            *own = self.lanes.gather(|place| {
                if place < s { u[(control_point(place, s) - 1) * d + k] } else { 0.0 }
            });
        }
        if u.iter().all(|u| u.abs() <= SMALL) {
            return Ok(());
        }
        if u.iter().any(|u| !u.is_finite()) {
            return Err(Fault::NotFinite);
        }
        self.check()
    }

    /// Refuses rotations of more than half a revolution.
    fn check(&self) -> Result<(), Fault> {
        for link in &self.links {
            for place in 0..self.stages {
                let u = |k: usize| self.u[link.offset + k].at(place);
                check_rotations(link.motion, link.offset, u)?;
            }
        }
        Ok(())
    }

    /// Root → leaf: configurations of the control points and of the rows.
    #[inline(always)]
    fn place(&mut self) {
        let Self { lanes, links, starts, poses, rows, columns, u, .. } = self;
        for (k, link) in links.iter().enumerate() {
            let own = link.offset..link.offset + link.dof;
            let (start, parent) = (&starts[k], link.parent);
            let at = (start, &starts[parent]);
            let pose = motion::move_link(*lanes, link, at, &poses[parent], &u[own.clone()]);
            let zero = [0.0; 3];
            // increments of the rows
            let of_rows = Pose {
                x: (pose.x - poses[parent].x).with_first(&zero),
                d: three(
                    #[inline(always)]
                    |i| pose.d[i].with_first(&zero),
                ),
            };
            let d = of_rows.directors(*lanes, start);
            let rest = Pose::rest(*lanes);
            let arm = motion::arm(*lanes, link, start, (&of_rows, &rest), &rows[parent].d);
            motion::write_columns(*lanes, link, &d, &rows[parent].d, &mut columns[own]);
            rows[k] = Row { d, arm };
            poses[k] = pose;
        }
    }

    /// Factors at the control points.
    #[inline(always)]
    fn factorize(&mut self) -> Result<(), Fault> {
        let Self { lanes, links, starts, poses, inertias, arms, factors, inverses, .. } = self;
        inertias.fill(Inertia::zero(*lanes));
        let mut found = Ok(());
        for (k, link) in links.iter().enumerate().rev() {
            let (own, parent) = (link.offset..link.offset + link.dof, link.parent);
            let d = poses[k].directors(*lanes, &starts[k]);
            let carrier = poses[parent].directors(*lanes, &starts[parent]);
            let between = (&poses[k], &poses[parent]);
            arms[k] = motion::arm(*lanes, link, &starts[k], between, &carrier);
            let mut s = [Screw::zero(*lanes); MAX_DOF];
            motion::write_columns(*lanes, link, &d, &carrier, &mut s);
            let columns = &mut factors[own];
            for i in 0..columns.len() {
                columns[i].s = s[i];
            }
            let mut A = inertias[k];
            A.add_body(*lanes, &link.mass, &d);
            let inverse = &mut inverses[link.inverse..link.inverse + link.dof * link.dof];
            let (columns, above) = ((columns, inverse), &mut inertias[parent]);
            found = found.and(factor::eliminate(*lanes, link, &A, &arms[k], columns, above));
        }
        found
    }

    /// Leaf → root: residuals, and the right-hand sides of the corrections up to the root.
    #[inline(always)]
    fn balance(&mut self) {
        let Self { lanes, links, weights, poses, rows, base, wrenches, solution, .. } = self;
        let Self { columns, factors, inverses, arms, r, x, .. } = self;
        let zero = Screw::zero(*lanes);
        wrenches.fill(zero);
        solution.fill(zero);
        for (k, link) in links.iter().enumerate().rev() {
            let (row, pose) = (&rows[k], &poses[k]);
            let (base, m) = (&base[k], &weights.masses[k]);
            let w = three(
                #[inline(always)]
                |v| base[1 + v] + weights.mix(&pose.d[v]) * m[1 + v], // w_i  [2.26]
            );
            let mut b = wrenches[k];
            b.linear = b.linear + base[0] + weights.mix(&pose.x) * m[0];
            b.angular =
                // P_inᵀ w_i
                b.angular + row.d[0].cross(w[0]) + row.d[1].cross(w[1]) + row.d[2].cross(w[2]);
            let own = link.offset..link.offset + link.dof;
            for i in own.clone() {
                r[i] = columns[i].dot(b);
                x[i] = weights.solve(r[i]);
            }
            link.transfer.add_transposed(&row.arm, &b, &mut wrenches[link.parent]);
            let inverse = &inverses[link.inverse..link.inverse + link.dof * link.dof];
            let p = factor::transmit::<T>(&factors[own.clone()], inverse, solution[k], &mut x[own]);
            link.transfer.add_transposed(&arms[k], &p, &mut solution[link.parent]);
        }
    }

    /// Root → leaf: corrections.
    #[inline(always)]
    fn correct(&mut self) {
        let Self { lanes, links, factors, arms, solution, u, x, nu, .. } = self;
        solution[links.len()] = Screw::zero(*lanes);
        nu.copy_from_slice(x);
        for (k, link) in links.iter().enumerate() {
            let own = link.offset..link.offset + link.dof;
            let inherited = link.transfer.apply(*lanes, &arms[k], &solution[link.parent]);
            let nu = &mut nu[own.clone()];
            solution[k] = factor::receive::<T>(&factors[own], inherited, nu);
            if let Some(first) = link.rotation_vector {
                let at = link.offset + first;
                let theta = Vector([u[at], u[at + 1], u[at + 2]]);
                let turn = Vector([nu[first], nu[first + 1], nu[first + 2]]);
                let across = theta.cross(turn); // T⁻¹ = I − ½ θ̂ + κ θ̂²
                let kappa = rotation_lanes::kappa(*lanes, theta.dot(theta));
                let du = turn - across * 0.5 + theta.cross(across).scaled(kappa);
                nu[first..first + 3].copy_from_slice(&du.0);
            }
        }
    }

    /// `w_i` without momenta of increments: `δ_i0 p̄_n` and the impulses of forces, for each vector
    /// of each frame.
    #[inline(always)]
    fn add_impulses(&mut self, points: &ControlPoints) {
        let Self { lanes, links, weights, base, force, constant, .. } = self;
        let p = points.momentum();
        for (link, base) in links.iter().zip(base) {
            for v in 0..4 {
                for i in 0..3 {
                    let at = 12 * link.frame + 3 * v + i;
                    let mut sum = lanes.splat(0.0).with_first(p[at]);
                    if *constant {
                        sum = sum + weights.total * force[at];
                    } else {
                        for k in 0..weights.force.len() {
                            sum = sum + weights.force[k] * points.force(k)[at];
                        }
                    }
                    base[v].0[i] = sum;
                }
            }
        }
    }
}
