//! Squares and values under conditions: minima by hand, with their prices.

use nalgebra::DMatrix;
use vi_control::constrained_least_squares::{
    Conditions, ConstrainedOptimum, DesignOutcome, minimise,
};
use vi_control::least_squares::{Parameter, Refused, Residuals};

type Row = (fn(&[f64]) -> f64, fn(&[f64]) -> Vec<f64>);

struct Rows(Vec<Row>);

impl Residuals for Rows {
    fn len(&self) -> usize {
        self.0.len()
    }
    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        for (i, (value, slope)) in self.0.iter().enumerate() {
            out[i] = value(theta);
            if let Some(jacobian) = jacobian.as_deref_mut() {
                slope(theta).into_iter().enumerate().for_each(|(j, x)| jacobian[(i, j)] = x);
            }
        }
        Ok(())
    }
}

fn parameters(starts: &[f64], bounds: [f64; 2]) -> Vec<Parameter> {
    let own = |(k, start): (usize, &f64)| {
        let own = Parameter::new(&format!("p{k}"), *start);
        Parameter { bounds, ..own }
    };
    starts.iter().enumerate().map(own).collect()
}

fn solve(rows: Vec<Row>, bounds: Vec<[f64; 2]>, own: &[Parameter]) -> ConstrainedOptimum {
    with_values(rows, &[], bounds, own)
}

fn with_values(
    rows: Vec<Row>,
    values: &[f64],
    bounds: Vec<[f64; 2]>,
    own: &[Parameter],
) -> ConstrainedOptimum {
    let conditions = Conditions { values: values.to_vec(), bounds, paths: Vec::new() };
    minimise(&mut Rows(rows), &conditions, own, 300, &mut |_| true).unwrap()
}

const WIDE: [f64; 2] = [-10.0, 10.0];
const X: Row = (|p| p[0] - 2.0, |_| vec![1.0, 0.0]);
const Y: Row = (|p| 3.0 * (p[1] - 1.0), |_| vec![0.0, 3.0]);
const CIRCLE: Row = (|p| p[0] * p[0] + p[1] * p[1], |p| vec![2.0 * p[0], 2.0 * p[1]]);

/// The nearest point of a circle in a scaled distance: the multiplier is `−dJ/du`.
#[test]
fn an_equation_is_met_and_has_its_price() {
    let at = |u: f64| solve(vec![X, Y, CIRCLE], vec![[u; 2]], &parameters(&[1.0, 1.0], WIDE));
    let found = at(1.0);
    assert_eq!(found.outcome, DesignOutcome::Optimal);
    let ([x, y], l) = ([found.parameters[0], found.parameters[1]], found.multipliers[0]);
    assert!((x * x + y * y - 1.0).abs() < 1e-10);
    assert!((x - 2.0 + 2.0 * l * x).abs() < 1e-8 && (9.0 * (y - 1.0) + 2.0 * l * y).abs() < 1e-8);
    let [more, less] = [1.0 + 1e-4, 1.0 - 1e-4].map(|u| at(u).cost);
    let slope = (more - less) / 2e-4;
    assert!((slope + l).abs() < 1e-6, "{slope} {l}");
}

/// Bounds that are not active change nothing; active ones hold with a multiplier of their sign.
#[test]
fn inequalities_act_where_they_are_active() {
    let own = parameters(&[0.5, 0.1], WIDE);
    let free = solve(vec![X, Y, CIRCLE], vec![[f64::NEG_INFINITY, 9.0]], &own);
    assert_eq!(free.outcome, DesignOutcome::Optimal);
    assert!((free.parameters[0] - 2.0).abs() < 1e-9 && free.multipliers[0] == 0.0);
    let upper = solve(vec![X, Y, CIRCLE], vec![[f64::NEG_INFINITY, 1.0]], &own);
    assert!(upper.multipliers[0] > 0.1 && (upper.conditions[0] - 1.0).abs() < 1e-10);
    let lower = solve(vec![X, Y, CIRCLE], vec![[9.0, f64::INFINITY]], &own);
    assert!(lower.multipliers[0] < -0.1 && (lower.conditions[0] - 9.0).abs() < 1e-9);
    let narrow = parameters(&[0.5, 0.1], [0.0, 0.7]);
    let cut = solve(vec![X, Y, CIRCLE], vec![[f64::NEG_INFINITY, 9.0]], &narrow);
    assert_eq!(cut.at_bounds, [0, 1]);
    assert!((cut.cost - 0.5 * (1.69 + 0.81)).abs() < 1e-9);
}

/// Conditions alone are solved as equations; those that nothing meets are infeasible.
#[test]
fn conditions_alone_are_equations() {
    let cubic: Row = (|p| p[0].powi(3), |p| vec![3.0 * p[0] * p[0]]);
    let found = solve(vec![cubic], vec![[0.2; 2]], &parameters(&[1.0], WIDE));
    assert_eq!(found.outcome, DesignOutcome::Optimal);
    assert!((found.parameters[0] - 0.2_f64.cbrt()).abs() < 1e-10);
    let never = solve(vec![cubic], vec![[2000.0; 2]], &parameters(&[1.0], WIDE));
    assert_eq!(never.outcome, DesignOutcome::Infeasible);
    let both = vec![[1.0; 2], [4.0; 2]];
    let torn = solve(vec![X, Y, CIRCLE, CIRCLE], both, &parameters(&[1.0, 1.0], WIDE));
    assert_eq!(torn.outcome, DesignOutcome::Infeasible);
    let seen = &mut 0;
    let mut watch = |_: &_| {
        *seen += 1;
        *seen < 3
    };
    let bounds = Conditions { bounds: vec![[0.2; 2]], ..Conditions::default() };
    let stopped =
        minimise(&mut Rows(vec![cubic]), &bounds, &parameters(&[9.0], WIDE), 300, &mut watch);
    assert_eq!(stopped.unwrap().outcome, DesignOutcome::Stopped);
}

/// A bound along a path of fifty places: the place of the extreme alone has a multiplier, whatever
/// its neighbours miss on the way; another start ends at the same point.
#[test]
fn a_path_touches_its_bound_at_an_extreme() {
    struct Path;
    impl Residuals for Path {
        fn len(&self) -> usize {
            51
        }
        fn evaluate(
            &mut self,
            theta: &[f64],
            out: &mut [f64],
            jacobian: Option<&mut DMatrix<f64>>,
        ) -> Result<(), Refused> {
            out[0] = theta[0] - 2.0;
            for i in 1..51 {
                out[i] = theta[0] * (0.1 * (i as f64 - 20.3)).cos();
            }
            if let Some(jacobian) = jacobian {
                jacobian[(0, 0)] = 1.0;
                (1..51).for_each(|i| jacobian[(i, 0)] = (0.1 * (i as f64 - 20.3)).cos());
            }
            Ok(())
        }
    }
    let bounds = vec![[f64::NEG_INFINITY, 0.8]; 50];
    let conditions =
        Conditions { values: Vec::new(), bounds, paths: std::iter::once(0..50).collect() };
    for start in [0.3, 1.0, 5.0] {
        let own = parameters(&[start], WIDE);
        let found = minimise(&mut Path, &conditions, &own, 300, &mut |_| true).unwrap();
        assert_eq!(found.outcome, DesignOutcome::Optimal);
        let largest = (0.03_f64).cos();
        assert!((found.parameters[0] - 0.8 / largest).abs() < 1e-9);
        let active: Vec<usize> = (0..50).filter(|&i| found.multipliers[i] != 0.0).collect();
        assert_eq!(active, [19], "from {start}");
        assert!((found.multipliers[19] * largest - (2.0 - 0.8 / largest)).abs() < 1e-6);
        assert!(found.iterations < 60, "{}", found.iterations);
    }
}

/// A curved valley as a value of weight 3, which no residual is: its minimum is found, with a slope
/// of zero.
#[test]
fn values_are_minimised_as_they_are() {
    let valley: Row = (
        |p| (1.0 - p[0]).powi(2) + 5.0 * (p[1] - p[0] * p[0]).powi(2) - 4.0,
        |p| {
            let bent = 10.0 * (p[1] - p[0] * p[0]);
            vec![-2.0 * (1.0 - p[0]) - 2.0 * bent * p[0], bent]
        },
    );
    let found = with_values(vec![valley], &[3.0], Vec::new(), &parameters(&[-1.2, 0.8], WIDE));
    println!("{found:?}");
    assert_eq!(found.outcome, DesignOutcome::Optimal);
    assert!(found.parameters.iter().all(|x| (x - 1.0).abs() < 1e-6));
    assert!((found.cost + 12.0).abs() < 1e-12 && found.iterations < 60);
    // a slope alone leads to a bound
    let slope: Row = (|p| p[0] - 2.0 * p[1], |_| vec![1.0, -2.0]);
    let cut = with_values(vec![slope], &[1.0], Vec::new(), &parameters(&[0.5, 0.1], [-3.0, 7.0]));
    assert_eq!((cut.outcome, &cut.at_bounds[..]), (DesignOutcome::Optimal, &[0, 1][..]));
    assert_eq!(cut.parameters, [-3.0, 7.0]);
}

/// A square, a value and an equation: `∇(½ρ²) + κ ∇y + λ ∇c = 0`.
#[test]
fn values_stand_beside_squares_and_conditions() {
    let value: Row = (
        |p| (0.5 * p[0]).exp() * p[1],
        |p| {
            let e = (0.5 * p[0]).exp();
            vec![0.5 * e * p[1], e]
        },
    );
    let own = parameters(&[0.4, 0.9], WIDE);
    let found = with_values(vec![X, Y, value, CIRCLE], &[0.7], vec![[1.0; 2]], &own);
    println!("{found:?}");
    assert_eq!(found.outcome, DesignOutcome::Optimal);
    let ([x, y], l) = ([found.parameters[0], found.parameters[1]], found.multipliers[0]);
    let e = 0.7 * (0.5 * x).exp();
    assert!((x * x + y * y - 1.0).abs() < 1e-10);
    let left = [x - 2.0 + 0.5 * e * y + 2.0 * l * x, 9.0 * (y - 1.0) + e + 2.0 * l * y];
    assert!(left.iter().all(|x| x.abs() < 1e-8), "{left:?}");
    assert!(
        (found.cost - (0.5 * ((x - 2.0).powi(2) + 9.0 * (y - 1.0).powi(2)) + e * y)).abs() < 1e-12
    );
}

/// Where no step decreases the sum and the slope is not zero, the point is no minimum: derivatives
/// are not those of the values. With and without conditions, of squares and of values.
#[test]
fn what_no_step_decreases_is_no_minimum() {
    const WRONG: Row = (|p| 1.0 + p[0] * p[0], |p| vec![0.3 + 2.0 * p[0], 0.0]);
    let own = parameters(&[0.0, 0.8], WIDE);
    let stuck = |words: &str, found: ConstrainedOptimum| {
        println!("{words}: {found:?}");
        assert_ne!(found.outcome, DesignOutcome::Optimal, "{words}");
    };
    stuck("squares", solve(vec![WRONG, Y], Vec::new(), &own));
    stuck("a condition that is met", solve(vec![WRONG, Y, CIRCLE], vec![[0.0, 90.0]], &own));
    stuck("a value", with_values(vec![Y, WRONG], &[1.0], Vec::new(), &own));
    // conditions alone ask for nothing but to be met
    let alone = solve(vec![CIRCLE], vec![[0.0, 90.0]], &parameters(&[1.0, 0.8], WIDE));
    assert_eq!(alone.outcome, DesignOutcome::Optimal);
}
