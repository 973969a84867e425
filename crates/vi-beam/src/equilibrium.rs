//! The equations of static equilibrium: residual and tangent.
//!
//! ```text
//! r(q) = P(q)ᵀ (∇V − λ w) − λ P_exᵀ (f, τ) = 0                               λ load factor
//! K    = P_exᵀ [ P_inᵀ∇²V P_in + Σ_I \widehat{∇_{d_I}V} d̂_I + λ(f̂, τ̂)_follower ] P_ex + joint geometry
//! q    = F_d(u, q_last),   Dr = K with ∂F_d/∂u on the right
//! ```
//! Source: theory §6, "Statics".
#![allow(non_snake_case)] // K, V

use crate::element::Elements;
use crate::high_order::HighOrderElements;
use crate::model::BeamModel;
use nalgebra::{Matrix3, Matrix6, Vector3};
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault, NewtonProblem};
use vi_core::potential::Potential;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::sparse_nodal::{Columns, ReducedMatrix, VelocityLayout};
use vi_rigid::directors::director;
use vi_rigid::load::{Load, LoadKind, add_wrench};
use vi_rigid::rotation::skew;

/// Everything an evaluation needs.
pub(crate) struct Work {
    pub(crate) elements: Elements,
    pub(crate) high_order: HighOrderElements,
    pub(crate) potentials: Vec<Box<dyn Potential>>,
    loads: Vec<Load>,
    pub(crate) time: f64,
    weight: Vec<f64>, // n  M γ
    pub(crate) mass: SparseMatrix,
    pub(crate) factor: f64,
    pub(crate) s: Interval, // q0: last equilibrium
    pub(crate) layout: VelocityLayout,
    pub(crate) left: Columns, // P(q)
    right: Columns,           // ∂F_d/∂u
    gradient: Vec<f64>,       // n  ∇V
    bracket: Vec<f64>,        // n  ∇V − λ (w + loads)
    spin: Vec<Matrix6<f64>>,  // geometric terms of each frame
    pub(crate) matrix: ReducedMatrix,
}

pub(crate) struct Problem<'a> {
    blocks: &'a [Block],
    work: &'a mut Work,
}

impl<'a> Problem<'a> {
    pub(crate) fn of(blocks: &'a [Block], work: &'a mut Work) -> Self {
        Self { blocks, work }
    }
}

impl NewtonProblem for Problem<'_> {
    fn blocks(&self) -> &[Block] {
        self.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.work.evaluate(x, r)
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.work.fill_tangent(x);
        Ok(self.work.matrix.solve(dx)?)
    }
}

impl Work {
    /// At the initial placement of the model, without loads.
    pub(crate) fn new(model: &BeamModel, mechanism: &Mechanism, loads: Vec<Load>) -> Self {
        let q = model.placement();
        let (n, frames) = (q.len(), q.len() / 12);
        let mass = model.mass_matrix(mechanism);
        let mut acceleration = vec![0.0; n];
        for k in 0..frames {
            acceleration[12 * k..12 * k + 3].copy_from_slice(model.description.gravity.as_slice());
        }
        let mut weight = vec![0.0; n];
        mass.mul_add(1.0, &acceleration, &mut weight);
        let layout = VelocityLayout::new(mechanism);
        let mut s = Interval::new(n);
        s.open(0.0, 1.0, &q);
        Self {
            elements: model.elements.clone(),
            high_order: model.high_order.clone(),
            potentials: Vec::new(),
            loads,
            time: 0.0,
            weight,
            mass,
            factor: 0.0,
            s,
            left: layout.columns(),
            right: layout.columns(),
            layout,
            gradient: vec![0.0; n],
            bracket: vec![0.0; n],
            spin: vec![Matrix6::zeros(); frames],
            matrix: ReducedMatrix::default(),
        }
    }

    /// Neighbouring nodes of all elements, those of higher order last.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        let elements = self.elements.list().iter().map(|element| element.nodes);
        elements.chain(self.high_order.pairs().iter().copied())
    }

    /// `r(u)`; leaves `P(q)` and `∇V` for the tangent.
    pub(crate) fn evaluate(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.layout.reparametrize(u, &mut self.s)?;
        let q = &self.s.q1;
        self.layout.null_space(q, &mut self.left);
        self.gradient.fill(0.0);
        self.elements.add_gradient(q, 1.0, &mut self.gradient);
        self.high_order.add_gradient(q, 1.0, &mut self.gradient);
        for potential in &self.potentials {
            potential.add_gradient(q, 1.0, &mut self.gradient);
        }
        self.bracket.copy_from_slice(&self.gradient);
        let factor = self.factor;
        self.add_loads(-factor);
        self.layout.pull_back(&self.left, &self.bracket, r);
        Ok(())
    }

    /// `bracket ← bracket + scale (w + loads)` at `q`.
    fn add_loads(&mut self, scale: f64) {
        for (b, w) in self.bracket.iter_mut().zip(&self.weight) {
            *b += scale * w;
        }
        for load in &self.loads {
            let own = load.offset()..load.offset() + 12;
            let frame = &self.s.q1[own.clone()];
            add_wrench(scale, load.wrench(self.time, frame), frame, &mut self.bracket[own]);
        }
    }

    /// `out ← ∂r/∂λ` at the point last evaluated.
    pub(crate) fn load_direction(&mut self, out: &mut [f64]) {
        self.bracket.fill(0.0);
        self.add_loads(-1.0);
        self.layout.pull_back(&self.left, &self.bracket, out);
    }

    /// Fills the tangent at the point last evaluated.
    pub(crate) fn fill_tangent(&mut self, u: &[f64]) {
        self.layout.tangent(u, &self.s, &mut self.right);
        let q = &self.s.q1;
        for (k, spin) in self.spin.iter_mut().enumerate() {
            let (frame, gradient) = (&q[12 * k..12 * k + 12], &self.gradient[12 * k..12 * k + 12]);
            let hats = (0..3).map(|i| skew(&director(gradient, i)) * skew(&director(frame, i)));
            spin.fill(0.0);
            spin.fixed_view_mut::<3, 3>(3, 3).copy_from(&hats.sum::<Matrix3<f64>>());
        }
        for load in self.loads.iter().filter(|load| load.kind() == LoadKind::Follower) {
            let frame = &q[load.offset()..load.offset() + 12];
            let (force, torque): (Vector3<f64>, Vector3<f64>) = load.wrench(self.time, frame);
            let spin = &mut self.spin[load.offset() / 12];
            let mut upper = spin.fixed_view_mut::<3, 3>(0, 3);
            upper += self.factor * skew(&force);
            let mut lower = spin.fixed_view_mut::<3, 3>(3, 3);
            lower += self.factor * skew(&torque);
        }
        let (elements, high_order) = (&self.elements, &self.high_order);
        let potentials = &self.potentials;
        let emit = |out: &mut dyn Entries| {
            elements.add_hessian(q, 1.0, out);
            high_order.add_hessian(q, 1.0, out);
            potentials.iter().for_each(|potential| potential.add_hessian(q, 1.0, out));
        };
        let pair = (&self.left, &self.right);
        self.matrix.fill(&self.layout, &emit, pair, &self.spin);
        self.matrix.add_joint_geometry(&mut self.layout, pair, &self.bracket);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{FrameRule, Mesh};
    use crate::sample::Sample;
    use crate::section::Section;
    use vi_multibody::mechanism::Attachment;
    use vi_multibody::pair::PairKind;
    use vi_multibody::spring::{Spring, SpringLaw};
    use vi_rigid::time_history::TimeHistory;

    /// ground – pair – beam – pair – beam – pair (a node on the ground), weight, loads, a spring.
    fn work(kinds: [PairKind; 3], sample: &mut Sample) -> Work {
        let section =
            Section::new([90.0, 80.0, 120.0, 5.0, 4.0, 3.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
        let mut model = BeamModel::new(Vector3::new(0.2, 0.3, -1.0));
        let rule = FrameRule::Normal(Vector3::z());
        let (corner, end) = (Vector3::new(1.0, 0.2, 0.0), Vector3::new(1.4, 1.1, 0.3));
        for (from, to) in [(Vector3::zeros(), corner), (corner, end)] {
            let mesh = Mesh::straight(from, to, 2, rule).unwrap();
            model.add_beam("beam", &mesh, section).unwrap();
        }
        let mut point = |at: Vector3<f64>| at + 0.3 * sample.vector();
        let axis = Vector3::new(0.3, -0.5, 1.0);
        model.join(kinds[0], None, 0, &point(Vector3::zeros()), &axis);
        model.join(kinds[1], Some(2), 3, &point(corner), &axis);
        model.join(kinds[2], Some(3), 4, &point(end), &axis);
        let mechanism = model.mechanism();
        assert!(!mechanism.has_loops());
        let mut load = |frame: usize, kind| {
            let (force, torque) = (sample.vector(), sample.vector());
            Load::new(12 * frame, kind, force, torque, TimeHistory::default()).unwrap()
        };
        let loads =
            vec![load(1, LoadKind::Follower), load(3, LoadKind::Dead), load(4, LoadKind::Dead)];
        let mut work = Work::new(&model, &mechanism, loads);
        let [a, b] = [0, 4].map(|k| mechanism.point_of(Attachment::Body(k), &Vector3::x()));
        let spring = Spring {
            between: b.minus(&a),
            stiffness: 3.0,
            natural_length: 0.5,
            law: SpringLaw::Linear,
        };
        work.potentials.push(Box::new(spring));
        work.factor = 0.7;
        work
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_residual() {
        use PairKind::{Cylindrical, Fixed, Planar, Prismatic, Revolute, Spherical, Universal};
        let mut sample = Sample::new(41);
        let mut worst = 0.0_f64;
        for kinds in [
            [Fixed, Spherical, Revolute],
            [Revolute, Universal, Fixed],
            [Spherical, Cylindrical, Prismatic],
            [Planar, Revolute, Spherical],
            [Universal, Fixed, Planar],
        ] {
            let mut work = work(kinds, &mut sample);
            let d = work.layout.dimension().1;
            let u: Vec<f64> = (0..d).map(|_| 0.2 * sample.number()).collect();
            let residual = |work: &mut Work, j: usize, by: f64| {
                let mut u = u.clone();
                u[j] += by;
                let mut r = vec![0.0; d];
                work.evaluate(&u, &mut r).unwrap();
                r
            };
            residual(&mut work, 0, 0.0);
            work.fill_tangent(&u);
            let exact = work.matrix.to_dense();
            for j in 0..d {
                let e = 1e-5;
                let (plus, minus) = (residual(&mut work, j, e), residual(&mut work, j, -e));
                for i in 0..d {
                    worst = worst.max(((plus[i] - minus[i]) / (2.0 * e) - exact[(i, j)]).abs());
                }
            }
        }
        println!("tangent off by {worst:.1e}");
        assert!(worst < 1e-6, "{worst:e}");
    }
}
