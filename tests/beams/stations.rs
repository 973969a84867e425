//! Sections that change along a beam: closed forms of tapers, tables in files, a blade of a wind
//! turbine.
#![allow(clippy::unwrap_used)] // a test

use holonom::model::{Meshes, Model, Stations};
use holonom::modes::{About, ModalAnalysis, ModeKind};
use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use holonom::run::prepare;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;
use vi_testkit::model::{beam, changed, head};

const BLADE: &str = include_str!("../../examples/models/wind_turbine_blade.toml");

/// The lowest frequencies of vibrations, Hz.
fn frequencies(model: &Model, count: usize) -> Vec<f64> {
    let report = ModalAnalysis::new(model, About::Start).unwrap().modes(count).unwrap();
    let vibrations = report.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
    vibrations.map(|mode| mode.omega / TAU).collect()
}

#[test]
fn the_blade_of_the_reference_turbine_has_its_frequencies() {
    let model = Model::from_toml(BLADE).unwrap();
    let found = frequencies(&model, 3);
    // NREL/TP-500-38060, table 9-1, of the rotor: asymmetric flapwise pitch 0.6675 Hz, edgewise
    // 1.0793 Hz
    let published = [0.6675, 1.0793];
    println!("blade: {found:.4?} Hz, published {published:?} Hz of the rotor");
    assert!((found[0] / published[0] - 1.0).abs() < 0.01, "flapwise {}", found[0]);
    assert!((found[1] / published[1] - 1.0).abs() < 0.03, "edgewise {}", found[1]);
    // ∫ rhoA ds by the trapezoidal rule: rhoA is linear between stations
    let Some(Stations::Rows(rows)) = &model.beams[0].stations else { panic!("no stations") };
    let line = |k: usize| rows[k].section.as_ref().unwrap().rho_a.unwrap();
    let pieces =
        (1..rows.len()).map(|k| 0.5 * (line(k) + line(k - 1)) * (rows[k].at - rows[k - 1].at));
    let (mass, found) = (pieces.sum::<f64>(), prepare(&model).unwrap().assembly().measures.mass);
    assert!((found / mass - 1.0).abs() < 1e-12, "{found} kg against {mass} kg");
}

/// A cone that hangs, `EA` in proportion to the square of its radius.
fn cone(elements: usize) -> String {
    let settings = "scheme = \"static\", step = 1.0, end = 1.0";
    let shape = |radius: f64| format!("shape = {{ type = \"circle\", dimensions = [{radius}] }}");
    [
        head("cone", settings),
        beam("cone", &[[0.0; 3], [2.0, 0.0, 0.0]], elements),
        "start = \"clamped\"\nsection = { material = { E = 1e6, nu = 0.3, density = 900.0 } }\n"
            .into(),
        format!("stations = [ {{ at = 0.0, section = {{ {} }} }}, ", shape(0.1)),
        format!("{{ at = 2.0, section = {{ {} }} }} ]\n", shape(0.05)),
        "[[load]]\nname = \"pull\"\nbody = \"cone.end\"\nforce = [10.0, 0.0, 0.0]\n".into(),
    ]
    .concat()
}

#[test]
fn a_cone_is_as_long_as_the_sum_of_its_compliances() {
    // u = F ∫ ds/(E π r²) = F L/(E π r_0 r_1)
    let exact = 10.0 * 2.0 / (1e6 * PI * 0.1 * 0.05);
    let errors: Vec<f64> = [1, 2, 4]
        .into_iter()
        .map(|elements| {
            let mut end = 0.0;
            let mut observe = |sample: &holonom::Sample| {
                end = sample.q[12 * elements] - 2.0;
                Ok(())
            };
            prepare(&Model::from_toml(&cone(elements)).unwrap())
                .unwrap()
                .run(&mut observe, &mut |_, _| {})
                .unwrap();
            end / exact - 1.0
        })
        .collect();
    println!("extension of a cone off by {errors:?} with 1, 2, 4 elements");
    assert!(errors[0].abs() < 2e-3 && errors[1].abs() < errors[0].abs() / 20.0, "{errors:?}");
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("holonom-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The text with its stations in a file.
fn with_file(name: &str) -> String {
    format!("{}stations = \"{name}\"\n", &BLADE[..BLADE.find("stations = [").unwrap()])
}

#[test]
fn tables_in_files_are_the_stations_that_they_state() {
    let folder = folder("stations");
    let stated = Model::from_toml(BLADE).unwrap();
    let Some(Stations::Rows(rows)) = &stated.beams[0].stations else { panic!("no stations") };
    let mut csv = "at,twist,EA,GA1,GA2,EI1,EI2,GJ,rhoA,rhoI1,rhoI2\n".to_owned();
    let mut blade = format!(
        "--- BEAMDYN INDIVIDUAL BLADE INPUT FILE ---\nof a test\n{} station_total - number\n0 damp_type\n\
         mu1 mu2 mu3 mu4 mu5 mu6\n(-)\n0 0 0 0 0 0\n--- DISTRIBUTED PROPERTIES ---\n",
        rows.len()
    );
    let mut points = format!(
        "1 member_total\n{} kp_total - points\n1 49\nkp_xr kp_yr kp_zr initial_twist\n(m) (m) (m) (deg)\n",
        rows.len()
    );
    let mut st = format!("2 sets\n#1 other\n$1 0\n#2 blade\n$1 0\n$2 {}\n", rows.len());
    for row in rows {
        let own = row.section.as_ref().unwrap();
        let numbers =
            [own.ea, own.ga1, own.ga2, own.ei1, own.ei2, own.gj, own.rho_a, own.rho_i1, own.rho_i2];
        let [ea, ga1, ga2, ei1, ei2, gj, line, i1, i2] = numbers.map(Option::unwrap);
        let fields: Vec<String> =
            [ea, ga1, ga2, ei1, ei2, gj, line, i1, i2].iter().map(f64::to_string).collect();
        csv += &format!("{},{},{}\n", row.at, row.twist, fields.join(","));
        blade += &format!("{}\n", row.at / 61.5);
        let (e, g) = (1e10, 1e9);
        let area = ea / e;
        let [r1, r2] = [i1, i2].map(|own: f64| (own / line).sqrt());
        st += &format!(
            "{} {line} 0 0 {r1} {r2} 0 0 {e} {g} {} {} {} {} {} {area} {} 0 0\n",
            row.at,
            ei1 / e,
            ei2 / e,
            gj / g,
            ga1 / (g * area),
            ga2 / (g * area),
            row.twist.to_degrees()
        );
        for diagonal in [[ga1, ga2, ea, ei1, ei2, gj], [line, line, line, i1, i2, i1 + i2]] {
            for i in 0..6 {
                let entry =
                    |j: usize| if i == j { format!("{:e}", diagonal[i]) } else { "0.0".into() };
                blade += &format!("{}\n", (0..6).map(entry).collect::<Vec<_>>().join(" "));
            }
        }
        points += &format!("0.0 0.0 {} {}\n", row.at, -row.twist.to_degrees());
    }
    points += "\"blade.dat\" BldFile - name\n";
    let files =
        [("blade.csv", &csv), ("blade.dat", &blade), ("primary.dat", &points), ("blade.st", &st)];
    for (name, text) in files {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let expected = frequencies(&stated, 4);
    for name in ["blade.csv", "primary.dat"] {
        let read = Model::from_toml_in(&with_file(name), &[], Meshes::in_folder(&folder)).unwrap();
        let found = frequencies(&read, 4);
        println!("{name}: {found:.6?} Hz");
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{name}: {found} against {expected} Hz");
        }
        let again = Model::from_toml(&read.to_toml()).unwrap();
        assert_eq!(again.beams, read.beams, "{name}: the resolved model names no file");
    }
    // the axes are turned in the sections, the beam is not twisted
    let read = Model::from_toml_in(&with_file("blade.st#2$2"), &[], Meshes::in_folder(&folder));
    let found = frequencies(&read.unwrap(), 4);
    println!("blade.st: {found:.6?} Hz");
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found / expected - 1.0).abs() < 2e-3, "{found} against {expected} Hz");
    }
    // the blade file alone has no twist: d_1 stays that of `normal`
    let read =
        Model::from_toml_in(&with_file("blade.dat"), &[], Meshes::in_folder(&folder)).unwrap();
    let triad = |model: &Model| -> Matrix3<f64> { model.beams[0].meshes().unwrap()[0].triads[0] };
    let turned = Rotation3::from_axis_angle(&Vector3::x_axis(), rows[0].twist);
    let off = (triad(&stated) - turned.into_inner() * triad(&read)).amax();
    assert!(off < 1e-12, "the root is twisted by 13.3° about −z of the blade: {off:e}");
    let missing = Model::from_toml_in(&with_file("none.csv"), &[], Meshes::in_folder(&folder));
    let message = missing.unwrap_err().to_string();
    assert!(message.contains("none.csv"), "{message}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn stations_that_cannot_be_are_refused() {
    let refused = |from: &str, to: &str| {
        Model::from_toml(&changed(&cone(2), from, to)).unwrap_err().to_string()
    };
    let cases = [
        (refused("at = 2.0", "at = 1.9"), "the stations end at 1.9 m, the beam at 2 m"),
        (refused("at = 0.0", "at = 0.1"), "the stations end at 0.1 m, the beam at 0 m"),
        (refused("dimensions = [0.05]", "dimensions = [-0.05]"), "not positive"),
        (
            refused(
                "type = \"circle\", dimensions = [0.05]",
                "type = \"rectangle\", dimensions = [0.1, 0.1]",
            ),
            "the stations before and after state different keys or shapes",
        ),
        (refused("{ at = 2.0", "{ at = 2.0, twist = 0.1, section = {} }, { at = 2.0"), "lacks"),
    ];
    for (message, expected) in cases {
        assert!(message.contains(expected), "{message}");
    }
}

/// One element without shear under a small load per length across it.
fn under_line_load(frame: &str) -> Model {
    let settings = "scheme = \"static\", step = 1.0, end = 1.0";
    let section = "section = { EA = 1e5, EI1 = 2.0, EI2 = 3.0, GJ = 1.0, rhoA = 1.0, rhoI1 = 1e-4, rhoI2 = 1e-4 }\n";
    let text = [
        head("bent", settings),
        beam("beam", &[[0.0; 3], [1.0, 0.0, 0.0]], 1),
        format!("normal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\n{section}"),
        format!("[[load]]\nname = \"line\"\nbeam = \"beam\"\nforce = {frame}\n"),
    ];
    Model::from_toml(&text.concat()).unwrap()
}

#[test]
fn a_load_along_one_element_bends_it_as_the_beam_does() {
    // q L⁴/8EI about d_1 = z, and the same pressure that follows: d_2 = −y
    for force in ["[0.0, 8e-5, 0.0]", "[0.0, -8e-5, 0.0]\nframe = \"body\""] {
        let mut end = 0.0;
        let mut observe = |sample: &holonom::Sample| {
            end = sample.q[13];
            Ok(())
        };
        prepare(&under_line_load(force)).unwrap().run(&mut observe, &mut |_, _| {}).unwrap();
        let exact = 8e-5 / (8.0 * 2.0);
        println!("{force}: {end:e} m against {exact:e} m");
        assert!((end / exact - 1.0).abs() < 1e-6, "{force}: {end} against {exact}");
    }
}

/// A cantilever of 1 m with a force across its end, `EI1 = 2`, `EI2 = 3` N·m².
fn without_shear(element: &str) -> Result<Model, holonom::ModelError> {
    let text = [
        head("bent", "scheme = \"static\", step = 1.0, end = 1.0"),
        beam("beam", &[[0.0; 3], [1.0, 0.0, 0.0]], 2),
        format!("element = \"{element}\"\nnormal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\n"),
        "section = { EA = 1e5, EI1 = 2.0, EI2 = 3.0, GJ = 1.0, rhoA = 1.0, rhoI1 = 1e-4, rhoI2 = 1e-4 }\n".into(),
        "[[load]]\nname = \"push\"\nbody = \"beam.end\"\nforce = [0.0, 4e-4, 6e-4]\n".into(),
    ]
    .concat();
    Model::from_toml(&text)
}

#[test]
fn a_section_without_shear_bends_as_euler_and_bernoulli_say() {
    let mut end = [0.0; 2];
    let mut observe = |sample: &holonom::Sample| {
        end = [sample.q[25], sample.q[26]];
        Ok(())
    };
    let model = without_shear("helicoidal").unwrap();
    prepare(&model).unwrap().run(&mut observe, &mut |_, _| {}).unwrap();
    // F L³/3EI: along y about d_1 = z, along z about d_2 = −y
    let exact = [4e-4 / (3.0 * 2.0), 6e-4 / (3.0 * 3.0)];
    for (found, exact) in end.iter().zip(exact) {
        println!("deflection {found:e} m against {exact:e} m");
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} against {exact}");
    }
    let refused = without_shear("mean_directors").unwrap_err().to_string();
    assert!(refused.contains("lacks GA1, GA2"), "{refused}");
}
