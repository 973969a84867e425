use super::*;
use crate::constraint::scalar_constraint::{ScalarConstraint, ScalarRow};
use crate::geometry::form::Form;
use vi_core::linear::dot;
use vi_rigid::rotation;
use vi_testkit::Sample;

/// A wheel, a wheel with a tyre on a turntable, a sphere on one.
fn examples() -> Vec<ScalarConstraint> {
    let plane = |spin| {
        let axes = rotation::exp(&Vector3::new(0.2, -0.1, 0.4));
        RolledPlane { origin: Vector3::new(0.3, -0.2, 0.1), axes, spin }
    };
    let axis = Vector3::new(0.6, 0.0, 0.8);
    let of = |axis, circle, section, spin| Rolling {
        frame: 0,
        axis,
        circle,
        section,
        plane: plane(spin),
    };
    vec![
        ScalarConstraint::rolling("disc", of(Some(axis), 0.3, 0.0, 0.0)),
        ScalarConstraint::rolling("tyre", of(Some(axis), 0.3, 0.1, 1.7)),
        ScalarConstraint::rolling("sphere", of(None, 0.0, 0.2, 3.0)),
        ScalarConstraint::blade(
            "blade",
            Form::vector(0, &axis),
            Form::point(0, &Vector3::new(0.2, -0.3, 0.1)),
        ),
    ]
}

/// An orientation in which the axes of the examples are not flat.
fn frame(sample: &mut Sample) -> Vec<f64> {
    let mut q = vec![0.0; FRAME];
    let small = 0.4 * sample.vector();
    let triad = rotation::exp(&(Vector3::new(0.9, 0.3, 0.0) + small));
    directors::set_frame(&mut q, &sample.vector(), &triad);
    q
}

/// `q` displaced by a twist.
fn moved(q: &[f64], twist: &[f64; 6], by: f64) -> Vec<f64> {
    let mut out = q.to_vec();
    let turn = rotation::exp(&(by * Vector3::new(twist[3], twist[4], twist[5])));
    let center = directors::center(q) + by * Vector3::new(twist[0], twist[1], twist[2]);
    directors::set_frame(&mut out, &center, &(turn * directors::triad(q)));
    out
}

fn along(twist: &[f64; 6], mut visit: impl FnMut(&mut WrenchVisitor<'_>)) -> f64 {
    let twist = Twist::new(
        Vector3::new(twist[0], twist[1], twist[2]),
        Vector3::new(twist[3], twist[4], twist[5]),
    );
    let mut sum = 0.0;
    visit(&mut |_, wrench| sum += twist.dot(&wrench));
    sum
}

/// A central difference of order 6.
fn derivative(f: impl Fn(f64) -> f64) -> f64 {
    let e = 2e-3;
    let pair = |k: f64| f(k * e) - f(-k * e);
    (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * e)
}

#[test]
fn derivatives_are_those_of_differences() {
    let mut sample = Sample::new(11);
    let mut off = [0.0_f64; 5];
    for constraint in examples() {
        for row in &constraint.rows {
            let start = frame(&mut sample);
            let step: [f64; 6] = sample.array();
            let end = moved(&start, &step, 0.7);
            let (twist, other): ([f64; 6], [f64; 6]) = (sample.array(), sample.array());
            let gap = |end: &[f64]| row.gap(&Interval::between(0.3, 0.05, &start, end));
            let s = Interval::between(0.3, 0.05, &start, &end);
            let exact = along(&twist, |visit| row.for_each_wrench_of_step(&s, visit));
            off[0] = off[0].max((exact - derivative(|e| gap(&moved(&end, &twist, e)))).abs());
            // wrenches are rows of the Jacobian, its derivative is that of differences
            let rates = |q: &[f64], twist: &[f64; 6]| {
                let t = |i| Vector3::new(twist[i], twist[i + 1], twist[i + 2]);
                directors::spin_velocity(q, &t(0), &t(3)).to_vec()
            };
            let rate = |q: &[f64], v: &[f64]| {
                let mut sum = 0.0;
                row.add_rate(q, v, &mut sum);
                sum
            };
            let (v, w) = (rates(&start, &twist), rates(&start, &other));
            let wrench = along(&twist, |visit| row.for_each_wrench(&start, visit));
            off[1] = off[1].max((wrench - rate(&start, &v)).abs());
            let shifted =
                |e: f64| -> Vec<f64> { start.iter().zip(&w).map(|(q, w)| q + e * w).collect() };
            let bend = derivative(|e| rate(&shifted(e), &v));
            off[2] = off[2].max((bend - row.second(&start, &w, &v)).abs());
            let mut matrix = nalgebra::DMatrix::zeros(FRAME, FRAME);
            row.emit_second(&start, 1.0, &mut matrix);
            let product = matrix.transpose() * nalgebra::DVector::from_column_slice(&v);
            off[3] = off[3].max((dot(product.as_slice(), &w) - bend).abs());
            if let ScalarRow::Velocity(velocity) = row {
                let drift = derivative(|e| velocity.rate(Configuration::new(0.0, &shifted(e))));
                let at = Configuration::new(0.0, &start);
                let mut slope = nalgebra::DMatrix::zeros(1, FRAME);
                velocity.emit_rate_slope(at, 0, 1.0, &mut slope);
                let own = (slope * nalgebra::DVector::from_column_slice(&w))[0];
                off[4] = off[4].max((drift - velocity.rate_change(at.moving(&w))).abs());
                off[4] = off[4].max((drift - own).abs());
            }
        }
    }
    println!("differences of step, Jacobian, second derivative, its matrix, drift: {off:?}");
    assert!(off.iter().all(|off| *off < 1e-9), "{off:?}");
}

/// The derivative of `h A_d` by the start is minus that of the step backwards, and `γ_q` that of
/// `γ = DA[v] v − ḃ`, both those of differences.
#[test]
fn derivatives_by_the_start_and_of_accelerations_are_those_of_differences() {
    let mut sample = Sample::new(17);
    let mut off = [0.0_f64; 2];
    for constraint in examples() {
        for row in &constraint.rows {
            let start = frame(&mut sample);
            let (step, twist): ([f64; 6], [f64; 6]) = (sample.array(), sample.array());
            let end = moved(&start, &step, 0.7);
            if row.is_of_velocities() {
                let s = Interval::between(0.3, 0.05, &start, &end);
                let mut back = Interval::new(start.len());
                back.reverse(&s);
                let exact = -along(&twist, |visit| row.for_each_wrench_of_step(&back, visit));
                let gap = |e: f64| {
                    row.gap(&Interval::between(0.3, 0.05, &moved(&start, &twist, e), &end))
                };
                off[0] = off[0].max((exact - derivative(gap)).abs());
            }
            let t = |i: usize| Vector3::new(step[i], step[i + 1], step[i + 2]);
            let v = directors::spin_velocity(&start, &t(0), &t(3)).to_vec();
            let w: Vec<f64> = (0..FRAME).map(|_| sample.number()).collect();
            let shifted =
                |e: f64| -> Vec<f64> { start.iter().zip(&w).map(|(q, w)| q + e * w).collect() };
            let terms = |e: f64| {
                let q = shifted(e);
                row.second(&q, &v, &v) + row.drift_change(Motion::new(0.0, &q, &v))
            };
            let mut slope = vec![0.0; FRAME];
            assert!(row.add_acceleration_slope(Motion::new(0.0, &start, &v), 1.0, &mut slope));
            off[1] = off[1].max((dot(&slope, &w) - derivative(terms)).abs());
        }
    }
    println!("differences by the start, of accelerations: {off:?}");
    assert!(off.iter().all(|off| *off < 1e-8), "{off:?}");
}

/// `A_d(q, q'; h) = A_d(q', q; −h)`, and `A_d = A Δq/h − b` at the midpoint to second order.
#[test]
fn the_step_is_symmetric_and_of_second_order() {
    let mut sample = Sample::new(3);
    for constraint in examples() {
        for row in constraint.rows.iter().filter(|row| row.is_of_velocities()) {
            let middle = frame(&mut sample);
            let twist: [f64; 6] = sample.array();
            let at = |h: f64| {
                let [a, b] = [-0.5, 0.5].map(|part| moved(&middle, &twist, part * h));
                let there = row.gap(&Interval::between(0.0, h, &a, &b)) / h;
                let back = row.gap(&Interval::between(h, -h, &b, &a)) / -h;
                (there, back)
            };
            let (there, back) = at(0.1);
            let own = along(&twist, |visit| row.for_each_wrench(&middle, visit));
            let exact = own + row.drift(Configuration::new(0.0, &middle));
            let errors = [0.1, 0.05].map(|h| (at(h).0 - exact).abs());
            println!("{}: {:.1e} apart, errors {errors:?}", constraint.name, there - back);
            assert!((there - back).abs() < 1e-14);
            assert!(errors[1] < 1e-12 || (errors[0] / errors[1] - 4.0).abs() < 0.3, "{errors:?}");
        }
    }
}

/// An upright wheel goes straight: `Δx = R Δθ` exactly, however large the step.
#[test]
fn straight_rolling_is_exact() {
    let plane = RolledPlane { origin: Vector3::zeros(), axes: Matrix3::identity(), spin: 0.0 };
    let (axis, radius) = (Vector3::y(), 0.3);
    let rolling = Rolling { frame: 0, axis: Some(axis), circle: radius, section: 0.0, plane };
    let constraint = ScalarConstraint::rolling("wheel", rolling);
    for angle in [1e-9, 0.4, 2.5] {
        let (mut start, mut end) = (vec![0.0; FRAME], vec![0.0; FRAME]);
        directors::set_frame(&mut start, &Vector3::new(0.0, 0.0, radius), &Matrix3::identity());
        let center = Vector3::new(radius * angle, 0.0, radius);
        directors::set_frame(&mut end, &center, &rotation::exp(&(angle * axis)));
        let s = Interval::between(0.0, 0.1, &start, &end);
        let worst = constraint.rows.iter().map(|row| row.gap(&s).abs()).fold(0.0, f64::max);
        println!("{angle}: {worst:.1e}");
        assert!(worst < 1e-16, "{worst:e}");
    }
}
