//! Reactions where constraints are redundant: which parts are unique, multipliers of the least
//! norm, flat positions.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{model, nodes, simulation};
use holonom::vi_constraints::Constraints;
use holonom::vi_core::{Configuration, Entries, SparseMatrix};
use holonom::{Model, Simulation};
use nalgebra::{DMatrix, DVector};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::{BarTension, Reaction, ReactionObserver, Reactions};
use vi_multibody::run::MechanismIntegrator;

const FOUR_BAR: &str = include_str!("../models/four_bar.toml");

/// An orthonormal basis of `null Gᵀ`, by a singular value decomposition.
fn null_vectors(mechanism: &Mechanism, q: &[f64]) -> Vec<Vec<f64>> {
    let (n, m) = (mechanism.dim(), mechanism.len());
    let mut g = DMatrix::zeros(m, n);
    mechanism.jacobian(0.0, q, &mut g);
    let gram = (&g * g.transpose()).symmetric_eigen();
    let small = (0..m).filter(|&k| gram.eigenvalues[k].abs() < 1e-12);
    small.map(|k| gram.eigenvectors.column(k).iter().copied().collect()).collect()
}

#[test]
fn in_the_plane_of_a_four_bar_reactions_are_unique_across_it_they_are_not() {
    let model = Model::from_toml(FOUR_BAR).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    assert_eq!(simulation.assembly().counts.redundant_constraints, 3);
    let run = simulation.integrator();
    for _ in 0..20 {
        run.step().unwrap();
    }
    let lambda = run.node_before().unwrap().lambda.clone();
    let (t, q) = (run.before().t, run.before().q.clone());
    let reactions =
        Reactions::at(run.constraints(), Configuration::new(t, &q), &lambda, run.rows());
    // other multipliers of the same constraint force
    let others = null_vectors(run.constraints(), &q);
    assert_eq!(others.len(), 3);
    let mut mixed = lambda.clone();
    for (z, factor) in others.iter().zip([3.0, -2.0, 5.0]) {
        mixed.iter_mut().zip(z).for_each(|(l, z)| *l += factor * z);
    }
    let again = Reactions::at(run.constraints(), Configuration::new(t, &q), &mixed, run.rows());
    for (k, (one, other)) in reactions.joints.iter().zip(&again.joints).enumerate() {
        // joint frame: m_1, m_2 in the plane, n across
        assert_eq!(one.unique, [true, true, false, false, false, true], "joint {k}");
        assert!(!one.is_unique());
        for (i, (a, b)) in one.components().into_iter().zip(other.components()).enumerate() {
            if let (Some(a), Some(b)) = (a, b) {
                assert!((a - b).abs() < 1e-9, "joint {k}, component {i}: {a} against {b}");
            }
        }
        let across = (one.force.z - other.force.z).abs() + (one.moment - other.moment).amax();
        assert!(across > 1e-3, "joint {k}: {across:e}");
        assert!(one.force.xy().norm() > 1.0, "the plane carries the weight");
    }
}

/// Multipliers of the least norm are orthogonal to `null Gᵀ`, and unique is what no vector of it
/// changes.
#[test]
fn multipliers_of_loops_have_no_part_in_the_null_space() {
    for name in ["four_bar_windows", "bricard", "six_hinge_cube", "andrews_squeezer"] {
        let mut simulation = simulation(name, &[]);
        let run = simulation.integrator();
        (0..20).for_each(|_| _ = run.step().unwrap());
        let node = run.node_before().unwrap().clone();
        let q = run.before().q.clone();
        let at = Configuration::new(run.before().t, &q);
        let mechanism = run.constraints();
        let null = null_vectors(mechanism, &q);
        let size = node.lambda.iter().map(|l| l * l).sum::<f64>().sqrt();
        let part =
            |z: &Vec<f64>| z.iter().zip(&node.lambda).map(|(z, l)| z * l).sum::<f64>() / size;
        let largest = null.iter().map(|z| part(z).abs()).fold(0.0, f64::max);
        let mut force = vec![0.0; q.len()];
        let g = SparseMatrix::assemble(mechanism.len(), q.len(), |out: &mut dyn Entries| {
            mechanism.jacobian(at.t, &q, out);
        });
        g.tr_mul_add(1.0, &node.lambda, &mut force);
        let w = force.iter().zip(&node.constraint_force).map(|(a, b)| (a - b).abs());
        let missed = w.fold(0.0, f64::max);
        println!(
            "{name}: {} null vectors, largest part {largest:.1e}, force {missed:.1e}",
            null.len()
        );
        assert!(!null.is_empty() && largest < 1e-10 && missed < 1e-10 * size, "{name}");
        // a large part of each null vector, one after the other
        let found = Reactions::at(mechanism, at, &node.lambda, run.rows());
        let mut unique = vec![[true; 6]; found.joints.len()];
        for z in &null {
            let mixed: Vec<f64> = node.lambda.iter().zip(z).map(|(l, z)| l + size * z).collect();
            let other = Reactions::at(mechanism, at, &mixed, run.rows());
            for (unique, (a, b)) in unique.iter_mut().zip(found.joints.iter().zip(&other.joints)) {
                for k in 0..3 {
                    unique[k] &= (a.force[k] - b.force[k]).abs() < 1e-8 * size;
                    unique[3 + k] &= (a.moment[k] - b.moment[k]).abs() < 1e-8 * size;
                }
            }
        }
        let marked: Vec<[bool; 6]> = found.joints.iter().map(|joint| joint.unique).collect();
        assert_eq!(marked, unique, "{name}");
    }
}

/// All reactions of a node, joints, bars, scalar constraints; `None` where a number is not unique.
fn numbers(joints: &[Reaction], bars: &[BarTension], scalars: &[BarTension]) -> Vec<Option<f64>> {
    let of_joints = joints.iter().flat_map(Reaction::components);
    let of_rows = bars.iter().chain(scalars).map(|row| row.unique.then_some(row.force));
    of_joints.chain(of_rows).collect()
}

/// Largest difference between reactions that follow from the constraint force of the node before
/// and from its multipliers, relative to the largest multiplier; and how many are unique.
fn apart(run: &mut MechanismIntegrator, observer: &mut ReactionObserver) -> (f64, usize) {
    let node = run.node_before().unwrap().clone();
    let at = run.before().configuration();
    let mechanism = run.constraints();
    let expected = Reactions::at(mechanism, at, &node.lambda, run.rows());
    let found = observer.observe(mechanism, at, &node.constraint_force, run.rows());
    let scalars = 0..mechanism.description().scalars.len();
    let rows = scalars.flat_map(|k| mechanism.scalar_rows(k));
    let scalars: Vec<BarTension> = rows.map(|row| found.scalar_row(row)).collect();
    let joints: Vec<Reaction> = (0..expected.joints.len()).map(|k| found.joint(k)).collect();
    let bars: Vec<BarTension> = (0..expected.bars.len()).map(|k| found.bar(k)).collect();
    let one = numbers(&joints, &bars, &scalars);
    let other = numbers(&expected.joints, &expected.bars, &expected.scalars);
    let size = node.lambda.iter().fold(0.0_f64, |size, lambda| size.max(lambda.abs()));
    let (mut off, mut unique) = (0.0_f64, 0);
    for (i, pair) in one.iter().zip(&other).enumerate() {
        match pair {
            (Some(a), Some(b)) => {
                let apart = (a - b).abs() / size;
                off = if apart <= off { off } else { apart };
                unique += 1;
            }
            (None, None) => {}
            _ => panic!("t = {}: unique in one way only: number {i}, {pair:?}", at.t),
        }
    }
    (off, unique)
}

/// What joints transmit follows from the constraint force and the multipliers of the closures
/// alone.
#[test]
fn reactions_of_the_constraint_force_are_those_of_the_multipliers() {
    let names = "heavy_top gyroscope chain8 panda quadruped slider_crank bricard six_hinge_cube four_bar_windows \
                 andrews_squeezer strandbeest scissor_mast stewart_platform flexible_four_bar \
                 flexible_slider_crank satellite four_particles whirling_shaft";
    for name in names.split_whitespace() {
        let mut simulation = simulation(name, &[("simulation.end", "1e3".to_owned())]);
        let run = simulation.integrator();
        (0..20).for_each(|_| _ = run.step().unwrap());
        let (off, unique) = apart(run, &mut ReactionObserver::new(run.constraints()));
        println!("{name}: {unique} unique, off by {off:.1e}");
        assert!(off < 1e-11, "{name}: {off:e}");
    }
}

/// Where the links of the windows lie in one line, multipliers grow like one over their angle, and
/// so does the rounding of both ways.
#[test]
fn reactions_in_flat_positions_are_those_of_the_multipliers() {
    let mut simulation = simulation("four_bar_windows", &[]);
    let run = simulation.integrator();
    let mut observer = ReactionObserver::new(run.constraints());
    let (mut largest, mut flat) = (0.0_f64, f64::INFINITY);
    for _ in 0..3000 {
        run.step().unwrap();
        let (off, _) = apart(run, &mut observer);
        largest = if off <= largest { largest } else { off };
        let q = &run.before().q; // the axis of the first crank against the ground
        flat = flat.min(q[1].atan2(q[0]).abs());
    }
    println!("down to {flat:.1e} rad from a flat position, largest difference {largest:.1e}");
    assert!(flat < 1e-2 && largest < 1e-9, "{flat:e}, {largest:e}");
}

const SQUARE: &str = include_str!("../models/square.toml");

/// In a flat position a parallelogram loses one more row, and a force may have a part along the
/// motion that is free there alone: no constraint exerts it.
#[test]
fn reactions_of_a_flat_parallelogram_leave_out_what_no_constraint_exerts() {
    let mut simulation = Simulation::new(&Model::from_toml(SQUARE).unwrap()).unwrap();
    let run = simulation.integrator();
    let mechanism = run.constraints();
    let side = |x: f64| [x, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let upper = [1.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let q = [side(0.5), upper, side(1.5)].concat();
    let (m, n) = (mechanism.len(), mechanism.dim());
    let mut g = vec![1.0_f64; m];
    mechanism.value(Configuration::new(0.0, &q), &mut g);
    assert!(g.iter().all(|g| g.abs() < 1e-15), "{g:?}");
    assert_eq!(null_vectors(mechanism, &q).len(), m - run.rows().len() + 1, "one row more");
    let mut jacobian = DMatrix::zeros(m, n);
    mechanism.jacobian(0.0, &q, &mut jacobian);
    let lambda = DVector::from_fn(m, |i, _| 5.0 * (1.7 * i as f64).sin());
    // turning both sides and nothing else is a motion here, turning the upper bar with the right
    // one another
    let gram = (jacobian.transpose() * &jacobian).symmetric_eigen();
    let free: Vec<usize> = (0..n).filter(|&k| gram.eigenvalues[k].abs() < 1e-12).collect();
    assert_eq!(free.len(), 2);
    for part in [0.0, 1.0] {
        let mut force = jacobian.tr_mul(&lambda);
        free.iter().for_each(|&k| force += part * gram.eigenvectors.column(k));
        let at = Configuration::new(0.0, &q);
        let mut observer = ReactionObserver::new(mechanism);
        let found = observer.observe(mechanism, at, force.as_slice(), run.rows());
        let expected = Reactions::at(mechanism, at, lambda.as_slice(), run.rows());
        let (mut off, mut unique) = (0.0_f64, 0);
        for (k, expected) in expected.joints.iter().enumerate() {
            let pairs = found.joint(k).components().into_iter().zip(expected.components());
            for pair in pairs {
                let (Some(found), Some(expected)) = pair else {
                    assert_eq!(pair, (None, None), "joint {k}: unique in one way only");
                    continue;
                };
                let apart = (found - expected).abs();
                off = if apart <= off { off } else { apart };
                unique += 1;
            }
        }
        println!("part {part}: {unique} unique, off by {off:.1e}");
        assert!(off < 1e-13 && unique == 8, "{unique}, {off:e}");
    }
}

/// The linkage moves in the plane of `x` and `z`: what acts there is unique also along the axes of
/// space.
#[test]
fn reactions_of_a_plane_linkage_are_unique_in_its_plane_along_the_axes_of_space() {
    let samples = nodes(&model("strandbeest", &[("simulation.end", "0.01".to_owned())]));
    let last = samples.last().unwrap();
    let hip = &last.sensors[last.sensors.len() - 7..];
    println!("{hip:?}");
    let given: Vec<bool> = hip[..6].iter().map(|x| x.is_finite()).collect();
    assert_eq!(given, [true, false, true, false, true, false]);
    assert!(hip[6] < 0.5, "not all are unique");
}
