use nalgebra::Vector3;
use vi_beam::mesh::{FrameRule, Mesh};
use vi_beam::model::BeamModel;
use vi_beam::section::Section;
use vi_beam::statics::*;
use vi_rigid::load::{Load, LoadKind};
#[test]
fn t() {
    let section = Section::new([1e4, 1e4, 1e4, 500., 500., 500.], [1., 10., 10., 0.]).unwrap();
    let mesh =
        Mesh::straight(Vector3::zeros(), 10.0 * Vector3::x(), 16, FrameRule::Normal(Vector3::z()))
            .unwrap();
    let mut m = BeamModel::new(Vector3::zeros());
    let b = m.add_beam("b", &mesh, section).unwrap();
    m.clamp(0);
    let mech = m.mechanism();
    let load = Load::new(
        12 * 16,
        LoadKind::Dead,
        Vector3::zeros(),
        Vector3::z() * 314.15926535897927,
        Default::default(),
    )
    .unwrap();
    let mut p = StaticProblem::new(&m, &mech, vec![load]);
    let path = p.solve(&[1.0], &StaticSettings::default()).unwrap();
    for x in &path.points {
        println!(
            "PT {} {} {} {:?} {}",
            x.factor, x.iterations, x.residual, x.limit, x.strain_energy
        );
    }
    println!("{} {:?}", path.halvings, b);
}
