//! Parameters of mechanisms from measurements: reference cases, and derivatives of residuals.

use crate::control_case::{Case, list, number, numbers};
use crate::fits::normal;
use crate::identification_case::Unknown;
use nalgebra::DMatrix;
use vi_control::identification::{MeasuredReading, MeasuredSeries, MotionResiduals, SeriesError};
use vi_control::least_squares::{FitError, FitOutcome, LeastSquares, Residuals};

fn unknown(name: &str) -> Unknown {
    Unknown(Case::text(name))
}

#[test]
fn stored_estimates_are_met() {
    for name in ["id01_pendulum", "id02_four_bar"] {
        let case = unknown(name);
        let (results, tolerance) = (case.0["results"].clone(), case.0["tolerance"].clone());
        let parameters = case.parameters();
        let fit = case.fit(&LeastSquares::default(), &parameters).unwrap();
        assert_eq!(fit.outcome, FitOutcome::Converged);
        let off = |found: &[f64], key: &str, tolerance: f64| {
            for (found, wanted) in found.iter().zip(numbers(&results[key])) {
                let off = (found / wanted - 1.0).abs();
                println!("{name} {key}: {found} off {:.2e} of the tolerance", off / tolerance);
                assert!(off <= tolerance, "{name} {key}: {found} for {wanted}");
            }
        };
        off(&fit.parameters, "estimate", number(&tolerance["estimate_relative"]));
        let errors = fit.standard_errors().unwrap();
        off(&errors, "standard_error", number(&tolerance["standard_error_relative"]));
        let sum = fit.half_sum_of_squares - number(&results["half_sum_of_squares"]);
        assert!(sum.abs() <= number(&tolerance["half_sum_of_squares"]), "{name}: {sum:e}");
        println!("{name}: {} iterations", fit.iterations);
    }
}

/// Inertia, damping and centre of a pendulum: one combination is not seen, and its direction is.
#[test]
fn a_combination_that_is_not_seen_is_named() {
    let case = unknown("id04_not_identifiable");
    let results = case.0["results"].clone();
    let mut parameters = case.parameters();
    for (own, at) in parameters.iter_mut().zip(numbers(&results["at"])) {
        (own.start, own.scale) = (at, at);
    }
    let fit = case.fit(&LeastSquares { max_iterations: 0 }, &parameters).unwrap();
    assert_eq!(fit.unseen.len(), 1);
    let wanted = numbers(&results["null_direction_relative"]);
    let sign = (fit.unseen[0].direction[0] * wanted[0]).signum();
    for (found, wanted) in fit.unseen[0].direction.iter().zip(wanted) {
        println!("{found} for {}", sign * wanted);
        assert!((found - sign * wanted).abs() < 1e-4);
    }
    // those of the case are of residuals in rad
    let stored = numbers(&results["singular_values_relative_parameters"]);
    for (found, stored) in fit.singular_values.iter().map(|s| s * 0.01).zip(&stored).take(2) {
        assert!((found / stored - 1.0).abs() < 1e-6, "{found} for {stored}");
    }
    assert!(fit.covariance.is_none());
    // within the moments that a body can have the fit converges, and says the same
    let case = unknown("id04_not_identifiable");
    let mut parameters = case.parameters();
    parameters[0].bounds = [0.0832, 0.0839];
    let fit = case.fit(&LeastSquares::default(), &parameters).unwrap();
    assert_eq!((fit.outcome, fit.unseen.len()), (FitOutcome::Converged, 1));
    // what is known beforehand of the inertia decides
    let case = unknown("id04_not_identifiable");
    parameters[0].prior = Some([0.08354166666666665, 1e-4]);
    let fit = case.fit(&LeastSquares::default(), &parameters).unwrap();
    assert_eq!(fit.outcome, FitOutcome::Converged);
    assert!(fit.unseen.is_empty() && fit.covariance.is_some());
    assert!(fit.unseen.is_empty() && fit.covariance.is_some());
    assert!(
        (fit.parameters[0] - 0.08354166666666665).abs() < 1e-9,
        "{:?} {:?} {} {:e} {:?}",
        fit.parameters,
        fit.outcome,
        fit.iterations,
        fit.gradient,
        fit.singular_values
    );
}

/// Derivatives of residuals against differences, on the tree and on the closed loop: values and
/// rates, at nodes and between them.
#[test]
fn derivatives_of_residuals_are_those_of_the_motion() {
    let readings = [
        (MeasuredReading::Value, 0.0),
        (MeasuredReading::Value, 0.3),
        (MeasuredReading::Rate, 0.0),
    ];
    let readings = readings.into_iter().chain([(MeasuredReading::Rate, 0.8)]);
    let names = ["id01_pendulum", "id02_four_bar", "id04_not_identifiable"];
    for (name, (reading, later)) in names.iter().flat_map(|n| readings.clone().map(move |r| (n, r)))
    {
        let case = unknown(name);
        let theta: Vec<f64> = case.parameters().iter().map(|own| own.start).collect();
        let mut series = case.series();
        for own in &mut series {
            own.steps.truncate(8);
            own.values.truncate(8);
            own.reading = reading;
            own.steps.iter_mut().for_each(|x| *x += later);
        }
        let mut residuals = MotionResiduals::new(case, series).unwrap();
        let count = residuals.len();
        let mut at = |theta: &[f64], jacobian: Option<&mut DMatrix<f64>>| {
            let mut out = vec![0.0; count];
            residuals.evaluate(theta, &mut out, jacobian).unwrap();
            out
        };
        let mut jacobian = DMatrix::zeros(count, theta.len());
        at(&theta, Some(&mut jacobian));
        for k in 0..theta.len() {
            let e = 1e-5 * theta[k];
            let mut moved = |by: f64| {
                let mut theta = theta.clone();
                theta[k] += by;
                at(&theta, None)
            };
            let (plus, minus) = (moved(e), moved(-e));
            for i in 0..count {
                let wanted = (plus[i] - minus[i]) / (2.0 * e);
                let exact = jacobian[(i, k)];
                let off = (wanted - exact).abs() / (1.0 + jacobian.column(k).amax());
                let of = format!("{name} {reading:?} {later}: residual {i} by {k}");
                assert!(off < 1e-6, "{of}: {exact} for {wanted}");
            }
        }
    }
}

/// Of so many fits of the pendulum to its own motion with normal noise: stated over observed
/// standard errors, and how often intervals of 95 % cover the truth.
fn coverage(count: usize) -> [[f64; 2]; 2] {
    let truth: Vec<f64> = list(&unknown("id01_pendulum").0, "parameters")
        .iter()
        .map(|own| number(&own["value"]))
        .collect();
    let mut exact = unknown("id01_pendulum").series();
    exact.iter_mut().for_each(|own| own.values.fill(0.0));
    let mut motion = MotionResiduals::new(unknown("id01_pendulum"), exact.clone()).unwrap();
    let mut y = vec![0.0; motion.len()];
    motion.evaluate(&truth, &mut y, None).unwrap(); // in standard deviations
    let mut draw = normal(41);
    let ([mut square, mut stated, mut covered], n) = ([[0.0; 2]; 3], count as f64);
    for _ in 0..count {
        let case = unknown("id01_pendulum");
        let parameters = case.parameters();
        let (mut series, mut y) = (exact.clone(), y.iter());
        for own in &mut series {
            own.values.fill_with(|| own.sigma * (y.next().unwrap() + draw()));
        }
        let mut residuals = MotionResiduals::new(case, series).unwrap();
        let fit = LeastSquares::default().fit(&mut residuals, &parameters).unwrap();
        assert_eq!(fit.outcome, FitOutcome::Converged);
        let errors = fit.standard_errors().unwrap();
        for j in 0..2 {
            let off = fit.parameters[j] - truth[j];
            square[j] += off * off / n;
            stated[j] += errors[j] / n;
            covered[j] += f64::from(off.abs() <= 1.959_964 * errors[j]) / n;
        }
    }
    [[0, 1].map(|j| stated[j] / f64::sqrt(square[j])), covered]
}

/// Of 120 sets a standard deviation is known to 6.5 %, a coverage to 2 %.
#[test]
fn intervals_of_a_mechanism_cover_as_often_as_they_say() {
    let [ratio, covered] = coverage(120);
    println!("stated over observed {ratio:.3?}, covered {covered:.3?}");
    assert!(ratio.iter().all(|own| (own - 1.0).abs() < 0.2), "{ratio:?}");
    assert!(covered.iter().all(|own| (0.89..=0.995).contains(own)), "{covered:?}");
}

/// 1000 sets: standard errors right within 5 %, intervals cover 93 to 97 %. Of so many a standard
/// deviation is known to 2.2 %, a coverage to 0.7 %.
#[test]
#[ignore = "minutes: by --ignored"]
fn intervals_of_a_mechanism_cover_in_a_thousand_sets() {
    let [ratio, covered] = coverage(1000);
    println!("stated over observed {ratio:.3?}, covered {covered:.3?}");
    assert!(ratio.iter().all(|own| (own - 1.0).abs() < 0.05), "{ratio:?}");
    assert!(covered.iter().all(|own| (0.93..=0.97).contains(own)), "{covered:?}");
}

#[test]
fn bad_series_are_refused() {
    let refused = |change: &dyn Fn(&mut MeasuredSeries)| {
        let case = unknown("id01_pendulum");
        let mut series = case.series();
        change(&mut series[0]);
        MotionResiduals::new(case, series).unwrap_err()
    };
    assert_eq!(refused(&|own| own.sigma = 0.0), SeriesError::Deviation(0));
    assert_eq!(refused(&|own| own.steps.swap(0, 1)), SeriesError::Order(0));
    assert_eq!(refused(&|own| own.values.truncate(3)), SeriesError::Shape(0));
    let odd = SeriesError::NotANumber { series: 0, value: 4 };
    assert_eq!(refused(&|own| own.values[4] = f64::NAN), odd);
    // a start that is no mechanism: a four-bar that does not close
    let case = unknown("id02_four_bar");
    let mut parameters = case.parameters();
    parameters[3].start = 5.0;
    assert!(matches!(case.fit(&LeastSquares::default(), &parameters), Err(FitError::Start(_))));
    assert!(list(&Case::text("id02_four_bar"), "measurements").len() == 2);
}

/// Values between nodes, and rates, of a pendulum against the same motion with a tenth of the step:
/// of third order and better, at nodes the values themselves.
#[test]
fn values_between_nodes_and_rates_are_those_of_the_motion() {
    let read = |refined: usize, reading: MeasuredReading, later: f64| {
        let mut value = Case::text("id01_pendulum");
        let (h, steps) = (number(&value["h"]), value["steps"].as_u64().unwrap());
        let controls = list(&value, "controls").to_vec();
        let finer: Vec<_> = controls.into_iter().flat_map(|row| vec![row; refined]).collect();
        value["h"] = (h / refined as f64).into();
        value["steps"] = (steps * refined as u64).into();
        value["controls"] = finer.into();
        let case = Unknown(value);
        let theta: Vec<f64> = case.parameters().iter().map(|own| own.start).collect();
        let mut series = case.series();
        let own = &mut series[0];
        own.reading = reading;
        own.sigma = 1.0;
        own.steps.iter_mut().for_each(|x| *x = (*x + later) * refined as f64);
        own.values.fill(0.0);
        own.steps.pop();
        own.values.pop();
        series.truncate(1);
        let mut residuals = MotionResiduals::new(case, series).unwrap();
        let mut out = vec![0.0; residuals.len()];
        residuals.evaluate(&theta, &mut out, None).unwrap();
        out
    };
    // what is between nodes is no further from the motion than nodes are
    for reading in [MeasuredReading::Value, MeasuredReading::Rate] {
        let fine = |later| read(32, reading, later);
        let off = |refined: usize, later: f64| {
            let own = read(refined, reading, later);
            let apart = own.iter().zip(fine(later)).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max)
        };
        for later in [0.25, 0.5, 0.875] {
            let (coarse, half, nodes) = (off(1, later), off(2, later), off(1, 0.0));
            println!("{reading:?} {later}: {coarse:.2e} {half:.2e}, at nodes {nodes:.2e}");
            assert!(coarse < 1.5 * nodes, "{reading:?} {later}: {coarse:e}");
            assert!(coarse / half > 3.0, "{reading:?} {later}: {coarse:e} {half:e}");
        }
    }
}
