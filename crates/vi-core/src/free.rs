//! Discrete Euler–Lagrange stepping of unconstrained systems, in position–momentum form.
//!
//! ```text
//! p_n + D_1 L_d(q_n, q_{n+1}) + f_d^-(q_n, q_{n+1}) = 0        solved for q_{n+1}
//! p_{n+1} = D_2 L_d(q_n, q_{n+1}) + f_d^+(q_n, q_{n+1})
//! ```
//! The discrete Legendre transforms `p_n^- = −D_1 L_d(q_n, q_{n+1})` and
//! `p_n^+ = D_2 L_d(q_{n-1}, q_n)` agree along a solution: that is the step equation.
//!
//! Source: Marsden & West 2001, part 1; LMO08 §3.

use crate::discrete_lagrangian::DiscreteLagrangian;
use crate::interval::Interval;
use crate::linear::SparseLu;
use crate::newton::{
    Block, BlockKind, Fault, Newton, NewtonError, NewtonProblem, NewtonReport, NewtonSettings,
};
use crate::sparse::SparseMatrix;
use crate::state::State;

/// Steps an unconstrained system; the unknown is `Δq ∈ R^n`.
pub struct FreeStepper<S> {
    system: S,
    newton: Newton,
    sub_steps: usize,
    dq: Vec<f64>, // n  unknown
    work: Work,
}

struct Work {
    s: Interval,           // (q_n, q_{n+1})
    p: Vec<f64>,           // n  p_n, then p_{n+1}
    tangent: SparseMatrix, // n × n  D_2 D_1 L_d
    lu: SparseLu,
    blocks: [Block; 1],
}

struct Problem<'a, S> {
    system: &'a S,
    work: &'a mut Work,
}

impl<S: DiscreteLagrangian> NewtonProblem for Problem<'_, S> {
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        work.s.dq.copy_from_slice(x);
        work.s.close_from_increment();
        self.system.forced_d1(&work.s, r);
        for (r, p) in r.iter_mut().zip(&work.p) {
            *r += p;
        }
        Ok(())
    }

    fn correction(&mut self, _x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        work.tangent.refill(|out| self.system.forced_d2_d1(&work.s, out));
        Ok(work.lu.solve(&work.tangent, dx)?)
    }
}

impl<S: DiscreteLagrangian> FreeStepper<S> {
    /// A stepper for `sub_steps` sub-steps per composition (1 without one).
    ///
    /// # Errors
    /// [`Fault::SingularTangent`] when the mass matrix has an empty row.
    pub fn new(system: S, settings: NewtonSettings, sub_steps: usize) -> Result<Self, Fault> {
        let n = system.dim();
        let mut s = Interval::new(n);
        s.h = 1.0;
        let tangent = SparseMatrix::assemble(n, n, |out| system.forced_d2_d1(&s, out));
        let lu = SparseLu::new(&tangent)?;
        let blocks = [Block { kind: BlockKind::Position, range: 0..n, floor: 1e-12 }];
        let work = Work { s, p: vec![0.0; n], tangent, lu, blocks };
        Ok(Self { system, newton: Newton::new(n, settings), sub_steps, dq: vec![0.0; n], work })
    }

    /// The system.
    pub fn system(&self) -> &S {
        &self.system
    }

    /// The last interval.
    pub fn interval(&self) -> &Interval {
        &self.work.s
    }

    /// Replaces `(t_n, q_n, p_n)` by `(t_{n+1}, q_{n+1}, p_{n+1})` for a step `h` (s).
    ///
    /// # Errors
    /// [`NewtonError`]; the state is then what it was.
    pub fn step(&mut self, h: f64, state: &mut State) -> Result<NewtonReport, NewtonError> {
        self.sub_step(0, h, state)
    }

    /// Sub-step `k` of a composition.
    ///
    /// # Errors
    /// [`NewtonError`]; the state is then what it was.
    pub fn sub_step(
        &mut self,
        k: usize,
        h: f64,
        state: &mut State,
    ) -> Result<NewtonReport, NewtonError> {
        state.history.fit(self.dq.len(), self.sub_steps, 0..0);
        self.work.s.open_at(state, h);
        self.work.p.copy_from_slice(&state.p);
        if !state.history.predict(k, h, usize::MAX, &mut self.dq) {
            self.dq.fill(0.0);
        }
        let mut problem = Problem { system: &self.system, work: &mut self.work };
        let report = self.newton.solve(&mut problem, &mut self.dq)?;
        state.history.remember(k, h, false, &self.dq);
        state.move_to_end(&self.system, &self.work.s);
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::Composition;
    use crate::discrete_lagrangian::SeparableSystem;
    use crate::force::{LinearDamping, MidpointForce};
    use crate::potential::{DualPotential, ScalarField};
    use num_dual::DualNum;

    /// Kepler's problem, `V = −1/|q|`.
    struct Kepler;
    impl ScalarField<2> for Kepler {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 2]) -> D {
            -(q[0] * q[0] + q[1] * q[1]).sqrt().recip()
        }
    }

    fn kepler() -> FreeStepper<SeparableSystem> {
        let system =
            SeparableSystem::with_diagonal_mass(&[1.0, 1.0]).potential(DualPotential(Kepler));
        FreeStepper::new(system, NewtonSettings::default(), 17).unwrap()
    }

    /// Eccentricity 0.4, perihelion at (0.6, 0), period 2π.
    fn start() -> State {
        State::new(0.0, vec![0.6, 0.0], vec![0.0, (1.4_f64 / 0.6).sqrt()])
    }

    fn run(composition: Composition, steps: u32, end: f64) -> State {
        let (mut stepper, mut state) = (kepler(), start());
        let h = end / f64::from(steps);
        for _ in 0..steps {
            for (k, gamma) in composition.gammas().iter().enumerate() {
                stepper.sub_step(k, gamma * h, &mut state).unwrap();
            }
        }
        state
    }

    #[test]
    fn kepler_orders_two_four_six() {
        let period = 2.0 * std::f64::consts::PI;
        for (composition, steps) in
            [(Composition::Identity, 400), (Composition::Suzuki5, 100), (Composition::KahanLi9, 60)]
        {
            let error = |steps| {
                let (end, exact) = (run(composition, steps, period), start());
                let dq = (end.q[0] - exact.q[0]).hypot(end.q[1] - exact.q[1]);
                let dp = (end.p[0] - exact.p[0]).hypot(end.p[1] - exact.p[1]);
                (dq, dp)
            };
            let (coarse, fine) = (error(steps), error(2 * steps));
            let (oq, op) = ((coarse.0 / fine.0).log2(), (coarse.1 / fine.1).log2());
            println!("{composition:?}: order of q {oq:.2}, of p {op:.2}");
            let nominal = f64::from(composition.order());
            assert!((oq - nominal).abs() < 0.3 && (op - nominal).abs() < 0.3, "{oq} {op}");
        }
    }

    #[test]
    fn angular_momentum_is_exact_and_time_reverses() {
        let (mut stepper, mut state) = (kepler(), start());
        let j0 = state.q[0] * state.p[1] - state.q[1] * state.p[0];
        let (mut drift, mut range) = (0.0_f64, (f64::MAX, f64::MIN));
        for _ in 0..2000 {
            stepper.step(0.05, &mut state).unwrap();
            let j = state.q[0] * state.p[1] - state.q[1] * state.p[0];
            drift = drift.max((j - j0).abs());
            let e = stepper.system().discrete_energy(stepper.interval());
            range = (range.0.min(e), range.1.max(e));
        }
        println!("angular momentum drift {drift:.1e}, discrete energy in {range:?}");
        assert!(drift < 2e-14, "{drift:e}");
        assert!(range.1 - range.0 < 0.02);
        for _ in 0..2000 {
            stepper.step(-0.05, &mut state).unwrap();
        }
        let back = (state.q[0] - 0.6).hypot(state.q[1]);
        println!("2000 steps forward and back: off by {back:.1e}");
        assert!(back < 1e-10, "{back:e}");
    }

    #[test]
    fn damping_takes_out_the_work_it_does_to_second_order() {
        // damped oscillator against the exact solution
        struct Spring;
        impl ScalarField<1> for Spring {
            fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 1]) -> D {
                q[0] * q[0] * 2.0
            }
        }
        let damping = || Box::new(MidpointForce(LinearDamping { entries: vec![(0, 0, 0.4)] }));
        let error = |steps: u32| {
            let system = SeparableSystem::with_diagonal_mass(&[1.0])
                .potential(DualPotential(Spring))
                .force(damping());
            let mut stepper = FreeStepper::new(system, NewtonSettings::default(), 1).unwrap();
            let mut state = State::new(0.0, vec![1.0], vec![0.0]);
            let h = 3.0 / f64::from(steps);
            for _ in 0..steps {
                stepper.step(h, &mut state).unwrap();
            }
            let (w, t) = ((4.0_f64 - 0.04).sqrt(), 3.0);
            let exact = (-0.2_f64 * t).exp() * ((w * t).cos() + 0.2 / w * (w * t).sin());
            (state.q[0] - exact).abs()
        };
        let order = (error(40) / error(80)).log2();
        println!("forced order {order:.2}");
        assert!((order - 2.0).abs() < 0.1, "{order}");
    }
}
