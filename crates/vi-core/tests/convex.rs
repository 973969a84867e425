//! Proximal steps to the convex laws of contacts: impulses in their cones, velocities in the dual
//! ones, orthogonal, unique; with the speed of slip they are those of Coulomb's law.
#![allow(non_snake_case)] // L, W

use crate::cone::Problem;
use nalgebra::{DMatrix, DVector};
use vi_core::cone::{Cone, ConeFault, ConeSolver, ConvexSolver, SparseRows};
use vi_testkit::Sample;

/// `L`, the laws and `w`, of bodies that touch at more points than they have freedoms.
struct Touching {
    factor: DMatrix<f64>,
    cones: Vec<Cone>,
    w: DVector<f64>,
}

impl Touching {
    /// Of `contacts` with friction, a contact without, and a joint with dry friction; `r` freedoms.
    fn new(seed: u64, contacts: usize, r: usize) -> Self {
        let mut sample = Sample::new(seed);
        let mut cones = vec![Cone::Normal, Cone::Bounded { bound: 0.2 }];
        for _ in 0..contacts {
            let coefficient = 0.1 + 0.1 * sample.index(12) as f64;
            cones.push(Cone::Convex { coefficient, speed: 0.02 * sample.index(8) as f64 });
        }
        let k = cones.iter().map(Cone::rows).sum();
        // velocities that some motion of the bodies stops
        let factor = sample.matrix(k, r);
        let w = &factor * sample.matrix(r, 1).column(0);
        Self { factor, cones, w }
    }

    fn velocity(&self, lambda: &[f64]) -> DVector<f64> {
        &self.factor * self.factor.tr_mul(&DVector::from_column_slice(lambda)) + &self.w
    }

    /// Steps from `lambda` with growing `ρ`, and the most steps of Newton's method of one.
    fn solve(&self, solver: &mut ConvexSolver, lambda: &mut [f64]) -> usize {
        let (k, r) = self.factor.shape();
        let ends: Vec<usize> = (1..=k).map(|i| i * r).collect();
        let places: Vec<u32> = (0..k * r).map(|i| (i % r) as u32).collect();
        let values: Vec<f64> = self.factor.transpose().as_slice().to_vec();
        let L = SparseRows { ends: &ends, places: &places, values: &values };
        let steps = (0..60).map(|step| {
            let rho = 10_f64.powi(1 + step.min(4));
            let given = lambda.to_vec();
            solver.step(&self.cones, L, self.w.as_slice(), rho, &given, lambda).unwrap().steps
        });
        steps.max().unwrap()
    }
}

#[test]
fn impulses_and_velocities_are_in_dual_cones_and_orthogonal() {
    let (mut solver, mut worst, mut apart, mut most) =
        (ConvexSolver::default(), 0.0_f64, 0.0_f64, 0);
    for seed in 0..60 {
        let problem = Touching::new(seed, 2 + (seed as usize % 9), 6 + (seed as usize % 7));
        let k = problem.w.len();
        let mut from_rest = vec![0.0; k];
        most = most.max(problem.solve(&mut solver, &mut from_rest));
        let y = problem.velocity(&from_rest);
        let w_matrix = &problem.factor * problem.factor.transpose();
        let laws = Problem { cones: problem.cones.clone(), w_matrix, w: problem.w.clone() };
        worst = worst.max(laws.violation(&DVector::from_column_slice(&from_rest)));
        let mut sample = Sample::new(1000 + seed);
        let mut elsewhere: Vec<f64> =
            sample.matrix(k, 1).as_slice().iter().map(|x| 3.0 * x).collect();
        problem.solve(&mut solver, &mut elsewhere);
        apart = apart.max((problem.velocity(&elsewhere) - &y).amax() / problem.w.amax());
    }
    println!("laws {worst:.1e}, velocities apart {apart:.1e}, steps {most}");
    assert!(worst < 1e-9 && apart < 1e-7, "{worst:e} {apart:e}");
}

/// One contact, with impulses that are unique: `s = μ|y_T|` gives Coulomb's law.
#[test]
fn the_speed_of_slip_leads_to_coulombs_law() {
    let mut worst = 0.0_f64;
    let mut slides = 0;
    for seed in 0..40 {
        let mut sample = Sample::new(seed);
        let factor = sample.matrix(3, 3) + DMatrix::identity(3, 3) * 2.0;
        let (mu, w) = (0.3, DVector::from_column_slice(&[-1.0, 0.3 * (seed % 3) as f64, 0.05]));
        let W = &factor * factor.transpose();
        let mut exact = [0.0; 3];
        let law = [Cone::Friction { coefficient: mu }];
        ConeSolver::default().solve(&law, W.as_slice(), w.as_slice(), &mut exact).unwrap();
        let speed = mu * {
            let y = &W * DVector::from_column_slice(&exact) + &w;
            y[1].hypot(y[2])
        };
        slides += usize::from(speed > 1e-9);
        let problem = Touching { factor, cones: vec![Cone::Convex { coefficient: mu, speed }], w };
        let mut lambda = [0.0; 3];
        problem.solve(&mut ConvexSolver::default(), &mut lambda);
        let apart = (0..3).map(|i| (lambda[i] - exact[i]).abs()).fold(0.0, f64::max);
        worst = worst.max(apart / exact[0].abs().max(1e-3));
    }
    println!("{slides} of 40 slide, impulses apart {worst:.1e}");
    assert!(worst < 1e-9 && (5..35).contains(&slides), "{worst:e} {slides}");
}

#[test]
fn what_is_no_number_is_refused() {
    let L = SparseRows { ends: &[1], places: &[0], values: &[1.0] };
    let mut lambda = [0.0];
    let (w, given) = (&[f64::NAN], &[0.0]);
    let out = ConvexSolver::default().step(&[Cone::Normal], L, w, 1.0, given, &mut lambda);
    assert_eq!(out, Err(ConeFault::NotFinite));
}
