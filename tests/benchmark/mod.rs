//! What the benchmark tests share: runs of shipped models, points of bodies, tables of observed
//! orders.
#![allow(dead_code, clippy::unwrap_used)] // each test uses its part

use crate::harness::models::overrides;
use holonom::{Model, Sample, Simulation};
use nalgebra::{Matrix3, Vector3};

/// Reference of the tip of the shipped `chain8` at `t = 1`.
pub(crate) const CHAIN_TIP: [f64; 3] = [4.086_210_757_198, -0.893_891_357_675, -6.337_916_339_015];
/// Reference of the centre of the shipped `heavy_top` at `t = 10`.
pub(crate) const TOP_CENTER: [f64; 3] = [-0.102_307_757_820, 0.286_070_018_166, -0.952_731_372_107];

/// A model with values replaced: `("simulation.step", "0.01")`.
pub(crate) fn model(text: &str, replaced: &[(&str, &str)]) -> Model {
    Model::from_toml_with(text, &overrides(replaced)).unwrap()
}

/// All recorded nodes of a run that reaches its end.
pub(crate) fn samples(simulation: &mut Simulation) -> Vec<Sample> {
    simulation.samples().collect::<Result<_, _>>().unwrap()
}

/// Largest difference of two configurations; NaN where one is NaN.
pub(crate) fn apart(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    holonom::vi_core::linear::norm_inf(&difference)
}

/// A running model, with step and order replaced.
pub(crate) struct Run {
    pub(crate) simulation: Simulation,
    pub(crate) model: Model,
    pub(crate) h: f64,
    pub(crate) iterations: usize,
}

/// A point of a body, or a direction in it.
#[derive(Clone, Copy)]
pub(crate) struct Point {
    offset: usize,
    components: Vector3<f64>,
}

impl Run {
    pub(crate) fn new(text: &str, h: f64, order: u32) -> Self {
        Self::with(text, h, order, &[])
    }

    pub(crate) fn with(text: &str, h: f64, order: u32, replaced: &[(&str, &str)]) -> Self {
        let (step, order) = (format!("{h:e}"), order.to_string());
        let own = [("simulation.step", step.as_str()), ("simulation.order", order.as_str())];
        let model = model(text, &[&own[..], replaced].concat());
        Self { simulation: Simulation::new(&model).unwrap(), model, h, iterations: 0 }
    }

    pub(crate) fn steps(&mut self, count: usize) {
        for _ in 0..count {
            let step = self.simulation.integrator().step();
            let t = self.t();
            self.iterations += step.unwrap_or_else(|e| panic!("t = {t}: {e}")).iterations;
        }
    }

    /// Steps until `t`, which must be a whole number of steps away.
    pub(crate) fn until(&mut self, t: f64) {
        let count = (t - self.t()) / self.h;
        assert!((count - count.round()).abs() < 1e-6, "{t} is not on a step of {}", self.h);
        self.steps(count.round() as usize);
    }

    /// The configuration at `t`.
    pub(crate) fn configuration_at(mut self, t: f64) -> Vec<f64> {
        self.until(t);
        self.q().to_vec()
    }

    pub(crate) fn t(&mut self) -> f64 {
        self.simulation.integrator().state().t
    }

    pub(crate) fn q(&mut self) -> &[f64] {
        &self.simulation.integrator().state().q
    }

    fn offset(&self, member: &str) -> usize {
        let members = self.simulation.members();
        let k = members.iter().position(|m| m.name == member).unwrap();
        members[..k].iter().map(|m| m.kind.columns().len()).sum()
    }

    /// The point of a body that is at `x` now.
    pub(crate) fn point(&mut self, body: &str, x: [f64; 3]) -> Point {
        let offset = self.offset(body);
        let components = self.triad(offset).transpose() * (Vector3::from(x) - self.center(offset));
        Point { offset, components }
    }

    fn center(&mut self, offset: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.q()[offset..offset + 3])
    }

    fn triad(&mut self, offset: usize) -> Matrix3<f64> {
        Matrix3::from_column_slice(&self.q()[offset + 3..offset + 12])
    }

    /// Where a point is now.
    pub(crate) fn at(&mut self, point: Point) -> Vector3<f64> {
        self.center(point.offset) + self.triad(point.offset) * point.components
    }

    /// Where the velocity `v̂` of the projected momentum takes a point.
    pub(crate) fn rate(&mut self, point: Point) -> Vector3<f64> {
        let v = self.simulation.integrator().observe_state().unwrap().v.clone();
        let at = point.offset;
        Vector3::from_column_slice(&v[at..at + 3])
            + Matrix3::from_column_slice(&v[at + 3..at + 12]) * point.components
    }

    /// Coordinates of a component.
    pub(crate) fn coordinates(&mut self, member: &str) -> Vec<f64> {
        let offset = self.offset(member);
        self.q()[offset..].to_vec()
    }

    /// `H_d` of the projected momentum.
    pub(crate) fn energy(&mut self) -> f64 {
        self.simulation.integrator().observe_state().unwrap().hamiltonian_projected.total()
    }

    /// `|g(q_n)|_∞`.
    pub(crate) fn residual(&mut self) -> f64 {
        self.simulation.integrator().observe_state().unwrap().position_residual
    }

    /// How far the tip of the shipped `chain8` is from its reference at `t = 1`, where the run
    /// goes.
    pub(crate) fn error_of_chain(&mut self) -> f64 {
        let tip = self.point("link8", [8.0, 0.0, 0.0]);
        self.until(1.0);
        (self.at(tip) - Vector3::from(CHAIN_TIP)).norm()
    }

    /// How far the centre of the shipped `heavy_top` is from its reference at `t = 10`, where the
    /// run goes.
    pub(crate) fn error_of_top(&mut self) -> f64 {
        self.until(10.0);
        let x = Vector3::from_column_slice(&self.q()[..3]);
        (x - Vector3::from(TOP_CENTER)).norm()
    }

    /// Linear and angular momentum of the projected momentum.
    pub(crate) fn momentum(&mut self) -> [Vector3<f64>; 2] {
        let run = self.simulation.integrator();
        let p = run.observe_state().unwrap().p_projected.clone();
        let momentum = run.constraints().momentum(&run.state().q, &p);
        [momentum.linear.into(), momentum.angular.into()]
    }
}

/// The angle of a body about a fixed axis, unwrapped beyond half a revolution.
pub(crate) struct Rotation {
    offset: usize,
    axis: Vector3<f64>,
    last: Matrix3<f64>,
    pub(crate) angle: f64,
}

impl Rotation {
    pub(crate) fn new(run: &mut Run, body: &str, axis: [f64; 3], angle: f64) -> Self {
        let offset = run.offset(body);
        Self { offset, axis: axis.into(), last: run.triad(offset), angle }
    }

    /// Adds a step of less than half a revolution.
    pub(crate) fn follow(&mut self, run: &mut Run) {
        let now = run.triad(self.offset);
        let turn = now * self.last.transpose();
        let twice = Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12);
        self.angle += twice.dot(&self.axis).atan2(turn.trace() - 1.0);
        self.last = now;
    }
}

/// Errors over steps with the order observed between neighbours; returns these orders.
pub(crate) fn orders(what: &str, steps: &[f64], errors: &[f64]) -> Vec<f64> {
    println!("{what}:");
    let mut orders = Vec::new();
    for (k, (h, error)) in steps.iter().zip(errors).enumerate() {
        if k == 0 {
            println!("  h = {h:<9.3e} error {error:.3e}");
        } else {
            let order = (errors[k - 1] / error).ln() / (steps[k - 1] / h).ln();
            println!("  h = {h:<9.3e} error {error:.3e}  order {order:.2}");
            orders.push(order);
        }
    }
    orders
}

/// For each step, how far the configurations of this and of half this step are apart; each step is
/// half the one before.
pub(crate) fn changes_at_halved_steps(steps: &[f64], end: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let last = steps.last().map(|h| 0.5 * h);
    let ends: Vec<Vec<f64>> = steps.iter().copied().chain(last).map(end).collect();
    ends.windows(2).map(|pair| apart(&pair[0], &pair[1])).collect()
}

/// Runs `error` for each step length, prints and returns errors and orders.
pub(crate) fn study(
    what: &str,
    steps: &[f64],
    mut error: impl FnMut(f64) -> f64,
) -> (Vec<f64>, Vec<f64>) {
    let begin = std::time::Instant::now();
    let errors: Vec<f64> = steps.iter().map(|&h| error(h)).collect();
    let orders = orders(what, steps, &errors);
    println!("  ({:.2} s)", begin.elapsed().as_secs_f64());
    (errors, orders)
}

/// The last order is nominal.
#[track_caller]
pub(crate) fn assert_order(orders: &[f64], nominal: f64, within: f64) {
    let last = orders.last().unwrap();
    assert!((last - nominal).abs() <= within, "order {last:.3} instead of {nominal}");
}

/// `y(t)` of `ẏ = f(y)` by Gragg extrapolation to round-off.
pub(crate) fn ode<const N: usize>(
    f: impl Fn(&[f64; N]) -> [f64; N],
    y0: [f64; N],
    t: f64,
) -> [f64; N] {
    let steps = (t / 0.02).ceil().max(1.0);
    let big = t / steps;
    let mut y = y0;
    for _ in 0..steps as usize {
        let mut table: Vec<[f64; N]> = Vec::new();
        for j in 1..=8_usize {
            let n = 2 * j;
            let h = big / n as f64;
            let slope = f(&y);
            let (mut old, mut new) = (y, std::array::from_fn(|i| y[i] + h * slope[i]));
            for _ in 1..n {
                let slope = f(&new);
                let next = std::array::from_fn(|i| old[i] + 2.0 * h * slope[i]);
                (old, new) = (new, next);
            }
            let slope = f(&new);
            let mut row: [f64; N] = std::array::from_fn(|i| 0.5 * (new[i] + old[i] + h * slope[i]));
            for k in 1..j {
                let ratio = (j as f64 / (j - k) as f64).powi(2) - 1.0;
                let before = std::mem::replace(&mut table[k - 1], row);
                row = std::array::from_fn(|i| row[i] + (row[i] - before[i]) / ratio);
            }
            table.push(row);
        }
        y = table[7];
    }
    y
}
