//! Impulses of unilateral contact and dry friction.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3, dmatrix, dvector};
use vi_core::cone::{Cone, ConeFault, ConeSolver};
use vi_testkit::allocator::allocations;
use vi_testkit::{CountingAllocator, Sample};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// `y = WΛ + w` with its laws.
pub(crate) struct Problem {
    pub(crate) cones: Vec<Cone>,
    pub(crate) w_matrix: DMatrix<f64>,
    pub(crate) w: DVector<f64>,
}

impl Problem {
    fn solve(&self, lambda: &mut DVector<f64>) -> Result<usize, ConeFault> {
        let mut solver = ConeSolver::default();
        let lambda = lambda.as_mut_slice();
        let report =
            solver.solve(&self.cones, self.w_matrix.as_slice(), self.w.as_slice(), lambda)?;
        Ok(report.rounds)
    }

    /// The largest violation of a law, stated by inequalities and products instead of projections;
    /// impulses relative to the largest, velocities to what their terms cancel.
    pub(crate) fn violation(&self, lambda: &DVector<f64>) -> f64 {
        let y = &self.w_matrix * lambda + &self.w;
        let mut violations = Vec::new();
        let mut row = 0;
        for cone in &self.cones {
            let n = cone.rows();
            let block = |v: &DVector<f64>| v.rows(row, n).into_owned();
            let (impulse, speed) = (block(lambda), block(&y));
            let terms = |i: usize| {
                let sum: f64 = (0..lambda.len())
                    .map(|j| (self.w_matrix[(row + i, j)] * lambda[j]).abs())
                    .sum();
                sum + self.w[row + i].abs()
            };
            let speeds = (0..n).map(terms).fold(1e-300, f64::max);
            let largest = (0..n).map(|i| self.w_matrix[(row + i, row + i)]).fold(0.0, f64::max);
            let impulses = impulse.amax() + speeds / largest.max(1e-300);
            let (impulse, speed) = (impulse / impulses, speed / speeds);
            match *cone {
                Cone::Normal => {
                    violations.extend([-impulse[0], -speed[0], (impulse[0] * speed[0]).abs()]);
                }
                Cone::Bounded { bound } => {
                    let bound = bound / impulses;
                    violations.push(impulse[0].abs() - bound);
                    // y ≠ 0: on the bound, against the motion
                    violations.push((speed[0] * impulse[0] + speed[0].abs() * bound).abs());
                }
                Cone::Sliding { direction, slope, at } => {
                    violations.extend([-impulse[0], -speed[0], (impulse[0] * speed[0]).abs()]);
                    let off = [0, 1].map(|i| speed[1 + i] * speeds - at[i]);
                    for i in 0..2 {
                        let part = direction[i] + slope[i][0] * off[0] + slope[i][1] * off[1];
                        violations.push((impulse[1 + i] + impulse[0] * part).abs());
                    }
                }
                Cone::Convex { coefficient, speed: s } => {
                    let normal = speed[0] + s / speeds;
                    violations.push(
                        (impulse[0] * normal + impulse[1] * speed[1] + impulse[2] * speed[2]).abs(),
                    );
                    violations.push(impulse[1].hypot(impulse[2]) - coefficient * impulse[0]);
                    violations.push(coefficient * speed[1].hypot(speed[2]) - normal);
                }
                Cone::Friction { coefficient } => {
                    let tangent = |v: &DVector<f64>| [v[1], v[2]];
                    let ([p, q], [u, v]) = (tangent(&impulse), tangent(&speed));
                    let slip = u.hypot(v);
                    violations.extend([-impulse[0], -speed[0], (impulse[0] * speed[0]).abs()]);
                    violations.push(p.hypot(q) - coefficient * impulse[0]);
                    for (t, y) in [(p, u), (q, v)] {
                        violations.push((t * slip + coefficient * impulse[0] * y).abs());
                    }
                }
            }
            row += n;
        }
        violations.into_iter().fold(0.0, f64::max)
    }
}

/// Masses over `ratio`, as many degrees of freedom as wished; some motion opens all contacts.
fn random(sample: &mut Sample, cones: Vec<Cone>, freedoms: usize, ratio: f64) -> Problem {
    let k: usize = cones.iter().map(Cone::rows).sum();
    let mut rows = sample.matrix(freedoms, k);
    let mut row = 0;
    for cone in &cones {
        for i in 0..cone.rows() {
            let normal = i == 0 && !matches!(cone, Cone::Bounded { .. });
            rows[(0, row + i)] = f64::from(u8::from(normal));
        }
        row += cone.rows();
    }
    for i in 0..freedoms {
        let mass = ratio.powf(0.5 * (sample.number() + 1.0));
        rows.row_mut(i).scale_mut(1.0 / mass.sqrt());
    }
    let motion = sample.matrix(freedoms, 1);
    let w = rows.transpose() * motion;
    Problem { cones, w_matrix: rows.transpose() * rows, w: w.column(0).into_owned() }
}

fn some_cones(sample: &mut Sample, most: usize, friction: f64) -> Vec<Cone> {
    let count = 1 + sample.index(most);
    (0..count)
        .map(|_| match sample.index(6) {
            0 => Cone::Normal,
            1 => Cone::Bounded { bound: 0.5 * (sample.number() + 1.0) },
            _ => Cone::Friction { coefficient: 0.5 * friction * (sample.number() + 1.0) },
        })
        .collect()
}

/// Solves random problems that have solutions; so many may end with an error.
fn solve_many(count: u64, freedoms: usize, ratio: f64, friction: f64, unsolved: usize) {
    let (mut worst, mut most_rounds, mut failed) = (0.0_f64, 0, Vec::new());
    for seed in 0..count {
        let mut sample = Sample::new(seed);
        let cones = some_cones(&mut sample, 6, friction);
        let freedoms = 1 + sample.index(freedoms);
        let problem = random(&mut sample, cones, freedoms, ratio);
        let mut lambda = DVector::zeros(problem.w.len());
        match problem.solve(&mut lambda) {
            Ok(rounds) => {
                most_rounds = most_rounds.max(rounds);
                worst = worst.max(problem.violation(&lambda));
                // T⁺ − T⁻ = ½ Λ·(y + w)
                let (power, squares) =
                    (problem.w.dot(&lambda), lambda.dot(&(&problem.w_matrix * &lambda)));
                let (gain, size) = (power + 0.5 * squares, power.abs() + squares);
                assert!(
                    gain <= 1e-13 * size,
                    "seed {seed}: the energy grows by {gain:e} of {size:e}"
                );
                let again = problem.solve(&mut lambda).unwrap();
                assert_eq!(again, 0, "seed {seed}: a solution is its own warm start");
            }
            Err(fault) => failed.push((seed, fault)),
        }
    }
    println!("masses over {ratio:e}, μ ≤ {friction}: laws to {worst:.1e}, rounds ≤ {most_rounds}");
    println!("without a solution: {failed:?}");
    assert!(failed.len() <= unsolved, "{failed:?}");
    assert!(worst <= 1e-13, "{worst:e}");
}

#[test]
fn random_contacts_obey_their_laws_and_gain_no_energy() {
    solve_many(2000, 24, 1.0, 1.5, 0);
}

#[test]
fn contacts_of_few_degrees_of_freedom_are_hyperstatic() {
    solve_many(1000, 4, 1.0, 1.0, 0);
}

/// Four corners of a rigid box on a floor, with velocities that no motion of it has, by `1e-12` to
/// `1e-6` of them: laws of steps that turn, or of impacts beside contacts, contradict one another
/// so. A corner opens, or friction between corners grows to its bound.
#[test]
fn corners_whose_laws_contradict_one_another_open_or_slide() {
    let (mut most, mut worst, mut failed) = (0, 0.0_f64, Vec::new());
    for seed in 0..400 {
        let mut sample = Sample::new(seed);
        let [a, b, c] = [0; 3].map(|_| 10.0_f64.powf(sample.number()));
        let inertia = [b * b + c * c, a * a + c * c, a * a + b * b].map(|own| own / 3.0);
        let mut rows = DMatrix::zeros(6, 12);
        for (k, [x, y]) in [[a, b], [-a, b], [a, -b], [-a, -b]].into_iter().enumerate() {
            let arm = Vector3::new(x, y, -c);
            for (i, direction) in [Vector3::z(), Vector3::x(), Vector3::y()].iter().enumerate() {
                let turn = arm.cross(direction);
                for j in 0..3 {
                    rows[(j, 3 * k + i)] = direction[j];
                    rows[(3 + j, 3 * k + i)] = turn[j] / inertia[j].sqrt();
                }
            }
        }
        let mut motion = sample.matrix(6, 1) * 0.1;
        motion[2] = -1.0;
        let off = 10.0_f64.powf(-9.0 + 3.0 * sample.number());
        let w = rows.transpose() * motion + sample.matrix(12, 1) * off;
        let friction = Cone::Friction { coefficient: 0.55 + 0.45 * sample.number() };
        let w_matrix = rows.transpose() * rows;
        let problem = Problem { cones: vec![friction; 4], w_matrix, w: w.column(0).into_owned() };
        let mut lambda = DVector::zeros(12);
        match problem.solve(&mut lambda) {
            Ok(rounds) => {
                most = most.max(rounds);
                worst = worst.max(problem.violation(&lambda));
            }
            Err(fault) => failed.push((seed, off, fault)),
        }
    }
    println!(
        "laws to {worst:.1e}, rounds ≤ {most}, without a solution: {} {failed:?}",
        failed.len()
    );
    assert!(failed.len() <= 2 && worst <= 2e-12, "{worst:e} {failed:?}");
}

/// A point with one freedom along `b` is hit and thrown back: `y = b bᵀΛ + w`, `w = b m` with
/// `w_N` times `1 + e`. It slides then, along `b_T`, with `Λ_N = s/(b_N − μ|b_T|)`,
/// `s = −(1 + e) m`; where `b_N ≤ μ|b_T|` friction grips, and nothing obeys the laws: impulses that
/// balance one another are none, however many digits of velocities they hide. With two freedoms
/// impulses are of the size of the motion, too.
#[test]
fn an_impact_of_what_moves_along_few_directions() {
    let (mut grips, mut largest, mut failed) = (0, 0.0_f64, 0);
    for seed in 0..4000 {
        let mut sample = Sample::new(seed);
        let freedoms = 1 + sample.index(2);
        let mut rows = sample.matrix(freedoms, 3);
        rows[(0, 0)] = 0.5 + rows[(0, 0)].abs();
        let motion = sample.matrix(freedoms, 1);
        let mu = 0.5 * (sample.number() + 1.0);
        let e = 0.5 * (sample.number() + 1.0);
        let mut w = (rows.transpose() * &motion).column(0).into_owned();
        w[0] *= 1.0 + e;
        let w_matrix = rows.transpose() * &rows;
        let problem = Problem { cones: vec![Cone::Friction { coefficient: mu }], w_matrix, w };
        let mut lambda = DVector::zeros(3);
        let solved = problem.solve(&mut lambda);
        if solved.is_ok() {
            let (violation, size) = (problem.violation(&lambda), problem.w.amax());
            largest = largest.max(lambda.amax() * problem.w_matrix.diagonal().amax() / size);
            assert!(violation < 1e-12, "seed {seed}: {violation:e}");
        }
        failed += usize::from(solved.is_err());
        if freedoms == 1 && motion[0] < 0.0 {
            let below = rows[(0, 0)] - mu * rows[(0, 1)].hypot(rows[(0, 2)]);
            if below <= 0.0 {
                grips += 1;
                assert!(solved.is_err(), "seed {seed}: {lambda}");
            } else {
                let normal = -(1.0 + e) * motion[0] / below;
                let error = (lambda[0] - normal).abs() / normal;
                assert!(solved.is_ok() && error < 1e-9, "seed {seed}: {solved:?} {error:e}");
            }
        }
    }
    println!("grip: {grips}, without impulses: {failed}, impulses up to {largest:.1e}");
    assert!(grips > 20 && largest < 1e6, "{largest:e}");
}

/// What moves along one or two directions is jammed by a contact: friction holds it with impulses
/// that are not unique, and velocities that are known to rounding contradict one another by as
/// much. The impulses are of the size of the motion: those that balance one another in the cone
/// change no velocity, and lead nowhere.
#[test]
fn a_contact_that_jams_a_guide_has_impulses_of_the_size_of_the_motion() {
    let (mut largest, mut jams, mut failed) = (0.0_f64, 0, Vec::new());
    for seed in 0..4000 {
        let mut sample = Sample::new(seed);
        let freedoms = 1 + sample.index(2);
        let mut rows = sample.matrix(freedoms, 3);
        rows[(0, 0)] = 0.05 + 0.3 * rows[(0, 0)].abs();
        let mass = 10.0_f64.powf(sample.number());
        rows.scale_mut(1.0 / mass.sqrt());
        let mut motion = sample.matrix(freedoms, 1);
        motion[0] = -motion[0].abs();
        let mu = 0.6 + 0.4 * sample.number();
        let off = 10.0_f64.powf(-14.5 + 1.5 * sample.number());
        let w = rows.transpose() * motion + sample.matrix(3, 1) * off;
        let w = w.column(0).into_owned();
        let w_matrix = rows.transpose() * &rows;
        let cones = [Cone::Friction { coefficient: mu }];
        let (mut solver, mut lambda, errors) = (ConeSolver::default(), [0.0; 3], [2.0 * off; 3]);
        let own = (w.as_slice(), &errors[..]);
        match solver.solve_within(&cones, w_matrix.as_slice(), own, &mut lambda) {
            Ok(_) => {
                let size = DVector::from_row_slice(&lambda).amax();
                jams += usize::from(size > 0.0);
                largest = largest.max(size * w_matrix.diagonal().amax() / w.amax());
            }
            Err(fault) => failed.push((seed, fault)),
        }
    }
    println!("{jams} jam, impulses up to {largest:.1e} of the motion, failed {failed:?}");
    assert!(jams > 1000 && largest < 1e4 && failed.is_empty(), "{largest:e} {failed:?}");
}

/// Where the one motion that opens the contacts moves the largest mass, a solution may be out of
/// reach; that ends with an error.
#[test]
fn masses_of_a_ratio_of_1e8_stand_side_by_side() {
    solve_many(1000, 24, 1e8, 1.0, 2);
}

/// The rod of Painlevé at 1 rad slides at 3 m/s into its inclination, `W_NN − μW_NT < 0`: an impact
/// without collision. The tip sticks: the impulse is that which stops it.
#[test]
fn a_sliding_rod_is_stopped_by_an_impact_without_collision() {
    let (x, z) = (0.5 * 1.0_f64.cos(), 0.5 * 1.0_f64.sin()); // centre above the tip
    let inertia = 1.0 / 12.0;
    let coupling = -x * z / inertia;
    let w_matrix = dmatrix![
        1.0 + x * x / inertia, coupling, 0.0;
        coupling, 1.0 + z * z / inertia, 0.0;
        0.0, 0.0, 4.0
    ];
    assert!((w_matrix[(0, 0)] + 2.0 * w_matrix[(0, 1)] + 0.852_112_535_297_759).abs() < 1e-14);
    let w = dvector![-1e-9, -3.0, 0.0];
    let problem = Problem { cones: vec![Cone::Friction { coefficient: 2.0 }], w_matrix, w };
    let mut lambda = DVector::zeros(3);
    problem.solve(&mut lambda).unwrap();
    println!("{lambda}");
    // the impulse of an analytic solution, published digits; the approach of 1e-9 m/s added
    assert!((lambda[0] - 1.022_959_605_178_892).abs() < 2e-9, "{}", lambda[0]);
    assert!((lambda[1] - 1.406_834_808_884_464_9).abs() < 2e-9, "{}", lambda[1]);
    assert!(problem.violation(&lambda) < 1e-14);
}

/// A block on one contact: impulses and velocities in closed form.
#[test]
fn one_contact_opens_sticks_or_slips() {
    let solve = |coefficient: f64, w: [f64; 3]| {
        let cones = vec![Cone::Friction { coefficient }];
        let w_matrix = DMatrix::identity(3, 3) * 0.5;
        let problem = Problem { cones, w_matrix, w: DVector::from_row_slice(&w) };
        let mut lambda = DVector::zeros(3);
        problem.solve(&mut lambda).unwrap();
        Vector3::new(lambda[0], lambda[1], lambda[2])
    };
    assert_eq!(solve(0.3, [0.1, 1.0, 2.0]), Vector3::zeros());
    let stuck = solve(0.8, [-5.0, 1.2, -1.6]);
    assert!((stuck - Vector3::new(10.0, -2.4, 3.2)).norm() < 1e-14, "{stuck}");
    let slipping = solve(0.3, [-5.0, 1.2, -1.6]);
    assert!((slipping - Vector3::new(10.0, -1.8, 2.4)).norm() < 1e-14, "{slipping}");
    let smooth = solve(0.0, [-5.0, 1.2, -1.6]);
    assert!((smooth - Vector3::new(10.0, 0.0, 0.0)).norm() < 1e-14, "{smooth}");
}

/// Slip of a coupled contact: the friction is against the velocity after the impulse, which has
/// another direction than that before.
#[test]
fn slip_turns_by_the_coupling() {
    let w_matrix = Matrix3::new(2.0, 0.3, -0.4, 0.3, 1.5, 0.2, -0.4, 0.2, 1.0);
    let w = Vector3::new(-1.0, 3.0, 1.0);
    let mu = 0.4;
    // Λ_N and the direction of slip by a fixed point
    let (mut normal, mut e) = (0.0, Vector3::new(0.0, 1.0, 0.0));
    for _ in 0..200 {
        let along = Vector3::new(1.0, -mu * e[1], -mu * e[2]);
        normal = -w[0] / (w_matrix * along)[0];
        let y = w_matrix * along * normal + w;
        e = Vector3::new(0.0, y[1], y[2]).normalize();
    }
    let expected = normal * Vector3::new(1.0, -mu * e[1], -mu * e[2]);
    let problem = Problem {
        cones: vec![Cone::Friction { coefficient: mu }],
        w_matrix: DMatrix::from_column_slice(3, 3, w_matrix.as_slice()),
        w: DVector::from_column_slice(w.as_slice()),
    };
    let mut lambda = DVector::zeros(3);
    problem.solve(&mut lambda).unwrap();
    let found = Vector3::new(lambda[0], lambda[1], lambda[2]);
    assert!((found - expected).norm() < 1e-14, "{found} {expected}");
}

/// Dry friction of joints: it holds up to the bound, beyond it acts against the motion, and without
/// mass behind it the sign of the motion alone decides.
#[test]
fn friction_of_a_joint_holds_up_to_its_bound() {
    let solve = |bound: f64, inverse_mass: f64, w: f64| {
        let (cones, w_matrix) = (vec![Cone::Bounded { bound }], dmatrix![inverse_mass]);
        let mut lambda = dvector![0.0];
        Problem { cones, w_matrix, w: dvector![w] }.solve(&mut lambda).unwrap();
        lambda[0]
    };
    assert_eq!(solve(1.0, 0.5, 0.4), -0.8);
    assert_eq!(solve(0.25, 0.5, 0.4), -0.25);
    assert_eq!(solve(0.25, 0.5, -0.4), 0.25);
    assert_eq!(solve(0.25, 0.0, 1e-3), -0.25);
    assert_eq!(solve(0.0, 0.5, 1.0), 0.0);
}

/// Three equal balls touch, the first one hits: `(−1/3, 2/3, 2/3)` of its speed for `e = 1`.
#[test]
fn a_touching_cradle_shares_the_impact() {
    let cones = vec![Cone::Normal; 2];
    let w_matrix = dmatrix![2.0, -1.0; -1.0, 2.0];
    let mut lambda = DVector::zeros(2);
    Problem { cones, w_matrix, w: dvector![-2.0, 0.0] }.solve(&mut lambda).unwrap();
    let speeds = [1.0 - lambda[0], lambda[0] - lambda[1], lambda[1]];
    let expected = [-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    assert!((0..3).all(|i| (speeds[i] - expected[i]).abs() < 1e-15), "{speeds:?}");
}

/// Masses of 1 and 10⁸ stand on one another alternately; the ground bears their weight.
#[test]
fn a_stack_of_light_and_heavy_blocks_rests() {
    let count = 20;
    let mass = |k: usize| if k.is_multiple_of(2) { 1.0 } else { 1e8 };
    let mut w_matrix = DMatrix::zeros(count, count);
    for k in 0..count {
        w_matrix[(k, k)] = 1.0 / mass(k) + if k > 0 { 1.0 / mass(k - 1) } else { 0.0 };
        if k > 0 {
            w_matrix[(k, k - 1)] = -1.0 / mass(k - 1);
            w_matrix[(k - 1, k)] = -1.0 / mass(k - 1);
        }
    }
    let mut w = DVector::zeros(count);
    w[0] = -1.0; // all of them fall at the same speed
    let problem = Problem { cones: vec![Cone::Normal; count], w_matrix, w };
    let mut lambda = DVector::zeros(count);
    problem.solve(&mut lambda).unwrap();
    let mut above = 0.0;
    for k in (0..count).rev() {
        above += mass(k);
        let error = (lambda[k] - above).abs() / above;
        let known = 1e8 * f64::EPSILON; // what is left of a heavy mass beside a light one in W
        assert!(error < count as f64 * known, "block {k}: {error:e}");
    }
    println!("laws to {:.1e}", problem.violation(&lambda));
    assert!(problem.violation(&lambda) < 1e-13);
}

/// Two prescribed bodies press a third one: nothing opens both contacts, the error names them.
#[test]
fn a_wedged_body_is_named() {
    let cones = vec![Cone::Normal, Cone::Bounded { bound: 0.1 }, Cone::Normal, Cone::Normal];
    let w_matrix = dmatrix![
        1.0, 0.0, -1.0, 0.0;
        0.0, 1.0, 0.0, 0.0;
        -1.0, 0.0, 1.0, 0.0;
        0.0, 0.0, 0.0, 2.0
    ];
    let problem = Problem { cones, w_matrix, w: dvector![-0.5, 0.3, -0.5, -1.0] };
    let mut lambda = DVector::zeros(4);
    let fault = problem.solve(&mut lambda).unwrap_err();
    assert!(matches!(fault, ConeFault::Wedged { .. }), "{fault}");
    assert!((lambda - dvector![1.0, 0.0, 1.0, 0.0]).norm() < 1e-9);
    // a prescribed body runs into the ground
    let (cones, w_matrix) = (vec![Cone::Normal; 2], dmatrix![1.0, 0.0; 0.0, 0.0]);
    let fault = Problem { cones, w_matrix, w: dvector![-1.0, -0.2] }.solve(&mut dvector![0.0, 0.0]);
    assert_eq!(fault, Err(ConeFault::Wedged { cone: 1 }));
    // and one that moves away from it, or touches it but for rounding, does not
    for w in [0.2, -1e-15] {
        let (cones, w_matrix) = (vec![Cone::Normal; 2], dmatrix![1.0, 0.0; 0.0, 0.0]);
        Problem { cones, w_matrix, w: dvector![-1.0, w] }.solve(&mut dvector![0.0, 0.0]).unwrap();
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let solve = |entry: f64, bound: f64| {
        let (cones, w_matrix) = (vec![Cone::Bounded { bound }], dmatrix![entry]);
        Problem { cones, w_matrix, w: dvector![1.0] }.solve(&mut dvector![0.0])
    };
    assert_eq!(solve(f64::NAN, 1.0), Err(ConeFault::NotFinite));
    assert_eq!(solve(1.0, f64::INFINITY), Err(ConeFault::NotFinite));
    assert_eq!(solve(1.0, f64::NAN), Err(ConeFault::NotFinite));
}

/// Problems of any size below the largest one so far take no memory, and leave nothing behind: the
/// bits are those of a new solver.
#[test]
fn a_solver_takes_no_memory_twice_and_remembers_nothing() {
    let mut sample = Sample::new(7);
    let problems: Vec<_> = (0..40)
        .map(|_| {
            let cones = some_cones(&mut sample, 6, 1.0);
            random(&mut sample, cones, 6, 10.0)
        })
        .collect();
    let mut solver = ConeSolver::default();
    let mut solutions: Vec<_> = problems.iter().map(|p| DVector::zeros(p.w.len())).collect();
    let mut run = |solutions: &mut Vec<DVector<f64>>| {
        for (problem, lambda) in problems.iter().zip(solutions) {
            lambda.fill(0.0);
            let (matrix, w) = (problem.w_matrix.as_slice(), problem.w.as_slice());
            solver.solve(&problem.cones, matrix, w, lambda.as_mut_slice()).unwrap();
        }
    };
    run(&mut solutions);
    let before = allocations();
    run(&mut solutions);
    assert_eq!(allocations() - before, 0);
    for (problem, lambda) in problems.iter().zip(&solutions) {
        let mut alone = DVector::zeros(lambda.len());
        problem.solve(&mut alone).unwrap();
        assert_eq!(&alone, lambda);
    }
}

/// Boxes on one another on a slope, four contacts each: they rest, hyperstatic, for any `μ` above
/// the slope, also where single contacts stand on the rims of their cones, and where every second
/// box is a hundred times heavier.
#[test]
fn a_stack_of_boxes_rests_on_a_slope() {
    for (count, coefficient, slope, ratio) in [
        (3, 0.3, 0.15_f64, 1.0),
        (3, 0.152, 0.15, 1.0),
        (6, 0.3, 0.15, 1.0),
        (4, 0.3, 0.29, 1.0),
        (10, 0.3, 0.15, 1.0),
        (10, 0.3, 0.15, 100.0),
        (10, 0.5, 0.0, 100.0),
    ] {
        let root = |body: usize| if body % 2 == 1 { f64::sqrt(ratio) } else { 1.0 };
        let (side, height) = (0.2, 0.1);
        let mut rows = DMatrix::<f64>::zeros(6 * count, 12 * count);
        let mut free = DVector::zeros(6 * count);
        let inertia = |a: f64, b: f64| (a * a + b * b) / 12.0;
        let spin = [inertia(side, height), inertia(side, height), inertia(side, side)];
        for body in 0..count {
            free[6 * body] = 0.1 * slope.sin() * root(body);
            free[6 * body + 2] = -0.1 * slope.cos() * root(body);
            for corner in 0..4 {
                let sign = |bit: usize| if corner >> bit & 1 == 1 { 0.5 } else { -0.5 };
                for (i, direction) in [Vector3::z(), Vector3::x(), Vector3::y()].iter().enumerate()
                {
                    let column = 12 * body + 3 * corner + i;
                    for (of, level, factor) in
                        [(body, -0.5, 1.0), (body.wrapping_sub(1), 0.5, -1.0)]
                    {
                        if of >= count {
                            continue; // the ground
                        }
                        let factor = factor / root(of);
                        let arm = Vector3::new(sign(0) * side, sign(1) * side, level * height);
                        let torque = arm.cross(direction);
                        for k in 0..3 {
                            rows[(6 * of + k, column)] += factor * direction[k];
                            rows[(6 * of + 3 + k, column)] += factor * torque[k] / spin[k].sqrt();
                        }
                    }
                }
            }
        }
        let problem = Problem {
            cones: vec![Cone::Friction { coefficient }; 4 * count],
            w_matrix: rows.transpose() * &rows,
            w: rows.transpose() * &free,
        };
        let mut lambda = DVector::zeros(12 * count);
        let rounds = problem.solve(&mut lambda).unwrap();
        let moved = (free + rows * &lambda).amax();
        println!(
            "{count} boxes: {rounds} rounds, {moved:.1e}, laws {:.1e}",
            problem.violation(&lambda)
        );
        let known = 1e-14 * ratio * count as f64;
        assert!(moved < known, "{count} boxes move by {moved:e}");
        assert!(problem.violation(&lambda) < 1e-12);
    }
}
