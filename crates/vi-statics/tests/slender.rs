//! Slender beams: Newton's method where the axial stiffness is far above that of bending.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{center_of, dead, straight};
use nalgebra::Vector3;
use vi_beam::element::ElementKind;
use vi_beam::{BeamModel, Section};
use vi_statics::{StaticProblem, StaticSettings};

/// Tip deflection of the elastica of length 1 under `P = EI/L²`.
const ELASTICA: f64 = 0.301_720_774;

/// A square wire of length 1, `h = 1/slenderness`, clamped, under a transverse force `EI/L²`.
fn wire(kind: ElementKind, slenderness: f64, elements: usize) -> StaticProblem {
    let h = 1.0 / slenderness;
    let (e, area, second) = (2.1e11, h * h, h.powi(4) / 12.0);
    let (ga, ea, ei) = (e / 2.6 * 5.0 / 6.0 * area, e * area, e * second);
    let rho = [1.0, 1e-4 * h * h, 1e-4 * h * h, 0.0];
    let section = Section::new([ga, ga, ea, ei, ei, 0.65 * ei], rho).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("wire", &straight(1.0, elements), section).unwrap();
    let q = model.configuration();
    model.elements.set_strains(beam.elements.clone(), kind, &q).unwrap();
    model.clamp(beam.nodes.start);
    let load = dead(beam.nodes.end - 1, ei * Vector3::z());
    common::problem(&model, &model.mechanism(), vec![load])
}

#[test]
fn a_slender_wire_bends_as_the_elastica() {
    println!("L/h, elements' strains: iterations of two steps, tip");
    for kind in [ElementKind::MeanDirectors, ElementKind::SecondOrder, ElementKind::Helicoidal] {
        for slenderness in [1e2, 1e4, 5e4, 1e6] {
            let mut problem = wire(kind, slenderness, 16);
            let settings = StaticSettings { first_step: 1.0, ..StaticSettings::default() };
            let path = problem.solve(&[0.5, 1.0], &settings).unwrap();
            let iterations: usize = path.points.iter().map(|point| point.iterations).sum();
            let q = problem.configuration();
            let tip = center_of(q, 16).z;
            println!(
                "{slenderness:.0e} {kind:?}: {iterations} in {} steps, {tip:.7}",
                path.points.len()
            );
            let allowed = match kind {
                ElementKind::Helicoidal if slenderness > 1e3 => 1e-6,
                ElementKind::Helicoidal => 3e-5, // true shear
                _ => 3e-4,
            };
            assert!((tip - ELASTICA).abs() < allowed, "{slenderness:e}, {kind:?}: {tip}");
            let most = if slenderness > 1e5 { 14 } else { 10 };
            assert!(iterations <= most && path.points.len() == 2, "{iterations}");
        }
    }
}
