//! Impulses of many contacts, by proximal steps, obey Coulomb's law.

#![allow(non_snake_case)] // L

use crate::cone::Problem;
use nalgebra::{DMatrix, DVector, Vector3};
use vi_core::cone::{Cone, ConvexSolver, Repeated, SparseRows};
use vi_testkit::Sample;

/// Spheres in columns beside one another in a box without a lid; so many of 100 neighbours touch.
/// The columns of `M^−½ Bᵀ`, and the velocity of a fall.
fn bed(seed: u64, side: usize, layers: usize, neighbours: usize) -> (DMatrix<f64>, DVector<f64>) {
    const RADIUS: f64 = 0.05;
    let mut sample = Sample::new(seed);
    let count = side * side * layers;
    let id = |[x, y, z]: [usize; 3]| (z * side + y) * side + x;
    let mut contacts: Vec<(Option<usize>, usize, Vector3<f64>)> = Vec::new();
    for k in 0..count {
        let at = [k % side, k / side % side, k / (side * side)];
        for axis in 0..3 {
            let along = Vector3::from_fn(|i, _| f64::from(u8::from(i == axis)));
            let (below, is_beside) = (at[axis].checked_sub(1), axis < 2);
            let lean: Vector3<f64> = sample.vector();
            match below {
                None => contacts.push((None, k, along)),
                Some(_) if is_beside && sample.index(100) >= neighbours => {}
                Some(below) => {
                    let mut other = at;
                    other[axis] = below;
                    contacts.push((Some(id(other)), k, (along + 0.3 * lean).normalize()));
                }
            }
            if is_beside && at[axis] + 1 == side {
                contacts.push((None, k, -along));
            }
        }
    }
    let root = RADIUS * 0.4_f64.sqrt(); // of the moment of inertia over the mass
    let mut columns = DMatrix::zeros(6 * count, 3 * contacts.len());
    for (c, (a, b, normal)) in contacts.iter().enumerate() {
        let across = normal.cross(&Vector3::new(0.31, 0.72, -0.2)).normalize();
        for (i, direction) in [*normal, across, normal.cross(&across)].iter().enumerate() {
            for (body, sign) in [(*a, -1.0), (Some(*b), 1.0)] {
                let Some(body) = body else { continue };
                let turn = (-sign * RADIUS * normal).cross(direction) / root;
                let mut own = columns.view_mut((6 * body, 3 * c + i), (6, 1));
                own.rows_mut(0, 3).copy_from(&(sign * direction));
                own.rows_mut(3, 3).copy_from(&(sign * turn));
            }
        }
    }
    let fall = DVector::from_fn(6 * count, |i, _| if i % 6 == 2 { -0.05 } else { 0.0 });
    (columns, fall)
}

/// `L` of `W = L Lᵀ` in sparse rows: where each row ends, places and entries.
type Rows = (Vec<usize>, Vec<u32>, Vec<f64>);

fn sparse(columns: &DMatrix<f64>) -> Rows {
    let (mut ends, mut places, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..columns.ncols() {
        for j in (0..columns.nrows()).filter(|j| columns[(*j, i)] != 0.0) {
            places.push(j as u32);
            values.push(columns[(j, i)]);
        }
        ends.push(places.len());
    }
    (ends, places, values)
}

/// A bed whose motion is first seen roughly, then in passes that change it less and less: the
/// interior point method begins next to the impulses of the pass before, and is at the laws in few
/// steps.
#[test]
fn impulses_of_the_pass_before_lead_to_those_of_the_next_in_few_steps() {
    let (mut steps, mut passes, mut furthest) = (0, 0, 0.0_f64);
    for (seed, neighbours) in (77..80).flat_map(|seed| [(seed, 20), (seed, 40)]) {
        let (columns, mut fall) = bed(seed, 5, 5, neighbours);
        let (w_matrix, k) = (columns.tr_mul(&columns), columns.ncols());
        let cones = vec![Cone::Friction { coefficient: 0.3 }; k / 3];
        let (ends, places, values) = sparse(&columns);
        let L = SparseRows { ends: &ends, places: &places, values: &values };
        let mut sample = Sample::new(seed);
        let (mut solver, mut lambda) = (ConvexSolver::default(), DVector::zeros(k));
        let mut problem = Problem { cones, w_matrix, w: columns.tr_mul(&fall) };
        for (change, part) in [(0.0, 1e-2), (1e-2, 1e-5), (1e-4, 1e-6), (1e-5, 1e-7)] {
            let size = fall.amax();
            fall += sample.matrix(fall.len(), 1).column(0) * (change * size);
            problem.w = columns.tr_mul(&fall);
            let within = part * size;
            let repeated =
                Repeated { first: 1e3, within, enough: within, afresh: true, central: true };
            let (w, impulse) = (problem.w.as_slice(), lambda.as_mut_slice());
            let report = solver.follow(&problem.cones, L, w, repeated, impulse).unwrap();
            let laws = problem.violation(&lambda);
            println!("{k} rows, seed {seed}, to {part:e}: {report:?}, laws {laws:.1e}");
            assert!(report.left <= within, "{report:?}");
            if change > 0.0 {
                (steps, passes) = (steps + report.steps, passes + 1);
            }
            furthest = furthest.max(report.left / within);
        }
    }
    let mean = f64::from(u32::try_from(steps).unwrap()) / f64::from(passes);
    println!("{mean:.1} steps in the mean, laws to {furthest:.2} of what they may");
    assert!(mean < 5.0, "{mean} steps in the mean"); // from nowhere it takes some 15
}

/// Beds of few and of more contacts than degrees of freedom, from rest, from half of the impulses,
/// and from those of another motion.
#[test]
fn beds_of_spheres_obey_the_laws() {
    let sizes = [(3, 20), (4, 10), (5, 20), (4, 60)];
    let (mut worst, mut most, mut exact, mut all) = (0.0_f64, [0; 2], 0, 0);
    let mut steps_in_all = 0;
    for (seed, (side, neighbours)) in (77..80).flat_map(|seed| sizes.map(|size| (seed, size))) {
        let (columns, fall) = bed(seed, side, 5, neighbours);
        let (w_matrix, w) = (columns.tr_mul(&columns), columns.tr_mul(&fall));
        let k = w.len();
        assert!(k > 300, "{k} rows");
        let cones = vec![Cone::Friction { coefficient: 0.3 }; k / 3];
        let (ends, places, values) = sparse(&columns);
        let L = SparseRows { ends: &ends, places: &places, values: &values };
        let mut lambda = DVector::zeros(k);
        let mut solver = ConvexSolver::default();
        let mut problem = Problem { cones, w_matrix, w };
        let mut fall = fall;
        let mut sample = Sample::new(seed);
        for start in ["rest", "half", "another motion"] {
            if start == "another motion" {
                lambda *= 2.0;
                fall += sample.matrix(fall.len(), 1).column(0) * 0.03;
                problem.w = columns.tr_mul(&fall);
            }
            let (w, impulse) = (problem.w.as_slice(), lambda.as_mut_slice());
            let repeated = Repeated {
                first: 10.0,
                within: 1e-13,
                enough: 1e-13,
                afresh: true,
                central: false,
            };
            let mut follow = || {
                let report = solver.follow(&problem.cones, L, w, repeated, impulse).unwrap();
                steps_in_all += report.steps;
                report
            };
            let mut report = follow();
            for _ in 0..4 {
                if report.left > 1e-13 {
                    report = follow();
                }
            }
            let (moved, laws) = (&fall + &columns * &lambda, problem.violation(&lambda));
            println!("{k} rows, from {start}: {report:?}, laws {laws:.1e}");
            assert!(moved.norm() <= fall.norm(), "it gains energy");
            worst = worst.max(laws);
            (exact, all) = (exact + usize::from(laws < 1e-10), all + 1);
            most = [most[0].max(report.rounds), most[1].max(report.steps)];
            lambda *= 0.5;
        }
    }
    let [rounds, steps] = most;
    println!("laws {worst:.1e}, {exact} of {all} to 1e-10; {rounds} rounds, {steps} steps");
    println!("{steps_in_all} steps in all");
    assert!(worst < 1e-4 && exact >= 33, "{worst:e}, {exact} of {all}");
    assert!(steps_in_all < 4000, "{steps_in_all}"); // a solution from nowhere takes some 25
}
