//! The law of a contact at a node: orders of convergence, balances of momentum, work.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use nalgebra::{Matrix3, Vector3};
use vi_constraints::nonsmooth::{ContactRecord, ContactStatus, Method};
use vi_core::State;
use vi_multibody::FrameId::{self, Ground};
use vi_multibody::PairKind;
use vi_multibody::builder::{DryFriction, Inertia, JointLimits, MechanismBuilder};
use vi_multibody::joint_force::{Motor, Viscous};
use vi_multibody::run::MechanismIntegrator;
use vi_rigid::gap::ContactShape;

type V = Vector3<f64>;

const FRAME: usize = 12;

/// Linear and angular momentum of `p̄`, about the origin of space.
fn momentum(state: &State) -> [V; 2] {
    let mut sums = [V::zeros(); 2];
    for (q, p) in state.q.chunks(FRAME).zip(state.p.chunks(FRAME)) {
        let part = |of: &[f64], k: usize| V::from_column_slice(&of[3 * k..3 * k + 3]);
        sums[0] += part(p, 0);
        sums[1] += (0..4).map(|k| part(q, k).cross(&part(p, k))).sum::<V>();
    }
    sums
}

/// The orders of convergence of the last differences between runs with half the step each.
fn orders(found: &[Vec<f64>]) -> Vec<f64> {
    let apart = |a: &Vec<f64>, b: &Vec<f64>| {
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let changes: Vec<f64> = found.windows(2).map(|two| apart(&two[0], &two[1])).collect();
    changes.windows(2).map(|two| (two[0] / two[1]).log2()).collect()
}

fn advance(run: &mut MechanismIntegrator, steps: usize) {
    for step in 0..steps {
        run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
    }
}

/// A ball slides across a slope while it turns: the direction of its slip turns, and the velocity
/// of the node, not the slip of the step, makes the friction one of order two.
#[test]
fn friction_of_a_slip_that_turns_is_of_order_two() {
    let slope = 0.25_f64;
    let end = |steps: usize| {
        let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
        let mut builder = MechanismBuilder::new().gravity(gravity);
        let ball = builder.body("ball", Inertia::principal(1.0, [0.004; 3])).at([0.0, 0.0, 0.1]);
        let ball = ball.velocity([0.0, 2.0, 0.0]).angular_velocity([3.0, 1.0, 5.0]).id();
        let shape = ContactShape::sphere(V::zeros(), 0.1);
        let law = coulomb(0.3, 0.0);
        builder.shape_contact("floor", (Ground, floor()), (ball, shape), law).unwrap();
        let mut run = run_by(&builder, 0.2 / steps as f64, Method::Events);
        advance(&mut run, steps);
        run.state().q[..2].to_vec()
    };
    let orders = orders(&[20, 40, 80, 160].map(end));
    println!("orders {orders:.2?}");
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.2), "{orders:?}");
}

/// Two balls that turn collide with friction between two nodes, by fixed steps: while the gap is
/// open both feel opposite impulses in one point, and no momentum changes.
#[test]
fn an_open_gap_transmits_no_momentum_to_nowhere() {
    let mut builder = MechanismBuilder::new();
    let a = builder.body("a", Inertia::principal(1.0, [0.004; 3])).velocity([1.0, 0.0, 0.0]);
    let a = a.angular_velocity([3.0, 5.0, -7.0]).id();
    let b = builder.body("b", Inertia::principal(2.0, [0.018; 3])).at([0.5, 0.1, 0.05]);
    let b = b.velocity([-0.5, 0.1, 0.0]).angular_velocity([-4.0, 1.0, 2.0]).id();
    let balls = [(a, 0.1), (b, 0.15)];
    let [a, b] =
        balls.map(|(of, radius)| (FrameId::from(of), ContactShape::sphere(V::zeros(), radius)));
    builder.shape_contact("balls", a, b, coulomb(0.3, 0.6)).unwrap();
    let mut run = run_by(&builder, 0.01, Method::Stepping);
    let start = momentum(run.state());
    let (mut off, mut gap) = (0.0_f64, 0.0_f64);
    for _ in 0..60 {
        run.step().unwrap();
        for (_, contacts) in run.nonsmooth().unwrap().nodes() {
            let acting = contacts.iter().filter(|own| own.status != ContactStatus::Open);
            gap = acting.map(|own| own.gap).fold(gap, f64::max);
        }
        let now = momentum(run.state());
        off = now.iter().zip(&start).map(|(a, b)| (a - b).amax()).fold(off, f64::max);
    }
    println!("a gap of {gap:.1e} m transmits an impulse, momenta change by {off:.1e}");
    assert!(gap > 1e-4, "{gap:e}");
    assert!(off < 1e-14, "{off:e}");
}

/// A leaning rod hits a floor with friction: Newton's law of restitution alone would gain 46 mJ.
#[test]
fn restitution_with_friction_gains_no_energy() {
    let (s, c) = (1.0_f64.sin(), 1.0_f64.cos());
    let mut builder = MechanismBuilder::new();
    let inertia = Inertia::principal(1.0, [1e-3, 1.0 / 12.0, 1.0 / 12.0]);
    let attitude = Matrix3::new(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c);
    let rod = builder.body("rod", inertia).at([0.5 * c, 0.0, 0.5 * s + 5e-4]).attitude(attitude);
    let rod = rod.velocity([0.6, 0.0, -1.0]).id();
    let tip = ContactShape::Points { points: vec![V::new(-0.5, 0.0, 0.0)], radius: 0.0 };
    let law = coulomb(0.6, 0.9);
    builder.shape_contact("floor", (Ground, floor()), (rod, tip), law).unwrap();
    let mut run = run_by(&builder, 1e-3, Method::Events);
    advance(&mut run, 3);
    let counts = run.state().contacts.counts;
    println!("{counts:?}");
    assert_eq!((counts.impacts, counts.guarded), (1, 1));
    assert!(counts.largest_work < 1e-12, "gains {:e} J", counts.largest_work);
    assert!((counts.largest_reduction - (1.0 - 0.832 / 0.9)).abs() < 1e-3, "{counts:?}");
}

/// A mass on a spring with dry friction comes to rest after half swings that are known; its rate is
/// reversed with the mean of the sign over the time of the node.
#[test]
fn a_rate_is_reversed_to_second_order() {
    // between reversals x = ±F/k + A cos ωt, and A falls by 2F/k from each half swing to the next
    let (k, force, start, t) = (100.0_f64, 3.0, 0.5, 1.45_f64);
    let omega = k.sqrt();
    let half = (t * omega / std::f64::consts::PI).floor();
    let amplitude = start - (2.0 * half + 1.0) * force / k;
    let sign = if half % 2.0 == 0.0 { 1.0 } else { -1.0 };
    let phase = t * omega - half * std::f64::consts::PI;
    let exact = sign * (force / k + amplitude * phase.cos());
    let error = |step: f64| {
        let mut builder = MechanismBuilder::new();
        let body = builder.body("mass", Inertia::principal(1.0, [1.0; 3])).id();
        let guide = builder.joint("guide", PairKind::Prismatic, Ground, body).at([0.0; 3]);
        let along = guide.axis([1.0, 0.0, 0.0]).id().coordinate(0);
        builder.joint_spring(along, k, -start);
        builder.joint_friction(along, DryFriction::Effort(force));
        let mut run = run_by(&builder, step, Method::Events);
        advance(&mut run, (t / step).round() as usize);
        (run.state().q[0] + start - exact).abs()
    };
    let errors = [0.0025, 0.00125].map(error);
    println!("errors {errors:?} m");
    assert!(errors[0] < 6e-5 && errors[1] < 6e-5, "{errors:?}");
}

/// A box is held by four corners whose impulses are not unique: those of a stored state choose the
/// same ones, to the bit.
#[test]
fn stored_impulses_of_four_corners_continue_to_the_bit() {
    let begin = || {
        let mut builder = MechanismBuilder::new().gravity([2.0, 0.7, -G]);
        let body = builder.body("box", Inertia::principal(3.0, [0.02, 0.04, 0.05]));
        let body = body
            .at([0.0, 0.0, 0.2])
            .velocity([0.9, -0.4, 0.0])
            .angular_velocity([0.3, 0.2, 2.0])
            .id();
        let own = (FrameId::from(body), box_shape([0.2, 0.15, 0.1]));
        builder.shape_contact("floor", (Ground, floor()), own, coulomb(0.4, 0.2)).unwrap();
        run_by(&builder, 0.005, Method::Stepping)
    };
    let mut run = begin();
    advance(&mut run, 80);
    let mut closed = 0;
    for _ in 0..6 {
        advance(&mut run, 10);
        let text = serde_json::to_string(run.state()).unwrap();
        let mut other = begin();
        other.resume(serde_json::from_str::<State>(&text).unwrap()).unwrap();
        for _ in 0..5 {
            run.step().unwrap();
            other.step().unwrap();
            assert_eq!(run.state(), other.state(), "step {}", run.state().step);
        }
        let four = run.state().contacts.contacts.iter().filter(|own| own.impulse[0] > 0.0);
        closed += usize::from(four.count() == 4);
    }
    println!("four corners bear at {closed} of 6 stored states");
    assert!(closed >= 3);
}

/// What contacts of a step do to a body that alone moves: the sums of their impulses and of their
/// moments about the origin.
fn exerted(contacts: &[ContactRecord]) -> [V; 2] {
    let mut sums = [V::zeros(); 2];
    for own in contacts {
        let place = own.place.expect("it is in space");
        let impulse: V = (0..3).map(|i| V::from(place.axes[i]) * own.impulse[i]).sum();
        sums[0] += impulse;
        sums[1] += V::from(place.point).cross(&impulse);
    }
    sums
}

/// A plate with three feet, its centre of mass between them at their height, so that each bears a
/// third of the weight. It slides and turns such that the velocity of the first foot passes
/// through zero while the others slide.
fn plate(step: f64, method: Method) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let plate = builder.body("plate", Inertia::principal(MASS, [0.04, 0.04, PLATE]));
    let plate = plate.velocity(VELOCITY).angular_velocity([0.0, 0.0, SPIN]).id();
    let points = ContactShape::Points { points: feet().to_vec(), radius: 0.0 };
    let law = coulomb(FRICTION, 0.0);
    builder.shape_contact("floor", (Ground, floor()), (plate, points), law).unwrap();
    run_by(&builder, step, method)
}

const MASS: f64 = 1.5;
const PLATE: f64 = 0.05; // kg·m²
const FRICTION: f64 = 0.25;
const SPIN: f64 = 5.0;
const RADIUS: f64 = 0.2;
/// Nearly that of a turn about the first foot.
const VELOCITY: [f64; 3] = [0.35, -SPIN * RADIUS + 0.1, 0.0];

fn feet() -> [V; 3] {
    [0.0, 1.0, 2.0].map(|k| {
        let angle: f64 = 2.0 / 3.0 * std::f64::consts::PI * k;
        RADIUS * V::new(angle.cos(), angle.sin(), 0.0)
    })
}

/// The same by Runge and Kutta's method in place, angle and their rates: `(x, y, θ, ẋ, ẏ, θ̇)`, and
/// the least speed of the first foot with the largest of the others then.
fn planar(t: f64, steps: usize) -> ([f64; 6], f64, f64) {
    let slips = |y: &[f64; 6]| {
        feet().map(|foot| {
            let (s, c) = y[2].sin_cos();
            let arm = [c * foot.x - s * foot.y, s * foot.x + c * foot.y];
            ([y[3] - y[5] * arm[1], y[4] + y[5] * arm[0]], arm)
        })
    };
    let rate = |y: &[f64; 6]| {
        let mut sums = [0.0; 3];
        for (slip, arm) in slips(y) {
            let speed = slip[0].hypot(slip[1]).max(1e-12);
            let force = slip.map(|u| -FRICTION * MASS * G / 3.0 * u / speed);
            sums[0] += force[0] / MASS;
            sums[1] += force[1] / MASS;
            sums[2] += (arm[0] * force[1] - arm[1] * force[0]) / PLATE;
        }
        [y[3], y[4], y[5], sums[0], sums[1], sums[2]]
    };
    let mut y = [0.0, 0.0, 0.0, VELOCITY[0], VELOCITY[1], SPIN];
    let (h, mut least, mut beside) = (t / steps as f64, f64::INFINITY, 0.0);
    for _ in 0..steps {
        let along = |k: &[f64; 6], part: f64| std::array::from_fn(|i| y[i] + part * h * k[i]);
        let k_1 = rate(&y);
        let k_2 = rate(&along(&k_1, 0.5));
        let k_3 = rate(&along(&k_2, 0.5));
        let k_4 = rate(&along(&k_3, 1.0));
        y = std::array::from_fn(|i| {
            y[i] + h / 6.0 * (k_1[i] + 2.0 * k_2[i] + 2.0 * k_3[i] + k_4[i])
        });
        let [first, second, third] = slips(&y).map(|(slip, _)| slip[0].hypot(slip[1]));
        if first < least {
            (least, beside) = (first, second.min(third));
        }
    }
    (y, least, beside)
}

/// One foot of a plate stands still for a moment while the others slide: the impulses of all nodes
/// stay in their cones, the friction of each node takes out work, the balances of momentum are
/// exact, and the motion converges to that of the plane. Where the slip of the foot turns back
/// within a step, the friction of that foot alone may do work, of second order in the step.
#[test]
fn a_foot_whose_velocity_passes_through_zero() {
    let t = 0.1;
    let (exact, least, beside) = planar(t, 200_000);
    println!("the first foot comes down to {least:.1e} m/s, the others slide at {beside:.2} m/s");
    assert!(least < 2e-3 && beside > 1.0, "{least} {beside}");
    for method in [Method::Events, Method::Stepping] {
        let mut errors = Vec::new();
        for steps in [25, 50, 100, 200] {
            let h = t / f64::from(steps);
            let mut run = plate(h, method);
            let (mut work, mut foot, mut rim, mut off) = (f64::MIN, 0.0_f64, f64::MIN, 0.0_f64);
            for _ in 0..steps {
                let (before, center) =
                    (momentum(run.state()), V::from_column_slice(&run.state().q[..3]));
                run.step().unwrap();
                let after = momentum(run.state());
                let mean = 0.5 * (center + V::from_column_slice(&run.state().q[..3]));
                let weight = h * MASS * V::new(0.0, 0.0, -G);
                for (_, contacts) in run.nonsmooth().unwrap().nodes() {
                    let [impulse, moment] = exerted(contacts);
                    let linear = after[0] - before[0] - impulse - weight;
                    let angular = after[1] - before[1] - moment - mean.cross(&weight);
                    off = off.max(linear.amax()).max(angular.amax());
                    work = work.max(contacts.iter().map(|own| own.work).sum());
                    for own in contacts {
                        let [normal, a, b] = own.impulse;
                        foot = foot.max(own.work);
                        rim = rim.max((a.hypot(b) - FRICTION * normal) / normal);
                    }
                }
            }
            let q = &run.state().q;
            let angle = q[4].atan2(q[3]);
            let error =
                (q[0] - exact[0]).hypot(q[1] - exact[1]) + RADIUS * (angle - exact[2]).abs();
            println!(
                "{method:?}, {steps} steps: error {error:.1e} m, largest work of a node {work:.1e} J, \
                 of a foot {foot:.1e} J, beyond the cone {rim:.1e}, momenta off by {off:.1e}"
            );
            assert!(work < 0.0 && rim < 1e-12 && off < 1e-14, "{work:e} {rim:e} {off:e}");
            // |Λ_T| times half of what its velocity changes in a step by all forces
            let most = FRICTION * MASS * G / 3.0 * h * h * 4.0 * FRICTION * G;
            assert!(foot <= most, "{foot:e} J of {most:e} J");
            errors.push(error);
        }
        let order = (errors[0] / errors[3]).log2() / 3.0;
        println!("order {order:.2}");
        assert!(order > 0.9, "{order}");
    }
}

/// A carriage of 2 kg with a damper and dry friction between two stops, from the middle: each part
/// of its motion is an exponential.
struct Carriage {
    damper: f64,
    dry: f64,
    restitution: f64,
    /// A force along the guide, N.
    press: f64,
    speed: f64,
}

impl Carriage {
    const MASS: f64 = 2.0;
    const STOP: f64 = 0.5;

    /// `x` and `v` after a time of sliding with one sign of the rate.
    fn slide(&self, (x, v): (f64, f64), sign: f64, time: f64) -> (f64, f64) {
        let last = (self.press - self.dry * sign) / self.damper;
        let decay = (-self.damper * time / Self::MASS).exp();
        let way = last * time + (v - last) * Self::MASS / self.damper * (1.0 - decay);
        (x + way, last + (v - last) * decay)
    }

    /// Where it is at a time, when it has hit a stop before, and how often it turned back.
    fn exact(&self, end: f64) -> (f64, Vec<f64>, usize) {
        let (mut at, mut t, mut hits, mut turns) = ((0.0, self.speed), 0.0, Vec::new(), 0);
        let mut sign = 1.0;
        for _ in 0..20 {
            // a stop ahead, or the end of the rate; both rise through zero
            let ahead = |time: f64| sign * self.slide(at, sign, time).0 - Self::STOP;
            let turn = |time: f64| -sign * self.slide(at, sign, time).1;
            let root = |f: &dyn Fn(f64) -> f64| {
                let (mut low, mut high) = (1e-12, end - t);
                if f(high) < 0.0 {
                    return f64::INFINITY;
                }
                for _ in 0..100 {
                    let middle = 0.5 * (low + high);
                    if f(middle) < 0.0 { low = middle } else { high = middle }
                }
                high
            };
            let times = [root(&ahead), root(&turn)];
            let time = times[0].min(times[1]);
            if time.is_infinite() {
                break;
            }
            at = self.slide(at, sign, time);
            t += time;
            if times[0] < times[1] {
                at = (sign * Self::STOP, -self.restitution * at.1);
                hits.push(t);
            } else {
                at.1 = 0.0;
                turns += 1;
            }
            sign = -sign;
        }
        (self.slide(at, sign, end - t).0, hits, turns)
    }

    /// The same by steps.
    fn run(&self, end: f64, steps: u32) -> (f64, Vec<f64>) {
        let mut builder = MechanismBuilder::new().gravity([self.press / Self::MASS, 0.0, 0.0]);
        let body = builder.body("carriage", Inertia::principal(Self::MASS, [0.1; 3]));
        let body = body.velocity([self.speed, 0.0, 0.0]).id();
        let guide = builder.joint("guide", PairKind::Prismatic, Ground, body).at([0.0; 3]);
        let along = guide.axis([1.0, 0.0, 0.0]).id().coordinate(0);
        let (lower, upper) = (Some(-Self::STOP), Some(Self::STOP));
        builder.joint_limits(along, JointLimits { lower, upper, restitution: self.restitution });
        builder.joint_friction(along, DryFriction::Effort(self.dry));
        builder.joint_force(along, Viscous(self.damper));
        let mut run = run_by(&builder, end / f64::from(steps), Method::Events);
        let mut hits = Vec::new();
        for _ in 0..steps {
            run.step().unwrap();
            for (node, contacts) in run.nonsmooth().unwrap().nodes() {
                let hit = contacts.iter().any(|own| own.status == ContactStatus::Impact);
                hits.extend(hit.then_some(node.t));
            }
        }
        (run.state().q[0], hits)
    }

    /// The order of the errors of the hits and of the place at a time, with as many hits and turns.
    fn order(&self, end: f64, counts: (usize, usize)) -> f64 {
        let (exact, hits, turns) = self.exact(end);
        println!("hits at {hits:?} s, {turns} turns, ends at {exact} m");
        assert_eq!((hits.len(), turns), counts);
        let error = |steps: u32| {
            let (x, found) = self.run(end, steps);
            assert_eq!(found.len(), hits.len(), "{found:?}");
            let late = found.iter().zip(&hits).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!(
                "{steps} steps: place off by {:.1e} m, hits by {late:.1e} s",
                (x - exact).abs()
            );
            late.max((x - exact).abs())
        };
        let errors = [50, 100, 200, 400].map(error);
        let order = (errors[0] / errors[3]).log2() / 3.0;
        println!("order {order:.2}");
        order
    }
}

/// A joint with damper, stops and dry friction: the velocity that a stop returns is that of the
/// node, with the friction up to it, and the friction from there has the other sign.
#[test]
fn damper_stops_and_friction_of_one_joint_are_of_order_two() {
    for restitution in [0.7, 1.0] {
        let own = Carriage { damper: 3.0, dry: 1.5, restitution, press: 0.5, speed: 5.0 };
        let order = own.order(0.7, (2, 0));
        assert!((order - 2.0).abs() < 0.2, "e = {restitution}: order {order}");
    }
}

/// A slide on a carriage, with dry friction between them, when the carriage hits a stop: the slide
/// is not hit, yet the rate between them is reversed. All accelerations are constant between, so
/// places are exact, for steps of any length.
#[test]
fn friction_between_two_bodies_is_reversed_by_a_stop_of_one() {
    let (masses, friction, restitution, stop, end) = ([2.0, 3.0], 1.5, 0.7, 0.5, 0.2);
    let speeds = [5.0, 1.0];
    // of the carriage −a, of the slide b, then a, −b
    let [a, b] = masses.map(|mass| friction / mass);
    let hit = (speeds[0] - f64::sqrt(speeds[0] * speeds[0] - 2.0 * a * stop)) / a;
    let at = [speeds[0] - a * hit, speeds[1] + b * hit];
    let (left, back) = (end - hit, -restitution * at[0]);
    assert!(at[1] < at[0] && at[1] - b * left > back + a * left, "it slides to the end");
    let exact = [
        stop + back * left + 0.5 * a * left * left,
        0.5 * (speeds[1] + at[1]) * hit + at[1] * left - 0.5 * b * left * left,
    ];
    for steps in [7_u32, 20, 64] {
        let mut builder = MechanismBuilder::new();
        let mut add = |name: &str, k: usize| {
            let body = builder.body(name, Inertia::principal(masses[k], [0.1; 3]));
            body.velocity([speeds[k], 0.0, 0.0]).id()
        };
        let [carriage, slide] = [add("carriage", 0), add("slide", 1)];
        let guide = |from: FrameId, to, name: &str, builder: &mut MechanismBuilder| {
            let guide = builder.joint(name, PairKind::Prismatic, from, to).at([0.0; 3]);
            guide.axis([1.0, 0.0, 0.0]).id().coordinate(0)
        };
        let along = guide(Ground, carriage, "guide", &mut builder);
        let between = guide(carriage.into(), slide, "track", &mut builder);
        builder.joint_limits(along, JointLimits { lower: None, upper: Some(stop), restitution });
        builder.joint_friction(between, DryFriction::Effort(friction));
        let mut run = run_by(&builder, end / f64::from(steps), Method::Events);
        advance(&mut run, steps as usize);
        let found = [0, 1].map(|k| run.state().q[FRAME * k]);
        let off = (0..2).map(|k| (found[k] - exact[k]).abs()).fold(0.0, f64::max);
        println!("{steps} steps: places off by {off:.1e} m");
        assert!(off < 1e-11, "{found:?} for {exact:?}");
    }
}

/// A rate that a force turns back, [N6] of docs/theory.md, 2.20: of order one where friction is no
/// small part of the force, whose acceleration then differs before and after.
#[test]
fn a_rate_that_is_turned_back_against_much_friction_is_of_order_one() {
    let own = Carriage { damper: 3.0, dry: 1.5, restitution: 0.7, press: 6.0, speed: 1.0 };
    let order = own.order(1.1, (2, 2));
    assert!((order - 1.0).abs() < 0.3, "{order}");
}

/// A block in a groove of two planes at 45° to the vertical, on a slope: each plane bears
/// `m g cos β/(2 sin 45°)`, so that it sticks up to `tan β = μ/sin 45°`, and slides beyond with
/// `g (sin β − μ cos β/sin 45°)`.
#[test]
fn a_block_in_a_groove_sticks_and_slides_as_it_must() {
    let (friction, across, t) = (0.3, std::f64::consts::FRAC_1_SQRT_2, 0.5);
    for (part, method) in
        [0.99, 1.01, 1.5].map(|part| [(part, Method::Events), (part, Method::Stepping)]).concat()
    {
        let slope = (part * friction / across).atan();
        let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
        let mut builder = MechanismBuilder::new().gravity(gravity);
        let block = builder.body("block", Inertia::principal(1.0, [0.01, 0.02, 0.02]));
        let block = block.at([0.0, 0.0, 0.1]).id();
        for side in [-1.0, 1.0] {
            let normal = V::new(0.0, -side, 1.0).normalize();
            let wall = ContactShape::Plane { point: V::zeros(), normal };
            let points = [-0.1, 0.1].map(|x| V::new(x, 0.1 * side, 0.0)).to_vec();
            let feet = ContactShape::Points { points, radius: 0.0 };
            let law = coulomb(friction, 0.0);
            builder.shape_contact("wall", (Ground, wall), (block, feet), law).unwrap();
        }
        let mut run = run_by(&builder, 0.005, method);
        advance(&mut run, 100);
        let bearing = slope.sin() - friction * slope.cos() / across;
        let (way, exact) = (run.state().q[0], 0.5 * G * bearing.max(0.0) * t * t);
        println!("{part} of the largest slope, {method:?}: {way:e} m, exact {exact:e} m");
        assert!((way - exact).abs() < 1e-12, "{part}: {way:e} for {exact:e}");
    }
}

/// Two jaws press a wedge with the half angle `α`: it is locked up to `tan α = μ`, and is driven
/// out beyond, with `2N (sin α − μ cos α)/m` and the normal force `N` of each jaw that follows from
/// their own acceleration.
#[test]
fn a_wedge_between_jaws_locks_itself() {
    let (friction, press, t): (f64, f64, f64) = (0.3, 20.0, 0.1);
    let (mass, jaw_mass) = (1.0, 2.0);
    for (part, method) in
        [0.98, 1.02, 1.6].map(|part| [(part, Method::Events), (part, Method::Stepping)]).concat()
    {
        let tangent = part * friction;
        let (sin, cos) = tangent.atan().sin_cos();
        let mut builder = MechanismBuilder::new();
        let wedge = builder.body("wedge", Inertia::principal(mass, [0.01; 3])).id();
        for side in [-1.0, 1.0] {
            let name = if side < 0.0 { "left" } else { "right" };
            let jaw = builder.body(name, Inertia::principal(jaw_mass, [0.01; 3]));
            let jaw = jaw.at([0.2 * side, 0.0, 0.0]).id();
            let guide = builder.joint(&format!("{name} guide"), PairKind::Prismatic, Ground, jaw);
            let guide = guide.at([0.2 * side, 0.0, 0.0]).axis([-side, 0.0, 0.0]).id().coordinate(0);
            builder.joint_force(guide, Motor(std::sync::Arc::new(move |_| press)));
            let point = V::new(-0.1 * side, 0.0, 0.0);
            let face = ContactShape::Plane { point, normal: V::new(-side * cos, 0.0, sin) };
            let corner = |y: f64, z: f64| V::new(side * (0.1 + z * tangent), y, z);
            let points = [[-0.05, -0.05], [0.05, -0.05], [-0.05, 0.05], [0.05, 0.05]];
            let points = points.map(|[y, z]| corner(y, z)).to_vec();
            let corners = ContactShape::Points { points, radius: 0.0 };
            let law = coulomb(friction, 0.0);
            builder.shape_contact(name, (jaw, face), (wedge, corners), law).unwrap();
        }
        let mut run = run_by(&builder, 0.001, method);
        advance(&mut run, 100);
        let drive = 2.0 * (sin - friction * cos) / mass;
        let normal = press / (cos + friction * sin + jaw_mass * tangent * drive);
        let exact = 0.5 * (drive * normal).max(0.0) * t * t;
        let way = run.state().q[2];
        println!("{part} of the angle of friction, {method:?}: {way:e} m, exact {exact:e} m");
        assert!((way - exact).abs() < 1e-12, "{part}: {way:e} for {exact:e}");
    }
}
