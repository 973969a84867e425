//! Least squares: known minima, bounds, priors, combinations that are not seen, and intervals that
//! cover as often as they say.

use nalgebra::DMatrix;
use vi_control::least_squares::{
    FitError, FitOutcome, LeastSquares, Parameter, Refused, Residuals, probability_of_runs,
};
use vi_testkit::Sample;

/// Residuals by a function that also writes the derivatives.
struct Function<F>(usize, F);

impl<F> Residuals for Function<F>
where
    F: FnMut(&[f64], &mut [f64], Option<&mut DMatrix<f64>>) -> Result<(), Refused>,
{
    fn len(&self) -> usize {
        self.0
    }
    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        (self.1)(theta, out, jacobian)
    }
}

/// `a e^{−bt} cos(ωt)` at 60 times against data with a deviation: the swing of a damped pendulum.
struct Swing {
    data: Vec<f64>,
    sigma: f64,
}

const TRUTH: [f64; 3] = [0.4, 0.25, 3.1];

fn time(i: usize) -> f64 {
    0.1 * (i + 1) as f64
}

impl Swing {
    fn exact(sigma: f64) -> Self {
        let value = |i: usize| TRUTH[0] * (-TRUTH[1] * time(i)).exp() * (TRUTH[2] * time(i)).cos();
        Self { data: (0..60).map(value).collect(), sigma }
    }

    fn noisy(sigma: f64, normal: &mut impl FnMut() -> f64) -> Self {
        let mut swing = Self::exact(sigma);
        swing.data.iter_mut().for_each(|y| *y += sigma * normal());
        swing
    }
}

impl Residuals for Swing {
    fn len(&self) -> usize {
        self.data.len()
    }
    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        let [a, b, omega] = [theta[0], theta[1], theta[2]];
        if b < -50.0 {
            return Err(Refused("it grows beyond all bounds".into()));
        }
        let parts = |i: usize| {
            let t = time(i);
            ((-b * t).exp() / self.sigma, (omega * t).cos(), (omega * t).sin(), t)
        };
        for (i, out) in out.iter_mut().enumerate() {
            let (decay, cos, _, _) = parts(i);
            *out = a * decay * cos - self.data[i] / self.sigma;
        }
        if let Some(jacobian) = jacobian {
            for i in 0..self.data.len() {
                let (decay, cos, sin, t) = parts(i);
                jacobian[(i, 0)] = decay * cos;
                jacobian[(i, 1)] = -a * t * decay * cos;
                jacobian[(i, 2)] = -a * t * decay * sin;
            }
        }
        Ok(())
    }
}

fn unknowns() -> Vec<Parameter> {
    let start = [("amplitude", 0.3), ("damping", 0.1), ("frequency", 3.3)];
    start.iter().map(|(name, start)| Parameter::new(name, *start)).collect()
}

/// Two normal numbers of two uniform ones, Box and Muller; these from sums of a generator.
pub(crate) fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut sample = Sample::new(seed);
    move || {
        let [u, v] = [0, 1].map(|_| 0.5 * (sample.number() + 1.0));
        let u = u.clamp(1e-12, 1.0);
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

#[test]
fn exact_data_are_met_to_round_off() {
    let fit = LeastSquares::default().fit(&mut Swing::exact(0.01), &unknowns()).unwrap();
    assert_eq!(fit.outcome, FitOutcome::Converged);
    for (found, truth) in fit.parameters.iter().zip(TRUTH) {
        assert!((found - truth).abs() < 1e-13, "{found} for {truth}");
    }
    assert!(fit.unseen.is_empty() && fit.at_bounds.is_empty());
    // units change nothing: the same data in parts of their deviation
    let small = LeastSquares::default().fit(&mut Swing::exact(1e-7), &unknowns()).unwrap();
    assert!(small.parameters.iter().zip(TRUTH).all(|(a, b)| (a - b).abs() < 1e-13));
}

/// Rosenbrock's valley, from its far end, free and with a bound that cuts the minimum off.
#[test]
fn bounds_hold_and_the_rest_is_fitted() {
    let rosenbrock = |theta: &[f64], out: &mut [f64], jacobian: Option<&mut DMatrix<f64>>| {
        let (x, y) = (theta[0], theta[1]);
        out.copy_from_slice(&[10.0 * (y - x * x), 1.0 - x]);
        if let Some(jacobian) = jacobian {
            jacobian.copy_from(&nalgebra::dmatrix![-20.0 * x, 10.0; -1.0, 0.0]);
        }
        Ok(())
    };
    let mut parameters = [Parameter::new("x", -1.2), Parameter::new("y", 1.0)];
    let free = LeastSquares::default().fit(&mut Function(2, rosenbrock), &parameters).unwrap();
    assert_eq!(free.outcome, FitOutcome::Converged);
    assert!(free.parameters.iter().all(|p| (p - 1.0).abs() < 1e-12), "{free:?}");
    // with y ≤ 0.5 the minimum solves 200 x³ − 99 x − 1 = 0 near 0.71: y at its bound
    parameters[1].bounds = [-2.0, 0.5];
    parameters[1].start = 0.4;
    let bound = LeastSquares::default().fit(&mut Function(2, rosenbrock), &parameters).unwrap();
    let x = bound.parameters[0];
    assert_eq!((bound.outcome, &bound.at_bounds[..]), (FitOutcome::Converged, &[1][..]));
    assert_eq!(bound.parameters[1].to_bits(), 0.5_f64.to_bits());
    assert!((200.0 * x * x * x - 99.0 * x - 1.0).abs() < 1e-9, "x = {x}");
    // what is at a bound has no deviation
    assert_eq!(bound.standard_errors().unwrap()[1].to_bits(), 0.0_f64.to_bits());
}

/// Only the product of two parameters is seen: the direction is named, a prior decides.
#[test]
fn what_the_data_do_not_see_is_named() {
    let product = |theta: &[f64], out: &mut [f64], jacobian: Option<&mut DMatrix<f64>>| {
        let (a, b, c) = (theta[0], theta[1], theta[2]);
        for (i, out) in out.iter_mut().enumerate() {
            *out = a * b * time(i) + c - (6.0 * time(i) + 1.0);
        }
        if let Some(jacobian) = jacobian {
            for i in 0..20 {
                let t = time(i);
                jacobian.row_mut(i).copy_from_slice(&[b * t, a * t, 1.0]);
            }
        }
        Ok(())
    };
    let mut parameters =
        [Parameter::new("a", 1.0), Parameter::new("b", 4.0), Parameter::new("c", 2.0)];
    let fit = LeastSquares::default().fit(&mut Function(20, product), &parameters).unwrap();
    let direction = &fit.unseen[0].direction;
    assert_eq!(fit.unseen.len(), 1);
    // a + δ, b − δ b/a leave the product: δa/s_a : δb/s_b = a/s_a : −b/s_b
    let ratio = (fit.parameters[0] / 1.0) / (fit.parameters[1] / 4.0);
    assert!((direction[0] / direction[1] + ratio).abs() < 1e-9, "{direction:?}");
    assert!(direction[2].abs() < 1e-9 && fit.covariance.is_none());
    assert!((fit.parameters[0] * fit.parameters[1] - 6.0).abs() < 1e-10);
    parameters[0].prior = Some([2.0, 0.1]);
    let fit = LeastSquares::default().fit(&mut Function(20, product), &parameters).unwrap();
    assert!(fit.unseen.is_empty());
    assert!((fit.parameters[0] - 2.0).abs() < 1e-9 && (fit.parameters[1] - 3.0).abs() < 1e-9);
    let errors = fit.standard_errors().unwrap();
    assert!((errors[0] - 0.1).abs() < 1e-9, "the prior alone: {errors:?}");
}

#[test]
fn bad_inputs_are_refused_by_name() {
    let fit = |change: &dyn Fn(&mut Vec<Parameter>)| {
        let mut parameters = unknowns();
        change(&mut parameters);
        LeastSquares::default().fit(&mut Swing::exact(0.01), &parameters)
    };
    let odd = |name: &str| FitError::Parameter(name.to_owned());
    assert_eq!(fit(&|p| p[1].bounds = [0.2, 0.9]).unwrap_err(), odd("damping"));
    assert_eq!(fit(&|p| p[0].start = f64::NAN).unwrap_err(), odd("amplitude"));
    assert_eq!(fit(&|p| p[2].prior = Some([1.0, 0.0])).unwrap_err(), odd("frequency"));
    assert_eq!(fit(&|p| p[2].scale = 0.0).unwrap_err(), odd("frequency"));
    let few = FitError::TooFew { residuals: 60, parameters: 0 };
    assert_eq!(fit(&|p| p.clear()).unwrap_err(), few);
    let refused = fit(&|p| p[1].start = -60.0).unwrap_err();
    assert_eq!(refused, FitError::Start(Refused("it grows beyond all bounds".into())));
    // amplitude zero: nothing depends on the rest
    assert_eq!(fit(&|p| p[0].start = 0.0).unwrap_err(), FitError::Idle("damping".into()));
}

/// A minimum beyond a wall where there are no residuals: stuck, not converged.
#[test]
fn a_wall_is_no_minimum() {
    let wall = |theta: &[f64], out: &mut [f64], jacobian: Option<&mut DMatrix<f64>>| {
        if theta[0] > 2.0 {
            return Err(Refused("there is no such body".into()));
        }
        out.copy_from_slice(&[theta[0] - 3.0, 1.0]);
        if let Some(jacobian) = jacobian {
            jacobian.copy_from(&nalgebra::dmatrix![1.0; 0.0]);
        }
        Ok(())
    };
    let parameter = Parameter::new("x", 1.0);
    let fit = LeastSquares::default()
        .fit(&mut Function(2, wall), std::slice::from_ref(&parameter))
        .unwrap();
    assert_eq!(fit.outcome, FitOutcome::Stuck, "{fit:?}");
    let bounded = Parameter { bounds: [0.0, 1.9], ..parameter };
    let fit = LeastSquares::default().fit(&mut Function(2, wall), &[bounded]).unwrap();
    assert_eq!((fit.outcome, &fit.at_bounds[..]), (FitOutcome::Converged, &[0][..]));
}

/// Standard errors and intervals of simulated data sets, `count` of them.
fn coverage(count: usize) -> ([f64; 3], [f64; 3], f64) {
    let (mut square, mut stated, mut covered) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let (mut draw, mut chi) = (normal(42), 0.0);
    for _ in 0..count {
        let mut swing = Swing::noisy(0.02, &mut draw);
        let fit = LeastSquares::default().fit(&mut swing, &unknowns()).unwrap();
        assert_eq!(fit.outcome, FitOutcome::Converged);
        let errors = fit.standard_errors().unwrap();
        for j in 0..3 {
            let off = fit.parameters[j] - TRUTH[j];
            square[j] += off * off / count as f64;
            stated[j] += errors[j] / count as f64;
            covered[j] += f64::from(off.abs() <= 1.959_964 * errors[j]) / count as f64;
        }
        chi += fit.chi_square_per_freedom / count as f64;
    }
    let ratio = std::array::from_fn(|j| stated[j] / f64::sqrt(square[j]));
    (ratio, covered, chi)
}

/// 10 000 data sets, seeded: standard errors within 5 %, 95 % intervals cover 93 to 97 %. Of so
/// many a standard deviation is known to 0.7 %.
#[test]
fn intervals_cover_as_often_as_they_say() {
    let (ratio, covered, chi) = coverage(10_000);
    println!("stated over observed {ratio:.3?}, covered {covered:.3?}, χ² {chi:.4}");
    for j in 0..3 {
        assert!((ratio[j] - 1.0).abs() < 0.05, "standard error {j}: {}", ratio[j]);
        assert!((0.93..=0.97).contains(&covered[j]), "interval {j}: {}", covered[j]);
    }
    assert!((chi - 1.0).abs() < 0.02);
}

#[test]
fn runs_of_signs_tell_of_what_a_model_misses() {
    let mut draw = normal(3);
    let noise: Vec<f64> = (0..200).map(|_| draw()).collect();
    assert!(probability_of_runs(&noise).unwrap() > 0.05);
    let wave: Vec<f64> = (0..200).map(|i| (0.2 * i as f64 + 0.1).sin() + 0.3 * draw()).collect();
    assert!(probability_of_runs(&wave).unwrap() < 1e-4);
    // ten of each sign that alternate: 20 runs of a mean of 11, variance 90/19
    let alternate: Vec<f64> = (0..20).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let wanted = libm::erfc(9.0 / (2.0 * 90.0 / 19.0_f64).sqrt());
    assert!((probability_of_runs(&alternate).unwrap() - wanted).abs() < 1e-15);
    assert_eq!(probability_of_runs(&[1.0; 40]), None);
}
