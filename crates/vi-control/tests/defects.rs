//! Planted defects of the linearized step: each is found by what it does to a gradient.

use crate::runs::{Subject, four_bar, pendulum, run, spatial};
use vi_constraints::linearization::{Costate, StepLinearization};
use vi_constraints::{Constraints, SchemeKind};
use vi_control::objective::StepGradient;
use vi_control::{Checkpoints, Gradient, Task};
use vi_core::linear::norm_inf;
use vi_core::sparse::{Block, Entries};
use vi_core::{
    Composition, Configuration, DiscreteLagrangian, Interval, MechanicalSystem, Motion, Slot,
    SparseMatrix,
};
use vi_multibody::Mechanism;

const STEPS: usize = 20;

/// What is wrong in a sweep backward.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Defect {
    None,
    /// `B` without `h Σ λ_i D²g_i`.
    NoCurvature,
    /// `C` without `D_1 f_d^+`.
    NoSlopeOfLaterForce,
    /// What forces have in the matrix of the step is not transposed.
    NotTransposed,
    /// A control has its whole impulse at each end, not half of it.
    WholeImpulse,
}

struct Faulty<'a, T> {
    inner: &'a T,
    defect: Defect,
}

impl<T: DiscreteLagrangian> MechanicalSystem for Faulty<'_, T> {
    fn mass(&self) -> &SparseMatrix {
        self.inner.mass()
    }
    fn potential_energy(&self, at: Configuration<'_>) -> f64 {
        self.inner.potential_energy(at)
    }
    fn add_potential_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.inner.add_potential_gradient(at, scale, out);
    }
    fn add_force(&self, at: Motion<'_>, out: &mut [f64]) {
        self.inner.add_force(at, out);
    }
}

impl<T: DiscreteLagrangian> DiscreteLagrangian for Faulty<'_, T> {
    fn discrete_lagrangian(&self, s: &Interval) -> f64 {
        self.inner.discrete_lagrangian(s)
    }
    fn d1(&self, s: &Interval, out: &mut [f64]) {
        self.inner.d1(s, out);
    }
    fn d2(&self, s: &Interval, out: &mut [f64]) {
        self.inner.d2(s, out);
    }
    fn d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.d2_d1(s, out);
    }
    fn d1_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.d1_d1(s, out);
    }
    fn d2_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.d2_d2(s, out);
    }
    fn potential_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.inner.potential_hessian(at, scale, out);
    }
    fn add_force_minus(&self, s: &Interval, out: &mut [f64]) {
        self.inner.add_force_minus(s, out);
    }
    fn add_force_plus(&self, s: &Interval, out: &mut [f64]) {
        self.inner.add_force_plus(s, out);
    }
    fn force_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.inner.force_minus_d2(s, out);
    }
    fn force_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        let missing = self.defect == Defect::NoSlopeOfLaterForce;
        let transposed =
            self.defect == Defect::NotTransposed && [of, by] == [Slot::First, Slot::Second];
        if !(missing && [of, by] == [Slot::Second, Slot::First]) {
            let mut block = Block { into: out, row: 0, column: 0, scale: 1.0, transposed };
            self.inner.force_slope(s, of, by, &mut block);
        }
    }
    fn discrete_potential_energy(&self, s: &Interval) -> f64 {
        self.inner.discrete_potential_energy(s)
    }
}

impl Constraints for Faulty<'_, Mechanism> {
    fn dim(&self) -> usize {
        Constraints::dim(self.inner)
    }
    fn len(&self) -> usize {
        self.inner.len()
    }
    fn value(&self, at: Configuration<'_>, out: &mut [f64]) {
        self.inner.value(at, out);
    }
    fn jacobian(&self, t: f64, q: &[f64], out: &mut dyn Entries) {
        self.inner.jacobian(t, q, out);
    }
    fn second_derivative(&self, t: f64, q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        self.inner.second_derivative(t, q, v, w, out);
    }
    fn weighted_hessian(
        &self,
        t: f64,
        q: &[f64],
        weights: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        if self.defect != Defect::NoCurvature {
            self.inner.weighted_hessian(t, q, weights, scale, out);
        }
    }
}

/// `dJ/dw` by a sweep with a defect, relative to the largest entry of what it should be.
fn error(subject: Subject, defect: Defect) -> f64 {
    let (mut run, controls, objective) =
        run(subject, SchemeKind::Nodal, Composition::Identity, STEPS);
    let start = run.state().clone();
    let task = Task {
        steps: STEPS,
        objective: &objective,
        controls: &controls,
        design: None,
        by_step: false,
        checkpoints: Checkpoints::All,
    };
    let expected = Gradient::of(&mut run, &task).unwrap().controls.concat();
    run.place_at(&start);
    let mut taken = Vec::new();
    for step in 0..STEPS {
        controls.set(step);
        let p = run.state().p.clone();
        run.step().unwrap();
        taken.push((p, run.interval().clone()));
    }
    let system = &Faulty { inner: run.system(), defect };
    let constraints = &Faulty { inner: run.constraints(), defect };
    let (n, m) = (start.q.len(), constraints.len());
    let mut sweep = StepLinearization::new(n, m, run.rows());
    let mut costate = Costate::zero(n, 0);
    objective.add_of_end(run.state(), &mut costate);
    let mut found = vec![Vec::new(); STEPS];
    for (step, (p, s)) in taken.iter().enumerate().rev() {
        controls.set(step);
        let mut of_step = StepGradient::zero(n, controls.count());
        objective.add_of_step(s, controls.at(step), &mut of_step);
        costate.q.iter_mut().zip(&of_step.end).for_each(|(a, by)| *a += by);
        sweep.linearize(system, constraints, s, p).unwrap();
        sweep.pull(system, constraints, s, &mut costate).unwrap();
        costate.q.iter_mut().zip(&of_step.start).for_each(|(a, by)| *a += by);
        let costates = sweep.costates();
        let share = if defect == Defect::WholeImpulse { 2.0 } else { 1.0 };
        found[step] = controls
            .forces()
            .iter()
            .zip(&of_step.controls)
            .map(|(force, own)| {
                let [first, second] = Slot::BOTH.map(|of| match of {
                    Slot::First => share * force.along(s, of, costates.step),
                    Slot::Second => share * force.along(s, of, costates.momentum),
                });
                own + second - first
            })
            .collect();
    }
    let off: Vec<f64> = found.concat().iter().zip(&expected).map(|(a, b)| a - b).collect();
    norm_inf(&off) / norm_inf(&expected)
}

#[test]
fn a_sweep_with_a_defect_is_found() {
    let subjects: [fn() -> Subject; 3] = [pendulum, spatial, four_bar];
    let defects = [
        Defect::NoCurvature,
        Defect::NoSlopeOfLaterForce,
        Defect::NotTransposed,
        Defect::WholeImpulse,
    ];
    for subject in subjects {
        let name = subject().name;
        let right = error(subject(), Defect::None);
        println!("{name}: without a defect off by {right:.1e}");
        assert!(right < 1e-12, "{name}: {right:e}");
        for defect in defects {
            let wrong = error(subject(), defect);
            println!("{name}: {defect:?} off by {wrong:.1e}");
            assert!(wrong > 1e-5, "{name}: {defect:?} is not found: {wrong:e}");
        }
    }
}
