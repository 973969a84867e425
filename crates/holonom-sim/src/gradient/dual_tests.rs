//! A double pendulum over dual numbers: the same discrete motion in two angles, differentiated
//! exactly by other formulas.
//!
//! ```text
//! L_d(α, α') = Σ m_i |Δp_i|²/2h + J_i (1 − cos Δα_i)/h − h m_i g (z_i + z_i')/2
//! p_n + D_1 L_d = 0,   p_{n+1} = D_2 L_d,   p_0 = M(α_0) α̇_0
//! ```
//! Directors that turn by `Δα` in a plane have the kinetic energy of the second term, and nodes on
//! the constraints leave the step equations of `L_d` on them.

use super::tests::changed;
use super::{Wanted, gradient};
use holonom_model::ModelText;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::path::Path;

/// `x + ε dx`.
#[derive(Clone, Copy, Debug)]
struct Dual(f64, f64);

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.0 * other.1 + self.1 * other.0)
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let ratio = self.0 / other.0;
        Self(ratio, (self.1 - ratio * other.1) / other.0)
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Dual {
    fn sin(self) -> Self {
        Self(self.0.sin(), self.0.cos() * self.1)
    }
    fn cos(self) -> Self {
        Self(self.0.cos(), -self.0.sin() * self.1)
    }
}

fn real(x: f64) -> Dual {
    Dual(x, 0.0)
}

/// `(cos α, −sin α)`: along a rod that has turned by `α` about `y`, in the plane of `x` and `z`.
fn along(a: Dual) -> [Dual; 2] {
    [a.cos(), -a.sin()]
}

/// Its derivative by the angle.
fn across(a: Dual) -> [Dual; 2] {
    [-a.sin(), -a.cos()]
}

fn times(s: Dual, x: [Dual; 2]) -> [Dual; 2] {
    x.map(|x| s * x)
}

fn plus(a: [Dual; 2], b: [Dual; 2]) -> [Dual; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn product(a: [Dual; 2], b: [Dual; 2]) -> Dual {
    a[0] * b[0] + a[1] * b[1]
}

const G: f64 = 9.81;
const H: f64 = 0.01;
const STEPS: usize = 50;

/// Two rods of equal lengths, their centres in the middle.
struct Rods {
    m: [Dual; 2],
    j: [Dual; 2],
    l: Dual,
}

impl Rods {
    fn half(&self) -> Dual {
        self.l * real(0.5)
    }

    fn centres(&self, [a, b]: [Dual; 2]) -> [[Dual; 2]; 2] {
        let half = self.half();
        [times(half, along(a)), plus(times(self.l, along(a)), times(half, along(b)))]
    }

    /// `D_1 L_d` or `D_2 L_d`, of the node `at`.
    fn slope(&self, from: [Dual; 2], to: [Dual; 2], at_end: bool) -> [Dual; 2] {
        let (sign, at) = if at_end { (real(1.0), to) } else { (real(-1.0), from) };
        let (before, after) = (self.centres(from), self.centres(to));
        let moved = |i: usize| plus(after[i], times(real(-1.0), before[i]));
        let (n, half, [m, m_2]) = (at.map(across), self.half(), self.m);
        let turned = |i: usize| self.j[i] * (to[i] - from[i]).sin();
        let inertia = [
            m * half * product(moved(0), n[0]) + m_2 * self.l * product(moved(1), n[0]) + turned(0),
            m_2 * half * product(moved(1), n[1]) + turned(1),
        ];
        let arm = [m * half + m_2 * self.l, m_2 * half];
        let weight = |i: usize| real(0.5 * H * G) * arm[i] * n[i][1];
        [0, 1].map(|i| sign * inertia[i] / real(H) - weight(i))
    }

    /// `M(α) α̇`.
    fn momentum(&self, at: [Dual; 2], rates: [Dual; 2]) -> [Dual; 2] {
        let (n, half, [m, m_2]) = (at.map(across), self.half(), self.m);
        let v = times(half * rates[0], n[0]);
        let v_2 = plus(times(self.l * rates[0], n[0]), times(half * rates[1], n[1]));
        [
            m * half * product(v, n[0]) + m_2 * self.l * product(v_2, n[0]) + self.j[0] * rates[0],
            m_2 * half * product(v_2, n[1]) + self.j[1] * rates[1],
        ]
    }

    /// `D_2 D_1 L_d`.
    fn matrix(&self, from: [Dual; 2], to: [Dual; 2]) -> [[Dual; 2]; 2] {
        let (n, next, half, [m, m_2]) = (from.map(across), to.map(across), self.half(), self.m);
        let upper = m * half * half + m_2 * self.l * self.l;
        let both = m_2 * half * self.l;
        let turned = |i: usize| self.j[i] * (to[i] - from[i]).cos();
        let all = [
            [upper * product(next[0], n[0]) + turned(0), both * product(next[1], n[0])],
            [both * product(next[0], n[1]), m_2 * half * half * product(next[1], n[1]) + turned(1)],
        ];
        all.map(|row| row.map(|x| -x / real(H)))
    }

    /// The height of the tip at the end.
    fn height(&self, mut at: [Dual; 2], rates: [Dual; 2]) -> Dual {
        let mut p = self.momentum(at, rates);
        let mut last = rates.map(|rate| real(H) * rate);
        for _ in 0..STEPS {
            let mut to = [0, 1].map(|i| at[i] + last[i]);
            for _ in 0..8 {
                let slope = self.slope(at, to, false);
                let r = [0, 1].map(|i| p[i] + slope[i]);
                let [[a, b], [c, d]] = self.matrix(at, to);
                let det = a * d - b * c;
                to = [to[0] - (d * r[0] - b * r[1]) / det, to[1] - (a * r[1] - c * r[0]) / det];
            }
            p = self.slope(at, to, true);
            last = [0, 1].map(|i| to[i] - at[i]);
            at = to;
        }
        times(self.l, plus(along(at[0]), along(at[1])))[1]
    }
}

const MODEL: &str = r#"
model = { name = "rods", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.5, scheme = "SCHEME" }
parameters = { mass = 1.3, length = 0.9, inertia = 0.07 }
[[body]]
name = "upper"
position = ["= length/2", 0.0, 0.0]
mass = 1.1
inertia = [0.03, "= inertia", 0.07]
[[body]]
name = "lower"
position = ["= 1.5*length", 0.0, 0.0]
mass = "= mass"
inertia = [0.03, 0.05, 0.06]
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = -2.5
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = ["= length", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = 1.5
[[sensor]]
name = "tip"
type = "position"
of = "lower"
point = ["= length/2", 0.0, 0.0]
"#;

#[test]
fn a_double_pendulum_over_dual_numbers_has_the_same_derivatives() {
    // mass, length, inertia, angle and rate of the shoulder, of the elbow
    let along = |k: usize| {
        let d = |own: usize| if own == k { 1.0 } else { 0.0 };
        let (l, j) = (Dual(0.9, d(1)), Dual(0.07, d(2)));
        let rods = Rods { m: [real(1.1), Dual(1.3, d(0))], j: [j, real(0.05)], l };
        let [shoulder, rate] = [Dual(0.0, d(3)), Dual(-2.5, d(4))];
        let [elbow, bends] = [Dual(0.0, d(5)), Dual(1.5, d(6))];
        rods.height([shoulder, shoulder + elbow], [rate, rate + bends])
    };
    for scheme in ["nodal", "reduced", "constrained", "dalembert"] {
        let text = changed(MODEL, &[("SCHEME", scheme)]);
        let text = ModelText::from_text(Path::new("model.toml"), &text);
        let model = text.model(&[]).unwrap();
        let wanted = Wanted { of: vec!["tip.z".into()], ..Wanted::everything() };
        let found = gradient(&text, &[], &model, &wanted).unwrap();
        let of =
            |name: &str| found.parameters.iter().find(|own| own.name == name).unwrap().derivative;
        let of_start = |name: &str| {
            let own = found.initial.iter().find(|own| own.name == name).unwrap();
            [own.coordinate, own.rate.unwrap()]
        };
        let starts = [of_start("shoulder"), of_start("elbow")].concat();
        let all = [vec![of("mass"), of("length"), of("inertia")], starts].concat();
        assert!((found.value - along(0).0).abs() < 1e-12, "{} {}", found.value, along(0).0);
        // of the start relative to the largest, as terms of its derivatives cancel
        let largest = (3..7).map(|k| along(k).1.abs()).fold(0.0, f64::max);
        for (k, derivative) in all.into_iter().enumerate() {
            let wanted = along(k).1;
            let size = if k < 3 { wanted.abs() } else { largest };
            let off = (derivative - wanted).abs() / size;
            println!("{scheme} {k}: {derivative} off {off:.1e}");
            assert!(off < 1e-12, "{scheme} {k}: {derivative} for {wanted}");
        }
    }
}
