//! Small vibrations: frequencies of a cantilever against the beam theories, six rigid modes of a
//! free beam, the frequency a time step shows.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::straight;
use nalgebra::Vector3;
use vi_beam::model::BeamModel;
use vi_beam::section_force::{SectionState, center_line, section_states};
use vi_beam::{Beam, ElementKind, Material, Profile, Section, Stated};
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
    for kind in [ElementKind::MeanDirectors, ElementKind::Helicoidal] {
        let mut model = BeamModel::new(Vector3::zeros());
        let beam = common::beam(&mut model, &straight(1.0, 18), section(), kind);
        model.clamp(0);
        let force = Vector3::new(0.5, -0.3, 0.8);
        let loads = vec![common::dead(18, force)];
        let mut problem = common::problem(&model, &model.mechanism(), loads);
        problem.solve(&[1.0], &StaticSettings::default()).unwrap();
        let states = section_states(&model, &beam, problem.configuration());
        assert_eq!(states.len(), 18);
        let off = |s: &SectionState| (Vector3::from(s.spatial_force) - force).norm();
        let worst = common::largest(states.iter().map(off));
        println!("{kind:?}: section force off the end load by {worst:.1e}");
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

/// A slender beam whose squared frequencies span eight decades and more: rotary inertia of
/// 1e-6 kg·m.
#[test]
fn a_wide_spectrum_has_no_mode_that_is_not_there() {
    for (elements, kind) in [(24, ElementKind::MeanDirectors), (16, ElementKind::Helicoidal)] {
        let mut model = BeamModel::new(Vector3::zeros());
        let section = Section::new([1e6, 1e6, 1e6, 1.0, 1.0, 1.0], [1.0, 1e-6, 1e-6, 0.0]).unwrap();
        common::beam(&mut model, &straight(1.0, elements), section, kind);
        model.clamp(0);
        let mut problem = common::problem(&model, &model.mechanism(), vec![]);
        let found = modes(&mut problem).unwrap();
        let unstable = (0..found.squared.len()).filter(|&k| found.is_unstable(k)).count();
        let (span, residual) = (found.squared.last().unwrap() / found.squared[0], found.residual);
        let orthogonality = found.orthogonality;
        println!(
            "{elements} elements, {kind:?}: ω {:.6} … {:.3e} rad/s, residual {residual:.1e}, \
             orthogonality {orthogonality:.1e}",
            found.omega[0],
            found.omega.last().unwrap()
        );
        assert_eq!((unstable, found.negative), (0, Some(0)), "{:?}", &found.squared[..3]);
        assert!(span > 1e8 && residual < 1e-9 && orthogonality < 1e-6);
        // Euler–Bernoulli: (1.875104)² = 3.516015, twice
        let error = [0, 1].map(|k| (found.omega[k] / 3.516015 - 1.0).abs());
        assert!(error.iter().all(|error| *error < 2e-3), "{error:?}");
    }
}

/// Clamped wires of square section: the frequencies of Euler and Bernoulli whatever the
/// slenderness, two of each.
#[test]
fn modes_of_slender_wires() {
    for slenderness in [1e2, 1e4, 1e6] {
        let side: f64 = 1.0 / slenderness;
        let (e, rho) = (2.1e11, 7850.0);
        let material = Material::from_poisson(e, 0.3, rho).unwrap();
        let profile = Profile::Rectangle { width: side, height: side };
        let section = profile.section(&material, &Stated::default()).unwrap();
        let mut model = BeamModel::new(Vector3::zeros());
        common::beam(&mut model, &straight(1.0, 16), section, ElementKind::Helicoidal);
        model.clamp(0);
        let mut problem = common::problem(&model, &model.mechanism(), vec![]);
        let found = modes(&mut problem).unwrap();
        let unit = (e * side * side / (12.0 * rho)).sqrt(); // √(EI/ρA)/L²
        let exact = [1.875_104_07_f64, 1.875_104_07, 4.694_091_13, 4.694_091_13];
        let error = exact.iter().zip(&found.omega).map(|(k, omega)| omega / (unit * k * k) - 1.0);
        let error: Vec<f64> = error.collect();
        println!("L/h {slenderness:e}: off by {error:?}, residual {:.1e}", found.residual);
        for (error, of_elements) in error.iter().zip([1e-6, 1e-6, 2e-5, 2e-5]) {
            let of_shear = 10.0 * side * side; // and of rotary inertia
            assert!(error.abs() < of_elements + of_shear, "{error:e}");
        }
        assert_eq!(found.negative, Some(0));
    }
}
