//! Small vibrations: frequencies of a cantilever against the beam theories, six rigid modes of a
//! free beam, the frequency a time step shows.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::straight;
use nalgebra::Vector3;
use vi_beam::model::BeamModel;
use vi_beam::section_force::{SectionState, center_line, section_states};
use vi_beam::{Beam, Section};
use vi_statics::StaticSettings;
use vi_statics::modes;

fn section() -> Section {
    Section::new([5000.0, 5000.0, 2e4, 2.0, 3.0, 2.0], [1.0, 1.5e-4, 1e-4, 0.0]).unwrap()
}

fn cantilever(elements: usize) -> (BeamModel, Beam) {
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("beam", &straight(1.0, elements), section()).unwrap();
    model.clamp(0);
    (model, beam)
}

#[test]
fn frequencies_of_a_cantilever() {
    let first = |elements: usize| {
        let (model, _) = cantilever(elements);
        let mut problem = common::problem(&model, &model.mechanism(), vec![]);
        modes(&mut problem).unwrap().omega[0]
    };
    let omega = first(16);
    let error = omega / 4.968986952218165 - 1.0; // reference case 03
    println!("first frequency {omega:.12} (16 elements), relative deviation {error:.1e}");
    assert!(error.abs() < 1e-10, "{omega}");
    let exact = 4.96663042; // Timoshenko
    let errors: Vec<f64> = [8, 16, 32].iter().map(|&n| first(n) - exact).collect();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("errors {errors:?}, orders {orders:.3?}");
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.1), "{orders:?}");
}

#[test]
fn a_free_beam_has_six_rigid_modes() {
    let mut model = BeamModel::new(Vector3::zeros());
    model.add_beam("beam", &straight(1.0, 10), section()).unwrap();
    let mut problem = common::problem(&model, &model.mechanism(), vec![]);
    let found = modes(&mut problem).unwrap();
    let rigid = common::largest(found.squared[..6].iter().copied());
    println!("ω²: rigid {rigid:.1e}, first elastic {:.4}", found.squared[6]);
    // free-free Euler-Bernoulli: (4.730)² √(EI/ρA L⁴)
    assert!(rigid < 1e-4 && (found.omega[6] / 31.64 - 1.0).abs() < 0.02, "{:?}", found.omega[6]);
    let mass = model.mechanism().mass(|out| model.elements.emit_mass(out));
    for k in 0..found.omega.len() {
        let v = found.shapes.column(k).clone_owned();
        let norm = mass.bilinear(v.as_slice(), v.as_slice());
        assert!((norm - 1.0).abs() < 1e-9, "mode {k}: vᵀMv = {norm}");
    }
}

#[test]
fn section_forces_balance_the_load() {
    for order in 1..=3 {
        let mut model = BeamModel::new(Vector3::zeros());
        let mesh = straight(1.0, 18);
        let beam = match order {
            1 => model.add_beam("beam", &mesh, section()).unwrap(),
            order => model.add_high_order_beam("beam", &mesh, section(), order).unwrap(),
        };
        model.clamp(0);
        let force = Vector3::new(0.5, -0.3, 0.8);
        let loads = vec![common::dead(18, force)];
        let mut problem = common::problem(&model, &model.mechanism(), loads);
        problem.solve(&[1.0], &StaticSettings::default()).unwrap();
        let states = section_states(&model, &beam, problem.configuration());
        assert_eq!(states.len(), [18, 18, 18][order - 1]); // one, two, three for each element
        let off = |s: &SectionState| (Vector3::from(s.spatial_force) - force).norm();
        let worst = common::largest(states.iter().map(off));
        println!("order {order}: section force off the end load by {worst:.1e}");
        assert!(worst < 1e-9, "{worst:e}");
        let total: f64 = states.iter().map(|s| s.length).sum();
        assert!((total - 1.0).abs() < 1e-14, "{total}");
        assert!(states.windows(2).all(|s| s[0].arc_length < s[1].arc_length));
        let line = center_line(&model, &beam, problem.configuration(), 4);
        assert_eq!(line.len(), 4 * 18 + 1);
        let longest = common::largest(line.windows(2).map(|pair| (pair[1] - pair[0]).norm()));
        assert!(longest < 0.014, "{longest}");
    }
}

/// A slender beam whose spectrum spans twelve decades: rotary inertia of 1e-6 kg·m, 16 quadratic
/// elements.
#[test]
fn a_wide_spectrum_has_no_mode_that_is_not_there() {
    for (elements, order) in [(16, 2), (12, 3), (24, 1)] {
        let mut model = BeamModel::new(Vector3::zeros());
        let section = Section::new([1e6, 1e6, 1e6, 1.0, 1.0, 1.0], [1.0, 1e-6, 1e-6, 0.0]).unwrap();
        let mesh = straight(1.0, elements * order);
        if order == 1 {
            model.add_beam("beam", &mesh, section).unwrap();
        } else {
            model.add_high_order_beam("beam", &mesh, section, order).unwrap();
        }
        model.clamp(0);
        let mut problem = common::problem(&model, &model.mechanism(), vec![]);
        let found = modes(&mut problem).unwrap();
        let unstable = (0..found.squared.len()).filter(|&k| found.is_unstable(k)).count();
        let (span, residual) = (found.squared.last().unwrap() / found.squared[0], found.residual);
        let orthogonality = found.orthogonality;
        println!(
            "{elements} elements of order {order}: ω {:.6} … {:.3e} rad/s, residual {residual:.1e}, \
             orthogonality {orthogonality:.1e}",
            found.omega[0],
            found.omega.last().unwrap()
        );
        assert_eq!((unstable, found.negative), (0, Some(0)), "{:?}", &found.squared[..3]);
        assert!(span > 1e9 && residual < 1e-9 && orthogonality < 1e-6);
        // Euler–Bernoulli: (1.875104)² = 3.516015, twice
        let error = [0, 1].map(|k| (found.omega[k] / 3.516015 - 1.0).abs());
        assert!(error.iter().all(|error| *error < 2e-3), "{error:?}");
    }
}
