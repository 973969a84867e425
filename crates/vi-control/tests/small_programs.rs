//! Small programs with known optima; a method that returns its guess is seen through.

use std::cell::RefCell;
use std::rc::Rc;
use vi_control::kkt::{Kkt, Tolerances};
use vi_control::program::{
    Bounds, MethodStart, MethodWatch, Multipliers, NlpSolver, Outcome, Program, SharedProgram,
    Solved, SolverError, Undefined, check_start,
};

/// `min (x − a)² + (y − b)²` on `x² + y² = 1` within bounds of `x`.
struct Circle {
    target: [f64; 2],
    bounds: [f64; 2],
    radius: f64,
    at: [f64; 2],
}

impl Circle {
    fn shared(target: [f64; 2], bounds: [f64; 2], radius: f64) -> SharedProgram {
        Rc::new(RefCell::new(Self { target, bounds, radius, at: [f64::NAN; 2] }))
    }
}

impl Program for Circle {
    fn variables(&self) -> usize {
        2
    }
    fn rows(&self) -> usize {
        1
    }
    fn bounds(&self) -> Bounds {
        let none = [f64::NEG_INFINITY, f64::INFINITY];
        Bounds { variables: vec![self.bounds, none], rows: vec![[self.radius * self.radius; 2]] }
    }
    fn jacobian_places(&self) -> &[(usize, usize)] {
        &[(0, 0), (0, 1)]
    }
    fn hessian_places(&self) -> &[(usize, usize)] {
        &[(0, 0), (1, 1), (1, 1)] // one entry in two parts
    }
    fn move_to(&mut self, x: &[f64]) -> Result<(), Undefined> {
        self.at = [x[0], x[1]];
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Undefined) }
    }
    fn cost(&self) -> f64 {
        (0..2).map(|i| (self.at[i] - self.target[i]).powi(2)).sum()
    }
    fn cost_gradient(&self, out: &mut [f64]) {
        (0..2).for_each(|i| out[i] = 2.0 * (self.at[i] - self.target[i]));
    }
    fn row_values(&self, out: &mut [f64]) {
        out[0] = self.at[0] * self.at[0] + self.at[1] * self.at[1];
    }
    fn jacobian(&self, out: &mut [f64]) {
        (0..2).for_each(|i| out[i] = 2.0 * self.at[i]);
    }
    fn hessian(&self, factor: f64, lambda: &[f64], out: &mut [f64]) {
        out.copy_from_slice(&[2.0 * factor + 2.0 * lambda[0], 2.0 * factor, 2.0 * lambda[0]]);
    }
}

/// A method that calls its guess an optimum.
struct Guesses;

impl NlpSolver for Guesses {
    fn solve(
        &mut self,
        program: &SharedProgram,
        start: &MethodStart,
        _watch: MethodWatch,
    ) -> Result<Solved, SolverError> {
        check_start(&*program.borrow(), start)?;
        let zero = vec![0.0; start.x.len()];
        let rows = vec![0.0; program.borrow().rows()];
        let multipliers = Multipliers { rows, lower: zero.clone(), upper: zero };
        let (x, iterates) = (start.x.clone(), Vec::new());
        Ok(Solved { outcome: Outcome::Optimal, x, multipliers, iterates })
    }
}

fn start(x: [f64; 2]) -> MethodStart {
    MethodStart { x: x.to_vec(), ..MethodStart::default() }
}

fn judged(program: &SharedProgram, solved: &Solved) -> Kkt {
    Kkt::judge(&mut *program.borrow_mut(), &solved.x, &solved.multipliers).unwrap()
}

#[test]
fn a_guess_that_is_called_an_optimum_is_seen_through() {
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    for x in [[0.3, 0.4], [0.6, 0.8], [3.0, 4.0]] {
        let program = Circle::shared([3.0, -4.0], free, 1.0);
        let solved = Guesses.solve(&program, &start(x), Box::new(|_| true)).unwrap();
        let kkt = judged(&program, &solved);
        assert!(!kkt.is_met(&Tolerances::default()), "{x:?}: {kkt:?}");
    }
    let program = Circle::shared([3.0, 4.0], free, 1.0);
    let refused = Guesses.solve(&program, &start([f64::NAN, 0.0]), Box::new(|_| true));
    assert_eq!(refused.unwrap_err(), SolverError::NotFinite(0));
    let short = MethodStart { x: vec![0.0], ..MethodStart::default() };
    let refused = Guesses.solve(&program, &short, Box::new(|_| true));
    assert_eq!(refused.unwrap_err(), SolverError::Shape { found: 1, wanted: 2 });
}

#[test]
fn conditions_are_judged_one_by_one() {
    // the optimum (0.6, 0.8): 2 (x − 3) + 2 λ x = 0 → λ = 4
    let program = Circle::shared([3.0, 4.0], [f64::NEG_INFINITY, f64::INFINITY], 1.0);
    let with = |x: [f64; 2], lambda: f64, lower: f64, upper: f64| {
        let multipliers =
            Multipliers { rows: vec![lambda], lower: vec![lower, 0.0], upper: vec![upper, 0.0] };
        Kkt::judge(&mut *program.borrow_mut(), &x, &multipliers).unwrap()
    };
    let tolerances = Tolerances::default();
    assert!(with([0.6, 0.8], 4.0, 0.0, 0.0).is_met(&tolerances));
    assert!(!with([0.6, 0.8], 4.1, 0.0, 0.0).is_met(&tolerances), "stationarity");
    assert!(!with([0.6, 0.8 + 1e-6], 4.0, 0.0, 0.0).is_met(&tolerances), "violation");
    // multipliers of bounds that cancel, and of a bound that is not there
    assert!(!with([0.6, 0.8], 4.0, 0.5, 0.5).is_met(&tolerances), "complementarity");
    assert!(!with([0.6, 0.8], f64::NAN, 0.0, 0.0).is_met(&tolerances), "NaN");
}

#[cfg(feature = "pounce")]
mod by_pounce {
    use super::*;
    use vi_control::Pounce;

    #[test]
    fn optima_are_found() {
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        // on the circle towards the target; with a bound of x active
        for (bounds, wanted) in [(free, [0.6, 0.8]), ([-1.0, 0.28], [0.28, 0.96])] {
            let program = Circle::shared([3.0, 4.0], bounds, 1.0);
            let solved =
                Pounce::default().solve(&program, &start([0.1, 0.3]), Box::new(|_| true)).unwrap();
            assert_eq!(solved.outcome, Outcome::Optimal);
            assert!((0..2).all(|i| (solved.x[i] - wanted[i]).abs() < 1e-9), "{:?}", solved.x);
            let kkt = judged(&program, &solved);
            assert!(kkt.is_met(&Tolerances::default()), "{kkt:?}");
            assert!(!solved.iterates.is_empty());
            // warm start from the optimum
            let warm = MethodStart {
                x: solved.x.clone(),
                multipliers: Some(solved.multipliers.clone()),
                near: true,
            };
            let again = Pounce::default().solve(&program, &warm, Box::new(|_| true)).unwrap();
            assert!(again.iterates.len() <= solved.iterates.len());
        }
    }

    #[test]
    fn contradictions_limits_and_stops_are_told_apart() {
        // x ≥ 2 on the unit circle
        let program = Circle::shared([3.0, 4.0], [2.0, 5.0], 1.0);
        let solved =
            Pounce::default().solve(&program, &start([2.5, 0.3]), Box::new(|_| true)).unwrap();
        assert_eq!(solved.outcome, Outcome::Infeasible);
        let kkt = judged(&program, &solved);
        assert_eq!(kkt.violated.first().map(|v| v.0), Some(0), "{kkt:?}");
        let free = [f64::NEG_INFINITY, f64::INFINITY];
        let program = Circle::shared([3.0, 4.0], free, 1.0);
        let mut few = Pounce { max_iterations: 1 };
        let solved = few.solve(&program, &start([0.1, 0.3]), Box::new(|_| true)).unwrap();
        assert_eq!(solved.outcome, Outcome::Exhausted);
        let watch = |iterate: &vi_control::program::Iterate| iterate.iteration < 2;
        let solved =
            Pounce::default().solve(&program, &start([0.1, 0.3]), Box::new(watch)).unwrap();
        assert_eq!((solved.outcome, solved.iterates.len()), (Outcome::Stopped, 3));
    }
}
