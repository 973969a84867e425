use super::*;
use nalgebra::{Vector3, Vector6};
use vi_testkit::Sample;

fn off<const N: usize>(a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, N>) -> f64 {
    (a - b).amax() / b.amax()
}

fn plain() -> Section {
    Section::new([3.0, 4.0, 90.0, 0.4, 0.7, 0.3], [0.1, 2e-3, 1e-3, 0.0]).unwrap()
}

#[test]
fn centers_are_where_forces_make_no_other_strains() {
    let ([x_t, y_t], [x_s, y_s]) = ([0.02, -0.03], [-0.05, 0.04]);
    let section = plain().with_centers([x_t, y_t], [x_s, y_s]).with_mass_center([0.01, 0.06]);
    let strains = |force: [f64; 3], at: [f64; 2]| {
        let [n1, n2, n3] = force;
        let [x, y] = at;
        section.compliance() * Vector6::new(n1, n2, n3, y * n3, -x * n3, x * n2 - y * n1)
    };
    let pulled = strains([0.0, 0.0, 9.0], [x_t, y_t]);
    assert!(pulled.rows(3, 3).amax() < 1e-14, "no curvature: {pulled}");
    let sheared = strains([0.3, -0.2, 0.0], [x_s, y_s]);
    assert!(sheared[5].abs() < 1e-14, "no twist: {sheared}");
    let centers = section.centers();
    let expected = Centers { tension: [x_t, y_t], shear: [x_s, y_s], mass: [0.01, 0.06] };
    let all = |c: &Centers| [c.tension, c.shear, c.mass].concat();
    for (found, stated) in all(&centers).into_iter().zip(all(&expected)) {
        assert!((found - stated).abs() < 1e-13, "{centers:?}");
    }
    let product = section.stiffness_matrix() * section.compliance();
    assert!(off(&product, &Matrix6::identity()) < 1e-11, "{product}");
    // energy of the strains at the centres themselves
    let own = Vector6::new(0.1, -0.2, 0.05, 0.3, 0.4, -0.6);
    let at_centers = Vector6::new(
        own[0] - y_s * own[5],
        own[1] + x_s * own[5],
        own[2] + y_t * own[3] - x_t * own[4],
        own[3],
        own[4],
        own[5],
    );
    let of = |C: Matrix6<f64>, e: &Vector6<f64>| (C * e).dot(e);
    let energies =
        [of(*section.stiffness_matrix(), &own), of(*plain().stiffness_matrix(), &at_centers)];
    assert!((energies[0] / energies[1] - 1.0).abs() < 1e-14, "{energies:?}");
}

#[test]
fn a_turned_section_bends_about_turned_axes() {
    let quarter = plain().turned(std::f64::consts::FRAC_PI_2);
    let expected = [4.0, 3.0, 90.0, 0.7, 0.4, 0.3];
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-14;
    assert!(quarter.stiffness().iter().zip(expected).all(|(a, b)| close(*a, b)), "{quarter:?}");
    assert!(quarter.inertia().iter().zip([0.1, 1e-3, 2e-3]).all(|(a, b)| close(*a, b)));
    // a centre moves along: d_1 becomes d_2
    let moved = plain().with_centers([0.02, 0.0], [0.03, 0.0]).with_mass_center([0.04, 0.0]);
    let moved = moved.turned(std::f64::consts::FRAC_PI_2).centers();
    for (found, x) in [moved.tension, moved.shear, moved.mass].iter().zip([0.02, 0.03, 0.04]) {
        assert!(found[0].abs() < 1e-15 && (found[1] - x).abs() < 1e-15, "{moved:?}");
    }
    assert!(!plain().is_isotropic() && !plain().with_centers([0.0, 0.1], [0.0; 2]).is_isotropic());
    let round = Section::new([3.0, 3.0, 90.0, 0.4, 0.4, 0.3], [0.1, 1e-3, 1e-3, 0.0]).unwrap();
    assert!(round.is_isotropic() && !round.with_mass_center([0.01, 0.0]).is_isotropic());
}

#[test]
fn the_mass_of_velocities_is_that_of_directors() {
    let mut sample = Sample::new(31);
    // points of mass (x, y) in the section
    let points: Vec<[f64; 3]> =
        (0..5).map(|_| [1.0 + 0.5 * sample.number(), sample.number(), sample.number()]).collect();
    let (mut M, mut m) = (Matrix6::zeros(), Matrix4::zeros());
    for [mass, x, y] in points {
        let arm = Vector3::new(x, y, 0.0).cross_matrix();
        let mut B = SMatrix::<f64, 3, 6>::zeros(); // v − arm × ω
        B.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        B.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm));
        M += mass * B.transpose() * B;
        let N = nalgebra::Vector4::new(1.0, x, y, 0.0);
        m += mass * N * N.transpose();
    }
    let (found, miss) = Section::mass_of_velocities(&M).unwrap();
    assert!(off(&found, &m) < 1e-14 && miss < 1e-14, "{found} against {m}, {miss:e}");
    let mut thick = M;
    thick[(5, 5)] *= 0.9;
    let (found, miss) = Section::mass_of_velocities(&thick).unwrap();
    let moments = [found[(1, 1)], found[(2, 2)], found[(3, 3)]];
    assert!((miss - 0.1 / 0.9).abs() < 1e-12 && moments[2] > 0.0, "{miss}, {moments:?}");
    assert!((moments[0] + moments[1] - thick[(5, 5)]).abs() < 1e-13, "J_3 = I_1 + I_2");
    let mut odd = M;
    odd[(1, 5)] += 0.5;
    odd[(5, 1)] += 0.5;
    let refused = Section::mass_of_velocities(&odd).unwrap_err().to_string();
    assert!(refused.starts_with("entry (2, 6) of the mass matrix"), "{refused}");
}

#[test]
fn compliances_and_dampings_add_along_an_element() {
    let soft = plain().with_damping([1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3]).unwrap();
    let stiff = Section::new([30.0, 40.0, 900.0, 4.0, 7.0, 3.0], [0.3, 2e-3, 1e-3, 0.0]).unwrap();
    let mean = Section::mean(&[(0.25, soft), (0.75, stiff)]);
    let C = 1.0 / (0.25 / 0.4 + 0.75 / 4.0);
    assert!((mean.stiffness()[3] / C - 1.0).abs() < 1e-13, "{mean:?}");
    // the same stress in both: only the soft one dissipates, σ² Y
    let V = C * C * 0.25 * 4e-3 / 0.4;
    assert!((mean.viscosity()[(3, 3)] / V - 1.0).abs() < 1e-12, "{mean:?}");
    assert!((mean.inertia()[0] - 0.25).abs() < 1e-15);
    assert_eq!(Section::mean(&[(0.5, soft), (0.5, soft)]), soft);
}

#[test]
fn a_section_without_shear_has_its_compliances_alone() {
    let stiff = Section::new([3e9, 4e9, 90.0, 0.4, 0.7, 0.3], [0.1, 2e-3, 1e-3, 0.0]).unwrap();
    let rigid = Section::rigid_in_shear([90.0, 0.4, 0.7, 0.3], [0.1, 2e-3, 1e-3, 0.0]).unwrap();
    let times = [1e-3; 6];
    let moved = |own: Section| own.with_centers([0.02, 0.1], [0.1, -0.05]).turned(0.4);
    let [stiff, rigid] = [stiff, rigid].map(|own| moved(own.with_damping(times).unwrap()));
    assert!(off(&rigid.compliance(), &stiff.compliance()) < 1e-9);
    let mean = Section::mean(&[(0.5, rigid), (0.5, moved(moved(rigid)))]);
    let Y = |own: &Section| own.compliance() * own.viscosity() * own.compliance();
    assert!(off(&Y(&rigid), &Y(&stiff)) < 1e-7, "{}", off(&Y(&rigid), &Y(&stiff))); // GA/GJ = 1e10
    let half = 0.5 * (Y(&rigid) + Y(&moved(moved(rigid))));
    assert!(off(&Y(&mean), &half) < 1e-9, "{}", off(&Y(&mean), &half));
    assert!(mean.is_rigid_in_shear() && rigid.condition() < 1e5);
}

#[test]
fn matrices_that_cannot_be_are_refused_in_words() {
    let mut C = *plain().stiffness_matrix();
    (C[(3, 5)], C[(5, 3)]) = (0.4, 0.4);
    let m = plain().mass_matrix();
    let refused = Section::general(C, m).unwrap_err().to_string();
    assert_eq!(
        refused,
        "the stiffness matrix of the cross-section is not positive definite: bending about d_1 \
         with twist has negative energy"
    );
    C[(5, 3)] = 0.1;
    let refused = Section::general(C, m).unwrap_err().to_string();
    assert!(refused.contains("entry (4, 6) is 0.4, entry (6, 4) is 0.1"), "{refused}");
    let far = plain().with_mass_center([0.5, 0.0]).mass_matrix();
    let C = *plain().stiffness_matrix();
    assert!(Section::general(C, far).is_ok(), "a centre off the line");
    let mut impossible = far;
    impossible[(1, 1)] -= 0.0021;
    let refused = Section::general(C, impossible).unwrap_err().to_string();
    assert!(refused.contains("about its centre of mass, at (0.5000, 0.0000) m"), "{refused}");
    let negative = plain().with_viscosity(-1e-3 * C).unwrap_err().to_string();
    assert!(negative.contains("damping") && negative.contains("negative energy"), "{negative}");
    let scaled = Section::general(C * 1e6, m).unwrap();
    assert!((scaled.condition() - 1.0).abs() < 1e-9, "{}", scaled.condition());
}
