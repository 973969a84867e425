//! The bound of the highest frequency of a beam, element by element, against the modes of the
//! whole.

use crate::common::{beam, problem};
use nalgebra::Vector3;
use vi_beam::frequency::highest_frequency;
use vi_beam::{BeamMesh, BeamModel, ElementKind, FrameRule, Section};
use vi_statics::modes;

/// The bound lies above the highest frequency of the assembled beam, and close to it.
#[test]
fn the_bound_is_one_and_close() {
    let section = Section::new([1e4, 1e4, 1e4, 500.0, 400.0, 300.0], [1.0, 10.0, 9.0, 0.0]);
    let rule = FrameRule::Normal(Vector3::z());
    let mesh = BeamMesh::straight(Vector3::zeros(), 3.0 * Vector3::x(), 12, rule).unwrap();
    for kind in [ElementKind::MeanDirectors, ElementKind::Helicoidal, ElementKind::SecondOrder] {
        let mut model = BeamModel::new(Vector3::zeros());
        let section = section.clone().unwrap();
        let beam = beam(&mut model, &mesh, section, kind);
        let bound = highest_frequency(&model, &beam, &model.configuration()).omega;
        let mut problem = problem(&model, &model.mechanism(), vec![]);
        let found = modes(&mut problem).unwrap();
        let highest = found.omega[found.omega.len() - 1];
        println!("{kind:?}: highest {highest:.4}, bound {bound:.4} rad/s");
        assert!(bound >= highest * (1.0 - 1e-12) && bound < 1.1 * highest);
    }
}
